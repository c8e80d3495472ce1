//! Schemas of a log's messages (JSON Schema): the fields of a scene by the names of its parts, with units in their descriptions, as Foxglove
//! shows them.

use crate::scene_names::SceneNames;
use serde_json::{Map, Value, json};

/// Schema of `/step`.
pub(super) fn step(names: &SceneNames) -> Value {
    let device = || {
        object(
            "Device: input and output of the step",
            [
                ("present", boolean("Whether the device is active")),
                ("suspended", boolean("Whether it is silent for now; absent when it is not")),
                ("position", xyz("Interface point at the end of the step [m, world]")),
                ("force", xyz("Reaction force on the hand, held over the step [N, world]")),
                ("proxy", xyz("Proxy at the end of the step [m, world]: held point, or centre of the tip")),
                ("holds", held_point("Held point; absent in other modes")),
                (
                    "exerts",
                    object(
                        "Prescribed force; absent in other modes",
                        [
                            ("on", held_point("Point that it acts on")),
                            ("force", xyz("Force on the object, held over the step [N, world]")),
                        ],
                    ),
                ),
            ],
        )
    };
    let body = || {
        object(
            "Object at the end of the step",
            [
                ("pose", pose("Placement; position of the centre of mass [m, world]")),
                ("velocity", xyz("Velocity of the centre of mass [m/s, world]")),
                ("angular_velocity", xyz("Angular velocity [rad/s, world]")),
                ("penetration_m", number("Largest penetration of its contacts [m], not negative")),
            ],
        )
    };
    let clamp = || {
        object(
            "Clamp",
            [
                ("frame", pose("Frame at the end of the step [m, world]")),
                ("force", xyz("Reaction force on the clamp, held over the step [N, world]")),
                ("torque", xyz("Reaction torque on the clamp about the origin of its frame [N·m, world]")),
            ],
        )
    };
    let base = || xyz("Position that the base goes to, of the centre of mass at rest [m, world]");
    let obstacle = || pose("Pose of the plane or obstacle at the end of the step [m, world]");
    let energies = [
        ("kinetic", number("Kinetic energy of rigid motion and modes [J]")),
        ("elastic", number("Elastic energy of the modes [J]")),
        ("residual", number("Elastic energy of the residual compliance [J]")),
        ("potential", number("Potential energy in the gravity field [J]")),
        ("coupling", number("Elastic energy of virtual couplings [J]")),
        ("input", number("Work on the objects since the start [J]")),
        ("dissipated", number("Energy dissipated by damping since the start [J]")),
        ("friction", number("Energy dissipated by friction since the start [J]")),
        ("impact", number("Energy dissipated by impact since the start [J]")),
    ];
    let status = [
        ("residual_m", number("Largest residual of a contact's law [m]")),
        ("unsolved", integer("Islands whose contacts were not solved [1]")),
        ("dropped", integer("Contacts dropped beyond the limit of an object [1]")),
        ("rejected", integer("Inputs that could not be used [1]")),
    ];
    let timing = [
        ("tick", integer("Tick of the force process's clock [1]")),
        ("late_us", number("Delay of the cycle after its deadline [µs]")),
        ("compute_us", number("Compute time of the cycle [µs]")),
    ];
    titled(
        "palpate.Step",
        object(
            "Step: input, output and timing",
            [
                ("step", integer("Number of the step, from 1")),
                ("devices", named("Devices by name", &names.devices, device)),
                ("obstacles", named("Planes and obstacles by name", &names.obstacles, obstacle)),
                ("clamps", named("Clamps by name", &names.clamps, clamp)),
                ("bases", named("Bases that move, by the names of their objects", &names.objects, base)),
                ("gravity", xyz("Gravity over the step, where it changes in time [m/s², world]")),
                ("objects", named("Objects by name", &names.objects, body)),
                ("energy", object("Energy ledger of the scene", energies)),
                ("status", object("Status of the step: what it could not do", status)),
                ("timing", object("Timing of the cycle", timing)),
            ],
        ),
    )
}

/// Schema of `/contacts`.
pub(super) fn contacts() -> Value {
    let contact = object(
        "Contact",
        [
            ("object", text("Name of the object")),
            ("against", text("Name of the device, plane, obstacle or object that it touches")),
            ("point", xyz("Point on the object's surface at the end of the step [m, world]")),
            ("normal", xyz("Unit normal, out of the object [1, world]")),
            ("force", xyz("Force on the object, held over the step [N, world]")),
            ("gap", number("Gap at the end of the step [m], negative when penetrating")),
            ("slip_speed", number("Mean slip speed over the step [m/s]")),
        ],
    );
    let list = json!({ "type": "array", "description": "Contacts that carry force", "items": contact });
    titled("palpate.Contacts", object("Contacts of a step", [("contacts", list)]))
}

/// Schema of `/modes`.
pub(super) fn modes(names: &SceneNames) -> Value {
    let coordinates = || {
        let coordinate = number("Modal coordinate q of mass-normalised modes [m·√kg]");
        json!({ "type": "array", "description": "Modal coordinates q [m·√kg], by ascending frequency", "items": coordinate })
    };
    titled("palpate.Modes", named("Modal coordinates of the objects by name", &names.objects, coordinates))
}

fn titled(title: &str, mut schema: Value) -> Value {
    schema["title"] = title.into();
    schema
}

fn object<const N: usize>(description: &str, fields: [(&str, Value); N]) -> Value {
    let properties: Map<String, Value> =
        fields.into_iter().map(|(name, schema)| (name.to_owned(), schema)).collect();
    json!({ "type": "object", "description": description, "properties": properties })
}

/// Number of parts of a kind up to which each has a field: schemas of more say what all are.
const MOST_NAMES: usize = 64;

/// Object with a field for each part of a scene.
fn named(description: &str, names: &[String], schema: impl Fn() -> Value) -> Value {
    if names.len() > MOST_NAMES {
        return json!({ "type": "object", "description": description, "additionalProperties": schema() });
    }
    let properties: Map<String, Value> = names.iter().map(|name| (name.clone(), schema())).collect();
    json!({ "type": "object", "description": description, "properties": properties })
}

fn scalar(kind: &str, description: &str) -> Value {
    json!({ "type": kind, "description": description })
}

fn number(description: &str) -> Value {
    scalar("number", description)
}

fn integer(description: &str) -> Value {
    scalar("integer", description)
}

fn boolean(description: &str) -> Value {
    scalar("boolean", description)
}

fn text(description: &str) -> Value {
    scalar("string", description)
}

/// Vector whose components have the description of the whole.
fn xyz(description: &str) -> Value {
    let component = || number(description);
    object(description, [("x", component()), ("y", component()), ("z", component())])
}

fn pose(description: &str) -> Value {
    let part = || number("Part of the unit quaternion from body to world [1]");
    object(
        description,
        [
            ("position", xyz("Position of the frame's origin [m, world]")),
            (
                "orientation",
                object(
                    "Rotation from body to world, a unit quaternion [1]",
                    [("x", part()), ("y", part()), ("z", part()), ("w", part())],
                ),
            ),
        ],
    )
}

fn held_point(description: &str) -> Value {
    let weights =
        json!({ "type": "array", "description": "Barycentric weights [1]", "items": number("Weight [1]") });
    object(
        description,
        [
            ("object", integer("Number of the object, from 0")),
            ("triangle", integer("Triangle of its surface, from 0")),
            ("weights", weights),
        ],
    )
}

//! Pointer devices for scenes that have none.

use palpate::{ModelObject, Recording};
use toml::{Table, Value};

/// Number of added pointers.
const POINTERS: usize = 4;

/// Keys that say what moves a device.
const MOVERS: [&str; 5] = ["path", "driver", "linked", "simulated", "pointer"];

/// Scene with its pointers.
pub(super) struct WithPointers {
    pub(super) text: String,
    /// Names of pointers whose size nobody has chosen.
    pub(super) added: Vec<String>,
}

/// Scene with pointers; none if it has some. Tips that nothing moves become pointers. Without any, four are added: they are appended, so
/// that line numbers stay.
pub(super) fn with_pointers(text: &str, objects: &[ModelObject]) -> Option<WithPointers> {
    let mut scene: Table = text.parse().ok()?;
    let mut is_changed = false;
    let devices = scene.get_mut("device").and_then(Value::as_array_mut).into_iter().flatten();
    for device in devices.filter_map(Value::as_table_mut).filter(|device| is_unmoved_tip(device)) {
        for denied in MOVERS {
            device.remove(denied);
        }
        device.insert("pointer".into(), Value::Boolean(true));
        is_changed = true;
    }
    if is_changed {
        return Some(WithPointers { text: scene.to_string(), added: Vec::new() });
    }
    let entries = |kind: &str| scene.get(kind).and_then(Value::as_array).into_iter().flatten();
    if entries("device").any(|device| device.get("pointer").and_then(Value::as_bool) == Some(true)) {
        return None;
    }
    let named = ["object", "device", "plane", "obstacle"].into_iter().flat_map(entries);
    let taken: Vec<&str> = named.filter_map(|entry| entry.get("name")?.as_str()).collect();
    let names = (1..).map(|number| format!("finger{number}")).filter(|name| !taken.contains(&name.as_str()));
    let added: Vec<String> = names.take(POINTERS).collect();
    let fingers = fingers(added.clone(), objects)?;
    let table = Table::from_iter([("device".to_string(), Value::Array(fingers.clone()))]);
    let longer = format!("{}\n\n{table}", text.trim_end());
    if longer.parse::<Table>().is_ok() {
        return Some(WithPointers { text: longer, added });
    }
    // An inline array of devices cannot be continued further down.
    scene.entry("device").or_insert_with(|| Value::Array(Vec::new())).as_array_mut()?.extend(fingers);
    Some(WithPointers { text: scene.to_string(), added })
}

/// Whether a device is a tip that a program would move.
fn is_unmoved_tip(device: &Table) -> bool {
    let is_touch = device.get("mode").and_then(Value::as_str) == Some("touch");
    let moves = |key: &&str| device.get(*key).is_some_and(|value| value.as_bool() != Some(false));
    is_touch && !MOVERS.iter().any(moves)
}

/// Pointer devices of a size and stiffness for the smallest object.
fn fingers(names: Vec<String>, objects: &[ModelObject]) -> Option<Vec<Value>> {
    let size = |recording: &Recording| recording.surface.radius();
    let recordings = objects.iter().map(|object| &*object.recording);
    let recording = recordings.min_by(|a, b| size(a).total_cmp(&size(b)))?;
    let radius = size(recording);
    // Stiffness m·ω² of the lowest mode: about that of the whole object. Damping ratio 0.1.
    let omega = recording.modes.angular_frequencies.first().copied().unwrap_or(50.0);
    let coupling = Table::from_iter([
        ("stiffness".to_string(), Value::Float(recording.mass() * omega * omega)),
        ("damping".to_string(), Value::Float(0.2 * recording.mass() * omega)),
    ]);
    let finger = |name: String| {
        Value::Table(Table::from_iter([
            ("name".to_string(), Value::String(name)),
            ("mode".to_string(), Value::String("touch".into())),
            ("pointer".to_string(), Value::Boolean(true)),
            ("tip_radius".to_string(), Value::Float(0.08 * radius)),
            ("patch_radius".to_string(), Value::Float(0.15 * radius)),
            ("friction".to_string(), Value::Float(0.8)),
            ("coupling".to_string(), Value::Table(coupling.clone())),
        ]))
    };
    Some(names.into_iter().map(finger).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use palpate_testkit::{free_block, object_at};

    #[test]
    fn fingers_stand_below_what_is_there_and_have_names_of_their_own() {
        let objects = [object_at(&free_block(), DVec3::ZERO, DVec3::ZERO)];
        let names = |text: &str| -> Vec<String> {
            let scene: Table = text.parse().expect("TOML");
            let devices = scene["device"].as_array().expect("devices");
            devices.iter().map(|device| device["name"].as_str().expect("a name").to_string()).collect()
        };
        let text =
            "# mine\n[[object]]\nname = \"finger2\"\n[[device]]\nname = \"left\"\n[[plane]]\nname = \"a\"\n";
        let WithPointers { text: longer, added } = with_pointers(text, &objects).expect("fingers");
        assert!(longer.starts_with(text), "{longer}");
        assert_eq!(added, ["finger1", "finger3", "finger4", "finger5"]);
        assert_eq!(names(&longer), ["left", "finger1", "finger3", "finger4", "finger5"]);
        assert!(with_pointers(&longer, &objects).is_none(), "there are some");
        let list = "device = [{ name = \"left\" }]\n";
        let longer = with_pointers(list, &objects).expect("fingers").text;
        assert_eq!(names(&longer), ["left", "finger1", "finger2", "finger3", "finger4"]);
    }

    #[test]
    fn tips_that_nothing_moves_become_pointers() {
        let objects = [object_at(&free_block(), DVec3::ZERO, DVec3::ZERO)];
        let text = "[[device]]\nname = \"tip\"\nmode = \"touch\"\nlinked = false\ntip_radius = 0.01\n\
                    [[device]]\nname = \"far\"\nmode = \"touch\"\nlinked = true\n\
                    [[device]]\nname = \"hand\"\nmode = \"held\"\n";
        let WithPointers { text, added } = with_pointers(text, &objects).expect("a pointer");
        assert!(added.is_empty());
        let scene: Table = text.parse().expect("TOML");
        let devices = scene["device"].as_array().expect("devices");
        let pointer = |at: usize| devices[at].get("pointer").and_then(Value::as_bool);
        assert_eq!([pointer(0), pointer(1), pointer(2)], [Some(true), None, None]);
        assert_eq!(devices[0]["tip_radius"].as_float(), Some(0.01));
        assert_eq!(devices[0].get("linked"), None, "a pointer is not linked");
        assert!(with_pointers(&text, &objects).is_none(), "there is one");
    }
}

//! `[[device]]`: devices that hold a point or prescribe a force on it, and tips that touch.

use super::coupling;
use super::drivers::{read_motion_limits, read_real, read_simulated};
use super::keys::{AttachEntry, DeviceEntry};
use super::places::surface_point;
use super::source::{DeviceMover, Quantity, Source};
use crate::error::{SceneError, SceneErrorKind};
use crate::scene::{Scene, SceneDevice};
use crate::warning::{Warning, WarningKind};
use glam::DVec3;
use palpate::{
    AppliedForce, Coupling, DeviceMode, DeviceParameters, Grasp, ModelObject, ResponseForm, Surface,
};
use palpate_haptics::{Columns, MotionLimits};
use toml::Spanned;

/// Distance of a device's start from its held point that gets a warning, as a share of the diagonal.
const FAR_START: f64 = 0.01;

/// Patch radii, in edges around them, below which quadratic and linear elements are too stiff by more than 2 to 3 % (measured,
/// docs/contact.md).
const SMOOTH_PATCH: f64 = 3.0;
const SMOOTH_PATCH_LINEAR: f64 = 6.0;

/// Share of a surface's area with longer edges that gets no warning: a few long triangles are no coarse place.
const COARSE_SHARE: f64 = 0.05;

/// Parameters of a device for the model, with a check of keys that exclude one another.
pub(super) fn read_parameters(source: &Source, device: &DeviceEntry) -> Result<DeviceParameters, SceneError> {
    let coupling = match device.coupling.as_ref() {
        Some(choice) => coupling::read_gains(source, choice)?,
        None => None,
    };
    match (device.mode.get_ref().as_str(), &device.attach) {
        ("held", Some(_)) => {
            refuse_touch_keys(source, device)?;
            Ok(DeviceParameters { coupling, ..DeviceParameters::default() })
        }
        ("held", None) => source.fail(
            device.mode.span(),
            SceneErrorKind::Missing,
            "attach",
            "mode = \"held\" needs attach = { object = \"…\", point = [x, y, z] }, the point that the device holds",
        ),
        ("force", Some(_)) => force_parameters(source, device),
        ("force", None) => source.fail(
            device.mode.span(),
            SceneErrorKind::Missing,
            "attach",
            "mode = \"force\" needs attach = { object = \"…\", point = [x, y, z] }, the point that the force acts on",
        ),
        ("touch", None) => touch_parameters(source, device, coupling),
        ("touch", Some(attach)) => source.fail(
            attach.span(),
            SceneErrorKind::Conflict,
            "attach",
            "attach is of a device that holds a point; with mode = \"touch\" leave it out",
        ),
        (other, _) => {
            let message = format!("mode is {other:?}, expected \"held\", \"touch\" or \"force\"");
            source.fail(device.mode.span(), SceneErrorKind::UnknownValue, "mode", message)
        }
    }
}

/// Device with its held point and its path.
pub(super) fn read_device(
    source: &Source,
    device: &DeviceEntry,
    parameters: DeviceParameters,
    objects: &[ModelObject],
    object_names: &[String],
    warnings: &mut Vec<Warning>,
) -> Result<SceneDevice, SceneError> {
    let mode = match &device.attach {
        Some(attach) => {
            let grasp = read_grasp(source, device, attach.get_ref(), objects, object_names)?;
            if is_force(device) {
                return read_force(source, device, (grasp, parameters), objects, object_names, warnings);
            }
            DeviceMode::Held(grasp)
        }
        None => DeviceMode::Touch,
    };
    let linked = device.linked.as_ref().filter(|linked| *linked.get_ref());
    if let (Some(linked), true) = (linked, device.path.is_some() || device.simulated.is_some()) {
        return source.fail(
            linked.span(),
            SceneErrorKind::Conflict,
            "linked",
            "a linked device has its path, or its hand, in the process that it is in: leave path and simulated out",
        );
    }
    let pointer = device.pointer.as_ref().filter(|pointer| *pointer.get_ref());
    if let Some(pointer) = pointer {
        refuse_other_hands(source, device, pointer)?;
    }
    let real = read_real(source, device)?;
    let path = match (&device.path, linked.or(pointer)) {
        (None, None) if real.is_none() && source.mover == DeviceMover::Nobody => {
            return source.fail(
                device.name.span(),
                SceneErrorKind::Missing,
                "path",
                "the device needs path = { file = \"…\" }, driver = { kind = \"…\" } if it is a real one, linked = true if it is \
                 in another process, or pointer = true if it is a pointer of the viewer",
            );
        }
        (entry, _) => entry.as_ref().map(|entry| source.motion_path(entry, Columns::Position)).transpose()?,
    };
    let simulated = device.simulated.as_ref().map(|entry| read_simulated(source, entry)).transpose()?;
    let (pointer, motion_limits) = (pointer.is_some(), read_motion_limits(source, device)?);
    let name = device.name.get_ref().clone();
    let device = SceneDevice { name, mode, parameters, path, simulated, real, motion_limits, pointer };
    warnings.extend(far_start(&device, objects));
    warnings.extend(small_patches(&device, objects, object_names));
    Ok(device)
}

/// Device that prescribes a force.
fn read_force(
    source: &Source,
    device: &DeviceEntry,
    (grasp, parameters): (Grasp, DeviceParameters),
    objects: &[ModelObject],
    object_names: &[String],
    warnings: &mut Vec<Warning>,
) -> Result<SceneDevice, SceneError> {
    if device.path.is_none() && source.mover == DeviceMover::Nobody {
        return source.fail(
            device.name.span(),
            SceneErrorKind::Missing,
            "path",
            "mode = \"force\" needs path = { file = \"…\" } with the columns t,fx,fy,fz: the force on the object in world axes [N]",
        );
    }
    let path = device.path.as_ref().map(|entry| source.motion_path(entry, Columns::Force)).transpose()?;
    let force = path.as_ref().map_or(DVec3::ZERO, |path| path.at(0.0).position);
    let applied = AppliedForce { grasp, force };
    let device = SceneDevice {
        name: device.name.get_ref().clone(),
        mode: DeviceMode::Force(applied),
        parameters,
        path,
        simulated: None,
        real: None,
        motion_limits: MotionLimits::default(),
        pointer: false,
    };
    let touched = grasp.object..grasp.object + 1;
    warnings.extend(small_patches(&device, &objects[touched.clone()], &object_names[touched]));
    Ok(device)
}

fn is_force(device: &DeviceEntry) -> bool {
    device.mode.get_ref() == "force"
}

/// Parameters of a device that prescribes a force; other keys of devices are refused.
fn force_parameters(source: &Source, device: &DeviceEntry) -> Result<DeviceParameters, SceneError> {
    let refused = [
        ("tip_radius", device.tip_radius.as_ref().map(Spanned::span)),
        ("friction", device.friction.as_ref().map(Spanned::span)),
        ("coupling", device.coupling.as_ref().map(Spanned::span)),
        ("linked", device.linked.as_ref().map(Spanned::span)),
        ("pointer", device.pointer.as_ref().map(Spanned::span)),
        ("simulated", device.simulated.as_ref().map(|simulated| simulated.device.span())),
        ("driver", device.driver.as_ref().map(Spanned::span)),
        ("mount", device.mount.as_ref().map(Spanned::span)),
        ("limits", device.limits.as_ref().map(Spanned::span)),
    ];
    if let Some((key, span)) = refused.into_iter().find_map(|(key, span)| Some((key, span?))) {
        let message =
            format!("{key} is of a hand; with mode = \"force\" the path is the force: leave it out");
        return source.fail(span, SceneErrorKind::Conflict, key, message);
    }
    let length = |number| source.not_negative(number, Quantity::length("patch_radius"));
    let patch_radius = device.patch_radius.as_ref().map_or(Ok(0.0), length)?;
    Ok(DeviceParameters { patch_radius, ..DeviceParameters::default() })
}

/// Checks that a pointer has no other source of motion and no held point.
fn refuse_other_hands(
    source: &Source,
    device: &DeviceEntry,
    pointer: &Spanned<bool>,
) -> Result<(), SceneError> {
    let other = device.path.is_some() || device.simulated.is_some() || device.driver.is_some();
    if other || device.linked.is_some() {
        return source.fail(
            pointer.span(),
            SceneErrorKind::Conflict,
            "pointer",
            "a pointer is where the viewer's page says: leave path, simulated, driver and linked out",
        );
    }
    match &device.attach {
        Some(attach) => source.fail(
            attach.span(),
            SceneErrorKind::Conflict,
            "attach",
            "a pointer holds what it is pressed on: leave attach out, and say mode = \"touch\"",
        ),
        None => Ok(()),
    }
}

fn touch_parameters(
    source: &Source,
    device: &DeviceEntry,
    coupling: Option<Coupling>,
) -> Result<DeviceParameters, SceneError> {
    let length = |key, number| source.not_negative(number, Quantity::length(key));
    let tip_radius = device.tip_radius.as_ref().map_or(Ok(0.0), |number| length("tip_radius", number))?;
    let patch_radius =
        device.patch_radius.as_ref().map_or(Ok(tip_radius), |number| length("patch_radius", number))?;
    let friction = source.friction(device.friction.as_ref())?;
    Ok(DeviceParameters { tip_radius, patch_radius, friction, coupling })
}

/// Checks that a held point has no keys of a tip.
fn refuse_touch_keys(source: &Source, device: &DeviceEntry) -> Result<(), SceneError> {
    let keys = [
        ("tip_radius", &device.tip_radius),
        ("patch_radius", &device.patch_radius),
        ("friction", &device.friction),
    ];
    for (key, number) in keys {
        if let Some(number) = number {
            return source.fail(
                number.span(),
                SceneErrorKind::Conflict,
                key,
                format!("{key} is of a device that touches; with mode = \"held\" leave it out"),
            );
        }
    }
    Ok(())
}

/// Material point that a device holds.
fn read_grasp(
    source: &Source,
    device: &DeviceEntry,
    attach: &AttachEntry,
    objects: &[ModelObject],
    object_names: &[String],
) -> Result<Grasp, SceneError> {
    let (name, wanted) = (device.name.get_ref(), attach.object.get_ref());
    let grasp = surface_point(source, (&attach.object, &attach.point), objects, object_names)?;
    let ModelObject { recording, response, .. } = &objects[grasp.object];
    match response {
        ResponseForm::Modal if !recording.is_movable(&grasp.point) => {
            return source.fail(
                attach.point.span(),
                SceneErrorKind::Grasp,
                "point",
                format!("the point of {name:?} lies on fixed nodes of {wanted:?}: no hand can move it; hold one that is farther from them"),
            );
        }
        ResponseForm::Modal => {}
        ResponseForm::Fir(table) => {
            if let Err(error) = table.prepare(&recording.surface, &grasp.point) {
                let message = format!("device {name:?} on {wanted:?}: {error}");
                return source.fail(attach.point.span(), SceneErrorKind::Table, "point", message);
            }
        }
    }
    Ok(grasp)
}

/// Loads what the devices need of recorded tables beyond their points.
pub(super) fn prepare(source: &Source, entries: &[DeviceEntry], scene: &Scene) -> Result<(), SceneError> {
    for (number, (entry, device)) in entries.iter().zip(&scene.devices).enumerate() {
        if let Err(error) = scene.prepare_device(number, &device.mode) {
            let message = format!("device {:?}: {error}", device.name);
            return source.fail(entry.name.span(), error.kind, "table", message);
        }
    }
    Ok(())
}

/// Checks that no two devices hold the same point: no force could satisfy both.
pub(super) fn check_grasps(
    source: &Source,
    entries: &[DeviceEntry],
    devices: &[SceneDevice],
) -> Result<(), SceneError> {
    for (at, (device, entry)) in devices.iter().zip(entries).enumerate() {
        let is_held = matches!(device.mode, DeviceMode::Held(_));
        let holds = |other: &&SceneDevice| other.mode == device.mode && is_held;
        if let (Some(other), Some(attach)) = (devices[..at].iter().find(holds), &entry.attach) {
            return source.fail(
                attach.get_ref().point.span(),
                SceneErrorKind::Grasp,
                "point",
                format!("device {:?} holds the same point as {:?}", device.name, other.name),
            );
        }
    }
    Ok(())
}

fn far_start(device: &SceneDevice, objects: &[ModelObject]) -> Option<Warning> {
    let DeviceMode::Held(grasp) = device.mode else { return None };
    let ModelObject { recording, start, .. } = &objects[grasp.object];
    let held = start.pose.world_from_body(recording.surface.rest_position(&grasp.point));
    let distance = (device.path.as_ref()?.at(0.0).position - held).length();
    let pulled = match device.parameters.coupling {
        None => "the point is pulled there in the first step",
        Some(_) => "the coupling pulls it there from the first step on",
    };
    (distance > FAR_START * recording.surface.diagonal()).then(|| {
        let message =
            format!("device {:?} starts {distance:.4} m from the point that it holds: {pulled}", device.name);
        Warning::new(WarningKind::FarStart, &device.name, message)
    })
}

fn small_patches(device: &SceneDevice, objects: &[ModelObject], names: &[String]) -> Vec<Warning> {
    let radius = device.parameters.patch_radius;
    objects
        .iter()
        .zip(names)
        .filter_map(|(object, name)| {
            let edges =
                if object.recording.metadata.mesh.order == 2 { SMOOTH_PATCH } else { SMOOTH_PATCH_LINEAR };
            let local = match &object.recording.embedding {
                Some(embedding) => vec![(embedding.mean_edge, 1.0)],
                None => local_edges(&object.recording.surface),
            };
            let area_above = |edge: f64| local.iter().filter(|(own, _)| *own > edge).map(|(_, area)| area).sum::<f64>();
            let share = area_above(radius / edges) / area_above(0.0);
            (radius > 0.0 && share > COARSE_SHARE).then(|| {
                // The last edge above which there is more than that share.
                let enough = local.partition_point(|(own, _)| area_above(*own) > COARSE_SHARE * area_above(0.0));
                let smooth = edges * local.get(enough).map_or(0.0, |(own, _)| *own);
                let message = format!(
                    "device {:?} touches with a patch of {radius:.2e} m, less than {edges} edges of the mesh on {:.0} % of {name:?}: its \
                     finite elements are too stiff for that by more than 2 %, and the feel shows the mesh; with patch_radius = \
                     {smooth:.2e} it does not",
                    device.name,
                    100.0 * share
                );
                Warning::new(WarningKind::SmallPatch, &device.name, message)
            })
        })
        .collect()
}

/// Mean length [m] of the edges around each triangle, those of all triangles at its corners, and its area [m²]; ascending.
fn local_edges(surface: &Surface) -> Vec<(f64, f64)> {
    let corners = |triangle: &[u32; 3]| triangle.map(|node| surface.positions[node as usize]);
    let mut at_node = vec![(0.0, 0.0); surface.positions.len()];
    for triangle in &surface.triangles {
        let [a, b, c] = corners(triangle);
        let mean = ((b - a).length() + (c - b).length() + (a - c).length()) / 3.0;
        for &node in triangle {
            let (sum, count) = &mut at_node[node as usize];
            (*sum, *count) = (*sum + mean, *count + 1.0);
        }
    }
    let local = |triangle: &[u32; 3]| {
        let [a, b, c] = corners(triangle);
        let edge =
            triangle.map(|node| at_node[node as usize].0 / at_node[node as usize].1).iter().sum::<f64>()
                / 3.0;
        (edge, 0.5 * (b - a).cross(c - a).length())
    };
    let mut edges: Vec<_> = surface.triangles.iter().map(local).collect();
    edges.sort_by(|a, b| a.0.total_cmp(&b.0));
    edges
}

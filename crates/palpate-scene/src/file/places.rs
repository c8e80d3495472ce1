//! Material points of objects: where devices hold, and `[[probe]]`.

use super::keys::{Numbers, ProbeEntry};
use super::source::Source;
use crate::error::{SceneError, SceneErrorKind};
use glam::DVec3;
use palpate::{Grasp, ModelObject, ResponseForm};
#[cfg(feature = "native")]
use palpate_export::ProbeLabel;
use toml::Spanned;

/// Allowed distance of a point from the surface, as a share of the object's diagonal.
const OFF_SURFACE: f64 = 0.05;

/// Object by its name.
pub(super) fn named_object(
    source: &Source,
    name: &Spanned<String>,
    object_names: &[String],
) -> Result<usize, SceneError> {
    let wanted = name.get_ref();
    match object_names.iter().position(|name| name == wanted) {
        Some(object) => Ok(object),
        None => {
            let known = object_names.join(", ");
            let message = format!("there is no object {wanted:?}; the scene has {known}");
            source.fail(name.span(), SceneErrorKind::UnknownValue, "object", message)
        }
    }
}

/// Material point of a named object that is nearest to a point [m, body].
pub(super) fn surface_point(
    source: &Source,
    (name, given): (&Spanned<String>, &Spanned<Numbers<3>>),
    objects: &[ModelObject],
    object_names: &[String],
) -> Result<Grasp, SceneError> {
    let object = named_object(source, name, object_names)?;
    let (wanted, recording) = (name.get_ref(), &objects[object].recording);
    let point = DVec3::from_array(given.get_ref().0);
    let allowed = OFF_SURFACE * recording.surface.diagonal();
    match recording.surface.nearest(point) {
        Some((point, distance)) if distance <= allowed => Ok(Grasp { object, point }),
        Some((_, distance)) => source.fail(
            given.span(),
            SceneErrorKind::Grasp,
            "point",
            format!(
                "the point {point} is {distance:.4} m from the surface of {wanted:?}, at most {allowed:.4} m are allowed; it is \
                 given in the body frame, whose origin is the centre of mass"
            ),
        ),
        None => {
            let message = format!("the object {wanted:?} has no surface");
            source.fail(given.span(), SceneErrorKind::Grasp, "point", message)
        }
    }
}

/// Displacement probe of an entry.
#[cfg(feature = "native")]
pub(super) fn read_probe(
    source: &Source,
    probe: &ProbeEntry,
    objects: &[ModelObject],
    object_names: &[String],
) -> Result<ProbeLabel, SceneError> {
    let name = probe.name.get_ref().clone();
    let at = surface_point(source, (&probe.object, &probe.point), objects, object_names)?;
    let ModelObject { recording, response, .. } = &objects[at.object];
    if let ResponseForm::Fir(table) = response
        && !table.observes(&recording.surface, &at.point)
    {
        let message =
            format!("the table of {:?} does not hold the displacement of this point", probe.object.get_ref());
        return source.fail(probe.point.span(), SceneErrorKind::Table, "point", message);
    }
    Ok(ProbeLabel { name, at })
}

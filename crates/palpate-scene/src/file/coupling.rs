//! `coupling`: gains of the virtual coupling, or `"auto"` for those that are stable with a margin.

use super::drivers::{read_real, read_simulated};
use super::keys::{CouplingChoice, DeviceEntry};
use super::source::{Quantity, Source};
use crate::devices::ANY_HAND;
use crate::error::{SceneError, SceneErrorKind};
use glam::DVec3;
use palpate::{Coupling, DeviceParameters, ModelObject};
use palpate_haptics::device::{DeviceSpec, Hand};
use palpate_haptics::stability::{
    ClosedLoop, LoopTiming, PointResponse, default_coupling, normal_at, stiffest_point,
};
use toml::Spanned;

/// Upper bound of stiffness [N/m] and damping [N·s/m].
const LARGEST_GAIN: f64 = 1e18;

/// Delay of a link [s]: more than 99 % of motions see on one machine.
const LINK_DELAY_S: f64 = 0.005;

/// Gains of the scene; none for `"auto"`, which is chosen when the objects are known.
pub(super) fn read_gains(
    source: &Source,
    choice: &Spanned<CouplingChoice>,
) -> Result<Option<Coupling>, SceneError> {
    let entry = match choice.get_ref() {
        CouplingChoice::Gains(entry) => entry,
        CouplingChoice::Word(word) if word == "auto" => return Ok(None),
        CouplingChoice::Word(word) => {
            return source.fail(
                choice.span(),
                SceneErrorKind::UnknownValue,
                "coupling",
                format!("coupling is {word:?}, expected {{ stiffness = …, damping = … }} or \"auto\""),
            );
        }
    };
    let stiffness = Quantity { key: "stiffness", unit: " N/m", below: LARGEST_GAIN };
    let damping = Quantity { key: "damping", unit: " N·s/m", below: LARGEST_GAIN };
    Ok(Some(Coupling {
        stiffness: source.positive(&entry.stiffness, stiffness)?,
        damping: entry.damping.as_ref().map_or(Ok(0.0), |number| source.not_negative(number, damping))?,
    }))
}

/// Default coupling of a device with `coupling = "auto"`, and a line that describes it: for the held point, or for the stiffest
/// point of all objects. None for other devices.
pub(super) fn choose_default(
    source: &Source,
    device: &DeviceEntry,
    parameters: &DeviceParameters,
    step_s: f64,
    objects: &[ModelObject],
    object_names: &[String],
) -> Result<Option<(Coupling, String)>, SceneError> {
    let Some(choice) = device.coupling.as_ref() else { return Ok(None) };
    // The model refuses a step out of its range.
    let automatic = matches!(choice.get_ref(), CouplingChoice::Word(_));
    if !(automatic && step_s > 0.0 && step_s <= 1.0) {
        return Ok(None);
    }
    let (traits, hands) = match &device.simulated {
        Some(entry) => {
            let (traits, hand) = read_simulated(source, entry)?;
            (traits, vec![Some(hand)])
        }
        // Any grip; the lightest device where the driver has no traits.
        None => {
            let real = read_real(source, device)?;
            let traits = real.map_or(DeviceSpec::TOUCH, |real| real.driver.typical_spec());
            (traits, ANY_HAND.map(|(_, hand): (_, Option<Hand>)| hand).to_vec())
        }
    };
    let linked = device.linked.as_ref().is_some_and(|linked| *linked.get_ref());
    let timing = LoopTiming::new(step_s, if linked { LINK_DELAY_S } else { 0.0 });
    let held = device.attach.as_ref().map(|attach| attach.get_ref());
    let touched = objects.iter().zip(object_names);
    let touched = touched.filter(|(_, name)| held.is_none_or(|attach| *name == attach.object.get_ref()));
    let points = touched.filter_map(|(object, _)| {
        let recording = &*object.recording;
        let point = match held {
            Some(attach) => recording.surface.nearest(DVec3::from_array(attach.point.get_ref().0))?.0,
            None => stiffest_point(recording, parameters.patch_radius, step_s)?,
        };
        let normal = normal_at(&recording.surface, &point);
        Some(PointResponse::new(recording, &point, parameters.patch_radius, normal))
    });
    let gives = |place: &PointResponse| place.instantaneous_compliance(step_s);
    let Some(place) = points.min_by(|a, b| gives(a).total_cmp(&gives(b))) else { return Ok(None) };
    let one = |hand: &Option<Hand>| ClosedLoop::new(&place, traits, *hand, timing);
    let loops: Vec<ClosedLoop> = hands.iter().map(one).collect();
    let Some(found) = default_coupling(&loops, gives(&place)) else {
        return source.fail(
            choice.span(),
            SceneErrorKind::Coupling,
            "coupling",
            "no coupling is stable with a margin here: give one as { stiffness = …, damping = … } (palpate inspect --device \
             tells which are stable)",
        );
    };
    let Coupling { stiffness, damping } = found.coupling;
    let line = format!(
        "{}: coupling {stiffness:.4} N/m, {damping:.4} N·s/m, for {} at {:.0} Hz{}; stable up to {:.1} × these gains, or {:.2} ms \
         later",
        device.name.get_ref(),
        traits.kind,
        1.0 / step_s,
        if linked { ", over a link of 5 ms" } else { "" },
        found.margins.gain.min(1e3),
        1e3 * found.margins.delay_s.min(10.0)
    );
    Ok(Some((found.coupling, line)))
}

//! `palpate inspect --device`: stable virtual couplings on an object, and their margins.

use crate::failure::Failure;
use crate::terminal::{print, print_json};
use clap::Args;
use glam::DVec3;
use palpate::{Coupling, Recording, SurfacePoint};
use palpate_haptics::device::{DeviceSpec, Hand};
use palpate_haptics::stability::{
    ClosedLoop, DefaultCoupling, LoopTiming, PointResponse, StiffnessLimit, critical_stiffness,
    default_coupling, normal_at, stable_damping, stiffest_point,
};
use palpate_scene::{ANY_HAND, find_device_traits, find_grip};
use serde_json::json;
use std::fmt::Write;

/// Options of the stability analysis.
#[derive(Args)]
pub struct StabilityArguments {
    /// Show which virtual couplings are stable with this device, and their margins: touch, omega.3 or inverse3
    #[arg(long, value_name = "DEVICE")]
    device: Option<String>,
    /// Steps of the scene, and updates of the device, per second [Hz]
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 1000.0,
        requires = "device",
        allow_negative_numbers = true
    )]
    rate: f64,
    /// Round-trip delay of a link, from a motion to its force [s]
    #[arg(long, value_name = "S", default_value_t = 0.0, requires = "device", allow_negative_numbers = true)]
    delay: f64,
    /// Grip of the hand: firm, light or fingertip; without it the worst of all, and of no hand
    #[arg(long, value_name = "GRIP", requires = "device")]
    grip: Option<String>,
    /// Contact point in the body frame [m]; without it the stiffest point of the surface
    #[arg(long, value_name = "X,Y,Z", requires = "device", allow_hyphen_values = true)]
    point: Option<String>,
    /// Radius of the contact patch [m]
    #[arg(long, value_name = "M", default_value_t = 0.0, requires = "device", allow_negative_numbers = true)]
    patch: f64,
}

/// Stiffnesses of the table [N/m].
const TABLE: [f64; 12] =
    [10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0, 20_000.0, 50_000.0];

/// Upper bound of the search [N/m].
const STIFFEST: f64 = 1e6;

/// Result of the analysis.
struct Analysis {
    traits: DeviceSpec,
    hands: Vec<&'static str>,
    timing: LoopTiming,
    position: DVec3,
    normal: DVec3,
    within_step: f64,
    at_rest: f64,
    table: Vec<(f64, Option<[f64; 2]>)>,
    unstable_from: Option<f64>,
    default: Option<DefaultCoupling>,
    /// Device damping with which the default is passive with any hand [N·s/m].
    passive: Option<f64>,
}

impl StabilityArguments {
    /// Prints the analysis if a device is given; returns whether one is.
    pub fn print_if_given(&self, recording: &Recording, as_json: bool) -> Result<bool, Failure> {
        let Some(device) = &self.device else { return Ok(false) };
        let found = self.find(recording, find_device_traits(device).map_err(Failure)?)?;
        if as_json {
            print_json(&found.json())?;
        } else {
            print(&found.text().map_err(|e| Failure(e.to_string()))?)?;
        }
        Ok(true)
    }

    fn find(&self, recording: &Recording, traits: DeviceSpec) -> Result<Analysis, Failure> {
        let fail = |what: String| Err(Failure(what));
        let Self { rate, delay, patch, .. } = *self;
        if !(50.0..=10_000.0).contains(&rate) {
            return fail(format!("--rate is {rate} Hz, expected 50 to 10000"));
        }
        if !(0.0..=0.5).contains(&delay) {
            return fail(format!("--delay is {delay} s, expected 0 to 0.5"));
        }
        if !(0.0..1e6).contains(&patch) {
            return fail(format!("--patch is {patch} m, expected a number not below 0"));
        }
        let timing = LoopTiming::new(1.0 / rate, delay);
        let hands: Vec<(&str, Option<Hand>)> = match &self.grip {
            None => ANY_HAND.to_vec(),
            Some(grip) => {
                let hand = find_grip(grip).map_err(Failure)?;
                ANY_HAND.into_iter().filter(|(_, known)| *known == Some(hand)).collect()
            }
        };
        let point = self.contact_point(recording, timing.step_s)?;
        let normal = normal_at(&recording.surface, &point);
        let place = PointResponse::new(recording, &point, patch, normal);
        let one = |(_, hand): &(&str, Option<Hand>)| ClosedLoop::new(&place, traits, *hand, timing);
        let loops: Vec<ClosedLoop> = hands.iter().map(one).collect();
        let within_step = place.instantaneous_compliance(timing.step_s);
        let default = default_coupling(&loops, within_step);
        let needs = |found: &DefaultCoupling| loops[0].damping_for_passivity(found.coupling);
        Ok(Analysis {
            traits,
            hands: hands.iter().map(|(name, _)| *name).collect(),
            timing,
            position: recording.surface.rest_position(&point),
            normal,
            within_step,
            at_rest: place.static_compliance(),
            table: TABLE.into_iter().map(|k| (k, stable_damping(&loops, k))).collect(),
            unstable_from: critical_stiffness(&loops, STIFFEST),
            passive: default.as_ref().map(needs),
            default,
        })
    }

    fn contact_point(&self, recording: &Recording, step_s: f64) -> Result<SurfacePoint, Failure> {
        let nowhere = || Failure("the recording has no surface that can be touched".to_string());
        let Some(text) = &self.point else {
            return stiffest_point(recording, self.patch, step_s).ok_or_else(nowhere);
        };
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
        let wanted = match numbers.as_deref() {
            Ok(&[x, y, z]) if DVec3::new(x, y, z).is_finite() => DVec3::new(x, y, z),
            _ => return Err(Failure(format!("--point is {text:?}, expected three numbers x,y,z in metres"))),
        };
        let (point, _) = recording.surface.nearest(wanted).ok_or_else(nowhere)?;
        if !recording.is_movable(&point) {
            return Err(Failure(format!(
                "--point {text} lies on fixed nodes: nothing of the body is felt there"
            )));
        }
        Ok(point)
    }
}

impl Analysis {
    fn text(&self) -> Result<String, std::fmt::Error> {
        let mut out = String::new();
        let LoopTiming { step_s, delay_updates } = self.timing;
        let [p, n] = [self.position, self.normal].map(|v| format!("({:.4}, {:.4}, {:.4})", v.x, v.y, v.z));
        writeln!(out, "{} at {p}, pressed along {n}", self.traits.kind)?;
        writeln!(
            out,
            "  loop         {:.0} Hz, {delay_updates} update{} from a motion to its force; hand: {}",
            1.0 / step_s,
            if delay_updates == 1 { "" } else { "s" },
            self.hands.join(", ")
        )?;
        let (within, rest) = (self.within_step, self.at_rest);
        writeln!(out, "  gives        {within:.3e} m/N within a step (R[0]), {rest:.3e} m/N at rest")?;
        writeln!(out, "  stiffness    stable with damping, with every hand")?;
        for (stiffness, range) in &self.table {
            let text = match range {
                Some([low, high]) => format!("{} to {} N·s/m", gain(*low), gain(*high)),
                None => "none".into(),
            };
            writeln!(out, "  {stiffness:>8} N/m   {text}")?;
            if range.is_none() {
                break;
            }
        }
        match self.unstable_from {
            Some(from) => writeln!(out, "  unstable     from {} N/m on, whatever the damping", gain(from))?,
            None => writeln!(out, "  unstable     with no stiffness: the object gives enough")?,
        }
        let Some(DefaultCoupling { coupling: Coupling { stiffness, damping }, limit, margins }) =
            self.default
        else {
            writeln!(out, "  default      none: shorten the delay, or name a --grip that holds it")?;
            return Ok(out);
        };
        writeln!(
            out,
            "  default      coupling = {{ stiffness = {}, damping = {} }}   (coupling = \"auto\")",
            gain(stiffness),
            gain(damping)
        )?;
        writeln!(
            out,
            "  by how much  stable up to {:.1} × both gains, or {:.2} ms later, or {:.0}° of phase",
            margins.gain.min(1e3),
            1e3 * margins.delay_s.min(10.0),
            margins.phase_rad.to_degrees()
        )?;
        let why = match limit {
            StiffnessLimit::Object => "the object: stiffer would not be felt, it is 10/R[0]",
            StiffnessLimit::Loop => {
                "rate, delay, device and hand: twice the gains, and twice as late, must be stable"
            }
        };
        writeln!(out, "  limited by   {why}")?;
        let (needs, has) = (self.passive.unwrap_or(0.0), self.traits.damping_n_s_m);
        let verdict =
            if needs <= has { "it is passive with any hand" } else { "the controller sees to the rest" };
        writeln!(
            out,
            "  passive      a device with {} N·s/m of its own would be, with any hand; this one has {has}: {verdict}",
            gain(needs)
        )?;
        Ok(out)
    }

    fn json(&self) -> serde_json::Value {
        json!({
            "device": self.traits.kind,
            "hands": self.hands,
            "rate_hz": 1.0 / self.timing.step_s,
            "delay_updates": self.timing.delay_updates,
            "point_m": self.position.to_array(),
            "normal": self.normal.to_array(),
            "compliance_within_step_m_per_n": self.within_step,
            "compliance_at_rest_m_per_n": self.at_rest,
            "stable": self.table.iter().map(|(stiffness, range)| json!({
                "stiffness_n_per_m": stiffness,
                "damping_n_s_per_m": range,
            })).collect::<Vec<_>>(),
            "unstable_from_n_per_m": self.unstable_from,
            "default": self.default.map(|found| json!({
                "stiffness_n_per_m": found.coupling.stiffness,
                "damping_n_s_per_m": found.coupling.damping,
                "limited_by": match found.limit { StiffnessLimit::Object => "object", StiffnessLimit::Loop => "loop" },
                "gain_margin": found.margins.gain,
                "delay_margin_s": found.margins.delay_s.is_finite().then_some(found.margins.delay_s),
                "phase_margin_rad": found.margins.phase_rad,
                "device_damping_for_passivity_n_s_per_m": self.passive,
            })),
        })
    }
}

/// Gain with three digits.
fn gain(value: f64) -> String {
    match value {
        0.0 => "0.0".into(),
        v if v >= 100.0 => format!("{v:.1}"),
        v if v >= 1.0 => format!("{v:.2}"),
        v => format!("{v:.4}"),
    }
}

//! Messages of a link: greeting as JSON, motions and efforts in fixed little-endian layouts.
//!
//! ```text
//! motion: 'M', sequence u64, position 3×f64, orientation 4×f64 (x, y, z, w), buttons u32
//! effort: 'E', sequence u64, in reply to u64, force 3×f64, absorbed energy f64
//! ```

use crate::port::{Effort, Motion};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Size of a motion [bytes], tag included.
pub(crate) const MOTION: usize = 1 + 8 + 7 * 8 + 4;

/// Size of an effort [bytes], tag included.
pub(crate) const EFFORT: usize = 1 + 8 + 8 + 4 * 8;

const MOTION_TAG: u8 = 0x4d;
const EFFORT_TAG: u8 = 0x45;

/// Greeting of a device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Hello {
    /// Name of the device in the scene.
    pub device: String,
}

/// Reply to a greeting. The names on the wire are those of the first version.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum Welcome {
    /// The device is connected.
    #[serde(rename = "Taken")]
    Accepted,
    /// The device is refused, with a reason.
    Refused(String),
}

/// Reason of a refusal while another device has the name.
pub(crate) fn taken(device: &str) -> String {
    format!("the device {device:?} is taken")
}

/// Numbers from little-endian bytes; `None` if the length differs.
fn numbers<const N: usize>(bytes: &[u8]) -> Option<[f64; N]> {
    let (chunks, rest) = bytes.as_chunks::<8>();
    let all: [[u8; 8]; N] = chunks.try_into().ok()?;
    rest.is_empty().then_some(all.map(f64::from_le_bytes))
}

/// Bytes of a motion. Its time is not sent: the receiver stamps it.
pub(crate) fn motion_bytes(motion: &Motion) -> [u8; MOTION] {
    let mut bytes = [0; MOTION];
    bytes[0] = MOTION_TAG;
    bytes[1..9].copy_from_slice(&motion.sequence.to_le_bytes());
    let (p, q) = (motion.position, motion.orientation);
    for (slot, number) in bytes[9..].chunks_exact_mut(8).zip([p.x, p.y, p.z, q.x, q.y, q.z, q.w]) {
        slot.copy_from_slice(&number.to_le_bytes());
    }
    bytes[MOTION - 4..].copy_from_slice(&motion.buttons.to_le_bytes());
    bytes
}

/// Motion from bytes received at a time [s]; `None` if they are no valid motion.
pub(crate) fn motion(bytes: &[u8], time_s: f64) -> Option<Motion> {
    if bytes.len() != MOTION || bytes[0] != MOTION_TAG {
        return None;
    }
    let sequence = u64::from_le_bytes(bytes[1..9].try_into().ok()?);
    let [x, y, z, qx, qy, qz, qw] = numbers(&bytes[9..MOTION - 4])?;
    let buttons = u32::from_le_bytes(bytes[MOTION - 4..].try_into().ok()?);
    let (position, orientation) = (DVec3::new(x, y, z), DQuat::from_xyzw(qx, qy, qz, qw));
    let good = sequence > 0 && position.is_finite() && orientation.is_finite();
    good.then_some(Motion { sequence, time_s, position, orientation, buttons, ..Motion::default() })
}

/// Bytes of an effort. Its time is not sent: the receiver stamps it.
pub(crate) fn effort_bytes(effort: &Effort) -> [u8; EFFORT] {
    let mut bytes = [0; EFFORT];
    bytes[0] = EFFORT_TAG;
    bytes[1..9].copy_from_slice(&effort.sequence.to_le_bytes());
    bytes[9..17].copy_from_slice(&effort.in_reply_to.to_le_bytes());
    let force = effort.force;
    for (slot, number) in bytes[17..].chunks_exact_mut(8).zip([force.x, force.y, force.z, effort.absorbed_j])
    {
        slot.copy_from_slice(&number.to_le_bytes());
    }
    bytes
}

/// Effort from bytes received at a time [s]; `None` if they are no valid effort.
pub(crate) fn effort(bytes: &[u8], time_s: f64) -> Option<Effort> {
    if bytes.len() != EFFORT || bytes[0] != EFFORT_TAG {
        return None;
    }
    let sequence = u64::from_le_bytes(bytes[1..9].try_into().ok()?);
    let in_reply_to = u64::from_le_bytes(bytes[9..17].try_into().ok()?);
    let [x, y, z, absorbed_j] = numbers(&bytes[17..])?;
    let force = DVec3::new(x, y, z);
    let good = sequence > 0 && force.is_finite() && absorbed_j.is_finite();
    good.then_some(Effort { sequence, in_reply_to, time_s, force, absorbed_j })
}

/// Whether bytes are a message of either end: entry of the fuzzer.
#[doc(hidden)]
pub fn decodes_link_message(bytes: &[u8]) -> bool {
    let greets =
        serde_json::from_slice::<Hello>(bytes).is_ok() || serde_json::from_slice::<Welcome>(bytes).is_ok();
    greets || motion(bytes, 0.0).is_some() || effort(bytes, 0.0).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_back_to_the_bit_and_garbage_does_not() {
        let sent = Motion {
            sequence: 7,
            time_s: 1.0,
            position: DVec3::new(0.1, -1e-300, 3.0),
            orientation: DQuat::from_xyzw(0.5, 0.5, -0.5, 0.5),
            buttons: 5,
            ..Motion::default()
        };
        assert_eq!(motion(&motion_bytes(&sent), 2.0), Some(Motion { time_s: 2.0, ..sent }));
        let answer = Effort { sequence: 9, in_reply_to: 7, time_s: 3.0, force: DVec3::Y, absorbed_j: -0.25 };
        assert_eq!(effort(&effort_bytes(&answer), 4.0), Some(Effort { time_s: 4.0, ..answer }));
        // The tag, the length and finite numbers are required.
        assert_eq!(motion(&effort_bytes(&answer), 0.0), None);
        assert_eq!(effort(&motion_bytes(&sent), 0.0), None);
        for length in 0..2 * MOTION {
            let bytes: Vec<u8> = motion_bytes(&sent).into_iter().cycle().take(length).collect();
            assert_eq!(motion(&bytes, 0.0).is_some(), length == MOTION);
            assert_eq!(effort(&bytes, 0.0), None);
        }
        let no_number = Motion { position: DVec3::X * f64::NAN, ..sent };
        assert_eq!(motion(&motion_bytes(&no_number), 0.0), None);
        let endless = Effort { force: DVec3::X * f64::INFINITY, ..answer };
        assert_eq!(effort(&effort_bytes(&endless), 0.0), None);
    }
}

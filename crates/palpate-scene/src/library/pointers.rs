//! Pointer devices for scenes that have none.

use crate::file::EditedText;
use palpate::{ModelObject, Recording, Support};
use std::ops::Range;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

/// Number of added pointers.
const POINTERS: usize = 4;

/// Keys that say what moves a device.
const MOVERS: [&str; 5] = ["path", "driver", "linked", "simulated", "pointer"];

/// Scene with its pointers.
pub(super) struct WithPointers {
    pub(super) edited: EditedText,
    /// Names of pointers whose size nobody has chosen.
    pub(super) added: Vec<String>,
}

/// Scene with pointers; none if it has some. Tips that nothing moves become pointers. Without any, four are added. The rest of the text stays
/// as it is, with its comments.
pub(super) fn with_pointers(text: &str, objects: &[ModelObject]) -> Option<WithPointers> {
    let scene: Table = text.parse().ok()?;
    if let Some(edited) = with_tips_as_pointers(text, &scene) {
        return Some(WithPointers { edited, added: Vec::new() });
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
    let mut longer = scene.clone();
    let devices = longer.entry("device").or_insert_with(|| Value::Array(Vec::new()));
    devices.as_array_mut()?.extend(fingers.clone());
    let below = Table::from_iter([("device".to_string(), Value::Array(fingers.clone()))]);
    let appended = format!("{}\n\n{below}", text.trim_end());
    let written = EditedText::same_lines(appended, &longer);
    // An inline array of devices cannot be continued further down, but where it ends.
    let inline = || {
        let end = DeTable::parse(text).ok()?.get_ref().get("device")?.span().end.checked_sub(1)?;
        let fingers: Vec<String> = fingers.iter().map(Value::to_string).collect();
        let continued = |comma: &str| {
            let text = format!("{}{comma}{}{}", &text[..end], fingers.join(", "), &text[end..]);
            EditedText::same_lines(text, &longer)
        };
        [", ", ""].into_iter().find_map(continued)
    };
    let edited = written.or_else(inline).unwrap_or_else(|| EditedText::rewritten(&longer));
    Some(WithPointers { edited, added })
}

/// Scene in which tips that nothing moves are pointers; none if there is no such tip.
fn with_tips_as_pointers(text: &str, scene: &Table) -> Option<EditedText> {
    let devices = scene.get("device").and_then(Value::as_array)?;
    let is_tip = |device: &Value| device.as_table().is_some_and(is_unmoved_tip);
    let tips: Vec<usize> = (0..devices.len()).filter(|at| is_tip(&devices[*at])).collect();
    if tips.is_empty() {
        return None;
    }
    let mut expected = scene.clone();
    for device in expected.get_mut("device").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(tip) = device.as_table_mut().filter(|device| is_unmoved_tip(device)) {
            tip.insert("pointer".into(), Value::Boolean(true));
        }
    }
    let places = device_places(text);
    let edit = || {
        let mut edited = EditedText { text: text.to_string(), added_lines: Vec::new() };
        // From the last, so that the places of the others stay.
        for &tip in tips.iter().rev() {
            let DevicePlace { mode, pointer } = places.as_ref()?.get(tip)?;
            match pointer {
                Some(pointer) => edited.text.replace_range(pointer.clone(), "true"),
                None => edited.insert_after_line(mode.as_ref()?.end, "pointer = true"),
            }
        }
        edited.is(&expected).then_some(edited)
    };
    let edit_inline = || {
        let mut edited = text.to_string();
        for &tip in tips.iter().rev() {
            let DevicePlace { mode, pointer } = places.as_ref()?.get(tip)?;
            match pointer {
                Some(pointer) => edited.replace_range(pointer.clone(), "true"),
                None => edited.insert_str(mode.as_ref()?.end, ", pointer = true"),
            }
        }
        EditedText::same_lines(edited, &expected)
    };
    Some(edit().or_else(edit_inline).unwrap_or_else(|| EditedText::rewritten(&expected)))
}

/// Places of two values of a device in a text.
struct DevicePlace {
    mode: Option<Range<usize>>,
    pointer: Option<Range<usize>>,
}

/// Places of the devices.
fn device_places(text: &str) -> Option<Vec<DevicePlace>> {
    let scene = DeTable::parse(text).ok()?;
    let DeValue::Array(devices) = scene.get_ref().get("device")?.get_ref() else { return None };
    let place = |device: &DeValue| {
        let of = |key: &str| device.get(key).map(|value| value.span());
        DevicePlace { mode: of("mode"), pointer: of("pointer") }
    };
    Some(devices.iter().map(|device| place(device.get_ref())).collect())
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
    // Stiffness m·ω² of the lowest mode: about that of the whole object. Damping ratio 0.1. An object that cannot come along is stretched
    // by what drags it: a finger gives way there, and slips.
    let (share, friction) = match recording.metadata.support {
        Support::Free => (1.0, 0.8),
        Support::Fixed => (0.25, 0.3),
    };
    let omega = recording.modes.angular_frequencies.first().copied().unwrap_or(50.0);
    let coupling = Table::from_iter([
        ("stiffness".to_string(), Value::Float(share * recording.mass() * omega * omega)),
        ("damping".to_string(), Value::Float(0.2 * share * recording.mass() * omega)),
    ]);
    let finger = |name: String| {
        Value::Table(Table::from_iter([
            ("name".to_string(), Value::String(name)),
            ("mode".to_string(), Value::String("touch".into())),
            ("pointer".to_string(), Value::Boolean(true)),
            ("tip_radius".to_string(), Value::Float(0.08 * radius)),
            ("patch_radius".to_string(), Value::Float(0.15 * radius)),
            ("friction".to_string(), Value::Float(friction)),
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
        let WithPointers { edited: EditedText { text: longer, .. }, added } =
            with_pointers(text, &objects).expect("fingers");
        assert!(longer.starts_with(text), "{longer}");
        assert_eq!(added, ["finger1", "finger3", "finger4", "finger5"]);
        assert_eq!(names(&longer), ["left", "finger1", "finger3", "finger4", "finger5"]);
        assert!(with_pointers(&longer, &objects).is_none(), "there are some");
        for list in
            ["device = [{ name = \"left\" }]\n# end\n", "device = [\n{ name = \"left\" },\n]\n# end\n"]
        {
            let EditedText { text: longer, added_lines } =
                with_pointers(list, &objects).expect("fingers").edited;
            assert_eq!(names(&longer), ["left", "finger1", "finger2", "finger3", "finger4"]);
            assert_eq!((longer.lines().count(), added_lines), (list.lines().count(), Vec::new()), "{longer}");
            assert!(longer.ends_with("]\n# end\n"), "{longer}");
        }
    }

    #[test]
    fn tips_that_nothing_moves_become_pointers_where_they_stand() {
        let objects = [object_at(&free_block(), DVec3::ZERO, DVec3::ZERO)];
        let text = "# mine\n[[device]]\nname = \"tip\"\nmode = \"touch\" # the finger\nlinked = false\ntip_radius = 0.01\n\n\
                    [[device]]\nname = \"far\"\nmode = \"touch\"\nlinked = true\n\
                    [[device]]\nname = \"other\"\npointer = false\nmode = \"touch\"\n\
                    [[device]]\nname = \"hand\"\nmode = \"held\"\n";
        let WithPointers { edited, added } = with_pointers(text, &objects).expect("a pointer");
        assert!(added.is_empty());
        let expected = text
            .replace("# the finger\n", "# the finger\npointer = true\n")
            .replace("pointer = false", "pointer = true");
        assert_eq!(edited.text, expected);
        // The finger's line is the fifth; the one after it was the fifth of the file.
        assert_eq!([4, 5, 6, 7, 99].map(|line| edited.line_before(line)), [4, 4, 5, 6, 98]);
        assert!(with_pointers(&edited.text, &objects).is_none(), "there are some");
    }

    #[test]
    fn tips_in_an_inline_array_become_pointers_on_their_line() {
        let objects = [object_at(&free_block(), DVec3::ZERO, DVec3::ZERO)];
        let text = "device = [{ mode = \"touch\", name = \"a\" }, { name = \"b\", mode = \"touch\" }]\n";
        let edited = with_pointers(text, &objects).expect("pointers").edited;
        assert_eq!(edited.text, text.replace("\"touch\"", "\"touch\", pointer = true"));
        assert!(edited.added_lines.is_empty());
    }
}

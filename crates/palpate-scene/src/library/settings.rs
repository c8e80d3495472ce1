//! Changes of a scene's settings, as edits of its text.

use crate::error::{SceneError, SceneErrorKind};
use palpate::Coupling;
use toml::{Table, Value};

/// New values of settings; none leaves a setting as it is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SettingsChange {
    /// Gravity [m/s²].
    pub gravity: Option<[f64; 3]>,
    /// Step [s], 0.2 ms to 10 ms.
    pub step_s: Option<f64>,
    /// Coefficient of friction of everything that touches.
    pub friction: Option<f64>,
    /// Virtual coupling of the pointers.
    pub coupling: Option<Coupling>,
}

impl SettingsChange {
    /// Changes the text of a scene.
    ///
    /// # Errors
    /// When a value is out of its range.
    pub fn apply(&self, text: &mut Table) -> Result<(), SceneError> {
        if let Some(gravity) = self.gravity {
            text.insert("gravity".into(), Value::Array(gravity.map(Value::Float).to_vec()));
        }
        if let Some(step) = self.step_s {
            if !(200e-6..=10e-3).contains(&step) {
                let message = format!("the step is {step} s, expected 0.0002 s to 0.01 s");
                return Err(SceneError::new(SceneErrorKind::OutOfRange, message));
            }
            text.insert("step".into(), Value::Float(step));
        }
        if let Some(friction) = self.friction {
            for kind in ["object", "plane", "obstacle", "device"] {
                let entries = text.get_mut(kind).and_then(Value::as_array_mut).into_iter().flatten();
                let touches = |entry: &Value| entry.get("mode").and_then(Value::as_str) != Some("held");
                entries.filter(|entry| touches(entry)).for_each(|entry| set(entry, "friction", friction));
            }
        }
        if let Some(coupling) = self.coupling {
            let gains = Table::from_iter([
                ("stiffness".to_string(), Value::Float(coupling.stiffness)),
                ("damping".to_string(), Value::Float(coupling.damping)),
            ]);
            let devices = text.get_mut("device").and_then(Value::as_array_mut).into_iter().flatten();
            let pointer = |device: &Value| device.get("pointer").and_then(Value::as_bool) == Some(true);
            devices
                .filter(|device| pointer(device))
                .for_each(|device| set(device, "coupling", gains.clone()));
        }
        Ok(())
    }
}

/// Sets a key of a table.
pub(super) fn set(entry: &mut Value, key: &str, value: impl Into<Value>) {
    if let Some(table) = entry.as_table_mut() {
        table.insert(key.into(), value.into());
    }
}

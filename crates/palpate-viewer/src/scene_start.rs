//! Rates of a scene, whoever runs it.

/// Time without an input after which a device becomes inactive [s].
pub(crate) const DEVICE_TIMEOUT_S: f64 = 0.1;

/// Frame rate [Hz].
pub(crate) const FRAME_RATE_HZ: f64 = 60.0;

//! Sound of elastic bodies, from the same modes as their contact forces.
//!
//! A step of `palpate` holds every modal force, so that the motion of every mode between two steps is known in closed form. A
//! [`Synthesiser`] evaluates it at the audio instants and adds up the modes between 20 Hz and 20 kHz, each with the pressure that it
//! radiates at its own frequency ([`Radiator`]). Contacts, dampers and hands act on the sound as they act on the motion: there is no second
//! simulation.
//!
//! ```text
//! State —capture→ StepRecord —synthesise→ pressure [Pa] → high-pass → bridge → limiter → samples, −1 to 1
//! ```
//!
//! Equations: docs/theory.md (C85) to (C88).
//!
//! Without threads, clock, standard library and unsafe code.
#![no_std]
extern crate alloc;

mod limiter;
mod oscillator_bank;
mod output_stage;
mod radiation;
mod step_record;
mod synthesiser;

pub use limiter::{CEILING, KNEE, limit};
pub use radiation::Radiator;
pub use step_record::StepRecord;
pub use synthesiser::Synthesiser;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// Parameters of the sound of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoundParameters {
    /// Samples per second [Hz].
    pub sample_rate_hz: f64,
    /// Distance of the listener from every body [m].
    pub distance_m: f64,
    /// Pressure of a sample of size 1 [Pa].
    pub full_scale_pa: f64,
    /// Upper limit of audible modes in all bodies together; the lowest ones are kept.
    pub max_modes: usize,
}

/// Lowest and highest frequency of a mode that sounds [Hz]: the range of hearing, below half of the sample rate.
pub const AUDIBLE_HZ: [f64; 2] = [20.0, 20e3];

impl Default for SoundParameters {
    /// 48 kHz, the rate of most sound devices; a listener at 0.5 m, as far as the hands; full scale at 2 Pa (100 dB), where a small bell that is
    /// struck gently comes near; 2000 modes, a tenth of a core at a step of 1 ms.
    fn default() -> Self {
        Self { sample_rate_hz: 48e3, distance_m: 0.5, full_scale_pa: 2.0, max_modes: 2000 }
    }
}

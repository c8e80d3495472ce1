//! Waves over a surface after an impulse, and their arrival.

use glam::{DMat3, DVec3};

/// Step of the integration [s]; the force is held for `HELD` of them, the paper's step of 2 ms.
pub const STEP_S: f64 = 0.5e-3;
pub const HELD: usize = 4;

/// Displacements of the surface [m] after one kind of impulse: sample by sample, node by node.
pub struct Wave {
    /// Displacement of each node in each sample.
    pub frames: Vec<Vec<DVec3>>,
}

impl Wave {
    /// Response to a force held for `HELD` steps, from the response to one that is held for one.
    pub fn new(column: &[f64], nodes: usize) -> Self {
        let single: Vec<Vec<DVec3>> = column
            .chunks_exact(3 * nodes)
            .map(|sample| sample.chunks_exact(3).map(DVec3::from_slice).collect())
            .collect();
        let at = |s: usize, node: usize| (0..HELD.min(s + 1)).map(|k| single[s - k][node]).sum();
        Self { frames: (0..single.len()).map(|s| (0..nodes).map(|node| at(s, node)).collect()).collect() }
    }

    /// With the rigid motion of a body of some mass [kg] and inertia added, after a force that acts on points: what one
    /// who stands beside it sees.
    pub fn with_motion(&self, rest: &[DVec3], mass: f64, inertia: DMat3, forces: &[(DVec3, DVec3)]) -> Self {
        let force: DVec3 = forces.iter().map(|(_, force)| *force).sum();
        let torque: DVec3 = forces.iter().map(|(point, force)| point.cross(*force)).sum();
        let (acceleration, turning) = (force / mass, inertia.inverse() * torque);
        let held = HELD as f64 * STEP_S;
        let frames = self.frames.iter().enumerate().map(|(s, frame)| {
            let t = (s + 1) as f64 * STEP_S;
            // Twice integrated: ½t² while the force is held, then on at constant speed.
            let way = if t <= held { 0.5 * t * t } else { held * t - 0.5 * held * held };
            let moved = |(p, u): (&DVec3, &DVec3)| *u + (acceleration + turning.cross(*p)) * way;
            rest.iter().zip(frame).map(moved).collect()
        });
        Self { frames: frames.collect() }
    }

    /// Largest displacement of any node at any time [m].
    pub fn peak(&self) -> f64 {
        self.frames.iter().flatten().fold(0.0, |peak, u| u.length().max(peak))
    }

    /// Time at which every node has moved by more than a share of the peak [s], from samples every `step_s`; linear between them.
    pub fn arrival(&self, share: f64, step_s: f64) -> Option<f64> {
        let bound = share * self.peak();
        let of_node = |node: usize| {
            let s = self.frames.iter().position(|frame| frame[node].length() > bound)?;
            let (before, after) =
                (if s == 0 { 0.0 } else { self.frames[s - 1][node].length() }, self.frames[s][node].length());
            Some(step_s * (s as f64 + (bound - before) / (after - before)))
        };
        (0..self.frames[0].len()).map(of_node).try_fold(0.0, |latest: f64, t| Some(latest.max(t?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_has_arrived_when_the_last_node_has_moved_by_the_share_of_the_peak() {
        let frame = |near: f64, far: f64| vec![DVec3::X * near, DVec3::Y * far];
        let wave = Wave { frames: vec![frame(1.0, 0.0), frame(2.0, 0.5), frame(1.0, 1.5)] };
        // A quarter of 2 is reached by the far node at the end of the second sample, a half in the middle of the third.
        assert_eq!(wave.arrival(0.25, 1.0), Some(2.0));
        assert_eq!(wave.arrival(0.5, 1.0), Some(2.5));
        assert_eq!(wave.arrival(0.9, 1.0), None);
    }

    #[test]
    fn motion_is_added_as_of_a_rigid_body() {
        let wave = Wave { frames: vec![vec![DVec3::ZERO]; HELD + 1] };
        let push = [(DVec3::ZERO, DVec3::X * 2.0)];
        let moved = wave.with_motion(&[DVec3::Y], 4.0, DMat3::IDENTITY, &push);
        let held = HELD as f64 * STEP_S;
        // ½·a·t² with a = 0.5 m/s², then on at a·t.
        assert!((moved.frames[HELD - 1][0].x - 0.25 * held * held).abs() < 1e-18);
        assert!((moved.frames[HELD][0].x - (0.25 * held * held + 0.5 * held * STEP_S)).abs() < 1e-18);
    }
}

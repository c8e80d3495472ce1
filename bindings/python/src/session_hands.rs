//! Parts of a session that the caller moves: devices without a path, planes, obstacles and clamps.
//!
//! A move is reached in a straight line in the time since the move before it: a hand that is moved at some hertz, by a loop of control or by
//! pictures of a camera, goes evenly from each position to the next, one interval late (delayed first-order hold).

use crate::arrays::{Numbers, check_finite, check_finite_row};
use crate::device_mode::ModeChange;
use crate::errors::input_error;
use crate::motion::{Arguments, Kind, pose_of_row};
use crate::scene::Scene as PythonScene;
use glam::DVec3;
use palpate::{AppliedForce, DeviceMode, Pose};
use palpate_haptics::{
    DevicePort, Motion, Playback, PoseSender, PoseTrajectory, SceneMotion, SessionDevice, port, pose_port,
};
use palpate_scene::Scene;
use pyo3::prelude::*;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest time that a move takes when the caller states none [s]: moves at 10 Hz and more are without steps of the velocity's size.
const MAX_INTERVAL_S: f64 = 0.1;

/// Longest time that a caller may state [s].
const MAX_OVER_S: f64 = 3600.0;

/// Parts of a session as the caller moves them.
pub struct Hands {
    hands: Vec<Hand>,
    obstacles: Frames,
    clamps: Frames,
    /// Modes of the devices.
    pub modes: Vec<DeviceMode>,
    playback: Arc<Playback>,
    /// Origin of all times.
    start: Instant,
}

/// Hand that the force process sees through a port; none where it follows a path.
struct Hand {
    port: Option<DevicePort>,
    sequence: u64,
    position: DVec3,
    /// Simulated time in which it gets there [s].
    over_s: f64,
    pace: Pace,
    /// Whether the caller has said where it is, or what it exerts.
    has_begun: bool,
}

/// Planes and obstacles, or clamps; none where they follow a path.
struct Frames {
    senders: Vec<Option<PoseSender>>,
    pace: Pace,
}

/// Pace at which the caller moves something.
#[derive(Clone, Copy)]
struct Pace {
    last: Option<Instant>,
    /// Time at which it is there.
    arrival: Instant,
}

impl Pace {
    /// Time for a move that begins now [s]: that since the last move, and no less than is left of it, so that a late move and the next one, which is
    /// in time, do not end in a jump. `first_s` is that of the first move.
    fn next_s(&mut self, stated: Option<f64>, now: Instant, first_s: f64) -> f64 {
        let since = |last: Instant| now.saturating_duration_since(last).as_secs_f64().min(MAX_INTERVAL_S);
        let interval = || self.last.map_or(first_s, since);
        let left = || self.arrival.saturating_duration_since(now).as_secs_f64();
        let over_s = stated.unwrap_or_else(|| interval().max(left().min(MAX_INTERVAL_S)));
        *self = Self { last: Some(now), arrival: now + Duration::from_secs_f64(over_s) };
        over_s
    }
}

/// Move of a caller, checked.
pub struct Move {
    /// Positions or forces, by device.
    hands: Vec<(usize, DVec3)>,
    obstacles: Vec<(usize, Pose)>,
    clamps: Vec<(usize, Pose)>,
    over_s: Option<f64>,
}

impl Move {
    /// Parts that it gives a position, and these [m, world].
    pub fn positions<'s>(
        &'s self,
        scene: &'s Scene,
        modes: &'s [DeviceMode],
    ) -> impl Iterator<Item = (&'s str, DVec3)> {
        let has_position = |device: &usize| !matches!(modes[*device], DeviceMode::Force(_));
        let hands = self.hands.iter().filter(move |(device, _)| has_position(device));
        let hands = hands.map(|(device, position)| (&*scene.devices[*device].name, *position));
        let obstacles = self.obstacles.iter().map(|(at, pose)| (&scene.obstacles[*at], pose.position));
        // Obstacles where the scene has put them are not asked about.
        let obstacles = obstacles.filter(|(own, position)| own.start.position != *position);
        let obstacles = obstacles.map(|(own, position)| (&*own.name, position));
        let clamps = self.clamps.iter().map(|(at, pose)| (&*scene.clamps[*at].name, pose.position));
        hands.chain(obstacles).chain(clamps)
    }
}

impl Hands {
    /// Parts of a scene, and the devices that a session takes.
    pub fn open(scene: &Scene, start: Instant, playback: Arc<Playback>) -> (Self, Vec<SessionDevice>) {
        let pace = Pace { last: None, arrival: start };
        let hand =
            |port| Hand { port, sequence: 0, position: DVec3::ZERO, over_s: 0.0, pace, has_begun: false };
        let open = |device: &palpate_scene::SceneDevice| match &device.path {
            Some(path) => (hand(None), SessionDevice::Path(path.clone(), device.mode)),
            None => {
                let (device_port, force_port) = port();
                (hand(Some(device_port)), SessionDevice::Remote(force_port, device.mode))
            }
        };
        let (hands, devices) = scene.devices.iter().map(open).unzip();
        let modes = scene.devices.iter().map(|device| device.mode).collect();
        let [obstacles, clamps] = [(); 2].map(|()| Frames { senders: Vec::new(), pace });
        (Self { hands, obstacles, clamps, modes, playback, start }, devices)
    }

    /// Take the motion of planes, obstacles and clamps without a path into the caller's hand.
    pub fn take_over(&mut self, scene: &Scene, motion: &mut SceneMotion) {
        let step_s = scene.model.parameters().step_s;
        let live = |start: Pose, has_path: bool, trajectory: &mut PoseTrajectory| {
            let (sender, own) = pose_port(start, step_s);
            (!has_path).then(|| {
                *trajectory = own;
                sender
            })
        };
        let obstacles = scene.obstacles.iter().zip(&mut motion.obstacles);
        self.obstacles.senders = obstacles
            .map(|(obstacle, trajectory)| live(trajectory(0.0), obstacle.path.is_some(), trajectory))
            .collect();
        let frames = scene.model.parameters().clamps.iter().map(|clamp| clamp.frame);
        let clamps = frames.zip(&mut motion.clamps).map(|(frame, trajectory)| {
            let has_path = trajectory.is_some();
            live(frame, has_path, trajectory.get_or_insert_with(|| Box::new(move |_| frame)))
        });
        self.clamps.senders = clamps.collect();
    }

    /// Whether the caller moves a device.
    pub fn is_moved(&self, device: usize) -> bool {
        self.hands[device].port.is_some()
    }

    /// Read and check a move of all devices or of one, of planes and obstacles, and of clamps.
    pub fn read(
        &self,
        py: Python<'_>,
        scene: &Scene,
        arguments: &Arguments<'_, '_>,
        device: Option<&Bound<'_, PyAny>>,
        over: Option<f64>,
    ) -> PyResult<Move> {
        let Arguments { positions, obstacles, clamps } = *arguments;
        if positions.is_none() && (device.is_some() || obstacles.is_none() && clamps.is_none()) {
            return Err(input_error(py, "positions is missing: give positions, obstacles or clamps"));
        }
        if let Some(over) = over.filter(|over| !(0.0..=MAX_OVER_S).contains(over)) {
            return Err(input_error(py, format!("over is {over} s, expected 0 to {MAX_OVER_S} s")));
        }
        let device = device.map(|device| PythonScene::device(scene, device)).transpose()?;
        let hands = positions.map(|given| self.read_positions(py, scene, given, device)).transpose()?;
        let poses = |kind: Kind, given: Option<&Bound<'_, PyAny>>, frames: &Frames| {
            given.map(|given| frames.read(py, kind, given)).transpose().map(Option::unwrap_or_default)
        };
        Ok(Move {
            hands: hands.unwrap_or_default(),
            obstacles: poses(Kind::Obstacles, obstacles, &self.obstacles)?,
            clamps: poses(Kind::Clamps, clamps, &self.clamps)?,
            over_s: over,
        })
    }

    fn read_positions(
        &self,
        py: Python<'_>,
        scene: &Scene,
        given: &Bound<'_, PyAny>,
        device: Option<usize>,
    ) -> PyResult<Vec<(usize, DVec3)>> {
        if let Some(device) = device {
            if !self.is_moved(device) {
                let name = &scene.devices[device].name;
                return Err(input_error(py, format!("device {name:?} follows a path of the scene")));
            }
            let numbers = Numbers::read(given, "positions", &[Some(3)])?;
            check_finite(py, "positions", numbers.as_slice()?, 3)?;
            return Ok(vec![(device, DVec3::from_slice(numbers.as_slice()?))]);
        }
        let rows = read_rows(py, Kind::Devices, given, |row| self.is_moved(row), self.hands.len())?;
        Ok(rows.into_iter().map(|(device, row)| (device, DVec3::from_slice(&row))).collect())
    }

    /// Move parts.
    pub fn make(&mut self, given: &Move) {
        let now = Instant::now();
        let slowdown = f64::from(self.playback.slowdown());
        for (device, given_row) in &given.hands {
            let hand = &mut self.hands[*device];
            // The first position is where the hand begins.
            hand.over_s = hand.pace.next_s(given.over_s, now, 0.0) / slowdown;
            if let DeviceMode::Force(applied) = &mut self.modes[*device] {
                *applied = AppliedForce { force: *given_row, ..*applied };
            } else {
                hand.position = *given_row;
            }
            hand.has_begun = true;
            self.send(*device);
        }
        for (frames, poses) in [(&mut self.obstacles, &given.obstacles), (&mut self.clamps, &given.clamps)] {
            if poses.is_empty() {
                continue;
            }
            let over_s = frames.pace.next_s(given.over_s, now, MAX_INTERVAL_S) / slowdown;
            for (at, pose) in poses {
                frames.senders[*at].iter_mut().for_each(|sender| sender.send(*pose, over_s));
            }
        }
    }

    /// Change the mode of a device that the caller moves.
    ///
    /// # Errors
    /// Text for the caller.
    pub fn change(&mut self, scene: &Scene, change: ModeChange) -> Result<(), String> {
        let device = change.device();
        if !self.is_moved(device) {
            let name = &scene.devices[device].name;
            return Err(format!(
                "device {name:?} follows a path of the scene, which a session does not change"
            ));
        }
        change.apply(scene, &mut self.modes)?;
        self.send(device);
        Ok(())
    }

    /// Send the newest motion of a device to the force process, once it has begun.
    fn send(&mut self, device: usize) {
        let (hand, mode) = (&mut self.hands[device], self.modes[device]);
        let (Some(port), true) = (&mut hand.port, hand.has_begun) else { return };
        hand.sequence += 1;
        port.send(Motion {
            sequence: hand.sequence,
            time_s: self.start.elapsed().as_secs_f64(),
            position: hand.position,
            over_s: hand.over_s,
            mode: Some(mode),
            ..Motion::default()
        });
    }
}

impl Frames {
    /// Poses of the parts without a path.
    fn read(&self, py: Python<'_>, kind: Kind, given: &Bound<'_, PyAny>) -> PyResult<Vec<(usize, Pose)>> {
        let rows = read_rows(py, kind, given, |row| self.senders[row].is_some(), self.senders.len())?;
        let pose = |(row, numbers): (usize, Vec<f64>)| Ok((row, pose_of_row(kind, row, &numbers)?));
        let poses: Result<_, String> = rows.into_iter().map(pose).collect();
        poses.map_err(|error| input_error(py, error))
    }
}

/// Rows of an argument that the caller moves, by number; the others are not used.
fn read_rows(
    py: Python<'_>,
    kind: Kind,
    given: &Bound<'_, PyAny>,
    is_moved: impl Fn(usize) -> bool,
    rows: usize,
) -> PyResult<Vec<(usize, Vec<f64>)>> {
    let (name, columns) = (kind.name(), kind.columns());
    let numbers = Numbers::read(given, name, &[Some(rows), Some(columns)])?;
    let mut moved = Vec::new();
    for (row, numbers) in
        numbers.as_slice()?.chunks_exact(columns).enumerate().filter(|(row, _)| is_moved(*row))
    {
        check_finite_row(py, name, row, numbers)?;
        moved.push((row, numbers.to_vec()));
    }
    Ok(moved)
}

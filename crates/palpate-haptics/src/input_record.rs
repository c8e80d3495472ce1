//! Record of a run by its inputs: the initial states of the objects and the input of every step, as numbers. The same steps follow from it
//! to the bit, at a tenth of the size of their log.
//!
//! ```text
//! objects n, of each: pose 7, velocities 6, angular momentum 3, modes m, of each q, v | input | input | …
//! input: devices n, of each: position 3, kind, held point 5 (kinds 2, 3), force 3 (kind 3); obstacles n × 7; clamps n × 7;
//!        bases n, of each: whether, position 3; gravity: whether, 3
//! ```

use glam::{DQuat, DVec3};
use palpate::{
    AppliedForce, DeviceInput, DeviceMode, Grasp, Input, ObjectSnapshot, OscillatorState, Pose, SurfacePoint,
    Twist,
};

/// Record of a run by its inputs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct InputRecord {
    numbers: Vec<f64>,
    steps: u64,
}

impl InputRecord {
    /// Record that begins with the states of the objects.
    pub fn new(start: &[ObjectSnapshot]) -> Self {
        let mut numbers = vec![start.len() as f64];
        for object in start {
            push_pose(&mut numbers, &object.pose);
            for vector in [object.twist.linear, object.twist.angular, object.angular_momentum] {
                numbers.extend(vector.to_array());
            }
            numbers.push(object.modes.len() as f64);
            numbers.extend(object.modes.iter().flat_map(|mode| [mode.q, mode.v]));
        }
        Self { numbers, steps: 0 }
    }

    /// Adds the input of the next step.
    pub fn push(&mut self, input: &Input) {
        let out = &mut self.numbers;
        out.push(input.devices.len() as f64);
        for DeviceInput { position, mode } in &input.devices {
            out.extend(position.to_array());
            match mode {
                DeviceMode::Inactive => out.push(0.0),
                DeviceMode::Touch => out.push(1.0),
                DeviceMode::Held(grasp) => {
                    out.push(2.0);
                    push_grasp(out, grasp);
                }
                DeviceMode::Force(AppliedForce { grasp, force }) => {
                    out.push(3.0);
                    push_grasp(out, grasp);
                    out.extend(force.to_array());
                }
                DeviceMode::Suspended => out.push(4.0),
            }
        }
        for poses in [&input.obstacles, &input.clamps] {
            out.push(poses.len() as f64);
            poses.iter().for_each(|pose| push_pose(out, pose));
        }
        out.push(input.bases.len() as f64);
        input.bases.iter().for_each(|base| push_optional(out, *base));
        push_optional(out, input.gravity);
        self.steps += 1;
    }

    /// Number of steps.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Length of its numbers [bytes].
    pub fn bytes(&self) -> usize {
        size_of_val(self.numbers.as_slice())
    }

    /// Its numbers.
    pub fn numbers(&self) -> &[f64] {
        &self.numbers
    }
}

/// Reader of the numbers of an [`InputRecord`].
#[derive(Debug, Clone)]
pub struct InputReader {
    numbers: Vec<f64>,
    at: usize,
}

impl InputReader {
    /// Reader of numbers, and the states of the objects at the start; none if the numbers are too few.
    pub fn new(numbers: Vec<f64>) -> Option<(Self, Vec<ObjectSnapshot>)> {
        let mut reader = Self { numbers, at: 0 };
        let start = reader.list(|reader| {
            let pose = reader.pose()?;
            let twist = Twist { linear: reader.vector()?, angular: reader.vector()? };
            let angular_momentum = reader.vector()?;
            let modes =
                reader.list(|reader| Some(OscillatorState { q: reader.next()?, v: reader.next()? }))?;
            Some(ObjectSnapshot { pose, twist, angular_momentum, modes })
        })?;
        Some((reader, start))
    }

    /// Input of the next step; none at the end.
    pub fn input(&mut self) -> Option<Input> {
        let devices = self.list(|reader| {
            let position = reader.vector()?;
            let mode = match reader.next()? {
                1.0 => DeviceMode::Touch,
                2.0 => DeviceMode::Held(reader.grasp()?),
                3.0 => DeviceMode::Force(AppliedForce { grasp: reader.grasp()?, force: reader.vector()? }),
                4.0 => DeviceMode::Suspended,
                _ => DeviceMode::Inactive,
            };
            Some(DeviceInput { position, mode })
        })?;
        Some(Input {
            devices,
            obstacles: self.list(Self::pose)?,
            clamps: self.list(Self::pose)?,
            bases: self.list(Self::optional)?,
            gravity: self.optional()?,
        })
    }

    fn next(&mut self) -> Option<f64> {
        let number = self.numbers.get(self.at).copied();
        self.at += 1;
        number
    }

    fn list<T>(&mut self, mut read: impl FnMut(&mut Self) -> Option<T>) -> Option<Vec<T>> {
        let length = self.next()? as usize;
        (0..length).map(|_| read(self)).collect()
    }

    fn vector(&mut self) -> Option<DVec3> {
        Some(DVec3::new(self.next()?, self.next()?, self.next()?))
    }

    fn optional(&mut self) -> Option<Option<DVec3>> {
        let is_there = self.next()? != 0.0;
        let vector = self.vector()?;
        Some(is_there.then_some(vector))
    }

    fn pose(&mut self) -> Option<Pose> {
        let position = self.vector()?;
        let orientation = DQuat::from_xyzw(self.next()?, self.next()?, self.next()?, self.next()?);
        Some(Pose { position, orientation })
    }

    fn grasp(&mut self) -> Option<Grasp> {
        let (object, triangle) = (self.next()? as usize, self.next()? as u32);
        let weights = [self.next()?, self.next()?, self.next()?];
        Some(Grasp { object, point: SurfacePoint { triangle, weights } })
    }
}

fn push_pose(out: &mut Vec<f64>, pose: &Pose) {
    out.extend(pose.position.to_array());
    out.extend(pose.orientation.to_array());
}

fn push_grasp(out: &mut Vec<f64>, Grasp { object, point }: &Grasp) {
    out.extend([*object as f64, f64::from(point.triangle)]);
    out.extend(point.weights);
}

fn push_optional(out: &mut Vec<f64>, vector: Option<DVec3>) {
    out.push(f64::from(u8::from(vector.is_some())));
    out.extend(vector.unwrap_or_default().to_array());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_gives_its_inputs_back() {
        let vector = DVec3::new(0.1, -2.0, 1e-9);
        let pose = Pose { position: vector, orientation: DQuat::from_xyzw(0.0, 0.6, 0.0, 0.8) };
        let grasp = Grasp { object: 1, point: SurfacePoint { triangle: 7, weights: [0.2, 0.3, 0.5] } };
        let modes = [
            DeviceMode::Inactive,
            DeviceMode::Touch,
            DeviceMode::Held(grasp),
            DeviceMode::Force(AppliedForce { grasp, force: -vector }),
            DeviceMode::Suspended,
        ];
        let full = Input {
            devices: modes.map(|mode| DeviceInput { position: vector, mode }).to_vec(),
            obstacles: vec![pose, Pose::IDENTITY],
            clamps: vec![pose],
            bases: vec![None, Some(vector)],
            gravity: Some(vector),
        };
        let start = vec![ObjectSnapshot {
            pose,
            twist: Twist { linear: vector, angular: -vector },
            angular_momentum: vector,
            modes: vec![OscillatorState { q: 1.0, v: 2.0 }, OscillatorState { q: -3.0, v: 4.0 }],
        }];
        let mut record = InputRecord::new(&start);
        for input in [&full, &Input::default(), &full] {
            record.push(input);
        }
        assert_eq!(record.steps(), 3);
        let (mut reader, read) = InputReader::new(record.numbers().to_vec()).expect("a record");
        assert_eq!(format!("{read:?}"), format!("{start:?}"));
        for expected in [&full, &Input::default(), &full] {
            assert_eq!(format!("{:?}", reader.input()), format!("{:?}", Some(expected)));
        }
        assert!(reader.input().is_none());
        assert!(InputReader::new(vec![3.0, 1.0]).is_none(), "numbers are missing");
    }
}

//! Steps as CSV: a row per step, and a row per contact.

use crate::Failure;
use crate::scene_file::Scene;
use crate::whole_file::WholeFile;
use palpate::{Collider, Input, Output};
use std::path::{Path, PathBuf};

/// Lines of numbers that read back to the same bits.
struct Rows {
    file: WholeFile,
}

impl Rows {
    fn new(path: &Path, scene: &Scene, header: &str) -> Result<Self, Failure> {
        let inputs: Vec<&Path> = scene.inputs.iter().map(PathBuf::as_path).collect();
        let mut rows = Self { file: WholeFile::create(path, &inputs)? };
        rows.line(header)?;
        Ok(rows)
    }

    fn line(&mut self, text: &str) -> Result<(), Failure> {
        self.file.write(format!("{text}\n").as_bytes())
    }
}

fn joined(numbers: impl IntoIterator<Item = f64>) -> String {
    let cells: Vec<String> = numbers.into_iter().map(|number| format!("{number:?}")).collect();
    cells.join(",")
}

/// Every step as a row.
pub struct StepsCsv {
    rows: Rows,
}

impl StepsCsv {
    /// Begin the file with its header.
    pub fn new(path: &Path, scene: &Scene) -> Result<Self, Failure> {
        let mut columns = vec!["t".to_string()];
        for device in &scene.devices {
            let parts = ["x", "y", "z", "fx", "fy", "fz", "proxy_x", "proxy_y", "proxy_z"];
            columns.extend(parts.map(|c| format!("{}.{c}", device.name)));
        }
        for name in &scene.object_names {
            let parts = ["px", "py", "pz", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"];
            columns.extend(parts.map(|c| format!("{name}.{c}")));
        }
        let stored = ["kinetic", "elastic", "residual", "potential", "coupling"];
        let passed = ["input", "dissipated", "friction", "impact", "defect"];
        columns.extend(stored.into_iter().chain(passed).map(|c| format!("energy.{c}")));
        Ok(Self { rows: Rows::new(path, scene, &columns.join(","))? })
    }

    /// Write a step.
    pub fn write(&mut self, input: &Input, output: &Output) -> Result<(), Failure> {
        let mut numbers = vec![output.time_s];
        for (device, out) in input.devices.iter().zip(&output.devices) {
            numbers.extend(device.position.to_array());
            numbers.extend(out.force_on_hand.to_array());
            numbers.extend(out.proxy.to_array());
        }
        for object in &output.objects {
            let q = object.pose.orientation;
            numbers.extend(object.pose.position.to_array());
            numbers.extend([q.w, q.x, q.y, q.z]);
            numbers.extend(object.twist.linear.to_array());
            numbers.extend(object.twist.angular.to_array());
        }
        let e = &output.energy;
        numbers.extend([e.kinetic, e.elastic, e.residual, e.potential, e.coupling]);
        numbers.extend([e.input, e.dissipated, e.friction, e.impact, e.defect]);
        self.rows.line(&joined(numbers))
    }

    /// Let the file take its name; gives that.
    pub fn finish(self) -> Result<PathBuf, Failure> {
        self.rows.file.finish()
    }
}

/// Every contact of every step as a row.
pub struct ContactsCsv {
    rows: Rows,
}

impl ContactsCsv {
    /// Begin the file with its header.
    pub fn new(path: &Path, scene: &Scene) -> Result<Self, Failure> {
        let header = "t,object,against,px,py,pz,nx,ny,nz,fx,fy,fz,gap,slip_speed";
        Ok(Self { rows: Rows::new(path, scene, header)? })
    }

    /// Write the contacts of a step.
    pub fn write(&mut self, scene: &Scene, output: &Output) -> Result<(), Failure> {
        for contact in &output.contacts {
            let against = match contact.against {
                Collider::Device(at) => &scene.devices[at].name,
                Collider::Obstacle(at) => &scene.obstacles[at].name,
                Collider::Object(at) => &scene.object_names[at],
            };
            let vectors = [contact.point, contact.normal, contact.force].into_iter();
            let numbers = vectors.flat_map(|v| v.to_array()).chain([contact.gap, contact.slip_speed]);
            // Adding 0 turns −0 into 0.
            let numbers = numbers.map(|number| number + 0.0);
            let object = &scene.object_names[contact.object];
            self.rows.line(&format!("{:?},{object},{against},{}", output.time_s, joined(numbers)))?;
        }
        Ok(())
    }

    /// Let the file take its name; gives that.
    pub fn finish(self) -> Result<PathBuf, Failure> {
        self.rows.file.finish()
    }
}

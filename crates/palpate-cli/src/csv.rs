//! A run as CSV: a row per step.

use crate::Failure;
use crate::scene_file::Scene;
use crate::whole_file::WholeFile;
use palpate::{Input, Output};
use std::path::{Path, PathBuf};

/// Every step as a line of numbers that read back to the same bits.
pub struct CsvWriter {
    file: WholeFile,
}

impl CsvWriter {
    /// Begin the file with its header.
    pub fn new(path: &Path, scene: &Scene) -> Result<Self, Failure> {
        let inputs: Vec<&Path> = scene.inputs.iter().map(PathBuf::as_path).collect();
        let mut writer = Self { file: WholeFile::create(path, &inputs)? };
        let mut columns = vec!["t".to_string()];
        for device in &scene.devices {
            columns.extend(["x", "y", "z", "fx", "fy", "fz"].map(|c| format!("{}.{c}", device.name)));
        }
        for name in &scene.object_names {
            let parts = ["px", "py", "pz", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"];
            columns.extend(parts.map(|c| format!("{name}.{c}")));
        }
        let energies = ["kinetic", "elastic", "residual", "potential", "input", "dissipated", "defect"];
        columns.extend(energies.map(|c| format!("energy.{c}")));
        writer.line(&columns.join(","))?;
        Ok(writer)
    }

    fn line(&mut self, text: &str) -> Result<(), Failure> {
        self.file.write(format!("{text}\n").as_bytes())
    }

    /// Write a step.
    pub fn write(&mut self, input: &Input, output: &Output) -> Result<(), Failure> {
        let mut numbers = vec![output.time_s];
        for (device, out) in input.devices.iter().zip(&output.devices) {
            numbers.extend(device.position.to_array());
            numbers.extend(out.force_on_hand.to_array());
        }
        for object in &output.objects {
            let q = object.pose.orientation;
            numbers.extend(object.pose.position.to_array());
            numbers.extend([q.w, q.x, q.y, q.z]);
            numbers.extend(object.twist.linear.to_array());
            numbers.extend(object.twist.angular.to_array());
        }
        let e = &output.energy;
        numbers.extend([e.kinetic, e.elastic, e.residual, e.potential, e.input, e.dissipated, e.defect]);
        let cells: Vec<String> = numbers.iter().map(|number| format!("{number:?}")).collect();
        self.line(&cells.join(","))
    }

    /// Let the file take its name.
    pub fn finish(self) -> Result<(), Failure> {
        self.file.finish()
    }
}

//! CSV files: a row per step, and a row per contact and step.

use crate::atomic_file::AtomicFile;
use crate::error::ExportError;
use crate::labels::{ProbeReading, SceneLabels};
use crate::standard_output::{STANDARD_OUTPUT, has_reader};
use palpate::{Collider, Input, Model, Output, State};
use std::io::{self, BufWriter, Stdout, Write};
use std::path::{Path, PathBuf};

/// Rows of numbers, written so that they parse to the same bits.
enum Rows {
    File(AtomicFile),
    /// Standard output; none once its reader has gone away.
    Output(Option<BufWriter<Stdout>>),
}

impl Rows {
    /// Rows of a file, or for the path `-` of standard output.
    fn new(path: &Path, labels: &SceneLabels, header: &str) -> Result<Self, ExportError> {
        let mut rows = if path.as_os_str() == STANDARD_OUTPUT {
            Self::Output(Some(BufWriter::new(io::stdout())))
        } else {
            Self::File(AtomicFile::create(path, &labels.input_paths())?)
        };
        rows.line(header)?;
        Ok(rows)
    }

    fn line(&mut self, text: &str) -> Result<(), ExportError> {
        match self {
            Self::File(file) => file.write(format!("{text}\n").as_bytes()),
            Self::Output(output) => put(output, |writer| writeln!(writer, "{text}")),
        }
    }

    fn finish(self) -> Result<PathBuf, ExportError> {
        match self {
            Self::File(file) => file.finish(),
            Self::Output(mut output) => {
                put(&mut output, BufWriter::flush)?;
                Ok(STANDARD_OUTPUT.into())
            }
        }
    }
}

/// Writes to standard output, until its reader has gone away.
fn put(
    output: &mut Option<BufWriter<Stdout>>,
    write: impl FnOnce(&mut BufWriter<Stdout>) -> io::Result<()>,
) -> Result<(), ExportError> {
    if !has_reader(output.as_mut().map_or(Ok(()), write))? {
        // What its buffer holds can't be written either.
        output.take().map(BufWriter::into_parts);
    }
    Ok(())
}

fn joined(numbers: impl IntoIterator<Item = f64>) -> String {
    let cells: Vec<String> = numbers.into_iter().map(|number| format!("{number:?}")).collect();
    cells.join(",")
}

/// Columns of a net force [N] and torque [N·m].
const NET_FORCE: [&str; 6] = ["fx", "fy", "fz", "tx", "ty", "tz"];

/// Writer of one row per step: poses, forces, velocities and energies.
pub struct StepsCsv {
    rows: Rows,
}

impl StepsCsv {
    /// Creates the file, or for `-` takes standard output, and writes the header.
    pub fn new(path: &Path, labels: &SceneLabels) -> Result<Self, ExportError> {
        let mut columns = vec!["t".to_string()];
        for device in &labels.devices {
            let parts = ["x", "y", "z", "fx", "fy", "fz", "proxy_x", "proxy_y", "proxy_z"];
            columns.extend(parts.map(|c| format!("{}.{c}", device.name)));
        }
        for name in &labels.objects {
            let parts = ["px", "py", "pz", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"];
            columns.extend(parts.into_iter().chain(NET_FORCE).map(|c| format!("{name}.{c}")));
        }
        for name in &labels.obstacles {
            columns.extend(NET_FORCE.map(|c| format!("{name}.{c}")));
        }
        for name in &labels.clamps {
            let parts = ["x", "y", "z", "qw", "qx", "qy", "qz", "fx", "fy", "fz", "tx", "ty", "tz"];
            columns.extend(parts.map(|c| format!("{name}.{c}")));
        }
        for probe in &labels.probes {
            columns.extend(["x", "y", "z", "ux", "uy", "uz"].map(|c| format!("{}.{c}", probe.name)));
        }
        let stored = ["kinetic", "elastic", "residual", "potential", "coupling"];
        let passed = ["input", "dissipated", "friction", "impact", "defect"];
        columns.extend(stored.into_iter().chain(passed).map(|c| format!("energy.{c}")));
        Ok(Self { rows: Rows::new(path, labels, &columns.join(","))? })
    }

    /// Writes the row of a step.
    pub fn write(
        &mut self,
        labels: &SceneLabels,
        (model, state): (&Model, &State),
        input: &Input,
    ) -> Result<(), ExportError> {
        let output = state.output();
        let mut numbers = vec![output.time_s];
        for (device, out) in input.devices.iter().zip(&output.devices) {
            numbers.extend(device.hand(out).to_array());
            numbers.extend(out.force_on_hand.to_array());
            numbers.extend(out.proxy.to_array());
        }
        for object in &output.objects {
            let q = object.pose.orientation;
            numbers.extend(object.pose.position.to_array());
            numbers.extend([q.w, q.x, q.y, q.z]);
            numbers.extend(object.twist.linear.to_array());
            numbers.extend(object.twist.angular.to_array());
            numbers.extend(object.force.to_array());
            numbers.extend(object.torque.to_array());
        }
        for obstacle in &output.obstacles {
            numbers.extend(obstacle.force.to_array());
            numbers.extend(obstacle.torque.to_array());
        }
        for (at, clamp) in output.clamps.iter().enumerate() {
            let frame = input.clamps.get(at).copied().unwrap_or(model.parameters().clamps[at].frame);
            let q = frame.orientation;
            numbers.extend(frame.position.to_array());
            numbers.extend([q.w, q.x, q.y, q.z]);
            numbers.extend(clamp.force.to_array());
            numbers.extend(clamp.torque.to_array());
        }
        for ProbeReading { position, displacement } in
            labels.probes.iter().map(|probe| probe.read(model, state))
        {
            numbers.extend(position.to_array());
            numbers.extend(displacement.to_array());
        }
        let e = &output.energy;
        numbers.extend([e.kinetic, e.elastic, e.residual, e.potential, e.coupling]);
        numbers.extend([e.input, e.dissipated, e.friction, e.impact, e.defect]);
        self.rows.line(&joined(numbers))
    }

    /// Renames the file to its final path; returns it.
    pub fn finish(self) -> Result<PathBuf, ExportError> {
        self.rows.finish()
    }
}

/// Writer of one row per contact and step.
pub struct ContactsCsv {
    rows: Rows,
}

impl ContactsCsv {
    /// Creates the file, or for `-` takes standard output, and writes the header.
    pub fn new(path: &Path, labels: &SceneLabels) -> Result<Self, ExportError> {
        let header = "t,object,against,px,py,pz,nx,ny,nz,fx,fy,fz,gap,slip_speed";
        Ok(Self { rows: Rows::new(path, labels, header)? })
    }

    /// Writes the contacts of a step.
    pub fn write(&mut self, labels: &SceneLabels, output: &Output) -> Result<(), ExportError> {
        for contact in &output.contacts {
            let against = match contact.against {
                Collider::Device(at) => &labels.devices[at].name,
                Collider::Obstacle(at) => &labels.obstacles[at],
                Collider::Object(at) => &labels.objects[at],
            };
            let vectors = [contact.point, contact.normal, contact.force].into_iter();
            let numbers = vectors.flat_map(|v| v.to_array()).chain([contact.gap, contact.slip_speed]);
            // −0 + 0 = 0.
            let numbers = numbers.map(|number| number + 0.0);
            let object = &labels.objects[contact.object];
            self.rows.line(&format!("{:?},{object},{against},{}", output.time_s, joined(numbers)))?;
        }
        Ok(())
    }

    /// Renames the file to its final path; returns it.
    pub fn finish(self) -> Result<PathBuf, ExportError> {
        self.rows.finish()
    }
}

//! Series of a run: the numbers of every step, as arrays.

use crate::arrays::array;
use crate::contacts::ContactLayout;
use glam::DVec3;
use palpate::{Input, State};
use palpate_scene::{Scene, pose_row, twist_row};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::TryReserveError;

/// Numbers of the steps of a run, step by step.
pub struct Series {
    steps: usize,
    time: Vec<f64>,
    positions: Vec<f64>,
    forces: Vec<f64>,
    proxies: Vec<f64>,
    poses: Vec<f64>,
    velocities: Vec<f64>,
    penetration: Vec<f64>,
    /// Forces and torques.
    object_loads: [Vec<f64>; 2],
    obstacle_loads: [Vec<f64>; 2],
    clamps: [Vec<f64>; 3],
    probes: [Vec<f64>; 2],
    /// Terms of the ledger, in its order.
    energy: [Vec<f64>; 10],
    unsolved: Vec<i64>,
    /// Rows of contacts; none if they are not asked for.
    contacts: Option<Vec<u8>>,
}

impl Series {
    /// Empty series with room for a number of steps.
    pub fn new(scene: &Scene, steps: usize, with_contacts: bool) -> Result<Self, TryReserveError> {
        let room = |width: usize| with_room(steps.saturating_mul(width));
        let (devices, objects) = (scene.devices.len(), scene.object_names.len());
        let (obstacles, clamps, probes) = (scene.obstacles.len(), scene.clamps.len(), scene.probes.len());
        let mut energy = [(); 10].map(|()| Vec::new());
        energy.iter_mut().try_for_each(|terms| terms.try_reserve_exact(steps))?;
        Ok(Self {
            steps: 0,
            time: room(1)?,
            positions: room(3 * devices)?,
            forces: room(3 * devices)?,
            proxies: room(3 * devices)?,
            poses: room(7 * objects)?,
            velocities: room(6 * objects)?,
            penetration: room(objects)?,
            object_loads: [room(3 * objects)?, room(3 * objects)?],
            obstacle_loads: [room(3 * obstacles)?, room(3 * obstacles)?],
            clamps: [room(7 * clamps)?, room(3 * clamps)?, room(3 * clamps)?],
            probes: [room(3 * probes)?, room(3 * probes)?],
            energy,
            unsolved: with_room(steps)?,
            contacts: with_contacts.then(Vec::new),
        })
    }

    /// Memory of a step [bytes], without contacts.
    pub fn bytes_per_step(scene: &Scene) -> f64 {
        let (devices, objects) = (scene.devices.len(), scene.object_names.len());
        let (obstacles, clamps, probes) = (scene.obstacles.len(), scene.clamps.len(), scene.probes.len());
        let energies = 10;
        let parts = 9 * devices + 20 * objects + 6 * obstacles + 13 * clamps + 6 * probes;
        8.0 * (2 + energies + parts) as f64
    }

    /// Append the last step of a state.
    ///
    /// # Errors
    /// Without memory for its contacts.
    pub fn append(
        &mut self,
        scene: &Scene,
        layout: &ContactLayout,
        input: &Input,
        state: &State,
    ) -> Result<(), TryReserveError> {
        let output = state.output();
        self.steps += 1;
        self.time.push(output.time_s);
        for (device, out) in input.devices.iter().zip(&output.devices) {
            self.positions.extend(device.hand(out).to_array());
            self.forces.extend(out.force_on_hand.to_array());
            self.proxies.extend(out.proxy.to_array());
        }
        for object in &output.objects {
            self.poses.extend(pose_row(&object.pose));
            self.velocities.extend(twist_row(&object.twist));
            self.penetration.push(object.penetration_m);
            append_load(&mut self.object_loads, object.force, object.torque);
        }
        for obstacle in &output.obstacles {
            append_load(&mut self.obstacle_loads, obstacle.force, obstacle.torque);
        }
        let [frames, forces, torques] = &mut self.clamps;
        for (frame, clamp) in input.clamps.iter().zip(&output.clamps) {
            frames.extend(pose_row(frame));
            forces.extend(clamp.force.to_array());
            torques.extend(clamp.torque.to_array());
        }
        let [points, displacements] = &mut self.probes;
        for probe in &scene.probes {
            let reading = probe.read(&scene.model, state);
            points.extend(reading.position.to_array());
            displacements.extend(reading.displacement.to_array());
        }
        for (terms, (_, value)) in self.energy.iter_mut().zip(output.energy.named()) {
            terms.push(value);
        }
        self.unsolved.push(i64::from(output.status.unsolved_islands));
        if let Some(rows) = &mut self.contacts {
            rows.try_reserve(layout.row_bytes() * output.contacts.len())?;
            output.contacts.iter().for_each(|contact| layout.append(output.time_s, contact, rows));
        }
        Ok(())
    }

    /// Arrays by name, which take the memory of the numbers.
    pub fn into_dict<'py>(
        self,
        py: Python<'py>,
        scene: &Scene,
        layout: &ContactLayout,
    ) -> PyResult<Bound<'py, PyDict>> {
        let steps = self.steps;
        let dict = PyDict::new(py);
        let set = |name: &str, numbers: Vec<f64>, extents: &[usize]| {
            dict.set_item(name, array(py, numbers, &[&[steps], extents].concat())?)
        };
        let (devices, objects) = (scene.devices.len(), scene.object_names.len());
        let (obstacles, clamps, probes) = (scene.obstacles.len(), scene.clamps.len(), scene.probes.len());
        set("time", self.time, &[])?;
        set("positions", self.positions, &[devices, 3])?;
        set("forces", self.forces, &[devices, 3])?;
        set("proxies", self.proxies, &[devices, 3])?;
        set("poses", self.poses, &[objects, 7])?;
        set("velocities", self.velocities, &[objects, 6])?;
        set("penetration", self.penetration, &[objects])?;
        let [forces, torques] = self.object_loads;
        set("object_forces", forces, &[objects, 3])?;
        set("object_torques", torques, &[objects, 3])?;
        let [forces, torques] = self.obstacle_loads;
        set("obstacle_forces", forces, &[obstacles, 3])?;
        set("obstacle_torques", torques, &[obstacles, 3])?;
        let [frames, forces, torques] = self.clamps;
        set("clamp_frames", frames, &[clamps, 7])?;
        set("clamp_forces", forces, &[clamps, 3])?;
        set("clamp_torques", torques, &[clamps, 3])?;
        let [points, displacements] = self.probes;
        set("probe_positions", points, &[probes, 3])?;
        set("probe_displacements", displacements, &[probes, 3])?;
        dict.set_item("unsolved_islands", numpy::PyArray1::from_vec(py, self.unsolved))?;
        let energy = PyDict::new(py);
        for (terms, (name, _)) in self.energy.into_iter().zip(palpate::EnergyLedger::default().named()) {
            energy.set_item(name, array(py, terms, &[steps])?)?;
        }
        dict.set_item("energy", energy)?;
        if let Some(rows) = self.contacts {
            dict.set_item("contacts", layout.array(py, rows, false)?)?;
        }
        Ok(dict)
    }
}

fn append_load([forces, torques]: &mut [Vec<f64>; 2], force: DVec3, torque: DVec3) {
    forces.extend(force.to_array());
    torques.extend(torque.to_array());
}

/// Empty list with room for a number of items.
fn with_room<T>(count: usize) -> Result<Vec<T>, TryReserveError> {
    let mut list = Vec::new();
    list.try_reserve_exact(count)?;
    Ok(list)
}

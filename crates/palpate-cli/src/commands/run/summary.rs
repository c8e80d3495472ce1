//! Summary of a run, as text and as JSON.

use super::warnings;
use glam::DVec3;
use palpate::{ClampOutput, Input, Output, ResidualFieldCache, State, StepStatus};
use palpate_export::ProbeReading;
use palpate_haptics::percentile_us;
use palpate_scene::{RunCheck, Scene, SceneClamp, Warning};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Duration;

/// Summary of a run.
pub struct Summary {
    steps: usize,
    /// Force on the hand by device and step [N].
    pub forces: Vec<Vec<DVec3>>,
    last: Output,
    /// Largest force [N] and torque [N·m] on each plane and obstacle, and on each clamp.
    obstacle_maxima: Vec<[f64; 2]>,
    clamp_maxima: Vec<[f64; 2]>,
    /// Readings of the probes at the end.
    probes: Vec<ProbeReading>,
    /// Largest residual and number of iterations.
    status: StepStatus,
    steps_out_of_budget: usize,
    /// Largest number of contacts in a step, and largest contact force [N].
    max_contacts: usize,
    max_contact_force: f64,
    start_energy: f64,
    /// Compute time of each step [ns], sorted.
    times_ns: Vec<u32>,
    index: Option<PathBuf>,
    /// Sound file, and the largest size of its samples [1, of full scale].
    sound: Option<(PathBuf, f32)>,
    check: RunCheck,
    /// Fields that the samples of the surfaces share.
    residual_fields: Vec<ResidualFieldCache>,
}

impl Summary {
    /// Summary before the first step.
    pub(super) fn new(scene: &Scene, steps: usize, start: &Output) -> Self {
        Self {
            steps,
            forces: vec![Vec::with_capacity(steps); scene.devices.len()],
            last: start.clone(),
            obstacle_maxima: vec![[0.0; 2]; scene.obstacles.len()],
            clamp_maxima: vec![[0.0; 2]; scene.clamps.len()],
            probes: Vec::new(),
            status: StepStatus::default(),
            steps_out_of_budget: 0,
            max_contacts: 0,
            max_contact_force: 0.0,
            start_energy: start.energy.stored(),
            times_ns: Vec::with_capacity(steps),
            index: None,
            sound: None,
            check: RunCheck::new(scene),
            residual_fields: Vec::new(),
        }
    }

    /// Adds a step and its compute time.
    pub(super) fn take(&mut self, input: &Input, state: &State, took: Duration) {
        let output = state.output();
        self.check.add(input, state);
        self.times_ns.push(took.as_nanos().min(u128::from(u32::MAX)) as u32);
        for (forces, device) in self.forces.iter_mut().zip(&output.devices) {
            forces.push(device.force_on_hand);
        }
        let obstacles = output.obstacles.iter().map(|obstacle| [obstacle.force, obstacle.torque]);
        raise(&mut self.obstacle_maxima, obstacles);
        raise(&mut self.clamp_maxima, output.clamps.iter().map(|clamp| [clamp.force, clamp.torque]));
        let (all, now) = (&mut self.status, &output.status);
        all.solver_residual_m = all.solver_residual_m.max(now.solver_residual_m);
        all.iterations = all.iterations.max(now.iterations);
        self.steps_out_of_budget += usize::from(now.islands_out_of_budget > 0);
        self.max_contacts = self.max_contacts.max(output.contacts.len());
        let forces = output.contacts.iter().map(|contact| contact.force.length());
        self.max_contact_force = forces.fold(self.max_contact_force, f64::max);
    }

    /// Completes the summary after the last step.
    pub(super) fn finish(
        &mut self,
        scene: &Scene,
        last: &State,
        index: Option<PathBuf>,
        sound: Option<(PathBuf, f32)>,
    ) {
        self.times_ns.sort_unstable();
        self.last = last.output().clone();
        self.probes = scene.probes.iter().map(|probe| probe.read(&scene.model, last)).collect();
        (self.index, self.sound) = (index, sound);
    }

    /// Samples the surfaces for the check of the run.
    pub(super) fn sample_surfaces(&mut self, scene: &Scene, input: &Input, state: &State) {
        self.check.sample_surfaces(scene, input, state, &mut self.residual_fields);
    }

    /// Quantile of the compute times [µs].
    pub fn time_us(&self, share: f64) -> f64 {
        percentile_us(&self.times_ns, share)
    }

    /// Summary as JSON.
    pub fn json(&self, scene: &Scene) -> Value {
        let last_force = |forces: &Vec<DVec3>| forces.last().copied().unwrap_or_default();
        let devices: Vec<Value> = scene
            .devices
            .iter()
            .zip(&self.forces)
            .zip(&self.last.devices)
            .map(|((device, forces), last)| {
                json!({
                    "name": device.name,
                    "proxy_last_m": last.proxy.to_array(),
                    "force_last_n": last_force(forces).length(),
                    "force_max_n": largest(forces),
                    "force_last_xyz_n": last_force(forces).to_array(),
                })
            })
            .collect();
        let objects: Vec<Value> = scene
            .object_names
            .iter()
            .zip(&self.last.objects)
            .zip(self.check.deformation.iter().zip(&self.check.penetration))
            .map(|((name, object), (deformation, penetration))| {
                let q = object.pose.orientation;
                json!({
                    "name": name,
                    "position_m": object.pose.position.to_array(),
                    "orientation": [q.w, q.x, q.y, q.z],
                    "velocity_m_s": object.twist.linear.to_array(),
                    "angular_velocity_rad_s": object.twist.angular.to_array(),
                    "force_last_xyz_n": object.force.to_array(),
                    "torque_last_xyz_nm": object.torque.to_array(),
                    "displacement_max_m": deformation,
                    "largest_penetration_m": penetration,
                    "is_asleep": object.is_asleep,
                })
            })
            .collect();
        let obstacles = scene.obstacles.iter().zip(&self.last.obstacles).zip(&self.obstacle_maxima);
        let obstacles: Vec<Value> = obstacles
            .map(|((obstacle, last), [force_max, torque_max])| {
                json!({
                    "name": obstacle.name,
                    "force_last_xyz_n": last.force.to_array(),
                    "torque_last_xyz_nm": last.torque.to_array(),
                    "force_max_n": force_max,
                    "torque_max_nm": torque_max,
                })
            })
            .collect();
        let clamps = scene.clamps.iter().enumerate().zip(&self.last.clamps).zip(&self.clamp_maxima);
        let clamp = |(((at, clamp), last), [force_max, torque_max]): (
            ((usize, &SceneClamp), &ClampOutput),
            &[f64; 2],
        )| {
            json!({
                "name": clamp.name,
                "cells": scene.model.clamp_cells(at),
                "force_last_xyz_n": last.force.to_array(),
                "torque_last_xyz_nm": last.torque.to_array(),
                "force_max_n": force_max,
                "torque_max_nm": torque_max,
            })
        };
        let clamps: Vec<Value> = clamps.map(clamp).collect();
        let probes: Vec<Value> = scene
            .probes
            .iter()
            .zip(&self.probes)
            .map(|(probe, ProbeReading { position, displacement })| {
                json!({
                    "name": probe.name,
                    "object": scene.object_names[probe.at.object],
                    "position_m": position.to_array(),
                    "displacement_m": displacement.to_array(),
                })
            })
            .collect();
        let energy = &self.last.energy;
        let mut json = json!({
            "steps": self.steps,
            "step_s": scene.model.parameters().step_s,
            "devices": devices,
            "objects": objects,
            "obstacles": obstacles,
            "clamps": clamps,
            "probes": probes,
            "contacts": { "count_max": self.max_contacts, "force_max_n": self.max_contact_force },
            "energy_j": {
                "kinetic": energy.kinetic,
                "elastic": energy.elastic,
                "residual": energy.residual,
                "potential": energy.potential,
                "coupling": energy.coupling,
                "input": energy.input,
                "dissipated": energy.dissipated,
                "friction": energy.friction,
                "impact": energy.impact,
                "defect": energy.defect,
                "stored_at_start": self.start_energy,
            },
            "timing_us": {
                "p50": self.time_us(0.5),
                "p99": self.time_us(0.99),
                "p999": self.time_us(0.999),
                "max": self.time_us(1.0),
            },
            "solver": {
                "constraint_residual_max_m": self.status.solver_residual_m,
                "iterations_max": self.status.iterations,
                "dependent_rows": self.check.dependent_rows,
                "dropped_contacts": self.check.dropped_contacts,
                "unsolved_steps": self.check.unsolved_steps,
                "steps_out_of_budget": self.steps_out_of_budget,
            },
            "warnings": warnings::json(scene, &self.warnings(scene)),
        });
        if let Some((path, peak)) = &self.sound {
            json["sound"] = json!({ "path": path, "peak": peak });
        }
        json
    }

    /// Summary as text.
    pub fn text(&self, scene: &Scene) -> String {
        let step_s = scene.model.parameters().step_s;
        let mut out = format!("{} steps of {} ms = {:.4} s\n", self.steps, 1000.0 * step_s, self.last.time_s);
        for (device, forces) in scene.devices.iter().zip(&self.forces) {
            let last = forces.last().copied().unwrap_or_default();
            out += &format!(
                "  {:<12} force on the hand {:.5} N at the end, {:.5} N at most\n",
                device.name,
                last.length(),
                largest(forces)
            );
        }
        for ((name, object), deformation) in
            scene.object_names.iter().zip(&self.last.objects).zip(&self.check.deformation)
        {
            // Adding 0 turns −0 into 0.
            let (p, v) = (object.pose.position + DVec3::ZERO, object.twist.linear + DVec3::ZERO);
            out += &format!(
                "  {name:<12} centre ({:.5}, {:.5}, {:.5}) m, velocity ({:.4}, {:.4}, {:.4}) m/s, deformed by up to {:.2} mm{}\n",
                p.x,
                p.y,
                p.z,
                v.x,
                v.y,
                v.z,
                1000.0 * deformation,
                if object.is_asleep { ", asleep" } else { "" }
            );
        }
        for (obstacle, last) in scene.obstacles.iter().zip(&self.last.obstacles) {
            out += &format!("  {:<12} carries {:.5} N at the end\n", obstacle.name, last.force.length());
        }
        for (clamp, last) in scene.clamps.iter().zip(&self.last.clamps) {
            out += &format!(
                "  {:<12} force on the clamp {:.5} N, torque {:.3e} N·m at the end\n",
                clamp.name,
                last.force.length(),
                last.torque.length()
            );
        }
        for (probe, ProbeReading { displacement, .. }) in scene.probes.iter().zip(&self.probes) {
            let u = 1000.0 * *displacement + DVec3::ZERO;
            out += &format!(
                "  {:<12} displaced by ({:.5}, {:.5}, {:.5}) mm at the end, body axes\n",
                probe.name, u.x, u.y, u.z
            );
        }
        if self.max_contacts > 0 {
            let deepest = self.check.penetration.iter().copied().fold(0.0, f64::max);
            out += &format!(
                "  contacts     {} at once at most, {:.5} N in one at most, {:.3} mm of penetration at most\n",
                self.max_contacts,
                self.max_contact_force,
                1000.0 * deepest
            );
        }
        out += &self.energy_line(scene);
        out += &format!(
            "  step time    {:.1} µs median; 99 % below {:.1}, 99.9 % below {:.1}, all below {:.1}\n",
            self.time_us(0.5),
            self.time_us(0.99),
            self.time_us(0.999),
            self.time_us(1.0)
        );
        out += &warnings::text(&self.warnings(scene));
        if let Some(index) = &self.index {
            out += &format!("  surfaces     {} (open it in ParaView)\n", index.display());
        }
        if let Some((path, peak)) = &self.sound {
            out += &format!("  sound        {}, {}\n", path.display(), loudness(*peak));
        }
        out
    }

    /// Warnings of the run.
    pub(super) fn warnings(&self, scene: &Scene) -> Vec<Warning> {
        self.check.warnings(scene)
    }

    /// Energy balance as a line.
    fn energy_line(&self, scene: &Scene) -> String {
        let energy = &self.last.energy;
        let moving = scene.obstacles.iter().any(|obstacle| obstacle.path.is_some());
        let bases = scene.bases.iter().any(Option::is_some);
        let movers = if bases {
            "hands, obstacles and bases"
        } else if moving {
            "hands and obstacles"
        } else {
            "the hands"
        };
        let mut lost = format!("{:.3e} J dissipated", energy.dissipated);
        if energy.friction != 0.0 || energy.impact != 0.0 {
            // Pushing out what penetrates gives energy back.
            let sign = if energy.impact < 0.0 { '+' } else { '-' };
            lost += &format!(
                " - {:.3e} J in friction {sign} {:.3e} J in impacts",
                energy.friction,
                energy.impact.abs()
            );
        }
        format!(
            "  energy       {:+.3e} J stored since the start = {:+.3e} J from {movers} - {lost}, to {:.0e} J\n",
            energy.stored() - self.start_energy,
            energy.input,
            energy.defect.abs()
        )
    }
}

/// Largest size of a sound's samples [1, of full scale] in words.
fn loudness(peak: f32) -> String {
    let decibels = 20.0 * peak.max(f32::MIN_POSITIVE).log10();
    match peak {
        0.0 => "silent: no mode from 20 Hz to 20 kHz moves".into(),
        _ if f64::from(peak) > palpate_sound::KNEE => {
            format!(
                "peak {decibels:.1} dB of full scale: the limiter acts; a larger --sound-full-scale avoids that"
            )
        }
        _ => format!("peak {decibels:.1} dB of full scale"),
    }
}

/// Raise largest forces and torques to those of a step.
fn raise(maxima: &mut [[f64; 2]], now: impl Iterator<Item = [DVec3; 2]>) {
    for (largest, now) in maxima.iter_mut().zip(now) {
        *largest = [0, 1].map(|at| largest[at].max(now[at].length()));
    }
}

fn largest(forces: &[DVec3]) -> f64 {
    forces.iter().map(|force| force.length()).fold(0.0, f64::max)
}

//! Simulation: a scene that the caller steps, with its input and output in flat arrays.

use glam::DVec3;
use palpate::{Collider, DeviceInput, DeviceMode, Grasp, Input, ResidualFieldCache, State, step};
use palpate_scene::{RunCheck, Scene, pose_of_row, pose_row, twist_row};
use std::sync::Arc;

/// Array of a simulation. The order of its rows is the scene's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Array {
    /// Input: positions of the hands at the end of the next step, rows x, y, z [m]; of a device of mode `force` the force on its object [N]. A row
    /// that is not a number takes no part.
    Positions,
    /// Input: poses of planes and obstacles at the end of the next step, rows x, y, z [m], qw, qx, qy, qz.
    Obstacles,
    /// Input: frames of the clamps, likewise.
    Clamps,
    /// Forces on the hands, rows of 3 [N].
    Forces,
    /// Tips, or held points, rows of 3 [m].
    Proxies,
    /// Poses of the objects, rows x, y, z [m], qw, qx, qy, qz.
    Poses,
    /// Velocities of the objects, rows of 3 [m/s] and 3 [rad/s].
    Velocities,
    /// Net forces and torques on the objects, rows of 3 [N] and 3 [N·m].
    ObjectLoads,
    /// Net forces and torques on planes and obstacles, likewise.
    ObstacleLoads,
    /// Reactions on the clamps, likewise.
    ClampLoads,
    /// Energies [J], in the order of [`palpate::EnergyLedger::named`].
    Energies,
    /// Contacts that carry force: rows of point [m], normal, force on the object [N], gap [m], slip speed [m/s], object, kind of the other
    /// side (0 device, 1 obstacle, 2 object), its number.
    Contacts,
}

impl Array {
    /// All arrays; their numbers in the interface are their places here.
    pub const ALL: [Self; 12] = [
        Self::Positions,
        Self::Obstacles,
        Self::Clamps,
        Self::Forces,
        Self::Proxies,
        Self::Poses,
        Self::Velocities,
        Self::ObjectLoads,
        Self::ObstacleLoads,
        Self::ClampLoads,
        Self::Energies,
        Self::Contacts,
    ];

    fn is_input(self) -> bool {
        matches!(self, Self::Positions | Self::Obstacles | Self::Clamps)
    }
}

/// Numbers of a row of [`Array::Contacts`].
const CONTACT_COLUMNS: usize = 14;

/// State of a scene with its arrays.
pub struct Simulation {
    scene: Arc<Scene>,
    state: State,
    input: Input,
    /// Modes of the devices: those of the scene, until one grasps, lets go or leaves.
    modes: Vec<DeviceMode>,
    arrays: [Vec<f64>; Array::ALL.len()],
    /// Positions of an object's nodes, rows of 3 [m, world], in single precision.
    surface: Vec<f32>,
    displacements: Vec<DVec3>,
    residual_fields: Vec<ResidualFieldCache>,
    /// Check of the steps since the start.
    check: RunCheck,
}

impl Simulation {
    /// Simulation at the start of a scene.
    pub fn new(scene: Arc<Scene>) -> Self {
        let state = State::new(&scene.model);
        let input = scene.input_at(0.0);
        let modes: Vec<DeviceMode> = scene.devices.iter().map(|device| device.mode).collect();
        let mut made = Self {
            check: RunCheck::new(&scene),
            residual_fields: scene.object_names.iter().map(|_| ResidualFieldCache::default()).collect(),
            scene,
            state,
            input,
            modes,
            arrays: Default::default(),
            surface: Vec::new(),
            displacements: Vec::new(),
        };
        *made.array_mut(Array::Positions) = vec![f64::NAN; 3 * made.modes.len()];
        *made.array_mut(Array::Obstacles) = made.input.obstacles.iter().flat_map(pose_row).collect();
        *made.array_mut(Array::Clamps) = made.input.clamps.iter().flat_map(pose_row).collect();
        let contacts = made.state.output().contacts.capacity();
        made.array_mut(Array::Contacts).reserve_exact(CONTACT_COLUMNS * contacts);
        made.write_output();
        made
    }

    /// Back to the start of the scene, with its modes. Arrays stay where they are in memory.
    pub fn reset(&mut self) {
        let mut fresh = Self::new(Arc::clone(&self.scene));
        for (own, new) in self.arrays.iter_mut().zip(&fresh.arrays) {
            own.clone_from(new);
        }
        fresh.arrays = std::mem::take(&mut self.arrays);
        *self = fresh;
    }

    /// Array as it is now.
    pub fn array(&self, array: Array) -> &[f64] {
        &self.arrays[array as usize]
    }

    /// Array; those of the input may be written, their lengths may not change.
    pub fn array_mut(&mut self, array: Array) -> &mut Vec<f64> {
        &mut self.arrays[array as usize]
    }

    /// Simulated time [s].
    pub fn time_s(&self) -> f64 {
        self.state.output().time_s
    }

    /// Steps with the input arrays; parts with a path in the scene follow it. A step allocates nothing.
    ///
    /// # Errors
    /// Text, for a motion that cannot be followed.
    pub fn step(&mut self) -> Result<(), String> {
        self.read_input();
        self.check.add_input(&self.scene, &self.input, &self.state);
        step(&self.scene.model, &mut self.state, &self.input);
        self.write_output();
        self.check.add(&self.input, &self.state);
        self.scene.check_step(&self.input, &self.state)
    }

    /// Warnings about the steps since the start, but for large deformation.
    pub fn warnings(&self) -> Vec<String> {
        self.check.warnings(&self.scene).iter().map(ToString::to_string).collect()
    }

    /// Lets a device hold the point of an object's surface that is nearest to a position [m, world].
    ///
    /// # Errors
    /// Text, when there is no such part, or the point cannot move.
    pub fn grasp(&mut self, device: usize, object: usize, position: DVec3) -> Result<(), String> {
        let recording = self
            .scene
            .model
            .recordings()
            .nth(object)
            .ok_or_else(|| format!("there is no object {object}"))?;
        let pose = self.state.output().objects[object].pose;
        let nearest = recording.surface.nearest(pose.body_from_world(position));
        let (point, _) = nearest.ok_or("the position is not finite")?;
        let grasp = Grasp { object, point };
        self.set_mode(device, DeviceMode::Held(grasp))?;
        let rest = self.scene.model.recordings().nth(object).map(|of| of.surface.rest_position(&point));
        let displacement = self.state.point_displacement(&self.scene.model, object, &point);
        let held = pose.world_from_body(rest.unwrap_or_default() + displacement);
        self.array_mut(Array::Positions)[3 * device..][..3].copy_from_slice(&held.to_array());
        Ok(())
    }

    /// Lets go: the device touches with its tip from now on.
    ///
    /// # Errors
    /// Text, when there is no such device.
    pub fn release(&mut self, device: usize) -> Result<(), String> {
        self.set_mode(device, DeviceMode::Touch)
    }

    fn set_mode(&mut self, device: usize, mode: DeviceMode) -> Result<(), String> {
        let own = self.modes.get_mut(device).ok_or_else(|| format!("there is no device {device}"))?;
        self.scene.prepare_device(device, &mode).map_err(|error| error.to_string())?;
        *own = mode;
        Ok(())
    }

    /// Positions of the nodes of an object's surface, rows of 3 [m, world]. Costs nodes × modes: for drawing, not for each step.
    pub fn surface(&mut self, object: usize) -> &[f32] {
        self.surface.clear();
        let Some(surface) = self.scene.model.recordings().nth(object).map(|recording| &recording.surface)
        else {
            return &[];
        };
        self.displacements.resize(surface.positions.len(), DVec3::ZERO);
        let deformation = self.state.deformation(object);
        let fields = &mut self.residual_fields[object];
        deformation.surface_displacement_cached(&self.scene.model, fields, &mut self.displacements);
        let pose = self.state.output().objects[object].pose;
        for (rest, displacement) in surface.positions.iter().zip(&self.displacements) {
            self.surface.extend(pose.world_from_body(*rest + *displacement).as_vec3().to_array());
        }
        &self.surface
    }

    /// Numbers of the surface that was computed last.
    pub fn surface_length(&self) -> usize {
        self.surface.len()
    }

    /// Input of the next step.
    fn read_input(&mut self) {
        self.scene.follow_next_step(&self.state, &mut self.input);
        let positions = &self.arrays[Array::Positions as usize];
        let devices = self.input.devices.iter_mut().zip(positions.as_chunks::<3>().0);
        for (((own, row), of), mode) in devices.zip(&self.scene.devices).zip(&self.modes) {
            let given = DVec3::from_array(*row);
            if of.path.is_some() && !given.is_finite() {
                match (own.mode, mode) {
                    // A force of the scene's course.
                    (DeviceMode::Force(_), DeviceMode::Force(_)) => {}
                    // It has let go of what it pushed, and is nowhere.
                    (DeviceMode::Force(_), _) => *own = DeviceInput::inactive(),
                    _ => own.mode = *mode,
                }
                continue;
            }
            *own = match *mode {
                _ if !given.is_finite() => DeviceInput::inactive(),
                DeviceMode::Force(applied) => {
                    DeviceInput::exerting(palpate::AppliedForce { force: given, ..applied })
                }
                mode => DeviceInput { position: given, mode },
            };
        }
        let obstacles = &self.arrays[Array::Obstacles as usize];
        let poses = self.input.obstacles.iter_mut().zip(obstacles.as_chunks::<7>().0);
        for ((own, row), of) in poses.zip(&self.scene.obstacles) {
            if of.path.is_none() {
                // Poses that are not finite are refused by the step.
                (*own, _) = pose_of_row(row);
            }
        }
        let clamps = &self.arrays[Array::Clamps as usize];
        let frames = self.input.clamps.iter_mut().zip(clamps.as_chunks::<7>().0);
        for ((own, row), of) in frames.zip(&self.scene.clamps) {
            if of.path.is_none() {
                (*own, _) = pose_of_row(row);
            }
        }
    }

    /// Arrays of the output.
    fn write_output(&mut self) {
        for array in Array::ALL.into_iter().filter(|array| !array.is_input()) {
            self.arrays[array as usize].clear();
        }
        let output = self.state.output();
        let arrays = &mut self.arrays;
        for device in &output.devices {
            arrays[Array::Forces as usize].extend(device.force_on_hand.to_array());
            arrays[Array::Proxies as usize].extend(device.proxy.to_array());
        }
        for object in &output.objects {
            arrays[Array::Poses as usize].extend(pose_row(&object.pose));
            arrays[Array::Velocities as usize].extend(twist_row(&object.twist));
            arrays[Array::ObjectLoads as usize].extend(object.force.to_array());
            arrays[Array::ObjectLoads as usize].extend(object.torque.to_array());
        }
        for obstacle in &output.obstacles {
            arrays[Array::ObstacleLoads as usize].extend(obstacle.force.to_array());
            arrays[Array::ObstacleLoads as usize].extend(obstacle.torque.to_array());
        }
        for clamp in &output.clamps {
            arrays[Array::ClampLoads as usize].extend(clamp.force.to_array());
            arrays[Array::ClampLoads as usize].extend(clamp.torque.to_array());
        }
        arrays[Array::Energies as usize].extend(output.energy.named().map(|(_, energy)| energy));
        for contact in &output.contacts {
            let (kind, number) = match contact.against {
                Collider::Device(number) => (0.0, number),
                Collider::Obstacle(number) => (1.0, number),
                Collider::Object(number) => (2.0, number),
            };
            let row = &mut arrays[Array::Contacts as usize];
            row.extend(contact.point.to_array());
            row.extend(contact.normal.to_array());
            row.extend(contact.force.to_array());
            row.extend([contact.gap, contact.slip_speed, contact.object as f64, kind, number as f64]);
        }
    }
}

/// Names of the energies.
#[cfg(target_arch = "wasm32")]
pub fn energy_names() -> Vec<&'static str> {
    palpate::EnergyLedger::default().named().into_iter().map(|(name, _)| name).collect()
}

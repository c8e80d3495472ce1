//! What GLB files of palpate are made of: surfaces that deform or don't, nodes that move, animations.

use super::glb::{Content, Glb};
use super::shading::Shaded;
use super::solid::Solid;
use crate::Failure;
use glam::{DQuat, DVec3};
use palpate::Pose;
use serde_json::{Value, json};

/// A surface that changes its shape.
pub struct Deforming {
    shaded: Shaded,
    rest: Vec<DVec3>,
    rest_normals: Vec<DVec3>,
    primitive: Value,
    /// What is written so far: a target per shape, and their names.
    targets: Vec<Value>,
    names: Vec<String>,
    /// Where it was.
    pub track: Track,
}

/// A node that moves.
#[derive(Default)]
pub struct Track {
    node: usize,
    /// Where it was, frame by frame.
    pub poses: Vec<Pose>,
    /// Whether it was there, where it comes and goes.
    pub there: Vec<bool>,
}

/// The world's node: y is up in glTF, and here the way against gravity; y as it is without gravity.
pub fn root(gravity: DVec3) -> Value {
    let up = gravity.try_normalize().map_or(DVec3::Y, |down| -down);
    json!({ "name": "world", "rotation": DQuat::from_rotation_arc(up, DVec3::Y).to_array(), "children": [] })
}

/// A node with a surface that does not change.
pub fn rigid(glb: &mut Glb, name: &str, surface: &Solid, look: ([f32; 3], bool)) -> Result<Track, Failure> {
    let positions = glb.vectors(surface.positions.iter().copied())?;
    let mut attributes = json!({ "POSITION": positions });
    // Without normals faces are flat.
    if let Some(normals) = &surface.normals {
        attributes["NORMAL"] = json!(glb.vectors(normals.iter().copied())?);
    }
    let indices = glb.triangles(&surface.triangles);
    let material = glb.content.material(name, look.0, look.1);
    let primitive = json!({ "attributes": attributes, "indices": indices, "material": material });
    let mesh = glb.content.mesh(json!({ "name": name, "primitives": [primitive] }));
    let node = glb.content.child(json!({ "name": name, "mesh": mesh }));
    Ok(Track { node, ..Track::default() })
}

impl Deforming {
    /// Begin with the surface at rest.
    pub fn new(
        glb: &mut Glb,
        name: &str,
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        colour: [f32; 3],
    ) -> Result<Self, Failure> {
        let shaded = Shaded::new(positions, triangles);
        let rest_normals = shaded.normals(positions);
        let attributes = json!({
            "POSITION": glb.vectors(shaded.nodes.iter().map(|&node| positions[node as usize]))?,
            "NORMAL": glb.vectors(rest_normals.iter().copied())?,
        });
        let indices = glb.triangles(&shaded.triangles);
        let material = glb.content.material(name, colour, false);
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": material });
        let node = glb.content.child(json!({ "name": name }));
        Ok(Self {
            shaded,
            rest: positions.to_vec(),
            rest_normals,
            primitive,
            targets: Vec::new(),
            names: Vec::new(),
            track: Track { node, ..Track::default() },
        })
    }

    /// Vertices and triangles.
    pub fn size(&self) -> (usize, usize) {
        (self.shaded.nodes.len(), self.shaded.triangles.len())
    }

    /// Its node.
    pub fn node(&self) -> usize {
        self.track.node
    }

    /// Add a shape, by the displacement [m, body] of the surface's nodes.
    pub fn add_shape(&mut self, glb: &mut Glb, displacement: &[DVec3], name: String) -> Result<(), Failure> {
        let positions: Vec<DVec3> = self.rest.iter().zip(displacement).map(|(rest, u)| *rest + *u).collect();
        let moved = glb.vectors(self.shaded.nodes.iter().map(|&node| displacement[node as usize]))?;
        let normals = self.shaded.normals(&positions);
        let turned = glb.vectors(normals.iter().zip(&self.rest_normals).map(|(now, rest)| *now - *rest))?;
        self.targets.push(json!({ "POSITION": moved, "NORMAL": turned }));
        self.names.push(name);
        Ok(())
    }

    /// Put the mesh together, with the weights of its shapes while nothing moves.
    pub fn finish(mut self, content: &mut Content, weights: &[f64]) {
        let node = self.track.node;
        let mut mesh = json!({ "name": content.nodes[node]["name"] });
        // Lists that are there are not empty.
        if !self.targets.is_empty() {
            self.primitive["targets"] = Value::Array(self.targets);
            mesh["weights"] = json!(weights);
            mesh["extras"] = json!({ "targetNames": self.names });
        }
        mesh["primitives"] = json!([self.primitive]);
        let mesh = content.mesh(mesh);
        content.nodes[node]["mesh"] = json!(mesh);
    }
}

/// Samplers and the channels that they move.
pub struct Animation {
    times: usize,
    samplers: Vec<Value>,
    channels: Vec<Value>,
}

impl Animation {
    /// Begin, with the accessor of its times.
    pub fn new(times: usize) -> Self {
        Self { times, samplers: Vec::new(), channels: Vec::new() }
    }

    /// Let a node's property take some values.
    pub fn channel(
        &mut self,
        glb: &mut Glb,
        node: usize,
        property: &str,
        values: impl Iterator<Item = f32>,
        form: (&str, usize),
    ) {
        self.sampled(glb, node, property, values, (form, "LINEAR"));
    }

    fn sampled(
        &mut self,
        glb: &mut Glb,
        node: usize,
        property: &str,
        values: impl Iterator<Item = f32>,
        ((kind, components), between): ((&str, usize), &str),
    ) {
        let output = glb.values(values, kind, components);
        self.channels.push(json!({
            "sampler": self.samplers.len(), "target": { "node": node, "path": property },
        }));
        self.samplers.push(json!({ "input": self.times, "output": output, "interpolation": between }));
    }

    /// Let a node be where it was; what does not move is put there.
    pub fn track(&mut self, glb: &mut Glb, track: &Track) {
        let Some(first) = track.poses.first() else { return };
        let Track { node, poses, there } = track;
        let node_json = &mut glb.content.nodes[*node];
        node_json["translation"] = json!(first.position.to_array());
        node_json["rotation"] = json!(first.orientation.to_array());
        if poses.iter().any(|pose| pose.position != first.position) {
            let values = poses.iter().flat_map(|pose| pose.position.to_array()).map(|v| v as f32);
            self.channel(glb, *node, "translation", values, ("VEC3", 3));
        }
        if poses.iter().any(|pose| pose.orientation != first.orientation) {
            let values = the_short_way(poses).flat_map(|q| q.to_array()).map(|v| v as f32);
            self.channel(glb, *node, "rotation", values, ("VEC4", 4));
        }
        // Without size it is not drawn.
        let size = |there: &bool| [if *there { 1.0 } else { 0.0 }; 3];
        if let Some(first) = there.first().filter(|_| there.contains(&false)) {
            glb.content.nodes[*node]["scale"] = json!(size(first));
            self.sampled(glb, *node, "scale", there.iter().flat_map(size), (("VEC3", 3), "STEP"));
        }
    }

    /// As the file has it.
    pub fn json(self, name: &str) -> Value {
        json!({ "name": name, "samplers": self.samplers, "channels": self.channels })
    }
}

/// Quaternions and their opposites are the same turns: those that follow one another the short way.
fn the_short_way(poses: &[Pose]) -> impl Iterator<Item = DQuat> + '_ {
    poses.iter().scan(DQuat::IDENTITY, |before, pose| {
        let q = pose.orientation;
        *before = if before.dot(q) < 0.0 { -q } else { q };
        Some(*before)
    })
}

//! Parts of GLB files: deforming and rigid surfaces, node tracks, animations.

use crate::error::ExportError;
use crate::glb::{Content, Glb};
use crate::rigid_surface::RigidSurface;
use crate::vertex_normals::ShadedSurface;
use glam::{DQuat, DVec3};
use palpate::Pose;
use serde_json::{Value, json};

/// Surface with a morph target per shape.
pub struct DeformingSurface {
    shaded: ShadedSurface,
    rest: Vec<DVec3>,
    rest_normals: Vec<DVec3>,
    primitive: Value,
    /// Morph targets, and their names.
    targets: Vec<Value>,
    names: Vec<String>,
    /// Rigid motion.
    pub track: NodeTrack,
}

/// Rigid motion of a node over the frames.
#[derive(Default)]
pub struct NodeTrack {
    node: usize,
    /// Pose, by frame.
    pub poses: Vec<Pose>,
    /// Visibility, by frame; empty when always visible.
    pub visible: Vec<bool>,
}

/// Root node: turns the direction against gravity to y, which is up in glTF; no rotation without gravity.
pub fn root_node(gravity: DVec3) -> Value {
    let up = gravity.try_normalize().map_or(DVec3::Y, |down| -down);
    json!({ "name": "world", "rotation": DQuat::from_rotation_arc(up, DVec3::Y).to_array(), "children": [] })
}

/// Adds a node with a rigid surface, a colour and whether both sides are drawn.
pub fn rigid(
    glb: &mut Glb,
    name: &str,
    surface: &RigidSurface,
    look: ([f32; 3], bool),
) -> Result<NodeTrack, ExportError> {
    let positions = glb.vectors(surface.positions.iter().copied())?;
    let mut attributes = json!({ "POSITION": positions });
    // Viewers shade flat without normals.
    if let Some(normals) = &surface.normals {
        attributes["NORMAL"] = json!(glb.vectors(normals.iter().copied())?);
    }
    let indices = glb.triangles(&surface.triangles);
    let material = glb.content.material(name, look.0, look.1);
    let primitive = json!({ "attributes": attributes, "indices": indices, "material": material });
    let mesh = glb.content.mesh(json!({ "name": name, "primitives": [primitive] }));
    let node = glb.content.child(json!({ "name": name, "mesh": mesh }));
    Ok(NodeTrack { node, ..NodeTrack::default() })
}

impl DeformingSurface {
    /// Adds the surface at rest.
    ///
    /// # Errors
    /// As [`Glb::vectors`].
    pub fn new(
        glb: &mut Glb,
        name: &str,
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        colour: [f32; 3],
    ) -> Result<Self, ExportError> {
        let shaded = ShadedSurface::new(positions, triangles);
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
            track: NodeTrack { node, ..NodeTrack::default() },
        })
    }

    /// Numbers of vertices and triangles.
    pub fn size(&self) -> (usize, usize) {
        (self.shaded.nodes.len(), self.shaded.triangles.len())
    }

    /// Index of its node.
    pub fn node(&self) -> usize {
        self.track.node
    }

    /// Adds a shape by the displacements of the surface nodes [m, body frame].
    ///
    /// # Errors
    /// As [`Glb::vectors`].
    pub fn add_shape(
        &mut self,
        glb: &mut Glb,
        displacement: &[DVec3],
        name: String,
    ) -> Result<(), ExportError> {
        let positions: Vec<DVec3> = self.rest.iter().zip(displacement).map(|(rest, u)| *rest + *u).collect();
        let moved = glb.vectors(self.shaded.nodes.iter().map(|&node| displacement[node as usize]))?;
        let normals = self.shaded.normals(&positions);
        let turned = glb.vectors(normals.iter().zip(&self.rest_normals).map(|(now, rest)| *now - *rest))?;
        self.targets.push(json!({ "POSITION": moved, "NORMAL": turned }));
        self.names.push(name);
        Ok(())
    }

    /// Completes the mesh, with the weights of the morph targets at rest.
    pub fn finish(mut self, content: &mut Content, weights: &[f64]) {
        let node = self.track.node;
        let mut mesh = json!({ "name": content.nodes[node]["name"] });
        // Empty lists are not allowed.
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

/// Animation: samplers and channels.
pub struct GlbAnimation {
    times: usize,
    samplers: Vec<Value>,
    channels: Vec<Value>,
}

impl GlbAnimation {
    /// Empty animation with the accessor of its key times.
    pub fn new(times: usize) -> Self {
        Self { times, samplers: Vec::new(), channels: Vec::new() }
    }

    /// Adds a channel for a node's property, linear between the key times; `form` is the accessor type and its length.
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

    /// Adds channels for a track; a constant pose is set on the node instead.
    pub fn track(&mut self, glb: &mut Glb, track: &NodeTrack) {
        let Some(first) = track.poses.first() else { return };
        let NodeTrack { node, poses, visible } = track;
        let node_json = &mut glb.content.nodes[*node];
        node_json["translation"] = json!(first.position.to_array());
        node_json["rotation"] = json!(first.orientation.to_array());
        if poses.iter().any(|pose| pose.position != first.position) {
            let values = poses.iter().flat_map(|pose| pose.position.to_array()).map(|v| v as f32);
            self.channel(glb, *node, "translation", values, ("VEC3", 3));
        }
        if poses.iter().any(|pose| pose.orientation != first.orientation) {
            let values = shortest_rotations(poses).flat_map(|q| q.to_array()).map(|v| v as f32);
            self.channel(glb, *node, "rotation", values, ("VEC4", 4));
        }
        // Scale 0 hides the node.
        let size = |visible: &bool| [if *visible { 1.0 } else { 0.0 }; 3];
        if let Some(first) = visible.first().filter(|_| visible.contains(&false)) {
            glb.content.nodes[*node]["scale"] = json!(size(first));
            self.sampled(glb, *node, "scale", visible.iter().flat_map(size), (("VEC3", 3), "STEP"));
        }
    }

    /// JSON of the animation.
    pub fn json(self, name: &str) -> Value {
        json!({ "name": name, "samplers": self.samplers, "channels": self.channels })
    }
}

/// Orientations with the signs that interpolate the short way: q and −q are the same rotation.
fn shortest_rotations(poses: &[Pose]) -> impl Iterator<Item = DQuat> + '_ {
    poses.iter().scan(DQuat::IDENTITY, |before, pose| {
        let q = pose.orientation;
        *before = if before.dot(q) < 0.0 { -q } else { q };
        Some(*before)
    })
}

//! Static data of a scene that a page fetches: surfaces and mode shapes.

use crate::protocol::{mode_shapes_bytes, surface_bytes};
use palpate::{Model, Shape};

/// Kind of static data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum StaticData {
    /// Surface of an object, by index.
    ObjectSurface(usize),
    /// Mode shapes of an object, by index.
    ModeShapes(usize),
    /// Surface of an obstacle that is a mesh, by index.
    ObstacleSurface(usize),
}

impl StaticData {
    /// Generation and data of a path, as `scene/3/object/0/surface`.
    pub fn parse(path: &str) -> Option<(u32, Self)> {
        let parts: Vec<&str> = path.split('/').collect();
        let ["scene", generation, kind, index, data] = parts[..] else { return None };
        let index = index.parse().ok()?;
        let data = match (kind, data) {
            ("object", "surface") => Self::ObjectSurface(index),
            ("object", "mode_shapes") => Self::ModeShapes(index),
            ("obstacle", "surface") => Self::ObstacleSurface(index),
            _ => return None,
        };
        Some((generation.parse().ok()?, data))
    }

    /// Encoded data of a model; none if it has no such part.
    pub fn encode(self, model: &Model) -> Option<Vec<u8>> {
        match self {
            Self::ObjectSurface(index) => {
                let surface = &model.recordings().nth(index)?.surface;
                Some(surface_bytes(&surface.positions, &surface.triangles))
            }
            Self::ModeShapes(index) => {
                let recording = model.recordings().nth(index)?;
                Some(mode_shapes_bytes(&recording.modes, recording.surface.positions.len()))
            }
            Self::ObstacleSurface(index) => match &model.parameters().obstacles.get(index)?.shape {
                Shape::Mesh(mesh) => {
                    Some(surface_bytes(&mesh.surface().positions, &mesh.surface().triangles))
                }
                _ => None,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_name_their_data_and_others_none() {
        let parsed = StaticData::parse;
        assert_eq!(parsed("scene/3/object/0/surface"), Some((3, StaticData::ObjectSurface(0))));
        assert_eq!(parsed("scene/3/object/1/mode_shapes"), Some((3, StaticData::ModeShapes(1))));
        assert_eq!(parsed("scene/1/obstacle/2/surface"), Some((1, StaticData::ObstacleSurface(2))));
        for wrong in [
            "",
            "scene",
            "scene/x/object/0/surface",
            "scene/1/obstacle/0/mode_shapes",
            "scene/1/object/-1/surface",
        ] {
            assert_eq!(parsed(wrong), None, "{wrong}");
        }
    }
}

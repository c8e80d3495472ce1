//! The two forms of the response in scenes that are run by the program `palpate`.

use crate::error::ReproduceError;
use crate::options::Options;
use crate::processes::{finish, start};
use glam::DVec3;
use palpate::Recording;
use palpate_fem::RecordedBody;

/// The paper's step [s] and window.
pub const STEP_S: f64 = 2e-3;
pub const SAMPLES: usize = 500;

/// Row of the paper in a table of cycles with so many columns: name, force time, cycle, late cycles, and what it does not state.
pub fn paper_cycle(columns: usize) -> Vec<String> {
    let mut row = ["the paper, 500 Hz", "0.5 ms at most", "2 ms at most", "none"].map(String::from).to_vec();
    row.resize(columns, "not stated".into());
    row
}

/// Form of the response of an object in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Modes and residual compliance.
    Modal,
    /// The recorded table R[s], by direct convolution.
    Table,
}

impl Form {
    /// Name in tables and answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Modal => "modal form",
            Self::Table => "R[s], T = 500",
        }
    }

    /// Part of file names.
    pub fn word(self) -> &'static str {
        match self {
            Self::Modal => "modal",
            Self::Table => "table",
        }
    }

    /// Lines of a scene for an object `cube` of a recording without its ending; a table has the recording's name.
    pub fn object(self, recording: &str) -> String {
        let response = match self {
            Self::Modal => "modal",
            Self::Table => "fir",
        };
        format!(
            "\n[[object]]\nname = \"cube\"\nrecording = \"{recording}.palp\"\nresponse = \"{response}\"\n"
        )
    }
}

/// Nodes of the triangles that some points of the surface [m] lie on, ascending: where a table has to be touchable for them to be held.
pub fn held_nodes(body: &RecordedBody, points: &[DVec3]) -> Vec<u32> {
    let recording: &Recording = &body.recording;
    let surface_nodes = body.surface_nodes();
    let found = points.iter().filter_map(|point| recording.surface.nearest(*point));
    let corners = found.flat_map(|(point, _)| recording.surface.corners(&point));
    let mut nodes: Vec<u32> = corners.map(|(node, _)| surface_nodes[node]).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Arguments of `palpate record` for the paper's table of the cube with a damping α,β, touchable at some nodes, as a store of a name.
pub fn record_arguments(cells: u32, recording: &str, damping: &str, nodes: &[u32]) -> Vec<String> {
    let nodes: Vec<String> = nodes.iter().map(u32::to_string).collect();
    let source = format!("box:0.1x0.1x0.1/{cells}x{cells}x{cells}");
    let text = format!(
        "record {source} --order 1 --young 2000 --poisson 0.49 --density 110 --rayleigh {damping} --dense {recording}.zarr --step {STEP_S} \
         --duration {} --touchable nodes:{}",
        STEP_S * SAMPLES as f64,
        nodes.join(",")
    );
    text.split_whitespace().map(str::to_owned).collect()
}

/// Records the paper's table as [`record_arguments`] says into the folder of the scenes; gives the arguments.
pub fn record_table(
    options: &Options,
    (cells, recording): (u32, &str),
    damping: &str,
    nodes: &[u32],
) -> Result<Vec<String>, ReproduceError> {
    let arguments = record_arguments(cells, recording, damping, nodes);
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    // A store of other nodes or cells can't be gone on with.
    let store = options.scenes().join(format!("{recording}.zarr"));
    if store.exists() {
        std::fs::remove_dir_all(&store).map_err(|e| ReproduceError::folder(&store, e))?;
    }
    finish(start(&options.program, &options.scenes(), &words)?)?;
    Ok(arguments)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::cube;
    use palpate_fem::SilentProgress;

    #[test]
    fn a_table_is_touchable_at_the_corners_of_the_held_triangles() {
        let body = cube(4, 20, &mut SilentProgress).expect("a cube");
        let sides = [DVec3::X * -0.05, DVec3::X * 0.05];
        let nodes = held_nodes(&body, &sides);
        assert!(nodes.is_sorted() && (2..=6).contains(&nodes.len()), "{nodes:?}");
        for side in sides {
            assert!(nodes.contains(&(body.nearest_node(side) as u32)), "{side} is held");
        }
        let arguments = record_arguments(4, "cube", "2,2e-4", &nodes[..1]).join(" ");
        assert!(
            arguments.ends_with(&format!(
                "--rayleigh 2,2e-4 --dense cube.zarr --step 0.002 --duration 1 --touchable nodes:{}",
                nodes[0]
            )),
            "{arguments}"
        );
    }
}

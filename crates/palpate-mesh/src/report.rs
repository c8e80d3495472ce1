//! Report on a mesh file: its content, its state, and what a recording will say of it.

use crate::check::size_question;
use crate::error::MeshError;
use crate::faces::{Sets, dihedral_angles, tet_volume};
use crate::mesher::{MeshingParameters, MeshingReport, WatchFn, tetrahedralise};
use crate::read::MeshFile;
use crate::repair::{PieceChoice, Repair};
use crate::surface_mesh::{SurfaceFile, SurfaceMesh};
use crate::volume_mesh::{Mesh, VolumeFile};
use glam::DVec3;
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};

/// Width of the bins of the histogram of dihedral angles [°].
pub const ANGLE_BIN_DEG: f64 = 10.0;

/// Report on a mesh file.
#[derive(Debug, Clone, Serialize)]
pub struct MeshReport {
    /// Format, version and encoding.
    pub format: String,
    /// Number of nodes in the file.
    pub nodes: usize,
    /// Number of elements by the plural of their shape.
    pub elements: BTreeMap<String, usize>,
    /// Corners of the bounding box of the used nodes [m], after scaling.
    pub bounding_box_m: [[f64; 3]; 2],
    /// Question about the unit of the file.
    pub unit_question: Option<String>,
    /// Filling of a surface with tetrahedra.
    pub meshing: Option<MeshingReport>,
    /// Tetrahedra: of the file, or inside its surface.
    pub volume: Option<VolumeReport>,
    /// Boundary of the tetrahedra, or the surface.
    pub surface: SurfaceReport,
    /// Repairs and oddities, a sentence each.
    pub warnings: Vec<String>,
    /// Fault that keeps the mesh from being recorded or touched.
    pub problem: Option<String>,
}

/// Tetrahedra of a report.
#[derive(Debug, Clone, Serialize)]
pub struct VolumeReport {
    /// Number of tetrahedra, after repair.
    pub tetrahedra: usize,
    /// Number of tetrahedra with a curved edge, by the mid-edge nodes of the file.
    pub curved_tetrahedra: usize,
    /// Volume [m³], with curved edges.
    pub volume_m3: f64,
    /// Pieces that share no face, the largest first.
    pub pieces: Vec<PieceReport>,
    /// Regions.
    pub regions: Vec<RegionReport>,
    /// Names and numbers of nodes of the groups.
    pub groups: Vec<(String, usize)>,
    /// Smallest and largest dihedral angle [°].
    pub dihedral_range_deg: [f64; 2],
    /// Dihedral angles by bins of [`ANGLE_BIN_DEG`] from 0°.
    pub dihedral_histogram: Vec<usize>,
}

/// Piece of a body.
#[derive(Debug, Clone, Serialize)]
pub struct PieceReport {
    /// Number of tetrahedra.
    pub tetrahedra: usize,
    /// Volume [m³].
    pub volume_m3: f64,
    /// Centroid of its first tetrahedron [m].
    pub near_m: [f64; 3],
}

/// Region of a body.
#[derive(Debug, Clone, Serialize)]
pub struct RegionReport {
    /// Number in the file.
    pub number: i64,
    /// Name in the file.
    pub name: Option<String>,
    /// Number of tetrahedra.
    pub tetrahedra: usize,
    /// Volume [m³].
    pub volume_m3: f64,
    /// Material in the file.
    pub material: Option<String>,
}

/// Triangles of a report.
#[derive(Debug, Clone, Serialize)]
pub struct SurfaceReport {
    /// Number of triangles.
    pub triangles: usize,
    /// Number of vertices, after joining those on one point.
    pub vertices: usize,
    /// Edges of one triangle only: the surface is open there.
    pub open_edges: usize,
    /// Edges of more than two triangles: the surface meets itself there.
    pub crossing_edges: usize,
    /// Edges whose two triangles are oriented against each other.
    pub flipped_edges: usize,
    /// Parts that share no edge.
    pub parts: usize,
    /// Enclosed volume [m³], if the surface is closed; negative if its triangles face inwards.
    pub volume_m3: Option<f64>,
}

impl SurfaceReport {
    /// Whether every edge has two triangles.
    pub fn is_watertight(&self) -> bool {
        self.triangles > 0 && self.open_edges == 0 && self.crossing_edges == 0
    }

    fn of(surface: &SurfaceMesh) -> Self {
        // Uses of each edge, in its direction and against it, and a triangle of it.
        let mut edges: HashMap<[u32; 2], (usize, usize, u32)> = HashMap::new();
        let mut sets = Sets::new(surface.triangles.len());
        for (triangle, &[a, b, c]) in (0..).zip(&surface.triangles) {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let edge = edges.entry([from.min(to), from.max(to)]).or_insert((0, 0, triangle));
                if from < to {
                    edge.0 += 1;
                } else {
                    edge.1 += 1;
                }
                sets.join(edge.2, triangle);
            }
        }
        let count = |is: &dyn Fn(usize, usize) -> bool| edges.values().filter(|(f, b, _)| is(*f, *b)).count();
        let open_edges = count(&|forward, back| forward + back == 1);
        Self {
            triangles: surface.triangles.len(),
            vertices: surface.positions.len(),
            open_edges,
            crossing_edges: count(&|forward, back| forward + back > 2),
            flipped_edges: count(&|forward, back| forward + back == 2 && forward != back),
            parts: (0..surface.triangles.len() as u32).filter(|&at| sets.root(at) == at).count(),
            volume_m3: (open_edges == 0 && !surface.triangles.is_empty()).then(|| surface.volume()),
        }
    }
}

impl MeshReport {
    /// Report on a file, after scaling to metres and repair, and the tetrahedra that a recording takes, if there is no problem.
    pub fn new(
        file: MeshFile,
        scale: f64,
        repair: &Repair,
        meshing: &MeshingParameters,
        watch: WatchFn,
    ) -> (Self, Option<Mesh>) {
        match file {
            MeshFile::Volume(_) if meshing.cell_size.is_some() => {
                let (report, _) = Self::new(file, scale, repair, &MeshingParameters::default(), watch);
                (Self { problem: Some(MeshError::CellSizeOfSolids.to_string()), ..report }, None)
            }
            MeshFile::Volume(file) => Self::of_volume(file, scale, repair),
            MeshFile::Surface(file) => Self::of_surface(file, scale, repair, meshing, watch),
        }
    }

    fn of_volume(file: VolumeFile, scale: f64, repair: &Repair) -> (Self, Option<Mesh>) {
        let VolumeFile { format, elements, mut mesh } = file;
        let nodes = mesh.nodes.len();
        // By the report's own question, which knows the scale.
        mesh.is_unit_asked = true;
        let pieces_before = |mesh: &Mesh| mesh.used_nodes().map(|_| mesh.pieces()).unwrap_or_default();
        // All pieces are listed, also where one is chosen.
        let whole = Repair { piece: PieceChoice::Only, ..*repair };
        let mut problem = mesh.scale(scale).and_then(|()| mesh.repair(&whole)).err();
        let pieces = pieces_before(&mesh);
        if problem.is_none() {
            problem = mesh.repair(repair).err();
        }
        let mesh = match mesh.clone().checked() {
            Ok(checked) => checked,
            Err(error) => {
                problem.get_or_insert(error);
                mesh
            }
        };
        let is_usable = mesh.used_nodes().is_ok();
        if problem.is_none() {
            problem = mesh.check_curved().err();
        }
        let mut surface = SurfaceMesh {
            triangles: if is_usable { mesh.boundary() } else { Vec::new() },
            positions: mesh.nodes.clone(),
        };
        surface.remove_unused_nodes();
        let bounding_box = bounds(&surface.positions);
        let problem = problem.map(|error| error.to_string());
        let report = Self {
            format,
            nodes,
            elements: elements.into_iter().map(|(shape, count)| (shape.to_owned(), count)).collect(),
            bounding_box_m: bounding_box.map(|corner| corner.to_array()),
            unit_question: size_question(bounding_box[1] - bounding_box[0], scale).filter(|_| is_usable),
            meshing: None,
            volume: is_usable.then(|| VolumeReport::of(&mesh, pieces)),
            surface: SurfaceReport::of(&surface),
            warnings: mesh.warnings.clone(),
            problem,
        };
        let is_sound = report.problem.is_none();
        (report, is_sound.then_some(mesh))
    }

    fn of_surface(
        file: SurfaceFile,
        scale: f64,
        repair: &Repair,
        meshing: &MeshingParameters,
        watch: WatchFn,
    ) -> (Self, Option<Mesh>) {
        let SurfaceFile { format, mesh: mut surface } = file;
        let nodes = surface.positions.len();
        let elements = BTreeMap::from([("triangles", surface.triangles.len())]);
        let filled = surface.scale(scale).and_then(|()| tetrahedralise(&surface, meshing, watch));
        let (tetrahedra, meshing, refused) = match filled {
            Ok((mesh, meshing)) => (mesh, Some(meshing), None),
            Err(error) => (Mesh::default(), None, Some(error.to_string())),
        };
        let file = VolumeFile { format, elements, mesh: tetrahedra };
        let (report, mesh) = Self::of_volume(file, 1.0, repair);
        surface.weld();
        let bounding_box = bounds(&surface.positions);
        let report = Self {
            nodes,
            bounding_box_m: bounding_box.map(|corner| corner.to_array()),
            unit_question: size_question(bounding_box[1] - bounding_box[0], scale),
            meshing,
            surface: SurfaceReport::of(&surface),
            problem: refused.or(report.problem),
            ..report
        };
        (report, mesh)
    }
}

impl VolumeReport {
    fn of(mesh: &Mesh, pieces: Vec<crate::pieces::Piece>) -> Self {
        let is_curved = mesh.is_curved();
        let mut curved_tetrahedra = 0;
        let volume = |tet: &[u32; 4]| {
            let element = is_curved.then(|| mesh.quadratic_tet(tet)).filter(|element| !element.is_straight());
            curved_tetrahedra += usize::from(element.is_some());
            element.map_or_else(|| tet_volume(&mesh.nodes, tet), |element| element.volume()).abs()
        };
        let volumes: Vec<f64> = mesh.tets.iter().map(volume).collect();
        let mut regions: Vec<RegionReport> = mesh
            .regions
            .iter()
            .map(|region| RegionReport {
                number: region.tag,
                name: region.name.clone(),
                tetrahedra: 0,
                volume_m3: 0.0,
                material: region.material.as_ref().map(|material| material.name.clone()),
            })
            .collect();
        for (region, volume) in mesh.tet_regions.iter().zip(&volumes) {
            let region = &mut regions[*region as usize];
            region.tetrahedra += 1;
            region.volume_m3 += volume;
        }
        let mut histogram = vec![0; (180.0 / ANGLE_BIN_DEG) as usize];
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for angle in mesh.tets.iter().flat_map(|tet| dihedral_angles(&mesh.nodes, tet)).map(f64::to_degrees) {
            (least, most) = (least.min(angle), most.max(angle));
            let bin = ((angle / ANGLE_BIN_DEG) as usize).min(histogram.len() - 1);
            histogram[bin] += 1;
        }
        let pieces = pieces.into_iter().map(|piece| PieceReport {
            tetrahedra: piece.tets.len(),
            volume_m3: piece.volume,
            near_m: piece.near.to_array(),
        });
        Self {
            tetrahedra: mesh.tets.len(),
            curved_tetrahedra,
            volume_m3: volumes.iter().sum(),
            pieces: pieces.collect(),
            regions,
            groups: mesh.groups.iter().map(|group| (group.name.clone(), group.nodes.len())).collect(),
            dihedral_range_deg: [least, most],
            dihedral_histogram: histogram,
        }
    }
}

/// Corners of the bounding box of finite points [m].
fn bounds(points: &[DVec3]) -> [DVec3; 2] {
    let finite = || points.iter().copied().filter(|point| point.is_finite());
    [finite().reduce(DVec3::min).unwrap_or_default(), finite().reduce(DVec3::max).unwrap_or_default()]
}

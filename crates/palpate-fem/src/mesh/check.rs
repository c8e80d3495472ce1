//! Is a mesh one sound body? Repairs what is harmless, refuses the rest and says where.

use super::{Mesh, MeshError};
use glam::DVec3;

/// A tetrahedron is flat when its volume is below this share of its longest edge cubed: its stiffness
/// would be round-off.
const FLAT_BELOW: f64 = 1e-10;

/// Mean-ratio quality (1: regular, 0: flat) below which a tetrahedron gets a remark.
const POOR_BELOW: f64 = 0.03;

/// Bodies outside of this range of extents [m] are most likely in another unit.
const USUAL_EXTENT: [f64; 2] = [1e-3, 3.0];

/// Nodes closer than this share of the mesh's diagonal are one point: some times the rounding of a file in f32.
pub(super) const COINCIDENT: f64 = 1e-6;

/// Signed volume [m³].
pub(crate) fn tet_volume(nodes: &[DVec3], tet: &[u32; 4]) -> f64 {
    let [a, b, c, d] = tet.map(|n| nodes[n as usize]);
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// Faces of a tetrahedron of positive volume, counter-clockwise seen from outside.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

/// A face as it lies in a tetrahedron: sorted nodes, which way round, whose.
type Face = ([u32; 3], bool, u32);

/// Every face of every tetrahedron, sorted so that shared ones are neighbours.
fn faces(tets: &[[u32; 4]]) -> Vec<Face> {
    let mut faces = Vec::with_capacity(4 * tets.len());
    for (number, tet) in tets.iter().enumerate() {
        for corners in FACES {
            let [mut a, mut b, mut c] = corners.map(|corner| tet[corner]);
            let mut even = true;
            if a > b {
                (a, b, even) = (b, a, !even);
            }
            if b > c {
                (b, c, even) = (c, b, !even);
            }
            if a > b {
                (a, b, even) = (b, a, !even);
            }
            faces.push(([a, b, c], even, number as u32));
        }
    }
    faces.sort_unstable();
    faces
}

/// Triangles that belong to one tetrahedron only, counter-clockwise seen from outside, in the order of
/// their sorted nodes.
pub fn boundary(tets: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let faces = faces(tets);
    let lone = faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1);
    lone.map(|same| {
        let ([a, b, c], even, _) = same[0];
        if even { [a, b, c] } else { [a, c, b] }
    })
    .collect()
}

/// Check a mesh and turn its tetrahedra to positive volume. Remarks are added to the mesh.
///
/// # Errors
/// [`MeshError::Unusable`] for a mesh that is empty, not finite, degenerate, duplicated, folded over
/// itself, or in several pieces.
pub fn check(mut mesh: Mesh) -> Result<Mesh, MeshError> {
    let unusable = |what: String| Err(MeshError::Unusable(what));
    if mesh.tets.is_empty() {
        return unusable("the mesh has no tetrahedra; palpate needs a volume mesh, not a surface".into());
    }
    let mut used = vec![false; mesh.nodes.len()];
    for (number, tet) in mesh.tets.iter().enumerate() {
        for &node in tet {
            match mesh.nodes.get(node as usize) {
                None => {
                    return unusable(format!(
                        "tetrahedron {number} names node {node} of {}",
                        mesh.nodes.len()
                    ));
                }
                Some(p) if !p.is_finite() => {
                    return unusable(format!(
                        "node {node} is at {p}, which is not finite (in tetrahedron {number}; both counted from 0)"
                    ));
                }
                Some(_) => used[node as usize] = true,
            }
        }
    }
    let (low, high) = extent(&mesh, &used);
    let unused = used.iter().filter(|used| !**used).count();
    if unused > 0 {
        mesh.remarks.push(format!("{unused} nodes belong to no tetrahedron and are left out"));
    }
    turn_upright(&mut mesh)?;
    let faces = faces(&mesh.tets);
    check_faces(&mesh, &faces)?;
    let coincident = coincident_pairs(&mesh.nodes, &used, COINCIDENT * (high - low).length());
    check_connected(&mesh, &faces, coincident.first().copied())?;
    if let Some(&(a, b)) = coincident.first() {
        mesh.remarks.push(format!(
            "{} pairs of nodes lie on the same point (nodes {a} and {b}, counted from 0, at {}): the body is slit open there. If it \
             should not be, use --merge-nodes",
            coincident.len(),
            place(mesh.nodes[a as usize])
        ));
    }
    remark_on_size(&mut mesh, high - low);
    remark_on_quality(&mut mesh);
    Ok(mesh)
}

/// Let tetrahedra and groups use one node where several lie on the same point. Gives the number of nodes that are no
/// longer used.
pub fn merge_nodes(mesh: &mut Mesh) -> usize {
    let mut used = vec![false; mesh.nodes.len()];
    let known = mesh.tets.iter().flatten().filter(|&&node| (node as usize) < mesh.nodes.len());
    known.for_each(|&node| used[node as usize] = true);
    let (low, high) = extent(mesh, &used);
    let mut first: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    let pairs = coincident_pairs(&mesh.nodes, &used, COINCIDENT * (high - low).length());
    for (a, b) in pairs {
        first[b as usize] = first[a as usize];
    }
    let renumber = |nodes: &mut [u32]| {
        nodes.iter_mut().for_each(|node| *node = first.get(*node as usize).copied().unwrap_or(*node));
    };
    mesh.tets.iter_mut().for_each(|tet| renumber(tet));
    for group in &mut mesh.groups {
        renumber(&mut group.nodes);
        group.nodes.sort_unstable();
        group.nodes.dedup();
    }
    first.iter().enumerate().filter(|(at, first)| *at as u32 != **first).count()
}

fn place(p: DVec3) -> String {
    format!("({:.4e}, {:.4e}, {:.4e}) m", p.x, p.y, p.z)
}

fn centre(mesh: &Mesh, tet: u32) -> DVec3 {
    mesh.tets[tet as usize].iter().map(|&n| mesh.nodes[n as usize]).sum::<DVec3>() * 0.25
}

fn extent(mesh: &Mesh, used: &[bool]) -> (DVec3, DVec3) {
    let points = || mesh.nodes.iter().zip(used).filter(|(p, used)| **used && p.is_finite()).map(|(p, _)| *p);
    (points().reduce(DVec3::min).unwrap_or_default(), points().reduce(DVec3::max).unwrap_or_default())
}

/// Swap two corners where the volume is negative; refuse flat tetrahedra.
fn turn_upright(mesh: &mut Mesh) -> Result<(), MeshError> {
    let (mut turned, mut flat) = (0, Vec::new());
    for (number, tet) in mesh.tets.iter_mut().enumerate() {
        let corners = tet.map(|n| mesh.nodes[n as usize]);
        let edges = crate::element::EDGES.map(|[a, b]| (corners[a] - corners[b]).length());
        let longest = edges.into_iter().fold(0.0, f64::max);
        let volume = tet_volume(&mesh.nodes, tet);
        // Beyond 1e100 m a volume overflows: that is no size either.
        if volume.abs() <= FLAT_BELOW * longest.powi(3) || !volume.is_finite() {
            flat.push(number as u32);
        } else if volume < 0.0 {
            tet.swap(2, 3);
            turned += 1;
        }
    }
    if let Some(&worst) = flat.first() {
        return Err(MeshError::Unusable(format!(
            "{} tetrahedra are flat or repeat a node, first tetrahedron {worst} (nodes {:?}, all counted from 0) near {}",
            flat.len(),
            mesh.tets[worst as usize],
            place(centre(mesh, worst))
        )));
    }
    if turned > 0 {
        mesh.remarks.push(format!(
            "{turned} of {} tetrahedra were inverted (corners in the other order) and were turned",
            mesh.tets.len()
        ));
    }
    Ok(())
}

/// Each face must join at most two tetrahedra, on opposite sides.
fn check_faces(mesh: &Mesh, faces: &[Face]) -> Result<(), MeshError> {
    let mut sorted: Vec<_> = mesh
        .tets
        .iter()
        .enumerate()
        .map(|(number, tet)| {
            let mut key = *tet;
            key.sort_unstable();
            (key, number as u32)
        })
        .collect();
    sorted.sort_unstable();
    let same_nodes = sorted.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    let doubled: Vec<_> = same_nodes.map(|pair| (pair[0].1, pair[1].1)).collect();
    let (mut crowded, mut folded) = (Vec::new(), Vec::new());
    for same in faces.chunk_by(|a, b| a.0 == b.0) {
        match same {
            [_] => {}
            [a, b] if a.1 != b.1 => {}
            [a, b] => folded.push((a.2, b.2)),
            more => crowded.push((more[0].2, more[1].2)),
        }
    }
    let report = |pairs: &[(u32, u32)], what: &str| {
        let (a, b) = pairs[0];
        Err(MeshError::Unusable(format!(
            "{} {what}, first tetrahedra {a} and {b} (counted from 0) near {}",
            pairs.len(),
            place(centre(mesh, a))
        )))
    };
    if !doubled.is_empty() {
        return report(&doubled, "tetrahedra are duplicated (the same four nodes)");
    }
    if !crowded.is_empty() {
        return report(&crowded, "faces belong to more than two tetrahedra: parts of the mesh overlap");
    }
    if !folded.is_empty() {
        return report(
            &folded,
            "faces have both their tetrahedra on the same side: the mesh is inverted or folded there",
        );
    }
    Ok(())
}

/// All tetrahedra must hang together through faces.
fn check_connected(mesh: &Mesh, faces: &[Face], coincident: Option<(u32, u32)>) -> Result<(), MeshError> {
    let mut parent: Vec<u32> = (0..mesh.tets.len() as u32).collect();
    fn root(parent: &mut [u32], mut at: u32) -> u32 {
        while parent[at as usize] != at {
            parent[at as usize] = parent[parent[at as usize] as usize];
            at = parent[at as usize];
        }
        at
    }
    for same in faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 2) {
        let (a, b) = (root(&mut parent, same[0].2), root(&mut parent, same[1].2));
        parent[a.max(b) as usize] = a.min(b);
    }
    let mut sizes = std::collections::BTreeMap::new();
    for tet in 0..mesh.tets.len() as u32 {
        *sizes.entry(root(&mut parent, tet)).or_insert(0_usize) += 1;
    }
    if sizes.len() == 1 {
        return Ok(());
    }
    let pieces: Vec<String> = sizes
        .iter()
        .take(4)
        .map(|(&first, size)| format!("{size} tetrahedra near {}", place(centre(mesh, first))))
        .collect();
    let more = if sizes.len() > 4 { ", …" } else { "" };
    let advice = match coincident {
        Some((a, b)) => {
            format!("; nodes {a} and {b} lie on the same point, --merge-nodes joins such nodes")
        }
        None => "; keep one piece, or record each on its own".into(),
    };
    Err(MeshError::Unusable(format!(
        "the mesh is disconnected: {} pieces that share no face ({}{more}){advice}",
        sizes.len(),
        pieces.join(", ")
    )))
}

/// Pairs (first, other) of used nodes within `tolerance` [m], each other node once: nodes are sorted into cells of that
/// size and compared with those in the neighbouring cells.
pub(super) fn coincident_pairs(places: &[DVec3], used: &[bool], tolerance: f64) -> Vec<(u32, u32)> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Vec::new();
    }
    let cell = |p: DVec3| (p / tolerance).floor();
    let key = |cell: DVec3| cell.to_array().map(f64::to_bits);
    let mut firsts: std::collections::HashMap<[u64; 3], Vec<u32>> = std::collections::HashMap::new();
    let mut pairs = Vec::new();
    let nodes = (0..places.len() as u32).filter(|&n| used[n as usize] && places[n as usize].is_finite());
    for node in nodes {
        let position = places[node as usize];
        let home = cell(position);
        let around =
            (0..27).map(|at: i32| DVec3::new(f64::from(at % 3), f64::from(at / 3 % 3), f64::from(at / 9)));
        let near = around
            // Adding 0 turns −0 into 0, which has other bits.
            .filter_map(|shift| firsts.get(&key(home + shift - DVec3::ONE + DVec3::ZERO)))
            .flatten()
            .find(|&&first| (places[first as usize] - position).length() <= tolerance);
        match near {
            Some(&first) => pairs.push((first, node)),
            None => firsts.entry(key(home + DVec3::ZERO)).or_default().push(node),
        }
    }
    pairs
}

fn remark_on_size(mesh: &mut Mesh, extent: DVec3) {
    let largest = extent.max_element();
    let [small, large] = USUAL_EXTENT;
    if largest > large {
        mesh.remarks
            .push(format!("the body is {largest} m large; if the file is in millimetres, use --scale 0.001"));
    } else if largest < small {
        mesh.remarks.push(format!("the body is only {largest} m large; is the scale right? (--scale)"));
    }
}

/// Mean ratio 12·(3V)^(2/3)/Σ edge² (Liu & Joe 1994).
fn remark_on_quality(mesh: &mut Mesh) {
    let quality = |tet: &[u32; 4]| {
        let corners = tet.map(|n| mesh.nodes[n as usize]);
        let squares: f64 =
            crate::element::EDGES.iter().map(|&[a, b]| (corners[a] - corners[b]).length_squared()).sum();
        12.0 * (3.0 * tet_volume(&mesh.nodes, tet)).powf(2.0 / 3.0) / squares
    };
    let worst = mesh.tets.iter().enumerate().map(|(number, tet)| (number, quality(tet)));
    let poor = worst.clone().filter(|(_, q)| *q < POOR_BELOW).count();
    if let Some((number, q)) = worst.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| poor > 0) {
        mesh.remarks.push(format!(
            "{poor} tetrahedra are slivers, the worst is {number} near {} with quality {q:.4} (1 is regular): \
             responses are too stiff there",
            place(centre(mesh, number as u32))
        ));
    }
}

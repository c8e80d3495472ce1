//! Parameters of collision detection: every tuned number in one place, each dimensionless by a named scale.
//!
//! Lengths are shares of the *mean edge* of the object's triangles at rest unless said otherwise. docs/ablation.md has what
//! each is worth.

/// Parameters of collision detection.
pub(super) struct CollisionParameters {
    /// Margin within which points become candidates without approaching, and length below which two points count as one
    /// place: contact forces of one step move neighbours by less. A point has half of it as the radius of its tip, since it needs
    /// a side from which it comes.
    pub(super) margin: f64,
    /// Displacement of a free node by the forces on its neighbours, as a share of theirs: an upper bound between neighbours.
    pub(super) neighbour_displacement: f64,
    /// Depth beyond which a point that was not in contact has not come through this surface, and motion in a step beyond which
    /// a tip is swept: of a tip, a share of its radius.
    pub(super) max_depth: f64,
    /// Gap between a fast tip and a surface at which they are in contact, and a sweep has arrived, as a share of its radius.
    pub(super) tip_margin: f64,
    /// Change of location that a persistent contact ignores, as a share of the tip's size, and of a triangle's edge: a new location costs its
    /// responses. A point so close to an edge or a corner lies on it.
    pub(super) location_tolerance: [f64; 2],
    /// Cosine between the normals of two triangles below which there is a crease between them (within 32° they are one face).
    pub(super) crease_cosine: f64,
    /// Cosine between the outward normals of a node and of a face below which they can press on each other. On the paper's cube a
    /// face opposes an edge by −0.7 and a corner by −0.58; strain turns normals by some hundredths.
    pub(super) opposing_cosine: f64,
    /// Distance over the rim of a face, of an object or a box, that a node may slide before it leaves the face.
    pub(super) overhang: f64,
    /// Residual displacement above which it is bounded subtree by subtree: the smallest spheres have a radius of about an edge.
    pub(super) local_residual: f64,
    /// Skin of a triangle cache, as a share of mean edge and reach.
    pub(super) skin: f64,
    /// Steps that a rebuild takes, if it visits as many spheres and triangles as the last one.
    pub(super) rebuild_steps: usize,
    /// Number of cached triangles above which only seeds are kept: local minima of the distance, from which a descent leads
    /// to the present ones.
    pub(super) seed_above: usize,
    /// The next finer level of detail is tried after this many steps, and kept with at most this share of the allowed samples near.
    pub(super) refine_after_steps: u64,
    pub(super) refine_below: f64,
    /// Depth of a node between contact samples from which it is added, as a share of the object's radius.
    pub(super) sample_tolerance: f64,
    /// Spheres and triangles that a step visits to find such nodes.
    pub(super) search_visits: usize,
}

/// The parameters.
pub(super) const COLLISION: CollisionParameters = CollisionParameters {
    margin: 2e-3,
    neighbour_displacement: 0.3,
    max_depth: 0.5,
    tip_margin: 0.05,
    location_tolerance: [1e-3, 1e-2],
    crease_cosine: 0.85,
    opposing_cosine: -0.2,
    overhang: 0.1,
    local_residual: 0.1,
    skin: 0.5,
    rebuild_steps: 4,
    seed_above: 48,
    refine_after_steps: 50,
    refine_below: 0.8,
    sample_tolerance: 3e-4,
    search_visits: 64,
};

/// Relative difference that is round-off: of distances, and of barycentric weights.
pub(super) const ROUND_OFF: f64 = 1e-9;

/// Upper limit of iterations: conservative advancements (each about halves the distance), triangles of a descent or of a
/// projection. Reached in degenerate geometry only.
pub(super) const MAX_ITERATIONS: usize = 40;

//! Device tips against objects: contacts of the proxy, a ball with the tip's radius, with the deformed surface.
//!
//! Where a surface comes within reach of the proxy in a step, the nearest point of each face becomes a contact, and the solver
//! keeps the ball outside (god-object of Zilles & Salisbury 1995). A contact stays at its material point while it sticks; when
//! it slips or rolls it follows the point nearest to the proxy. Fast tips are swept by conservative advancement.
//!
//! Equations: docs/theory.md (C23).

use super::phong_projection::phong_project;
use crate::collision::candidate::{CandidateSide, ContactCandidate};
use crate::collision::contact::{Collider, Contact, ContactId, ContactLaw, FeatureId, contacts_between};
use crate::collision::context::CollisionContext;
use crate::collision::deformed_surface::{
    DeformedSurface, MAX_TIP_CONTACTS, SurfaceTime, TriangleProjection,
};
use crate::collision::parameters::{COLLISION, MAX_ITERATIONS};
use crate::collision::proximity::ProximityQuery;
use crate::device::{DeviceParameters, DeviceState};
use crate::object::ObjectState;
use crate::response::{Body, ContactLocation, Footprint};
use crate::surface::{SurfacePoint, at_weights};
use glam::DVec3;

/// Upper limit of samples along a slide.
const MAX_SLIDE_SAMPLES: f64 = 8.0;

/// A device and an object in a step.
#[derive(Clone, Copy)]
pub(crate) struct TipPair<'a> {
    pub(crate) number: usize,
    pub(crate) device: &'a DeviceState,
    pub(crate) object: usize,
}

/// Motion of a proxy relative to an object over a step, and how the object is read.
struct Path {
    object: usize,
    footprint: Footprint,
    /// Proxy at the start, and at the end without contact force [m, body].
    start: DVec3,
    free: DVec3,
    /// Bound of the relative motion of proxy and surface [m].
    motion: f64,
}

impl CollisionContext<'_> {
    /// Find the contacts of a device with an object. Says whether the proxy may be inside without contact.
    ///
    /// # Real time
    pub(crate) fn find_tip_contacts(&mut self, pair: TipPair) -> bool {
        let TipPair { number, device, object: at } = pair;
        let (object, own) = (&self.scene.objects[at], &self.states[at]);
        let parameters = &self.scene.devices[number];
        let body = &object.body;
        let footprint = body.footprint(parameters.patch_radius);
        let tip = parameters.ball_radius(body);
        let start = own.rigid.pose.body_from_world(device.proxy);
        let free = own.free.end.pose.body_from_world(device.proxy_under_force());
        let travel = (free - start).length();
        let motion = travel + own.surface_motion;

        let own_contacts = own_locations((self.states, self.contacts), number, at);
        let workspace = &mut *self.workspace;
        let positions = &mut workspace.positions[at];
        let moment = SurfaceTime::StepStart(self.step);
        let mut surface =
            DeformedSurface::new(body, footprint, &own.response, &own.points, positions, moment);
        if start.length() - motion - tip > object.radius + surface.max_displacement() {
            return false;
        }
        surface.exclude_own_residual(own_contacts, flat_radius(parameters, body));
        let query = &mut workspace.query;
        let reach = tip + travel + 10.0 * COLLISION.margin * body.edge;
        let triangles = self.caches.triangles[number].of(at, self.step);
        triangles.find(query, &mut surface, start, reach);
        // The surface here moves about as its nearest nodes do.
        let mut motion = motion;
        if let Some(nearest) = query.found.first().copied() {
            let local = surface.predicted_motion(nearest.triangle);
            motion = motion.min(travel + local + 5.0 * COLLISION.margin * body.edge);
        }
        // Slow tips: all that can be met is near now. Fast tips: present contacts, and a sweep.
        let is_fast = motion > COLLISION.max_depth * tip.max(0.5 * body.edge);
        let needed = if is_fast {
            (1.0 + COLLISION.tip_margin) * tip
        } else {
            // A contact that presses is found again, though between nodes of a coarse mesh its patch stands higher than this surface.
            let known = contacts_between(self.contacts, Collider::Device(number), at);
            let pressing = known.iter().filter(|contact| contact.force != DVec3::ZERO).map(|contact| {
                let SurfacePoint { triangle, weights } = own.points.of(contact.slot).location.point;
                (start - at_weights(surface.corners(triangle), weights)).length()
            });
            pressing.fold(tip, f64::max) + motion
        };
        if needed > reach {
            triangles.find(query, &mut surface, start, needed);
        }
        let is_inside = query.is_inside(body, start);
        query.keep_local_minima(body, needed, 2 * MAX_TIP_CONTACTS);
        let mut contacts = TipContacts { list: [None; MAX_TIP_CONTACTS], count: 0, tip };
        for found in &query.found {
            contacts.add(&mut surface, found, start, own.rigid.pose.orientation);
        }
        let path = Path { object: at, footprint, start, free, motion };
        if is_fast {
            self.sweep_tip(&mut contacts, &path);
        }
        self.push_tip_candidates(&contacts, number, &path);
        is_inside && contacts.count == 0
    }

    /// Continue the incremental rebuilds of a device's triangle caches.
    ///
    /// # Real time
    pub(crate) fn rebuild_ahead(&mut self, number: usize) {
        let parameters = &self.scene.devices[number];
        let Self { scene, states, contacts, .. } = *self;
        let positions = &mut self.workspace.positions;
        for (at, cache) in self.caches.triangles[number].rebuilding() {
            let (body, own) = (&scene.objects[at].body, &states[at]);
            let coordinates = cache.take_rebuild_coordinates();
            let footprint = body.footprint(parameters.patch_radius);
            let moment = SurfaceTime::Coordinates(&coordinates[..own.response.coordinates().len()]);
            let (response, points) = (&own.response, &own.points);
            let mut surface =
                DeformedSurface::new(body, footprint, response, points, &mut positions[at], moment);
            let own_contacts = own_locations((states, contacts), number, at);
            surface.exclude_own_residual(own_contacts, flat_radius(parameters, body));
            cache.continue_rebuild(&mut surface);
            cache.return_rebuild_coordinates(coordinates, body);
        }
    }

    /// Sweep a fast proxy: add the faces that it meets first on its path.
    fn sweep_tip(&mut self, contacts: &mut TipContacts, path: &Path) {
        let Path { object: at, footprint, start, free, motion } = *path;
        let own = &self.states[at];
        let body = &self.scene.objects[at].body;
        let (from, to) = (own.response.coordinates(), own.response.free_coordinates());
        let (before, after) = (own.rigid.pose.orientation, own.free.end.pose.orientation);
        let workspace = &mut *self.workspace;
        let blend = &mut workspace.coordinates[..from.len()];
        let interpolate = |t: f64, blend: &mut [f64]| {
            blend.iter_mut().zip(from.iter().zip(to)).for_each(|(q, (a, b))| *q = a + t * (b - a));
        };
        let (query, positions) = (&mut workspace.query, &mut workspace.positions[at]);
        let touching = contacts.count;
        if touching == 0 {
            // Free: conservative advancement to the first touch.
            let mut t = 0.0;
            for _ in 0..MAX_ITERATIONS {
                interpolate(t, blend);
                let moment = SurfaceTime::Coordinates(blend);
                let mut surface =
                    DeformedSurface::new(body, footprint, &own.response, &own.points, positions, moment);
                let p = start.lerp(free, t);
                let reach = motion * (1.0 - t) + 2.0 * contacts.tip;
                let Some(nearest) = ProximityQuery::nearest(&mut surface, p, reach) else { return };
                let gap = nearest.distance - contacts.tip;
                if gap < COLLISION.tip_margin * contacts.tip {
                    query.triangles_within(
                        &mut surface,
                        p,
                        contacts.tip + gap + COLLISION.tip_margin * contacts.tip,
                    );
                    query.keep_local_minima(body, f64::INFINITY, 2 * MAX_TIP_CONTACTS);
                    for found in &query.found {
                        contacts.add(&mut surface, found, p, before.slerp(after, t));
                    }
                    return;
                }
                t += (gap / motion).max(1e-4);
                if t >= 1.0 {
                    return;
                }
            }
            return;
        }
        // Touching: samples along the slide on the touched faces, to the first other face.
        let mut slide = free - start;
        for contact in contacts.all() {
            slide -= contact.normal_in_body * slide.dot(contact.normal_in_body).min(0.0);
        }
        let count = libm::ceil(slide.length() / (COLLISION.max_depth * contacts.tip.max(0.5 * body.edge)))
            .min(MAX_SLIDE_SAMPLES);
        for k in 1..=count as u32 {
            let t = f64::from(k) / count;
            interpolate(t, blend);
            let moment = SurfaceTime::Coordinates(blend);
            let mut surface =
                DeformedSurface::new(body, footprint, &own.response, &own.points, positions, moment);
            let p = start + slide * t;
            query.triangles_within(
                &mut surface,
                p,
                (1.0 - COLLISION.tip_margin) * contacts.tip.max(slide.length() / count),
            );
            query.keep_local_minima(body, f64::INFINITY, 2 * MAX_TIP_CONTACTS);
            for found in &query.found {
                let is_other =
                    contacts.all().all(|c| c.normal_in_body.dot(found.normal) < COLLISION.crease_cosine);
                // Met from outside: the slide leads against it.
                if is_other && slide.dot(found.normal) < 0.0 {
                    let beside = found.position + found.normal * contacts.tip;
                    contacts.add(&mut surface, found, beside, before.slerp(after, t));
                }
            }
            if contacts.count > touching {
                return;
            }
        }
    }

    /// Push the tip contacts as candidates, matched with the contacts of the last step.
    fn push_tip_candidates(&mut self, contacts: &TipContacts, number: usize, path: &Path) {
        let Path { object: at, footprint, start, motion, .. } = *path;
        let (own, body) = (&self.states[at], &self.scene.objects[at].body);
        let parameters = &self.scene.devices[number];
        let size = contacts.tip.max(parameters.patch_radius).max(0.1 * body.edge);
        let mut taken = [false; 2 * MAX_TIP_CONTACTS];
        let collider = Collider::Device(number);
        let known = contacts_between(self.contacts, collider, at);
        for found in contacts.all() {
            let rest = body.recording.surface.rest_position(&found.point);
            let mut location = ContactLocation { point: found.point, footprint };
            // The nearest contact of the last step on the surface, within reach of the motion.
            let is_free = |c: &&Contact| tip_number(c).is_some_and(|number| !taken[number as usize]);
            let distance = |c: &Contact| (own.points.of(c.slot).rest - rest).length();
            let before = known.iter().filter(is_free).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let before = before.filter(|c| distance(c) < size + 2.0 * motion + body.edge);
            let feature = match before.and_then(|contact| Some((contact, tip_number(contact)?))) {
                Some((contact, feature)) => {
                    let point = own.points.of(contact.slot);
                    let away = start - (point.rest + point.state.displacement);
                    let aside = away - found.normal_in_body * found.normal_in_body.dot(away);
                    if aside.length() < COLLISION.location_tolerance[0] * size {
                        location = point.location;
                    }
                    feature
                }
                None => {
                    let is_used = |feature: u8| {
                        taken[feature as usize] || known.iter().any(|c| tip_number(c) == Some(feature))
                    };
                    (0..taken.len() as u8).find(|&feature| !is_used(feature)).unwrap_or_default()
                }
            };
            taken[feature as usize] = true;
            self.workspace.candidates.push(ContactCandidate {
                id: ContactId { collider, object: at, feature: FeatureId::Tip(feature) },
                location,
                other: CandidateSide::Device(number),
                law: ContactLaw::Unilateral { friction: parameters.friction },
                normal: found.normal_in_world,
                distance: contacts.tip,
            });
        }
    }
}

/// Locations at which a device is in contact with an object: their residual displacement is its own.
fn own_locations(
    (states, contacts): (&[ObjectState], &[Contact]),
    number: usize,
    at: usize,
) -> [Option<ContactLocation>; MAX_TIP_CONTACTS] {
    let mut locations = [None; MAX_TIP_CONTACTS];
    for (location, contact) in
        locations.iter_mut().zip(contacts_between(contacts, Collider::Device(number), at))
    {
        *location = Some(states[at].points.of(contact.slot).location);
    }
    locations
}

/// Number of a tip contact; none for a held point.
fn tip_number(contact: &Contact) -> Option<u8> {
    match contact.id.feature {
        FeatureId::Tip(number) => Some(number),
        _ => None,
    }
}

impl DeviceParameters {
    /// Radius of the tip against a body [m]: of a point, a share of the mean edge, since it needs a side from which it comes.
    pub(super) fn ball_radius(&self, body: &Body) -> f64 {
        self.tip_radius.max(0.5 * COLLISION.margin * body.edge)
    }
}

/// Distance from a location that a tip presses up to which the surface moves as the location does [m].
fn flat_radius(parameters: &DeviceParameters, body: &Body) -> f64 {
    1.5 * (parameters.patch_radius + body.edge)
}

/// Contact of a tip with a face.
#[derive(Clone, Copy)]
struct TipContact {
    point: SurfacePoint,
    normal_in_world: DVec3,
    normal_in_body: DVec3,
}

/// Contacts of a tip with an object, one per face.
struct TipContacts {
    list: [Option<TipContact>; MAX_TIP_CONTACTS],
    count: usize,
    /// Tip radius [m].
    tip: f64,
}

impl TipContacts {
    /// Add a nearest point if the proxy is on its outer side and its face is not known.
    fn add(
        &mut self,
        surface: &mut DeformedSurface,
        found: &TriangleProjection,
        proxy: DVec3,
        orientation: glam::DQuat,
    ) {
        // A proxy on the surface itself may be below it by round-off.
        let clearance = (proxy - found.position).dot(found.normal);
        if self.count == MAX_TIP_CONTACTS
            || clearance < -COLLISION.max_depth * self.tip
            || found.normal == DVec3::ZERO
        {
            return;
        }
        let foot = phong_project(surface, found, proxy, self.tip);
        // Two nearest points of one smooth surface are one contact; the back of a wall whose front is touched is none.
        let is_known = |c: &TipContact| c.normal_in_body.dot(foot.normal) > COLLISION.crease_cosine;
        let is_back = |c: &TipContact| clearance < 0.0 && c.normal_in_body.dot(foot.normal) < 0.0;
        if self.all().any(|c| is_known(c) || is_back(c)) {
            return;
        }
        self.list[self.count] = Some(TipContact {
            point: SurfacePoint { triangle: foot.triangle, weights: foot.weights },
            normal_in_world: orientation * foot.normal,
            normal_in_body: foot.normal,
        });
        self.count += 1;
    }

    fn all(&self) -> impl Iterator<Item = &TipContact> {
        self.list.iter().flatten()
    }
}

//! Interface points that touch: the proxy (god-object) of each device on the moving, deformed surfaces.
//!
//! After Zilles & Salisbury (1995, IROS, 146): the proxy is where the device would be if it could not enter an
//! object. Here it is a ball with the tip's radius. Where a surface comes within reach of it in a step, the nearest
//! point of each face becomes a contact, and the solver keeps the ball outside: with the device itself, or with the
//! proxy at the end of a virtual coupling. A contact stays at its material point while it sticks; when it slips or
//! rolls it goes to the point nearest to the proxy.
//!
//! A virtual coupling (stiffness k, damping d) is part of the solver's compliance. With e the stretch, device minus
//! proxy, a force f that is held over the step gives
//!
//! ```text
//! f = k·e⁺ + d·(e⁺ − e)/h        so        e⁺ = (f + d/h·e) / (k + d/h)
//! ```

use super::projection::stand;
use super::search::{ONE_FACE, Search};
use super::sight::{Found, MOST_FACES, Sight};
use super::wanted::{Finding, Key, Wanted, WantedOther};
use super::{Collider, Contact, Law, known_contacts};
use crate::response::{Body, Place, Reading};
use crate::scene::DeviceParameters;
use crate::surface::SurfacePoint;
use glam::DVec3;

/// A place is kept while the proxy is off its normal by less than this share of the contact's size.
const ROLL: f64 = 1e-3;

/// Faces whose normals have a cosine below this look in opposite directions.
const OPPOSED: f64 = -0.5;

/// The least radius of a tip, as a share of the mean edge: a point needs a side from which it comes.
const LEAST_TIP: f64 = 1e-3;

/// Steps of conservative advancement along a path; each at least halves the distance, or nearly.
const ADVANCES: usize = 40;

/// Places along a slide that are looked at.
const SLIDES: f64 = 8.0;

/// One device between steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DeviceState {
    /// Whether it was touching or holding in the last step.
    pub(crate) present: bool,
    /// Interface point at the start and at the end of the step [m, world].
    pub(crate) last: DVec3,
    pub(crate) target: DVec3,
    /// Proxy at the start of the step [m, world].
    pub(crate) proxy: DVec3,
    /// What is left at the end of the step of the coupling's stretch without force [m].
    relaxed: DVec3,
    /// Compliance of the coupling within a step [m/N].
    pub(crate) compliance: f64,
    /// Force on the objects [N, world].
    pub(crate) force: DVec3,
}

impl DeviceState {
    pub(crate) fn new() -> Self {
        let zero = DVec3::ZERO;
        Self {
            present: false,
            last: zero,
            target: zero,
            proxy: zero,
            relaxed: zero,
            compliance: 0.0,
            force: zero,
        }
    }

    /// Begin a step that ends with the device at `target`. A device that was away comes from `from`.
    pub(crate) fn begin(&mut self, parameters: &DeviceParameters, step_s: f64, target: DVec3, from: DVec3) {
        if !self.present {
            (self.present, self.last, self.proxy) = (true, from, from);
        }
        self.target = target;
        self.force = DVec3::ZERO;
        (self.relaxed, self.compliance) = match parameters.coupling {
            Some(coupling) => {
                let rate = coupling.damping / step_s;
                let sum = coupling.stiffness + rate;
                ((self.last - self.proxy) * (rate / sum), 1.0 / sum)
            }
            None => (DVec3::ZERO, 0.0),
        };
    }

    /// The proxy at the end of the step under the forces that act now [m, world].
    pub(crate) fn proxy_under_force(&self) -> DVec3 {
        self.target - self.relaxed - self.force * self.compliance
    }
}

/// Find the contacts of a device with an object. `inside` says whether the device is known to be inside, where it
/// touches nothing until it has come out.
///
/// # Real time
pub(crate) fn touch(
    scene: &mut Finding,
    number: usize,
    device: &DeviceState,
    fresh: bool,
    at: usize,
    inside: &mut bool,
) {
    let (object, own) = (&scene.model.objects[at], &scene.objects[at]);
    let parameters = &scene.model.parameters.devices[number];
    let body = &object.body;
    let reading = body.reading(parameters.patch_radius);
    let tip = parameters.tip_radius.max(LEAST_TIP * body.edge);
    let start = own.rigid.pose.body_from_world(device.proxy);
    let free = own.free.end.pose.body_from_world(device.proxy_under_force());
    let travel = (free - start).length();
    let motion = travel + own.surface_motion;

    let dents = own_dents(scene, number, at);
    let cache = &mut scene.caches[at];
    let mut sight = Sight::new(body, reading, &own.response, &own.points, cache, Ok(scene.step));
    if start.length() - motion - tip > object.radius + sight.reach() {
        *inside = false;
        return;
    }
    sight.without_dents(dents, flat(parameters, body));
    let vicinity = &mut scene.vicinities[number * scene.model.objects.len() + at];
    // The side is asked for only when it is not known.
    if fresh || *inside {
        let Some(nearest) = Search::nearest(&mut sight, start, f64::INFINITY) else { return };
        scene.search.near(&mut sight, start, nearest.distance * (1.0 + 1e-9) + 1e-12);
        *inside = scene.search.is_inside(start);
        if *inside {
            return;
        }
    }
    let reach = tip + 1.2 * travel + 0.02 * body.edge;
    vicinity.find(scene.search, &mut sight, start, reach);
    // The surface here moves about as its nearest nodes do.
    let mut motion = motion;
    if let Some(nearest) = scene.search.found.first().copied() {
        let local = 1.5 * sight.deformation(&nearest);
        motion = motion.min(travel + local + 0.01 * body.edge);
    }
    // Slow: whatever can be met in the step is near now. Fast: what is touched now, and what comes in the way.
    let fast = motion > 0.5 * tip.max(0.5 * body.edge);
    let needed = if fast { 1.05 * tip } else { tip + 1.2 * motion };
    if needed > reach {
        vicinity.find(scene.search, &mut sight, start, needed);
    }
    scene.search.keep_minima(body, needed, 2 * MOST_FACES);
    let mut faces = Faces { meet: [None; MOST_FACES], count: 0, tip };
    for found in &scene.search.found {
        faces.add(&mut sight, found, start, own.rigid.pose.orientation);
    }
    if fast {
        on_the_way(scene, &mut faces, reading, at, start, free, motion);
    }
    want(scene, &faces, number, at, reading, start, motion);
}

/// Go on finding what a device will be near to, where that has begun: a part in each step.
///
/// # Real time
pub(crate) fn look_ahead(scene: &mut Finding, number: usize, at: usize) {
    let of = number * scene.model.objects.len() + at;
    let Some(moment) = scene.vicinities[of].lend_moment() else { return };
    let dents = own_dents(scene, number, at);
    let (body, own) = (&scene.model.objects[at].body, &scene.objects[at]);
    let parameters = &scene.model.parameters.devices[number];
    let (reading, cache) = (body.reading(parameters.patch_radius), &mut scene.caches[at]);
    let moment_then = Err(&moment[..own.response.coordinates().len()]);
    let mut sight = Sight::new(body, reading, &own.response, &own.points, cache, moment_then);
    sight.without_dents(dents, flat(parameters, body));
    scene.vicinities[of].grow(&mut sight);
    scene.vicinities[of].take_back(moment, body);
}

/// The places that a device touches already: their dents are its own.
fn own_dents(scene: &Finding, number: usize, at: usize) -> [Option<Place>; MOST_FACES] {
    let mut dents = [None; MOST_FACES];
    for (dent, contact) in dents.iter_mut().zip(known_contacts(scene.contacts, Collider::Device(number), at))
    {
        *dent = Some(scene.objects[at].points.of(contact.slot).place);
    }
    dents
}

/// Around a place that a tip presses the surface goes as the place does, up to this distance [m].
fn flat(parameters: &DeviceParameters, body: &Body) -> f64 {
    1.5 * (parameters.patch_radius + body.edge)
}

/// A face that a tip meets.
#[derive(Clone, Copy)]
struct Meeting {
    point: SurfacePoint,
    normal_in_world: DVec3,
    normal_in_body: DVec3,
}

struct Faces {
    meet: [Option<Meeting>; MOST_FACES],
    count: usize,
    tip: f64,
}

impl Faces {
    /// Take a found place if the proxy is on its outer side.
    fn add(&mut self, sight: &mut Sight, found: &Found, proxy: DVec3, orientation: glam::DQuat) {
        // A proxy on the surface itself may be a rounding below it.
        let out = (proxy - found.position).dot(found.normal);
        if self.count == MOST_FACES || out < -0.5 * self.tip || found.normal == DVec3::ZERO {
            return;
        }
        let standing = stand(sight, found, proxy, self.tip);
        // Two nearest points of one smooth surface are one place. And what the proxy is behind is the back of the wall
        // whose front is met.
        let known = |m: &Meeting| m.normal_in_body.dot(standing.normal) > ONE_FACE;
        let back = |m: &Meeting| out < 0.0 && m.normal_in_body.dot(standing.normal) < OPPOSED;
        if self.all().any(|m| known(m) || back(m)) {
            return;
        }
        self.meet[self.count] = Some(Meeting {
            point: SurfacePoint { triangle: standing.triangle, weights: standing.weights },
            normal_in_world: orientation * standing.normal,
            normal_in_body: standing.normal,
        });
        self.count += 1;
    }

    fn all(&self) -> impl Iterator<Item = &Meeting> {
        self.meet.iter().flatten()
    }
}

/// What a fast proxy meets first on its way.
fn on_the_way(
    scene: &mut Finding,
    faces: &mut Faces,
    reading: Reading,
    at: usize,
    start: DVec3,
    free: DVec3,
    motion: f64,
) {
    let own = &scene.objects[at];
    let body = &scene.model.objects[at].body;
    let (from, to) = (own.response.coordinates(), own.response.free_coordinates());
    let (before, after) = (own.rigid.pose.orientation, own.free.end.pose.orientation);
    let blend = &mut scene.modes[..from.len()];
    let at_time = |t: f64, blend: &mut [f64]| {
        blend.iter_mut().zip(from.iter().zip(to)).for_each(|(q, (a, b))| *q = a + t * (b - a));
    };
    let touching = faces.count;
    if touching == 0 {
        // Free: conservative advancement to the first touch.
        let mut t = 0.0;
        for _ in 0..ADVANCES {
            at_time(t, blend);
            let cache = &mut scene.caches[at];
            let mut sight = Sight::new(body, reading, &own.response, &own.points, cache, Err(blend));
            let p = start.lerp(free, t);
            let reach = motion * (1.0 - t) + 2.0 * faces.tip;
            let Some(nearest) = Search::nearest(&mut sight, p, reach) else { return };
            let gap = nearest.distance - faces.tip;
            if gap < 0.02 * faces.tip {
                scene.search.near(&mut sight, p, faces.tip + gap + 0.05 * faces.tip);
                scene.search.keep_minima(body, f64::INFINITY, 2 * MOST_FACES);
                for found in &scene.search.found {
                    faces.add(&mut sight, found, p, before.slerp(after, t));
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
    // Touching: along the faces that it touches, to the first other face.
    let mut slide = free - start;
    for meeting in faces.all() {
        slide -= meeting.normal_in_body * slide.dot(meeting.normal_in_body).min(0.0);
    }
    let count = libm::ceil(slide.length() / (0.5 * faces.tip.max(0.5 * body.edge))).min(SLIDES);
    for k in 1..=count as u32 {
        let t = f64::from(k) / count;
        at_time(t, blend);
        let cache = &mut scene.caches[at];
        let mut sight = Sight::new(body, reading, &own.response, &own.points, cache, Err(blend));
        let p = start + slide * t;
        scene.search.near(&mut sight, p, 0.98 * faces.tip.max(slide.length() / count));
        scene.search.keep_minima(body, f64::INFINITY, 2 * MOST_FACES);
        for found in &scene.search.found {
            let other = faces.all().all(|meeting| meeting.normal_in_body.dot(found.normal) < ONE_FACE);
            // Met from outside: the way leads against it.
            if other && slide.dot(found.normal) < 0.0 {
                let beside = found.position + found.normal * faces.tip;
                faces.add(&mut sight, found, beside, before.slerp(after, t));
            }
        }
        if faces.count > touching {
            return;
        }
    }
}

/// Write down the contacts, matched with those of the last step.
fn want(
    scene: &mut Finding,
    faces: &Faces,
    number: usize,
    at: usize,
    reading: Reading,
    start: DVec3,
    motion: f64,
) {
    let (own, body) = (&scene.objects[at], &scene.model.objects[at].body);
    let parameters = &scene.model.parameters.devices[number];
    let size = faces.tip.max(parameters.patch_radius).max(0.1 * body.edge);
    let mut taken = [false; 2 * MOST_FACES];
    let known = known_contacts(scene.contacts, Collider::Device(number), at);
    for meeting in faces.all() {
        let rest = body.recording.surface.rest_position(&meeting.point);
        let mut place = Place { point: meeting.point, reading };
        // The contact of the last step that is nearest on the surface, if one is near.
        let left = |c: &&Contact| c.law != Law::Held && !taken[c.key.feature as usize];
        let off = |c: &Contact| (own.points.of(c.slot).rest - rest).length();
        let before = known.iter().filter(left).min_by(|a, b| off(a).total_cmp(&off(b)));
        let before = before.filter(|c| off(c) < size + 2.0 * motion + body.edge);
        let feature = match before {
            Some(contact) => {
                let point = own.points.of(contact.slot);
                let away = start - (point.rest + point.placed.displacement);
                let aside = away - meeting.normal_in_body * meeting.normal_in_body.dot(away);
                if aside.length() < ROLL * size {
                    place = point.place;
                }
                contact.key.feature
            }
            None => {
                let used =
                    |feature: u64| taken[feature as usize] || known.iter().any(|c| c.key.feature == feature);
                (0..taken.len() as u64).find(|&feature| !used(feature)).unwrap_or_default()
            }
        };
        taken[feature as usize] = true;
        scene.wanted.push(Wanted {
            key: Key { other: Collider::Device(number), object: at, feature },
            place,
            other: WantedOther::Device(number),
            law: Law::Touch { friction: parameters.friction },
            normal: meeting.normal_in_world,
            distance: faces.tip,
        });
    }
}

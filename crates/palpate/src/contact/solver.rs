//! Solver of the contact problem: held points, tips, obstacles and pairs together, island by island.
//!
//! With W [m/N] the Delassus operator (see `problem`), the sides of contact c end up apart by
//!
//! ```text
//! apart_c = b_c − Σ_d W_cd·f_d
//! ```
//!
//! Projected block Gauss-Seidel: a sweep solves each contact's law with the other forces as they are (see `coulomb`); the
//! held points of an island are one block, solved by Cholesky factors. Between sweeps everything is evaluated exactly with
//! the rotation that the forces cause, so that in the end the equations of motion are met, not their linearisation.
//!
//! Equations: docs/theory.md (C41), (C42), (C43).

use super::bilateral::BilateralSystem;
use super::islands::Islands;
use super::parameters::{ROUND_OFF, SOLVER, UNSOLVED};
use super::problem::{ContactProblem, larger};
use crate::collision::{ContactLaw, OtherSide};
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Result of a solve, over all islands.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SolverReport {
    /// Largest residual of a contact's law [m].
    pub(crate) residual_m: f64,
    /// Largest number of exact evaluations.
    pub(crate) iterations: u32,
    /// Held directions that depend on others.
    pub(crate) dependent_rows: u32,
    /// Islands whose contacts were not solved.
    pub(crate) unsolved_islands: u32,
}

/// Solver with its buffers, made once.
#[derive(Debug, Clone)]
pub(crate) struct Solver {
    /// Contact visits after which the loose tolerance is enough.
    visits_until_loose: u32,
    islands: Islands,
    system: BilateralSystem,
    held: Vec<u32>,
    /// Objects and contacts of the island that is being solved.
    bodies: Vec<u32>,
    members: Vec<u32>,
}

impl Solver {
    /// Solver for so many objects, held points and contacts; `uses_samples` says whether contact samples stand for nodes.
    pub(crate) fn new(objects: usize, held: usize, contacts: usize, uses_samples: bool) -> Self {
        Self {
            visits_until_loose: if uses_samples { SOLVER.visits_with_samples } else { SOLVER.visits },
            islands: Islands::new(objects, contacts),
            system: BilateralSystem::new(held),
            held: Vec::with_capacity(held),
            bodies: Vec::with_capacity(objects),
            members: Vec::with_capacity(contacts),
        }
    }

    /// Solve for all forces. An island that can't be solved gets a scaled solution, if that is sound; if not, or where points
    /// are only held, its objects move freely for the step.
    ///
    /// # Real time
    /// Costs sweeps × contacts × contact points of an object.
    pub(crate) fn solve(&mut self, problem: &mut ContactProblem) -> SolverReport {
        let mut report = SolverReport::default();
        self.islands.find(problem.contacts, problem.devices);
        problem.devices.iter_mut().for_each(|device| device.force = DVec3::ZERO);
        for root in 0..problem.objects.len() {
            if !self.islands.is_root(root) {
                continue;
            }
            let (bodies, members) = self.islands.members(root);
            self.bodies.clear();
            self.bodies.extend_from_slice(bodies);
            self.members.clear();
            self.members.extend_from_slice(members);
            if self.members.is_empty() {
                let own = &mut problem.states[root];
                own.end = own.free;
            } else {
                self.solve_island(problem, &mut report);
            }
        }
        problem.sum_on_devices();
        report
    }

    /// Start all objects of the island from their motion without contact force.
    fn start(&self, problem: &mut ContactProblem) {
        for at in self.bodies.iter().map(|&at| at as usize) {
            problem.start(at);
        }
    }

    fn solve_island(&mut self, problem: &mut ContactProblem, report: &mut SolverReport) {
        let touches = self.members.iter().any(|&c| !problem.contacts[c as usize].is_held());
        // Held points alone are solved to round-off, and their stiff rows would turn what is not propagated into forces.
        let is_exact = self.members.len() <= SOLVER.few_contacts || !touches;
        let min_change = if is_exact { 0.0 } else { SOLVER.min_change };
        let (mut reach, mut size) = (0.0_f64, f64::INFINITY);
        for at in self.bodies.iter().map(|&at| at as usize) {
            let radius = problem.objects[at].radius;
            problem.states[at].points.least_move = min_change * radius;
            reach = reach.max(problem.states[at].reach(&problem.objects[at]));
            size = size.min(radius);
        }
        self.start(problem);
        self.linearise(problem);
        for at in self.members.iter().map(|&member| member as usize) {
            let contact = problem.contacts[at];
            problem.apply(&contact, contact.force);
        }
        let dependent = self.factorise_held(problem);
        report.dependent_rows += dependent as u32;

        let round_off = ROUND_OFF * reach;
        let mut first_residual = f64::INFINITY;
        let (mut iterations, mut visits, mut sweeps) = (0, 0, 0);
        let count = self.members.len() as u32;
        let (is_solved, last_residual) = loop {
            let rotation = self.evaluate(problem);
            if rotation > SOLVER.relinearise * size {
                self.linearise(problem);
            }
            iterations += 1;
            let residual = larger(rotation, self.sweep(problem, SOLVER.skip * self.tolerance(visits) * size));
            visits += count;
            if iterations == 1 {
                first_residual = residual;
            }
            let tolerance = if touches { self.tolerance(visits) * size } else { 8.0 * round_off };
            let is_last =
                iterations == SOLVER.max_evaluations || sweeps >= SOLVER.max_sweeps || !residual.is_finite();
            if residual <= tolerance || is_last {
                report.iterations = report.iterations.max(iterations);
                report.residual_m =
                    report.residual_m.max(if residual.is_finite() { residual } else { reach });
                let allowed = if touches { SOLVER.rough_tolerance * size } else { UNSOLVED * reach };
                // Dependent held points can't be met where their devices differ, and need not be.
                let is_solved = residual <= allowed || dependent > 0 && residual <= first_residual;
                break (is_solved, residual);
            }
            // Held points alone are solved by one sweep.
            let goal = round_off.max(SOLVER.sweep_goal * residual);
            while touches && sweeps < SOLVER.max_sweeps {
                sweeps += 1;
                let moved = self.sweep(problem, SOLVER.skip * goal);
                visits += count;
                if moved <= goal.max(0.3 * self.tolerance(visits) * size) {
                    break;
                }
                // Sweeps that move contacts farther than the objects reach diverge; their forces would leave round-off behind.
                if !moved.is_finite() || moved > reach {
                    sweeps = SOLVER.max_sweeps;
                }
            }
        };
        // Contacts may be loose, the equations of motion under their forces not: the energy ledger relies on them.
        let is_solved = is_solved && {
            problem.project_forces(&self.members);
            self.evaluate_to(problem, round_off) <= UNSOLVED * reach
        };
        if !is_solved {
            report.unsolved_islands += 1;
            if !(touches && self.solve_scaled(problem, round_off)) {
                problem.release_forces(&self.bodies, &self.members);
            }
            self.evaluate_to(problem, round_off);
        }
        for &object in &self.bodies {
            problem.finish(object as usize);
        }
        problem.write_ends(&self.members);
        // A rough solution is used, and reported as unsolved: by its residual, or by what the last sweep moved.
        let is_rough =
            last_residual.max(0.5 * problem.max_open_gap(&self.members)) > SOLVER.loose_tolerance * size;
        report.unsolved_islands += u32::from(is_solved && touches && is_rough);
    }

    /// Scaled fallback solution: the forces that the linearisation about the free motion gives, scaled down until the
    /// equations of motion hold and contacts give no energy. Says whether such forces were found.
    fn solve_scaled(&mut self, problem: &mut ContactProblem, round_off: f64) -> bool {
        problem.release_forces(&self.bodies, &self.members);
        self.start(problem);
        self.linearise(problem);
        for _ in 0..SOLVER.max_evaluations {
            let moved = self.sweep(problem, 0.0);
            if moved <= round_off {
                break;
            }
        }
        let largest = self.bodies.iter().map(|&at| problem.change(at as usize)).fold(0.0, larger);
        let mut share = (SOLVER.max_turn / largest).min(0.5);
        for _ in 0..SOLVER.fallback_scales {
            self.start(problem);
            problem.scale_forces(&self.members, share);
            if self.evaluate_to(problem, round_off) <= round_off && problem.write_ends(&self.members) >= 0.0 {
                return true;
            }
            share = 0.25;
        }
        false
    }

    /// Tolerance after so many contact visits, as a share of the size.
    fn tolerance(&self, visits: u32) -> f64 {
        match visits {
            visits if visits > self.visits_until_loose => SOLVER.loose_tolerance,
            _ if self.members.len() <= SOLVER.few_contacts => SOLVER.exact_tolerance,
            _ => SOLVER.tolerance,
        }
    }

    /// Evaluate all objects under the present forces. Gives the residual of their rotations [m].
    fn evaluate(&self, problem: &mut ContactProblem) -> f64 {
        self.bodies.iter().map(|&object| problem.evaluate(object as usize)).fold(0.0, larger)
    }

    /// Evaluate until the residual of the rotations is down to a goal [m], or gets no smaller. Gives it.
    fn evaluate_to(&self, problem: &mut ContactProblem, goal: f64) -> f64 {
        let mut last = f64::INFINITY;
        for _ in 0..SOLVER.max_evaluations {
            let residual = self.evaluate(problem);
            if residual <= goal || residual >= last {
                return residual;
            }
            last = residual;
        }
        last
    }

    /// Linearise all unilateral contacts about the last evaluation.
    fn linearise(&self, problem: &mut ContactProblem) {
        for at in self.members.iter().map(|&member| member as usize) {
            if !problem.contacts[at].is_held() {
                problem.linearise(at);
            }
        }
    }

    /// Factorise the W of the held points. Gives the number of dependent rows.
    fn factorise_held(&mut self, problem: &ContactProblem) -> usize {
        self.held.clear();
        let is_held = |c: &&u32| problem.contacts[**c as usize].is_held();
        self.held.extend(self.members.iter().filter(is_held));
        let Self { system, held, .. } = self;
        system.factorise(held.len(), |a, b| {
            let (a, b) = (&problem.contacts[held[a] as usize], &problem.contacts[held[b] as usize]);
            let mut w = DMat3::ZERO;
            if a.object() == b.object() {
                w += problem.compliance(a.object(), a.slot, b.slot);
            }
            if let (true, OtherSide::Device(device)) = (a.other == b.other, a.other) {
                w += DMat3::from_diagonal(DVec3::splat(problem.devices[device].compliance));
            }
            w
        })
    }

    /// Gauss-Seidel sweep: solve every contact once, where that moves its sides by more than `enough` [m]. Gives the
    /// largest movement [m].
    fn sweep(&mut self, problem: &mut ContactProblem, enough: f64) -> f64 {
        let mut largest = 0.0_f64;
        let Self { system, held, members, .. } = self;
        if !held.is_empty() {
            largest = system.solve(|point| problem.apart(&problem.contacts[held[point] as usize]));
            for (at, &contact) in held.iter().enumerate() {
                problem.add_force(contact as usize, system.force(at));
            }
        }
        for at in members.iter().map(|&at| at as usize) {
            let ContactLaw::Unilateral { friction } = problem.contacts[at].law else { continue };
            let moved = problem.solve_unilateral(at, friction, enough);
            largest = larger(largest, moved);
        }
        largest
    }
}

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
//! Work is counted in products of a 3×3 block of W and a force. A budget of it, shared by the islands in proportion to the cost of their
//! sweeps, ends the sweeps of an island early: its forces are then scaled down as far as its contacts would give energy.
//!
//! Equations: docs/theory.md (C41), (C42), (C43), (C83).

use super::bilateral::BilateralSystem;
use super::islands::Islands;
use super::parameters::{MAX_EVALUATIONS, ROUND_OFF, SOLVER, UNSOLVED};
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
    /// Islands whose contacts were not solved, and those whose sweeps the budget ended.
    pub(crate) unsolved_islands: u32,
    pub(crate) islands_out_of_budget: u32,
}

/// Scales of an island.
#[derive(Debug, Clone, Copy)]
struct Island {
    /// Whether it has contacts, not held points alone.
    touches: bool,
    /// Radius of its smallest object, and the distance from the origin that its objects reach [m].
    size: f64,
    reach: f64,
    /// Held directions that depend on others.
    dependent: usize,
}

impl Island {
    /// Round-off of a length [m].
    fn round_off(&self) -> f64 {
        ROUND_OFF * self.reach
    }
}

/// Outcome of the iteration of an island.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    /// Residual of the contacts' laws and of the rotations [m].
    residual: f64,
    is_solved: bool,
    is_out_of_budget: bool,
}

/// Progress of an island's solution.
#[derive(Debug, Clone, Copy)]
struct Progress {
    /// Block products of a sweep, those so far, and their upper limit.
    per_sweep: u64,
    done: u64,
    limit: u64,
    /// Contact visits, sweeps and exact evaluations.
    visits: u32,
    sweeps: u32,
    iterations: u32,
}

impl Progress {
    fn is_out_of_budget(&self) -> bool {
        self.done + self.per_sweep > self.limit
    }
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
    pub(crate) fn solve(&mut self, problem: &mut ContactProblem, budget: u64) -> SolverReport {
        let mut report = SolverReport::default();
        let awake = problem.awake;
        self.islands.find(awake, problem.contacts, problem.devices);
        let per_sweep: u64 = problem.contacts.iter().map(|contact| problem.products_of(contact)).sum();
        problem.devices.iter_mut().for_each(|device| device.force = DVec3::ZERO);
        for &root in awake {
            if !self.islands.is_root(root) {
                continue;
            }
            let (bodies, members) = self.islands.members(root);
            self.bodies.clear();
            self.bodies.extend_from_slice(bodies);
            self.members.clear();
            self.members.extend_from_slice(members);
            if self.members.is_empty() {
                let own = &mut problem.states[root as usize];
                own.end = own.free;
            } else {
                let of_island =
                    self.members.iter().map(|&at| problem.products_of(&problem.contacts[at as usize]));
                let own = of_island.sum::<u64>();
                let limit = (u128::from(budget) * u128::from(own) / u128::from(per_sweep.max(1))) as u64;
                let progress =
                    Progress { per_sweep: own, done: 0, limit, visits: 0, sweeps: 0, iterations: 0 };
                self.solve_island(problem, progress, &mut report);
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

    fn solve_island(
        &mut self,
        problem: &mut ContactProblem,
        mut progress: Progress,
        report: &mut SolverReport,
    ) {
        let touches = self.members.iter().any(|&c| !problem.contacts[c as usize].is_held());
        let mut island = Island { touches, reach: 0.0, size: f64::INFINITY, dependent: 0 };
        for at in self.bodies.iter().map(|&at| at as usize) {
            let radius = problem.objects[at].radius;
            island.reach = island.reach.max(problem.states[at].reach(&problem.objects[at]));
            island.size = island.size.min(radius);
        }
        self.start(problem);
        self.linearise(problem);
        for at in self.members.iter().map(|&member| member as usize) {
            let contact = problem.contacts[at];
            problem.apply(&contact, contact.force);
        }
        island.dependent = self.factorise_held(problem);
        report.dependent_rows += island.dependent as u32;

        let Outcome { residual, is_solved, is_out_of_budget } = self.iterate(problem, &island, &mut progress);
        report.iterations = report.iterations.max(progress.iterations);
        let finite = if residual.is_finite() { residual } else { island.reach };
        report.residual_m = report.residual_m.max(finite);
        report.islands_out_of_budget += u32::from(is_out_of_budget);
        let round_off = island.round_off();
        // Contacts may be loose, the equations of motion under their forces not: the energy ledger relies on them.
        let is_solved = (is_solved || is_out_of_budget) && {
            problem.project_forces(&self.members);
            self.evaluate_to(problem, round_off) <= UNSOLVED * island.reach
        };
        let is_solved = is_solved && (!is_out_of_budget || self.make_passive(problem, round_off));
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
            residual.max(0.5 * problem.max_open_gap(&self.members)) > SOLVER.loose_tolerance * island.size;
        report.unsolved_islands += u32::from(is_solved && touches && !is_out_of_budget && is_rough);
    }

    /// Alternate exact evaluations and sweeps until the contacts meet their laws, a limit is reached, or the budget is used up.
    fn iterate(&mut self, problem: &mut ContactProblem, island: &Island, progress: &mut Progress) -> Outcome {
        let Island { touches, size, reach, dependent } = *island;
        let round_off = island.round_off();
        let mut first_residual = f64::INFINITY;
        loop {
            let rotation = self.evaluate(problem);
            if rotation > SOLVER.relinearise * size {
                self.linearise(problem);
            }
            progress.iterations += 1;
            let enough = SOLVER.skip * self.tolerance(progress.visits) * size;
            let residual = larger(rotation, self.counted_sweep(problem, enough, progress));
            if progress.iterations == 1 {
                first_residual = residual;
            }
            let tolerance = if touches { self.tolerance(progress.visits) * size } else { 8.0 * round_off };
            let is_met = residual <= tolerance;
            let is_out_of_budget = touches && !is_met && residual.is_finite() && progress.is_out_of_budget();
            let is_last = progress.iterations == MAX_EVALUATIONS
                || progress.sweeps >= SOLVER.max_sweeps
                || !residual.is_finite();
            if is_met || is_out_of_budget || is_last {
                let allowed = if touches { SOLVER.rough_tolerance * size } else { UNSOLVED * reach };
                // Dependent held points can't be met where their devices differ, and need not be.
                let is_solved = residual <= allowed || dependent > 0 && residual <= first_residual;
                return Outcome { residual, is_solved, is_out_of_budget };
            }
            // Held points alone are solved by one sweep.
            let goal = round_off.max(SOLVER.sweep_goal * residual);
            while touches && progress.sweeps < SOLVER.max_sweeps && !progress.is_out_of_budget() {
                progress.sweeps += 1;
                let moved = self.counted_sweep(problem, SOLVER.skip * goal, progress);
                if moved <= goal.max(0.3 * self.tolerance(progress.visits) * size) {
                    break;
                }
                // Sweeps that move contacts farther than the objects reach diverge; their forces would leave round-off behind.
                if !moved.is_finite() || moved > reach {
                    progress.sweeps = SOLVER.max_sweeps;
                }
            }
        }
    }

    /// Scale the forces of an island down until its contacts give no energy. Says whether they don't.
    ///
    /// With the ends apart(s) of forces s·f, linear in s between those without forces and those of f, the contacts dissipate
    ///
    /// ```text
    /// D(s) = s·((1 − s)·D₀ + s·D₁)        D₀ = f·(apart(0) − start),  D₁ = f·(apart(1) − start)
    /// ```
    fn make_passive(&self, problem: &mut ContactProblem, round_off: f64) -> bool {
        let with_forces = problem.write_ends(&self.members) + problem.paid(&self.members);
        if with_forces >= 0.0 {
            return true;
        }
        let without = problem.dissipated_without_forces(&self.members);
        let mut share = if without > 0.0 { without / (without - with_forces) } else { 0.0 };
        for _ in 0..SOLVER.fallback_scales {
            // The forces are those of the last attempt.
            self.start(problem);
            problem.scale_forces(&self.members, share);
            let is_sound = self.evaluate_to(problem, round_off) <= round_off;
            if is_sound && problem.write_ends(&self.members) + problem.paid(&self.members) >= 0.0 {
                return true;
            }
            share = 0.5;
        }
        false
    }

    /// Scaled fallback solution: the forces that the linearisation about the free motion gives, scaled down until the
    /// equations of motion hold and contacts give no energy. Says whether such forces were found.
    fn solve_scaled(&mut self, problem: &mut ContactProblem, round_off: f64) -> bool {
        problem.release_forces(&self.bodies, &self.members);
        self.start(problem);
        self.linearise(problem);
        for _ in 0..MAX_EVALUATIONS {
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
        for _ in 0..MAX_EVALUATIONS {
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

    /// Sweep that counts towards the budget.
    fn counted_sweep(&mut self, problem: &mut ContactProblem, enough: f64, progress: &mut Progress) -> f64 {
        progress.visits += self.members.len() as u32;
        progress.done += progress.per_sweep;
        self.sweep(problem, enough)
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

//! Contact problem and its solver: the forces of all contacts that obey their laws at the end of the step.

mod bilateral;
mod constraint;
mod coulomb;
mod islands;
mod parameters;
mod problem;
mod recovery;
mod solver;

pub(crate) use constraint::Constraint;
pub(crate) use parameters::{SOLVER, UNSOLVED};
pub(crate) use problem::{ContactProblem, StepRules};
pub(crate) use recovery::RecoveryBudget;
pub(crate) use solver::{Solver, SolverReport};

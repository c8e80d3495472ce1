//! Statements and figures of the paper, each with its place in it and the part of the report that answers it.

use crate::options::Part;

/// A statement or figure of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Statement {
    ForceIndependentOfModel,
    DeformationLinearInModel,
    AdvantageGrows,
    FreeToMove,
    SlowRotation,
    DroppedTerms,
    GivenDisplacement,
    PointInTriangle,
    EulerMotion,
    PastForcesCost,
    SolutionCost,
    SurfaceCost,
    Memory,
    MotionCost,
    Figure1,
    ModelSize,
    ColumnTime,
    ColumnData,
    WholeTable,
    Averaging,
    Figure2,
    Figure3,
    Figure4,
    SeparateDeformation,
    GodObject,
    PicturesFromLog,
    Figure5a,
    Figure5b,
    ForceTime,
    CycleTime,
    BeyondFem,
}

impl Statement {
    /// All of them, in the order of the paper.
    pub const ALL: [Self; 31] = {
        use Statement::*;
        [
            ForceIndependentOfModel,
            DeformationLinearInModel,
            AdvantageGrows,
            FreeToMove,
            SlowRotation,
            DroppedTerms,
            GivenDisplacement,
            PointInTriangle,
            EulerMotion,
            PastForcesCost,
            SolutionCost,
            SurfaceCost,
            Memory,
            MotionCost,
            Figure1,
            ModelSize,
            ColumnTime,
            ColumnData,
            WholeTable,
            Averaging,
            Figure2,
            Figure3,
            Figure4,
            SeparateDeformation,
            GodObject,
            PicturesFromLog,
            Figure5a,
            Figure5b,
            ForceTime,
            CycleTime,
            BeyondFem,
        ]
    };

    /// Place in the paper, and what it says there.
    pub fn text(self) -> (&'static str, &'static str) {
        use Statement::*;
        match self {
            ForceIndependentOfModel => {
                ("abstract", "The time for a force does not depend on the complexity of the model.")
            }
            DeformationLinearInModel => {
                ("abstract", "The time for the deformation is proportional to the complexity of the model.")
            }
            AdvantageGrows => (
                "section 1",
                "The advantage over a finite element method grows with the complexity of the model.",
            ),
            FreeToMove => (
                "section 2.1",
                "No part of the object needs to be fixed: an impulse gives it momentum and angular momentum.",
            ),
            SlowRotation => (
                "section 2.1",
                "While the angular rate is not large, the nonlinearity of rotation is negligible.",
            ),
            DroppedTerms => (
                "equation (3)",
                "The terms of acceleration and angular acceleration are negligible for a small step.",
            ),
            GivenDisplacement => (
                "equations (4), (9)",
                "Where the displacement is given, the force follows from R[0] and the forces before.",
            ),
            PointInTriangle => (
                "section 2.3",
                "Between nodes, the force is distributed to the corners of a triangle, approximately.",
            ),
            EulerMotion => ("equations (11)–(14)", "The motion is described by Euler's method."),
            PastForcesCost => ("section 2.5", "The displacement from past forces costs O(n_c²·T)."),
            SolutionCost => ("section 2.5", "Equation (9) costs O(n_c³)."),
            SurfaceCost => {
                ("section 2.5", "The displacement of all other degrees of freedom costs O(n·n_c·T).")
            }
            Memory => ("section 2.5", "The table takes O(n²·T) numbers, the past forces O(n_c·T)."),
            MotionCost => ("section 2.5", "The motion costs O(N) for N objects, which is negligible."),
            Figure1 => ("figure 1", "The model, a cube of tetrahedra."),
            ModelSize => ("table 1", "866 free nodes, 1728 triangles, 2197 nodes, 8640 tetrahedra."),
            ColumnTime => {
                ("table 1", "Recording takes 92.8 s per degree of freedom, on four Itanium2 of 1.4 GHz.")
            }
            ColumnData => ("table 1", "Recording gives 9.9 MB per degree of freedom."),
            WholeTable => ("table 1", "Not stated: the whole table follows as 67 h and 25 GiB."),
            Averaging => (
                "section 3.1",
                "Steps of 1 ms, of which two are averaged, improve the accuracy of quick deformation.",
            ),
            Figure2 => (
                "figure 2",
                "An impulse by a point: the wave has reached all nodes after approximately 16 ms.",
            ),
            Figure3 => ("figure 3", "An impulse by a plane on all nodes of the top."),
            Figure4 => (
                "figure 4",
                "Haptic update at 1 kHz and force process at 500 Hz on two computers, joined by a network.",
            ),
            SeparateDeformation => {
                ("section 3.2", "The deformation is computed beside the force process, asynchronously.")
            }
            GodObject => (
                "section 3.2",
                "The god-object gives the displacement: from where the interface point may be to where it is.",
            ),
            PicturesFromLog => ("section 3.3", "The images are made off line from the log of the forces."),
            Figure5a => ("figure 5(a)", "The cube falls on a floor, deforms and bounces."),
            Figure5b => {
                ("figure 5(b)", "Two interface points hold the cube and shake it at 2 Hz without gravity.")
            }
            ForceTime => ("section 3.3", "A force takes at most approximately 0.5 ms, on three processors."),
            CycleTime => ("section 3.3", "The whole force process ends within every cycle of 2 ms."),
            BeyondFem => ("section 4", "Forces come at haptic rates, which finite elements barely attain."),
        }
    }

    /// Part of the report that answers it.
    pub fn part(self) -> Part {
        use Statement::*;
        match self {
            Figure1 | ModelSize | ColumnTime | ColumnData | WholeTable => Part::Recording,
            Figure2 | Figure3 => Part::Impulses,
            Averaging => Part::Passivity,
            GivenDisplacement | PointInTriangle | GodObject => Part::Agreement,
            ForceIndependentOfModel
            | DeformationLinearInModel
            | AdvantageGrows
            | PastForcesCost
            | SolutionCost
            | SurfaceCost
            | Memory
            | MotionCost
            | BeyondFem => Part::Cost,
            SlowRotation | DroppedTerms | EulerMotion => Part::Motion,
            PicturesFromLog | Figure5a => Part::Fall,
            FreeToMove | Figure4 | SeparateDeformation | Figure5b | ForceTime | CycleTime => Part::Shake,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_statement_is_listed_once_and_every_part_answers_some() {
        for (at, statement) in Statement::ALL.iter().enumerate() {
            assert!(!Statement::ALL[..at].contains(statement), "{statement:?} is twice in the list");
        }
        for part in Part::ALL {
            assert!(
                Statement::ALL.iter().any(|statement| statement.part() == part),
                "{part:?} answers nothing"
            );
        }
    }
}

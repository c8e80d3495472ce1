//! The cost of direct convolution, against section 2.5 of the paper, and that of finite elements beside it.

mod measure;

use crate::bodies::cube;
use crate::chapter::{Chapter, csv};
use crate::chart::{Axis, AxisName, Chart, ReferenceLine, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::medians::Median;
use crate::options::Effort;
use crate::page::{Section, code, figure, paragraph};
use crate::progress::StageProgress;
use crate::statements::Statement;
use crate::verdict::quantity;
use measure::{Cost, Form, finite_element_time, measure, motion_time};
use palpate_fem::SilentProgress;

const USUAL_SAMPLES: usize = 500;
const USUAL_POINTS: usize = 2;
/// Window in which the solution of equation (9) outweighs the convolution.
const SHORT_SAMPLES: usize = 2;

/// Modes of the bodies: few, for the numbers in the table do not change its cost.
const MODES: usize = 60;

/// Cells along a side of the cubes; the last but one is the paper's.
const CELLS: [u32; 5] = [4, 6, 8, 12, 16];
const POINTS: [usize; 5] = [1, 2, 4, 8, 16];
const MANY_POINTS: [usize; 4] = [4, 8, 16, 32];
const WINDOWS: [usize; 5] = [125, 250, 500, 1000, 2000];
const OBJECTS: [usize; 4] = [1, 4, 16, 64];

/// Step of the paper [µs].
const PAPER_STEP_US: f64 = 2000.0;

/// A cube of some fineness: the costs of both forms, and of one solution of its finite elements.
struct ByMesh {
    table: Cost,
    modal: Cost,
    elements: Median,
}

/// Everything that is measured.
struct Measured {
    by_mesh: Vec<ByMesh>,
    by_contacts: Vec<Cost>,
    by_many_contacts: Vec<Cost>,
    by_samples: Vec<Cost>,
    by_objects: Vec<Median>,
}

impl Measured {
    fn new(effort: Effort, progress: &mut dyn StageProgress) -> Result<Self, ReproduceError> {
        // In the tests' coarse reports the finest cubes would take most of the time.
        let cells = CELLS.iter().filter(|cells| **cells <= 2 * effort.cells);
        let stages = 2 * cells.clone().count() + POINTS.len() + MANY_POINTS.len() + WINDOWS.len();
        progress.begin("cost of direct convolution", stages as u64);
        let mut done = 0;
        let mut over = |body: &palpate_fem::RecordedBody, points: usize, form: Form| {
            let cost = measure(body, points, form, effort.steps);
            done += 1;
            progress.advance(done);
            cost
        };
        let mut by_mesh = Vec::new();
        for &cells in cells {
            let body = cube(cells, MODES, &mut SilentProgress)?;
            by_mesh.push(ByMesh {
                table: over(&body, USUAL_POINTS, Form::Table(USUAL_SAMPLES))?,
                modal: over(&body, USUAL_POINTS, Form::Modal)?,
                elements: finite_element_time(&body)?,
            });
        }
        let usual = cube(effort.cells.min(8), MODES, &mut SilentProgress)?;
        let mut all = |points: &[usize], window: usize| -> Result<Vec<Cost>, ReproduceError> {
            points.iter().map(|&points| over(&usual, points, Form::Table(window))).collect()
        };
        let (by_contacts, by_many_contacts) =
            (all(&POINTS, USUAL_SAMPLES)?, all(&MANY_POINTS, SHORT_SAMPLES)?);
        let by_samples = WINDOWS.map(|samples| over(&usual, USUAL_POINTS, Form::Table(samples)));
        let by_samples = by_samples.into_iter().collect::<Result<_, _>>()?;
        let by_objects = OBJECTS.map(|objects| motion_time(&usual, objects, effort.steps));
        let by_objects = by_objects.into_iter().collect::<Result<_, _>>()?;
        progress.finish();
        Ok(Self { by_mesh, by_contacts, by_many_contacts, by_samples, by_objects })
    }

    fn all(&self) -> impl Iterator<Item = &Cost> {
        let meshes = self.by_mesh.iter().flat_map(|mesh| [&mesh.table, &mesh.modal]);
        meshes.chain(&self.by_contacts).chain(&self.by_many_contacts).chain(&self.by_samples)
    }

    /// The cube of the paper's mesh, or the finest of a coarse report.
    fn papers(&self) -> Option<&ByMesh> {
        let papers = self.by_mesh.iter().find(|mesh| mesh.table.observed == 2598);
        papers.or(self.by_mesh.last())
    }
}

/// Slope of a line through points on logarithmic axes: the power that y grows with.
fn power(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (mut above, mut below) = (0.0, 0.0);
    for (a, b) in logs {
        above += (a - x) * (b - y);
        below += (a - x) * (a - x);
    }
    above / below
}

fn line(label: &str, points: Vec<(f64, f64)>) -> Series {
    Series { label: format!("{label} (power {:.2})", power(&points)), points, style: Style::LineAndMarkers }
}

fn chart(title: &str, x: &str, series: Vec<Series>, reference_lines: Vec<ReferenceLine>) -> String {
    Chart {
        title: title.into(),
        x: Axis { label: x.into(), scale: Scale::Log },
        y: Axis { label: "time [µs]".into(), scale: Scale::Log },
        series,
        reference_lines,
    }
    .svg()
}

fn curve(costs: &[Cost], x: fn(&Cost) -> f64, y: fn(&Cost) -> Median) -> Vec<(f64, f64)> {
    costs.iter().map(|cost| (x(cost), y(cost).us)).collect()
}

/// The charts with their captions.
fn figures(measured: &Measured) -> String {
    let Measured { by_mesh, by_contacts, by_many_contacts, by_samples, by_objects } = measured;
    let over_mesh = |of: &dyn Fn(&ByMesh) -> f64| -> Vec<(f64, f64)> {
        by_mesh.iter().map(|mesh| (mesh.table.observed as f64, of(mesh))).collect()
    };
    let cycle = ReferenceLine { axis: AxisName::Y, value: PAPER_STEP_US, label: "2 ms".into() };
    let contact: fn(&Cost) -> f64 = |cost| cost.contact as f64;
    let history: fn(&Cost) -> f64 = |cost| (cost.contact * cost.samples()) as f64;
    let force: fn(&Cost) -> Median = |cost| cost.force;
    let deformation: fn(&Cost) -> Median = |cost| cost.deformation;
    figure(
        &chart(
            "Against the observed degrees of freedom n",
            "n",
            vec![
                line("force, R[s]", over_mesh(&|mesh| mesh.table.force.us)),
                line("deformation, R[s]", over_mesh(&|mesh| mesh.table.deformation.us)),
                line("force, modal", over_mesh(&|mesh| mesh.modal.force.us)),
                line("deformation, modal", over_mesh(&|mesh| mesh.modal.deformation.us)),
                line("finite elements, one solve", over_mesh(&|mesh| mesh.elements.us)),
            ],
            vec![cycle],
        ),
        "Time of a step over the fineness of the mesh. Two nodes are held (n_c = 6), T = 500; the modal form has 60 modes. Finite elements: one solution with the \
         factored system matrix of the whole mesh and the products of a step, the least that a step of implicit time integration needs.",
    ) + &figure(
        &chart(
            "Force against contacts and window",
            "n_c, or T/100",
            vec![
                line("against n_c, T = 500", curve(by_contacts, contact, force)),
                line("against n_c, T = 2", curve(by_many_contacts, contact, force)),
                line(
                    "against T/100, n_c = 6",
                    curve(by_samples, |cost| cost.samples() as f64 / 100.0, force),
                ),
            ],
            Vec::new(),
        ),
        "Time of a force on R[s]. The paper: O(n_c²·T) for the displacement from past forces, which a long window shows, and O(n_c³) for the solution, which a window \
         of two samples shows.",
    ) + &figure(
        &chart(
            "Deformation against n_c·T",
            "n_c·T",
            vec![
                line("n_c grows, T = 500", curve(by_contacts, history, deformation)),
                line("T grows, n_c = 6", curve(by_samples, history, deformation)),
            ],
            Vec::new(),
        ),
        "Time of the deformation of the whole surface on R[s]. The paper: O(n·n_c·T).",
    ) + &figure(
        &chart(
            "Motion against the objects N",
            "N",
            vec![line(
                "step without contact",
                OBJECTS.iter().zip(by_objects).map(|(n, m)| (*n as f64, m.us)).collect(),
            )],
            Vec::new(),
        ),
        "Time of a step of N cubes of 60 modes that touch nothing: their motion and free vibration. The paper: O(N).",
    )
}

/// The curves of the report.
pub fn chapter(effort: Effort, progress: &mut dyn StageProgress) -> Result<Chapter, ReproduceError> {
    let measured = Measured::new(effort, progress)?;
    let papers =
        measured.papers().ok_or_else(|| ReproduceError::Measurement("no mesh was measured".into()))?;
    let (n, bytes) = (papers.table.observed, papers.table.table_bytes);
    // Forces, written twice, and the copied series with two sources.
    let history_bytes = 2 * 24 * USUAL_SAMPLES + 2 * 72 * USUAL_SAMPLES;
    let html = paragraph(&format!(
        "Median step times over {} steps with a full history on one thread, cubes of linear elements; times of forces are means of 16 steps, over which a convolution spreads its work. A step holds the fixed cost of \
         about a microsecond for motion and energies as well, so powers at the small end are below the paper's.",
        effort.steps,
    )) + &figures(&measured)
        + &paragraph(&format!(
            "The table is n·n_touch·T numbers: {:.1} MB for the six columns in use with n = {n} and T = 500 in double precision; the history adds {:.0} kB per point in contact.",
            bytes as f64 / 1e6,
            history_bytes as f64 / 1e3
        ))
        + &code("palpate reproduce --only cost");
    let rows = measured.all().map(|cost| {
        vec![
            f64::from(u8::from(cost.form == Form::Modal)),
            cost.observed as f64,
            cost.contact as f64,
            cost.samples() as f64,
            cost.force.us,
            cost.force.low_us,
            cost.force.high_us,
            cost.force_p99_us,
            cost.deformation.us,
            cost.table_bytes as f64,
        ]
    });
    let data = vec![
        csv(
            "cost.csv",
            "is_modal,observed_dofs,contact_dofs,samples,force_p50_us,force_p50_low_us,force_p50_high_us,force_p99_us,deformation_p50_us,table_bytes",
            rows,
        ),
        csv(
            "cost_finite_elements.csv",
            "observed_dofs,solve_us,solve_low_us,solve_high_us,force_us",
            measured.by_mesh.iter().map(|mesh| {
                let Median { us, low_us, high_us } = mesh.elements;
                vec![mesh.table.observed as f64, us, low_us, high_us, mesh.table.force.us]
            }),
        ),
    ];
    let findings = findings(&measured, papers, history_bytes);
    let section = Section { id: "cost".into(), heading: "Cost (the paper's section 2.5)".into(), body: html };
    Ok(Chapter { section, data, findings })
}

/// Margin of the power of a measured curve above that of its order: what else the machine does bends a curve.
const POWER_MARGIN: f64 = 0.25;

/// Power of x between the ends of a curve; NaN of fewer than two points.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let ends = points.first().zip(points.last()).filter(|(first, last)| first.0 < last.0);
    ends.map_or(f64::NAN, |((x, y), (last_x, last_y))| (last_y / y).ln() / (last_x / x).ln())
}

fn findings(measured: &Measured, papers: &ByMesh, history_bytes: usize) -> Vec<Finding> {
    // Times and no powers: what else the machine does bends a curve, and the table has no room to tell.
    let ends = |costs: &[Cost], name: &str, x: fn(&Cost) -> usize, y: fn(&Cost) -> Median| {
        let at = |cost: &Cost| format!("{} at {name} = {}", y(cost), x(cost));
        let (first, last) = (costs.first().map(at), costs.last().map(at));
        format!("{}, {}", first.unwrap_or_default(), last.unwrap_or_default())
    };
    let tables: Vec<Cost> = measured.by_mesh.iter().map(|mesh| mesh.table).collect();
    let ratio = |mesh: &ByMesh| mesh.elements.us / mesh.table.force.us;
    let ratios: Vec<String> = measured
        .by_mesh
        .iter()
        .map(|mesh| format!("{:.0} at n = {}", ratio(mesh), mesh.table.observed))
        .collect();
    let objects = OBJECTS.iter().zip(&measured.by_objects).map(|(n, median)| format!("{median} for N = {n}"));
    let objects: Vec<String> = objects.collect();
    let power = |costs: &[Cost], name: &str, x: fn(&Cost) -> usize, y: fn(&Cost) -> Median, papers: f64| {
        let points: Vec<(f64, f64)> = costs.iter().map(|cost| (x(cost) as f64, y(cost).us)).collect();
        quantity(name, exponent(&points), "").at_most(papers + POWER_MARGIN)
    };
    let by_objects: Vec<(f64, f64)> =
        OBJECTS.iter().zip(&measured.by_objects).map(|(n, median)| (*n as f64, median.us)).collect();
    let gains: Vec<f64> = measured.by_mesh.iter().map(ratio).collect();
    let gain = gains.last().zip(gains.first()).map_or(f64::NAN, |(last, first)| last / first);
    let numbers = 6 * papers.table.observed * USUAL_SAMPLES * 8;
    vec![
        Finding::measured(
            Statement::ForceIndependentOfModel,
            power(&tables, "power of n", |c| c.observed, |c| c.force, 0.0),
            ends(&tables, "n", |c| c.observed, |c| c.force),
        ),
        Finding::measured(
            Statement::DeformationLinearInModel,
            power(&tables, "power of n", |c| c.observed, |c| c.deformation, 1.0),
            ends(&tables, "n", |c| c.observed, |c| c.deformation),
        ),
        Finding::measured(
            Statement::AdvantageGrows,
            quantity("gain, finest by coarsest mesh", gain, "").at_least(1.0),
            format!(
                "one solve of the finite elements takes, in times of a force on R[s]: {}",
                ratios.join(", ")
            ),
        ),
        Finding::measured(
            Statement::PastForcesCost,
            power(&measured.by_contacts, "power of n_c", |c| c.contact, |c| c.force, 2.0).and(power(
                &measured.by_samples,
                "power of T",
                Cost::samples,
                |c| c.force,
                1.0,
            )),
            format!(
                "{}; {}",
                ends(&measured.by_contacts, "n_c", |c| c.contact, |c| c.force),
                ends(&measured.by_samples, "T", Cost::samples, |c| c.force)
            ),
        ),
        Finding::measured(
            Statement::SolutionCost,
            power(&measured.by_many_contacts, "power of n_c", |c| c.contact, |c| c.force, 3.0),
            format!("with T = 2: {}", ends(&measured.by_many_contacts, "n_c", |c| c.contact, |c| c.force)),
        ),
        Finding::measured(
            Statement::SurfaceCost,
            power(&measured.by_samples, "power of T", Cost::samples, |c| c.deformation, 1.0),
            ends(&measured.by_samples, "T", Cost::samples, |c| c.deformation),
        ),
        Finding::derived(
            Statement::Memory,
            quantity("bytes by n·6·T·8", papers.table.table_bytes as f64 / numbers as f64, "").equals(1.0),
            format!(
                "6 columns × n = {} × T = 500 × 8 bytes = {:.1} MB in use; history {:.0} kB per point",
                papers.table.observed,
                papers.table.table_bytes as f64 / 1e6,
                history_bytes as f64 / 1e3
            ),
        ),
        Finding::measured(
            Statement::MotionCost,
            quantity("power of N", exponent(&by_objects), "").at_most(1.0 + POWER_MARGIN),
            objects.join(", "),
        ),
        Finding::measured(
            Statement::BeyondFem,
            quantity("solve of finite elements by a force", ratio(papers), "").at_least(1.0),
            format!(
                "on this machine one solve of the finite elements with n = {} takes {}, a force on R[s] {}",
                papers.table.observed, papers.elements, papers.table.force
            ),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_of_a_power_law_is_its_exponent() {
        let points: Vec<(f64, f64)> = [1.0, 2.0, 5.0, 11.0_f64].map(|x| (x, 3.0 * x.powf(1.7))).to_vec();
        assert!((power(&points) - 1.7).abs() < 1e-12);
    }
}

//! Table 1: the size of the model, and what recording a column costs.

use crate::chapter::{Chapter, csv};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::options::Effort;
use crate::page::{Section, code, paragraph, table};
use crate::progress::StageProgress;
use palpate::Sampling;
use palpate_fem::RecordedBody;
use palpate_fem::table::{COLUMN_BLOCK, TableMethod, TableParameters, TableRecorder};
use std::time::Instant;

/// The paper's sampling: 500 samples in 1 s; a tenth of them is timed, since every sample costs the same.
const SAMPLES: usize = 500;
const TIMED: usize = 50;
const STEP_S: f64 = 2e-3;

/// Table 1 with our figures beside the paper's.
pub fn chapter(
    body: &RecordedBody,
    effort: Effort,
    progress: &mut dyn StageProgress,
) -> Result<Chapter, ReproduceError> {
    let surface = body.surface_nodes();
    let ways = [
        ("closed form, 200 modes and residual", TableMethod::ClosedForm, Sampling::End),
        ("time integration, the paper's sampling", TableMethod::Transient { substeps: 1 }, Sampling::Mean),
        ("time integration, end of step", TableMethod::Transient { substeps: 1 }, Sampling::End),
    ];
    let mut seconds = Vec::new();
    for (_, method, sampling) in ways {
        let parameters = TableParameters {
            step_s: STEP_S,
            samples: TIMED,
            sampling,
            method,
            touchable_nodes: surface.clone(),
            observed_nodes: surface.clone(),
        };
        let recorder = TableRecorder::new(body, &parameters)?;
        let columns = effort.columns.min(3 * surface.len());
        progress.begin("timing a column", columns as u64);
        let counter = progress.counter();
        let before = Instant::now();
        let made = recorder.columns(0..columns, COLUMN_BLOCK, &|done| counter(done));
        seconds.push(before.elapsed().as_secs_f64() / made.len() as f64 * (SAMPLES / TIMED) as f64);
    }
    progress.finish();

    let dofs = 3 * surface.len();
    let mebibytes = |bytes: usize| (SAMPLES * dofs * bytes) as f64 / 1_048_576.0;
    let count = |n: usize| n.to_string();
    let row = |what: &str, paper: &str, ours: String| vec![what.into(), paper.into(), ours];
    let mut rows = vec![
        row("free nodes on the surface", "866", count(surface.len())),
        row("surface triangles", "1728", count(body.surface_triangles().len())),
        row("entire nodes", "2197", count(body.nodes().len())),
        row("tetrahedral elements", "8640", count(body.element_count())),
        row("data per d.o.f., double precision [MB]", "9.9", format!("{:.1}", mebibytes(8))),
        row("data per d.o.f., single precision [MB]", "", format!("{:.1}", mebibytes(4))),
    ];
    for ((name, ..), seconds) in ways.iter().zip(&seconds) {
        let paper = if name.contains("paper") { "92.8" } else { "" };
        rows.push(row(&format!("computing a d.o.f. [s]: {name}"), paper, format!("{seconds:.3}")));
    }
    rows.push(row(
        "all d.o.f.s, the paper's sampling [h]",
        &format!("{:.0}", 92.8 * dofs as f64 / 3600.0),
        format!("{:.2}", seconds[1] * dofs as f64 / 3600.0),
    ));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let html = table("Table 1: complexity of the model", &["", "paper", "palpate"], &rows)
        + &paragraph(&format!(
            "Times are wall-clock time per column of {SAMPLES} samples of 2 ms (of which {TIMED} were timed), {} columns at a time on \
             {cores} cores of this machine ({}); the paper used four Itanium2 processors at 1.4 GHz. The paper's sampling integrates with steps of \
             1 ms and averages two; ours is an order-5 integrator with five solves per step (docs/table.md). The last row is \
             the time per column times {dofs} columns. The paper's MB are 2²⁰ bytes.",
            effort.columns,
            processor()
        ))
        + &code(
            "palpate record box:0.1x0.1x0.1/12x12x12 --order 1 \\\n    --young 2000 --poisson 0.49 --density 110 --rayleigh 2,2e-4 \\\n    \
             --dense cube.zarr --method transient --sampling mean \\\n    --step 0.002 --duration 1",
        );
    let section = Section { id: "recording".into(), heading: "Recording (Table 1)".into(), body: html };
    let finding = |what: &str, paper: &str, ours: String| Finding {
        what: what.into(),
        place: "table 1",
        paper: paper.into(),
        ours,
        section: "recording",
    };
    let findings = vec![
        finding(
            "nodes of the cube: all, on the surface; tetrahedra",
            "2197, 866; 8640",
            format!("{}, {}; {}", body.nodes().len(), surface.len(), body.element_count()),
        ),
        finding(
            "recording one degree of freedom",
            "92.8 s, on four Itanium2",
            format!("{:.3} s the paper's way, {:.4} s in closed form", seconds[1], seconds[0]),
        ),
        finding("data of one degree of freedom", "9.9 MB", format!("{:.1} MB", mebibytes(8))),
    ];
    let data = csv(
        "table1.csv",
        "closed_form_s_per_dof,transient_mean_s_per_dof,transient_end_s_per_dof",
        [seconds].into_iter(),
    );
    Ok(Chapter { section, data: vec![data], findings })
}

/// The processor's name, where the system tells.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = text.lines().find(|line| line.starts_with("model name"));
    let name = line.and_then(|line| line.split_once(':')).map(|(_, name)| name.trim());
    name.unwrap_or("unknown processor").into()
}

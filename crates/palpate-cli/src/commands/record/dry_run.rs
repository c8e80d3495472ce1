//! `palpate record --dry-run`: what a recording will take.

use super::Arguments;
use crate::failure::Failure;
use crate::terminal::{print, print_json};
use palpate_fem::{Estimate, available_memory, estimate};
use palpate_scene::PreparedBody;
use serde_json::json;

/// Prints the cost of a recording; fails if it needs more memory than is free.
pub fn print_estimate(arguments: &Arguments, body: PreparedBody) -> Result<(), Failure> {
    let PreparedBody { mesh, parameters, .. } = body;
    let source = parameters.source.clone();
    let failed = |error: palpate_fem::RecordError| Failure(format!("{source}: {error}"));
    let cost = estimate(mesh, &parameters).map_err(failed)?;
    if arguments.json {
        print_json(&as_json(&cost))?;
    } else {
        print(&as_text(&source, &cost))?;
    }
    cost.check_memory().map_err(failed)
}

fn as_json(cost: &Estimate) -> serde_json::Value {
    json!({
        "nodes": cost.nodes,
        "elements": cost.elements,
        "degrees_of_freedom": cost.dofs,
        "surface_nodes": cost.surface_nodes,
        "modes": cost.modes,
        "factor_bytes": cost.factor_bytes,
        "memory_bytes": cost.memory_bytes,
        "available_bytes": available_memory(),
        "file_bytes": cost.file_bytes,
        "seconds": cost.seconds,
        "threads": cost.threads,
    })
}

fn as_text(source: &str, cost: &Estimate) -> String {
    let free = available_memory().map_or(String::new(), |bytes| format!(" of {} that are free", size(bytes)));
    format!(
        "{source}: nothing is recorded (--dry-run)\n  model        {} nodes, {} elements, {} degrees of freedom that can move\n  \
         surface      {} nodes\n  modes        {}\n  memory       about {}{free}\n  time         about {} on {} threads of a machine \
         that has nothing else to do\n  file         about {}\n",
        cost.nodes,
        cost.elements,
        cost.dofs,
        cost.surface_nodes,
        cost.modes,
        size(cost.memory_bytes as f64),
        duration(cost.seconds),
        cost.threads,
        size(cost.file_bytes as f64),
    )
}

/// A size with three digits.
fn size(bytes: f64) -> String {
    let (scale, unit) = if bytes < 1e9 { (1e6, "MB") } else { (1e9, "GB") };
    let value = bytes / scale;
    let digits = if value < 10.0 { 2 } else { usize::from(value < 100.0) };
    format!("{value:.digits$} {unit}")
}

fn duration(seconds: f64) -> String {
    if seconds < 100.0 { format!("{seconds:.0} s") } else { format!("{:.0} min", seconds / 60.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_times_have_the_digits_that_an_estimate_has() {
        let sizes = [4.6e5, 1.77e7, 2.46e8, 1.23e9, 4.5e10].map(size);
        assert_eq!(sizes, ["0.46 MB", "17.7 MB", "246 MB", "1.23 GB", "45.0 GB"]);
        assert_eq!([3.2, 99.0, 150.0].map(duration), ["3 s", "99 s", "2 min"]);
    }
}

//! `palpate materials`: the materials that have a name.

use crate::failure::Failure;
use crate::terminal::{print, print_json};
use clap::Args;
use palpate::Damping;
use palpate_fem::{ElasticLaw, LibraryMaterial, MATERIALS};
use serde_json::{Value, json};
use std::fmt::Write;

/// Show the materials that have a name, with their numbers and sources
///
/// Each has a value for a first try and the range of the literature. Measure yours where the force matters: soft tissue scatters by a
/// factor of ten.
#[derive(Args)]
#[command(after_help = "Use:
  palpate record liver.vtu --material liver --damping-ratio 0.1 -o liver.palp
  palpate record hand.msh --material skin=skin --material bone=wood -o hand.palp     # REGION=NAME

A material file takes them as `name = \"liver\"`, see `palpate record --help`. Where no damping stands, the source has none: give
--damping-ratio or --rayleigh. A wooden body has its grain along x, rings along y; `axes` of a material file turn it.")]
pub struct Arguments {
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn materials(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.json {
        return print_json(&json!({ "materials": MATERIALS.iter().map(as_json).collect::<Vec<_>>() }));
    }
    print(&as_text().map_err(|error| Failure(error.to_string()))?)
}

fn as_text() -> Result<String, std::fmt::Error> {
    let mut out = String::new();
    writeln!(
        out,
        "{:<14} {:>9} {:>12} {:>21} {:>6}  damping",
        "name", "ρ [kg/m³]", "E [Pa]", "range of E [Pa]", "ν"
    )?;
    for one in MATERIALS {
        let material = one.material();
        let [low, high] = one.young_range_pa;
        let damping = match one.damping {
            None => "—".to_owned(),
            Some(Damping::Ratio(ratio)) => format!("ratio {ratio}"),
            Some(Damping::Rayleigh { alpha, beta }) => format!("Rayleigh {alpha} 1/s, {beta:e} s"),
        };
        let (young, poisson) = match one.law {
            ElasticLaw::Isotropic { .. } => (number(material.young_pa), material.poisson.to_string()),
            ElasticLaw::Orthotropic(_) => ("orthotropic".to_owned(), "—".to_owned()),
        };
        let range = format!("{} to {}", number(low), number(high));
        writeln!(
            out,
            "{:<14} {:>9} {young:>12} {range:>21} {poisson:>6}  {damping}",
            one.name, material.density_kg_m3
        )?;
    }
    writeln!(out, "\nSources")?;
    for one in MATERIALS {
        writeln!(out, "  {:<14} {}", one.name, one.source)?;
        if let ElasticLaw::Orthotropic(constants) = one.law {
            let list = |values: [f64; 3]| values.map(number).join(", ");
            let poisson = constants.poisson.map(|value| value.to_string()).join(", ");
            writeln!(
                out,
                "  {:<14} E1, E2, E3 = {} Pa; ν12, ν13, ν23 = {poisson}; G12, G13, G23 = {} Pa",
                "",
                list(constants.young),
                list(constants.shear)
            )?;
        }
    }
    Ok(out)
}

/// A modulus with three digits.
fn number(value: f64) -> String {
    format!("{value:.2e}")
}

fn as_json(one: &LibraryMaterial) -> Value {
    let material = one.material();
    let damping = match one.damping {
        None => Value::Null,
        Some(Damping::Ratio(ratio)) => json!({ "ratio": ratio }),
        Some(Damping::Rayleigh { alpha, beta }) => json!({ "alpha_per_s": alpha, "beta_s": beta }),
    };
    json!({
        "name": one.name,
        "young_pa": material.young_pa,
        "poisson": material.poisson,
        "stiffness_pa": material.stiffness_pa,
        "young_range_pa": one.young_range_pa,
        "density_kg_m3": material.density_kg_m3,
        "damping": damping,
        "source": one.source,
    })
}

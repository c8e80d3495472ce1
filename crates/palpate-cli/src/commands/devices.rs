//! `palpate devices`: haptic devices of this machine.

use crate::failure::Failure;
use crate::terminal::{print, print_json};
use clap::Args;
use palpate_haptics::Error;
use palpate_haptics::device::{DeviceSpec, DiscoveredDevice, Driver, discover};
use serde_json::json;

/// List haptic devices, with the reason where one is not available
///
/// Each driver looks for its devices through the vendor's software, and opens each briefly, without force.
#[derive(Args, Debug, Clone)]
#[command(after_help = "A device that was found:
  palpate device NAME --driver dhd --which 0      # for a scene with linked = true
  driver = { kind = \"dhd\", id = 0 }               # in a scene for palpate run --realtime
Without a device: palpate device NAME --path FILE.csv --simulated touch
Vendor software in other places is named in PALPATE_LIBHD, PALPATE_LIBDHD (files) and PALPATE_HAPLY (ADDRESS:PORT).")]
pub struct Arguments {
    /// One JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

type Discovered = Vec<(Driver, Result<Vec<DiscoveredDevice>, Error>)>;

/// Runs the command.
pub fn devices(arguments: &Arguments) -> Result<(), Failure> {
    let discovered = discover();
    if arguments.json { print_json(&json(&discovered)) } else { print(&text(&discovered)) }
}

fn json(discovered: &Discovered) -> serde_json::Value {
    let device = |one: &DiscoveredDevice| {
        json!({
            "index": one.index,
            "name": one.name,
            "serial": one.serial,
            "force_n": one.force_n,
            "why_not": one.unavailable,
        })
    };
    let drivers = discovered.iter().map(|(driver, found)| {
        json!({
            "driver": driver.name(),
            "variable": driver.variable(),
            "devices": found.as_ref().map_or(Vec::new(), |found| found.iter().map(device).collect()),
            "why_not": found.as_ref().err().map(ToString::to_string),
        })
    });
    let simulated = DeviceSpec::KNOWN.map(|traits| json!({ "name": traits.kind, "force_n": traits.force_n }));
    json!({ "drivers": drivers.collect::<Vec<_>>(), "simulated": simulated })
}

fn text(discovered: &Discovered) -> String {
    let mut out = String::new();
    for (driver, found) in discovered {
        let lines = match found {
            Ok(found) => found.iter().map(line).collect(),
            Err(error) => {
                let (text, name) = (error.to_string(), format!("{}: ", driver.name()));
                vec![format!("none: {}", text.strip_prefix(&name).unwrap_or(&text))]
            }
        };
        for line in lines {
            out += &format!("{:<12} {line}\n", driver.name());
        }
    }
    for traits in DeviceSpec::KNOWN {
        out += &format!("{:<12} {}, {} N\n", "simulated", traits.kind, traits.force_n);
    }
    out
}

fn line(one: &DiscoveredDevice) -> String {
    let force = one.force_n.map_or(String::new(), |force| format!(", {force} N"));
    let why_not = one.unavailable.as_ref().map_or(String::new(), |why| format!(": can't be had: {why}"));
    format!("{one}{force}{why_not}")
}

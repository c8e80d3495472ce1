//! Attacks on a process that holds a hand: each way out of it must leave the device without force. The device is a stand-in for Haply's
//! service, which holds the last force of a client that has gone.

#[path = "../../palpate-haptics/tests/standins/inverse_service.rs"]
#[allow(dead_code)]
mod inverse_service;

use crate::attack::{Attack, Verdict, require};
use crate::child::{PATIENCE, Running, send_signal, wait_until};
use crate::workplace::Workplace;
use inverse_service::Service;
use std::process::Command;
use std::time::{Duration, Instant};

/// The attacks.
pub const ATTACKS: &[Attack] = &[
    Attack { group: "hand", name: "INT, TERM and HUP with a force on", run: signals },
    Attack { group: "hand", name: "KILL, ABRT and SEGV with a force on", run: ends },
    Attack { group: "hand", name: "a process that hangs (STOP) with a force on", run: hang },
    Attack { group: "hand", name: "the parent is killed with a force on", run: parent },
    Attack { group: "hand", name: "the guardian is killed", run: no_guardian },
];

/// Force from which on a device pushes [N]: half of its limit.
const PUSHES_N: f64 = 0.2;

/// A run with a device that pulls its hand to a point that it does not reach.
struct Held {
    service: Service,
    run: Running,
}

impl Held {
    /// Starts a run, by `sh -c` with a script where one is given, and waits for its force.
    fn start(workplace: &Workplace, script: Option<&str>) -> Result<Self, String> {
        let service = Service::new();
        service.set(|world| world.cursor = [0.0; 3]);
        let scene = "step = 0.001\n[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\n[[device]]\nname = \"hand\"\n\
                     mode = \"held\"\nattach = { object = \"cube\", point = [-0.05, 0.0, 0.0] }\n\
                     driver = { kind = \"haply\", armed = true, max_force = 0.4 }\n\
                     mount = { position = [-0.055, 0.0, 0.0] }\ncoupling = { stiffness = 200.0, damping = 0.5 }\n";
        workplace.write("hand.toml", scene)?;
        let arguments = "run hand.toml --realtime --duration 600 --pictures 0";
        let mut command = match script {
            None => workplace.palpate(arguments),
            Some(script) => workplace.palpate_in(script, arguments),
        };
        let run = Running::start(command.env("PALPATE_HAPLY", service.place()))?;
        let held = Self { service, run };
        let pushes = wait_until(PATIENCE, || held.service.force()[0].abs() > PUSHES_N);
        require(pushes, || format!("no force came: {}", held.run.printed()))?;
        Ok(held)
    }

    /// Does harm, and waits until the force is off: the milliseconds that it took.
    fn off_after(&mut self, harm: impl FnOnce(&Running)) -> Result<f64, String> {
        let start = Instant::now();
        harm(&self.run);
        let is_off = wait_until(Duration::from_secs(5), || self.service.force() == [0.0; 3]);
        let took_ms = 1e3 * start.elapsed().as_secs_f64();
        require(is_off, || format!("after 5 s the force is {:?} N", self.service.force()))?;
        std::thread::sleep(Duration::from_millis(100));
        require(self.service.force() == [0.0; 3], || "the force has come back".into())?;
        Ok(took_ms)
    }
}

/// Times until the force is off after signals.
fn by_signals(workplace: &Workplace, signals: &[&str]) -> Verdict {
    let mut said = Vec::new();
    for signal in signals {
        let took_ms = Held::start(workplace, None)?.off_after(|run| run.signal(signal))?;
        said.push(format!("{signal} {took_ms:.0} ms"));
    }
    Ok(format!("force off after: {}", said.join(", ")))
}

fn signals(workplace: &Workplace) -> Verdict {
    by_signals(workplace, &["INT", "TERM", "HUP"])
}

fn ends(workplace: &Workplace) -> Verdict {
    // The handler of stack overflows takes the first of these for a fault of another kind.
    let twice = |run: &Running| (0..2).for_each(|_| run.signal("SEGV"));
    let took_ms = Held::start(workplace, None)?.off_after(twice)?;
    Ok(format!("{}, SEGV {took_ms:.0} ms", by_signals(workplace, &["KILL", "ABRT"])?))
}

fn hang(workplace: &Workplace) -> Verdict {
    by_signals(workplace, &["STOP"])
}

fn parent(workplace: &Workplace) -> Verdict {
    let mut held = Held::start(workplace, Some("\"$@\"; true"))?;
    let took_ms = held.off_after(|run| run.signal("KILL"))?;
    Ok(format!("force off after {took_ms:.0} ms"))
}

fn no_guardian(workplace: &Workplace) -> Verdict {
    let mut held = Held::start(workplace, None)?;
    let children = Command::new("pgrep").args(["-P", &held.run.id().to_string()]).output();
    let children = children.map_err(|error| format!("pgrep: {error}"))?;
    let text = String::from_utf8_lossy(&children.stdout).into_owned();
    let guardian =
        text.trim().parse::<u32>().map_err(|_| format!("one guardian expected, found {text:?}"))?;
    let took_ms = held.off_after(|_| send_signal(guardian, "KILL"))?;
    Ok(format!("force off after {took_ms:.0} ms, and it stays off"))
}

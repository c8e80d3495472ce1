//! Report of a run in real time, as text and as JSON.

use palpate_export::part_of;
use palpate_haptics::link::LinkCounts;
use palpate_haptics::log::LogSummary;
use palpate_haptics::{DeviceReport, Percentiles, Report, SafetyCounts, Timing};
use palpate_scene::Scene;
use serde_json::{Value, json};
use std::path::Path;

/// Percentiles as JSON [µs].
pub fn percentiles(of: Percentiles) -> Value {
    json!({ "p50": of.p50, "p99": of.p99, "p999": of.p999, "max": of.max })
}

/// Timing of a process as JSON.
pub fn timing(of: &Timing) -> Value {
    json!({
        "cycles": of.cycles(),
        "compute_us": percentiles(of.compute_us()),
        "lateness_us": percentiles(of.lateness_us()),
        "overruns": of.overruns,
        "own_overruns": of.own_overruns,
        "skipped": of.skipped,
    })
}

/// Counters of the safety as JSON.
pub fn safety(of: &SafetyCounts) -> Value {
    json!({
        "clamped": of.clamped,
        "slewed": of.slew_limited,
        "stale": of.stale,
        "gaps": of.gaps,
        "old_motions": of.old_motions,
        "slow_replies": of.slow_replies,
        "too_fast": of.overspeed,
        "out_of_range": of.out_of_range,
        "not_finite": of.not_finite,
        "trips": of.trips,
    })
}

/// Report as JSON.
pub(super) fn json(scene: &Scene, report: &Report, links: Option<LinkCounts>) -> Value {
    let devices = scene.devices.iter().zip(&report.devices).zip(&report.refused_motions);
    let devices = devices.map(|((device, own), refused)| {
        let Some(own) = own else {
            let first = refused.first.map(|first| first.to_string());
            return json!({
                "name": device.name, "kind": "link", "refused_motions": refused.count, "first_refused": first,
            });
        };
        let counts = own.counts;
        json!({
            "name": device.name,
            "kind": own.spec.kind,
            "force_max_n": counts.force_max_n,
            "given_j": counts.work_on_hand_j,
            "updates": counts.updates,
            "failed": counts.failed,
            "failure": own.failure.as_ref().map(ToString::to_string),
            "timing": timing(&own.timing),
            "answer_us": percentiles(own.motion_to_force.percentiles_us()),
            "passivity": { "acted": counts.passivity_active_updates, "missing_max_j": counts.passivity_max_deficit_j },
            "safety": safety(&counts.safety),
        })
    });
    let objects = scene.object_names.iter().zip(&report.state.output().objects);
    let objects = objects.zip(&report.largest_penetration_m).map(|((name, object), penetration)| {
        json!({
            "name": name,
            "position_m": object.pose.position.to_array(),
            "largest_penetration_m": penetration,
            "is_asleep": object.is_asleep,
        })
    });
    json!({
        "steps": report.steps,
        "step_s": scene.model.parameters().step_s,
        "wall_s": report.wall_s,
        "steal_time_s": report.steal_time_s,
        "granted": report.granted.to_string(),
        "force_process": timing(&report.force),
        "deformation_process": timing(&report.deformation),
        "unsolved_steps": report.unsolved_steps,
        "steps_out_of_budget": report.steps_out_of_budget,
        "max_contact_samples": scene.model.parameters().max_contact_samples,
        "devices": devices.collect::<Vec<_>>(),
        "objects": objects.collect::<Vec<_>>(),
        "links": links.map(|links| json!({
            "connected": links.connected,
            "refused": links.refused,
            "motions": links.motions,
            "old": links.old,
            "garbage": links.garbage,
        })),
        "warnings": super::warnings::json(scene, &scene.session_warnings(report)),
        "log": report.log.map(|log| json!({ "steps": log.steps, "missed": log.missed, "whole": !log.is_cut })),
    })
}

/// Report as text.
pub(super) fn text(scene: &Scene, report: &Report, links: Option<LinkCounts>, log: Option<&Path>) -> String {
    let step_s = scene.model.parameters().step_s;
    let line = |name: &str, of: Percentiles| {
        format!("  {name:<22} {:>9.1} {:>9.1} {:>9.1} {:>9.1}\n", of.p50, of.p99, of.p999, of.max)
    };
    let mut out = format!(
        "{} steps at {:.0} Hz in {:.3} s; force process: {}\n\n  {:<22} {:>9} {:>9} {:>9} {:>9}\n",
        report.steps,
        1.0 / step_s,
        report.wall_s,
        report.granted,
        "µs",
        "median",
        "99 %",
        "99.9 %",
        "most"
    );
    out += &line("force: compute", report.force.compute_us());
    out += &line("force: lateness", report.force.lateness_us());
    if report.deformation.cycles() > 0 {
        out += &line("deformation: compute", report.deformation.compute_us());
    }
    let here = || {
        scene.devices.iter().zip(&report.devices).filter_map(|(device, own)| Some((device, own.as_ref()?)))
    };
    for (device, own) in here() {
        out += &line(&format!("{}: motion to force", device.name), own.motion_to_force.percentiles_us());
    }
    out += "\n";
    out += &overruns(report, step_s);
    if let Some(steal_time_s) = report.steal_time_s.filter(|steal_time_s| *steal_time_s > 0.0) {
        let share = 100.0 * steal_time_s / report.wall_s;
        out += &format!(
            "  steal time   {steal_time_s:.2} s of its core ({share:.2} %): the hypervisor ran something else\n"
        );
    }
    for (device, own) in here() {
        out += &format!("  {:<12} {}\n", device.name, device_line(own));
    }
    if let Some(LinkCounts { connected, refused, motions, old, garbage }) = links {
        out += &format!(
            "  links        {connected} devices came, {refused} were refused; {motions} motions, {old} late or doubled, \
             {garbage} no motions\n"
        );
    }
    let parameters = scene.model.parameters();
    if !parameters.obstacles.is_empty() {
        out += &format!(
            "  contacts     at most {} contact samples of an object on an obstacle (max_contact_samples)\n",
            parameters.max_contact_samples
        );
    }
    if report.steps_out_of_budget > 0 {
        out += &format!(
            "  solver       left early in {} steps, with its budget used up (solver_budget = {})\n",
            report.steps_out_of_budget, parameters.solver_budget
        );
    }
    out += &super::warnings::text(&scene.session_warnings(report));
    if let (Some(summary), Some(path)) = (report.log, log) {
        out += &log_line(summary, path);
    }
    out
}

/// Log of the run, in a line.
fn log_line(LogSummary { steps, missed, is_cut }: LogSummary, path: &Path) -> String {
    let of = if is_cut { part_of(path) } else { path.to_path_buf() };
    let lost = match (is_cut, missed) {
        (true, missed) => format!(", {missed} MISSING: it could not be written further"),
        (false, 0) => String::new(),
        (false, missed) => {
            format!(", {missed} MISSED: the disk was too slow, a replay ends where they begin")
        }
    };
    format!("  log          {steps} steps in {}{lost}\n", of.display())
}

/// Forces, passivity and safety of a device, in a line.
pub fn device_line(own: &DeviceReport) -> String {
    let (counts, safety) = (own.counts, own.counts.safety);
    let mut out = format!("{}, {:.4} N at most", own.spec.kind, counts.force_max_n);
    if own.spec.force_n.is_infinite() {
        return out;
    }
    out += &format!(
        "; gave the hand {:+.3e} J; passivity acted in {} of {} updates",
        counts.work_on_hand_j, counts.passivity_active_updates, counts.updates
    );
    let faults = [
        (safety.clamped, "clamped"),
        (safety.slew_limited, "slewed"),
        (safety.stale, "stale"),
        (safety.gaps, "gaps between updates"),
        (safety.old_motions, "old motions"),
        (safety.slow_replies, "slow replies"),
        (safety.overspeed, "too fast"),
        (safety.out_of_range, "out of range"),
        (safety.not_finite, "no number"),
        (safety.trips, "trips"),
        (counts.failed, "failed"),
    ];
    let met = faults.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}"));
    let met: Vec<String> = met.collect();
    out += &if met.is_empty() {
        "; safety met nothing".to_string()
    } else {
        format!("; safety: {}", met.join(", "))
    };
    match &own.failure {
        Some(failure) => out + &format!("; the first that failed: {failure}"),
        None => out,
    }
}

/// Overruns of the force process, in a line.
fn overruns(report: &Report, step_s: f64) -> String {
    let Timing { overruns, own_overruns, skipped, .. } = report.force;
    if overruns == 0 {
        return "  overruns     none: every cycle was done before the next was due\n".to_string();
    }
    format!(
        "  overruns     {overruns} of {} cycles: {own_overruns} took longer than {:.3} ms by themselves, {} woke up late; \
         {skipped} ticks were passed over to be on the grid again\n",
        report.force.cycles(),
        1e3 * step_s,
        overruns - own_overruns
    )
}

//! What a person is told of a run.

use std::path::Path;

use endowire_core::insertion::{Simulation, StepReport};
use endowire_sweep::StepFailure;

use super::going::Ended;
use crate::args::RunArgs;
use crate::failure::Failure;
use crate::output::recorder::Summary;
use crate::output::{print_json, tell};

/// Tells what a run has come to, and fails as it has failed.
pub(super) fn tell_end(args: &RunArgs, folder: &Path, ended: Ended) -> Result<(), Failure> {
    let Ended { summary, simulation, written } = ended;
    for line in summary.outcome.until.iter().filter(|line| line.met.is_none()) {
        let what = "its condition (until) was not met on all of its way";
        tell(format_args!("{}: {}: {what}, {} steps", args.scene.display(), line.line, line.steps));
    }
    if args.json {
        print_json(&summary)?;
    } else if !args.quiet {
        tell(text(&summary, folder, &simulation));
    }
    match &summary.outcome.failure {
        Some(StepFailure { step, reason }) => {
            let kept = match written {
                Ok(()) => format!("{} steps are kept in {}", summary.outcome.steps, folder.display()),
                Err(error) => error.to_string(),
            };
            Err(Failure::Computation(format!("{}: step {step}: {reason} ({kept})", args.scene.display())))
        }
        None => written,
    }
}

/// What a person wants to see while it goes on.
pub(super) fn live(report: &StepReport, jumps: usize) -> String {
    let mut line = format!("{:.1} mm in, push {:.3} N", report.inserted_mm, report.push_force_n);
    if jumps > 0 {
        line += &format!(", {jumps} jumped");
    }
    if report.left_through.is_some() {
        line += ", tip outside";
    }
    line
}

/// The summary for a person, for stderr: stdout is for documents.
fn text(summary: &Summary, folder: &Path, simulation: &Simulation) -> String {
    let outcome = &summary.outcome;
    let tip = outcome.tip_mm.unwrap_or_default();
    let mut lines = vec![
        format!(
            "{}: {} of {} steps by {} in {:.2} s ({:.2} s simulating)",
            summary.scene,
            outcome.steps,
            outcome.steps_asked,
            summary.method,
            summary.wall_time_s,
            summary.step_time_s
        ),
        format!("  inserted       {:.2} mm", outcome.inserted_mm),
        format!("  tip            [{:.2}, {:.2}, {:.2}] mm", tip[0], tip[1], tip[2]),
        format!("  push force     {:.4} N, torque {:.4} N·mm", outcome.push_force_n, outcome.torque_nmm),
    ];
    lines.extend(outcome.instruments.iter().map(|one| {
        let push = one.report.push_force_n.map_or_else(|| "jumps".to_owned(), |n| format!("{n:.4} N"));
        let (mm, torque) = (one.report.inserted_mm, one.report.torque_nmm);
        format!("    {:<12} {mm:.2} mm, push {push}, torque {torque:.4} N·mm", one.name)
    }));
    let contacts = simulation.report().contacts.len();
    lines.push(format!(
        "  wall           {contacts} contacts, deepest penetration {:.3} mm",
        outcome.max_penetration_mm
    ));
    if let Some(opening) = outcome.left_through {
        lines.push(format!("  left           the tip is out of opening {opening}"));
    }
    let renderer = summary.renderer.as_ref().map_or(String::new(), |r| format!(" by {r}"));
    lines.push(format!("  recorded       {} frames{renderer} in {}", summary.frames.len(), folder.display()));
    lines.join("\n")
}

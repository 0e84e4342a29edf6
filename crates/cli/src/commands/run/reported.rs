//! Messages about a run.

use std::path::Path;

use endowire_core::insertion::{Met, Simulation, StepReport, Tally};
use endowire_recording::{EndedBy, RunOutcome, StepFailure};

use super::going::{Ended, Summary};
use crate::args::RunArgs;
use crate::failure::Failure;
use crate::output::{print_json, tell};
use crate::scenes::check_converged;

/// Prints the result of a run, and fails if the run has failed.
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
        Some(StepFailure { step, reason, .. }) => {
            let kept = match written {
                Ok(()) => format!("{} steps are kept in {}", summary.outcome.steps, folder.display()),
                Err(error) => error.to_string(),
            };
            Err(Failure::Computation(format!("{}: step {step}: {reason} ({kept})", args.scene.display())))
        }
        None => written.and_then(|()| {
            let (outcome, kept) = (&summary.outcome, format!("all are kept in {}", folder.display()));
            let allowed = args.convergence.allow_unconverged;
            check_converged(args.scene.display(), &outcome.tally, outcome.steps, allowed, kept)
        }),
    }
}

/// Text of the progress bar.
pub(super) fn live(report: &StepReport, tally: &Tally) -> String {
    let mut line = format!("{:.1} mm in, push {:.3} N", report.inserted_mm, report.push_force_n);
    if tally.jumps > 0 {
        line += &format!(", {} jumped", tally.jumps);
    }
    if tally.unconverged_steps > 0 {
        line += &format!(", {} without an equilibrium", tally.unconverged_steps);
    }
    if report.left_through.is_some() {
        line += ", tip outside";
    }
    line
}

/// How a run ended, unless it simply reached the end of its script.
fn ended(outcome: &RunOutcome) -> Option<String> {
    let ended_by = outcome.ended_by.filter(|ended_by| *ended_by != EndedBy::Script)?;
    let last = outcome.until.last().filter(|_| outcome.failure.is_none());
    Some(match last.and_then(|line| Some((line, line.met?))) {
        Some((line, met)) => {
            let what = match met {
                Met::TipWithinMm => "the tip is at its target (tip_within_mm)",
                Met::PushForceN => "the hand pushes as hard as was said (push_force_n)",
            };
            format!("{}: {}: {what}, after {} steps of the line", ended_by.name(), line.line, line.steps)
        }
        None => match &outcome.failure {
            Some(failure) => format!("{}, in step {}", ended_by.name(), failure.step),
            None => ended_by.name().to_owned(),
        },
    })
}

/// The summary as text, for stderr: stdout is for documents.
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
    let several = if outcome.instruments.len() > 1 { &outcome.instruments[..] } else { &[] };
    lines.extend(several.iter().map(|one| {
        let push = one.report.push_force_n.map_or_else(|| "jumps".to_owned(), |n| format!("{n:.4} N"));
        let (mm, torque) = (one.report.inserted_mm, one.report.torque_nmm);
        format!("    {:<12} {mm:.2} mm, push {push}, torque {torque:.4} N·mm", one.name)
    }));
    let contacts = simulation.report().contacts.len();
    lines.push(format!(
        "  wall           {contacts} contacts, {:.4} N in all, {:.4} N at most in one, {:.4} N at the tip; deepest penetration {:.3} mm",
        outcome.wall_force.sum_n,
        outcome.wall_force.largest_n,
        outcome.wall_force.tip_n,
        outcome.tally.max_penetration_mm
    ));
    let remarks = outcome.tally.remarks(outcome.steps);
    lines.push(format!(
        "  steps          {}",
        remarks.unwrap_or_else(|| "all in equilibrium, no jump".to_owned())
    ));
    lines.extend(summary.packing.map(|packed| format!("  sac            {}", packed.text())));
    if let Some(opening) = outcome.left_through {
        lines.push(format!("  left           the tip is out of opening {opening}"));
    }
    lines.extend(ended(outcome).map(|how| format!("  ended          {how}")));
    let renderer = summary.renderer.as_ref().map_or(String::new(), |r| format!(" by {r}"));
    lines.push(format!("  recorded       {} frames{renderer} in {}", summary.frames.len(), folder.display()));
    if let Some(frame) = summary.frames.last() {
        let shown = summary.film.as_ref().unwrap_or(frame);
        lines.push(format!("  look at        {}", folder.join(shown).display()));
    }
    lines.join("\n")
}

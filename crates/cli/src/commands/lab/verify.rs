//! `endowire verify`: reference cases and the stress table.

use std::time::Instant;

use endowire_core::Result;
use endowire_lab::deployments::{self, DEPLOYMENTS, DeploymentRow};
use endowire_lab::insertion_stress::{InsertionRow, InsertionStress};
use endowire_lab::instrument_stress::{self, InstrumentRow, InstrumentStress};
use endowire_lab::sequences::{self, SEQUENCES, SequenceRow};
use endowire_lab::{FAMILIES, Row, stress};
use serde::Serialize;

use crate::args::VerifyArgs;
use crate::commands::lab::parallel::in_parallel;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    cases: Vec<Row>,
    passed: usize,
    failed: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    stress: Option<Vec<Stress>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    insertion_stress: Option<Vec<InsertionRow>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    instrument_stress: Option<Vec<Instruments>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sequences: Option<Vec<SequenceRow>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    deployments: Option<Vec<DeploymentRow>>,
}

/// Results of random commands on several instruments, and their run time.
#[derive(Serialize)]
struct Instruments {
    #[serde(flatten)]
    row: InstrumentRow,
    time_s: f64,
}

/// A stress case and its run time.
#[derive(Serialize)]
struct Stress {
    #[serde(flatten)]
    row: stress::StressRow,
    time_s: f64,
}

/// Runs every reference case and prints the table.
pub(crate) fn verify(args: &VerifyArgs) -> std::result::Result<(), Failure> {
    if let Some(folder) = &args.surfaces {
        return super::surfaces::surfaces(args, folder);
    }
    let stressed = if args.stress { stress::cases() } else { Vec::new() };
    let insertion = args.stress.then(InsertionStress::new).transpose()?;
    let combinations = insertion.as_ref().map_or_else(Vec::new, InsertionStress::cases);
    let together = if args.stress { instrument_stress::cases() } else { Vec::new() };
    let seeds = if args.stress { 0..SEQUENCES } else { 0..0 };
    let deployed = if args.stress { DEPLOYMENTS } else { 0 };
    let count = FAMILIES.len() + stressed.len() + combinations.len() + together.len();
    let count = count + (seeds.end + deployed) as usize;
    let bar = progress::bar(count, "case");
    let mut cases = Vec::new();
    for family in FAMILIES {
        bar.set_message(family.id);
        cases.extend(family.run());
        bar.inc(1);
    }
    let mut rows = Vec::with_capacity(stressed.len());
    for case in &stressed {
        bar.set_message(case.name.clone());
        let clock = Instant::now();
        let row = case.run();
        rows.push(Stress { row, time_s: clock.elapsed().as_secs_f64() });
        bar.inc(1);
    }
    let insertions = insertion.map(|stress| {
        bar.set_message("insertions");
        let run = |case| {
            let row = stress.run(case);
            bar.inc(1);
            row
        };
        combinations.iter().map(run).collect::<Vec<InsertionRow>>()
    });
    let mut instruments = Vec::with_capacity(together.len());
    for case in &together {
        bar.set_message(format!("instruments in {}", case.vessel));
        let clock = Instant::now();
        let row = InstrumentStress::run(case, args.commands as usize);
        instruments.push(Instruments { row, time_s: clock.elapsed().as_secs_f64() });
        bar.inc(1);
    }
    bar.set_message("random commands");
    let random = in_parallel(seeds.end as usize, None, |seed| {
        let row = sequences::run(seed as u64);
        bar.inc(1);
        row
    });
    let random: Vec<SequenceRow> = random.into_iter().collect::<Result<_>>()?;
    bar.set_message("random deployments");
    let deployments = in_parallel(deployed as usize, None, |seed| {
        let row = deployments::run(seed as u64);
        bar.inc(1);
        row
    });
    let deployments: Vec<DeploymentRow> = deployments.into_iter().collect::<Result<_>>()?;
    bar.finish_and_clear();

    let passed = cases.iter().filter(|row| row.pass).count();
    let document = Document {
        provenance: Provenance::of_program("verify"),
        passed,
        failed: cases.len() - passed,
        cases,
        stress: args.stress.then_some(rows),
        insertion_stress: insertions,
        instrument_stress: args.stress.then_some(instruments),
        sequences: args.stress.then_some(random),
        deployments: args.stress.then_some(deployments),
    };
    answer(&document, args.json, || table(&document).join("\n"))?;
    let unexplained = document.stress.iter().flatten().filter(|s| !s.row.pass).count()
        + document.insertion_stress.iter().flatten().filter(|row| !row.pass).count()
        + document.instrument_stress.iter().flatten().filter(|one| !one.row.pass).count()
        + document.sequences.iter().flatten().filter(|row| !row.pass).count()
        + document.deployments.iter().flatten().filter(|row| !row.pass).count();
    if document.failed > 0 || unexplained > 0 {
        return Err(Failure::Computation(format!(
            "{} of {} reference rows and {unexplained} stressed cases fail",
            document.failed,
            document.cases.len()
        )));
    }
    Ok(())
}

/// The lines of the table.
fn table(document: &Document) -> Vec<String> {
    let mut lines = Vec::new();
    lines.push(format!(
        "{:<6}{:<30} {:<31} {:>15} {:>15} {:>8} {:>8} {:>5} {:>5}",
        "", "case", "quantity", "computed", "expected", "error", "bound", "order", "iter."
    ));
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    for row in &document.cases {
        lines.push(format!(
            "{:<6}{:<30} {:<31} {:>15.10} {:>15.10} {:>8.1e} {:>8.1e} {:>5} {:>5}",
            if row.pass { "pass" } else { "FAIL" },
            row.name,
            row.quantity,
            row.computed,
            row.expected,
            row.error,
            row.bound,
            or_dash(row.order.map(|order| format!("{order:.2}"))),
            or_dash(row.iterations.map(|iterations| iterations.to_string())),
        ));
    }
    lines.push(format!("{} passed, {} failed", document.passed, document.failed));
    if let Some(rows) = &document.stress {
        tell_stress(rows, &mut lines);
    }
    if let Some(rows) = &document.insertion_stress {
        tell_insertions(rows, &mut lines);
    }
    if let Some(rows) = &document.instrument_stress {
        tell_instruments(rows, &mut lines);
    }
    if let Some(rows) = &document.sequences {
        lines.push(String::new());
        lines.push(SequenceRow::HEAD.to_owned());
        lines.extend(rows.iter().map(ToString::to_string));
    }
    if let Some(rows) = &document.deployments {
        lines.push(String::new());
        lines.push(DeploymentRow::HEAD.to_owned());
        lines.extend(rows.iter().map(ToString::to_string));
    }
    lines
}

/// Tells the results of random commands on several instruments.
fn tell_instruments(rows: &[Instruments], lines: &mut Vec<String>) {
    lines.push(String::new());
    lines.push(format!(
        "{:<16} {:>8} {:>10} {:>10} {:>8} {:>8} {:>11} {:>7} {:>11} {:>7} {:>6} {:>6} {:>7}  first",
        "three in",
        "edge mm",
        "element mm",
        "friction",
        "commands",
        "refused",
        "unconverged",
        "crossed",
        "unexplained",
        "changed",
        "iter.",
        "parts",
        "time s"
    ));
    for Instruments { row, time_s } in rows {
        lines.push(format!(
            "{:<16} {:>8} {:>10} {:>10} {:>8} {:>8} {:>11} {:>7} {:>11} {:>7} {:>6} {:>6} {:>7.1}  {}",
            row.case.vessel,
            row.case.edge_mm,
            row.case.element_mm,
            format!("{:?}", row.case.friction).to_lowercase(),
            row.commands,
            row.refused,
            row.unconverged,
            row.crossed,
            row.unexplained,
            row.changed,
            row.most_iterations,
            row.most_substeps,
            time_s,
            row.first
        ));
    }
}

/// Tells the combinations that stopped, and counts of all.
fn tell_insertions(rows: &[InsertionRow], lines: &mut Vec<String>) {
    lines.push(String::new());
    lines.push(format!(
        "{:>10} {:>10} {:>10} {:>10} {:>9} {:>6} {:>6} {:>6}  insertion that stopped",
        "wall N/mm²", "EI N·mm²", "element mm", "step mm", "friction", "steps", "iter.", "parts"
    ));
    let mut outcomes: Vec<(&str, usize)> = Vec::new();
    for row in rows {
        let case = &row.case;
        if !row.converged {
            lines.push(format!(
                "{:>10.0e} {:>10.0e} {:>10} {:>10} {:>9} {:>6} {:>6} {:>6}  {}{}",
                case.modulus_n_per_mm2,
                case.bending_stiffness_nmm2,
                case.element_mm,
                case.increment_mm,
                case.friction,
                row.steps,
                row.most_iterations,
                row.most_substeps,
                row.outcome,
                if row.pass { "" } else { ", and cannot be pulled back" }
            ));
        }
        match outcomes.iter_mut().find(|(known, _)| *known == row.outcome) {
            Some((_, count)) => *count += 1,
            None => outcomes.push((&row.outcome, 1)),
        }
    }
    let counts: Vec<String> = outcomes.iter().map(|(outcome, count)| format!("{count} {outcome}")).collect();
    lines.push(format!("{} insertions: {}", rows.len(), counts.join(", ")));
}

fn tell_stress(rows: &[Stress], lines: &mut Vec<String>) {
    lines.push(String::new());
    lines.push(format!(
        "{:<54} {:<28} {:>8} {:>9} {:>5} {:>9}",
        "stressed", "outcome", "residual", "next bend", "iter.", "time ms"
    ));
    let mut outcomes: Vec<(String, usize)> = Vec::new();
    for Stress { row, time_s } in rows {
        let outcome = row.outcome();
        lines.push(format!(
            "{:<54} {:<28} {:>8.1e} {:>9.1e} {:>5} {:>9.2}",
            row.name,
            outcome,
            row.residual,
            row.next_bend,
            row.iterations,
            1e3 * time_s
        ));
        match outcomes.iter_mut().find(|(known, _)| *known == outcome) {
            Some((_, count)) => *count += 1,
            None => outcomes.push((outcome, 1)),
        }
    }
    let counts: Vec<String> = outcomes.iter().map(|(outcome, count)| format!("{count} {outcome}")).collect();
    lines.push(format!("{} stressed cases: {}", rows.len(), counts.join(", ")));
}

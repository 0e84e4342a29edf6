//! `endowire evidence`: studies that compare the model with what is known outside of it.

use std::path::Path;

use endowire_core::Vec3;
use endowire_lab::Row;
use endowire_lab::evidence::three_tubes::{self, ThreeTubes};
use endowire_lab::evidence::{
    Compared, Kind, STUDIES, Study, bending, capstan, coil_forces, reversal, straightening, tube_buckling,
    whip,
};
use endowire_methods::Setting;
use serde::Serialize;

use crate::args::EvidenceArgs;
use crate::commands::device::table::{columns, digits};
use crate::commands::lab::devices;
use crate::commands::lab::parallel::in_parallel;
use crate::failure::Failure;
use crate::output::curves::{Curve, Curves, Entry, Panel, Scale, Stroke, colour};
use crate::output::provenance::{Provenance, read_input};
use crate::output::study::{self, Page, Table};
use crate::output::{answer, chart, progress, tell};
use crate::scenes;

/// Folder of the scenes that studies use.
const SCENES: &str = "assets/scenes";
/// Points of a curve of distances.
const SHARES: usize = 200;

/// The document of a study.
#[derive(Serialize)]
struct Document<'a, R: Serialize> {
    #[serde(flatten)]
    provenance: &'a Provenance,
    study: &'static str,
    question: &'static str,
    data: &'static str,
    computed: &'static str,
    not_shown: &'static str,
    #[serde(flatten)]
    results: R,
}

/// Results of studies that need no data of the user.
#[derive(Serialize)]
struct Rows<'a> {
    rows: &'a [Row],
    passed: usize,
    failed: usize,
}

/// Lists the studies, or carries one out.
pub(crate) fn evidence(args: &EvidenceArgs) -> Result<(), Failure> {
    let Some(name) = &args.study else {
        let lines = STUDIES.iter().map(|study| format!("{:<12} {}", study.name, study.question));
        return crate::output::print(lines.collect::<Vec<_>>().join("\n"));
    };
    let unknown = || Failure::Input(format!("{name}: is no study; those there are: {}", names()));
    let study = STUDIES.iter().find(|study| study.name == *name).ok_or_else(unknown)?;
    if study.name == three_tubes::STUDY.name {
        return tubes(args, study);
    }
    if args.play || args.friction {
        let option = if args.play { "--play" } else { "--friction" };
        return Err(Failure::Input(format!(
            "{option}: {name} has no instruments with play or a path: leave it out"
        )));
    }
    if let Some(file) = &args.file {
        return Err(Failure::Input(format!("{}: {name} takes no file: leave it out", file.display())));
    }
    let (compared, provenance) = match study.name {
        "coil-forces" => (deployed()?, Provenance::of_program("evidence coil-forces")),
        "straightening" => straightened()?,
        "reversal" => (reversal::study()?, Provenance::of_program("evidence reversal")),
        "whip" => (whip::study()?, Provenance::of_program("evidence whip")),
        "capstan" => (capstan::study()?, Provenance::of_program("evidence capstan")),
        "tube-buckling" => (tube_buckling::study()?, Provenance::of_program("evidence tube-buckling")),
        _ => bent()?,
    };
    compare(args, study, &compared, &provenance)
}

/// Names of all studies.
fn names() -> String {
    STUDIES.map(|study| study.name).join(", ")
}

/// Coils, deployed side by side.
fn deployed() -> Result<Compared, Failure> {
    let sign = progress::waiting("coils are deployed");
    let compared = coil_forces::study(&|count, of| in_parallel(count, None, of));
    sign.finish_and_clear();
    Ok(compared?)
}

/// The wires of the catalogue, bent.
fn bent() -> Result<(Compared, Provenance), Failure> {
    let named = devices::read_all(&bending::WIRES.map(|(name, _)| name.into()))?;
    let inputs: Vec<&[u8]> = named.iter().map(|one| one.input.as_slice()).collect();
    let provenance = Provenance::new(&inputs, 0);
    let wires: Vec<_> = named.iter().map(|one| (one.file.name.clone(), one.file.device.clone())).collect();
    Ok((bending::study(&wires)?, provenance))
}

/// The wires of the catalogue in an artery that yields.
fn straightened() -> Result<(Compared, Provenance), Failure> {
    let path = scenes::named(straightening::SCENE.as_ref(), SCENES, "scene")?;
    let file = |wire: &str| format!("device.file=\"../devices/{wire}.toml\"");
    let read = |wire: &str| {
        let set = straightening::SET.map(str::to_owned).into_iter().chain([file(wire)]);
        let set = set.map(|set| set.parse()).collect::<Result<Vec<Setting>, endowire_core::Error>>()?;
        Ok((wire.to_owned(), scenes::read(&path, &set)?))
    };
    let wires = straightening::WIRES.iter().map(|wire| read(wire)).collect::<Result<Vec<_>, Failure>>()?;
    let sign = progress::waiting("wires are pushed up");
    let compared = straightening::study(&wires);
    sign.finish_and_clear();
    Ok((compared?, Provenance::new(&[&read_input(&path)?], 0)))
}

/// Shows a study that compares numbers.
fn compare(
    args: &EvidenceArgs,
    study: &Study,
    compared: &Compared,
    provenance: &Provenance,
) -> Result<(), Failure> {
    let failed = compared.rows.iter().filter(|row| !row.pass).count();
    let rows = Rows { rows: &compared.rows, passed: compared.rows.len() - failed, failed };
    let cells = compared.rows.iter().map(|row| {
        let verdict = if row.pass { "within" } else { "NOT within" };
        vec![
            row.name.clone(),
            row.quantity.clone(),
            digits(row.computed, 5),
            digits(row.expected, 5),
            format!("{:.2} %", 100.0 * row.error),
            format!("{verdict} {:.1} %", 100.0 * row.bound),
        ]
    });
    let table = Table {
        columns: vec!["case", "quantity", "computed", "reference", "error", "bound"],
        rows: cells.collect(),
    };
    let stroke = |kind: Kind| match kind {
        Kind::Computed => Stroke::Solid,
        Kind::Law => Stroke::Dashed,
        Kind::Values => Stroke::Dots,
    };
    let lines = || compared.lines.iter().enumerate();
    let [across, up] = compared.axes.map(str::to_owned);
    let curves = Curves {
        title: study.title.to_owned(),
        panels: vec![Panel {
            title: String::new(),
            across,
            up,
            scale: if compared.is_logarithmic { Scale::Logarithmic } else { Scale::Linear },
            curves: lines()
                .map(|(k, line)| Curve {
                    colour: colour(k),
                    stroke: stroke(line.kind),
                    points: line.points.clone(),
                })
                .collect(),
            bands: vec![],
        }],
        legend: lines()
            .map(|(k, line)| Entry { name: line.name.clone(), colour: colour(k), stroke: stroke(line.kind) })
            .collect(),
        notes: vec![],
    };
    show(args, study, provenance, (rows, &table, &curves))?;
    match failed {
        0 => Ok(()),
        _ => Err(Failure::Computation(format!("{}: {failed} numbers are beyond their bounds", study.name))),
    }
}

/// Fits the three tubes to measurements.
fn tubes(args: &EvidenceArgs, study: &Study) -> Result<(), Failure> {
    let file = args.file.as_deref().ok_or_else(|| {
        Failure::Input(format!("{}: give the file of the measurements as well. {}", study.name, study.data))
    })?;
    let input = read_input(file)?;
    let rows = three_tubes::read(&String::from_utf8_lossy(&input), file)?;
    let bar = progress::bar(three_tubes::MOST_STEPS, "fit");
    let parallel = |count: usize, of: &(dyn Fn(usize) -> Option<Vec3> + Sync)| in_parallel(count, None, of);
    let also = three_tubes::Also { play: args.play, friction: args.friction };
    let found = three_tubes::study(&rows, also, &parallel, &|done| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    let (table, curves) = distances(&found, file);
    show(args, study, &Provenance::new(&[&input], 0), (&found, &table, &curves))
}

fn distances(found: &ThreeTubes, file: &Path) -> (Table, Curves) {
    let row = |name: &str, misfit: &three_tubes::Misfit| {
        vec![
            name.to_owned(),
            misfit.rows.to_string(),
            misfit.unsolved.to_string(),
            format!("{:.2}", misfit.mean_mm),
            format!("{:.2}", misfit.mean_percent_of_length),
            format!("{:.2}", misfit.p95_mm),
        ]
    };
    let fitted = format!("fitted to {} rows, judged on others", found.fitted.rows_fitted);
    let table = Table {
        columns: vec!["numbers", "rows", "unsolved", "mean mm", "mean % of length", "95 % within mm"],
        rows: [row("as published", &found.nominal), row(&fitted, &found.fitted.misfit)]
            .into_iter()
            .chain(found.with_play.iter().map(|fitted| row("fitted with play", &fitted.misfit)))
            .chain(
                found.with_friction.iter().map(|fitted| row("fitted with play and friction", &fitted.misfit)),
            )
            .chain(found.driven.iter().map(|driven| {
                row(&format!("driven with play and friction {}", driven.friction), &driven.misfit)
            }))
            .collect(),
    };
    let names = ["as published", "fitted"];
    let share = |all: &Vec<f64>| -> Vec<[f64; 2]> {
        let at = |k: usize| (k * all.len().saturating_sub(1)) / SHARES;
        let part = |k: usize| 100.0 * (at(k) + 1) as f64 / all.len().max(1) as f64;
        let rest = (0..=SHARES).filter_map(|k| Some([*all.get(at(k))?, part(k)]));
        std::iter::once([0.0, 0.0]).chain(rest).collect()
    };
    let curves = Curves {
        title: "Measured and computed tips of three nested tubes".to_owned(),
        panels: vec![Panel {
            title: String::new(),
            across: "distance of the computed from the measured tip, mm".to_owned(),
            up: "rows within that distance, %".to_owned(),
            scale: Scale::Linear,
            curves: found
                .distances_mm
                .iter()
                .enumerate()
                .map(|(k, all)| Curve { colour: colour(k), stroke: Stroke::Solid, points: share(all) })
                .collect(),
            bands: vec![],
        }],
        legend: names
            .iter()
            .enumerate()
            .map(|(k, name)| Entry { name: (*name).to_owned(), colour: colour(k), stroke: Stroke::Solid })
            .collect(),
        notes: vec![format!(
            "the {} rows of {} that were not used for fitting",
            found.fitted.rows_tested,
            file.file_name().unwrap_or_default().to_string_lossy()
        )],
    };
    (table, curves)
}

/// Prints and writes a study.
fn show(
    args: &EvidenceArgs,
    study: &Study,
    provenance: &Provenance,
    (results, table, curves): (impl Serialize, &Table, &Curves),
) -> Result<(), Failure> {
    let Study { name, title, question, data, computed, not_shown } = *study;
    let about = [
        format!("Question: {question}"),
        format!("Data: {data}"),
        format!("Computed: {computed}"),
        format!("What it does not show: {not_shown}"),
    ];
    if let Some(out) = &args.out {
        chart::write_file(out, curves.size(), curves)?;
        tell(format_args!("wrote {}", out.display()));
    }
    if let Some(page) = &args.page {
        study::write(page, Page { title, about: &about, curves, table, source: provenance.words() })?;
        tell(format_args!("wrote {}", page.display()));
    }
    let document = Document { provenance, study: name, question, data, computed, not_shown, results };
    answer(&document, args.json, || {
        let table = columns(&table.columns, table.rows.iter().cloned());
        format!("{title}\n{}\n\n{table}", about.join("\n"))
    })
}

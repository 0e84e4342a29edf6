//! `endowire verify --surfaces DIR`: a matrix of insertions into arbitrary surfaces.

use std::fmt::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Instant;

use endowire_core::vessel::PatientAxes;
use endowire_lab::surfaces::{
    Cell, CellRow, Ending, Summary, Surface, SurfaceFile, cells, matches, run, surfaces_in,
};
use serde::Serialize;

use crate::args::VerifyArgs;
use crate::cache::Cache;
use crate::commands::lab::check_limit_s;
use crate::commands::lab::parallel::in_parallel;
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::{answer, print, progress};

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    surfaces: Vec<SurfaceRow>,
    cells: Vec<CellRow>,
    summary: Summary,
}

/// A surface and the starts of its wires.
#[derive(Serialize)]
struct SurfaceRow {
    name: String,
    unit_mm: f64,
    /// As in the sidecar; absent if it does not say.
    #[serde(skip_serializing_if = "Option::is_none")]
    axes: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<String>,
    triangles: usize,
    openings: usize,
    size_mm: f64,
    length_mm: f64,
    repaired: Vec<String>,
    starts: Vec<Start>,
    skipped: Vec<String>,
}

/// Start of a wire.
#[derive(Serialize)]
struct Start {
    wire: String,
    found: String,
    position_mm: [f64; 3],
    direction: [f64; 3],
}

/// Runs the matrix, or prints the scenes of its cells.
pub(crate) fn surfaces(args: &VerifyArgs, folder: &Path) -> Result<(), Failure> {
    check_limit_s(args.limit_s)?;
    let files = surfaces_in(folder)?;
    let none = |pattern: &str| {
        let remedy = "no cell has all of these words; --full has more cells";
        Failure::Input(format!("--cells {pattern}: {remedy}"))
    };
    // Reading the surfaces takes minutes.
    if let Some(pattern) = args.cells.as_deref()
        && !files.iter().any(|file| file.may_match(pattern, args.full))
    {
        return Err(none(pattern));
    }
    let mut inputs = Vec::new();
    for file in &files {
        inputs.push(read_input(&file.path)?);
    }
    let cache = Cache::new(&args.cache);
    let bar = progress::bar(files.len(), "surface");
    let read: Vec<(&SurfaceFile, Result<Surface, String>)> = files
        .iter()
        .map(|file| {
            bar.set_message(file.name.clone());
            let surface = Surface::read(file, &cache).map_err(|e| e.to_string());
            bar.inc(1);
            (file, surface)
        })
        .collect();
    bar.finish_and_clear();
    let mut jobs: Vec<(&Surface, Cell)> = Vec::new();
    for surface in read.iter().filter_map(|(_, surface)| surface.as_ref().ok()) {
        let all = cells(surface.places.len(), args.full);
        jobs.extend(all.into_iter().map(|cell| (surface, cell)));
    }
    if let Some(pattern) = &args.cells {
        jobs.retain(|(surface, cell)| matches(&cell.name_in(surface), pattern));
        if jobs.is_empty() {
            return Err(none(pattern));
        }
    }
    if args.scene {
        for (surface, cell) in &jobs {
            print(cell.scene(surface)?)?;
        }
        return Ok(());
    }
    let rows = run_all(&jobs, args, &cache);
    let document = Document {
        provenance: Provenance::new(&inputs, 0),
        surfaces: read.iter().map(|(file, surface)| surface_row(file, surface)).collect(),
        summary: Summary::of(&rows),
        cells: rows,
    };
    answer(&document, args.json, || text(&document))?;
    verdict(&document)
}

fn verdict(document: &Document) -> Result<(), Failure> {
    let summary = &document.summary;
    if summary.failed > 0 {
        return Err(Failure::Computation(format!("{} of {} cells fail", summary.failed, summary.cells)));
    }
    let unread = document.surfaces.iter().filter(|s| s.refused.is_some()).count();
    if summary.refused + unread > 0 {
        return Err(Failure::Input(format!(
            "{} of {} cells and {unread} surfaces are refused",
            summary.refused, summary.cells
        )));
    }
    Ok(())
}

/// Runs the cells on several threads; rows are in the order of the cells.
fn run_all(jobs: &[(&Surface, Cell)], args: &VerifyArgs, cache: &Cache) -> Vec<CellRow> {
    let bar = progress::bar(jobs.len(), "cell");
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let rows = in_parallel(jobs.len(), args.jobs.map(usize::from), |index| {
        let (surface, cell) = &jobs[index];
        bar.set_message(cell.name_in(surface));
        // A panic in one cell must not end the others.
        let row = catch_unwind(AssertUnwindSafe(|| run(surface, cell, cache, args.limit_s, &clock)));
        bar.inc(1);
        row.unwrap_or_else(|_| {
            let mut row = CellRow::new(surface, cell);
            row.end(Ending::Failed, "panicked".to_owned());
            row
        })
    });
    bar.finish_and_clear();
    rows
}

fn surface_row(file: &SurfaceFile, surface: &Result<Surface, String>) -> SurfaceRow {
    let mut row = SurfaceRow {
        name: file.name.clone(),
        unit_mm: file.frame.unit_mm,
        axes: file.frame.axes.map(PatientAxes::name),
        refused: surface.as_ref().err().cloned(),
        triangles: 0,
        openings: 0,
        size_mm: 0.0,
        length_mm: 0.0,
        repaired: Vec::new(),
        starts: Vec::new(),
        skipped: Vec::new(),
    };
    if let Ok(surface) = surface {
        let wall = &surface.wall;
        row.triangles = wall.report().triangles_given;
        row.openings = wall.openings().len();
        (row.size_mm, row.length_mm) = (surface.size_mm, surface.length_mm);
        row.repaired = wall.report().notes();
        row.skipped.clone_from(&surface.skipped);
        row.starts = surface
            .places
            .iter()
            .map(|place| Start {
                wire: place.wire.name(),
                found: place.found.to_string(),
                position_mm: place.sheath.position_mm.into(),
                direction: place.sheath.direction.into(),
            })
            .collect();
    }
    row
}

/// The table as text.
fn text(document: &Document) -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let mut line = |arguments: std::fmt::Arguments<'_>| {
        let _ = writeln!(text, "{arguments}");
    };
    for surface in &document.surfaces {
        surface_text(surface, &mut line);
        let mut rows = document.cells.iter().filter(|row| row.surface == surface.name).peekable();
        if rows.peek().is_some() {
            line(format_args!(
                "  {:<8} {:<52} {:>7} {:>5} {:>7} {:>6} {:>7} {:>8} {:>9} {:>7} {:>7} {:>5} {:>6} {:>9}",
                "end",
                "cell",
                "mm in",
                "cmds",
                "iter.",
                "most",
                "per mm",
                "median",
                "slowest",
                "set-up",
                "pen. mm",
                "jumps",
                "resort",
                "crossed"
            ));
        }
        for row in rows {
            row_text(row, &mut line);
        }
    }
    text + &document.summary.to_string()
}

fn surface_text(surface: &SurfaceRow, line: &mut impl FnMut(std::fmt::Arguments<'_>)) {
    if let Some(reason) = &surface.refused {
        return line(format_args!("{}: refused: {reason}", surface.name));
    }
    line(format_args!(
        "{}: unit {} mm, {} triangles, {} openings, {:.1} mm long; {:.1} mm are inserted",
        surface.name,
        surface.unit_mm,
        surface.triangles,
        surface.openings,
        surface.size_mm,
        surface.length_mm
    ));
    if !surface.repaired.is_empty() {
        line(format_args!("  repaired: {}", surface.repaired.join(", ")));
    }
    for Start { wire, found, position_mm: [x, y, z], direction: [u, v, w] } in &surface.starts {
        line(format_args!(
            "  {wire} starts at [{x:.2}, {y:.2}, {z:.2}] along [{u:.2}, {v:.2}, {w:.2}]: {found}"
        ));
    }
    for skipped in &surface.skipped {
        line(format_args!("  skipped: {skipped}"));
    }
}

fn row_text(row: &CellRow, line: &mut impl FnMut(std::fmt::Arguments<'_>)) {
    let crossed = match row.crossings {
        0 => "–".to_owned(),
        count => format!("{count}×{:.2}", row.missing_mm),
    } + &match row.unreported {
        0 => String::new(),
        unreported => format!(" ({unreported} untold)"),
    };
    line(format_args!(
        "  {:<8} {:<52} {:>7.1} {:>5} {:>7} {:>6} {:>7.0} {:>8.2} {:>9.1} {:>7.2} {:>7.3} {:>5} {:>6} {:>9}{}",
        row.ending.name(),
        row.name,
        row.inserted_mm,
        row.steps,
        row.iterations,
        row.most_iterations,
        row.most_iterations_per_mm,
        row.median_ms,
        row.slowest_ms,
        row.setup_s,
        row.max_penetration_mm,
        row.jumps,
        row.relaxations,
        crossed,
        // A good ending needs no message: where the tip left or was blocked is in the JSON document.
        row.message.as_ref().filter(|_| !row.ending.is_good()).map_or_else(String::new, |m| format!("  {m}")),
    ));
}

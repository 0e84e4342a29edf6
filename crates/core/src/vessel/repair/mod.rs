//! Repair of a surface with faults beyond duplicate vertices and flipped faces.
//!
//! No step changes sound parts, or a surface without its fault.

mod contents;
#[cfg(test)]
mod contents_tests;
mod cracks;
mod divide;
mod doubles;
mod fill;
mod folds;
mod grazing;
mod holes;
#[cfg(test)]
mod layers_tests;
mod overlap;
#[cfg(test)]
mod overlap_tests;
mod pieces;
mod seams;
#[cfg(test)]
pub(super) mod shapes;
mod sheets;
#[cfg_attr(not(feature = "union"), path = "no_solid.rs")]
mod solid;
#[cfg(test)]
mod tests;

use overlap::Overlaps;
pub(super) use pieces::{nested_and_apart, turn_bodies};

use super::crossings::Crossings;
use super::repairs::{self, RepairKind};
use super::topology::{EdgeTable, Edges};
use super::wall::{RepairReport, drop_unreferenced, remove_duplicates};
use super::{SurfaceMesh, sliver};
use crate::{Error, Result, Vec3};

/// Why a surface that was only welded cannot be a wall; `None` if it can.
pub(super) fn refuse_unmended(mesh: &SurfaceMesh, report: &RepairReport) -> Option<Error> {
    let table = EdgeTable::new(&mesh.triangles);
    let crowded = table.edges().filter(|uses| uses.len() > 2).flatten().map(|used| used.triangle);
    let crowded = repairs::of_triangles(RepairKind::EdgeCut, mesh, crowded);
    let sheets = pieces::sheets_in_lumen(mesh, &table);
    let faults = [
        (crowded.len(), "edges of more than two triangles", repairs::named(&crowded, RepairKind::EdgeCut)),
        (report.one_sided_edges, "edges that make the surface one-sided", String::new()),
        (report.stray_edges, "open edges that form no loop", String::new()),
        (
            sheets.len(),
            "sheets in the lumen, which have no inside",
            repairs::named(&sheets, RepairKind::SheetInLumen),
        ),
    ];
    let named = |(count, what, at): (usize, &str, String)| match (count, at.is_empty()) {
        (0, _) => None,
        (count, true) => Some(format!("{count} {what}")),
        (count, false) => Some(format!("{count} {what}: {at}")),
    };
    let found: Vec<String> = faults.into_iter().filter_map(named).collect();
    (!found.is_empty()).then(|| {
        Error::Mesh(format!(
            "with repair = \"none\" it cannot be a wall: {}; mend the surface there, or let it be mended (\"all\")",
            found.join("; ")
        ))
    })
}

/// Joins cracks and removes superfluous sheets, for a mesh of welded vertices with these edges, before its winding is
/// made consistent.
pub(super) fn join_sheets(
    mesh: &mut SurfaceMesh,
    edges: &mut Edges,
    tolerance_mm: f64,
    report: &mut RepairReport,
) {
    let noted = &mut report.repairs;
    let doubles = doubles::drop_doubles(mesh, edges.of(&mesh.triangles), noted);
    (report.pieces_dropped, report.skins_dropped) = (doubles.patches, doubles.skins);
    report.piece_triangles_dropped = doubles.triangles;
    if doubles.triangles > 0 {
        edges.changed();
    }
    report.cracks_closed = cracks::close_cracks(mesh, edges.of(&mesh.triangles), noted);
    if report.cracks_closed > 0 {
        edges.changed();
    }
    let (sewn, merged) = seams::sew(mesh, edges.of(&mesh.triangles), noted);
    (report.edges_sewn, report.cracks_closed) = (sewn, report.cracks_closed + merged);
    if report.cracks_closed + report.edges_sewn > 0 {
        edges.changed();
        report.degenerate_removed += sliver::remove_degenerate(mesh, tolerance_mm);
        report.duplicates_removed += remove_duplicates(&mut mesh.triangles, edges);
    }
    let resolved = sheets::resolve(mesh, edges, &mut report.repairs);
    report.sheets_removed = resolved.removed;
    report.edges_cut = resolved.cut;
    if doubles.triangles + report.cracks_closed + report.edges_sewn + resolved.removed + resolved.cut > 0 {
        edges.changed();
        drop_unreferenced(mesh);
    }
}

/// Drops pieces that are not vessels, makes walls of what is in the lumen, closes holes except those at `keep_open_mm`,
/// and repairs folds, for a mesh of consistent winding with these edges.
///
/// # Errors
/// As [`holes::fill_holes`].
pub(super) fn cure(
    mesh: &mut SurfaceMesh,
    edges: &mut Edges,
    tolerance_mm: f64,
    keep_open_mm: &[Vec3],
    report: &mut RepairReport,
) -> Result<()> {
    let noted = &mut report.repairs;
    let dropped = pieces::sort(mesh, edges.of(&mesh.triangles), noted);
    (report.bodies_in_lumen, report.sheets_in_lumen) = (dropped.bodies, dropped.sheets);
    if dropped.triangles + dropped.bodies + dropped.sheets > 0 {
        edges.changed();
    }
    report.pieces_dropped += dropped.specks;
    report.skins_dropped += dropped.skins;
    report.piece_triangles_dropped += dropped.triangles;
    let filled = holes::fill_holes(mesh, edges.of(&mesh.triangles), keep_open_mm, noted)?;
    report.holes_filled = filled.holes;
    report.triangles_added = filled.triangles;
    if filled.triangles > 0 {
        // The filling of a crack has no area: its needles are flipped into the adjacent triangles.
        sliver::remove_degenerate(mesh, tolerance_mm);
    }
    let mut found = folds::find(mesh, tolerance_mm);
    if filled.triangles > 0 {
        edges.changed();
    }
    let mut overlaps = Overlaps::find(mesh, edges.of(&mesh.triangles), &found);
    let own = overlaps.as_ref().map_or_else(Vec::new, |overlaps| overlaps.own(&found));
    if !own.is_empty() {
        let first = folds::cure(mesh, tolerance_mm, Crossings { pairs: own, capped: false }, noted);
        report.fold_triangles_removed = first.removed;
        report.triangles_added += first.added;
        edges.changed();
        found = folds::find(mesh, tolerance_mm);
        overlaps = Overlaps::find(mesh, edges.of(&mesh.triangles), &found);
    }
    if let Some(overlaps) = overlaps {
        (report.parts_united, report.bodies_in_wall) = overlaps.unite(mesh, noted)?;
        sliver::remove_degenerate(mesh, tolerance_mm);
        edges.changed();
        drop_unreferenced(mesh);
        found = folds::find(mesh, tolerance_mm);
    }
    let before = found.pairs.len();
    let parted = grazing::part(mesh, tolerance_mm, &mut found, noted);
    report.triangles_moved_apart = parted.moved;
    let cured = folds::cure(mesh, tolerance_mm, found, noted);
    report.intersections_found = before;
    report.intersections_left = cured.left + parted.left;
    report.intersections_capped = cured.capped;
    report.fold_triangles_removed += cured.removed;
    report.triangles_added += cured.added;
    if cured.added > 0 {
        sliver::remove_degenerate(mesh, tolerance_mm);
    }
    let made = report.triangles_added
        + dropped.bodies
        + dropped.sheets
        + report.parts_united
        + report.bodies_in_wall;
    let pruned = if made > 0 {
        // Rare: two fillings that share a chord, a flip that met another, a part that touches one along an edge.
        sheets::prune(mesh, noted)
    } else {
        0
    };
    report.sheets_removed += pruned;
    if made + pruned + dropped.triangles + report.fold_triangles_removed > 0 {
        edges.changed();
        drop_unreferenced(mesh);
    }
    noted.extend(nested_and_apart(mesh, edges.of(&mesh.triangles)));
    Ok(())
}

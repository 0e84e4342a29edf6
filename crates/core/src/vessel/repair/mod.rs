//! Repair of a surface with faults beyond duplicate vertices and flipped faces.
//!
//! No step changes sound parts, or a surface without its fault.

mod cracks;
mod doubles;
mod fill;
mod folds;
mod holes;
mod pieces;
mod seams;
mod sheets;
#[cfg(test)]
mod tests;

pub(super) use pieces::nested;

use super::SurfaceMesh;
use super::sliver;
use super::topology::Edges;
use super::wall::{RepairReport, drop_unreferenced, remove_duplicates};

/// Joins cracks and removes superfluous sheets, for a mesh of welded vertices with these edges, before its winding is
/// made consistent.
pub(super) fn join_sheets(
    mesh: &mut SurfaceMesh,
    edges: &mut Edges,
    tolerance_mm: f64,
    report: &mut RepairReport,
) {
    (report.pieces_dropped, report.piece_triangles_dropped) =
        doubles::drop_doubles(mesh, edges.of(&mesh.triangles));
    if report.pieces_dropped > 0 {
        edges.changed();
    }
    report.cracks_closed = cracks::close_cracks(mesh, edges.of(&mesh.triangles));
    if report.cracks_closed > 0 {
        edges.changed();
    }
    let (sewn, merged) = seams::sew(mesh, edges.of(&mesh.triangles));
    (report.edges_sewn, report.cracks_closed) = (sewn, report.cracks_closed + merged);
    if report.cracks_closed + report.edges_sewn > 0 {
        edges.changed();
        report.degenerate_removed += sliver::remove_degenerate(mesh, tolerance_mm);
        report.duplicates_removed += remove_duplicates(&mut mesh.triangles, edges);
    }
    let resolved = sheets::resolve(mesh, edges);
    report.sheets_removed = resolved.removed;
    report.edges_cut = resolved.cut;
    if report.pieces_dropped + report.cracks_closed + report.edges_sewn + resolved.removed + resolved.cut > 0
    {
        edges.changed();
        drop_unreferenced(mesh);
    }
}

/// Drops pieces that are not vessels, closes holes and repairs folds, for a mesh of consistent winding with these
/// edges.
pub(super) fn cure(mesh: &mut SurfaceMesh, edges: &mut Edges, tolerance_mm: f64, report: &mut RepairReport) {
    let dropped = pieces::drop_pieces(mesh, edges.of(&mesh.triangles));
    if dropped.triangles > 0 {
        edges.changed();
    }
    report.pieces_dropped += dropped.specks;
    report.skins_dropped = dropped.skins;
    report.piece_triangles_dropped += dropped.triangles;
    let filled = holes::fill_holes(mesh, edges.of(&mesh.triangles));
    report.holes_filled = filled.holes;
    report.triangles_added = filled.triangles;
    if filled.triangles > 0 {
        // The filling of a crack has no area: its needles are flipped into the adjacent triangles.
        sliver::remove_degenerate(mesh, tolerance_mm);
    }
    let cured = folds::cure(mesh, tolerance_mm);
    report.intersections_found = cured.found;
    report.intersections_left = cured.left;
    report.intersections_capped = cured.capped;
    report.fold_triangles_removed = cured.removed;
    report.triangles_added += cured.added;
    if cured.added > 0 {
        sliver::remove_degenerate(mesh, tolerance_mm);
    }
    if filled.triangles + cured.added > 0 {
        // Rare: two fillings that share a chord, or a flip that met another.
        report.sheets_removed += sheets::prune(mesh);
    }
    if dropped.triangles + filled.triangles + cured.removed + cured.added > 0 {
        edges.changed();
        drop_unreferenced(mesh);
    }
}

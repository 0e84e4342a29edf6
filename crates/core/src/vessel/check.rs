//! Properties and faults of a surface as given.

use super::crossings::crossings;
use super::extract::handles;
use super::hints::{opening_hints, unit_hint};
use super::pieces::{PieceReport, Pieces};
use super::survey::{Survey, survey};
use super::topology::EdgeTable;
use super::wall::{duplicate_pairs, flat_volume_mm3};
use super::weld::Welding;
use super::{RepairKind, RepairOptions, RepairReport, SurfaceMesh, Wall, opening, sliver};
use crate::{Error, Result};

/// Number of intersecting pairs named in a report; a list of thousands would not help.
const PAIRS_NAMED: usize = 10;
/// Number of intersecting pairs after which counting stops.
const PAIRS_COUNTED: usize = 100_000;

/// A boundary loop in a report.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct OpeningReport {
    /// Number, largest first.
    pub index: usize,
    /// Centre in mm.
    pub centre_mm: [f64; 3],
    /// Mean radius in mm.
    pub radius_mm: f64,
    /// Unit vector out of the vessel.
    pub direction: [f64; 3],
    /// Edges of the loop.
    pub edges: usize,
}

/// The result of [`check`]. Volume and openings are those of the repaired wall, which is used in simulations; faces
/// and counts of faults are those of the surface as given, with duplicate vertices welded.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CheckReport {
    /// Triangles as given.
    pub triangles: usize,
    /// Vertices after welding.
    pub vertices: usize,
    /// Vertices that coincide with another one (normal in STL, which stores each corner separately).
    pub duplicate_vertices: usize,
    /// Pieces connected by edges.
    pub components: usize,
    /// The pieces of the repaired wall, the largest first; empty if it is one.
    pub pieces: Vec<PieceReport>,
    /// Whether every edge belongs to exactly two triangles.
    pub watertight: bool,
    /// Edges of a single triangle.
    pub open_edges: usize,
    /// Open edges that form no loop.
    pub stray_edges: usize,
    /// The loops of open edges.
    pub openings: Vec<OpeningReport>,
    /// The index of the default opening for devices ([`Wall::inlet`]).
    pub inlet: Option<usize>,
    /// Pairs of openings of similar size that face each other within a radius: a vessel that is cut through there.
    pub facing_openings: Vec<[usize; 2]>,
    /// Pieces of the repaired wall inside another one, or through its openings, among its eight largest: volumes are added, and a
    /// device between the two is in the outer one. What is taken as a wall in the lumen does not count.
    pub nested_pieces: usize,
    /// Closed pieces of the repaired wall beside a vessel with openings, among its eight largest: nothing can get into them, as
    /// into a sac that is not joined to its artery.
    pub separate_pieces: usize,
    /// Rings of the repaired wall, in which vessels meet again: its handles, with each opening closed. Absent where it does not
    /// close.
    pub rings: Option<usize>,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Triangles wound against their neighbours or inwards.
    pub flipped_triangles: usize,
    /// Whether all triangles are wound inwards.
    pub inside_out: bool,
    /// Triangles without area.
    pub degenerate_triangles: usize,
    /// Triangles on the same vertices as an earlier one.
    pub duplicate_triangles: usize,
    /// Pairs of triangles that cross, touch or are folded onto each other beyond their common vertices.
    pub self_intersections: usize,
    /// Whether counting stopped before all pairs were found: there are at least this many.
    pub self_intersections_capped: bool,
    /// The first of these pairs, by triangle number in the file.
    pub intersecting_pairs: Vec<[usize; 2]>,
    /// Whether the surface encloses nothing beyond rounding: a sheet.
    pub flat: bool,
    /// Volume enclosed by the wall and flat caps in mm³.
    pub volume_mm3: f64,
    /// Area of the wall in mm².
    pub area_mm2: f64,
    /// Smallest coordinates in mm.
    pub low_mm: [f64; 3],
    /// Largest coordinates in mm.
    pub high_mm: [f64; 3],
    /// Shortest edge in mm.
    pub edge_min_mm: f64,
    /// Median edge in mm.
    pub edge_median_mm: f64,
    /// Longest edge in mm.
    pub edge_max_mm: f64,
    /// What the repair changed, and what faults remain.
    pub repair: RepairReport,
    /// Width of the lumen, thin septa and a suitable start, of the repaired wall.
    #[serde(flatten)]
    pub survey: Survey,
    /// Whether the repaired wall is closed except for its openings, which is required only for contrast medium in
    /// fluoroscopy.
    pub contrast: bool,
    /// Hints for the user.
    pub hints: Vec<String>,
}

/// Thickness in mm below which [`check`] counts septa: that of a vessel's wall.
const SEPTUM_MM: f64 = 1.0;
/// Largest such thickness, mm: that between organs.
const LARGEST_SEPTUM_MM: f64 = 100.0;

impl CheckReport {
    /// Whether a device can be simulated in this wall as it is: consistent, outward, manifold, free of faults,
    /// connected, around a volume. Open ends are fine.
    pub fn is_sound(&self) -> bool {
        self.faults().is_empty()
    }

    /// What is left to mend after the repair on loading, a sentence each.
    pub fn needs_you(&self) -> Vec<String> {
        let flat = self
            .flat
            .then(|| "the surface encloses no volume, as a sheet: no device can be in it".to_owned());
        let facing = self.facing_openings.iter().map(|[i, j]| {
            format!("openings {i} and {j} face each other: the vessel is cut through there; join its parts")
        });
        flat.into_iter().chain(self.repair.left()).chain(facing).collect()
    }

    /// Why it is not sound: a few words for each kind of fault, with the number of such faults.
    pub fn faults(&self) -> Vec<String> {
        let counts = [
            (self.non_manifold_edges, "edge of more than two triangles", "edges of more than two triangles"),
            (self.flipped_triangles, "flipped triangle", "flipped triangles"),
            (self.degenerate_triangles, "triangle without area", "triangles without area"),
            (self.duplicate_triangles, "duplicate triangle", "duplicate triangles"),
            (
                self.self_intersections.max(self.repair.intersections_left),
                "self-intersection",
                "self-intersections",
            ),
            (self.stray_edges, "stray open edge", "stray open edges"),
            (self.repair.edges_sewn, "edge along a crack", "edges along cracks"),
            (self.repair.cracks_closed, "vertex beside a crack", "vertices beside cracks"),
            (self.repair.holes_filled, "hole", "holes"),
            (self.repair.pieces_dropped, "piece that is no vessel", "pieces that are no vessels"),
            (self.repair.skins_dropped, "outer skin of a double wall", "outer skins of a double wall"),
            (
                self.facing_openings.len(),
                "pair of openings that face each other",
                "pairs of openings that face each other",
            ),
            (self.nested_pieces, "piece inside another", "pieces inside another"),
            (
                self.separate_pieces,
                "closed piece that is not joined to the vessel",
                "closed pieces that are not joined to the vessel",
            ),
        ];
        let counted = counts
            .iter()
            .filter(|(count, ..)| *count > 0)
            .map(|(count, one, several)| format!("{count} {}", if *count == 1 { one } else { several }));
        let flat = self.flat.then(|| "it encloses no volume, as a sheet".to_owned());
        flat.into_iter().chain(counted).collect()
    }
}

/// Checks a surface as it comes from a file.
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if there is no triangle with area, an index is out of range or a coordinate is not finite.
pub fn check(surface: &SurfaceMesh) -> Result<CheckReport> {
    check_with(surface, 1.0, SEPTUM_MM)
}

/// As [`check`], for a surface read with `unit_mm`, which hints name, and with septa counted below `septum_mm`.
///
/// # Errors
/// As [`check`], and [`Error::Parameter`] for a thickness that is not from 0 to 100.
pub(crate) fn check_with(surface: &SurfaceMesh, unit_mm: f64, septum_mm: f64) -> Result<CheckReport> {
    check_repaired(surface, unit_mm, septum_mm, &RepairOptions::default())
}

/// As `check_with`, with other choices of what is repaired.
///
/// # Errors
/// As `check_with` and [`Wall::repaired`].
pub fn check_repaired(
    surface: &SurfaceMesh,
    unit_mm: f64,
    septum_mm: f64,
    repair: &RepairOptions,
) -> Result<CheckReport> {
    if !(0.0..=LARGEST_SEPTUM_MM).contains(&septum_mm) {
        let remedy = format!("must be a thickness from 0 to {LARGEST_SEPTUM_MM} mm");
        return Err(Error::parameter("septum_mm", septum_mm, remedy));
    }
    let welding = Welding::of(surface)?;
    let wall = Wall::repaired_from(welding.clone(), repair)?;
    // If only welding and turning over was needed, the wall is the surface as given: it is neither welded nor
    // searched again.
    let as_given = wall.report().is_as_given();
    let given = if as_given { None } else { Some(Wall::report_on(welding.clone())?) };
    let Welding { mesh: welded, bounds_mm: (low, high), tolerance_mm, merged } = welding;
    let degenerate = |i: &usize| sliver::is_degenerate(&welded.corners(*i), tolerance_mm);
    let table = EdgeTable::new(&welded.triangles);
    let open_edges = table.edges().filter(|uses| uses.len() == 1).count();
    let intersections = match as_given {
        true => Intersections::default(),
        false => self_intersections(&welded, tolerance_mm),
    };
    let mut edges: Vec<f64> = table
        .edges()
        .map(|uses| {
            (welded.vertices_mm[uses[0].low as usize] - welded.vertices_mm[uses[0].high as usize]).norm()
        })
        .collect();
    let (middle, last) = (edges.len() / 2, edges.len().saturating_sub(1));
    let [edge_min_mm, edge_median_mm, edge_max_mm] = [0, middle, last].map(|k| match edges.is_empty() {
        true => 0.0,
        false => *edges.select_nth_unstable_by(k, f64::total_cmp).1,
    });
    let (report, repair) = (given.as_ref().unwrap_or(wall.report()), wall.report().clone());
    let survey = survey(&wall, septum_mm);
    let volume_mm3 = wall.volume_mm3();
    let rounding_mm3 = flat_volume_mm3(wall.mesh());
    let contrast = repair.stray_edges + repair.non_manifold_edges + repair.one_sided_edges == 0
        && volume_mm3 > rounding_mm3;
    let hints = hints(&wall, &survey, (high - low).norm(), unit_mm);
    let non_manifold_edges = table.non_manifold();
    let number = |kind: RepairKind| repair.repairs.iter().filter(|repair| repair.kind == kind).count();
    let (nested_pieces, separate_pieces) = (number(RepairKind::PieceNested), number(RepairKind::PieceApart));
    Ok(CheckReport {
        triangles: surface.triangles.len(),
        vertices: surface.vertices_mm.len() - merged,
        duplicate_vertices: merged,
        components: report.components,
        pieces: if wall.report().components > 1 {
            Pieces::of(wall.mesh()).reports(wall.mesh())
        } else {
            Vec::new()
        },
        watertight: open_edges == 0 && non_manifold_edges == 0,
        open_edges,
        stray_edges: report.stray_edges,
        openings: wall
            .openings()
            .iter()
            .map(|o| OpeningReport {
                index: o.index,
                centre_mm: o.centre_mm.into(),
                radius_mm: o.radius_mm,
                direction: o.direction.into(),
                edges: o.boundary.len(),
            })
            .collect(),
        inlet: wall.inlet().map(|opening| opening.index),
        facing_openings: opening::facing(wall.openings()),
        nested_pieces,
        separate_pieces,
        rings: handles(&wall, &[]),
        non_manifold_edges,
        flipped_triangles: report.triangles_flipped,
        inside_out: report.inside_out,
        degenerate_triangles: (0..welded.triangles.len()).filter(degenerate).count(),
        duplicate_triangles: duplicate_pairs(&welded.triangles, &table).len(),
        self_intersections: intersections.count,
        self_intersections_capped: intersections.capped,
        intersecting_pairs: intersections.first,
        flat: volume_mm3 <= rounding_mm3,
        volume_mm3,
        area_mm2: area_mm2(&welded),
        low_mm: low.into(),
        high_mm: high.into(),
        edge_min_mm,
        edge_median_mm,
        edge_max_mm,
        repair,
        survey,
        contrast,
        hints,
    })
}

/// Number of openings and of pieces above which a surface is rather one whose vertices were not merged.
const MANY: usize = 100;

/// What the user may want to know or change, a sentence each.
fn hints(wall: &Wall, survey: &Survey, diagonal_mm: f64, unit_mm: f64) -> Vec<String> {
    let half_lumen_mm = survey.lumen.as_ref().map(|lumen| lumen.median_mm);
    let unit = unit_hint(diagonal_mm, half_lumen_mm, unit_mm);
    let mut hints: Vec<String> = unit.into_iter().chain(opening_hints(wall.openings())).collect();
    let (openings, pieces) = (wall.openings().len(), wall.report().components);
    if openings.min(pieces) > MANY {
        hints.push(format!(
            "{openings} openings in {pieces} pieces: triangles of the surface do not share their vertices: merge those closer than a \
             fraction of an edge in a program for meshes (\"merge by distance\"), or write the file with more digits"
        ));
    }
    if wall.openings().is_empty() {
        let list = |v: &[f64; 3]| format!("[{:.3}, {:.3}, {:.3}]", v[0], v[1], v[2]);
        hints.push(match &survey.start {
            Some(start) => format!(
                "the vessel is closed, so a sheath needs a point inside and a direction, such as sheath.position_mm = {} and \
                 sheath.direction = {}",
                list(&start.position_mm),
                list(&start.direction)
            ),
            None => "the vessel is closed and no point is deep inside: open it, or give sheath.position_mm and \
                     sheath.direction"
                .to_owned(),
        });
    }
    hints
}

/// Area of all triangles, mm².
pub(crate) fn area_mm2(mesh: &SurfaceMesh) -> f64 {
    (0..mesh.triangles.len()).map(|i| super::mesh::area(&mesh.corners(i))).sum()
}

/// The result of [`self_intersections`].
#[derive(Default)]
pub(crate) struct Intersections {
    /// Number of intersecting pairs, all or those found before the limit.
    pub(crate) count: usize,
    /// Whether the limit stopped the count.
    pub(crate) capped: bool,
    /// The pairs with the smallest numbers.
    pub(crate) first: Vec<[usize; 2]>,
}

/// Counts intersecting pairs among the triangles with area, and names the first few.
pub(crate) fn self_intersections(mesh: &SurfaceMesh, tolerance_mm: f64) -> Intersections {
    let found = crossings(mesh, tolerance_mm, None, PAIRS_COUNTED);
    let first = found.pairs.iter().take(PAIRS_NAMED).map(|pair| pair.map(|t| t as usize)).collect();
    Intersections { count: found.pairs.len(), capped: found.capped, first }
}

//! A vessel wall made from a surface, with a report of its repair.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::in_front::Ends;
use super::mesh::retain_numbered;
use super::opening::{self, Boundary, Opening};
use super::repairs::{Repair, RepairKind, RepairMode, RepairOptions, Treatment, named};
pub(crate) use super::topology::NONE as NO_NEIGHBOUR;
use super::topology::{EdgeTable, EdgeUse, Edges};
use super::weld::Welding;
use super::{SurfaceMesh, far, orient, repair, sliver};
use crate::{Error, Result, Vec3};

/// Ratio of volume to the cube of the surface's size below which it is a sheet without an inside.
const FLAT: f64 = 1e-14;
/// Largest number of openings of a wall: beyond it, triangles do not share their vertices.
const MOST_OPENINGS: usize = 10_000;

/// A vessel wall: triangles counter-clockwise seen from outside the lumen, with numbered openings.
///
/// ```
/// use endowire_core::{SurfaceMesh, Vec3, Wall};
///
/// // Read one from a file with `SurfaceMesh::read(path, unit_mm)`. A box 10 mm wide:
/// let surface = SurfaceMesh::cuboid(Vec3::zeros(), Vec3::new(10.0, 10.0, 100.0), 5.0);
/// let wall = Wall::from_surface(&surface)?;
/// assert!((wall.volume_mm3() - 10_000.0).abs() < 1e-6);
/// # Ok::<(), endowire_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Wall {
    pub(super) mesh: SurfaceMesh,
    pub(super) openings: Vec<Opening>,
    pub(super) caps: Vec<[Vec3; 3]>,
    pub(super) report: RepairReport,
}

/// What [`Wall::from_surface`] found and changed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RepairReport {
    /// Triangles as given.
    pub triangles_given: usize,
    /// Vertices as given.
    pub vertices_given: usize,
    /// Vertices merged into another one.
    pub vertices_welded: usize,
    /// Vertices dropped because no triangle used them.
    pub vertices_unreferenced: usize,
    /// Triangles without area that were removed (for needles the neighbour's edge was flipped, so that no slit
    /// opens).
    pub degenerate_removed: usize,
    /// Triangles on the same three vertices as an earlier one, removed.
    pub duplicates_removed: usize,
    /// Triangles whose winding was reversed: flipped faces, or all of a surface that was inside out.
    pub triangles_flipped: usize,
    /// Whether the whole surface was inside out.
    pub inside_out: bool,
    /// Connected pieces of the surface. More than one may be legitimate (two vessels) or debris: `smallest_component`
    /// helps to decide.
    pub components: usize,
    /// Triangles of the smallest component.
    pub smallest_component: usize,
    /// Openings found: boundary loops.
    pub openings: usize,
    /// Open edges that form no loop.
    pub stray_edges: usize,
    /// Edges shared by more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges across which no winding agrees: the surface is one-sided.
    pub one_sided_edges: usize,
    /// Vertices merged across cracks wider than the welding tolerance.
    pub cracks_closed: usize,
    /// Open edges split at the vertices of the other side of a seam, and joined to it.
    pub edges_sewn: usize,
    /// Triangles of fins, second layers and membranes removed: edges had more than two triangles.
    pub sheets_removed: usize,
    /// Edges of more than two triangles along which the surface was cut apart, without moving anything.
    pub edges_cut: usize,
    /// Specks and floating patches dropped.
    pub pieces_dropped: usize,
    /// Outer skins dropped of a wall that was given with two: the inner one is that of the lumen.
    pub skins_dropped: usize,
    /// Triangles of dropped pieces and skins.
    pub piece_triangles_dropped: usize,
    /// Holes and tears closed.
    pub holes_filled: usize,
    /// Triangles added to close holes, including those of folds that were cut out.
    pub triangles_added: usize,
    /// Pairs of triangles that intersected before folds were cut out.
    pub intersections_found: usize,
    /// Pairs that still intersect.
    pub intersections_left: usize,
    /// Whether there were too many to find: then none was repaired.
    pub intersections_capped: bool,
    /// Triangles cut out because they intersected or were folded.
    pub fold_triangles_removed: usize,
    /// Triangles of vessels that grazed each other, moved apart.
    pub triangles_moved_apart: usize,
    /// Closed bodies in the lumen, taken as walls.
    pub bodies_in_lumen: usize,
    /// Sheets in the lumen, taken as thin walls with two sides.
    pub sheets_in_lumen: usize,
    /// Parts that overlapped others and were united with them.
    pub parts_united: usize,
    /// Closed bodies and sheets that stand in the wall, taken off the lumen.
    pub bodies_in_wall: usize,
    /// What was repaired where, in the order of the work: everything counted above except merged or unused vertices,
    /// triangles without area, duplicates and turned triangles, which change no surface.
    pub repairs: Vec<Repair>,
}

impl RepairReport {
    /// Whether the surface needed nothing but welding and a consistent winding, and no triangles of it intersect.
    pub(crate) fn is_as_given(&self) -> bool {
        let more = [
            self.degenerate_removed,
            self.duplicates_removed,
            self.cracks_closed,
            self.edges_sewn,
            self.sheets_removed,
            self.edges_cut,
            self.pieces_dropped,
            self.skins_dropped,
            self.holes_filled,
            self.triangles_added,
            self.intersections_found,
            self.fold_triangles_removed,
            self.triangles_moved_apart,
            self.bodies_in_lumen,
            self.sheets_in_lumen,
            self.parts_united,
            self.bodies_in_wall,
        ];
        more.iter().all(|count| *count == 0) && !self.intersections_capped
    }

    /// One line for each kind of what was repaired on the surface, of what in its lumen was taken as a wall, and of what is
    /// left to mend, with sizes and places of the largest; empty for a surface that is taken as it was given.
    pub fn repair_notes(&self) -> Vec<String> {
        self.lines().into_iter().map(|(_, line)| line).collect()
    }

    /// One line for each kind of change.
    pub fn repaired(&self) -> Vec<String> {
        let counted = [
            (self.vertices_welded, "duplicate vertices welded"),
            (self.vertices_unreferenced, "unused vertices dropped"),
            (self.degenerate_removed, "degenerate triangles removed"),
            (self.duplicates_removed, "duplicate triangles removed"),
            (self.triangles_flipped, "triangles turned over"),
        ];
        lines_of(&counted).chain(self.of_treatment(Treatment::Mended)).collect()
    }

    /// One line for each kind of what is unusual and was kept.
    pub fn kept(&self) -> Vec<String> {
        let pieces = (self.components > 1).then(|| {
            format!(
                "{} separate pieces, the smallest of {} triangles",
                self.components, self.smallest_component
            )
        });
        self.of_treatment(Treatment::Kept).chain(pieces).collect()
    }

    /// One line for each kind of fault that is left.
    pub fn left(&self) -> Vec<String> {
        let counted = [
            (self.stray_edges, "open edges form no loop"),
            (self.non_manifold_edges, "edges belong to more than two triangles"),
            (self.one_sided_edges, "edges make the surface one-sided"),
        ];
        self.of_treatment(Treatment::Left).chain(lines_of(&counted)).collect()
    }

    /// One line per change or irregularity; empty for a clean surface.
    pub fn notes(&self) -> Vec<String> {
        [self.repaired(), self.kept(), self.left()].concat()
    }

    fn of_treatment(&self, treatment: Treatment) -> impl Iterator<Item = String> {
        let those = self.lines().into_iter().filter(move |(kind, _)| kind.treatment() == treatment);
        those.map(|(_, line)| line)
    }

    /// A line for each kind of repair that there is, with places.
    fn lines(&self) -> Vec<(RepairKind, String)> {
        let at_least = if self.intersections_capped { "or more " } else { "" };
        let still = format!("{at_least}pairs of triangles still intersect: mend the surface there");
        let number = |kind: RepairKind| self.repairs.iter().filter(|repair| repair.kind == kind).count();
        let lines = [
            (self.cracks_closed, RepairKind::CrackJoined, "vertices merged over cracks"),
            (self.edges_sewn, RepairKind::SeamSewn, "edges sewn to vertices of the other side of a seam"),
            (
                self.sheets_removed,
                RepairKind::SheetRemoved,
                "triangles of fins, second layers and membranes removed",
            ),
            (self.edges_cut, RepairKind::EdgeCut, "edges of more than two triangles cut apart"),
            (
                self.pieces_dropped,
                RepairKind::PieceDropped,
                "pieces that are small, flat or on the wall dropped",
            ),
            (
                self.skins_dropped,
                RepairKind::SkinDropped,
                "outer skins of a double wall dropped, the inner one is the lumen",
            ),
            (self.bodies_in_lumen, RepairKind::BodyInLumen, "closed bodies in the lumen taken as walls"),
            (
                self.sheets_in_lumen,
                RepairKind::SheetInLumen,
                "sheets in the lumen taken as thin walls with two sides",
            ),
            (
                self.parts_united,
                RepairKind::PartUnited,
                "parts that overlapped the rest without being joined, united with it",
            ),
            (
                self.bodies_in_wall,
                RepairKind::BodyInWall,
                "bodies and sheets that stand in the wall, taken off the lumen",
            ),
            (self.holes_filled, RepairKind::HoleClosed, "holes and tears closed"),
            (number(RepairKind::HoleKept), RepairKind::HoleKept, "holes left open as asked"),
            (
                self.fold_triangles_removed,
                RepairKind::FoldReplaced,
                "intersecting or folded triangles cut out and replaced",
            ),
            (
                self.triangles_moved_apart,
                RepairKind::MovedApart,
                "triangles of vessels that graze each other moved apart: they stay two",
            ),
            (self.intersections_left, RepairKind::StillCrossing, &still),
            (
                number(RepairKind::PieceNested),
                RepairKind::PieceNested,
                "pieces inside another one: a device is in the inner or the outer lumen; delete one of the two",
            ),
            (
                number(RepairKind::PieceApart),
                RepairKind::PieceApart,
                "closed pieces that are not joined to the vessel, so nothing gets into them: unite them with it, or delete them",
            ),
        ];
        let line = |(count, kind, text): (usize, RepairKind, &str)| match named(&self.repairs, kind) {
            places if places.is_empty() => (kind, format!("{count} {text}")),
            places => (kind, format!("{count} {text}: {places}")),
        };
        lines.into_iter().filter(|(count, ..)| *count > 0).map(line).collect()
    }
}

/// A line for each number that is not 0.
fn lines_of(counted: &[(usize, &str)]) -> impl Iterator<Item = String> {
    counted.iter().filter(|(count, _)| *count > 0).map(|(count, text)| format!("{count} {text}"))
}

impl Wall {
    /// Repairs `surface` into a wall: welds, removes degenerate and duplicate triangles, joins cracks, removes fins
    /// and second layers, makes the winding consistent and outward, drops specks and outer skins, closes holes and
    /// tears, cuts out local folds, and takes the remaining boundary loops as openings. Sound parts are not changed,
    /// and remaining vertices are not moved, except across cracks. [`Wall::report`] lists changes and remaining
    /// faults.
    ///
    /// # Errors
    /// [`Error::Mesh`] if there is no triangle with area, an index is out of range or a coordinate that is used is not
    /// finite, and for more than 10,000 openings.
    pub fn from_surface(surface: &SurfaceMesh) -> Result<Self> {
        Self::repaired(surface, &RepairOptions::default())
    }

    /// [`Wall::from_surface`] with other choices of what is repaired.
    ///
    /// # Errors
    /// As [`Wall::from_surface`]; [`Error::Parameter`] naming `keep_open_mm` for a place without a hole; with
    /// [`RepairMode::None`] [`Error::Mesh`] for a surface that cannot be a wall as it is.
    pub fn repaired(surface: &SurfaceMesh, options: &RepairOptions) -> Result<Self> {
        Self::repaired_from(Welding::of(surface)?, options)
    }

    /// [`Wall::repaired`] of a surface whose vertices are merged.
    pub(super) fn repaired_from(welding: Welding, options: &RepairOptions) -> Result<Self> {
        match options.mode {
            RepairMode::All => Self::mended(welding, Some(&options.keep_open_mm)),
            RepairMode::None => {
                if let Some(place) = options.keep_open_mm.first() {
                    let remedy = "nothing is closed with repair = \"none\": leave it out";
                    return Err(Error::parameter("keep_open_mm", crate::error::vector(place), remedy));
                }
                far::refuse(&welding.mesh)?;
                let mut wall = Self::mended(welding, None)?;
                let table = EdgeTable::new(&wall.mesh.triangles);
                wall.report.repairs.extend(repair::nested_and_apart(&wall.mesh, &table));
                repair::refuse_unmended(&wall.mesh, &wall.report).map_or(Ok(wall), Err)
            }
        }
    }

    /// A wall of `surface` with only vertices welded, triangles without area removed and the winding made consistent;
    /// other faults remain.
    ///
    /// # Errors
    /// As [`Wall::from_surface`].
    pub fn welded(surface: &SurfaceMesh) -> Result<Self> {
        Self::mended(Welding::of(surface)?, None)
    }

    /// [`Wall::repaired`] with holes kept open at these places, or only [`Wall::welded`], of a surface whose vertices
    /// are merged.
    pub(super) fn mended(welding: Welding, keep_open_mm: Option<&[Vec3]>) -> Result<Self> {
        if keep_open_mm.is_some() {
            far::refuse(&welding.mesh)?;
        }
        let (mesh, mut edges, mut report) = Self::prepared(welding, keep_open_mm)?;
        let boundary = count(&mesh, &mut edges, &mut report);
        if report.openings > MOST_OPENINGS {
            return Err(Error::Mesh(format!(
                "{} openings in {} pieces of {} triangles, at most {MOST_OPENINGS} openings are read: its triangles do not share their vertices: merge those closer than a \
                 fraction of an edge in a program for meshes (\"merge by distance\"), or write the file with more digits",
                report.openings,
                report.components,
                mesh.triangles.len()
            )));
        }
        Ok(Self::ending(mesh, boundary, report))
    }

    /// The report on a surface of which only vertices were merged, whatever number of openings it has.
    pub(super) fn report_on(welding: Welding) -> Result<RepairReport> {
        let (mesh, mut edges, mut report) = Self::prepared(welding, None)?;
        count(&mesh, &mut edges, &mut report);
        Ok(report)
    }

    /// The mesh of [`Self::mended`] with its edges, and what was changed.
    fn prepared(
        welding: Welding,
        keep_open_mm: Option<&[Vec3]>,
    ) -> Result<(SurfaceMesh, Edges, RepairReport)> {
        let Welding { mut mesh, tolerance_mm, merged, .. } = welding;
        let mut report = RepairReport {
            triangles_given: mesh.triangles.len(),
            vertices_given: mesh.vertices_mm.len(),
            vertices_welded: merged,
            ..Default::default()
        };
        report.degenerate_removed = sliver::remove_degenerate(&mut mesh, tolerance_mm);
        if mesh.triangles.is_empty() {
            return Err(Error::Mesh("no triangle has an area; check the file and its unit".into()));
        }
        report.vertices_unreferenced = drop_unreferenced(&mut mesh) - report.vertices_welded;
        let mut edges = Edges::default();
        report.duplicates_removed = remove_duplicates(&mut mesh.triangles, &mut edges);
        if keep_open_mm.is_some() {
            repair::join_sheets(&mut mesh, &mut edges, tolerance_mm, &mut report);
        }
        if mesh.triangles.is_empty() {
            return Err(Error::Mesh(
                "nothing is left of it where its edges are joined; check the file and its unit".into(),
            ));
        }
        let before = mesh.triangles.clone();
        let consistency = orient::make_consistent(&mut mesh.triangles, &mut edges);
        turn_outward(&mut mesh, &mut edges, &consistency);
        // Turning over swaps two corners; turning twice restores them exactly.
        report.triangles_flipped = before.iter().zip(&mesh.triangles).filter(|(a, b)| a != b).count();
        report.inside_out = report.triangles_flipped == mesh.triangles.len();
        report.one_sided_edges = consistency.contradictions;
        match keep_open_mm {
            Some(places) => repair::cure(&mut mesh, &mut edges, tolerance_mm, places, &mut report)?,
            None => repair::turn_bodies(&mut mesh, &mut edges),
        }
        Ok((mesh, edges, report))
    }

    /// The wall of `mesh` with this boundary, whose openings are kept apart.
    fn ending(mesh: SurfaceMesh, mut boundary: Boundary, report: RepairReport) -> Self {
        let rims_mm: Vec<f64> = boundary.openings.iter().map(|opening| opening.rim_mm(&mesh)).collect();
        let ends = Ends::new(&mesh, &boundary.across, &boundary.openings);
        let see = |number: usize, opening: &Opening, see: &mut dyn FnMut(Vec3, bool)| {
            ends.sample(number, opening, see);
        };
        opening::keep_apart(see, &rims_mm, &mut boundary.openings);
        let caps = boundary.openings.iter().flat_map(|o| o.cap(&mesh).collect::<Vec<_>>()).collect();
        Self { mesh, openings: boundary.openings, caps, report }
    }

    /// The repaired surface, open where the vessel is open.
    pub fn mesh(&self) -> &SurfaceMesh {
        &self.mesh
    }

    /// For every triangle, the one across each of its sides (side k runs from corner k to the next), or [`NO_NEIGHBOUR`].
    pub(crate) fn neighbours(&self) -> Vec<[u32; 3]> {
        EdgeTable::new(&self.mesh.triangles).neighbours(self.mesh.triangles.len())
    }

    /// The openings, largest first.
    pub fn openings(&self) -> &[Opening] {
        &self.openings
    }

    /// Numbers its openings like those of the same vessel before it was meshed: for openings of equal size the order
    /// would depend on rounding.
    ///
    /// # Errors
    /// A different number of openings.
    pub(super) fn number_openings_as(&mut self, known: &[Opening]) -> Result<()> {
        if known.len() != self.openings.len() {
            return Err(Error::Mesh(format!(
                "the tree has {} open ends, but the wall has {} openings: branches overlap near an end, or its mesh is too coarse",
                known.len(),
                self.openings.len()
            )));
        }
        let nearest = |opening: &Opening| {
            let away = |k: &usize| (known[*k].centre_mm - opening.centre_mm).norm();
            (0..known.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0)
        };
        let order: Vec<usize> = self.openings.iter().map(nearest).collect();
        for (opening, index) in self.openings.iter_mut().zip(order) {
            opening.index = index;
        }
        self.openings.sort_by_key(|opening| opening.index);
        Ok(())
    }

    /// The default opening for devices: the lowest (smallest z: the nearest to the feet, in patient axes) of those
    /// with at least 0.4 of the widest one's radius, as for access from the groin. `None` without openings. A vessel
    /// made from a tree begins at its root instead ([`GeneratedWall::inlet`](super::GeneratedWall::inlet)), and blood
    /// has its own rule ([`VesselFlow::inlet_mm`](crate::flow::VesselFlow::inlet_mm)): it comes from the heart.
    pub fn inlet(&self) -> Option<&Opening> {
        opening::inlet(&self.openings)
    }

    /// The triangles that close the openings; they are used for the inside test only and are not part of the wall.
    pub fn caps(&self) -> &[[Vec3; 3]] {
        &self.caps
    }

    /// The wall closed by a fan of triangles over each opening, sharing its vertices: for volumes and rendering.
    pub fn closed_mesh(&self) -> SurfaceMesh {
        let mut mesh = self.mesh.clone();
        self.openings.iter().for_each(|opening| opening.close(&mut mesh));
        mesh
    }

    /// The report of the repair.
    pub fn report(&self) -> &RepairReport {
        &self.report
    }

    /// Volume enclosed by the wall and its caps in mm³.
    pub fn volume_mm3(&self) -> f64 {
        let origin = self.mesh.vertices_mm.first().copied().unwrap_or_default();
        self.mesh.signed_volume_mm3() + self.caps.iter().map(|cap| signed_volume(cap, origin)).sum::<f64>()
    }
}

/// A wall is serialised as its mesh and report: the rest follows from these, to the bit.
impl Serialize for Wall {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        (&self.mesh, &self.report).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Wall {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        let (mesh, mut report): (SurfaceMesh, RepairReport) = Deserialize::deserialize(deserializer)?;
        validate(&mesh).map_err(de::Error::custom)?;
        let boundary = count(&mesh, &mut Edges::default(), &mut report);
        Ok(Self::ending(mesh, boundary, report))
    }
}

/// Completes the report on `mesh`, with these edges, and finds its boundary.
fn count(mesh: &SurfaceMesh, edges: &mut Edges, report: &mut RepairReport) -> Boundary {
    let table = edges.of(&mesh.triangles);
    report.non_manifold_edges = table.non_manifold();
    let (component, pieces) = table.components(mesh.triangles.len());
    let mut sizes = vec![0; pieces];
    for c in component {
        sizes[c as usize] += 1;
    }
    report.components = pieces;
    report.smallest_component = sizes.into_iter().min().unwrap_or(0);
    let boundary = opening::boundary(mesh, table);
    report.openings = boundary.openings.len();
    report.stray_edges = boundary.stray_edges;
    boundary
}

/// Volume in mm³ up to which a surface is a flat sheet that encloses only rounding.
pub(crate) fn flat_volume_mm3(mesh: &SurfaceMesh) -> f64 {
    FLAT * mesh.used_bounds_mm().map_or(0.0, |(low, high)| (high - low).norm()).powi(3)
}

/// Rejects surfaces beyond repair.
pub(crate) fn validate(surface: &SurfaceMesh) -> Result<()> {
    if surface.triangles.is_empty() {
        return Err(Error::Mesh("no triangles; a wall needs a surface".into()));
    }
    if surface.vertices_mm.len() >= u32::MAX as usize || surface.triangles.len() >= u32::MAX as usize / 4 {
        return Err(Error::Mesh(format!(
            "{} vertices and {} triangles are more than 32-bit indices hold; decimate the surface",
            surface.vertices_mm.len(),
            surface.triangles.len()
        )));
    }
    let count = surface.vertices_mm.len();
    let out_of_range = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= count);
    if let Some((i, t)) = surface.triangles.iter().enumerate().find(|(_, t)| out_of_range(t)) {
        return Err(Error::Mesh(format!(
            "triangle {i} = {t:?} names a vertex beyond the last one, {}",
            count.max(1) - 1
        )));
    }
    // Squares and cubes of coordinates must stay finite too. A vertex that no triangle uses may be anywhere.
    let usable = |v: &Vec3| v.iter().all(|c| c.abs() < 1e100);
    if let Some(i) = surface.triangles.iter().flatten().find(|i| !usable(&surface.vertices_mm[**i as usize]))
    {
        let v = surface.vertices_mm[*i as usize];
        return Err(Error::Mesh(format!(
            "vertex {i} is at ({}, {}, {}); all coordinates must be finite",
            v.x, v.y, v.z
        )));
    }
    Ok(())
}

/// Keeps the first of all triangles on the same vertices, whatever their winding.
pub(super) fn remove_duplicates(triangles: &mut Vec<[u32; 3]>, edges: &mut Edges) -> usize {
    let before = triangles.len();
    let pairs = duplicate_pairs(triangles, edges.of(triangles));
    if pairs.is_empty() {
        return 0;
    }
    let mut keep = vec![true; before];
    for (earlier, later) in pairs {
        debug_assert!(earlier < later);
        keep[later] = false;
    }
    edges.changed();
    retain_numbered(triangles, |index, _| keep[index]);
    before - triangles.len()
}

/// Triangles on the same three vertices: (first, any later one), sorted. `table` holds their edges.
pub(crate) fn duplicate_pairs(triangles: &[[u32; 3]], table: &EdgeTable) -> Vec<(usize, usize)> {
    let apex = |u: &EdgeUse| triangles[u.triangle as usize][(u.side as usize + 2) % 3];
    let may_repeat = |uses: &&[EdgeUse]| match uses {
        [_] => false,
        [a, b] => apex(a) == apex(b),
        _ => true,
    };
    let shared = table.edges().filter(may_repeat).flatten().map(|u| u.triangle as usize);
    // Triangles with a repeated vertex are not in the table.
    let repeats = |t: &[u32; 3]| t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    let alone = (0..triangles.len()).filter(|&index| repeats(&triangles[index]));
    let with_key = |index: usize| {
        let mut key = triangles[index];
        key.sort_unstable();
        (key, index)
    };
    let mut order: Vec<([u32; 3], usize)> = shared.chain(alone).map(with_key).collect();
    order.sort_unstable();
    order.dedup();
    let mut pairs: Vec<(usize, usize)> = order
        .chunk_by(|a, b| a.0 == b.0)
        .flat_map(|same| same[1..].iter().map(move |other| (same[0].1, other.1)))
        .collect();
    pairs.sort_unstable();
    pairs
}

/// Removes vertices that no triangle uses; returns their number.
pub(crate) fn drop_unreferenced(mesh: &mut SurfaceMesh) -> usize {
    let mut used = vec![false; mesh.vertices_mm.len()];
    for v in mesh.triangles.iter().flatten() {
        used[*v as usize] = true;
    }
    let mut renumbered = vec![0; used.len()];
    let mut kept = Vec::with_capacity(used.len());
    for (v, _) in used.iter().enumerate().filter(|(_, used)| **used) {
        renumbered[v] = kept.len() as u32;
        kept.push(mesh.vertices_mm[v]);
    }
    let dropped = used.len() - kept.len();
    mesh.vertices_mm = kept;
    for t in &mut mesh.triangles {
        *t = t.map(|v| renumbered[v as usize]);
    }
    dropped
}

/// Turns over each patch whose volume, closed by the caps of its openings, is negative.
fn turn_outward(mesh: &mut SurfaceMesh, edges: &mut Edges, consistency: &orient::Consistency) {
    let origin = mesh.vertices_mm[0];
    let mut volume = vec![0.0; consistency.patches];
    for (index, &patch) in consistency.patch.iter().enumerate() {
        volume[patch as usize] += signed_volume(&mesh.corners(index), origin);
    }
    let boundary = opening::boundary(mesh, edges.of(&mesh.triangles));
    for (opening, &triangle) in boundary.openings.iter().zip(&boundary.first_triangle) {
        let patch = consistency.patch[triangle as usize] as usize;
        volume[patch] += opening.cap(mesh).map(|cap| signed_volume(&cap, origin)).sum::<f64>();
    }
    let rounding_mm3 = flat_volume_mm3(mesh);
    for (triangle, &patch) in mesh.triangles.iter_mut().zip(&consistency.patch) {
        if volume[patch as usize] < -rounding_mm3 {
            triangle.swap(1, 2);
            edges.changed();
        }
    }
}

/// Signed volume of the tetrahedron over a triangle in mm³.
pub(crate) fn signed_volume(corners: &[Vec3; 3], origin: Vec3) -> f64 {
    let [a, b, c] = corners;
    (a - origin).dot(&(b - origin).cross(&(c - origin))) / 6.0
}

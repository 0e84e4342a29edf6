//! Vessels.

use std::collections::BTreeMap;
use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use endowire_core::input::nearest;
use endowire_core::passable::passable;
use endowire_core::vessel::{
    CentrelineEnd, CentrelineLink, CentrelineNode, CentrelinePath, CentrelineTree, ExtractedCentreline,
    LabelOptions, LabelSurface, Lumen, NoStore, Opening, Repair, RepairOptions, Resolution, SurfaceFrame,
    SurfaceMesh, SweptVessel, Target, Wall, anatomy, check_repaired, wall_hints,
};
use endowire_core::{Error, Vec3};
use endowire_methods::Scene;
use endowire_viewer::read_label_map;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::Serialize;

use crate::arrays::{List, Numbers, array, finite, natural, place, points, rows};
use crate::document;
use crate::error::{InputError, exception, refuse};
use crate::instrument::Instrument;
use crate::interrupt::interruptible;

/// A vessel's wall and its centre line. The centre line is the one that the wall was made from; otherwise it is
/// extracted from the lumen when first needed, from the inlet (in the vessel of a scene, the sheath's opening) to all
/// other openings. A vessel is immutable.
#[pyclass(frozen, module = "endowire", name = "Vessel")]
pub(crate) struct Vessel {
    pub(crate) lumen: Lumen,
    /// The centre line that it was made with.
    given: Option<Line>,
    /// Otherwise the centre line that was extracted when needed.
    found: OnceLock<Line>,
    /// The opening where the extracted one begins.
    begins: usize,
}

/// A centre line.
struct Line {
    tree: CentrelineTree,
    /// The opening at its root; `None` if it begins inside.
    inlet: Option<usize>,
}

/// An end of a centre line: the number of an opening, or a place in mm.
fn end(name: &str, object: &Bound<'_, PyAny>) -> PyResult<CentrelineEnd> {
    if object.extract::<List<Bound<'_, PyAny>>>().is_ok() {
        return place(name, object).map(|place| CentrelineEnd::Place(place.into()));
    }
    natural(name, object).map(CentrelineEnd::Opening)
}

/// The end of a way: the name of a target, or a place in mm.
pub(crate) enum Goal {
    Name(String),
    Place([f64; 3]),
}

impl Goal {
    /// `name` is that of the argument in errors.
    pub(crate) fn of(name: &str, object: &Bound<'_, PyAny>) -> PyResult<Self> {
        match object.extract::<String>() {
            Ok(target) => Ok(Self::Name(target)),
            Err(_) => place(name, object).map(Self::Place),
        }
    }
}

/// Replaces the core's names `from` and `to` in an error by the arguments of the method.
fn as_argument(error: Error) -> Error {
    match error {
        Error::Parameter { name, value, remedy } if name == "from" => {
            Error::Parameter { name: "start".into(), value, remedy }
        }
        Error::Parameter { name, value, remedy } if name == "to" => {
            Error::Parameter { name: "ends".into(), value, remedy }
        }
        other => other,
    }
}

/// Closing links of a centre line: pairs of rows.
type Links = Vec<(usize, usize)>;

/// The lumen of a vessel, its centre line with its links, its inlet, and names with their rows.
type Pickled<'py> =
    (PickledLumen<'py>, Option<(Bound<'py, PyArray2<f64>>, Links)>, Option<usize>, Vec<(String, usize)>);

/// The bytes of a wall; or a tree, its closed rows, the resolution of its mesh, and its links.
#[derive(IntoPyObject)]
enum PickledLumen<'py> {
    Wall(Bound<'py, PyBytes>),
    Tree(Bound<'py, PyArray2<f64>>, Vec<usize>, Option<f64>, Option<usize>, Links),
}

/// The same when read.
#[derive(FromPyObject)]
enum UnpickledLumen<'py> {
    Wall(Vec<u8>),
    Tree(Numbers<'py>, Vec<usize>, Option<f64>, Option<usize>, Links),
}

/// A centre-line tree: the path of its table or the name of a built-in anatomy, or an array.
enum Tree<'py> {
    Path(PathBuf),
    Table(Numbers<'py>),
}

#[derive(Serialize)]
struct OpeningDocument {
    index: usize,
    centre_mm: [f64; 3],
    radius_mm: f64,
    direction: [f64; 3],
}

#[pymethods]
impl Vessel {
    /// Reads a surface file (STL, OBJ, PLY, VTP, VTK) and repairs it if possible. `unit_mm` is millimetres per unit
    /// of the file. `axes` is "LPS" or "RAS", if the file's header is silent or wrong (by default LPS, the axes of
    /// scenes).
    ///
    /// `repair`: "all" faults are mended, and closed bodies and sheets in the lumen become walls; "none" refuses a
    /// surface that cannot be a wall as it is. `keep_open_mm` are places of holes that are meant, shape (n, 3).
    ///
    /// Warns (UserWarning) of what was mended (`repairs`), if the unit may be wrong, and if openings face each other.
    /// Raises InputError for a file that cannot be read or is not usable as a wall.
    #[staticmethod]
    #[pyo3(signature = (path, unit_mm = 1.0, axes = None, repair = "all", keep_open_mm = None))]
    fn read(
        py: Python<'_>,
        path: PathBuf,
        unit_mm: f64,
        axes: Option<&str>,
        repair: &str,
        keep_open_mm: Option<Numbers<'_>>,
    ) -> PyResult<Self> {
        let frame = frame(unit_mm, axes)?;
        let options = repair_options(repair, keep_open_mm.as_ref())?;
        let reported = path.display().to_string();
        let made = interruptible(py, move || {
            let wall = Wall::repaired(&SurfaceMesh::read(&path, frame)?, &options)?;
            let hints = wall_hints(&wall, frame.unit_mm);
            Ok::<_, Error>((wall, hints))
        })?;
        let (wall, hints) = made.map_err(exception)?;
        for hint in wall.report().repair_notes().into_iter().chain(hints) {
            warn(py, &format!("{reported}: {hint}"))?;
        }
        Ok(Self::of_wall(wall))
    }

    /// The wall of a triangle surface: vertices in mm, shape (n, 3), and triangles of vertex indices, shape (m, 3),
    /// counter-clockwise seen from outside. The surface is repaired if possible; `repair` and `keep_open_mm` are as in
    /// `read`.
    ///
    /// Warns (UserWarning) of what was mended (`repairs`). Raises InputError for arrays of the wrong shape, for invalid
    /// indices, and for a surface that is not usable as a wall.
    #[staticmethod]
    #[pyo3(signature = (vertices_mm, triangles, repair = "all", keep_open_mm = None))]
    fn from_arrays(
        py: Python<'_>,
        vertices_mm: Numbers<'_>,
        triangles: Numbers<'_>,
        repair: &str,
        keep_open_mm: Option<Numbers<'_>>,
    ) -> PyResult<Self> {
        let options = repair_options(repair, keep_open_mm.as_ref())?;
        let vertices_mm: Vec<Vec3> = rows("vertices_mm", &vertices_mm)?.into_iter().map(Vec3::from).collect();
        // Indices are taken as floats and checked: a conversion to integers would drop fractions.
        let index = |corner: f64| {
            let last = vertices_mm.len().min(u32::MAX as usize) as f64 - 1.0;
            match (0.0..=last).contains(&corner) && corner.fract() == 0.0 {
                true => Ok(corner as u32),
                false => Err(refuse("triangles", corner, "must be the number of a vertex, from 0")),
            }
        };
        let triangles = rows("triangles", &triangles)?
            .into_iter()
            .map(|[a, b, c]| Ok([index(a)?, index(b)?, index(c)?]))
            .collect::<PyResult<_>>()?;
        let surface = SurfaceMesh { vertices_mm, triangles };
        let made = interruptible(py, move || Wall::repaired(&surface, &options))?;
        let wall = made.map_err(exception)?;
        for note in wall.report().repair_notes() {
            warn(py, &note)?;
        }
        Ok(Self::of_wall(wall))
    }

    /// Makes the wall of a segmentation: a label map (NIfTI) as TotalSegmentator and 3D Slicer write them. `label` is the
    /// number of the vessel's label, or several that together are the vessel. `parts`: the "largest" connected part, or
    /// "all". `ends`: which ends of vessels are opened, "all", those at the picture's "border", or "none". Positions are
    /// those of scenes (LPS), so that the tomogram of the segmentation fits as `patient.ct`.
    ///
    /// Warns (UserWarning) of what was left out, filled or not opened. Raises InputError for a file that is no label map
    /// and for a label that it does not have.
    #[staticmethod]
    #[pyo3(signature = (path, label, parts = "largest", ends = "all"))]
    fn from_labels(
        py: Python<'_>,
        path: PathBuf,
        label: &Bound<'_, PyAny>,
        parts: &str,
        ends: &str,
    ) -> PyResult<Self> {
        let labels = match label.extract::<List<Bound<'_, PyAny>>>() {
            Ok(several) => several.0.iter().map(|one| natural("label", one)).collect::<PyResult<_>>()?,
            Err(_) => vec![natural("label", label)?],
        };
        let (parts, ends) = (parts.parse().map_err(exception)?, ends.parse().map_err(exception)?);
        let options = LabelOptions { labels, parts, ends };
        let reported = path.display().to_string();
        let made = interruptible(py, move || {
            let surface = LabelSurface::of(&read_label_map(&path)?, &options)?;
            Wall::from_surface(&surface.mesh).map(|wall| (wall, surface.report.notes()))
        })?;
        let (wall, notes) = made.map_err(exception)?;
        for note in notes.into_iter().chain(wall.report().repair_notes()) {
            warn(py, &format!("{reported}: {note}"))?;
        }
        Ok(Self::of_wall(wall))
    }

    /// Builds the wall of a centre-line tree: a built-in anatomy ("straight_tube", "curved_tube", "aortic_arch",
    /// "aortic_arch_ii", "aortic_arch_iii", "hepatic", "sidewall_aneurysm", "basilar_aneurysm"), the path of a table, or
    /// an array of shape (n, 5) of x, y, z, radius (mm) and the row of the parent (-1 for the root).
    ///
    /// Devices touch the exact surface of the tree. Triangles are generated only when something draws, writes or
    /// reads them; `edge_mm` or `triangles` set their resolution, by default with edges of a quarter of the smallest
    /// radius.
    ///
    /// Raises InputError for a tree that does not define a vessel. If it does but cannot be meshed, only methods that
    /// need the triangles raise.
    #[staticmethod]
    #[pyo3(signature = (tree, edge_mm = None, triangles = None))]
    fn generate(
        py: Python<'_>,
        tree: &Bound<'_, PyAny>,
        edge_mm: Option<f64>,
        triangles: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let tree = Tree::of(tree)?.tree()?;
        let resolution = match (edge_mm, triangles) {
            (Some(edge_mm), None) => Resolution::EdgeMm(edge_mm),
            (None, Some(count)) => Resolution::Triangles(natural("triangles", count)?),
            (None, None) => Resolution::fitting(&tree),
            (Some(edge_mm), Some(_)) => {
                return Err(refuse("edge_mm", edge_mm, "triangles is given too: keep one of the two"));
            }
        };
        interruptible(py, move || Self::swept(tree, resolution))?.map_err(exception)
    }

    /// Vertices of the wall, mm, shape (n, 3).
    #[getter]
    fn vertices_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.wall(py)?.mesh().vertices_mm.iter().copied())
    }

    /// Vertex indices of its triangles, shape (m, 3).
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let triangles = &self.wall(py)?.mesh().triangles;
        array(py, triangles.as_flattened().to_vec(), [triangles.len(), 3])
    }

    /// Its openings, largest first: dictionaries of index, centre_mm, radius_mm and direction (out of the vessel).
    #[getter]
    fn openings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let openings: Vec<OpeningDocument> = (self.lumen.openings().iter())
            .map(|o| OpeningDocument {
                index: o.index,
                centre_mm: o.centre_mm.into(),
                radius_mm: o.radius_mm,
                direction: o.direction.into(),
            })
            .collect();
        document::write(py, &openings)
    }

    /// What was repaired on its surface, and what in its lumen was taken as a wall: dictionaries of kind (such as
    /// "hole_closed", "piece_dropped", "body_in_lumen", "sheet_in_lumen", "part_united", "body_in_wall"), triangles, at_mm and size_mm
    /// (middle and sides of the bounding box). Empty for a surface that is taken as it was given, and for a centre line.
    #[getter]
    fn repairs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match &self.lumen {
            Lumen::Meshed(_) => document::write(py, &self.wall(py)?.report().repairs),
            Lumen::Swept(_) => document::write(py, &Vec::<Repair>::new()),
        }
    }

    /// Its centre line, shape (n, 5): x, y, z, radius (mm) and the row of the parent (-1 for the root).
    ///
    /// Raises InputError if the vessel was not made from one and none can be extracted (`with_centreline` can set
    /// where it begins and ends).
    #[getter]
    fn centreline<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, &self.line(py)?.tree)
    }

    /// Whether its centre line is extracted automatically: the vessel was not made from one, and `with_centreline`
    /// was not used.
    #[getter]
    fn centreline_found(&self) -> bool {
        self.given.is_none()
    }

    /// The opening at the root of its centre line; None if it begins inside.
    #[getter]
    pub(crate) fn inlet(&self) -> Option<usize> {
        match &self.given {
            Some(line) => line.inlet,
            None => Some(self.begins).filter(|opening| *opening < self.lumen.openings().len()),
        }
    }

    /// Named points of its centre line: positions in mm by name; those of an extracted one are called `opening 1` and
    /// so on.
    ///
    /// Raises InputError as `centreline`.
    #[getter]
    fn targets(&self, py: Python<'_>) -> PyResult<BTreeMap<String, [f64; 3]>> {
        let tree = &self.line(py)?.tree;
        let place = |target: &Target| tree.nodes()[target.row].position_mm.into();
        Ok(tree.targets().iter().map(|target| (target.name.clone(), place(target))).collect())
    }

    /// The way along its centre line from the root to the target of this name, or to the point nearest to a place in
    /// mm: shape (n, 4), x, y, z and radius in mm, as used by `Controller.follow_path` and `search_ahead`. Where
    /// branches meet again it is the shortest; `via` is the name of a target or a place that it passes instead, such as
    /// "arm 1" in a ring whose shorter arm it would take.
    ///
    /// Raises InputError for an unknown name, for the root itself, for `via` on no such way, and as `centreline`.
    #[pyo3(signature = (to, via = None))]
    fn path<'py>(
        &self,
        py: Python<'py>,
        to: &Bound<'py, PyAny>,
        via: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let way = self.way(py, to, via)?;
        let numbers: Vec<f64> =
            way.points().iter().flat_map(|(p, radius_mm)| [p.x, p.y, p.z, *radius_mm]).collect();
        array(py, numbers, [way.points().len(), 4])
    }

    /// This vessel with the centre line extracted from its lumen between these ends, which determines `centreline`,
    /// `inlet`, `targets` ("opening 3", "place 1") and `branches`. Radii are those of the largest inscribed spheres;
    /// points lie where the sphere is the largest of its cross-section (paths of least ∫ ds/radius: Antiga et al.,
    /// IEEE Transactions on Medical Imaging 22, 2003).
    ///
    /// `start` is the number of an opening, or a place inside in mm; by default the inlet, the lowest of the openings
    /// with at least 0.4 of the widest one's radius. `ends` are openings and places too; by default all other
    /// openings. Openings that cannot be reached are not targets.
    ///
    /// Raises InputError naming `start` or `ends` for an unknown opening, a place outside, and one that cannot be
    /// reached.
    #[pyo3(signature = (start = None, ends = None))]
    fn with_centreline(
        &self,
        py: Python<'_>,
        start: Option<&Bound<'_, PyAny>>,
        ends: Option<List<Bound<'_, PyAny>>>,
    ) -> PyResult<Self> {
        let lumen = self.lumen.clone();
        let from = start.map(|start| end("start", start)).transpose()?;
        let ends = ends.map_or_else(Vec::new, |list| list.0).into_iter().enumerate();
        let to: Vec<CentrelineEnd> =
            ends.map(|(index, one)| end(&format!("ends[{index}]"), &one)).collect::<PyResult<_>>()?;
        let found = interruptible(py, move || ExtractedCentreline::of(lumen.wall(&NoStore)?, from, &to))?;
        let found = found.map_err(|error| exception(as_argument(error)))?;
        let inlet = match from {
            None => self.lumen.inlet().map(|opening| opening.index),
            Some(CentrelineEnd::Opening(opening)) => Some(opening),
            Some(CentrelineEnd::Place(_)) => None,
        };
        Ok(Self::of_line(self.lumen.clone(), Some(Line { tree: found.tree, inlet })))
    }

    /// Closing links of its centre line, where branches meet again: pairs of a row of `centreline`, the last point of an
    /// arm, and the row that it joins. Empty for a vessel without rings.
    ///
    /// Raises InputError as `centreline`.
    #[getter]
    fn links(&self, py: Python<'_>) -> PyResult<Links> {
        Ok(links(&self.line(py)?.tree))
    }

    /// Segments of its centre line between root, forks and ends: dictionaries of from and to (rows of `centreline`),
    /// length_mm, least_radius_mm and, of an arm that joins another branch, joins.
    ///
    /// Raises InputError as `centreline`.
    #[getter]
    fn branches<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        document::write(py, &self.line(py)?.tree.branches())
    }

    /// Whether an instrument can follow the way to a target; the check takes some 10 ms. Returns a dictionary of
    /// `passage` ("passes", "tight", "blocked", "short"), length_mm, taken_mm (length of the instrument along the
    /// least bent path), reaches_mm (how far the tip comes), the points `narrowest` and `sharpest`, and `way`, all
    /// points: arc_mm, position_mm, lumen_radius_mm, device_radius_mm, clearance_mm, bend_radius_mm (of the centre line),
    /// cut_radius_mm (of the least bent path within the clearance), bears_radius_mm (that the instrument takes
    /// without force: bending that costs at most `force_n`); radii of straight stretches are None.
    ///
    /// The way is that of `path`: `to` and `via` are names of targets, or places in mm.
    ///
    /// Raises InputError as `path`, and for a force that is not positive.
    #[pyo3(signature = (instrument, to, force_n = 0.1, via = None))]
    fn passable<'py>(
        &self,
        py: Python<'py>,
        instrument: &Instrument,
        to: &Bound<'py, PyAny>,
        force_n: f64,
        via: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let way = self.way(py, to, via)?;
        let found = py.detach(|| passable(&way, &instrument.device, force_n)).map_err(exception)?;
        document::write(py, &found)
    }

    /// Whether points (mm, shape (n, 3)) are inside: booleans of shape (n,).
    ///
    /// Raises InputError for points that are not finite.
    fn contains<'py>(&self, py: Python<'py>, points_mm: Numbers<'_>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let points = rows("points_mm", &points_mm)?;
        points
            .iter()
            .enumerate()
            .try_for_each(|(row, point)| finite(&format!("points_mm[{row}]"), *point))?;
        let lumen = &self.lumen;
        let inside: endowire_core::Result<Vec<bool>> =
            py.detach(|| points.into_iter().map(|p: [f64; 3]| lumen.contains(&Vec3::from(p))).collect());
        Ok(PyArray1::from_vec(py, inside.map_err(exception)?))
    }

    /// Writes the wall as a surface file, in the format of the extension (stl, obj, ply).
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.wall(py)?.mesh().write(&path).map_err(exception)
    }

    /// A vessel is immutable, so it is its own copy.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Pickled<'py>)> {
        let (py, vessel) = (slf.py(), slf.get());
        let lumen = match &vessel.lumen {
            Lumen::Meshed(_) => {
                let wall = postcard::to_allocvec(vessel.wall(py)?)
                    .map_err(|e| InputError::new_err(format!("the vessel cannot be written: {e}")))?;
                PickledLumen::Wall(PyBytes::new(py, &wall))
            }
            Lumen::Swept(swept) => {
                let (edge_mm, triangles) = match swept.resolution() {
                    Resolution::EdgeMm(edge_mm) => (Some(edge_mm), None),
                    Resolution::Triangles(count) => (None, Some(count)),
                };
                let tree = swept.tree();
                let closed = tree.closed_ends().to_vec();
                PickledLumen::Tree(table(py, tree)?, closed, edge_mm, triangles, links(tree))
            }
        };
        let given = vessel.given.as_ref();
        let targets = given.iter().flat_map(|line| line.tree.targets());
        let targets = targets.map(|target| (target.name.clone(), target.row)).collect();
        let rows = given.map(|line| PyResult::Ok((table(py, &line.tree)?, links(&line.tree)))).transpose()?;
        let parts = (lumen, rows, vessel.inlet(), targets);
        Ok((slf.get_type().getattr("_unpickled")?, parts))
    }

    #[staticmethod]
    fn _unpickled(
        lumen: UnpickledLumen<'_>,
        centreline: Option<(Numbers<'_>, Links)>,
        inlet: Option<usize>,
        targets: List<(String, usize)>,
    ) -> PyResult<Self> {
        let lumen = match lumen {
            UnpickledLumen::Wall(wall) => postcard::from_bytes::<Wall>(&wall)
                .map(Lumen::from)
                .map_err(|e| InputError::new_err(format!("the bytes of a vessel: {e}")))?,
            UnpickledLumen::Tree(table, closed, edge_mm, triangles, links) => {
                let tree = Tree::Table(table).tree()?.with_closed_ends(closed).map_err(exception)?;
                let tree = tree.with_links(linked(links)).map_err(exception)?;
                let resolution = match (edge_mm, triangles) {
                    (Some(edge_mm), _) => Resolution::EdgeMm(edge_mm),
                    (None, count) => Resolution::Triangles(count.unwrap_or_default()),
                };
                SweptVessel::new(tree, resolution).map_err(exception)?.into()
            }
        };
        let targets: Vec<Target> = targets.0.into_iter().map(|(name, row)| Target { name, row }).collect();
        let read = |(table, links)| Tree::Table(table).tree()?.with_links(linked(links)).map_err(exception);
        let tree = centreline.map(read).transpose()?;
        let tree = tree.map(|tree| tree.with_targets(targets)).transpose().map_err(exception)?;
        let line = tree.map(|tree| Line { tree, inlet });
        Ok(Self { begins: inlet.unwrap_or(0), ..Self::of_line(lumen, line) })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let made_of = match &self.lumen {
            Lumen::Meshed(_) => format!("{} triangles", self.wall(py)?.mesh().triangles.len()),
            Lumen::Swept(swept) => format!("{} points of a centre line", swept.tree().nodes().len()),
        };
        Ok(format!("<endowire.Vessel: {made_of}, {} openings>", self.lumen.openings().len()))
    }
}

impl Vessel {
    /// The vessel of a surface.
    pub(crate) fn of_wall(wall: Wall) -> Self {
        Self::of_line(wall.into(), None)
    }

    /// The vessel of a scene.
    pub(crate) fn of_scene(scene: &Scene) -> endowire_core::Result<Self> {
        let lumen = scene.lumen(&NoStore)?;
        let begins = scene.sheath.opening.unwrap_or(0);
        if scene.vessel.tree.is_none() && scene.vessel.centreline.is_none() {
            return Ok(Self { begins, ..Self::of_line(lumen, None) });
        }
        let tree = scene.centreline(&NoStore)?.clone();
        let root_mm = tree.nodes()[0].position_mm;
        let at_root = |opening: &&Opening| (opening.centre_mm - root_mm).norm() < opening.radius_mm;
        let inlet = lumen.openings().iter().find(at_root).map(|opening| opening.index);
        Ok(Self::of_line(lumen, Some(Line { tree, inlet })))
    }

    /// The vessel of a centre-line tree.
    fn swept(tree: CentrelineTree, resolution: Resolution) -> endowire_core::Result<Self> {
        let vessel = SweptVessel::new(tree, resolution)?;
        let line = Line { tree: vessel.tree().clone(), inlet: Some(vessel.inlet()) };
        Ok(Self::of_line(vessel.into(), Some(line)))
    }

    fn of_line(lumen: Lumen, given: Option<Line>) -> Self {
        Self { lumen, given, found: OnceLock::new(), begins: 0 }
    }

    /// Its wall as triangles, generated if necessary.
    pub(crate) fn wall(&self, py: Python<'_>) -> PyResult<&Wall> {
        let lumen = self.lumen.clone();
        interruptible(py, move || lumen.wall(&NoStore).map(|_| ()))?.map_err(exception)?;
        self.lumen.wall(&NoStore).map_err(exception)
    }

    /// Its centre line, extracted if necessary.
    fn line(&self, py: Python<'_>) -> PyResult<&Line> {
        if let Some(line) = self.given.as_ref().or(self.found.get()) {
            return Ok(line);
        }
        let (lumen, inlet) = (self.lumen.clone(), self.inlet());
        let from = inlet.map(CentrelineEnd::Opening);
        let found = interruptible(py, move || ExtractedCentreline::of(lumen.wall(&NoStore)?, from, &[]))?;
        let found = found.map_err(|error| {
            let remedy = format!("none is found in the vessel ({error}): take vessel.with_centreline(start, ends), of openings or places inside");
            refuse("centreline", "None", &remedy)
        })?;
        Ok(self.found.get_or_init(|| Line { tree: found.tree, inlet }))
    }

    /// Its centre line for contrast medium in pictures.
    pub(crate) fn tree(&self, py: Python<'_>) -> PyResult<&CentrelineTree> {
        self.line(py).map(|line| &line.tree)
    }

    /// The way along its centre line.
    fn way(
        &self,
        py: Python<'_>,
        to: &Bound<'_, PyAny>,
        via: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<CentrelinePath> {
        let tree = self.tree(py)?;
        if let Some(via) = via {
            let place = |key: &str, goal: &Bound<'_, PyAny>| match Goal::of(key, goal)? {
                Goal::Name(name) => {
                    PyResult::Ok(tree.nodes()[tree.target(&name).map_err(exception)?.row].position_mm)
                }
                Goal::Place(place) => Ok(place.into()),
            };
            return tree.path_via(&place("via", via)?, &place("to", to)?).map_err(exception);
        }
        let way = match Goal::of("to", to)? {
            Goal::Name(name) => tree.path_to(tree.target(&name).map_err(exception)?.row),
            Goal::Place(place) => tree.path_to_place(&place.into()),
        };
        match way {
            Some(way) => Ok(way),
            None => Err(refuse("to", to.repr()?, "is at the root of the centre line, where the way begins")),
        }
    }
}

/// The closing links of a tree.
fn links(tree: &CentrelineTree) -> Links {
    tree.links().iter().map(|link| (link.row, link.joins)).collect()
}

/// The same when read.
fn linked(links: Links) -> Vec<CentrelineLink> {
    links.into_iter().map(|(row, joins)| CentrelineLink { row, joins }).collect()
}

/// The rows of a tree; the parent of the root is -1.
fn table<'py>(py: Python<'py>, tree: &CentrelineTree) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let row = |node: &CentrelineNode| {
        let (p, parent) = (node.position_mm, node.parent.map_or(-1.0, |row| row as f64));
        [p.x, p.y, p.z, node.radius_mm, parent]
    };
    let numbers: Vec<f64> = tree.nodes().iter().flat_map(row).collect();
    array(py, numbers, [tree.nodes().len(), 5])
}

impl<'py> Tree<'py> {
    fn of(object: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(path) = object.extract::<PathBuf>() {
            return Ok(Self::Path(path));
        }
        object.extract::<Numbers<'py>>().map(Self::Table)
    }

    fn tree(&self) -> PyResult<CentrelineTree> {
        match self {
            Self::Path(path) => match built_in(path) {
                Some(tree) => Ok(tree),
                None => CentrelineTree::read(path).map_err(|error| unknown(path, error)),
            },
            Self::Table(table) => {
                let nodes = rows::<5>("tree", table)?
                    .into_iter()
                    .enumerate()
                    .map(|(row, [x, y, z, radius_mm, parent])| {
                        let parent = match parent {
                            -1.0 => None,
                            row if row >= 0.0 && row.fract() == 0.0 => Some(row as usize),
                            _ => {
                                let name = format!("tree[{row}][4]");
                                return Err(refuse(&name, parent, "must be the row of the parent, or -1"));
                            }
                        };
                        Ok(CentrelineNode { position_mm: Vec3::new(x, y, z), radius_mm, parent })
                    })
                    .collect::<PyResult<_>>()?;
                CentrelineTree::new(nodes).map_err(exception)
            }
        }
    }
}

/// The built-in anatomy of this name, unless a file has the same name.
fn built_in(path: &Path) -> Option<CentrelineTree> {
    path.to_str().filter(|_| !path.exists()).and_then(anatomy::tree)
}

/// The error for a table that cannot be read: where a name has no folder and no extension, it was meant for a built-in
/// anatomy.
fn unknown(path: &Path, error: Error) -> PyErr {
    let name = path.to_str().filter(|name| !path.exists() && Path::new(name).extension().is_none());
    let Some(name) = name.filter(|name| !name.contains(std::path::is_separator)) else {
        return exception(error);
    };
    let known = anatomy::NAMES.map(|known| format!("`{known}`")).join(", ");
    let hint = nearest(&format!("unknown name `{name}`, expected one of {known}"));
    let remedy =
        format!("is no file, and no built-in anatomy: those are {}{hint}", anatomy::NAMES.join(", "));
    refuse("tree", format!("{name:?}"), &remedy)
}

/// Warns as `warnings.warn` does, at the line of the caller.
pub(crate) fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
}

/// Units and axes of a surface file.
fn repair_options(repair: &str, keep_open_mm: Option<&Numbers<'_>>) -> PyResult<RepairOptions> {
    let mode = repair.parse().map_err(exception)?;
    let places = keep_open_mm.map(|places| rows("keep_open_mm", places)).transpose()?.unwrap_or_default();
    Ok(RepairOptions { mode, keep_open_mm: places.into_iter().map(Vec3::from).collect() })
}

fn frame(unit_mm: f64, axes: Option<&str>) -> PyResult<SurfaceFrame> {
    let axes = axes.map(str::parse).transpose().map_err(exception)?;
    Ok(SurfaceFrame { unit_mm, axes })
}

/// Checks a surface file as `endowire vessel check` does; returns a dictionary of the findings, with `sound`, `faults`, and lines on what
/// is `repaired` on loading, what is `kept`, and what `needs_you`.
/// Arguments are as in `Vessel.read`: with `repair="none"` the surface is taken as it is, and `keep_open_mm` are places
/// of holes that are meant. Septa thinner than `septum_mm` are counted.
///
/// Raises InputError for a file that cannot be read or is not usable as a wall.
#[pyfunction]
#[pyo3(signature = (path, unit_mm = 1.0, septum_mm = 1.0, axes = None, repair = "all", keep_open_mm = None))]
pub(crate) fn check_vessel<'py>(
    py: Python<'py>,
    path: PathBuf,
    unit_mm: f64,
    septum_mm: f64,
    axes: Option<&str>,
    repair: &str,
    keep_open_mm: Option<Numbers<'_>>,
) -> PyResult<Bound<'py, PyAny>> {
    let frame = frame(unit_mm, axes)?;
    let options = repair_options(repair, keep_open_mm.as_ref())?;
    let report = interruptible(py, move || {
        check_repaired(&SurfaceMesh::read(&path, frame)?, unit_mm, septum_mm, &options)
    })?
    .map_err(exception)?;
    let reported = document::write(py, &report)?;
    reported.set_item("sound", report.is_sound())?;
    reported.set_item("faults", report.faults())?;
    reported.set_item("repaired", report.repair.repaired())?;
    reported.set_item("kept", report.repair.kept())?;
    reported.set_item("needs_you", report.needs_you())?;
    Ok(reported)
}

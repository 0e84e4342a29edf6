//! A scene file, and building a simulation from it.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use serde::Deserialize;
use serde::de::{DeserializeOwned, IgnoredAny};

use super::method_table;
use super::tables::{DEPTH_MM, DeviceSpec, InstrumentSpec, SheathSpec, VesselSpec};
use crate::device::{Device, DeviceFile, FileTable, Instrument, Stack, line_mm};
use crate::field::FieldSpec;
use crate::file::{FileSystem, Files};
use crate::input::{from_toml_of, parse_toml};
use crate::insertion::{Command, Move, Script, ScriptLine, Sheath, Simulation, script_commands};
use crate::methods::{MethodChoice, OwnMethod};
use crate::vessel::{
    CentrelineTree, Lumen, NoStore, Opening, SurfaceMesh, SweptVessel, VesselMotion, Wall, WallRecipe,
    WallStore, anatomy, wall_hints,
};
use crate::{Error, Result};

/// A scene whose `[method]` is one of this crate's: the exact rod.
///
/// ```
/// # #[cfg(feature = "scene-files")] {
/// use endowire_core::{NoStore, Scene};
///
/// let text = r#"
///     vessel.tree = "curved_tube.csv"
///     sheath.opening = 0
///     [device]
///     section = [{ length_mm = 300.0, radius_mm = 0.45, bending_stiffness_nmm2 = 10.0 }]
/// "#;
/// // A file of this text beside the vessel's; `Scene::read` reads it from disk.
/// let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/vessels/scene.toml");
/// let mut simulation = Scene::from_toml(text, path.as_ref())?.simulation(&NoStore)?;
/// simulation.step(endowire_core::Command::advance(5.0))?;
/// assert_eq!(simulation.report().inserted_mm, 5.0);
/// # }
/// # Ok::<(), endowire_core::Error>(())
/// ```
pub type Scene = SceneOf<OwnMethod>;

/// The contents of a scene file, with the folder to which its paths are relative. `M` is the type of its `[method]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "M: MethodChoice + Deserialize<'de> + Default"))]
pub struct SceneOf<M> {
    /// Name of the scene; the file's stem if absent.
    #[serde(default)]
    pub name: String,
    /// Seed of all random numbers of the scene.
    #[serde(default)]
    pub seed: u64,
    /// The vessel.
    pub vessel: VesselSpec,
    /// The device, if it is a single one.
    pub device: Option<DeviceSpec>,
    /// The coaxial instruments, if there are several, the innermost first.
    #[serde(default)]
    pub instrument: Vec<InstrumentSpec>,
    /// Where the device enters.
    pub sheath: SheathSpec,
    /// The method for its equilibria.
    #[serde(default, deserialize_with = "method_table::read")]
    pub method: M,
    /// Fields that the device is in from the start.
    #[serde(default)]
    pub field: Vec<FieldSpec>,
    /// What the hand does.
    #[serde(default)]
    pub script: Vec<ScriptLine>,
    /// Read by the viewer.
    #[serde(default, rename = "view")]
    _view: IgnoredAny,
    /// The file of the script, if not the scene's.
    #[serde(skip)]
    script_file: Option<PathBuf>,
    #[serde(skip)]
    path: PathBuf,
    #[serde(skip)]
    folder: PathBuf,
    #[serde(skip)]
    text: String,
    /// Access to the files that it names.
    #[serde(skip, default = "of_file_system")]
    pub(super) files: Arc<dyn Files>,
    /// The vessel's centre line, once needed.
    #[serde(skip)]
    pub(super) centreline: OnceLock<CentrelineTree>,
    /// What was repaired on its surface, once read.
    #[serde(skip)]
    repair_notes: OnceLock<Vec<String>>,
}

fn of_file_system() -> Arc<dyn Files> {
    Arc::new(FileSystem)
}

/// A file of `[[script]]` tables alone.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScriptFile {
    #[serde(default)]
    script: Vec<ScriptLine>,
}

/// Increment in which initially inserted instruments are pushed in together, of the farthest, mm.
const START_MM: f64 = 1.0;

/// An error of a device given in a table of the scene.
fn in_table(table: &str, error: Error) -> Error {
    match error {
        Error::Parameter { name, value, remedy } => {
            let name = match ["device.", "magnet.", "weight."].iter().find_map(|own| name.strip_prefix(own)) {
                Some(key) => format!("{table}.{key}"),
                None => format!("{table}.{name}"),
            };
            Error::Parameter { name, value, remedy }
        }
        other => other,
    }
}

/// The error for an unreadable file, prefixed by the key that names it.
pub(super) fn missing(key: &str, error: Error) -> Error {
    match error {
        Error::File { path, source } => Error::parameter(key, path.display(), source.to_string()),
        other => other,
    }
}

/// The error for an unreadable tree, with a hint if a built-in vessel is meant.
pub(super) fn missing_tree(path: &Path, error: Error) -> Error {
    let name = path.file_name().and_then(|name| name.to_str()).filter(|name| anatomy::NAMES.contains(name));
    match (missing("vessel.tree", error), name) {
        (Error::Parameter { name: key, value, remedy }, Some(name)) => {
            let remedy = format!(
                "{remedy}; a scene names a table: `endowire new DIR --vessel {name}` writes that of the built-in vessel"
            );
            Error::Parameter { name: key, value, remedy }
        }
        (error, _) => error,
    }
}

/// Recordings get a folder with the scene's name, so it must be a valid file name.
fn check_name(name: &str) -> Result<()> {
    let odd = |c: char| c.is_control() || matches!(c, '/' | '\\' | ':');
    if name.chars().any(odd) || matches!(name, "." | "..") {
        return Err(Error::parameter(
            "name",
            format!("{name:?}"),
            "names a folder: no slashes, colons, line breaks or dots alone",
        ));
    }
    Ok(())
}

impl<M: MethodChoice + DeserializeOwned + Default> SceneOf<M> {
    /// Reads a scene file.
    ///
    /// # Errors
    /// Names file, line and key of the error.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_of(of_file_system(), path)
    }

    /// As [`Self::read`], for a scene in `files`, with the files that it names.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_of(files: Arc<dyn Files>, path: &Path) -> Result<Self> {
        let (scene, text): (Self, String) = from_toml_of(&*files, path)?;
        Self { files, ..scene }.of_file(text, path)
    }

    /// Reads a scene from the text of a file, to whose folder its paths are relative; errors name it `path`.
    ///
    /// # Errors
    /// As [`Self::read`], except those of reading the file.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self> {
        parse_toml::<Self>(text, path)?.of_file(text.to_owned(), path)
    }

    /// The same scene, with its files read from `files`.
    #[must_use]
    pub fn with_files(self, files: Arc<dyn Files>) -> Self {
        Self { files, ..self }
    }

    fn of_file(mut self, text: String, path: &Path) -> Result<Self> {
        self.path = path.to_path_buf();
        self.folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        self.text = text;
        if self.name.is_empty() {
            self.name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        }
        check_name(&self.name).map_err(|e| Error::content(path, e.to_string()))?;
        Ok(self)
    }

    /// Replaces the scene's script by that of a file with `[[script]]` tables.
    ///
    /// # Errors
    /// Names file, line and key of the error.
    pub fn take_script(&mut self, path: &Path) -> Result<()> {
        (self.script, self.script_file) = (self.read_script(path)?, Some(path.to_owned()));
        Ok(())
    }

    /// The lines of a file with `[[script]]` tables, which replace nothing.
    ///
    /// # Errors
    /// As [`SceneOf::take_script`].
    pub fn read_script(&self, path: &Path) -> Result<Vec<ScriptLine>> {
        let (file, _): (ScriptFile, String) = from_toml_of(&*self.files, path)?;
        Ok(file.script)
    }

    /// The text the scene was read from.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// A path of the scene, relative to the working directory.
    pub fn resolve(&self, path: &Path) -> PathBuf {
        self.folder.join(path)
    }

    /// The file of the vessel.
    ///
    /// # Errors
    /// Neither or both of `vessel.file` and `vessel.tree`.
    pub(crate) fn vessel_path(&self) -> Result<PathBuf> {
        match (&self.vessel.file, &self.vessel.tree) {
            (Some(path), None) | (None, Some(path)) => Ok(self.resolve(path)),
            (None, None) => Err(Error::parameter("vessel", "{}", "give vessel.file or vessel.tree")),
            (Some(path), Some(_)) => Err(Error::parameter(
                "vessel.file",
                path.display(),
                "vessel.tree is given too: keep one of the two",
            )),
        }
    }

    /// The files that the scene names, in the order of its tables, including that of a replaced script: with
    /// [`SceneOf::text`] its complete input.
    pub fn input_paths(&self) -> Vec<PathBuf> {
        let devices = self.device.iter().map(|device| &device.file);
        let devices = devices.chain(self.instrument.iter().map(|instrument| &instrument.file));
        let vessel = &self.vessel;
        let named = [&vessel.file, &vessel.tree, &vessel.centreline].into_iter().chain(devices);
        named.flatten().map(|path| self.resolve(path)).chain(self.script_file.clone()).collect()
    }

    /// The wall of the vessel as triangles, read, built, or from `store` ([`NoStore`](crate::vessel::NoStore) stores
    /// nothing).
    ///
    /// # Errors
    /// As [`SceneOf::lumen`], and a centre line that cannot be meshed.
    pub fn wall(&self, store: &dyn WallStore) -> Result<Wall> {
        self.lumen(store)?.into_wall(store).map_err(|error| self.of_tree(error))
    }

    /// The vessel: a surface that is read or stored in `store`, or a centre line, which is meshed only if needed.
    ///
    /// # Errors
    /// A missing or unusable file, inconsistent options, an unusable wall.
    pub fn lumen(&self, store: &dyn WallStore) -> Result<Lumen> {
        let path = self.vessel_path()?;
        let spec = &self.vessel;
        if spec.tree.is_some() {
            let remedy = "only with vessel.file: a tree is in millimetres, in the axes of the scene";
            if let Some(unit_mm) = spec.unit_mm {
                return Err(Error::parameter("vessel.unit_mm", unit_mm, remedy));
            }
            if let Some(axes) = spec.axes {
                return Err(Error::parameter("vessel.axes", axes.name(), remedy));
            }
            let remedy = "only with vessel.file: a tree is not repaired";
            if let Some(mode) = spec.repair {
                return Err(Error::parameter("vessel.repair", format!("{mode:?}").to_lowercase(), remedy));
            }
            if let Some(place) = spec.keep_open_mm.first() {
                return Err(Error::parameter("vessel.keep_open_mm", format!("{place:?}"), remedy));
            }
            self.centreline_path()?;
            let tree = CentrelineTree::read_of(&*self.files, &path).map_err(|e| missing_tree(&path, e))?;
            let resolution = spec.resolution(&tree)?;
            let vessel = SweptVessel::new(tree, resolution).map_err(|error| self.of_tree(error))?;
            return Ok(vessel.into());
        }
        for (name, given) in [
            ("vessel.edge_mm", spec.edge_mm.map(|v| v.to_string())),
            ("vessel.triangles", spec.triangles.map(|v| v.to_string())),
        ] {
            if let Some(value) = given {
                return Err(Error::parameter(name, value, "only with vessel.tree: a file has its own mesh"));
            }
        }
        let surface =
            SurfaceMesh::read_of(&*self.files, &path, spec.frame()).map_err(|error| match error {
                Error::Parameter { name, value, remedy } => {
                    Error::Parameter { name: format!("vessel.{name}"), value, remedy }
                }
                other => missing("vessel.file", other),
            })?;
        let recipe = WallRecipe::Repaired { surface: &surface, options: &spec.repair_options() };
        let wall = store.wall(&recipe).map_err(|error| match error {
            Error::Parameter { name, value, remedy } if name == "keep_open_mm" => {
                Error::Parameter { name: format!("vessel.{name}"), value, remedy }
            }
            other => Error::content(&path, other.to_string()),
        })?;
        let _ = self.repair_notes.set(wall.report().repair_notes());
        Ok(wall.into())
    }

    /// What was repaired on its surface and what in its lumen was taken as a wall, a sentence each, once the surface was
    /// read; none for a vessel from a tree.
    pub fn repair_notes(&self) -> &[String] {
        self.repair_notes.get().map_or(&[], Vec::as_slice)
    }

    /// Attributes an error of a vessel from a tree to the tree's file.
    fn of_tree(&self, error: Error) -> Error {
        let Some(path) = self.vessel.tree.as_ref().map(|path| self.resolve(path)) else { return error };
        match error {
            Error::Parameter { name, value, remedy } if name == "edge_mm" || name == "triangles" => {
                Error::parameter(format!("vessel.{name}"), value, format!("{}: {remedy}", path.display()))
            }
            other => Error::content(&path, other.to_string()),
        }
    }

    /// The device of a scene with a single one.
    ///
    /// # Errors
    /// A missing or unusable file, values out of range, several instruments.
    pub fn device(&self) -> Result<Device> {
        match self.stack()? {
            stack if stack.is_several() => {
                let remedy =
                    "the scene has several instruments, and one device is asked for: leave one [device]";
                Err(Error::parameter("instrument", stack.instruments().len(), remedy))
            }
            stack => Ok(stack.first().clone()),
        }
    }

    /// The single device, or all instruments.
    ///
    /// # Errors
    /// Missing or unusable files, values out of range, `[device]` and `[[instrument]]` together or neither, `may_lead` of the first, and as [`Stack::new`], [`Stack::with_friction`],
    /// [`Stack::sealed`] and [`Stack::with_clearance`].
    pub fn stack(&self) -> Result<Stack> {
        match (&self.device, self.instrument.is_empty()) {
            (Some(spec), true) => {
                self.read_device("device", spec.file.as_deref(), spec.tables()).map(Stack::from)
            }
            (None, false) => {
                if let Some(may_lead) = self.instrument.first().and_then(|first| first.may_lead) {
                    let remedy = "nothing lies in the first instrument, which it could lead: leave it out";
                    return Err(Error::parameter("instrument[0].may_lead", may_lead, remedy));
                }
                let each = self.instrument.iter().enumerate().map(|(index, spec)| {
                    let name = format!("instrument[{index}]");
                    let device = self.read_device(&name, spec.file.as_deref(), spec.tables())?;
                    Ok(Instrument {
                        name: spec.name.clone(),
                        device,
                        may_lead: spec.may_lead.unwrap_or(true),
                    })
                });
                let frictions = self.instrument.iter().map(|spec| spec.friction).collect();
                let valves_n = self.instrument.iter().map(|spec| spec.valve_n).collect();
                let plays = self.instrument.iter().map(|spec| spec.clearance).collect();
                let stack = Stack::new(each.collect::<Result<_>>()?)?.with_friction(frictions)?;
                stack.sealed(valves_n)?.with_clearance(plays)
            }
            (None, true) => {
                let remedy = "give [device], or an [[instrument]] for each of several, the innermost first";
                Err(Error::parameter("device", "{}", remedy))
            }
            (Some(_), false) => {
                let remedy = "[device] is given too: keep one of the two";
                Err(Error::parameter("instrument", self.instrument.len(), remedy))
            }
        }
    }

    /// Initial inserted lengths of the instruments, mm.
    ///
    /// # Errors
    /// A length greater than the instrument's, and instruments that cannot be inserted together by these lengths.
    pub(crate) fn inserted_mm(&self, stack: &Stack) -> Result<Vec<f64>> {
        let mut lengths_mm = vec![0.0; stack.instruments().len()];
        for (index, (spec, device)) in self.instrument.iter().zip(stack.devices()).enumerate() {
            if !(0.0..=device.length_mm()).contains(&spec.inserted_mm) {
                let remedy = format!("must be 0 to its length, {} mm", device.length_mm());
                return Err(Error::parameter(
                    format!("instrument[{index}].inserted_mm"),
                    spec.inserted_mm,
                    remedy,
                ));
            }
            lengths_mm[index] = spec.inserted_mm;
        }
        stack.check_places(lengths_mm.iter().copied())?;
        Ok(lengths_mm)
    }

    /// The device files with their paths, parts, materials and sources, of the device or of each instrument, if the
    /// scene names them; parts given in the scene form a file with the scene's path.
    ///
    /// # Errors
    /// A missing or unusable file, values out of range, sections or parts also given in the scene.
    pub fn device_files(&self) -> Result<Vec<Option<(PathBuf, DeviceFile)>>> {
        let device = self.device.iter().map(|spec| ("device".to_owned(), &spec.file, spec.tables()));
        let each = self.instrument.iter().enumerate();
        let each = each.map(|(index, spec)| (format!("instrument[{index}]"), &spec.file, spec.tables()));
        let all = device.chain(each);
        all.map(|(name, file, tables)| self.read_file(&name, file.as_deref(), tables)).collect()
    }

    /// A device of the scene, by its table's name.
    fn read_device(&self, name: &str, file: Option<&Path>, tables: FileTable) -> Result<Device> {
        let sections = tables.section.clone();
        match self.read_file(name, file, tables)? {
            Some((_, file)) => Ok(file.device),
            None => Device::new(sections).map_err(|error| in_table(name, error)),
        }
    }

    /// The device file that a table names or contains; `None` if it has only sections.
    fn read_file(
        &self,
        name: &str,
        file: Option<&Path>,
        tables: FileTable,
    ) -> Result<Option<(PathBuf, DeviceFile)>> {
        let given = tables.given();
        let Some(file) = file else {
            if given.is_none() {
                return Ok(None);
            }
            let named = if tables.name.is_empty() { name.to_owned() } else { tables.name.clone() };
            let resolved = FileTable { name: named, ..tables }.resolve();
            return resolved
                .map(|file| Some((self.path.clone(), file)))
                .map_err(|error| in_table(name, error));
        };
        let key = format!("{name}.file");
        if let Some(given) = given.or((!tables.section.is_empty()).then_some("section")) {
            let remedy = format!("{name}.{given} is given too: keep one of the two");
            return Err(Error::parameter(key, file.display(), remedy));
        }
        let path = self.resolve(file);
        match DeviceFile::read_of(&*self.files, &path) {
            Ok(file) => Ok(Some((path, file))),
            Err(error) => Err(missing(&key, error)),
        }
    }

    /// The sheath in the vessel.
    ///
    /// # Errors
    /// A nonexistent opening, contradictory keys, values that are not finite.
    pub fn sheath(&self, vessel: &impl AsRef<[Opening]>) -> Result<Sheath> {
        self.sheath.place(vessel)
    }

    /// The commands of the script of a single device, checked against it.
    ///
    /// # Errors
    /// A line that is not finite, contradictory, absurd, or moves the device beyond its ends.
    pub fn commands(&self, device: &Device) -> Result<Vec<Command>> {
        script_commands(&self.script, device)
    }

    /// The script, checked against the instruments, the method and the targets of the vessel. If a line has a target and
    /// the scene has no centre line, it is computed, and stored in `store`.
    ///
    /// # Errors
    /// As [`Script::new`], `SceneOf::inserted_mm`, [`SceneOf::centreline`] and, if a coil is detached,
    /// [`MethodChoice::check_detach`].
    pub fn steps(&self, stack: &Stack, store: &dyn WallStore) -> Result<Script> {
        self.steps_of(&self.script, stack, store)
    }

    /// The script of other lines than the scene's, in this scene.
    ///
    /// # Errors
    /// As [`SceneOf::steps`].
    pub fn steps_of(&self, lines: &[ScriptLine], stack: &Stack, store: &dyn WallStore) -> Result<Script> {
        // Do not open a file unnecessarily.
        let centreline = match lines.iter().any(ScriptLine::has_target) {
            true => Some(self.centreline(store)?),
            false => None,
        };
        let script = Script::new(lines, stack, &self.inserted_mm(stack)?, centreline)?;
        if let Some(line) = script.detaches() {
            let hint = format!("a coil is left behind by {line}.detach");
            self.method.check_detach().map_err(|error| with_hint(error, &hint))?;
        }
        if script.injects() && self.device.as_ref().is_some_and(|device| device.file.is_some()) {
            // Sections in the scene may give the lumen for rendering only; a file describes a device completely.
            let solid = |device: &Device| device.sections().iter().all(|s| s.inner_radius_mm.is_none());
            if stack.devices().all(solid) {
                let remedy = "its device has no lumen: medium comes through a catheter, not along a wire";
                return Err(Error::parameter("script.inject", "given", remedy));
            }
        }
        let moves = VesselMotion::new(&self.vessel.motion)?.is_some_and(|motion| motion.changes());
        if moves && !script.is_empty() && !script.is_timed() {
            let remedy = "no time goes by in the script: give its lines speeds (speed_mm_per_s, speed_deg_per_s), or wait_s";
            return Err(Error::parameter(
                "vessel.motion",
                format!("{} given", self.vessel.motion.len()),
                remedy,
            ));
        }
        Ok(script)
    }

    /// The simulation at the start, with walls from `store`: only the initial lengths of instruments are inserted.
    ///
    /// # Errors
    /// As [`SceneOf::wall`], [`SceneOf::stack`], [`SceneOf::sheath`], `SceneOf::inserted_mm`, [`Simulation::step_together`] and [`SimulationBuilder::build`](crate::insertion::SimulationBuilder::build).
    pub fn simulation(&self, store: &dyn WallStore) -> Result<Simulation> {
        let lumen = self.lumen(store)?;
        let hints = |error| match &error {
            // An absurd size of the vessel is the likeliest cause of any error.
            Error::Parameter { .. } | Error::Content { .. } => {
                let reported = self.lumen(store).and_then(|lumen| self.hints(&lumen)).unwrap_or_default();
                reported.iter().fold(error, |error, hint| with_hint(error, hint))
            }
            _ => error,
        };
        self.simulation_in(lumen, store).map_err(hints)
    }

    /// Hints for the user about the wall of a surface file, one sentence each, as
    /// [`wall_hints`](crate::vessel::wall_hints); none for a wall from a tree.
    ///
    /// # Errors
    /// As [`Lumen::wall`].
    pub fn hints(&self, lumen: &Lumen) -> Result<Vec<String>> {
        match lumen {
            Lumen::Meshed(_) => Ok(wall_hints(lumen.wall(&NoStore)?, self.vessel.frame().unit_mm)),
            Lumen::Swept(_) => Ok(Vec::new()),
        }
    }

    /// [`SceneOf::simulation`] in a given vessel: for example its mesh instead of its centre line, or one that
    /// several scenes share.
    ///
    /// # Errors
    /// As [`SceneOf::simulation`].
    pub fn simulation_in(&self, lumen: Lumen, store: &dyn WallStore) -> Result<Simulation> {
        let sheath = self.sheath(&lumen)?;
        let stack = self.stack()?;
        let inserted_mm = self.inserted_mm(&stack)?;
        let mut simulation = self.built(lumen, stack, sheath, store)?;
        let fields =
            self.field.iter().enumerate().map(|(index, spec)| {
                spec.field().map_err(|error| in_table(&format!("field[{index}]"), error))
            });
        simulation.set_fields(fields.collect::<Result<Vec<_>>>()?)?;
        push_in(&mut simulation, &inserted_mm)?;
        Ok(simulation)
    }

    fn built(&self, lumen: Lumen, stack: Stack, sheath: Sheath, store: &dyn WallStore) -> Result<Simulation> {
        let (course, flow) = (self.course(&lumen, store)?, self.flow(&lumen, store)?);
        Simulation::builder(lumen, stack, sheath)
            .properties(self.vessel.wall.clone())
            .motion(VesselMotion::new(&self.vessel.motion)?)
            .course(course)
            .flow(flow)
            .method(&self.method)
            .store(store)
            .build()
            .map_err(|error| match error {
                // Attributes an error of a surface to its file.
                Error::Mesh(reason) => {
                    self.vessel_path().map_or_else(|e| e, |path| Error::content(&path, reason))
                }
                // The position follows from an opening: what can be changed is the depth.
                Error::Parameter { name, value, remedy } if name == "sheath.position_mm" => {
                    match self.sheath.opening {
                        Some(_) => Error::parameter(
                            "sheath.depth_mm",
                            self.sheath.depth_mm.unwrap_or(DEPTH_MM),
                            format!("the mouth at {value} {remedy}"),
                        ),
                        None => Error::Parameter { name, value, remedy },
                    }
                }
                other => other,
            })
    }
}

/// An error about input with a hint appended to its correction.
fn with_hint(error: Error, hint: &str) -> Error {
    match error {
        Error::Parameter { name, value, remedy } => {
            Error::Parameter { name, value, remedy: format!("{remedy}; {hint}") }
        }
        Error::Content { path, reason } => Error::Content { path, reason: format!("{reason}; {hint}") },
        other => other,
    }
}

/// Pushes in these lengths together, from nothing inserted.
fn push_in(simulation: &mut Simulation, lengths_mm: &[f64]) -> Result<()> {
    let steps = (line_mm(lengths_mm.iter().copied()) / START_MM).ceil();
    let part = |(instrument, mm): (usize, &f64)| Move { instrument, command: Command::advance(mm / steps) };
    let moves: Vec<Move> = lengths_mm.iter().enumerate().filter(|(_, mm)| **mm > 0.0).map(part).collect();
    for _ in 0..steps as usize {
        simulation.step_together(&moves)?;
    }
    Ok(())
}

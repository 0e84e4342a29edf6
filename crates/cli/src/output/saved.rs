//! Saved states of runs, from which a run can resume.
//!
//! The first line names the format, a line of JSON identifies what the state belongs to, and the state follows in a
//! binary format that keeps every bit of a number. The file ends with a hash of all this, which reveals incomplete
//! files.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use endowire_core::insertion::{Script, ScriptCourse, ScriptRun, Simulation, State, Step, Tally};
use endowire_core::vessel::{Lumen, NoStore, Sac, Wall};
use endowire_methods::Scene;
use endowire_recording::{InjectionRow, seal};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::whole;
use crate::failure::Failure;

/// First line of a saved state, and its beginning in every version.
const FORMAT: &str = "endowire state 24";
const ANY_FORMAT: &str = "endowire state ";

/// Hashes of everything that the steps up to a state depended on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Parts {
    vessel: String,
    motion: String,
    flow: String,
    wall: String,
    sac: String,
    field: String,
    device: String,
    sheath: String,
    method: String,
}

/// Hash of the triangles or the centre line of a vessel.
fn vessel(lumen: &Lumen) -> String {
    if let Lumen::Swept(vessel) = lumen {
        return hash(serde_json::to_vec(&(vessel.tree(), vessel.resolution())).unwrap_or_default());
    }
    let mesh = lumen.wall(&NoStore).map(Wall::mesh).ok();
    let vertices = mesh.iter().flat_map(|mesh| &mesh.vertices_mm);
    let numbers = vertices.flat_map(|v| v.iter().flat_map(|c| c.to_le_bytes()));
    let indices = mesh.iter().flat_map(|mesh| mesh.triangles.iter().flatten());
    hash(numbers.chain(indices.flat_map(|index| index.to_le_bytes())).collect())
}

impl Parts {
    /// The hashes for a simulation of `scene`, whose packing is recorded in this sac.
    fn new(scene: &Scene, simulation: &Simulation, sac: Option<&Sac>) -> Self {
        let json = |value: Result<Vec<u8>, serde_json::Error>| hash(value.unwrap_or_default());
        // Without flow, results do not depend on a centre line.
        let tree = scene.vessel.flow.as_ref().and_then(|_| scene.centreline(&NoStore).ok());
        let sheath = simulation.sheath();
        let place = sheath.position_mm.iter().chain(&sheath.direction);
        let roll = sheath.bends_towards.iter().flatten();
        let sheath = place.chain([&sheath.friction_n, &sheath.friction]).chain(roll);
        Self {
            vessel: vessel(simulation.lumen()),
            motion: json(serde_json::to_vec(&scene.vessel.motion)),
            flow: json(serde_json::to_vec(&(&scene.vessel.flow, tree))),
            wall: json(serde_json::to_vec(&scene.vessel.wall)),
            sac: json(serde_json::to_vec(&sac)),
            field: json(serde_json::to_vec(&scene.field)),
            device: json(pushed(scene, simulation)),
            sheath: hash(sheath.flat_map(|c| c.to_le_bytes()).collect()),
            method: json(serde_json::to_vec(&scene.method)),
        }
    }

    /// The parts that differ from `other`, in words.
    fn differing(&self, other: &Self) -> Vec<&'static str> {
        let pairs = [
            ("the vessel", &self.vessel, &other.vessel),
            ("how it moves (vessel.motion)", &self.motion, &other.motion),
            ("what flows in it (vessel.flow)", &self.flow, &other.flow),
            ("the properties of its wall (vessel.wall)", &self.wall, &other.wall),
            ("the sac that coils fill (vessel.sac)", &self.sac, &other.sac),
            ("the fields that act on the device (field)", &self.field, &other.field),
            ("the device", &self.device, &other.device),
            ("the sheath", &self.sheath, &other.sheath),
            ("the method or its options", &self.method, &other.method),
        ];
        pairs.into_iter().filter(|(_, a, b)| a != b).map(|(name, ..)| name).collect()
    }
}

/// The device, or the instruments with their names, mutual friction, valve friction, and initially inserted lengths.
fn pushed(scene: &Scene, simulation: &Simulation) -> serde_json::Result<Vec<u8>> {
    let stack = simulation.stack();
    if !stack.is_several() {
        return serde_json::to_vec(simulation.device().sections());
    }
    let start_mm = scene.instrument.iter().map(|spec| spec.inserted_mm);
    let each = stack.instruments().iter().zip(start_mm).enumerate();
    let each = each
        .map(|(i, (one, mm))| (&one.name, one.device.sections(), stack.friction(i), stack.valve_n(i), mm));
    let mut bytes = serde_json::to_vec(&each.collect::<Vec<_>>())?;
    // Nothing without play, so that what was written before there was any still fits.
    bytes.extend((0..stack.instruments().len()).filter(|i| stack.has_clearance(*i)).map(|i| i as u8));
    Ok(bytes)
}

/// Replays a script up to where a course says. Returns it and a hash of the steps so far; `seen` is called with each
/// step.
fn replayed<'a>(
    script: &'a Script,
    course: &ScriptCourse,
    several: bool,
    mut seen: impl FnMut(Step<'_>),
) -> endowire_core::Result<(ScriptRun<'a>, String)> {
    let mut numbers = Vec::new();
    let run = script.go_on(course, |step| {
        // The time determines the position of a moving vessel.
        numbers.extend(step.time_s.into_iter().flat_map(f64::to_le_bytes));
        numbers.extend(step.detach.into_iter().flat_map(|instrument| (instrument as u64).to_le_bytes()));
        // No instrument has this number.
        let of_tick = step.solves.into_iter().flat_map(|solves| [u64::MAX, solves as u64]);
        numbers.extend(of_tick.flat_map(u64::to_le_bytes));
        for one in &*step.moves {
            if several {
                numbers.extend((one.instrument as u64).to_le_bytes());
            }
            let steer = Some(one.command.steer).filter(|by| *by != 0.0);
            let command = [one.command.advance_mm, one.command.rotate_rad].into_iter().chain(steer);
            numbers.extend(command.flat_map(f64::to_le_bytes));
        }
        seen(step);
    })?;
    for one in run.injections() {
        numbers.extend([one.instrument, one.after_step].into_iter().flat_map(|n| (n as u64).to_le_bytes()));
        numbers.extend([one.ml, one.ml_per_s].into_iter().flat_map(f64::to_le_bytes));
    }
    // The hash covers conditions that were met, since with another condition a line may have ended earlier.
    let decided = serde_json::to_vec(&run.decided().collect::<Vec<_>>());
    numbers.extend(decided.map_err(|e| endowire_core::Error::Computation(e.to_string()))?);
    Ok((run, hash(numbers)))
}

fn hash(bytes: Vec<u8>) -> String {
    seal::hex(&Sha256::digest(bytes))
}

/// Data of a running run besides the state.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Course {
    /// Steps carried out.
    pub(crate) steps: usize,
    /// Time of the simulation, s.
    pub(crate) step_time_s: f64,
    /// Statistics of the steps.
    pub(crate) tally: Tally,
    /// Injections so far.
    #[serde(default)]
    pub(crate) injected: Vec<InjectionRow>,
}

impl Course {
    /// For a run that begins.
    pub(crate) fn begin() -> Self {
        Self { steps: 0, step_time_s: 0.0, tally: Tally::default(), injected: vec![] }
    }
}

#[derive(Debug, Serialize, Deserialize)]
struct Header {
    version: String,
    git_revision: String,
    scene: String,
    course: Course,
    parts: Parts,
    script: String,
    /// Number of steps of each line of the script.
    lines: ScriptCourse,
}

/// A saved state that was read.
#[derive(Debug)]
pub(crate) struct Saved {
    path: PathBuf,
    header: Header,
    state: State,
}

impl Saved {
    /// Reads a file written by [`Saver`].
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        let refuse = |what: &str| {
            Failure::Input(format!(
                "--resume {}: {what}: give a file that --save-state has written",
                path.display()
            ))
        };
        let bytes = endowire_core::file::read(path, u64::MAX)?;
        let first = bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
        if first != FORMAT.as_bytes() {
            return Err(match std::str::from_utf8(first) {
                Ok(line) if line.starts_with(ANY_FORMAT) => {
                    refuse(&format!("its format is \"{line}\", and this version reads \"{FORMAT}\""))
                }
                _ => refuse("is no saved state"),
            });
        }
        if bytes.len() <= first.len() + seal::BYTES {
            return Err(refuse("is not whole"));
        }
        let Some(body) = seal::opened(&bytes) else { return Err(refuse("is not whole or was changed")) };
        let rest = &body[first.len() + 1..];
        let line = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        let header = serde_json::from_slice(&rest[..line]).map_err(|e| refuse(&e.to_string()))?;
        let state = rest.get(line + 1..).unwrap_or_default();
        let state = postcard::from_bytes(state).map_err(|e| refuse(&e.to_string()))?;
        Ok(Self { path: path.to_path_buf(), header, state })
    }

    /// Data of the run up to the state.
    pub(crate) fn course(&self) -> Course {
        self.header.course.clone()
    }

    /// Restores the state in a simulation of the scene at its start, if it was saved in the same scene with the same
    /// sac; returns the script at that step. `seen` is called with each step so far.
    pub(crate) fn restore<'a>(
        &self,
        (scene, sac): (&Scene, Option<&Sac>),
        simulation: &mut Simulation,
        script: &'a Script,
        seen: impl FnMut(Step<'_>),
    ) -> Result<ScriptRun<'a>, Failure> {
        let refuse = |what: String| Failure::Input(format!("--resume {}: {what}", self.path.display()));
        let steps = self.header.course.steps;
        if steps > script.len() {
            return Err(refuse(format!(
                "it was saved after step {steps}, and the script has {} steps: give the scene that it was saved in ({})",
                script.len(),
                self.header.scene
            )));
        }
        let mut differing = self.header.parts.differing(&Parts::new(scene, simulation, sac));
        let several = simulation.stack().is_several();
        let run = match replayed(script, &self.header.lines, several, seen) {
            Ok((run, hash)) if hash == self.header.script => Some(run),
            _ => None,
        };
        if run.is_none() {
            differing.push("the part of the script that was carried out");
        }
        let (Some(run), true) = (run, differing.is_empty()) else {
            return Err(refuse(format!(
                "it belongs to another scene ({}): {} {} not the same; give the scene that it was saved in",
                self.header.scene,
                differing.join(", "),
                if differing.len() == 1 { "is" } else { "are" }
            )));
        };
        if self.header.git_revision != env!("ENDOWIRE_GIT_REVISION") {
            super::tell(format_args!(
                "endowire: {} was saved by version {} ({}): steps of this one may differ in their last bits",
                self.path.display(),
                self.header.version,
                self.header.git_revision
            ));
        }
        simulation.restore(&self.state).map_err(|error| refuse(error.to_string()))?;
        Ok(run)
    }
}

/// Saving takes at most one part in `SHARE` of a run's time.
const SHARE: u32 = 10;

/// Saves the state of a run to a file repeatedly.
pub(crate) struct Saver {
    path: PathBuf,
    scene: String,
    parts: Parts,
    /// Time of the last save, and its duration.
    last: Option<(Instant, Duration)>,
}

impl Saver {
    /// For a simulation of `scene` with its sac; an existing file is replaced.
    pub(crate) fn new(path: &Path, (scene, sac): (&Scene, Option<&Sac>), simulation: &Simulation) -> Self {
        let parts = Parts::new(scene, simulation, sac);
        Self { path: path.to_path_buf(), scene: scene.name.clone(), parts, last: None }
    }

    /// Whether it is time to save.
    pub(crate) fn is_due(&self) -> bool {
        self.last.is_none_or(|(when, took)| when.elapsed() >= took * SHARE)
    }

    /// Saves the state. At any time the file is completely the previous or the new one, even if the program or the
    /// power fails. `sync` syncs the recording to disk first, so that the state is never ahead of it.
    pub(crate) fn save(
        &mut self,
        simulation: &Simulation,
        (script, lines): (&Script, &ScriptCourse),
        course: &Course,
        sync: impl FnOnce() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let began = Instant::now();
        sync()?;
        let failed = |what: String| Failure::Computation(format!("the state cannot be written: {what}"));
        let several = simulation.stack().is_several();
        let (_, hash) = replayed(script, lines, several, |_| ()).map_err(|e| failed(e.to_string()))?;
        let header = Header {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: env!("ENDOWIRE_GIT_REVISION").to_owned(),
            scene: self.scene.clone(),
            course: course.clone(),
            parts: self.parts.clone(),
            script: hash,
            lines: lines.clone(),
        };
        let header = serde_json::to_string(&header).map_err(|e| failed(e.to_string()))?;
        let state = postcard::to_allocvec(&simulation.state()).map_err(|e| failed(e.to_string()))?;
        let mut bytes = format!("{FORMAT}\n{header}\n").into_bytes();
        bytes.extend(state);
        whole::write_bytes(&self.path, &seal::sealed(bytes)).map_err(|e| Failure::write(&self.path, &e))?;
        self.last = Some((Instant::now(), began.elapsed()));
        Ok(())
    }
}

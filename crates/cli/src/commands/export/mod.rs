//! `endowire export`: converts a recorded run for other programs.

mod glb;
mod gltf;
mod tube;
mod usd;
mod vessel_keys;
mod vtk;

use std::path::Path;

use endowire_core::Vec3;
use endowire_core::device::{Stack, line_mm};
use endowire_core::insertion::Sheath;
use endowire_core::shape::Shape;
use endowire_core::vessel::{Lumen, Wall};
use endowire_recording::{Left, Lengths, RecordedVessel, Recording, WallContact, coils_after, read_coils};

use self::vessel_keys::VesselKeys;
use crate::args::ExportArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::tell;
use crate::scenes;

/// Writes the wanted files.
pub(crate) fn export(args: &ExportArgs) -> Result<(), Failure> {
    for (file, ending, flag) in [(&args.gltf, "glb", "--gltf"), (&args.usd, "usda", "--usd")] {
        if let Some(file) = file
            && file.extension().is_none_or(|found| !found.eq_ignore_ascii_case(ending))
        {
            let text = format!("{flag} {}: name a file .{ending}", file.display());
            return Err(Failure::Input(text));
        }
    }
    let run = Run::read(args)?;
    for (path, flag) in [(&args.vtk, "--vtk"), (&args.gltf, "--gltf"), (&args.usd, "--usd")] {
        if let (Some(path), true) = (path, run.times.is_empty()) {
            return Err(Failure::Input(format!("{flag} {}: the run has recorded no step", path.display())));
        }
    }
    args.vtk.as_deref().map_or(Ok(()), |folder| vtk::write(&run, folder))?;
    args.gltf.as_deref().map_or(Ok(()), |file| gltf::write(&run, file))?;
    args.usd.as_deref().map_or(Ok(()), |file| usd::write(&run, file))
}

/// A recorded run in its scene.
struct Run {
    recording: Recording,
    stack: Stack,
    wall: Wall,
    sheath: Sheath,
    lengths: Lengths,
    left: Vec<Left>,
    /// Number and end time of each step, s.
    times: Vec<(usize, f64)>,
    places: RecordedVessel,
}

/// What is drawn as a line: an inserted instrument, or a detached coil.
struct Line {
    /// Index of the instrument.
    instrument: usize,
    /// Index of the coil, in order of detachment.
    coil: Option<usize>,
    shape: Shape,
}

impl Run {
    fn read(args: &ExportArgs) -> Result<Self, Failure> {
        let recording = scenes::recording(&args.dir, args.scene.as_deref())?;
        scenes::check_recorded(&args.set)?;
        let given = args.scene.as_deref();
        let (path, scene) = scenes::of_recording(recording.about(), given, &args.set)?;
        if let Some(other) = scenes::other_than_recorded(recording.about(), &args.dir, given, &path)? {
            tell(format_args!("endowire: {other}"));
        }
        let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
        let stack = scene.stack().map_err(in_scene)?;
        let cache = Cache::new(&args.cache);
        let wall = scene.wall(&cache).map_err(in_scene)?;
        let sheath = scene.sheath(&wall).map_err(in_scene)?;
        let times = recording.step_times()?;
        Ok(Self {
            lengths: Lengths::read(&args.dir, &stack)?,
            left: read_coils(&args.dir, &stack)?,
            places: RecordedVessel::read(&args.dir, &scene, &Lumen::from(wall.clone()), &cache)?,
            recording,
            stack,
            wall,
            sheath,
            times,
        })
    }

    /// Number and end time, s, of each row, from 1.
    fn rows(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        (1..).zip(&self.times).map(|(row, (step, time_s))| (row, *step, *time_s))
    }

    /// Rows with their times, s, which increase: as many as fit, evenly, with the last.
    fn keys(&self, most: usize) -> Vec<(usize, f64)> {
        let every = self.times.len().div_ceil(most).max(1);
        let due = self.rows().filter(|(row, ..)| (self.times.len() - row).is_multiple_of(every));
        let mut keys: Vec<(usize, f64)> = Vec::new();
        for (row, _, time_s) in due {
            // Of steps that end at the same time, in single precision, the last remains.
            keys.pop_if(|(_, before)| *before as f32 >= time_s as f32);
            keys.push((row, time_s));
        }
        keys
    }

    /// The line of each inserted instrument and of each detached coil after the step in a row.
    fn lines(&self, row: usize) -> Result<Vec<Line>, Failure> {
        let (step, _) = self.times[row - 1];
        let line = self.recording.shape(row);
        let lengths_mm = self.lengths.after(step, &line)?;
        let line_mm = line_mm(lengths_mm.iter().copied());
        let in_line = lengths_mm.iter().enumerate().filter(|(_, mm)| **mm > 0.0);
        let in_line =
            in_line.map(|(instrument, mm)| Line { instrument, coil: None, shape: line.behind(line_mm - mm) });
        let coils = coils_after(&self.left, step).into_iter().enumerate();
        let coils = coils.map(|(number, coil)| Line {
            instrument: coil.instrument,
            coil: Some(number),
            shape: coil.shape,
        });
        Ok(in_line.chain(coils).collect())
    }

    /// The contacts after the step in a row.
    fn contacts(&self, row: usize) -> Vec<WallContact> {
        self.recording.contacts(row)
    }

    /// The vertices of the vessel after the step in a row, or before the first.
    fn vertices_mm(&self, row: Option<usize>) -> Vec<Vec3> {
        let (step, time_s) = row.map_or((0, 0.0), |row| self.times[row - 1]);
        let displacement = self.places.at(step, time_s);
        let place = |v: &Vec3| displacement.as_ref().map_or(*v, |displacement| displacement.place(v));
        self.wall.mesh().vertices_mm.iter().map(place).collect()
    }

    /// Radius of an instrument at an arc length from its tip, mm.
    fn radius_mm(&self, instrument: usize, from_tip_mm: f64) -> f64 {
        self.stack.instruments()[instrument].device.section_at(from_tip_mm).radius_mm
    }

    /// Name of an instrument, or of a coil of it.
    fn name(&self, instrument: usize, coil: Option<usize>) -> String {
        let name = &self.stack.instruments()[instrument].name;
        coil.map_or_else(|| name.clone(), |number| format!("{name} coil {number}"))
    }
}

/// Tells what was written, with keys of a vessel that moves.
fn written(steps: usize, vessel: Option<&VesselKeys>, path: &Path) {
    tell(format_args!("{steps} steps and the vessel in {}", path.display()));
    if let Some(text) = vessel.and_then(VesselKeys::text) {
        tell(format_args!("{}: {text}", path.display()));
    }
}

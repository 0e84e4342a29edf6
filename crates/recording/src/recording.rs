//! Reads recorded runs.

use std::io;
use std::path::{Path, PathBuf};

use endowire_core::shape::Shape;
use endowire_core::{Error, Result, Vec3};

use crate::arrays::{self, GROWING, SHAPES};
use crate::npz::{self, Member};
use crate::rows::{AGAIN, Rows};
use crate::steps::{STEPS, StepRow, read_steps};
use crate::summary::About;
use crate::table::GIVE;

/// A contact of the wall with the device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallContact {
    /// Place on the device's axis.
    pub position_mm: Vec3,
    /// Force of the wall on the device, normal and friction together.
    pub force_n: Vec3,
}

/// A recorded run: its steps with their shapes and contacts, in memory. That its tables are of the same steps is checked.
///
/// ```no_run
/// use endowire_recording::Recording;
///
/// let recording = Recording::read("out/arch".as_ref())?;
/// for row in recording.rows() {
///     println!("{} mm: {} N", row.inserted_mm, row.push_force_n);
/// }
/// let last = recording.shape(recording.steps());
/// # Ok::<(), endowire_core::Error>(())
/// ```
#[derive(Debug)]
pub struct Recording {
    folder: PathBuf,
    about: About,
    rows: Vec<StepRow>,
    left_out: Option<String>,
    positions: Vec<Vec3>,
    tangents: Vec<Vec3>,
    from_tip: Vec<f64>,
    offsets: Vec<usize>,
    contact_points: Vec<Vec3>,
    contact_forces: Vec<Vec3>,
    contact_offsets: Vec<usize>,
}

impl Recording {
    /// Reads the recording in a folder; of a run that was killed, all complete steps.
    ///
    /// # Errors
    /// [`Error::Content`] for a folder without a recording, files that are damaged or of a later version, and tables and
    /// shapes that are not of the same steps.
    pub fn read(folder: &Path) -> Result<Self> {
        Self::of(folder, About::read(folder)?)
    }

    /// As [`Self::read`], of a run in this scene: the summary may be damaged or missing.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_in(folder: &Path, scene: &Path) -> Result<Self> {
        let unknown = || About { complete: Some(false), ..About::in_scene(scene) };
        Self::of(folder, About::read(folder).unwrap_or_else(|_| unknown()))
    }

    fn of(folder: &Path, about: About) -> Result<Self> {
        let is_killed = !about.is_complete();
        let Rows { mut steps, left_out, .. } = Rows::read(folder, &about)?;
        let mut recording = Self::of_arrays(folder, about)?;
        let count = recording.steps();
        if count != steps.len() && !is_killed {
            let what = format!("holds {count} steps, and {STEPS} {} of them: {AGAIN}", steps.len());
            return Err(Error::content(&folder.join(SHAPES), what));
        }
        let differ = || format!("{STEPS} has {} whole steps, and the shapes {count}", steps.len());
        recording.left_out = left_out.or_else(|| (count != steps.len()).then(differ));
        steps.truncate(count);
        recording.truncate(steps.len());
        recording.check_numbers()?;
        for (index, row) in steps.iter().enumerate() {
            recording.check_row(index, row)?;
        }
        recording.rows = steps;
        Ok(recording)
    }

    /// Checks that all numbers of the arrays are finite.
    fn check_numbers(&self) -> Result<()> {
        let nodes = ..self.offsets[self.steps()];
        let contacts = ..self.contact_offsets[self.steps()];
        let of_vectors = |all: &[Vec3]| all.iter().position(|one| !one.iter().all(|x| x.is_finite()));
        let wrong = [
            (arrays::POSITIONS, of_vectors(&self.positions[nodes])),
            (arrays::TANGENTS, of_vectors(&self.tangents[nodes])),
            (arrays::FROM_TIP, self.from_tip[nodes].iter().position(|x| !x.is_finite())),
            (arrays::CONTACT_POSITIONS, of_vectors(&self.contact_points[contacts])),
            (arrays::CONTACT_FORCES, of_vectors(&self.contact_forces[contacts])),
        ];
        match wrong.into_iter().find_map(|(member, row)| Some((member, row?))) {
            Some((member, row)) => {
                let what =
                    format!("{}[{row}]: must be finite: run the scene again (endowire run)", member.name);
                Err(Error::content(&self.folder.join(SHAPES), what))
            }
            None => Ok(()),
        }
    }

    /// Checks that the row of a step is that of its shape.
    fn check_row(&self, index: usize, row: &StepRow) -> Result<()> {
        let [first, end] = [self.offsets[index], self.offsets[index + 1]];
        let tip = self.positions[first..end].last().copied().unwrap_or_default();
        let fits = row.nodes == end - first && Vec3::new(row.tip_x_mm, row.tip_y_mm, row.tip_z_mm) == tip;
        if fits {
            return Ok(());
        }
        let what = format!(
            "line {}: step {} has {} nodes and its tip at ({}, {}, {}) mm, and the shape there {} and ({}, {}, {}): {AGAIN}",
            index + 2,
            row.step,
            row.nodes,
            row.tip_x_mm,
            row.tip_y_mm,
            row.tip_z_mm,
            end - first,
            tip.x,
            tip.y,
            tip.z
        );
        Err(Error::content(&self.folder.join(STEPS), what))
    }

    /// The arrays of a recording alone.
    fn of_arrays(folder: &Path, about: About) -> Result<Self> {
        let (packed, growing) = (folder.join(SHAPES), folder.join(GROWING));
        // Growing arrays may still lie beside packed ones; packed ones, if they exist, are complete.
        if !packed.exists() && growing.is_dir() {
            let mut recording =
                Self::from_arrays(folder, about, |member| npz::read_unpacked(&growing, member))
                    .map_err(|e| unreadable(&growing, &e))?;
            recording.cut_to_whole_steps();
            return Ok(recording);
        }
        let recording = Self::from_arrays(folder, about, |member| npz::read(&packed, member.name))
            .map_err(|e| unreadable(&packed, &e))?;
        recording.check().map_err(|what| unreadable(&packed, &what))?;
        Ok(recording)
    }

    fn from_arrays(
        folder: &Path,
        about: About,
        read: impl Fn(&Member) -> io::Result<Vec<[u8; 8]>>,
    ) -> io::Result<Self> {
        let floats = |member| -> io::Result<Vec<f64>> {
            Ok(read(member)?.into_iter().map(f64::from_le_bytes).collect())
        };
        let vectors = |member| -> io::Result<Vec<Vec3>> {
            Ok(floats(member)?.chunks_exact(3).map(|x| Vec3::new(x[0], x[1], x[2])).collect())
        };
        let offsets = |member| -> io::Result<Vec<usize>> {
            let numbers = read(member)?.into_iter().map(i64::from_le_bytes);
            Ok(numbers.map(|n| usize::try_from(n).unwrap_or(usize::MAX)).collect())
        };
        Ok(Self {
            folder: folder.to_path_buf(),
            about,
            rows: vec![],
            left_out: None,
            positions: vectors(&arrays::POSITIONS)?,
            tangents: vectors(&arrays::TANGENTS)?,
            from_tip: floats(&arrays::FROM_TIP)?,
            offsets: offsets(&arrays::OFFSETS)?,
            contact_points: vectors(&arrays::CONTACT_POSITIONS)?,
            contact_forces: vectors(&arrays::CONTACT_FORCES)?,
            contact_offsets: offsets(&arrays::CONTACT_OFFSETS)?,
        })
    }

    /// Checks that the arrays of a completed run are consistent.
    fn check(&self) -> std::result::Result<(), &'static str> {
        let (nodes, contacts) = (self.positions.len(), self.contact_points.len());
        if nodes != self.tangents.len()
            || nodes != self.from_tip.len()
            || contacts != self.contact_forces.len()
        {
            return Err("its arrays have different lengths");
        }
        for (offsets, most, what) in [
            (&self.offsets, nodes, "offsets do not fit the other arrays"),
            (&self.contact_offsets, contacts, "contact_offsets do not fit the other arrays"),
        ] {
            if offsets.first() != Some(&0) || !offsets.is_sorted() || offsets.last() != Some(&most) {
                return Err(what);
            }
        }
        if self.offsets.len() != self.contact_offsets.len() {
            return Err("shapes and contacts have different numbers of steps");
        }
        Ok(())
    }

    /// Drops everything after the last step that is complete in every array: a kill or a power failure can cut any
    /// file anywhere.
    fn cut_to_whole_steps(&mut self) {
        let nodes = self.positions.len().min(self.tangents.len()).min(self.from_tip.len());
        let contacts = self.contact_points.len().min(self.contact_forces.len());
        let whole = |offsets: &[usize], most: usize| {
            let from_zero = offsets.first() == Some(&0);
            let rise = offsets.windows(2).take_while(|w| w[0] <= w[1] && w[1] <= most).count();
            if from_zero { rise } else { 0 }
        };
        let steps = whole(&self.offsets, nodes).min(whole(&self.contact_offsets, contacts));
        for offsets in [&mut self.offsets, &mut self.contact_offsets] {
            offsets.truncate(steps + 1);
            // Even the first offset may be missing.
            if steps == 0 {
                *offsets = vec![0];
            }
        }
    }

    /// The first `steps` steps of the arrays in a folder.
    pub(crate) fn read_first(folder: &Path, steps: usize) -> Result<Self> {
        let mut recording = Self::of_arrays(folder, About::default())?;
        if recording.steps() < steps {
            let what = format!("its arrays hold {} steps and its table {steps}", recording.steps());
            return Err(unreadable(folder, &what));
        }
        recording.truncate(steps);
        recording.rows = read_steps(folder)?;
        recording.rows.truncate(steps);
        Ok(recording)
    }

    /// Drops all but the first steps of the arrays.
    fn truncate(&mut self, steps: usize) {
        self.offsets.truncate(steps + 1);
        self.contact_offsets.truncate(steps + 1);
    }

    /// Its folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What its summary says.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// The rows of its table of steps. Those of a run that was resumed in another folder begin later than with step 1.
    pub fn rows(&self) -> &[StepRow] {
        &self.rows
    }

    /// Numbers of its steps, with their end times, s.
    ///
    /// # Errors
    /// [`Error::Content`] for a table of steps without times.
    pub fn step_times(&self) -> Result<Vec<(usize, f64)>> {
        let times = self.rows.iter().map(|row| Some((row.step, row.time_s?)));
        let lacking = || Error::content(&self.folder.join(STEPS), format!("has no column time_s; {GIVE}"));
        times.collect::<Option<_>>().ok_or_else(lacking)
    }

    /// What was left out because a run that was killed has not written it whole, in words.
    pub fn left_out(&self) -> Option<&str> {
        self.left_out.as_deref()
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The shape after the step in row number `row`, from 1 to [`Self::steps`].
    ///
    /// # Panics
    /// For another row.
    pub fn shape(&self, row: usize) -> Shape {
        let range = self.offsets[row - 1]..self.offsets[row];
        Shape {
            positions_mm: self.positions[range.clone()].to_vec(),
            tangents: self.tangents[range.clone()].to_vec(),
            from_tip_mm: self.from_tip[range].to_vec(),
        }
    }

    /// The contacts after the step in row number `row`, from 1 to [`Self::steps`].
    ///
    /// # Panics
    /// For another row.
    pub fn contacts(&self, row: usize) -> Vec<WallContact> {
        (self.contact_offsets[row - 1]..self.contact_offsets[row])
            .map(|k| WallContact { position_mm: self.contact_points[k], force_n: self.contact_forces[k] })
            .collect()
    }
}

fn unreadable(path: &Path, error: &dyn std::fmt::Display) -> Error {
    Error::content(path, format!("{error}; {GIVE}"))
}

#[cfg(test)]
mod tests {
    use endowire_core::insertion::StepReport;
    use endowire_tests::damage::damaged;
    use endowire_tests::noise::Noise;

    use super::*;
    use crate::arrays::ShapeArrays;
    use crate::instruments::INSTRUMENTS;
    use crate::summary::SUMMARY;

    /// Records three steps of one, two and three nodes; all data of a node contain its number.
    fn killed(folder: &Path) -> ShapeArrays {
        std::fs::write(
            folder.join(SUMMARY),
            r#"{"schema": 1, "scene_file": "a.toml", "scene_hash": "", "complete": false}"#,
        )
        .unwrap();
        let mut table = "step,advance_mm,rotate_rad,inserted_mm,nodes,tip_x_mm,tip_y_mm,tip_z_mm,push_force_n,torque_nmm,jumped\n".to_owned();
        let mut instruments = "step,instrument,advance_mm,rotate_rad,inserted_mm,torque_nmm\n".to_owned();
        let mut arrays = ShapeArrays::new(folder).unwrap();
        let mut nodes = 0;
        for step in 1..=3 {
            let numbers: Vec<f64> = (nodes..nodes + step).map(f64::from).collect();
            nodes += step;
            let tip = nodes - 1;
            table += &format!("{step},1,0,1,{step},{tip},{tip},{tip},0,0,false\n");
            instruments += &format!("{step},wire,1,0,1,0\n");
            let vectors: Vec<Vec3> = numbers.iter().map(|x| Vec3::repeat(*x)).collect();
            let shape = Shape { positions_mm: vectors.clone(), tangents: vectors, from_tip_mm: numbers };
            arrays.push(&shape, &StepReport::default(), || Ok(())).unwrap();
        }
        std::fs::write(folder.join(STEPS), table).unwrap();
        std::fs::write(folder.join(INSTRUMENTS), instruments).unwrap();
        arrays
    }

    #[test]
    fn a_recording_that_was_cut_at_any_byte_has_its_whole_steps() {
        let folder = tempfile::tempdir().unwrap();
        killed(folder.path());
        let whole = Recording::read(folder.path()).unwrap();
        assert_eq!((whole.steps(), whole.left_out()), (3, None));
        let files: Vec<PathBuf> = std::fs::read_dir(folder.path().join(GROWING))
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        assert_eq!(files.len(), 7);
        let mut seen = [false; 3];
        for file in files {
            let whole = std::fs::read(&file).unwrap();
            for bytes in 0..whole.len() {
                std::fs::write(&file, &whole[..bytes]).unwrap();
                let recording = Recording::read(folder.path()).unwrap();
                // What is cut in arrays alone, its table has.
                assert_eq!(recording.left_out().is_some(), recording.steps() < 3);
                assert_eq!(recording.rows().len(), recording.steps());
                seen[recording.steps()] = true;
                for step in 1..=recording.steps() {
                    let shape = recording.shape(step);
                    let first = (step * (step - 1) / 2) as f64;
                    assert_eq!((shape.len(), shape.from_tip_mm[0]), (step, first), "{file:?} at {bytes}");
                    assert_eq!(shape.positions_mm, shape.tangents, "{file:?} at {bytes}");
                }
            }
            std::fs::write(&file, whole).unwrap();
        }
        assert_eq!(seen, [true; 3]);
    }

    /// Reads 2,000 damaged copies of a file of the recording in a folder, and returns how many were refused.
    fn damaged_copies(folder: &Path, file: &Path, noise: &mut Noise) -> usize {
        let whole = std::fs::read(file).unwrap();
        let mut refused = 0;
        for round in 0..2_000 {
            let bytes = damaged(&whole, noise);
            // A new file is faster: one that is truncated and rewritten is synced to disk at once, which takes
            // milliseconds.
            std::fs::remove_file(file).unwrap();
            std::fs::write(file, &bytes).unwrap();
            match Recording::read(folder) {
                Ok(recording) => {
                    let read: usize = (1..=recording.steps())
                        .map(|step| 7 * recording.shape(step).len() + 6 * recording.contacts(step).len())
                        .sum();
                    assert!(
                        8 * read <= whole.len().max(bytes.len()) + 1_000,
                        "round {round}: {read} numbers"
                    );
                }
                Err(error) => {
                    let reported = error.to_string();
                    assert!(reported.contains(folder.to_str().unwrap()), "round {round}: {reported}");
                    assert!(!reported.contains('\n') && reported.len() < 1_000, "round {round}: {reported}");
                    refused += 1;
                }
            }
        }
        refused
    }

    #[test]
    fn damaged_arrays_are_refused_or_read_and_hold_no_more_than_their_file() {
        let [growing, packed] = [0, 1].map(|_| tempfile::tempdir().unwrap());
        let mut noise = Noise::new(1);
        let _ = killed(growing.path());
        let file = growing.path().join(GROWING).join(arrays::OFFSETS.file_name());
        let refused = damaged_copies(growing.path(), &file, &mut noise);
        assert!(
            (1..2_000).contains(&refused),
            "{refused}: whole steps are read, and other shapes are not those of the table"
        );
        killed(packed.path()).pack(packed.path()).unwrap();
        let refused = damaged_copies(packed.path(), &packed.path().join(SHAPES), &mut noise);
        assert!(refused > 600, "{refused}: the archive's own sums find most damage");
    }

    #[test]
    fn an_array_with_a_number_that_is_not_finite_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        killed(folder.path());
        let path = folder.path().join(GROWING).join(arrays::TANGENTS.file_name());
        let mut bytes = std::fs::read(&path).unwrap();
        // The tangent of the second node, along z.
        bytes[40..48].copy_from_slice(&f64::NAN.to_le_bytes());
        std::fs::write(&path, bytes).unwrap();
        let reported = Recording::read(folder.path()).unwrap_err().to_string();
        assert!(reported.contains("tangents[1]: must be finite"), "{reported}");
    }

    #[test]
    fn a_damaged_summary_is_reported_and_not_needed_beside_the_scene() {
        let folder = tempfile::tempdir().unwrap();
        killed(folder.path());
        std::fs::write(folder.path().join(SUMMARY), "{\"scene").unwrap();
        let reported = Recording::read(folder.path()).unwrap_err().to_string();
        assert!(reported.contains(SUMMARY) && reported.contains("recorded run"), "{reported}");
        assert_eq!(Recording::read_in(folder.path(), Path::new("a.toml")).unwrap().steps(), 3);
    }

    #[test]
    fn a_step_that_could_not_be_written_whole_is_taken_back() {
        let folder = tempfile::tempdir().unwrap();
        let mut arrays = ShapeArrays::new(folder.path()).unwrap();
        let one =
            Shape { positions_mm: vec![Vec3::zeros()], tangents: vec![Vec3::z()], from_tip_mm: vec![0.0] };
        arrays.push(&one, &StepReport::default(), || Ok(())).unwrap();
        arrays.push(&one, &StepReport::default(), || Err(io::Error::other("full"))).unwrap_err();
        arrays.pack(folder.path()).unwrap();
        let packed = |member: &Member| npz::read(&folder.path().join(SHAPES), member.name).unwrap();
        assert_eq!(packed(&arrays::OFFSETS).len(), 2);
        assert_eq!(packed(&arrays::POSITIONS).len(), 3);
        assert!(!folder.path().join(GROWING).exists());
    }
}

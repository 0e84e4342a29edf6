//! Where a vessel is that yields: vessel.csv, beside steps.csv, has the displacement of each unknown of its course after
//! every step, and places.csv where its named places are then. Both are absent where only the wall yields.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::Arc;

use endowire_core::insertion::Simulation;
use endowire_core::methods::MethodChoice;
use endowire_core::scene::SceneOf;
use endowire_core::vessel::{Course, Displacement, Lumen, VesselMotion, WallStore};
use endowire_core::{Error, Result, Vec3};
use serde::de::DeserializeOwned;

use crate::columns::columns;
use crate::table::{self, StepTable};

/// The table of unknowns.
pub const VESSEL: &str = "vessel.csv";
/// The table of named places.
pub const PLACES: &str = "places.csv";

columns! {
    /// A row of vessel.csv: displacement of an unknown of the vessel's course after a step.
    pub struct UnknownRow {
        /// Number of the step.
        pub step: usize,
        /// Number of the unknown, from 0.
        pub unknown: usize,
        /// Its displacement.
        pub x_mm: f64,
        /// As `x_mm`.
        pub y_mm: f64,
        /// As `x_mm`.
        pub z_mm: f64,
    }
}

columns! {
    /// A row of places.csv: where a named place of the vessel is after a step.
    pub struct PlaceRow {
        /// Number of the step.
        pub step: usize,
        /// Name of the place.
        pub place: String,
        /// Where it is.
        pub x_mm: f64,
        /// As `x_mm`.
        pub y_mm: f64,
        /// As `x_mm`.
        pub z_mm: f64,
        /// Distance from where it is at rest.
        pub displacement_mm: f64,
    }
}

/// Writes the tables of a run.
pub(crate) struct VesselTables {
    pub(crate) unknowns: StepTable,
    pub(crate) places: StepTable,
}

impl VesselTables {
    /// The tables of a recording in `folder` that goes on after step `steps`; later rows are dropped. None for a vessel
    /// that does not yield.
    pub(crate) fn go_on(folder: &Path, steps: usize, at: &Simulation) -> io::Result<Option<Self>> {
        if at.course().is_none() {
            return Ok(None);
        }
        let table = |name: &str| StepTable::go_on(&folder.join(name), steps);
        Ok(Some(Self { unknowns: table(VESSEL)?, places: table(PLACES)? }))
    }

    /// Adds the rows of a step.
    pub(crate) fn push(&mut self, step: usize, simulation: &Simulation) -> io::Result<()> {
        for (unknown, by) in simulation.course_mm().iter().enumerate() {
            self.unknowns.push(UnknownRow { step, unknown, x_mm: by.x, y_mm: by.y, z_mm: by.z })?;
        }
        if let (Some(course), Some(displacement)) = (simulation.course(), simulation.displacement()) {
            for (place, at_rest) in course.places() {
                let now = displacement.place(at_rest);
                let displacement_mm = (now - at_rest).norm();
                self.places.push(PlaceRow {
                    step,
                    place: place.to_owned(),
                    x_mm: now.x,
                    y_mm: now.y,
                    z_mm: now.z,
                    displacement_mm,
                })?;
            }
        }
        Ok(())
    }
}

/// Displacements of the unknowns after steps, mm.
type BySteps = BTreeMap<usize, Vec<Vec3>>;

/// Where the vessel of a recording is after its steps.
pub struct RecordedVessel {
    motion: Option<VesselMotion>,
    course: Option<(Arc<Course>, BySteps)>,
}

impl RecordedVessel {
    /// Of the recording of a scene in `folder`, in this vessel.
    ///
    /// # Errors
    /// [`Error::Content`] for a table that is missing, cannot be read or is of another vessel; what is wrong with the scene.
    pub fn read<M: MethodChoice + DeserializeOwned + Default>(
        folder: &Path,
        scene: &SceneOf<M>,
        lumen: &Lumen,
        store: &dyn WallStore,
    ) -> Result<Self> {
        let motion = VesselMotion::new(&scene.vessel.motion)?;
        let Some(course) = scene.course(lumen, store)? else { return Ok(Self { motion, course: None }) };
        let path = folder.join(VESSEL);
        let mut steps = BySteps::new();
        for row in table::read::<UnknownRow>(&path)? {
            steps.entry(row.step).or_default().push(Vec3::new(row.x_mm, row.y_mm, row.z_mm));
        }
        // The last step of a run that was killed may be incomplete.
        let last = steps.keys().next_back().copied();
        if let Some((step, unknowns)) =
            steps.iter().find(|(step, unknowns)| Some(**step) != last && unknowns.len() != course.unknowns())
        {
            let what = format!(
                "step = {step}: has {} unknowns, and the vessel of the scene {}: give the scene of the run (--scene)",
                unknowns.len(),
                course.unknowns()
            );
            return Err(Error::content(&path, what));
        }
        steps.retain(|_, unknowns| unknowns.len() == course.unknowns());
        Ok(Self { motion, course: Some((Arc::new(course), steps)) })
    }

    /// Whether it is elsewhere in different steps.
    pub fn changes(&self) -> bool {
        self.course.is_some() || self.motion.as_ref().is_some_and(VesselMotion::changes)
    }

    /// Its displacement after a step, at that time, s; none before the first.
    pub fn at(&self, step: usize, time_s: f64) -> Option<Displacement> {
        let moved = self.motion.as_ref().map(|motion| motion.at(time_s));
        let Some((course, steps)) = &self.course else { return moved };
        let still = vec![Vec3::zeros(); course.unknowns()];
        Some(course.displaced(moved, steps.get(&step).unwrap_or(&still)))
    }
}

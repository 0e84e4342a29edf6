//! Where a vessel is that yields: vessel.csv, beside steps.csv, has the displacement of each unknown of its course after
//! every step, and places.csv where its named places are then. Both are absent where only the wall yields.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::Arc;

use endowire_core::Vec3;
use endowire_core::insertion::Simulation;
use endowire_core::vessel::{Course, Displacement, Lumen, VesselMotion};
use endowire_methods::Scene;
use serde::{Deserialize, Serialize};

use super::rows;
use super::step_table::StepTable;
use crate::cache::Cache;
use crate::failure::Failure;

/// The table of unknowns.
pub(crate) const VESSEL: &str = "vessel.csv";
/// The table of named places.
pub(crate) const PLACES: &str = "places.csv";

#[derive(Serialize, Deserialize)]
struct UnknownRow {
    step: usize,
    unknown: usize,
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
}

#[derive(Serialize)]
struct PlaceRow<'a> {
    step: usize,
    place: &'a str,
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    displacement_mm: f64,
}

/// Writes the tables of a run.
pub(crate) struct VesselTables {
    unknowns: StepTable,
    places: StepTable,
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
                    place,
                    x_mm: now.x,
                    y_mm: now.y,
                    z_mm: now.z,
                    displacement_mm,
                })?;
            }
        }
        self.unknowns.flush()?;
        self.places.flush()
    }

    /// Syncs all rows to disk.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.unknowns.sync()?;
        self.places.sync()
    }
}

/// Displacements of the unknowns after steps, mm.
type BySteps = BTreeMap<usize, Vec<Vec3>>;

/// Where the vessel of a recording is after its steps.
pub(crate) struct Recorded {
    motion: Option<VesselMotion>,
    course: Option<(Arc<Course>, BySteps)>,
}

impl Recorded {
    /// Of the recording of a scene in `folder`, in this vessel.
    pub(crate) fn read(folder: &Path, scene: &Scene, lumen: &Lumen, store: &Cache) -> Result<Self, Failure> {
        let motion = VesselMotion::new(&scene.vessel.motion)?;
        let Some(course) = scene.course(lumen, store)? else { return Ok(Self { motion, course: None }) };
        let path = folder.join(VESSEL);
        let mut steps = BySteps::new();
        for row in rows::read::<UnknownRow>(&path)? {
            steps.entry(row.step).or_default().push(Vec3::new(row.x_mm, row.y_mm, row.z_mm));
        }
        // The last step of a run that was killed may be incomplete.
        steps.retain(|_, unknowns| unknowns.len() == course.unknowns());
        Ok(Self { motion, course: Some((Arc::new(course), steps)) })
    }

    /// Whether it is elsewhere in different steps.
    pub(crate) fn changes(&self) -> bool {
        self.course.is_some() || self.motion.as_ref().is_some_and(VesselMotion::changes)
    }

    /// Its displacement after a step, at that time, s; at rest before the first.
    pub(crate) fn at(&self, step: usize, time_s: f64) -> Option<Displacement> {
        let moved = self.motion.as_ref().map(|motion| motion.at(time_s));
        let Some((course, steps)) = &self.course else { return moved };
        let still = vec![Vec3::zeros(); course.unknowns()];
        Some(course.displaced(moved, steps.get(&step).unwrap_or(&still)))
    }
}

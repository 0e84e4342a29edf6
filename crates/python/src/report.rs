//! Reports of steps.

use endowire_core::insertion::{self, InstrumentReport};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::arrays::points;
use crate::document;

/// The results of a step. Quantities per instrument are arrays of shape (n_instruments,), innermost instrument first.
#[pyclass(frozen, module = "endowire", name = "StepReport")]
pub(crate) struct StepReport {
    report: insertion::StepReport,
}

impl StepReport {
    pub(crate) fn new(report: insertion::StepReport) -> Self {
        Self { report }
    }

    fn of_hands<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&InstrumentReport) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.report.hands().iter().map(of).collect())
    }

    fn of_contacts<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&insertion::Contact) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.report.contacts.iter().map(of).collect())
    }
}

/// The push force of an instrument; NaN where it jumps.
pub(crate) fn push_force_n(hand: &InstrumentReport) -> f64 {
    hand.push_force_n.unwrap_or(f64::NAN)
}

#[pymethods]
impl StepReport {
    /// Length of each instrument beyond the mouth of the sheath, mm.
    #[getter]
    fn inserted_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.inserted_mm)
    }

    /// Rotation of each hand since the start, rad.
    #[getter]
    fn rotation_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.rotation_rad)
    }

    /// Rotation of each instrument at the sheath's mouth since the start, rad: the hand's, less the twist of the tail
    /// between.
    #[getter]
    fn mouth_rotation_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.mouth_rotation_rad)
    }

    /// Rotation of each tip since the start, relative to a frame carried along the axis without twist, rad.
    #[getter]
    fn tip_rotation_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.tip_rotation_rad)
    }

    /// Push force on each instrument, N. It is negative if the instrument must be pulled, and NaN where it jumps: if
    /// the tip is at that of another, or if nothing is inserted.
    #[getter]
    fn push_force_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, push_force_n)
    }

    /// Torque that holds each tail, N·mm.
    #[getter]
    fn torque_nmm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.torque_nmm)
    }

    /// Value to which each instrument is steered, −1 to 1; 0 for those that are not.
    #[getter]
    fn steer<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.steer)
    }

    /// What steering takes: derivative of the energy of each inserted length in that value, mJ.
    #[getter]
    fn steer_mj<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.steer_mj)
    }

    /// Bending energy, mJ.
    #[getter]
    fn bend_energy_mj(&self) -> f64 {
        self.report.energy.bend
    }

    /// Twist energy, mJ.
    #[getter]
    fn twist_energy_mj(&self) -> f64 {
        self.report.energy.twist
    }

    /// Energy of the deformed vessel wall, mJ.
    #[getter]
    fn wall_energy_mj(&self) -> f64 {
        self.report.energy.wall
    }

    /// Energy in fields, mJ; 0 without any.
    #[getter]
    fn field_energy_mj(&self) -> f64 {
        self.report.energy.field
    }

    /// Energy in the twist of the tails outside the body, mJ.
    #[getter]
    fn tail_energy_mj(&self) -> f64 {
        self.report.energy.tail
    }

    /// Energy in the course of a vessel that yields, mJ; 0 where only its wall does.
    #[getter]
    fn vessel_energy_mj(&self) -> f64 {
        self.report.energy.vessel
    }

    /// Deepest penetration of the wall, mm; 0 without contact.
    #[getter]
    fn max_penetration_mm(&self) -> f64 {
        self.report.max_penetration_mm
    }

    /// Largest angle by which an element bends from end to end, rad.
    #[getter]
    fn largest_bend_rad(&self) -> f64 {
        self.report.largest_bend_rad
    }

    /// Energy dissipated by friction in this step, mJ.
    #[getter]
    fn dissipated_mj(&self) -> f64 {
        self.report.dissipated_mj
    }

    /// Total drag of the blood flow on all instruments, N, shape (3,); 0 without flow.
    #[getter]
    fn drag_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.report.drag_n.as_slice())
    }

    /// Points of contact with the wall, on the axis, mm, shape (n, 3).
    #[getter]
    fn contact_positions_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.report.contacts.iter().map(|c| c.position_mm))
    }

    /// Force of the wall at each contact, including friction, N, shape (n, 3).
    #[getter]
    fn contact_forces_n<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.report.contacts.iter().map(insertion::Contact::total_n))
    }

    /// Normal force at each contact, N, shape (n,).
    #[getter]
    fn contact_normal_forces_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_contacts(py, |c| c.force_n)
    }

    /// Penetration at each contact, mm, shape (n,).
    #[getter]
    fn contact_penetrations_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_contacts(py, |c| c.penetration_mm)
    }

    /// The opening through which the device has left the vessel, while its tip is not back; None inside.
    #[getter]
    fn left_through(&self) -> Option<usize> {
        self.report.left_through
    }

    /// Newton iterations of this step.
    #[getter]
    fn iterations(&self) -> u32 {
        self.report.iterations
    }

    /// Linear solves in these iterations.
    #[getter]
    fn solves(&self) -> u32 {
        self.report.solves
    }

    /// Commanded motion in ticks that the instruments have not yet followed: advance_mm and rotate_rad of each, of
    /// shape (n_instruments, 2). None if nothing remains; zeros while the instruments are still coming to rest.
    #[getter]
    fn behind<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let behind: Vec<_> = self.report.behind.iter().map(|c| vec![c.advance_mm, c.rotate_rad]).collect();
        if behind.is_empty() { Ok(None) } else { Ok(Some(PyArray2::from_vec2(py, &behind)?)) }
    }

    /// Change of the steering in `behind` that the instruments have not yet followed, shape (n_instruments,). None if
    /// nothing remains.
    #[getter]
    fn behind_steer<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let behind: Vec<f64> = self.report.behind.iter().map(|left| left.steer).collect();
        (!behind.is_empty()).then(|| PyArray1::from_vec(py, behind))
    }

    /// Number of parts into which the command was divided.
    #[getter]
    fn substeps(&self) -> u32 {
        self.report.substeps
    }

    /// How often the instruments slid further while the commands rested, because friction and wall forces could not
    /// be found in one step.
    #[getter]
    fn slides(&self) -> u32 {
        self.report.slides
    }

    /// Number of parts of the command that did not follow a path from the last equilibrium; nearly always 0.
    #[getter]
    fn relaxations(&self) -> u32 {
        self.report.relaxations
    }

    /// Out-of-balance force relative to the largest force in the instruments.
    #[getter]
    fn imbalance(&self) -> f64 {
        self.report.imbalance
    }

    /// Energy released in jumps, to motion and friction together, mJ; 0 without jumps.
    #[getter]
    fn released_mj(&self) -> f64 {
        self.report.jump.map_or(0.0, |jump| jump.released_mj)
    }

    /// Position where the largest jump ended, mm, shape (3,); None without one.
    #[getter]
    fn jump_position_mm<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.report.jump.map(|jump| PyArray1::from_slice(py, jump.position_mm.as_slice()))
    }

    /// Whether the instruments jumped to a lower minimum.
    #[getter]
    fn jumped(&self) -> bool {
        self.report.jumped
    }

    /// Whether the step converged by the method's own test.
    #[getter]
    fn converged(&self) -> bool {
        self.report.converged
    }

    /// The whole report as dictionaries, lists and numbers, with the names of the Rust library.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        document::write(py, &self.report)
    }

    fn __repr__(&self) -> String {
        format!(
            "<endowire.StepReport: {} mm inserted, push force {} N, {} contacts, converged {}>",
            self.report.inserted_mm,
            self.report.push_force_n,
            self.report.contacts.len(),
            self.report.converged
        )
    }
}

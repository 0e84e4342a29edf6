//! The report of a step.

use endowire_core::insertion::{self, InstrumentReport};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::arrays::points;
use crate::document;

/// What is seen and felt after a step. Quantities of hands are arrays of shape (n_instruments,), the innermost instrument first.
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

/// The force of a hand; NaN where it jumps.
pub(crate) fn push_force_n(hand: &InstrumentReport) -> f64 {
    hand.push_force_n.unwrap_or(f64::NAN)
}

#[pymethods]
impl StepReport {
    /// Length of each instrument inside the sheath's mouth, mm.
    #[getter]
    fn inserted_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.inserted_mm)
    }

    /// Turn of each tail since the start, rad.
    #[getter]
    fn rotation_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.rotation_rad)
    }

    /// Turn of each tip since the start, carried along the axis without twist, rad.
    #[getter]
    fn tip_rotation_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.tip_rotation_rad)
    }

    /// Force with which the hand pushes each instrument, N; negative where it must pull, NaN where it jumps: the tip is at that of another,
    /// or nothing is in.
    #[getter]
    fn push_force_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, push_force_n)
    }

    /// Torque with which the hand holds each tail, N·mm.
    #[getter]
    fn torque_nmm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.torque_nmm)
    }

    /// Energy of bending, mJ.
    #[getter]
    fn bend_energy_mj(&self) -> f64 {
        self.report.energy.bend
    }

    /// Energy of twist, mJ.
    #[getter]
    fn twist_energy_mj(&self) -> f64 {
        self.report.energy.twist
    }

    /// Energy of the vessel wall's deformation, mJ.
    #[getter]
    fn wall_energy_mj(&self) -> f64 {
        self.report.energy.wall
    }

    /// Energy in fields, mJ; 0 without any.
    #[getter]
    fn field_energy_mj(&self) -> f64 {
        self.report.energy.field
    }

    /// Deepest penetration of the wall, mm; 0 without contact.
    #[getter]
    fn max_penetration_mm(&self) -> f64 {
        self.report.max_penetration_mm
    }

    /// Energy that friction took in this step, mJ.
    #[getter]
    fn dissipated_mj(&self) -> f64 {
        self.report.dissipated_mj
    }

    /// Force of the blood that flows on all instruments, N, shape (3,); 0 where no flow is given.
    #[getter]
    fn drag_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.report.drag_n.as_slice())
    }

    /// Where the wall holds the instruments: points on the axis, mm, shape (n, 3).
    #[getter]
    fn contact_positions_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.report.contacts.iter().map(|c| c.position_mm))
    }

    /// Force of the wall at each contact, normal and friction together, N, shape (n, 3).
    #[getter]
    fn contact_forces_n<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.report.contacts.iter().map(insertion::Contact::total_n))
    }

    /// Normal force at each contact, N, shape (n,).
    #[getter]
    fn contact_normal_forces_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_contacts(py, |c| c.force_n)
    }

    /// Depth of each contact, mm, shape (n,).
    #[getter]
    fn contact_penetrations_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_contacts(py, |c| c.penetration_mm)
    }

    /// The opening through which the tip has left the vessel, while it is beyond it; None inside.
    #[getter]
    fn left_through(&self) -> Option<usize> {
        self.report.left_through
    }

    /// Newton iterations of this step.
    #[getter]
    fn iterations(&self) -> u32 {
        self.report.iterations
    }

    /// Linear solves of these.
    #[getter]
    fn solves(&self) -> u32 {
        self.report.solves
    }

    /// What hands have done in ticks that the instruments have not yet followed: advance_mm and rotate_rad of each, of shape
    /// (n_instruments, 2). None where nothing is left over; zeros where the instruments are on their way to where they come to rest.
    #[getter]
    fn behind<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let behind: Vec<_> = self.report.behind.iter().map(|c| vec![c.advance_mm, c.rotate_rad]).collect();
        if behind.is_empty() { Ok(None) } else { Ok(Some(PyArray2::from_vec2(py, &behind)?)) }
    }

    /// Parts that the command was cut into.
    #[getter]
    fn substeps(&self) -> u32 {
        self.report.substeps
    }

    /// How often the instruments slid on while the hands held still, because friction and wall forces were not to be had in one step.
    #[getter]
    fn slides(&self) -> u32 {
        self.report.slides
    }

    /// Parts of the command in which the way from the last equilibrium was lost; 0 nearly always.
    #[getter]
    fn relaxations(&self) -> u32 {
        self.report.relaxations
    }

    /// What is left out of balance, over the largest force in the instruments.
    #[getter]
    fn imbalance(&self) -> f64 {
        self.report.imbalance
    }

    /// Energy that was lost in jumps, to motion and friction together, mJ; 0 without.
    #[getter]
    fn released_mj(&self) -> f64 {
        self.report.jump.map_or(0.0, |jump| jump.released_mj)
    }

    /// Where the largest jump has led, mm, shape (3,); None without one.
    #[getter]
    fn jump_position_mm<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.report.jump.map(|jump| PyArray1::from_slice(py, jump.position_mm.as_slice()))
    }

    /// Whether the instruments jumped to a lower minimum.
    #[getter]
    fn jumped(&self) -> bool {
        self.report.jumped
    }

    /// Whether the step met the method's own convergence test.
    #[getter]
    fn converged(&self) -> bool {
        self.report.converged
    }

    /// All of it as dictionaries, lists and numbers, under the names of the Rust library.
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

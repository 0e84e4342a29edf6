//! Insertions.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use endowire_core::Vec3;
use endowire_core::device::line_mm;
use endowire_core::field::FieldSpec;
use endowire_core::insertion::{self, Command, InstrumentReport, LateralForce};
use endowire_core::methods::{MethodChoice, Parameter};
use endowire_methods::AnyMethod;
use endowire_viewer::{DeviceView, SheathMouth};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{List, Numbers, Real, lengths_mm, natural, natural_or, place, points, shown};
use crate::document;
use crate::error::{exception, refuse};
use crate::gradient::Gradient;
use crate::instrument::Instrument;
use crate::moves::{of_each, together};
use crate::recorded::{Recorded, parameters};
use crate::report::StepReport;
use crate::start::{self, Arguments, Start};
use crate::state::{State, fields_of};
use crate::vessel::Vessel;

/// One instrument or several.
fn instruments(object: &Bound<'_, PyAny>) -> PyResult<Vec<Instrument>> {
    if let Ok(one) = object.extract::<Instrument>() {
        return Ok(vec![one]);
    }
    object.extract::<List<Instrument>>().map(|list| list.0).map_err(|error| {
        if !error.is_instance_of::<PyTypeError>(object.py()) {
            return error;
        }
        let wanted = "must be an Instrument, or a list of them, the innermost first";
        PyTypeError::new_err(format!("instruments = {}: {wanted}", shown(object)))
    })
}

/// An insertion: instruments in a vessel, stepped by commands.
///
/// Copies share the vessel and take microseconds. A pickle contains the state and the start of the simulation, the
/// latter only once for all copies in the same pickle. The pickle of a scene's simulation needs the files of the
/// scene in their places. A step that raises leaves everything unchanged, to the bit.
#[pyclass(frozen, module = "endowire", name = "Simulation")]
pub(crate) struct Simulation {
    inner: Mutex<insertion::Simulation>,
    /// Has its own reference count, since copies may be made with the interpreter released.
    start: Arc<Py<Start>>,
}

impl Clone for Simulation {
    fn clone(&self) -> Self {
        Self::new(self.lock().clone(), self.start())
    }
}

impl Simulation {
    /// A simulation with this start.
    pub(crate) fn new(simulation: insertion::Simulation, start: Arc<Py<Start>>) -> Self {
        Self { inner: Mutex::new(simulation), start }
    }

    /// A simulation at its start.
    pub(crate) fn begin(py: Python<'_>, start: Start) -> PyResult<Self> {
        Ok(Self::new(start.simulation(), Arc::new(Py::new(py, start)?)))
    }

    /// Its start.
    pub(crate) fn start(&self) -> Arc<Py<Start>> {
        Arc::clone(&self.start)
    }

    /// The instruments.
    pub(crate) fn pushed(&self) -> &[Instrument] {
        &self.start.get().instruments
    }

    /// Moves from the commands of the instruments.
    pub(crate) fn moves(
        &self,
        advance_mm: Option<&Bound<'_, PyAny>>,
        rotate_rad: Option<&Bound<'_, PyAny>>,
        steer: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<insertion::Move>> {
        let hands = self.pushed().len();
        let lengths_mm = of_each("advance_mm", advance_mm, hands)?;
        let turns_rad = of_each("rotate_rad", rotate_rad, hands)?;
        let steered = of_each("steer", steer, hands)?;
        let commands = lengths_mm.into_iter().zip(turns_rad).zip(steered);
        let command = |((advance_mm, rotate_rad), steer)| Command { advance_mm, rotate_rad, steer };
        Ok(together(commands.map(command)))
    }

    /// Locks the simulation. Never call it with the interpreter held: another thread may hold the lock for a long
    /// step.
    fn lock(&self) -> MutexGuard<'_, insertion::Simulation> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs `work` on the simulation with the interpreter released.
    pub(crate) fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut insertion::Simulation) -> T + Send,
    ) -> T {
        py.detach(|| work(&mut self.lock()))
    }

    /// The instruments for the viewer; empty for those that are outside.
    pub(crate) fn views(&self, py: Python<'_>) -> Vec<DeviceView> {
        let (shape, lengths_mm, coils) = self.with(py, |simulation| {
            (simulation.shape().clone(), simulation.report().lengths_mm(), simulation.coils().to_vec())
        });
        let left = coils.iter().map(|coil| {
            let instrument = &self.pushed()[coil.instrument];
            DeviceView::of_device(&coil.shape, &instrument.device, &instrument.parts)
        });
        let line_mm = line_mm(lengths_mm.iter().copied());
        let sheath = SheathMouth::of_line(&shape);
        let each = self.pushed().iter().zip(lengths_mm);
        each.map(|(instrument, mm)| match mm {
            0.0 => DeviceView::default(),
            mm => DeviceView {
                sheath,
                ..DeviceView::of_device(&shape.behind(line_mm - mm), &instrument.device, &instrument.parts)
            },
        })
        .chain(left)
        .collect()
    }

    /// Derivatives of what commands lead to.
    fn gradients_of(
        &self,
        py: Python<'_>,
        (commands, times_s): (&[Vec<insertion::Move>], Option<Vec<f64>>),
        by: &[String],
    ) -> PyResult<Vec<Gradient>> {
        let found = self.with(py, |simulation| {
            let (by, words) = parameters(by, simulation.stack())?;
            let all = match &times_s {
                Some(times_s) => simulation.gradients_until(commands, times_s, &by)?,
                None => simulation.gradients(commands, &by)?,
            };
            Ok(all.into_iter().map(|gradient| Gradient { gradient, by: words.clone() }).collect())
        });
        found.map_err(exception)
    }

    fn of_hands<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&InstrumentReport) -> f64 + Send + Sync,
    ) -> Bound<'py, PyArray1<f64>> {
        let list = self.with(py, |simulation| simulation.report().hands().iter().map(of).collect());
        PyArray1::from_vec(py, list)
    }
}

/// What pickling takes a simulation apart into: what makes it anew, and with what.
type Reduced<'py> = (Bound<'py, PyAny>, (Py<Start>, State));

#[pymethods]
impl Simulation {
    /// Instruments at the mouth of a sheath in a vessel, with nothing inserted.
    ///
    /// The sheath is at an `opening` of the vessel, `depth_mm` inside it (1 by default), or at `position_mm` with a
    /// `direction`. By default it is at the inlet of the vessel's centre line, or without one at the lowest of the
    /// wide openings. A positive first rest curvature bends instruments towards `bends_towards` at rotation zero, by
    /// default towards the coordinate axis least aligned with the sheath. `wall` has the keys of `[vessel.wall]` of a scene file (modulus_n_per_mm2, friction, region),
    /// `yielding` those of `[vessel.yielding]` (preset, …), by which the vessel yields as a whole,
    /// `method` those of `[method]` (name, element_mm, …). `sheath_friction_n` is the friction of the sheath's valve,
    /// N, and `sheath_friction` the friction coefficient in its mouth.
    ///
    /// Several instruments lie inside each other, innermost first. Optional lists with one entry per instrument are
    /// `names`, for messages; `friction` against the enclosing instruments; `may_lead`, whether its tip may be
    /// inserted farther than that of the instrument inside it; and `clearance`, whether it has the play in the enclosing
    /// instruments that the radii leave, and tilts where one of the two ends.
    ///
    /// Raises InputError for values that are out of range or inconsistent.
    #[new]
    #[pyo3(signature = (vessel, instruments, *, opening=None, depth_mm=None, position_mm=None, direction=None, bends_towards=None, wall=None, yielding=None, method=None, sheath_friction_n=0.0, sheath_friction=0.0, names=None, friction=None, may_lead=None, clearance=None))]
    #[allow(clippy::too_many_arguments, reason = "keywords of Python")]
    fn py_new(
        py: Python<'_>,
        vessel: Py<Vessel>,
        instruments: &Bound<'_, PyAny>,
        opening: Option<&Bound<'_, PyAny>>,
        depth_mm: Option<f64>,
        position_mm: Option<&Bound<'_, PyAny>>,
        direction: Option<&Bound<'_, PyAny>>,
        bends_towards: Option<&Bound<'_, PyAny>>,
        wall: Option<&Bound<'_, PyAny>>,
        yielding: Option<&Bound<'_, PyAny>>,
        method: Option<&Bound<'_, PyAny>>,
        sheath_friction_n: f64,
        sheath_friction: f64,
        names: Option<List<String>>,
        friction: Option<List<Real>>,
        may_lead: Option<List<bool>>,
        clearance: Option<List<bool>>,
    ) -> PyResult<Self> {
        let instruments = self::instruments(instruments)?;
        let position_mm = position_mm.map(|at| place("position_mm", at)).transpose()?;
        let direction = direction.map(|along| place("direction", along)).transpose()?;
        let bends_towards = bends_towards.map(|towards| place("bends_towards", towards)).transpose()?;
        let opening = opening.map(|opening| natural("opening", opening)).transpose()?;
        let nowhere = opening.is_none() && position_mm.is_none() && direction.is_none();
        let inlet = || {
            let vessel = vessel.get();
            vessel.inlet().or_else(|| vessel.lumen.inlet().map(|opening| opening.index)).unwrap_or(0)
        };
        let arguments = Arguments {
            opening: opening.or_else(|| nowhere.then(inlet)),
            depth_mm,
            position_mm,
            direction,
            bends_towards,
            wall: wall.map(|table| document::read("wall", table)).transpose()?.unwrap_or_default(),
            yielding: yielding.map(|table| document::read("yielding", table)).transpose()?,
            method: method.map(read_method).transpose()?.unwrap_or_default(),
            sheath_friction_n,
            sheath_friction,
            names: names.map(|list| list.0),
            friction: friction.map(|list| list.0.into_iter().map(|one| one.0).collect()),
            may_lead: may_lead.map(|list| list.0),
            clearance: clearance.map(|list| list.0),
        };
        Self::begin(py, Start::of_arguments(py, vessel, instruments, arguments)?)
    }

    /// Carries out one command: advance (negative to pull back), mm, and rotation of the tail, rad, as lists with one
    /// entry per instrument, or as numbers for a single instrument. Meanwhile time, and a vessel that moves, advance
    /// to `time_s`, s; not at all if absent. Returns the StepReport.
    ///
    /// A step ends after `most_solves` linear solves at the latest: what is then left of the motion is in
    /// `StepReport.behind`, and the next step or tick goes on with it.
    ///
    /// Raises InputError for an invalid command, EndOfWay where the way ends, and ComputationError if no equilibrium
    /// was found; then everything is unchanged.
    #[pyo3(signature = (advance_mm=None, rotate_rad=None, time_s=None, *, steer=None))]
    fn step(
        &self,
        py: Python<'_>,
        advance_mm: Option<&Bound<'_, PyAny>>,
        rotate_rad: Option<&Bound<'_, PyAny>>,
        time_s: Option<f64>,
        steer: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<StepReport> {
        let moves = self.moves(advance_mm, rotate_rad, steer)?;
        let stepped = self.with(py, |simulation| simulation.step_until(&moves, time_s).cloned());
        stepped.map(StepReport::new).map_err(exception)
    }

    /// As `step`, as a tick of bounded cost, for haptics and displays that need an answer in time: about `solves`
    /// linear solves (`StepReport.solves`), whether or not the instruments come to rest. The remaining motion is
    /// reported (`StepReport.behind`) and continued by the next tick or step; ticks without commands lead to an
    /// equilibrium. Eight solves are enough to follow commands at 1 kHz.
    ///
    /// Raises what `step` raises, except if no equilibrium is found within the tick. The remaining motion is dropped
    /// when it raises.
    #[pyo3(signature = (advance_mm=None, rotate_rad=None, *, solves, time_s=None, steer=None))]
    fn tick(
        &self,
        py: Python<'_>,
        advance_mm: Option<&Bound<'_, PyAny>>,
        rotate_rad: Option<&Bound<'_, PyAny>>,
        solves: &Bound<'_, PyAny>,
        time_s: Option<f64>,
        steer: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<StepReport> {
        let (moves, solves) = (self.moves(advance_mm, rotate_rad, steer)?, natural("solves", solves)?);
        let ticked = self.with(py, |simulation| simulation.tick(&moves, solves, time_s).cloned());
        ticked.map(StepReport::new).map_err(exception)
    }

    /// Derivatives of what `step` with this command would lead to from here; nothing changes. `by` is a list of
    /// words: "advance", "rotate", "hand" (both) and "steer" of the command; "EI[k]", "GJ[k]", "rest_u[k]", "rest_v[k]",
    /// "rest[k]" (both) and "radius[k]" of section k, the tip's 0; "wall", its modulus, and "friction", its coefficient; "entry_x", …,
    /// "entry" (all three), where the sheath's mouth is, and "direction_x", …, "direction", where it points; "field_x[k]", …, "field[k]",
    /// the field of a magnet or a weight, as `set_fields` has it. Those of an instrument begin
    /// with its name, "catheter.EI[1]"; without one they are of the innermost. Returns the Gradient.
    ///
    /// Raises what `step` raises; InputError for a parameter that does not exist or has no derivative, for other methods than
    /// kirchhoff, for loops that touch and for detached coils; ComputationError where the command passes a jump.
    #[pyo3(signature = (advance_mm=None, rotate_rad=None, time_s=None, *, by, steer=None))]
    fn gradient(
        &self,
        py: Python<'_>,
        advance_mm: Option<&Bound<'_, PyAny>>,
        rotate_rad: Option<&Bound<'_, PyAny>>,
        time_s: Option<f64>,
        by: List<String>,
        steer: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Gradient> {
        let moves = self.moves(advance_mm, rotate_rad, steer)?;
        Ok(self.gradients_of(py, (&[moves], time_s.map(|time_s| vec![time_s])), &by.0)?.remove(0))
    }

    /// The same simulation, in the same state, where parameters have other values: a dictionary of words of `gradient` and numbers,
    /// {"EI[0]": 5.0, "friction": 0.1}. Moduli of regions of the wall change in proportion. The instruments lie where they lay until
    /// the next step that moves them.
    ///
    /// Raises InputError for a parameter that does not exist or belongs to a command, and a value that is out of range.
    fn changed(&self, py: Python<'_>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        let values =
            values.iter().map(|(word, value)| Ok((word.extract::<String>()?, value.extract::<Real>()?.0)));
        let values: Vec<(String, f64)> = values.collect::<PyResult<_>>()?;
        let now = self.with(py, |simulation| simulation.clone());
        let changed = start::changed(&now, &values)?;
        Ok(Self::new(changed, Arc::new(Py::new(py, Start::changed_with(&self.start, &now, values)?)?)))
    }

    /// The value of a parameter, a word of `gradient`.
    ///
    /// Raises InputError for a parameter that does not exist or belongs to a command.
    fn value(&self, py: Python<'_>, of: &str) -> PyResult<f64> {
        let values = self.with(py, |simulation| {
            let parameters = Parameter::named(of, simulation.stack())?;
            parameters.iter().map(|parameter| simulation.value(parameter)).collect::<Result<Vec<_>, _>>()
        });
        match values.map_err(exception)?[..] {
            [Some(value)] => Ok(value),
            [None] => Err(refuse("of", format!("{of:?}"), "belongs to a command")),
            _ => Err(refuse("of", format!("{of:?}"), "stands for several: name each")),
        }
    }

    /// As `gradient`, of commands one after the other: an array as that of `run`. Returns a Gradient for each. Derivatives go through
    /// all commands, since friction remembers; "advance", "rotate" and "steer" are of the first, and stay in those that follow. `times_s`
    /// are the times after the commands, s; without them time stands still.
    ///
    /// Raises what `gradient` raises.
    #[pyo3(signature = (moves, *, by, times_s=None))]
    fn gradients(
        &self,
        py: Python<'_>,
        moves: Numbers<'_>,
        by: List<String>,
        times_s: Option<List<f64>>,
    ) -> PyResult<Vec<Gradient>> {
        let moves = crate::moves::moves(&moves, None, self.pushed().len())?;
        self.gradients_of(py, (&moves, times_s.map(|times_s| times_s.0)), &by.0)
    }

    /// Carries out commands on a copy, an array as that of `run`, and returns what they led to as a Recorded, by which sums of it are
    /// differentiated backwards: by any number of parameters and by the motions of all commands at once. `times_s` as for `gradients`.
    ///
    /// Raises what `gradients` raises.
    #[pyo3(signature = (moves, *, times_s=None))]
    fn recorded(&self, py: Python<'_>, moves: Numbers<'_>, times_s: Option<List<f64>>) -> PyResult<Recorded> {
        let moves = crate::moves::moves(&moves, None, self.pushed().len())?;
        let found = self.with(py, |simulation| {
            let times_s = times_s.map_or_else(|| vec![simulation.time_s(); moves.len()], |times_s| times_s.0);
            simulation.record(&moves, &times_s)
        });
        Ok(Recorded::new(found.map_err(exception)?))
    }

    /// As `gradients`, along one change of parameters together: a dictionary of words of `gradient`, each for one parameter, and how much of
    /// it changes, {"EI[0]": 1.0, "friction": -0.01}. Each Gradient has the one column "along", the product of the matrix of `gradients`
    /// with these numbers, at the cost of one parameter.
    ///
    /// Raises what `gradient` raises, and InputError where nothing changes.
    #[pyo3(signature = (moves, along, *, times_s=None))]
    fn jvp(
        &self,
        py: Python<'_>,
        moves: Numbers<'_>,
        along: &Bound<'_, PyDict>,
        times_s: Option<List<f64>>,
    ) -> PyResult<Vec<Gradient>> {
        let moves = crate::moves::moves(&moves, None, self.pushed().len())?;
        let words =
            along.iter().map(|(word, weight)| Ok((word.extract::<String>()?, weight.extract::<Real>()?.0)));
        let words: Vec<(String, f64)> = words.collect::<PyResult<_>>()?;
        let found = self.with(py, |simulation| {
            let along = start::each(simulation, "along", &words)?;
            let times_s = times_s.map_or_else(|| vec![simulation.time_s(); moves.len()], |times_s| times_s.0);
            simulation.jvp(&moves, &times_s, &along)
        });
        let all = found.map_err(exception)?.into_iter();
        Ok(all.map(|gradient| Gradient { gradient, by: vec!["along".to_owned()] }).collect())
    }

    /// The linear solves (`StepReport.solves`) after which `step` with this command ends, with what is behind from
    /// commands before; one Newton iteration more may be counted. None for methods other than kirchhoff.
    #[pyo3(signature = (advance_mm=None, rotate_rad=None, *, steer=None))]
    fn most_solves(
        &self,
        py: Python<'_>,
        advance_mm: Option<&Bound<'_, PyAny>>,
        rotate_rad: Option<&Bound<'_, PyAny>>,
        steer: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Option<usize>> {
        let moves = self.moves(advance_mm, rotate_rad, steer)?;
        Ok(self.with(py, |simulation| simulation.most_solves(&moves)))
    }

    /// Drops the motion that ticks and steps have left over (`StepReport.behind`): the hands are then where the
    /// instruments are, at the lengths and rotations of the report. Instruments that are on their way to where they
    /// rest still go there, in the next step or tick; until then `behind` is zeros.
    fn forget(&self, py: Python<'_>) {
        self.with(py, insertion::Simulation::forget);
    }

    /// Detaches the coil of an instrument, where it comes to rest, and withdraws its pusher. Returns the StepReport.
    ///
    /// Raises InputError for an instrument that is not a coil (`Instrument.coil_mm`), is already detached, or is not yet out of the
    /// catheter, and ComputationError if it does not come to rest; then everything is unchanged.
    #[pyo3(signature = (instrument=None), text_signature = "($self, instrument=0)")]
    fn detach(&self, py: Python<'_>, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<StepReport> {
        let place = natural_or("instrument", instrument, 0)?;
        let done = self.with(py, |simulation| simulation.detach(place).cloned());
        done.map(StepReport::new).map_err(exception)
    }

    /// Replaces the fields; the instruments respond with the next step or tick. Each field is a dictionary with the
    /// keys of `[[field]]` of a scene: `{"kind": "magnet", "instrument": 0, "start_mm": 0.0, "end_mm": 4.0,
    /// "moment_am2": 4e-3, "field_t": [0.05, 0.0, 0.0]}`, a magnet along the axis between two distances from the tip
    /// in a uniform magnetic field, or `{"kind": "weight", "instrument": 0, "force_n_per_mm": [0.0, 0.0, -1e-5]}`.
    ///
    /// Raises InputError for values out of range, for an unknown instrument, and for a magnet that ends beyond its
    /// instrument; then nothing is changed.
    fn set_fields(&self, py: Python<'_>, fields: &Bound<'_, PyAny>) -> PyResult<()> {
        let specs: Vec<FieldSpec> = document::read_list("fields", fields)?;
        let fields = fields_of(&specs).map_err(exception)?;
        self.with(py, |simulation| simulation.set_fields(fields)).map_err(exception)
    }

    /// Detached coils, in order: a list of pairs of an instrument and the points of its coil, from the detached end
    /// to the tip, mm, shape (n, 3).
    #[getter]
    fn coils<'py>(&self, py: Python<'py>) -> PyResult<Vec<(usize, Bound<'py, PyArray2<f64>>)>> {
        let coils = self.with(py, |simulation| simulation.coils().to_vec());
        coils.into_iter().map(|coil| Ok((coil.instrument, points(py, coil.shape.positions_mm)?))).collect()
    }

    /// Carries out commands one after the other: an array of shape (steps, n_instruments, 2) of advance_mm and
    /// rotate_rad, or (steps, n_instruments, 3) with changes of the steering. Returns the last StepReport. Ctrl-C ends it between two steps.
    ///
    /// Raises what `step` raises; earlier steps are kept.
    fn run(&self, py: Python<'_>, moves: Numbers<'_>) -> PyResult<StepReport> {
        for moves in crate::moves::moves(&moves, None, self.pushed().len())? {
            self.with(py, |simulation| simulation.step_together(&moves).map(drop)).map_err(exception)?;
            py.check_signals()?;
        }
        Ok(self.report(py))
    }

    /// The report of the last step.
    #[getter]
    pub(crate) fn report(&self, py: Python<'_>) -> StepReport {
        StepReport::new(self.with(py, |simulation| simulation.report().clone()))
    }

    /// Time since the start, s.
    #[getter]
    fn time_s(&self, py: Python<'_>) -> f64 {
        self.with(py, |simulation| simulation.time_s())
    }

    /// Where the named places of a vessel that yields are now, mm: the targets of its centre line, each an array of shape
    /// (3,); empty where only the wall yields.
    #[getter]
    fn places_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let places = self.with(py, |simulation| {
            let displacement = simulation.displacement();
            let place = |at: &Vec3| displacement.as_ref().map_or(*at, |now| now.place(at));
            let each = simulation.course().into_iter().flat_map(|course| course.places());
            each.map(|(name, at)| (name.clone(), place(at))).collect::<Vec<_>>()
        });
        let all = PyDict::new(py);
        for (name, place) in places {
            all.set_item(name, PyArray1::from_vec(py, vec![place.x, place.y, place.z]))?;
        }
        Ok(all)
    }

    /// Number of instruments.
    #[getter]
    fn n_instruments(&self) -> usize {
        self.pushed().len()
    }

    /// The instruments.
    #[getter]
    fn instruments(&self) -> Vec<Instrument> {
        self.pushed().to_vec()
    }

    /// The inserted centre line, from the sheath to the tip, mm, shape (n, 3).
    #[getter]
    fn positions_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let shape = self.with(py, |simulation| simulation.shape().positions_mm.clone());
        points(py, shape)
    }

    /// Unit tangents at these points, towards the tip, shape (n, 3).
    #[getter]
    fn tangents<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let shape = self.with(py, |simulation| simulation.shape().tangents.clone());
        points(py, shape)
    }

    /// Arc lengths of these points from the tip, mm, shape (n,).
    #[getter(from_tip_mm)]
    fn arc_lengths_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.with(py, |simulation| simulation.shape().from_tip_mm.clone()))
    }

    /// Position of the tip, mm, shape (3,); of several instruments the foremost.
    #[getter]
    fn tip_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let tip = self.with(py, |simulation| tip_mm(simulation));
        PyArray1::from_vec(py, vec![tip.x, tip.y, tip.z])
    }

    /// Positions of the tips of all instruments, mm, shape (n_instruments, 3); the mouth of the sheath for those that
    /// are outside.
    #[getter]
    fn tips_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.with(py, |simulation| tips_mm(simulation)))
    }

    /// Forces between an instrument, with everything inside it, and the enclosing instruments: a dictionary of
    /// `force_n`, the force across the line, shape (n, 3), `tension_n`, the axial force behind, `friction_n` along
    /// the line towards the tip and `friction_nmm` about it, shape (n,), at the points of `positions_mm`; `length_mm`
    /// is the length that each point represents.
    ///
    /// Raises InputError for an unknown instrument.
    fn lateral_forces<'py>(
        &self,
        py: Python<'py>,
        instrument: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (count, place) = (self.pushed().len(), natural::<usize>("instrument", instrument)?);
        if place >= count {
            let remedy = format!("there are {count}, the innermost is 0");
            return Err(refuse("instrument", place, &remedy));
        }
        let forces = self.with(py, |simulation| simulation.lateral_forces(place));
        let reported = PyDict::new(py);
        let list = |of: fn(&LateralForce) -> f64| PyArray1::from_vec(py, forces.iter().map(of).collect());
        reported.set_item("force_n", points(py, forces.iter().map(|at| at.force_n))?)?;
        reported.set_item("tension_n", list(|at| at.tension_n))?;
        reported.set_item("friction_n", list(|at| at.friction_n))?;
        reported.set_item("friction_nmm", list(|at| at.friction_nmm))?;
        reported.set_item("length_mm", list(|at| at.length_mm))?;
        Ok(reported)
    }

    /// Length of each instrument beyond the mouth of the sheath, mm, shape (n_instruments,).
    #[getter]
    fn inserted_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.inserted_mm)
    }

    /// Rotation of each hand since the start, rad, shape (n_instruments,).
    #[getter]
    fn rotation_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_hands(py, |hand| hand.rotation_rad)
    }

    /// Points of the centre line at these arc lengths from the tip, mm: shape (n,) to (n, 3). Lengths beyond the
    /// inserted one give the mouth of the sheath.
    ///
    /// Raises InputError for lengths that are not finite, or negative.
    fn points_mm<'py>(
        &self,
        py: Python<'py>,
        from_tip_mm: Numbers<'_>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let lengths = lengths_mm("from_tip_mm", &from_tip_mm)?;
        points(py, self.with(py, |simulation| points_at(simulation, &lengths)))
    }

    /// Everything that the next step depends on, except for what the simulation was made of: with the fields, also
    /// those that were set and not stepped into.
    fn state(&self, py: Python<'_>) -> State {
        self.with(py, |simulation| State::of(simulation))
    }

    /// Restores a state of the same scene, to the bit. Its fields replace those of the simulation.
    ///
    /// Raises InputError for a state of another method, vessel or instrument; then nothing is changed.
    fn restore(&self, py: Python<'_>, state: &State) -> PyResult<()> {
        self.with(py, |simulation| state.restore_in(simulation)).map_err(exception)
    }

    /// A simulation in the same state that shares the vessel.
    fn copy(&self, py: Python<'_>) -> Self {
        py.detach(|| self.clone())
    }

    fn __copy__(&self, py: Python<'_>) -> Self {
        self.copy(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: Bound<'_, PyAny>) -> Self {
        self.copy(py)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        let (py, simulation) = (slf.py(), slf.get());
        let parts = (simulation.start.clone_ref(py), simulation.state(py));
        Ok((slf.get_type().getattr("_unpickled")?, parts))
    }

    #[staticmethod]
    fn _unpickled(py: Python<'_>, start: Py<Start>, state: &State) -> PyResult<Self> {
        let unpickled = Self::new(start.get().simulation(), Arc::new(start));
        unpickled.restore(py, state)?;
        Ok(unpickled)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let inserted_mm = self.with(py, |simulation| simulation.report().inserted_mm);
        format!("<endowire.Simulation: {inserted_mm} mm inserted>")
    }
}

/// A `[method]` table, whose name is the default one if absent, as in scenes.
fn read_method(table: &Bound<'_, PyAny>) -> PyResult<AnyMethod> {
    document::read_choice("method", table, "name", AnyMethod::default().name())
}

/// The tip; the mouth of the sheath before anything is inserted.
pub(crate) fn tip_mm(simulation: &insertion::Simulation) -> Vec3 {
    simulation.shape().tip_mm().unwrap_or(simulation.sheath().position_mm)
}

/// The tip of each instrument.
pub(crate) fn tips_mm(simulation: &insertion::Simulation) -> Vec<Vec3> {
    let lengths_mm = simulation.report().lengths_mm();
    let line_mm = simulation.report().inserted_mm;
    points_at(simulation, &lengths_mm.iter().map(|mm| line_mm - mm).collect::<Vec<f64>>())
}

/// Points at arc lengths from the tip.
pub(crate) fn points_at(simulation: &insertion::Simulation, from_tip_mm: &[f64]) -> Vec<Vec3> {
    let mouth = simulation.sheath().position_mm;
    from_tip_mm.iter().map(|s| simulation.shape().position_at(*s).unwrap_or(mouth)).collect()
}

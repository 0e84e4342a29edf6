//! Many simulations, stepped in parallel.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use endowire_core::Error;
use endowire_core::insertion::{self, InstrumentReport, Move};
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{List, Numbers, array, lengths_mm, natural, points};
use crate::error::{exception, refuse};
use crate::interrupt::{signalled, stoppable_beside};
use crate::record::Record;
use crate::report::push_force_n;
use crate::simulation::{Simulation, points_at, tip_mm, tips_mm};
use crate::start::Start;
use crate::state::State;

/// Simulations stepped in parallel on all cores (or on RAYON_NUM_THREADS threads), each with the same bits as if
/// stepped alone.
#[pyclass(frozen, module = "endowire", name = "Batch")]
pub(crate) struct Batch {
    inner: Mutex<Members>,
}

struct Members {
    batch: insertion::Batch,
    /// The start of each simulation.
    starts: Vec<Arc<Py<Start>>>,
    /// Ends their long steps: threads of parallel work receive no signals.
    stop: Arc<AtomicBool>,
}

impl Clone for Members {
    /// The copy is stopped on its own.
    fn clone(&self) -> Self {
        Self::new(self.batch.simulations().to_vec(), self.starts.clone())
    }
}

impl Batch {
    /// Runs `work` on the members with the interpreter released.
    fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Members) -> T + Send) -> T {
        py.detach(|| {
            let mut members: MutexGuard<'_, Members> =
                self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            work(&mut members)
        })
    }

    /// Runs `work` on one simulation; a negative index counts from the end.
    fn at<T: Send>(
        &self,
        py: Python<'_>,
        index: isize,
        work: impl FnOnce(&mut Members, usize) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        self.with(py, |members| {
            let count = members.starts.len();
            let place = if index < 0 { index.checked_add_unsigned(count) } else { Some(index) };
            match place.and_then(|place| usize::try_from(place).ok()).filter(|place| *place < count) {
                Some(place) => work(members, place),
                None => Err(PyIndexError::new_err(format!("{index}: the batch has {count} simulations"))),
            }
        })
    }

    /// Carries out moves in each simulation; returns the failures.
    fn carry_out<'py>(
        &self,
        py: Python<'py>,
        moves: &Numbers<'_>,
        work: impl FnOnce(
            &mut insertion::Batch,
            &[Vec<Move>],
        ) -> endowire_core::Result<Vec<endowire_core::Result<()>>>
        + Send,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (count, hands) = self.with(py, |members| (members.starts.len(), members.hands()));
        let moves = crate::moves::moves(moves, Some(count), hands)?;
        let reported = self.work(py, |members| work(&mut members.batch, &moves))?.map_err(exception)?;
        failures(py, reported)
    }

    /// Runs long `work` on the members, which a signal ends. Threads are used only for several, since a program may have
    /// to fork.
    fn work<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Members) -> T + Send) -> PyResult<T> {
        py.detach(|| {
            let mut members: MutexGuard<'_, Members> =
                self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            let stop = Arc::clone(&members.stop);
            let members = &mut *members;
            stop.store(false, Ordering::Relaxed);
            match members.starts.len() {
                0 | 1 => Ok(work(members)),
                _ => stoppable_beside(&stop, || work(members)),
            }
        })
    }

    /// A number from each report.
    fn of_each<'py, T: numpy::Element + Send>(
        &self,
        py: Python<'py>,
        of: impl Fn(&insertion::StepReport) -> T + Send + Sync,
    ) -> Bound<'py, PyArray1<T>> {
        let list = self.with(py, |members| {
            members.batch.simulations().iter().map(|s| of(s.report())).collect::<Vec<T>>()
        });
        PyArray1::from_vec(py, list)
    }

    /// A number for each instrument of each simulation.
    fn of_hands<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&InstrumentReport) -> f64 + Send + Sync,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (rows, hands, list) = self.with(py, |members| {
            let reports = members.batch.simulations().iter().map(insertion::Simulation::report);
            let list: Vec<f64> =
                reports.flat_map(insertion::StepReport::hands).map(|hand| of(&hand)).collect();
            (members.starts.len(), members.hands(), list)
        });
        array(py, list, [rows, hands])
    }
}

impl Members {
    fn new(simulations: Vec<insertion::Simulation>, starts: Vec<Arc<Py<Start>>>) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let simulations = simulations.into_iter().map(|one| stopped_by(&stop, one)).collect();
        Self { batch: insertion::Batch::new(simulations), starts, stop }
    }

    /// A copy of a simulation outside of the batch.
    fn copied(&self, place: usize) -> Simulation {
        let mut simulation = self.batch.simulations()[place].clone();
        simulation.stop_when(signalled);
        Simulation::new(simulation, Arc::clone(&self.starts[place]))
    }

    /// Number of instruments per simulation.
    fn hands(&self) -> usize {
        self.starts.first().map_or(1, |start| start.get().instruments.len())
    }

    /// Refuses a simulation with another number of instruments.
    fn check_hands(&self, start: &Start) -> PyResult<()> {
        let (hands, instruments) = (self.hands(), start.instruments.len());
        if self.starts.is_empty() || instruments == hands {
            return Ok(());
        }
        let remedy = format!("a batch has simulations of the same number of instruments, here {hands}");
        Err(refuse("instruments", instruments, &remedy))
    }
}

/// The failures of simulations as a dictionary from their indices to exceptions.
fn failures(py: Python<'_>, reported: Vec<endowire_core::Result<()>>) -> PyResult<Bound<'_, PyDict>> {
    let failures = PyDict::new(py);
    for (index, reported) in reported.into_iter().enumerate() {
        match reported {
            Ok(()) => {}
            // No simulation has failed: the caller wants to stop.
            Err(stopped @ Error::Stopped) => return Err(exception(stopped)),
            Err(failed) => failures.set_item(index, exception(failed).into_value(py))?,
        }
    }
    Ok(failures)
}

/// The simulation; its long steps end once `stop` is set, or at a signal on the thread that receives them.
fn stopped_by(stop: &Arc<AtomicBool>, mut simulation: insertion::Simulation) -> insertion::Simulation {
    let stop = Arc::clone(stop);
    simulation.stop_when(move || stop.load(Ordering::Relaxed) || signalled());
    simulation
}

#[pymethods]
impl Batch {
    /// A batch of copies of simulations, in this order. They may differ in everything but the number of instruments.
    #[new]
    fn new(py: Python<'_>, simulations: List<Py<Simulation>>) -> PyResult<Self> {
        let copied = simulations.0.iter().map(|one| {
            let one = one.get();
            (one.with(py, |simulation| simulation.clone()), one.start())
        });
        let (list, starts): (Vec<_>, Vec<_>) = copied.unzip();
        let members = Members::new(list, starts);
        members.starts.iter().try_for_each(|start| members.check_hands(start.get()))?;
        Ok(Self { inner: Mutex::new(members) })
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.with(py, |members| members.starts.len())
    }

    /// Carries out one command in each simulation: an array of shape (n, n_instruments, 2) of advance_mm and
    /// rotate_rad. A simulation whose numbers are all 0 is not stepped.
    ///
    /// Returns the failures: a dictionary from the index of a simulation to the exception that `Simulation.step`
    /// would have raised; empty if all succeeded. Simulations that failed are unchanged, and do not affect the
    /// others. Ctrl-C raises KeyboardInterrupt, and leaves simulations unchanged whose step was not at its end.
    fn step<'py>(&self, py: Python<'py>, moves: Numbers<'_>) -> PyResult<Bound<'py, PyDict>> {
        self.carry_out(py, &moves, |batch, moves| batch.step_together(moves))
    }

    /// As `step`, in ticks of about `solves` linear solves each (`Simulation.tick`), so that no simulation delays the
    /// others for long. The remaining motion is available as `behind`, and is continued by the next tick or step,
    /// even if its command is 0.
    fn tick<'py>(
        &self,
        py: Python<'py>,
        moves: Numbers<'_>,
        solves: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let solves = natural("solves", solves)?;
        self.carry_out(py, &moves, |batch, moves| batch.tick(moves, solves))
    }

    /// Drops the motion that ticks and steps have left over, as `Simulation.forget`, in the simulations with these
    /// indices, or in all.
    ///
    /// Raises IndexError for an index that does not exist; then nothing is dropped.
    #[pyo3(signature = (indices=None))]
    fn forget(&self, py: Python<'_>, indices: Option<List<isize>>) -> PyResult<()> {
        let Some(indices) = indices else {
            self.with(py, |members| {
                members.batch.simulations_mut().iter_mut().for_each(insertion::Simulation::forget);
            });
            return Ok(());
        };
        let places = indices.0.into_iter().map(|index| self.at(py, index, |_, place| Ok(place)));
        let places = places.collect::<PyResult<Vec<usize>>>()?;
        self.with(py, |members| {
            places.into_iter().for_each(|place| members.batch.simulations_mut()[place].forget());
        });
        Ok(())
    }

    /// Detaches the coil of an instrument in each simulation, as `Simulation.detach`: a number of an instrument for each,
    /// or None where nothing is detached.
    ///
    /// Returns the failures, as `step`.
    fn detach<'py>(&self, py: Python<'py>, instruments: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
        // One more than there are shows that there are too many: an iterator may have no end.
        let count = self.with(py, |members| members.starts.len());
        let each = instruments.try_iter()?.take(count + 1).map(|one| match one? {
            one if one.is_none() => Ok(None),
            one => natural("instruments", &one).map(Some),
        });
        let instruments = each.collect::<PyResult<Vec<Option<usize>>>>()?;
        let reported = self.work(py, |members| members.batch.detach(&instruments))?.map_err(exception)?;
        failures(py, reported)
    }

    /// Adds the last step of each simulation to a record: `moves` as in `step`, and its end times `times_s`, shape
    /// (n,). A record may be None, for nothing to be added.
    ///
    /// Raises InputError if the number of records or times differs from that of simulations, and as `Record.note`;
    /// then nothing is added.
    fn note(
        &self,
        py: Python<'_>,
        records: List<Option<Py<Record>>>,
        moves: Numbers<'_>,
        times_s: Numbers<'_>,
    ) -> PyResult<()> {
        let (count, hands) = self.with(py, |members| (members.starts.len(), members.hands()));
        let moves = crate::moves::moves(&moves, Some(count), hands)?;
        let times_s: Vec<f64> = times_s.as_array().iter().copied().collect();
        for (name, given) in [("records", records.0.len()), ("times_s", times_s.len())] {
            if given != count {
                return Err(refuse(name, given, &format!("give one for each of {count} simulations")));
            }
        }
        for ((record, time_s), moves) in records.0.iter().zip(&times_s).zip(&moves) {
            if let Some(record) = record {
                record.get().check(*time_s, moves)?;
            }
        }
        self.with(py, |members| {
            let each = members.batch.simulations().iter().zip(&moves).zip(records.0.iter().zip(&times_s));
            for ((simulation, moves), (record, time_s)) in each {
                if let Some(record) = record {
                    record.get().lock().note(*time_s, moves, simulation, None);
                }
            }
        });
        Ok(())
    }

    /// Commanded motion that instruments have not yet followed, in ticks and in steps that used up their linear solves:
    /// advance_mm and rotate_rad of each, shape (n, n_instruments, 2); zeros if nothing remains.
    #[getter]
    fn behind<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (rows, hands, list) = self.with(py, |members| {
            let hands = members.hands();
            let reports = members.batch.simulations().iter().map(insertion::Simulation::report);
            let each = reports.flat_map(|report| (0..hands).map(|hand| report.behind.get(hand).copied()));
            let list: Vec<f64> = each
                .flat_map(|left| left.map_or([0.0; 2], |left| [left.advance_mm, left.rotate_rad]))
                .collect();
            (members.starts.len(), hands, list)
        });
        array(py, list, [rows, hands, 2])
    }

    /// A copy of one simulation.
    fn simulation(&self, py: Python<'_>, index: isize) -> PyResult<Simulation> {
        self.at(py, index, |members, k| Ok(members.copied(k)))
    }

    /// Replaces one simulation by a copy of `simulation`.
    fn replace(&self, py: Python<'_>, index: isize, simulation: &Simulation) -> PyResult<()> {
        let new = simulation.with(py, |simulation| simulation.clone());
        self.at(py, index, |members, k| {
            members.check_hands(simulation.start().get())?;
            members.batch.simulations_mut()[k] = stopped_by(&members.stop, new);
            members.starts[k] = simulation.start();
            Ok(())
        })
    }

    /// The state of one simulation, as `Simulation.state`.
    fn state(&self, py: Python<'_>, index: isize) -> PyResult<State> {
        self.at(py, index, |members, k| Ok(State::of(&members.batch.simulations()[k])))
    }

    /// Restores a state of its scene in one simulation, as `Simulation.restore`.
    fn restore(&self, py: Python<'_>, index: isize, state: &State) -> PyResult<()> {
        self.at(py, index, |members, k| {
            state.restore_in(&mut members.batch.simulations_mut()[k]).map_err(exception)
        })
    }

    /// Positions of the tips, mm, shape (n, 3); of several instruments the foremost.
    #[getter]
    fn tip_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let tips: Vec<_> = self.with(py, |members| members.batch.simulations().iter().map(tip_mm).collect());
        points(py, tips)
    }

    /// Positions of the tips of all instruments, mm, shape (n, n_instruments, 3); the mouth of the sheath for those
    /// that are outside.
    #[getter]
    fn tips_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (rows, hands, list) = self.with(py, |members| {
            let tips = members.batch.simulations().iter().flat_map(tips_mm).flat_map(|p| [p.x, p.y, p.z]);
            (members.starts.len(), members.hands(), tips.collect::<Vec<f64>>())
        });
        array(py, list, [rows, hands, 3])
    }

    /// Points of the centre lines at these arc lengths from the tip, mm: shape (m,) to (n, m, 3).
    ///
    /// Raises InputError for lengths that are not finite, or negative.
    fn points_mm<'py>(
        &self,
        py: Python<'py>,
        from_tip_mm: Numbers<'_>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let lengths = lengths_mm("from_tip_mm", &from_tip_mm)?;
        let (count, list) = self.with(py, |members| {
            let all = members.batch.simulations();
            let list = all.iter().flat_map(|s| points_at(s, &lengths)).flat_map(|p| [p.x, p.y, p.z]);
            (all.len(), list.collect::<Vec<f64>>())
        });
        array(py, list, [count, lengths.len(), 3])
    }

    /// Inserted lengths, from the mouth of the sheath, mm, shape (n, n_instruments).
    #[getter]
    fn inserted_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of_hands(py, |hand| hand.inserted_mm)
    }

    /// Rotations of the tails since the start, rad, shape (n, n_instruments).
    #[getter]
    fn rotation_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of_hands(py, |hand| hand.rotation_rad)
    }

    /// Push forces, N, shape (n, n_instruments); NaN where a force jumps.
    #[getter]
    fn push_force_n<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of_hands(py, push_force_n)
    }

    /// Torques that hold the tails, N·mm, shape (n, n_instruments).
    #[getter]
    fn torque_nmm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of_hands(py, |hand| hand.torque_nmm)
    }

    /// Largest normal forces of the wall at a contact, N, shape (n,); 0 without contact.
    #[getter]
    fn largest_contact_force_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.of_each(py, |report| report.contacts.iter().map(|c| c.force_n).fold(0.0, f64::max))
    }

    /// Wall forces, N, shape (n, 2): the largest force at a contact, and the sum of those at the tip, including
    /// friction. 0 without contact.
    #[getter]
    fn wall_forces_n<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (rows, list) = self.with(py, |members| {
            let forces = members.batch.simulations().iter().map(insertion::Simulation::wall_force);
            (members.starts.len(), forces.flat_map(|f| [f.largest_n, f.tip_n]).collect::<Vec<f64>>())
        });
        array(py, list, [rows, 2])
    }

    /// Openings through which the tips have left the vessel, shape (n,); -1 inside.
    #[getter]
    fn left_through<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.of_each(py, |report| report.left_through.map_or(-1, |opening| opening as i64))
    }

    /// Iterations of the method in the last steps, shape (n,).
    #[getter]
    fn iterations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        self.of_each(py, |report| report.iterations)
    }

    /// Whether the last steps converged by the method's own test, shape (n,).
    #[getter]
    fn converged<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.of_each(py, |report| report.converged)
    }

    /// A copy of the batch; the copies share their vessels.
    fn copy(&self, py: Python<'_>) -> Self {
        self.with(py, |members| Self { inner: Mutex::new(members.clone()) })
    }

    fn __copy__(&self, py: Python<'_>) -> Self {
        self.copy(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: Bound<'_, PyAny>) -> Self {
        self.copy(py)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Vec<Simulation>,))> {
        let simulations = slf
            .get()
            .with(slf.py(), |members| (0..members.starts.len()).map(|place| members.copied(place)).collect());
        Ok((slf.get_type().into_any(), (simulations,)))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<endowire.Batch of {}>", self.__len__(py))
    }
}

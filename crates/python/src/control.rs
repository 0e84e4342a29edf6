//! The controllers of the library.

use std::sync::{Mutex, PoisonError};

use endowire_core::control::{self, Action, FollowPath, Follower, SearchAhead, Team};
use endowire_core::vessel::CentrelinePath;
use endowire_core::{Error, Vec3};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{List, Numbers, array, natural, natural_or, rows};
use crate::error::{exception, refuse};
use crate::simulation::Simulation;

/// A controller that steers one instrument along a way. It examines a simulation and chooses the next command,
/// without learning.
///
/// `path_mm` is the way, shape (n, 4): x, y, z and the vessel's radius, mm. `lead` is the steered instrument;
/// `followers` follow behind its tip, as pairs of an instrument and a distance, mm. The controller has arrived when
/// the tip is at most `arrived_mm` before the end of the way.
#[pyclass(frozen, module = "endowire", name = "Controller")]
pub(crate) struct Controller {
    inner: Mutex<Hand>,
}

struct Hand {
    controller: Box<dyn control::Controller + Send>,
    ended: Option<&'static str>,
}

impl Controller {
    fn of(controller: impl control::Controller + Send + 'static) -> Self {
        Self { inner: Mutex::new(Hand { controller: Box::new(controller), ended: None }) }
    }

    fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Hand) -> T + Send) -> T {
        py.detach(|| work(&mut self.inner.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}

#[pymethods]
impl Controller {
    /// Turns the bent tip into the direction of the way and advances. If it leaves the way or makes no progress, it
    /// pulls back and tries another rotation.
    ///
    /// Raises InputError for an invalid path, and for distances below 0.
    #[staticmethod]
    #[pyo3(
        signature = (path_mm, *, arrived_mm = 5.0, lead = None, followers = None),
        text_signature = "(path_mm, *, arrived_mm=5.0, lead=0, followers=None)"
    )]
    fn follow_path<'py>(
        path_mm: Numbers<'py>,
        arrived_mm: f64,
        lead: Option<&Bound<'py, PyAny>>,
        followers: Option<Followers<'py>>,
    ) -> PyResult<Self> {
        check_distance("arrived_mm", arrived_mm)?;
        Ok(Self::of(FollowPath::new(path(&path_mm)?, team(lead, followers)?, arrived_mm)))
    }

    /// Tries rotations of the instruments `turned` (by default the leading one) on copies of the simulation, pushes
    /// and pulls for 20 mm after each, and carries out the one that moved the tip farthest along the way.
    ///
    /// Raises InputError as `follow_path`.
    #[staticmethod]
    #[pyo3(
        signature = (path_mm, *, arrived_mm = 5.0, lead = None, followers = None, turned = None),
        text_signature = "(path_mm, *, arrived_mm=5.0, lead=0, followers=None, turned=None)"
    )]
    fn search_ahead<'py>(
        path_mm: Numbers<'py>,
        arrived_mm: f64,
        lead: Option<&Bound<'py, PyAny>>,
        followers: Option<Followers<'py>>,
        turned: Option<List<Bound<'py, PyAny>>>,
    ) -> PyResult<Self> {
        check_distance("arrived_mm", arrived_mm)?;
        let team = team(lead, followers)?;
        let turned = match turned {
            Some(List(turned)) => turned.iter().map(|one| natural("turned", one)).collect::<PyResult<_>>()?,
            None => vec![team.lead],
        };
        Ok(Self::of(SearchAhead::new(path(&path_mm)?, team, turned, arrived_mm)))
    }

    /// A `Planner`: it plans the whole way on copies of the simulation before the first command, and carries the plan out.
    ///
    /// Raises InputError as `follow_path`.
    #[staticmethod]
    #[pyo3(
        signature = (path_mm, *, arrived_mm = 5.0, lead = None, followers = None),
        text_signature = "(path_mm, *, arrived_mm=5.0, lead=0, followers=None)"
    )]
    fn plan<'py>(
        path_mm: &Bound<'py, PyAny>,
        arrived_mm: f64,
        lead: Option<&Bound<'py, PyAny>>,
        followers: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = path_mm.py();
        let given = PyDict::new(py);
        given.set_item("arrived_mm", arrived_mm)?;
        for (name, value) in [("lead", lead), ("followers", followers)] {
            value.map_or(Ok(()), |value| given.set_item(name, value))?;
        }
        py.import("endowire.planning")?.getattr("Planner")?.call((path_mm,), Some(&given))
    }

    /// The next command for the current state of a simulation: advance_mm and rotate_rad of each instrument, shape
    /// (n_instruments, 2); None at the end, whose reason is `ended`. Call it once before every step, and carry the
    /// command out.
    ///
    /// Raises InputError for instruments that the simulation does not have.
    fn next<'py>(
        &self,
        py: Python<'py>,
        simulation: &Simulation,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let hands = simulation.pushed().len();
        // A copy, so that the simulation is not locked meanwhile.
        let copy = simulation.with(py, |simulation| simulation.clone());
        let reported = self.with(py, move |hand| {
            let action = hand.controller.next(&copy)?;
            hand.ended = match action {
                Action::Arrived => Some("arrived"),
                Action::GivenUp => Some("given up"),
                Action::Move(_) => None,
            };
            Ok::<_, Error>(action)
        });
        let Action::Move(moves) = reported.map_err(exception)? else { return Ok(None) };
        let mut numbers = vec![0.0; 2 * hands];
        for one in moves {
            numbers[2 * one.instrument] += one.command.advance_mm;
            numbers[2 * one.instrument + 1] += one.command.rotate_rad;
        }
        array(py, numbers, [hands, 2]).map(Some)
    }

    /// "arrived" or "given up" if the last result of `next` was None.
    #[getter]
    fn ended(&self, py: Python<'_>) -> Option<&'static str> {
        self.with(py, |hand| hand.ended)
    }

    /// Number of times it has pulled back to try something else.
    #[getter]
    fn retries(&self, py: Python<'_>) -> usize {
        self.with(py, |hand| hand.controller.retries())
    }
}

fn path(table: &Numbers<'_>) -> PyResult<CentrelinePath> {
    let rows = rows::<4>("path_mm", table)?;
    if let Some((row, [.., radius_mm])) =
        rows.iter().enumerate().find(|(_, [.., radius_mm])| *radius_mm < 0.0)
    {
        return Err(refuse(&format!("path_mm[{row}][3]"), radius_mm, "is a radius: must be 0 or more"));
    }
    let count = rows.len();
    let finite = rows.as_flattened().iter().all(|number| number.is_finite());
    let points = rows.into_iter().map(|[x, y, z, radius_mm]| (Vec3::new(x, y, z), radius_mm)).collect();
    let made = if finite { CentrelinePath::new(points) } else { None };
    let remedy = "must have two rows or more of finite numbers, and no two that follow in one place";
    made.ok_or_else(|| refuse("path_mm", format!("{count} rows"), remedy))
}

/// Refuses a distance that is negative or not finite.
fn check_distance(name: &str, distance_mm: f64) -> PyResult<()> {
    match distance_mm.is_finite() && distance_mm >= 0.0 {
        true => Ok(()),
        false => Err(refuse(name, distance_mm, "must be a distance of 0 or more")),
    }
}

/// Instruments, and how far they stay behind the tip, mm.
type Followers<'py> = List<(Bound<'py, PyAny>, f64)>;

fn team(lead: Option<&Bound<'_, PyAny>>, followers: Option<Followers<'_>>) -> PyResult<Team> {
    let follower = |(instrument, behind_mm): (Bound<'_, PyAny>, f64)| {
        check_distance("followers", behind_mm)?;
        Ok(Follower { instrument: natural("followers", &instrument)?, behind_mm })
    };
    let followers =
        followers.map_or_else(Vec::new, |list| list.0).into_iter().map(follower).collect::<PyResult<_>>()?;
    Ok(Team { lead: natural_or("lead", lead, 0)?, followers })
}

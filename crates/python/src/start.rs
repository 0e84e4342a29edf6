//! Starts of simulations. Copies share their start, so a pickle of many copies contains it only once, plus the state
//! of each.

use std::sync::{Mutex, PoisonError};

use endowire_core::Error;
use endowire_core::device::{self, Stack};
use endowire_core::insertion::{self, WallProperties};
use endowire_core::methods::Parameter;
use endowire_core::scene::SheathSpec;
use endowire_core::vessel::{Course, NoStore, YieldingSpec};
use endowire_methods::AnyMethod;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::arrays::List;
use crate::error::{InputError, exception, refuse};
use crate::instrument::Instrument;
use crate::interrupt::{interruptible, signalled};
use crate::scene::Scene;
use crate::vessel::Vessel;

/// A simulation before its first step, and its inputs. It is used only in pickles of simulations.
#[pyclass(frozen, module = "endowire._endowire", name = "_Start")]
pub(crate) struct Start {
    pub(crate) instruments: Vec<Instrument>,
    simulation: Mutex<insertion::Simulation>,
    made_of: MadeOf,
}

enum MadeOf {
    Arguments(Py<Vessel>, Box<Arguments>),
    Scene(Py<Scene>),
    /// Another start, with other values of parameters.
    Changed(Py<Start>, Vec<(String, f64)>),
}

/// Arguments of `Simulation` besides vessel and instruments.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct Arguments {
    pub(crate) opening: Option<usize>,
    pub(crate) depth_mm: Option<f64>,
    pub(crate) position_mm: Option<[f64; 3]>,
    pub(crate) direction: Option<[f64; 3]>,
    #[serde(default)]
    pub(crate) bends_towards: Option<[f64; 3]>,
    pub(crate) wall: WallProperties,
    /// How the vessel yields as a whole.
    #[serde(default)]
    pub(crate) yielding: Option<YieldingSpec>,
    pub(crate) method: AnyMethod,
    pub(crate) sheath_friction_n: f64,
    pub(crate) sheath_friction: f64,
    pub(crate) names: Option<Vec<String>>,
    pub(crate) friction: Option<Vec<f64>>,
    pub(crate) may_lead: Option<Vec<bool>>,
    /// Absent in states that were written before it existed.
    #[serde(default)]
    pub(crate) clearance: Option<Vec<bool>>,
}

impl Start {
    /// Instruments at the mouth of a sheath in a vessel.
    pub(crate) fn of_arguments(
        py: Python<'_>,
        vessel: Py<Vessel>,
        instruments: Vec<Instrument>,
        arguments: Arguments,
    ) -> PyResult<Self> {
        let (stack, lumen) = (arguments.stack(&instruments)?, vessel.get().lumen.clone());
        let Arguments { opening, depth_mm, position_mm, direction, bends_towards, .. } = arguments;
        let (friction_n, friction) = (arguments.sheath_friction_n, arguments.sheath_friction);
        let sheath =
            SheathSpec { opening, depth_mm, position_mm, direction, bends_towards, friction_n, friction };
        let (properties, method) = (arguments.wall.clone(), arguments.method.clone());
        let tree = arguments.yielding.as_ref().map(|_| vessel.get().tree(py).cloned()).transpose()?;
        let yielding = arguments.yielding.clone();
        let built = interruptible(py, move || {
            let sheath = sheath.place(&lumen)?;
            let builder = insertion::Simulation::builder(lumen, stack, sheath);
            let course = tree.zip(yielding).map(|(tree, spec)| Course::new(&tree, &spec)).transpose()?;
            builder.properties(properties).course(course).method(&method).store(&NoStore).build()
        })?;
        let simulation = Mutex::new(built.map_err(exception)?);
        Ok(Self { instruments, simulation, made_of: MadeOf::Arguments(vessel, Box::new(arguments)) })
    }

    /// The start of a scene's simulation.
    pub(crate) fn of_scene(scene: &Bound<'_, Scene>) -> PyResult<Self> {
        let (simulation, instruments) = scene.get().built(scene.py())?;
        let made_of = MadeOf::Scene(scene.clone().unbind());
        Ok(Self { instruments, simulation: Mutex::new(simulation), made_of })
    }

    /// The same start where parameters have other values.
    pub(crate) fn changed(this: &Py<Self>, values: Vec<(String, f64)>) -> PyResult<Self> {
        let start = this.get();
        let simulation = changed(&start.simulation(), &values)?;
        let mut instruments = start.instruments.clone();
        for (instrument, now) in instruments.iter_mut().zip(simulation.stack().devices()) {
            instrument.device = now.clone();
        }
        let this = Python::attach(|py| this.clone_ref(py));
        Ok(Self { instruments, simulation: Mutex::new(simulation), made_of: MadeOf::Changed(this, values) })
    }

    /// The start of a simulation from this one where parameters have other values. Fields that were set later are not part of
    /// a start, and neither are their values.
    pub(crate) fn changed_with(
        this: &Py<Self>,
        now: &insertion::Simulation,
        mut values: Vec<(String, f64)>,
    ) -> PyResult<Self> {
        let start = this.get().simulation();
        let specs =
            |of: &insertion::Simulation| of.fields()[1].iter().map(|field| field.spec()).collect::<Vec<_>>();
        if specs(&start) != specs(now) {
            let stack = start.stack();
            let is_field = |word: &str| {
                matches!(Parameter::named(word, stack).as_deref(), Ok([Parameter::Field { .. }]))
            };
            values.retain(|(word, _)| !is_field(word));
        }
        Self::changed(this, values)
    }

    /// The simulation; Ctrl-C ends its long steps.
    pub(crate) fn simulation(&self) -> insertion::Simulation {
        let mut simulation = self.simulation.lock().unwrap_or_else(PoisonError::into_inner).clone();
        simulation.stop_when(signalled);
        simulation
    }
}

#[pymethods]
impl Start {
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (py, start) = (slf.py(), slf.get());
        match &start.made_of {
            MadeOf::Arguments(vessel, arguments) => {
                let arguments = serde_json::to_string(arguments)
                    .map_err(|e| InputError::new_err(format!("the simulation cannot be written: {e}")))?;
                let parts = (vessel, start.instruments.clone(), arguments).into_pyobject(py)?;
                Ok((slf.get_type().getattr("_of_arguments")?, parts.into_any()))
            }
            MadeOf::Scene(scene) => {
                Ok((slf.get_type().getattr("_of_scene")?, (scene,).into_pyobject(py)?.into_any()))
            }
            MadeOf::Changed(start, values) => {
                let parts = (start, values.clone()).into_pyobject(py)?;
                Ok((slf.get_type().getattr("_changed")?, parts.into_any()))
            }
        }
    }

    #[staticmethod]
    fn _of_arguments(
        py: Python<'_>,
        vessel: Py<Vessel>,
        instruments: List<Instrument>,
        arguments: &str,
    ) -> PyResult<Self> {
        let arguments = serde_json::from_str(arguments)
            .map_err(|e| InputError::new_err(format!("the arguments of a simulation: {e}")))?;
        Self::of_arguments(py, vessel, instruments.0, arguments)
    }

    #[staticmethod]
    fn _changed(start: Py<Self>, values: Vec<(String, f64)>) -> PyResult<Self> {
        Self::changed(&start, values)
    }

    #[staticmethod]
    fn _of_scene(scene: &Bound<'_, Scene>) -> PyResult<Self> {
        Self::of_scene(scene)
    }
}

/// A simulation in its state, where the parameters of these words have other values.
pub(crate) fn changed(
    simulation: &insertion::Simulation,
    values: &[(String, f64)],
) -> PyResult<insertion::Simulation> {
    each(simulation, "changed", values).and_then(|values| simulation.changed(&values)).map_err(exception)
}

/// The parameters of words that stand for one each, with their numbers.
pub(crate) fn each(
    simulation: &insertion::Simulation,
    name: &str,
    numbers: &[(String, f64)],
) -> Result<Vec<(Parameter, f64)>, Error> {
    let one = |(word, number): &(String, f64)| match Parameter::named(word, simulation.stack())?[..] {
        [parameter] => Ok((parameter, *number)),
        _ => Err(Error::parameter(name, format!("{word:?}"), "stands for several: name each")),
    };
    numbers.iter().map(one).collect()
}

impl Arguments {
    /// Instruments as a stack of the library.
    fn stack(&self, instruments: &[Instrument]) -> PyResult<Stack> {
        let count = instruments.len();
        let reported = [
            ("names", self.names.as_ref().map(Vec::len)),
            ("friction", self.friction.as_ref().map(Vec::len)),
            ("may_lead", self.may_lead.as_ref().map(Vec::len)),
            ("clearance", self.clearance.as_ref().map(Vec::len)),
        ];
        for (name, given) in reported {
            if let Some(given) = given.filter(|given| *given != count) {
                let remedy = format!("there are {count} instruments: give one for each");
                return Err(refuse(name, given, &remedy));
            }
        }
        let names = self.names.clone();
        let names = names.unwrap_or_else(|| (0..count).map(|index| format!("instrument {index}")).collect());
        let may_lead = self.may_lead.clone().unwrap_or_else(|| vec![true; count]);
        let each = instruments.iter().zip(names).zip(may_lead);
        let each = each.map(|((one, name), may_lead)| device::Instrument {
            name,
            device: one.device.clone(),
            may_lead,
        });
        let stack = match instruments {
            [only] => Stack::from(only.device.clone()),
            _ => Stack::new(each.collect()).map_err(exception)?,
        };
        let stack = match &self.friction {
            Some(friction) => stack.with_friction(friction.clone()).map_err(exception)?,
            None => stack,
        };
        match &self.clearance {
            Some(plays) => stack.with_clearance(plays.clone()).map_err(exception),
            None => Ok(stack),
        }
    }
}

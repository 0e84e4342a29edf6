//! Whole methods that answer a command with the next equilibrium, behind one trait.

pub mod kirchhoff;
pub mod li2011;
mod state;

pub use state::{Content, NodesState, State, check_inserted};

use serde::{Deserialize, Serialize};

use crate::Result;
use crate::contact::Counters;
use crate::insertion::{Command, StepReport, Surroundings};
use crate::rod::{PLAIN, TWISTED};
use crate::shape::Shape;
use crate::vessel::{NoStore, WallStore};
use kirchhoff::{Kirchhoff, KirchhoffOptions};
use li2011::{Li2011, Li2011Options, LinearSolver};

/// A method keeps its own unknowns from step to step and moves them by commands.
///
/// What the next step depends on is its [`State`]; what it works with besides is a workspace, which may be dropped at any moment.
pub trait Method: Send {
    /// Carries out one command and finds the equilibrium after it.
    ///
    /// After an error the state is what it was before the command, to the bit.
    ///
    /// # Errors
    /// A command that the device or the method cannot follow (input), or an equilibrium not found (computation).
    fn step(&mut self, surroundings: &Surroundings<'_>, command: Command) -> Result<()>;

    /// The inserted centre line.
    fn shape(&self) -> &Shape;

    /// What the last step found.
    fn report(&self) -> &StepReport;

    /// Questions about the wall since the method was made; those of the one it was cloned from are among them.
    fn counters(&self) -> Counters {
        Counters::default()
    }

    /// All that the next step depends on.
    fn state(&self) -> State;

    /// Goes on from `state`. After an error nothing has changed.
    ///
    /// # Errors
    /// A state of another method, vessel or device, as far as that shows.
    fn restore(&mut self, surroundings: &Surroundings<'_>, state: &State) -> Result<()>;

    /// Drops what makes steps fast and no other: the next one makes it anew.
    fn drop_workspace(&mut self) {}

    /// The method in the same state.
    fn boxed_clone(&self) -> Box<dyn Method>;
}

/// A method by name, with its options: the `[method]` table of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name")]
pub enum MethodChoice {
    /// The exact rod in equilibrium with the wall.
    #[serde(rename = "kirchhoff")]
    Kirchhoff(KirchhoffOptions),
    /// Li et al. 2011 with the paper's dense solve.
    #[serde(rename = "li2011-dense")]
    Li2011Dense(Li2011Options),
    /// Li et al. 2011, the same equations solved in O(n).
    #[serde(rename = "li2011-banded")]
    Li2011Banded(Li2011Options),
}

impl Default for MethodChoice {
    fn default() -> Self {
        Self::Kirchhoff(KirchhoffOptions::default())
    }
}

impl MethodChoice {
    /// The name used in scene files and results.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Kirchhoff(_) => kirchhoff::NAME,
            Self::Li2011Dense(_) => LinearSolver::Dense.method(),
            Self::Li2011Banded(_) => LinearSolver::Banded.method(),
        }
    }

    /// The method at rest at the sheath, nothing inserted.
    ///
    /// # Errors
    /// Options out of range.
    pub fn start(&self, surroundings: &Surroundings<'_>) -> Result<Box<dyn Method>> {
        self.start_from(surroundings, &NoStore)
    }

    /// As [`MethodChoice::start`], with the wall that is felt from `store`.
    ///
    /// # Errors
    /// As [`MethodChoice::start`].
    pub fn start_from(
        &self,
        surroundings: &Surroundings<'_>,
        store: &dyn WallStore,
    ) -> Result<Box<dyn Method>> {
        Ok(match self {
            // A shape turns with the device, and friction twists it.
            Self::Kirchhoff(options) if surroundings.device.is_shaped() || surroundings.properties.rubs() => {
                Box::new(Kirchhoff::<TWISTED>::new(*options, surroundings, store)?)
            }
            Self::Kirchhoff(options) => Box::new(Kirchhoff::<PLAIN>::new(*options, surroundings, store)?),
            Self::Li2011Dense(options) => Box::new(Li2011::new(*options, LinearSolver::Dense, surroundings)?),
            Self::Li2011Banded(options) => {
                Box::new(Li2011::new(*options, LinearSolver::Banded, surroundings)?)
            }
        })
    }
}

//! All methods by name, with their options: the possible `[method]` tables of a scene.

use endowire_core::insertion::Surroundings;
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::methods::{Method, MethodChoice};
use endowire_core::vessel::WallStore;
use endowire_core::{Error, Result};
use serde::de::value::{Error as NotKnown, MapDeserializer};
use serde::{Deserialize, Serialize};

use crate::li2011::{Li2011, Li2011Options, LinearSolver};
use crate::options::{
    BeamFemDampedOptions, BeamFemOptions, ChordEnergyOptions, DiscreteRodOptions, MassSpringOptions,
    RigidLinksOptions,
};
use crate::{BeamFem, ChordEnergy, DiscreteRod, MassSpring, RigidLinks, RodModel};

/// A scene with any method as `[method]`.
pub type Scene = endowire_core::scene::SceneOf<AnyMethod>;

/// Names of all methods, this project's first.
pub const NAMES: [&str; 9] = [
    "kirchhoff",
    "li2011-dense",
    "li2011-banded",
    "rigid-links",
    "mass-spring",
    "beam-fem",
    "beam-fem-damped",
    "chord-energy",
    "discrete-rod",
];

/// Names of the methods that are a [`RodModel`]: all except `kirchhoff` and the two of Li et al. 2011.
pub const MODEL_NAMES: &[&str] = NAMES.split_at(3).1;

/// A method with its options.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name")]
#[allow(clippy::large_enum_variant, reason = "there is one of a scene, and it is copied as it is")]
pub enum AnyMethod {
    /// The exact rod in equilibrium with the wall.
    #[serde(rename = "kirchhoff")]
    Kirchhoff(KirchhoffOptions),
    /// Li et al. 2011 with the paper's dense solve.
    #[serde(rename = "li2011-dense")]
    Li2011Dense(Li2011Options),
    /// Li et al. 2011, the same equations solved in O(n).
    #[serde(rename = "li2011-banded")]
    Li2011Banded(Li2011Options),
    /// Dawson et al. 2000.
    #[serde(rename = "rigid-links")]
    RigidLinks(RigidLinksOptions),
    /// Wang et al. 2007.
    #[serde(rename = "mass-spring")]
    MassSpring(MassSpringOptions),
    /// Cotin et al. 2005.
    #[serde(rename = "beam-fem")]
    BeamFem(BeamFemOptions),
    /// The same with damping, unlike the paper.
    #[serde(rename = "beam-fem-damped")]
    BeamFemDamped(BeamFemDampedOptions),
    /// Konings et al. 2003.
    #[serde(rename = "chord-energy")]
    ChordEnergy(ChordEnergyOptions),
    /// Bergou et al. 2008, Tang et al. 2010.
    #[serde(rename = "discrete-rod")]
    DiscreteRod(DiscreteRodOptions),
}

impl Default for AnyMethod {
    fn default() -> Self {
        Self::Kirchhoff(KirchhoffOptions::default())
    }
}

impl AnyMethod {
    /// The method of this name with default options.
    ///
    /// # Errors
    /// A name that is not in [`NAMES`].
    pub fn named(name: &str) -> Result<Self> {
        let table = [("name", name)].into_iter();
        Self::deserialize(MapDeserializer::<_, NotKnown>::new(table))
            .map_err(|_| Error::parameter("method", name, format!("the methods are {}", NAMES.join(", "))))
    }

    /// The same method with another element length.
    #[must_use]
    pub fn with_element_mm(mut self, element_mm: f64) -> Self {
        *match &mut self {
            Self::Kirchhoff(options) => &mut options.element_mm,
            Self::Li2011Dense(options) | Self::Li2011Banded(options) => &mut options.element_mm,
            Self::RigidLinks(options) => &mut options.element_mm,
            Self::MassSpring(options) => &mut options.element_mm,
            Self::BeamFem(options) => &mut options.element_mm,
            Self::BeamFemDamped(options) => &mut options.element_mm,
            Self::ChordEnergy(options) => &mut options.element_mm,
            Self::DiscreteRod(options) => &mut options.element_mm,
        } = element_mm;
        self
    }
}

impl MethodChoice for AnyMethod {
    fn name(&self) -> &'static str {
        match self {
            Self::Kirchhoff(options) => options.name(),
            Self::Li2011Dense(_) => LinearSolver::Dense.method(),
            Self::Li2011Banded(_) => LinearSolver::Banded.method(),
            Self::RigidLinks(_) => "rigid-links",
            Self::MassSpring(_) => "mass-spring",
            Self::BeamFem(_) => "beam-fem",
            Self::BeamFemDamped(_) => "beam-fem-damped",
            Self::ChordEnergy(_) => "chord-energy",
            Self::DiscreteRod(_) => "discrete-rod",
        }
    }

    fn takes_several(&self) -> bool {
        matches!(self, Self::Kirchhoff(options) if options.takes_several())
    }

    fn takes_steering(&self) -> bool {
        matches!(self, Self::Kirchhoff(options) if options.takes_steering())
    }

    fn takes_soft_planes(&self) -> bool {
        matches!(self, Self::Kirchhoff(options) if options.takes_soft_planes())
    }

    fn check_detach(&self) -> Result<()> {
        match self {
            Self::Kirchhoff(options) => options.check_detach(),
            _ => {
                Err(Error::parameter("method.name", self.name(), "this method knows no coils: use kirchhoff"))
            }
        }
    }

    fn start(&self, surroundings: &Surroundings<'_>, store: &dyn WallStore) -> Result<Box<dyn Method>> {
        let paper = |options: &Li2011Options, solver| -> Result<Box<dyn Method>> {
            Ok(Box::new(Li2011::new(*options, solver, surroundings, store)?))
        };
        match self {
            Self::Kirchhoff(options) => options.start(surroundings, store),
            Self::Li2011Dense(options) => paper(options, LinearSolver::Dense),
            Self::Li2011Banded(options) => paper(options, LinearSolver::Banded),
            Self::RigidLinks(options) => options.inserted()?.start(surroundings, store),
            Self::MassSpring(options) => options.inserted()?.start(surroundings, store),
            Self::BeamFem(options) => options.inserted()?.start(surroundings, store),
            Self::BeamFemDamped(options) => options.inserted()?.start(surroundings, store),
            Self::ChordEnergy(options) => options.inserted()?.start(surroundings, store),
            Self::DiscreteRod(options) => options.inserted()?.start(surroundings, store),
        }
    }
}

/// The model of this name with the best parameters for one static solve from the unloaded shape, as found by the
/// example `tune`: there the motion is as long as the device. `None` for methods that are not a [`RodModel`].
pub fn static_model(name: &str) -> Option<Box<dyn RodModel>> {
    Some(match name {
        "rigid-links" => Box::new(RigidLinks::default()),
        "mass-spring" => Box::new(MassSpring::default()),
        "beam-fem" => Box::new(BeamFem::default()),
        "beam-fem-damped" => Box::new(BeamFem::damped()),
        "chord-energy" => Box::new(ChordEnergy::default()),
        "discrete-rod" => Box::new(DiscreteRod::default()),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use endowire_core::input::parse_toml;

    use super::*;

    #[test]
    fn every_name_is_that_of_a_method_and_of_its_model() {
        for name in NAMES {
            assert_eq!(AnyMethod::named(name).map(|method| method.name()).ok(), Some(name));
            assert_eq!(
                static_model(name).map(|model| model.name() == name),
                MODEL_NAMES.contains(&name).then_some(true)
            );
        }
        let error = AnyMethod::named("kirchoff").map_err(|e| e.to_string());
        assert!(error.is_err_and(|e| e.contains("kirchoff") && e.contains("kirchhoff, li2011-dense")));
    }

    #[test]
    fn a_scene_of_the_core_names_the_exact_rod_alone_and_one_of_this_crate_all() {
        let read = |name: &str| {
            let text = format!("[vessel]\n[device]\n[sheath]\n[method]\nname = \"{name}\"\n");
            let file = Path::new("scene.toml");
            let core = parse_toml::<endowire_core::scene::Scene>(&text, file).map_err(|e| e.to_string());
            (core.err(), parse_toml::<Scene>(&text, file).map_err(|e| e.to_string()).err())
        };
        assert_eq!(read("kirchhoff"), (None, None));
        for name in &NAMES[1..] {
            let (core, here) = read(name);
            assert!(core.is_some_and(|e| e.contains(name) && e.contains("expected `kirchhoff`")), "{name}");
            assert_eq!(here, None);
        }
        let (core, here) = read("kirchoff");
        for reported in [core, here] {
            assert!(reported.is_some_and(|e| e.contains("did you mean `kirchhoff`?")));
        }
    }
}

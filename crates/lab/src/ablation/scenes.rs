//! Hard scenes, run with numbers of the solver changed.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_core::methods::OwnMethod;
use endowire_core::scene::Scene;
use endowire_core::vessel::{CentrelineRecipe, CentrelineTree, Lumen, NoStore, Wall, WallRecipe, WallStore};
use endowire_core::{Error, Result, Vec3};

use super::rows::Row;
use crate::sequences::APART_MM;

/// What a scene took, and where it ended.
#[derive(Debug, Clone)]
pub(super) struct Outcome {
    pub(super) iterations: u64,
    /// Linear solves: factorisations.
    pub(super) solves: u64,
    pub(super) seconds: f64,
    pub(super) jumps: usize,
    /// Commands that ended without an equilibrium.
    pub(super) unbalanced: usize,
    pub(super) tip_mm: Vec3,
    /// The error that ended it.
    pub(super) end: Option<String>,
}

/// A scene of `benches/hard`.
pub(super) struct Hard {
    pub(super) name: String,
    /// How far tips may be apart at its end, mm.
    pub(super) apart_mm: f64,
    path: PathBuf,
    scene: Scene,
    walls: Option<(Lumen, Felt)>,
}

/// The contact surface of a scene: no row changes its recipe, so it is made once.
#[derive(Default)]
struct Felt {
    walls: RefCell<Vec<Wall>>,
    next: Cell<usize>,
}

impl WallStore for Felt {
    fn wall(&self, recipe: &WallRecipe<'_>) -> Result<Wall> {
        let index = self.next.replace(self.next.get() + 1);
        let mut walls = self.walls.borrow_mut();
        if index >= walls.len() {
            walls.push(recipe.make()?);
        }
        Ok(walls[index].clone())
    }

    fn centreline(&self, recipe: &CentrelineRecipe<'_>) -> Result<CentrelineTree> {
        recipe.make()
    }
}

/// All scenes of `benches/hard`, by name.
pub(super) fn all(repository: &Path) -> Result<Vec<Hard>> {
    let read = |path: PathBuf| {
        let scene = Scene::read(&path)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let apart_mm = APART_MM[usize::from(scene.vessel.wall.friction > 0.0)];
        Ok(Hard { name, apart_mm, path, scene, walls: None })
    };
    crate::hard::scenes(repository)?.into_iter().map(read).collect()
}

impl Hard {
    /// Makes the walls, once.
    pub(super) fn prepare(&mut self) -> Result<()> {
        if self.walls.is_none() {
            // A script with a mistake ends here, not as a scene that fails.
            self.scene.steps(&self.scene.stack()?, &NoStore)?;
            self.walls = Some((self.scene.lumen(&NoStore)?, Felt::default()));
        }
        Ok(())
    }

    /// Carries out its script with the numbers of a row, within a time.
    pub(super) fn run(&self, row: Option<&Row>, limit_s: Option<f64>) -> Result<Outcome> {
        let Some((lumen, felt)) = &self.walls else {
            return Err(Error::parameter("scene", self.name.as_str(), "prepare it first"));
        };
        // Scenes cannot be copied.
        let mut own = Scene::from_toml(self.scene.text(), &self.path)?;
        let OwnMethod::Kirchhoff(options) = &mut own.method;
        if let Some(row) = row {
            (row.change)(&mut options.tuning);
        }
        felt.next.set(0);
        let most_s = limit_s.unwrap_or(f64::INFINITY);
        let run = catch_unwind(AssertUnwindSafe(|| carry_out(&own, lumen, felt, most_s)));
        Ok(run.unwrap_or_else(|_| Outcome { end: Some("it panics".to_owned()), ..Outcome::none() }))
    }
}

impl Outcome {
    fn none() -> Self {
        let (iterations, solves, seconds, jumps, unbalanced) = (0, 0, 0.0, 0, 0);
        Self { iterations, solves, seconds, jumps, unbalanced, tip_mm: Vec3::zeros(), end: None }
    }
}

/// Carries out a scene's script.
fn carry_out(scene: &Scene, lumen: &Lumen, felt: &Felt, most_s: f64) -> Outcome {
    let mut outcome = Outcome::none();
    if let Err(error) = go(scene, lumen, felt, most_s, &mut outcome) {
        outcome.end = Some(error.to_string());
    }
    outcome
}

fn go(scene: &Scene, lumen: &Lumen, felt: &Felt, most_s: f64, outcome: &mut Outcome) -> Result<()> {
    let mut simulation = scene.simulation_in(lumen.clone(), felt)?;
    let script = scene.steps(simulation.stack(), &NoStore)?;
    let begun = Instant::now();
    simulation.stop_when(move || begun.elapsed().as_secs_f64() > most_s);
    let mut run = script.begin();
    let mut done = Ok(());
    while let Some(step) = run.next(&simulation)? {
        let step = step.into_owned();
        run.carried_out();
        match step.carry_out(&mut simulation) {
            Ok(report) => {
                outcome.iterations += u64::from(report.iterations);
                outcome.solves += u64::from(report.solves);
                outcome.jumps += usize::from(report.jumped);
                outcome.unbalanced += usize::from(!report.converged);
            }
            Err(error) => {
                done = Err(error);
                break;
            }
        }
    }
    outcome.seconds = begun.elapsed().as_secs_f64();
    outcome.tip_mm = simulation.shape().tip_mm().unwrap_or_default();
    done
}

//! One insertion of the matrix.

use serde::Serialize;

use super::{Cell, ITERATIONS_PER_MM, Surface};
use endowire_core::insertion::{
    Command, ScriptLine, Simulation, StepReport, WallProperties, script_commands,
};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::WallStore;
use endowire_core::{Error, PhysicalEnd, Result};

/// How an insertion ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// All commands were carried out.
    Arrived,
    /// The tip has left the vessel through an opening.
    Left,
    /// The vessel is narrower than the device.
    Blocked,
    /// A computation failed, or took too long.
    Failed,
    /// The input was rejected before the first command.
    Refused,
}

impl Ending {
    /// Whether it is a valid result of a wire in a vessel.
    pub fn is_good(self) -> bool {
        matches!(self, Self::Arrived | Self::Left | Self::Blocked)
    }

    /// One word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Arrived => "arrived",
            Self::Left => "left",
            Self::Blocked => "blocked",
            Self::Failed => "FAILED",
            Self::Refused => "refused",
        }
    }
}

/// One insertion and its result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellRow {
    /// Name: surface, wire and values.
    pub name: String,
    /// Surface.
    pub surface: String,
    /// Wire, its diameter in inches.
    pub wire: String,
    /// The parameters.
    #[serde(flatten)]
    pub cell: Cell,
    /// How it ended.
    pub ending: Ending,
    /// Why it did not arrive.
    pub message: Option<String>,
    /// Requested length, mm.
    pub length_mm: f64,
    /// Length inserted, mm.
    pub inserted_mm: f64,
    /// Number of commands requested.
    pub commands: usize,
    /// Commands carried out.
    pub steps: usize,
    /// Newton iterations of all steps.
    pub iterations: u64,
    /// Newton iterations of the worst step.
    pub most_iterations: u32,
    /// Newton iterations of the worst step per millimetre that it advanced.
    pub most_iterations_per_mm: f64,
    /// Steps that took more than [`ITERATIONS_PER_MM`].
    pub slow_steps: usize,
    /// Largest number of sub-steps of a command.
    pub most_substeps: u32,
    /// Steps in which a jump released energy.
    pub jumps: usize,
    /// Largest penetration reported by a step, mm.
    pub max_penetration_mm: f64,
    /// Sub-steps with relaxation as last resort.
    pub relaxations: u64,
    /// Steps after which the device's axis passed through a given triangle: where it has sunk into a soft wall by
    /// more than its radius, or where the contact surface is behind the given one.
    pub crossings: usize,
    /// Inserted length at the first of them, mm.
    pub first_crossing_mm: Option<f64>,
    /// Largest amount by which the reported penetration there was too small, mm.
    pub missing_mm: f64,
    /// The same behind the triangles of the contact surface, mm.
    pub missing_felt_mm: f64,
    /// Steps after which a device was behind the given triangles by more than reported plus their stated deviation,
    /// or behind those of the contact surface by more than reported.
    pub unreported: usize,
    /// Largest push force, N.
    pub most_push_force_n: f64,
    /// Time of the slowest command, including a failed one, ms.
    pub slowest_ms: f64,
    /// Median time of a command, ms.
    pub median_ms: f64,
    /// Time to prepare the wall for the device, s.
    pub setup_s: f64,
    /// Total time, including checks, s.
    pub total_s: f64,
}

/// Possible error of the largest deviation, which is measured at sample points, mm.
const MISSED_MM: f64 = 0.005;

impl Cell {
    /// The motion of the hand in `surface`.
    pub fn script(&self, surface: &Surface) -> ScriptLine {
        // Whole increments: the wire is longer than the surface requires by its soft end.
        let steps = (surface.length_mm / self.increment_mm - 1e-9).ceil().max(1.0);
        ScriptLine {
            advance_mm: Some(steps * self.increment_mm),
            rotate_deg: (self.turn_deg != 0.0).then_some(steps * self.turn_deg),
            step_mm: Some(self.increment_mm),
            step_deg: (self.turn_deg != 0.0).then_some(self.turn_deg),
            ..ScriptLine::default()
        }
    }

    /// The wall.
    pub fn properties(&self) -> WallProperties {
        WallProperties {
            modulus_n_per_mm2: self.modulus_n_per_mm2,
            friction: self.friction,
            ..WallProperties::default()
        }
    }

    /// The name of the cell in `surface`: surface, wire and values.
    pub fn name_in(&self, surface: &Surface) -> String {
        format!("{} {} {}", surface.name, surface.places[self.wire].wire.name(), self.name())
    }

    fn simulation(&self, surface: &Surface, store: &dyn WallStore) -> Result<Simulation> {
        let place = &surface.places[self.wire];
        let method = KirchhoffOptions { element_mm: self.element_mm, ..KirchhoffOptions::default() };
        let device = place.wire.device(surface.length_mm)?;
        Simulation::builder(surface.wall.clone(), device, place.sheath)
            .properties(self.properties())
            .method(&method)
            .store(store)
            .build()
    }
}

impl CellRow {
    /// An empty row of `cell`.
    pub fn new(surface: &Surface, cell: &Cell) -> Self {
        Self {
            name: cell.name_in(surface),
            surface: surface.name.clone(),
            wire: surface.places[cell.wire].wire.name(),
            cell: *cell,
            ending: Ending::Arrived,
            message: None,
            length_mm: surface.length_mm,
            inserted_mm: 0.0,
            commands: 0,
            steps: 0,
            iterations: 0,
            most_iterations: 0,
            most_iterations_per_mm: 0.0,
            slow_steps: 0,
            most_substeps: 0,
            jumps: 0,
            max_penetration_mm: 0.0,
            relaxations: 0,
            crossings: 0,
            first_crossing_mm: None,
            missing_mm: 0.0,
            missing_felt_mm: 0.0,
            unreported: 0,
            most_push_force_n: 0.0,
            slowest_ms: 0.0,
            median_ms: 0.0,
            setup_s: 0.0,
            total_s: 0.0,
        }
    }

    /// Completes the row.
    pub fn end(&mut self, ending: Ending, message: String) {
        (self.ending, self.message) = (ending, Some(message));
    }

    /// Adds the report of a step.
    fn count(&mut self, report: &StepReport, command: Command) {
        self.steps += 1;
        self.inserted_mm = report.inserted_mm;
        self.iterations += u64::from(report.iterations);
        self.most_iterations = self.most_iterations.max(report.iterations);
        let per_mm = f64::from(report.iterations) / command.advance_mm.abs().max(f64::MIN_POSITIVE);
        self.most_iterations_per_mm = self.most_iterations_per_mm.max(per_mm);
        self.slow_steps += usize::from(per_mm > ITERATIONS_PER_MM);
        self.most_substeps = self.most_substeps.max(report.substeps);
        self.jumps += usize::from(report.jumped);
        self.relaxations += u64::from(report.relaxations);
        self.max_penetration_mm = self.max_penetration_mm.max(report.max_penetration_mm);
        self.most_push_force_n = self.most_push_force_n.max(report.push_force_n);
    }

    /// Whether the device passes through given triangles or those of the contact surface, and whether its reported
    /// penetration there is correct.
    fn check(&mut self, surface: &Surface, simulation: &Simulation) {
        let given = surface.given.missing_mm(&surface.wall, simulation);
        let felt = surface.felt.missing_mm(&surface.even, simulation);
        if given.is_some() {
            self.crossings += 1;
            self.first_crossing_mm = self.first_crossing_mm.or(Some(self.inserted_mm));
        }
        let (given_mm, felt_mm) = (given.unwrap_or(0.0), felt.unwrap_or(0.0));
        self.missing_mm = self.missing_mm.max(given_mm);
        self.missing_felt_mm = self.missing_felt_mm.max(felt_mm);
        let place = &surface.places[self.cell.wire];
        self.unreported +=
            usize::from(given_mm > place.stated_mm + MISSED_MM || felt_mm > place.smooth_mm + MISSED_MM);
    }
}

/// Runs a cell, with the contact surface for its wire from `store`. `clock` returns seconds since any fixed time; a cell
/// that takes more than `limit_s` fails.
pub fn run(
    surface: &Surface,
    cell: &Cell,
    store: &dyn WallStore,
    limit_s: f64,
    clock: &dyn Fn() -> f64,
) -> CellRow {
    let begun = clock();
    let mut row = CellRow::new(surface, cell);
    let mut times_ms = Vec::new();
    let simulation = cell.simulation(surface, store);
    insert(&mut row, &mut times_ms, (surface, simulation), cell, (begun, limit_s), clock);
    times_ms.sort_by(f64::total_cmp);
    row.median_ms = times_ms.get(times_ms.len() / 2).copied().unwrap_or(0.0);
    row.slowest_ms = times_ms.last().copied().unwrap_or(0.0);
    row.total_s = clock() - begun;
    row
}

fn insert(
    row: &mut CellRow,
    times_ms: &mut Vec<f64>,
    (surface, simulation): (&Surface, Result<Simulation>),
    cell: &Cell,
    (begun, limit_s): (f64, f64),
    clock: &dyn Fn() -> f64,
) {
    let (mut simulation, list) = match simulation
        .and_then(|s| script_commands(&[cell.script(surface)], s.device()).map(|list| (s, list)))
    {
        Ok(ready) => ready,
        Err(error) => {
            let ending = if error.is_input() { Ending::Refused } else { Ending::Failed };
            return row.end(ending, error.to_string());
        }
    };
    row.setup_s = clock() - begun;
    row.commands = list.len();
    for command in list {
        if clock() - begun > limit_s {
            row.end(Ending::Failed, format!("too slow: not done within {limit_s} s"));
            break;
        }
        let before = clock();
        let result = simulation.step(command).cloned();
        times_ms.push(1e3 * (clock() - before));
        match result {
            Ok(report) => {
                row.count(&report, command);
                if !report.converged {
                    row.end(Ending::Failed, "a step ended without an equilibrium".to_owned());
                    break;
                }
                row.check(surface, &simulation);
            }
            Err(error) => {
                let ending = match &error {
                    Error::End(PhysicalEnd::Left { .. }) => Ending::Left,
                    Error::End(PhysicalEnd::Blocked { .. }) => Ending::Blocked,
                    _ => Ending::Failed,
                };
                row.end(ending, error.to_string());
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crossing::CrossingTest;
    use crate::surfaces::surface::straight_tube;
    use crate::surfaces::{cells, surfaces_in};
    use endowire_core::vessel::{NoStore, Wall};

    fn tube(sidecar: &str, length_mm: f64) -> Surface {
        let folder = tempfile::tempdir().unwrap();
        straight_tube(length_mm).write(&folder.path().join("tube.ply")).unwrap();
        std::fs::write(folder.path().join("tube.toml"), sidecar).unwrap();
        Surface::read(&surfaces_in(folder.path()).unwrap()[0], &NoStore).unwrap()
    }

    #[test]
    fn a_tube_is_gone_through_left_refused_or_too_slow() {
        let row =
            |surface: &Surface, limit_s: f64| run(surface, &cells(1, false)[3], &NoStore, limit_s, &|| 0.5);
        let surface = tube("length_mm = 30.0", 40.0);
        assert_eq!((surface.places.len(), surface.skipped.len()), (2, 0));
        let arrived = row(&surface, 1.0);
        assert_eq!(
            (arrived.ending, arrived.steps, arrived.crossings),
            (Ending::Arrived, 30, 0),
            "{arrived:?}"
        );
        assert!((arrived.inserted_mm - 30.0).abs() < 1e-9 && arrived.iterations > 0);
        assert_eq!(arrived.name, "tube.ply 0.014 step1 el1 mu0.1 k100 turn0");
        assert_eq!(row(&surface, -1.0).message.unwrap(), "too slow: not done within -1 s");

        let two = tube("device_radius_mm = [0.3, 4.5]", 40.0);
        assert_eq!(two.skipped, ["0.354 is too thick at the sheath"]);
        let left = row(&two, 1.0);
        assert_eq!(left.ending, Ending::Left, "{left:?}");
        assert!(left.ending.is_good() && left.inserted_mm > 35.0);

        let outside =
            tube("device_radius_mm = 0.3\n[sheath]\nposition_mm = [9, 0, 0]\ndirection = [0, 0, 1]", 40.0);
        assert_eq!(row(&outside, 1.0).ending, Ending::Refused);
    }

    /// Counter-check: the triangles that are checked are not those of the insertion.
    #[test]
    fn a_device_beyond_the_given_triangles_is_seen() {
        let start = "length_mm = 60.0\n[sheath]\nposition_mm = [0, 0, 1]\ndirection = [0, 0, 1]";
        let cell = cells(1, false)[3];
        let whole = tube(start, 100.0);
        let free = run(&whole, &cell, &NoStore, 1e9, &|| 0.0);
        assert_eq!((free.ending, free.crossings, free.missing_mm), (Ending::Arrived, 0, 0.0));
        assert_eq!((free.missing_felt_mm, free.unreported), (0.0, 0));
        // A closed tube of 30 mm; the wire gets to 41 mm minus the length its tip bends back.
        let mut closed = whole.wall.closed_mesh();
        closed.vertices_mm.iter_mut().for_each(|v| v.z *= 0.3);
        let mut simulation = cell.simulation(&whole, &NoStore).unwrap();
        let checked = Surface {
            given: CrossingTest::new(&closed),
            wall: Wall::from_surface(&closed).unwrap(),
            ..whole
        };
        for (advance_mm, crossings) in [(25.0, 0), (15.0, 1)] {
            simulation.step(Command::advance(advance_mm)).unwrap();
            let mut row = CellRow::new(&checked, &cell);
            row.check(&checked, &simulation);
            assert_eq!((row.crossings, row.unreported), (crossings, crossings));
            assert_eq!((8.0..11.5).contains(&row.missing_mm), crossings > 0, "{}", row.missing_mm);
        }
    }
}

//! A straight wire, pushed into an anatomy without rotation by the paper's method and by the exact rod, with the same
//! commands.
//!
//! The paper's method has neither rest shape nor twist, so its wire can only be pushed and pulled. It should end
//! where a straight wire of the exact rod ends.

use std::time::Instant;

use endowire_core::Result;
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::vessel::{CentrelinePath, GeneratedWall};

use super::navigation::{Anatomy, Row};
use crate::compare::candidate;

/// The paper's method and ours, with their segment lengths, mm. In the paper's method only nodes touch the wall, so
/// that segments must be as short as the crests at forks.
pub(super) const METHODS: [(&str, f64); 2] = [("li2011-banded", 1.0), ("kirchhoff", 3.0)];
/// Increment, mm.
const STEP_MM: f64 = 1.0;
/// Largest inserted length, mm.
const MOST_MM: f64 = 600.0;

/// A straight wire in an anatomy by one of [`METHODS`], and the results on its way.
struct Wire {
    simulation: Simulation,
    steps: usize,
    unconverged: usize,
    largest_push_n: f64,
    largest_wall_force_n: f64,
    largest_penetration_mm: f64,
    time_s: f64,
    /// Opening through which it has left.
    left: Option<usize>,
    /// Why it cannot advance further.
    failure: Option<String>,
}

impl Wire {
    fn new(anatomy: &Anatomy, made: &GeneratedWall, (method, element_mm): (&str, f64)) -> Result<Self> {
        let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0)?;
        let radius_mm = anatomy.radius_mm;
        let wire = Device::new(vec![
            Section::straight(anatomy.tip_mm, radius_mm, 4.0),
            Section::straight(60.0, radius_mm, 8.0),
            Section::straight(MOST_MM, radius_mm, 20.0),
        ])?;
        let properties = WallProperties::default();
        let simulation =
            candidate::insertion(method, element_mm, made.wall.clone(), properties, wire, sheath)?;
        Ok(Self {
            simulation,
            steps: 0,
            unconverged: 0,
            largest_push_n: 0.0,
            largest_wall_force_n: 0.0,
            largest_penetration_mm: 0.0,
            time_s: 0.0,
            left: None,
            failure: None,
        })
    }

    /// Carries out one push, unless it has ended.
    fn push(&mut self) {
        if self.left.is_some() || self.failure.is_some() {
            return;
        }
        let clock = Instant::now();
        let done = self.simulation.step(Command::advance(STEP_MM)).map(|_| ());
        self.time_s += clock.elapsed().as_secs_f64();
        if let Err(error) = done {
            self.failure = Some(error.to_string());
            return;
        }
        let report = self.simulation.report();
        self.steps += 1;
        self.unconverged += usize::from(!report.converged);
        self.largest_push_n = self.largest_push_n.max(report.push_force_n);
        let force_n: f64 = report.contacts.iter().map(|contact| contact.force_n.max(0.0)).sum();
        self.largest_wall_force_n = self.largest_wall_force_n.max(force_n);
        self.largest_penetration_mm = self.largest_penetration_mm.max(report.max_penetration_mm);
        self.left = report.left_through;
    }
}

/// Both wires at the end of their way.
pub struct Straight {
    wires: [Wire; 2],
    /// Distance between their tips where the first of them ends, and the largest distance before, mm.
    apart_mm: f64,
    largest_apart_mm: f64,
}

impl Straight {
    /// Pushes both wires by the same commands until the first has ended, and then the other to its end.
    ///
    /// # Errors
    /// A wire that cannot be set up.
    pub fn push(anatomy: &Anatomy, made: &GeneratedWall) -> Result<Self> {
        let mut wires = [Wire::new(anatomy, made, METHODS[0])?, Wire::new(anatomy, made, METHODS[1])?];
        let (mut apart_mm, mut largest_apart_mm) = (0.0, 0.0f64);
        for _ in 0..(MOST_MM / STEP_MM) as usize {
            let together = wires.iter().all(|wire| wire.left.is_none() && wire.failure.is_none());
            wires.iter_mut().for_each(Wire::push);
            if together {
                let [a, b] = [0, 1].map(|k| wires[k].simulation.shape().tip_mm().unwrap_or_default());
                apart_mm = (a - b).norm();
                largest_apart_mm = largest_apart_mm.max(apart_mm);
            }
        }
        Ok(Self { wires, apart_mm, largest_apart_mm })
    }

    /// The rows of a target, which ends in the opening `end`, each with the insertion it is of.
    pub fn rows(
        &self,
        (anatomy, target, end): (&Anatomy, &'static str, usize),
        path: &CentrelinePath,
    ) -> Vec<(Row, &Simulation)> {
        let mut rows = Vec::new();
        for (wire, (method, _)) in self.wires.iter().zip(METHODS) {
            let instruments = "straight wire, not turned".to_owned();
            let mut row = Row::new(anatomy.name, target, path.length_mm(), method, instruments);
            let report = wire.simulation.report();
            row.success = wire.left == Some(end);
            row.commands = wire.steps;
            row.inserted_mm = report.inserted_mm;
            row.largest_push_n = wire.largest_push_n;
            row.largest_wall_force_n = wire.largest_wall_force_n;
            row.largest_penetration_mm = wire.largest_penetration_mm;
            row.time_s = wire.time_s;
            row.unconverged = wire.unconverged;
            row.end(&wire.simulation, path);
            row.tip_apart_mm = Some(self.apart_mm);
            row.largest_tip_apart_mm = Some(self.largest_apart_mm);
            row.note = match (&wire.failure, wire.left, method) {
                _ if row.success => String::new(),
                (Some(failure), ..) => failure.clone(),
                (None, None, _) => format!("still in the vessel with {MOST_MM} mm inserted"),
                (None, Some(_), "kirchhoff") => "a straight wire that is not turned goes elsewhere".to_owned(),
                (None, Some(_), _) => {
                    "goes elsewhere, as the exact rod's: the method has no rest shape and no twist to steer by"
                        .to_owned()
                }
            };
            rows.push((row, &wire.simulation));
        }
        rows
    }
}

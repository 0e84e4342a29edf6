//! Numerical stress test of an insertion: run by `endowire verify --stress` in addition to the stress test of the rod
//! alone.
//!
//! A wire is pushed around a bend, with parameters far beyond the usual in every direction at once: walls from jelly
//! to steel, wires from thread to rod, coarse and fine elements, small and large increments, with and without
//! friction. Every combination must converge at every step, or stop with a reason that names the problem.

use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, Wall};
use endowire_core::{Result, Vec3};
use serde::Serialize;

/// Wall moduli, N/mm².
const MODULI: [f64; 3] = [1e-3, 1.0, 1e4];
/// Bending stiffnesses, N·mm².
const STIFFNESSES: [f64; 3] = [1e-2, 10.0, 1e4];
/// Element lengths, mm.
const ELEMENTS: [f64; 3] = [0.2, 2.0, 10.0];
/// Increments, mm.
const INCREMENTS: [f64; 3] = [0.01, 1.0, 20.0];
/// Coefficients of friction.
const FRICTIONS: [f64; 3] = [0.0, 0.1, 0.5];
/// Number of steps of the tested increment.
const STEPS: usize = 5;
/// Their largest total length, mm.
const MOST_MM: f64 = 40.0;
/// Number of steps of 2 mm that first bring the wire to the wall, and bend it.
const APPROACH: usize = 12;

/// One combination of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct InsertionCase {
    /// Wall modulus, N/mm².
    pub modulus_n_per_mm2: f64,
    /// Bending stiffness, N·mm².
    pub bending_stiffness_nmm2: f64,
    /// Element length, mm.
    pub element_mm: f64,
    /// Increment, mm.
    pub increment_mm: f64,
    /// Coefficient of friction.
    pub friction: f64,
}

/// Result of a combination.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InsertionRow {
    /// The combination.
    #[serde(flatten)]
    pub case: InsertionCase,
    /// Steps that converged.
    pub steps: usize,
    /// Newton iterations of all steps, and of the worst.
    pub iterations: u32,
    /// Newton iterations of the worst step.
    pub most_iterations: u32,
    /// Largest number of sub-steps of a step.
    pub most_substeps: u32,
    /// Largest penetration, mm.
    pub max_penetration_mm: f64,
    /// `converged`, or the reason why a step stopped.
    pub outcome: String,
    /// Whether every step converged.
    pub converged: bool,
    /// Whether every step converged, or the last one stopped with a reason and left a state from which the device can
    /// be pulled back.
    pub pass: bool,
}

/// The vessel of the table: 10 mm straight, a quarter circle of radius 20 mm, 40 mm straight; inner diameter 3 mm.
#[derive(Debug)]
pub struct InsertionStress {
    /// Its wall.
    pub wall: Wall,
    /// One millimetre inside its inlet.
    pub sheath: Sheath,
}

impl InsertionStress {
    /// Builds the vessel.
    ///
    /// # Errors
    /// None in practice: the vessel is fixed.
    pub fn new() -> Result<Self> {
        let mut axis: Vec<Vec3> = (0..5).map(|i| Vec3::x() * (2.0 * f64::from(i))).collect();
        axis.extend((0..=15).map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_2 / 15.0).sin_cos();
            Vec3::new(10.0 + 20.0 * sin, 20.0 - 20.0 * cos, 0.0)
        }));
        axis.extend((1..=20).map(|i| Vec3::new(30.0, 20.0 + 2.0 * f64::from(i), 0.0)));
        let nodes = axis.into_iter().enumerate().map(|(i, position_mm)| CentrelineNode {
            position_mm,
            radius_mm: 3.0,
            parent: i.checked_sub(1),
        });
        let made = GeneratedWall::new(&CentrelineTree::new(nodes.collect())?, Resolution::EdgeMm(0.8))?;
        let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0)?;
        Ok(Self { wall: made.wall, sheath })
    }

    /// The combinations.
    pub fn cases(&self) -> Vec<InsertionCase> {
        let mut cases = Vec::new();
        for modulus_n_per_mm2 in MODULI {
            for bending_stiffness_nmm2 in STIFFNESSES {
                for element_mm in ELEMENTS {
                    for increment_mm in INCREMENTS {
                        for friction in FRICTIONS {
                            cases.push(InsertionCase {
                                modulus_n_per_mm2,
                                bending_stiffness_nmm2,
                                element_mm,
                                increment_mm,
                                friction,
                            });
                        }
                    }
                }
            }
        }
        cases
    }

    /// Runs a combination.
    pub fn run(&self, case: &InsertionCase) -> InsertionRow {
        let mut row = InsertionRow {
            case: *case,
            steps: 0,
            iterations: 0,
            most_iterations: 0,
            most_substeps: 0,
            max_penetration_mm: 0.0,
            outcome: "converged".to_owned(),
            converged: true,
            pass: true,
        };
        let mut simulation = match self.start(case) {
            Ok(simulation) => simulation,
            Err(error) => {
                row.outcome = error.to_string();
                (row.converged, row.pass) = (false, false);
                return row;
            }
        };
        let steps = ((MOST_MM / case.increment_mm) as usize).clamp(1, STEPS);
        let approach = std::iter::repeat_n(2.0, APPROACH);
        for advance_mm in approach.chain(std::iter::repeat_n(case.increment_mm, steps)) {
            match simulation.step(Command::advance(advance_mm)) {
                Ok(report) => {
                    row.steps += 1;
                    row.iterations += report.iterations;
                    row.most_iterations = row.most_iterations.max(report.iterations);
                    row.most_substeps = row.most_substeps.max(report.substeps);
                    row.max_penetration_mm = row.max_penetration_mm.max(report.max_penetration_mm);
                    row.pass &= report.converged;
                }
                Err(error) => {
                    row.outcome = reason(&error.to_string());
                    row.converged = false;
                    let before = simulation.report().inserted_mm;
                    row.pass &= simulation.step(Command::retract(0.1 * before)).is_ok();
                    break;
                }
            }
        }
        row
    }

    fn start(&self, case: &InsertionCase) -> Result<Simulation> {
        let properties = WallProperties {
            modulus_n_per_mm2: case.modulus_n_per_mm2,
            friction: case.friction,
            ..WallProperties::default()
        };
        let device = Device::uniform(100.0, 0.45, case.bending_stiffness_nmm2)?;
        let method = KirchhoffOptions { element_mm: case.element_mm, ..KirchhoffOptions::default() };
        Simulation::builder(self.wall.clone(), device, self.sheath)
            .properties(properties)
            .method(&method)
            .build()
    }
}

/// The reason of a failed step without its numbers: after the last colon, without brackets.
fn reason(message: &str) -> String {
    let end = message.find(" (").unwrap_or(message.len());
    let text = &message[..end];
    text.rsplit(": ").next().unwrap_or(text).trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordinary_combinations_converge_and_an_impossible_one_is_no_pass() {
        let stress = InsertionStress::new().unwrap();
        let ordinary = InsertionCase {
            modulus_n_per_mm2: 1.0,
            bending_stiffness_nmm2: 10.0,
            element_mm: 2.0,
            increment_mm: 3.0,
            friction: 0.0,
        };
        let row = stress.run(&ordinary);
        assert!(
            row.pass && row.converged && row.steps == APPROACH + STEPS && row.max_penetration_mm > 0.0,
            "{row:?}"
        );
        assert!(!stress.run(&InsertionCase { element_mm: -1.0, ..ordinary }).pass);
        assert_eq!(
            reason(
                "kirchhoff: no equilibrium between 1 and 2 mm inserted: no step lowers the energy (residual 1e-3)"
            ),
            "no step lowers the energy"
        );
    }
}

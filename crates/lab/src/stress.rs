//! Numerical stress tests, run by `endowire verify --stress`. Every case must converge, or report what failed.

use super::{at_end, section, unit_rod};
use endowire_core::shape::Frame;
use endowire_core::statics::{LoadKind, StaticCase, StaticProblem};
use endowire_core::{Error, Result, Vec3};
use serde::Serialize;

/// Change of bend by one more Newton step, rad, below which a shape has settled, whatever its residual: rows of
/// elements 10,000 times shorter than the rod have a rounding error of 10⁻⁷ of its forces.
const SETTLED: f64 = 1e-8;

/// One stressed case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StressRow {
    /// Description of the case.
    pub name: String,
    /// Whether it converged.
    pub converged: bool,
    /// Whether the state is a minimum.
    pub stable: bool,
    /// Newton iterations.
    pub iterations: usize,
    /// Relative residual.
    pub residual: f64,
    /// Change of bend by one more Newton step, rad: the significance of the residual.
    pub next_bend: f64,
    /// Whether the merit decreased at every step.
    pub monotone: bool,
    /// Why it stopped.
    pub stop: String,
    /// Whether it converged to a minimum, with decreasing merit, and one more step would not matter.
    pub pass: bool,
}

impl StressRow {
    /// The result in a few words.
    pub fn outcome(&self) -> String {
        match self {
            Self { pass: true, .. } => self.stop.clone(),
            Self { converged: false, .. } => format!("failed: {}", self.stop),
            Self { stable: false, .. } => format!("{}, not a minimum", self.stop),
            Self { monotone: false, .. } => format!("{}, not downhill", self.stop),
            _ => format!("{}, not settled", self.stop),
        }
    }

    /// A case that could not be set up.
    fn refused(name: &str, error: &Error) -> Self {
        Self {
            name: name.to_owned(),
            converged: false,
            stable: false,
            iterations: 0,
            residual: f64::NAN,
            next_bend: f64::NAN,
            monotone: false,
            stop: error.to_string(),
            pass: false,
        }
    }
}

/// A case to be run.
#[derive(Debug)]
pub struct StressCase {
    /// Description of the case.
    pub name: String,
    problem: Result<StaticProblem>,
}

impl StressCase {
    fn new(name: String, case: &StaticCase) -> Self {
        Self { name, problem: StaticProblem::new(case) }
    }

    /// Solves it.
    pub fn run(&self) -> StressRow {
        let solved = match &self.problem {
            Ok(problem) => problem.solve_state().map(|s| (problem, s)),
            Err(error) => return StressRow::refused(&self.name, error),
        };
        match solved {
            Ok((problem, solved)) => {
                let report = problem.solution(&solved);
                let next_bend = problem.next_bend(&solved);
                StressRow {
                    name: self.name.clone(),
                    converged: report.converged,
                    stable: report.stable,
                    iterations: report.iterations,
                    residual: report.residual,
                    next_bend,
                    monotone: report.monotone,
                    stop: report.stop.clone(),
                    pass: report.converged && report.stable && report.monotone && next_bend < SETTLED,
                }
            }
            Err(error) => StressRow::refused(&self.name, &error),
        }
    }
}

fn case(elements: usize, length: f64, ei: f64, a: f64) -> StaticCase {
    let mut case = unit_rod(elements);
    case.rod.length = length;
    case.rod.section = vec![section(length, ei)];
    case.load = vec![at_end(LoadKind::Force, [0.0, -a * ei / (length * length), 0.0])];
    case
}

/// The cases of the table.
pub fn cases() -> Vec<StressCase> {
    let mut rows = Vec::new();
    for ei in [1e-3, 1.0, 1e2, 1e5] {
        rows.push(StressCase::new(
            format!("EI = {ei:.0e} N·mm², 300 mm, 100 elements, PL²/EI = 10"),
            &case(100, 300.0, ei, 10.0),
        ));
    }
    for (first, second) in [(1.0, 1e-6), (1e-6, 1.0), (1e6, 1.0), (1e-3, 1e3)] {
        let mut c = case(64, 1.0, 1.0, 0.0);
        c.rod.section = vec![section(0.5, first), section(1.0, second)];
        let soft: f64 = if first < second { first } else { second };
        c.load = vec![at_end(LoadKind::Force, [0.0, -10.0 * soft, 0.0])];
        rows.push(StressCase::new(format!("EI jumps from {first:.0e} to {second:.0e}, 64 elements"), &c));
    }
    {
        // Elements of 0.01 mm beside elements of 50 mm, forced by short sections.
        let mut c = case(14, 500.2, 100.0, 5.0);
        let mut sections = vec![section(250.0, 100.0)];
        for k in 1..=10 {
            sections.push(section(250.0 + 0.01 * f64::from(k), 100.0));
        }
        sections.push(section(500.2, 100.0));
        c.rod.section = sections;
        c.rod.elements = 20;
        rows.push(StressCase::new("elements from 0.01 to 50 mm".to_owned(), &c));
    }
    for slenderness in [1e2, 1e4, 1e6f64] {
        // Slenderness L/ρ with ρ² = EI/EA.
        let mut c = case(64, 1.0, 1.0, 10.0);
        c.rod.section[0].ea = Some(slenderness * slenderness);
        rows.push(StressCase::new(format!("slenderness {slenderness:.0e}, stretchable, PL²/EI = 10"), &c));
    }
    for a in [100.0, 300.0, 1000.0] {
        rows.push(StressCase::new(format!("PL²/EI = {a} across, 128 elements"), &case(128, 1.0, 1.0, a)));
        let mut c = case(128, 1.0, 1.0, 0.0);
        c.load = vec![at_end(LoadKind::Force, [-a, 0.0, 0.0])];
        rows.push(StressCase::new(format!("PL²/EI = {a} against the rod, 128 elements"), &c));
    }
    for n in [1, 2, 1000, 10_000] {
        rows.push(StressCase::new(format!("{n} elements, PL²/EI = 10"), &case(n, 1.0, 1.0, 10.0)));
    }
    let mut seed = 12345u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((seed >> 11) as f64) / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    for (twisted, turn) in [(false, 0.3), (false, 1.0), (true, 0.3), (true, 1.0)] {
        for k in 0..5 {
            let mut c = case(32, 1.0, 1.0, 3.0);
            if twisted {
                c.rod.section[0].gj = Some(0.77);
                c.rod.section[0].rest_curvature = [1.5, 0.5];
            }
            let name = format!(
                "random shape {k}, turns of up to {turn} an element{}",
                if twisted { ", twisted" } else { "" }
            );
            let mut row = StressCase::new(name, &c);
            if let Ok(problem) = &mut row.problem {
                let mut frames: Vec<Frame> = vec![problem.initial.frames[0]];
                for i in 0..32 {
                    let last = frames[i];
                    frames.push(last.transported(turn * noise(), turn * noise()));
                }
                problem.lay(Vec3::zeros(), frames);
            }
            rows.push(row);
        }
    }
    rows
}

//! Numerical stress: what `endowire verify --stress` runs. Every case must converge, or say what failed.

use super::{at_end, section, unit_rod};
use crate::Vec3;
use crate::rod::{Frame, RodState};
use crate::statics::{LoadKind, StaticCase, StaticProblem};
use serde::Serialize;

/// One stressed case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StressRow {
    /// What is stressed and by how much.
    pub name: String,
    /// Whether it converged.
    pub converged: bool,
    /// Whether the state is a minimum.
    pub stable: bool,
    /// Newton iterations.
    pub iterations: usize,
    /// Relative residual.
    pub residual: f64,
    /// Whether the merit fell at every step.
    pub monotone: bool,
    /// Why it stopped.
    pub stop: String,
}

fn run(name: String, problem: &StaticProblem) -> StressRow {
    match problem.solve() {
        Ok(s) => StressRow {
            name,
            converged: s.converged,
            stable: s.stable,
            iterations: s.iterations,
            residual: s.residual,
            monotone: s.monotone,
            stop: s.stop,
        },
        Err(e) => StressRow {
            name,
            converged: false,
            stable: false,
            iterations: 0,
            residual: f64::NAN,
            monotone: false,
            stop: e.to_string(),
        },
    }
}

fn case(elements: usize, length: f64, ei: f64, a: f64) -> StaticCase {
    let mut case = unit_rod(elements);
    case.rod.length = length;
    case.rod.section = vec![section(length, ei)];
    case.load = vec![at_end(LoadKind::Force, [0.0, -a * ei / (length * length), 0.0])];
    case
}

fn solved(name: String, case: &StaticCase) -> StressRow {
    match StaticProblem::new(case) {
        Ok(problem) => run(name, &problem),
        Err(e) => StressRow {
            name,
            converged: false,
            stable: false,
            iterations: 0,
            residual: f64::NAN,
            monotone: false,
            stop: e.to_string(),
        },
    }
}

/// The table.
pub fn run_all() -> Vec<StressRow> {
    let mut rows = Vec::new();
    for ei in [1e-3, 1.0, 1e2, 1e5] {
        rows.push(solved(
            format!("EI = {ei:.0e} N·mm², 300 mm, 100 elements, PL²/EI = 10"),
            &case(100, 300.0, ei, 10.0),
        ));
    }
    for (first, second) in [(1.0, 1e-6), (1e-6, 1.0), (1e6, 1.0), (1e-3, 1e3)] {
        let mut c = case(64, 1.0, 1.0, 0.0);
        c.rod.section = vec![section(0.5, first), section(1.0, second)];
        let soft: f64 = if first < second { first } else { second };
        c.load = vec![at_end(LoadKind::Force, [0.0, -10.0 * soft, 0.0])];
        rows.push(solved(format!("EI jumps from {first:.0e} to {second:.0e}, 64 elements"), &c));
    }
    {
        // Elements of 0.01 mm beside elements of 50 mm: short sections force them.
        let mut c = case(14, 500.2, 100.0, 5.0);
        let mut sections = vec![section(250.0, 100.0)];
        for k in 1..=10 {
            sections.push(section(250.0 + 0.01 * f64::from(k), 100.0));
        }
        sections.push(section(500.2, 100.0));
        c.rod.section = sections;
        c.rod.elements = 20;
        rows.push(solved("elements from 0.01 to 50 mm".to_owned(), &c));
    }
    for slenderness in [1e2, 1e4, 1e6f64] {
        // Slenderness L/ρ with ρ² = EI/EA.
        let mut c = case(64, 1.0, 1.0, 10.0);
        c.rod.section[0].ea = Some(slenderness * slenderness);
        rows.push(solved(format!("slenderness {slenderness:.0e}, stretchable, PL²/EI = 10"), &c));
    }
    for a in [100.0, 300.0, 1000.0] {
        rows.push(solved(format!("PL²/EI = {a} across, 128 elements"), &case(128, 1.0, 1.0, a)));
        let mut c = case(128, 1.0, 1.0, 0.0);
        c.load = vec![at_end(LoadKind::Force, [-a, 0.0, 0.0])];
        rows.push(solved(format!("PL²/EI = {a} against the rod, 128 elements"), &c));
    }
    for n in [1, 2, 1000, 10_000] {
        rows.push(solved(format!("{n} elements, PL²/EI = 10"), &case(n, 1.0, 1.0, 10.0)));
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
            let Ok(mut problem) = StaticProblem::new(&c) else { continue };
            let mut frames: Vec<Frame> = vec![problem.initial.frames[0]];
            for i in 0..32 {
                let last = frames[i];
                frames.push(last.transported(turn * noise(), turn * noise()));
            }
            problem.initial = RodState::from_frames(&problem.elements, Vec3::zeros(), frames);
            rows.push(run(name, &problem));
        }
    }
    rows
}

//! Part B: spatial cases without contact.

use super::planar::{CRITICAL_DIGITS, DIGITS, tip_error};
use super::{Row, at_end, observed_order, section, unit_rod};
use endowire_core::shape::Frame;
use endowire_core::statics::{EndKind, Initial, LoadKind, Parameter, StartKind, StaticCase, StaticProblem};
use endowire_core::{Result, Vec3};
use std::f64::consts::{FRAC_PI_4, PI};

pub(super) fn bend() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (p, tip) in
        [(300.0, [22.24503474, 58.77968539, 40.18828384]), (600.0, [15.68507816, 47.15129440, 53.46859844])]
    {
        // R = 100, E = 1e7, G = 5e6, unit square: EI = E/12; J = 1/6 is that of the list. Clamped along y at the
        // origin, bending to +x.
        let case = |n: usize| {
            let mut case = unit_rod(n);
            case.rod.length = 100.0 * FRAC_PI_4;
            case.rod.section = vec![section(case.rod.length, 1e7 / 12.0)];
            case.rod.section[0].gj = Some(5e6 / 6.0);
            case.rod.section[0].rest_curvature = [0.01, 0.0];
            case.start.tangent = [0.0, 1.0, 0.0];
            case.start.normal = Some([1.0, 0.0, 0.0]);
            case.load = vec![at_end(LoadKind::Force, [0.0, 0.0, p])];
            case
        };
        let s = case(24).solve()?.checked()?;
        let scale = Vec3::from(tip).norm();
        let order = observed_order(24, 100.0 * DIGITS, |n| tip_error(&case(n), tip))?;
        let name = format!("B1 P={p}, J=1/6, 24 elements");
        rows.push(Row::point(&name, "tip", s.tip, tip, scale, 1e-5).iterations(s.iterations).order(order));
    }
    Ok(rows)
}

/// The rotation of the end at which the twisted rod loses stability, searched around the reference.
fn critical_turns(case: &StaticCase, expected: f64) -> Result<f64> {
    StaticProblem::new(case)?.critical(Parameter::Turns, 0.7 * expected, 1.2 * expected, 1e-10)
}

fn order_of_turns(case: impl Fn(usize) -> StaticCase, expected: f64) -> Result<Option<f64>> {
    observed_order(64, CRITICAL_DIGITS, |n| Ok((critical_turns(&case(n), expected)? / expected - 1.0).abs()))
}

pub(super) fn twisted_rod() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (tension, expected) in [(0.0, 8.98681891581813), (100.0, 20.9835008281)] {
        let case = |n: usize| {
            let mut case = unit_rod(n);
            // GJ = 1, so that the rotation of the end is the torque.
            case.rod.section[0].gj = Some(1.0);
            case.end.kind = EndKind::Clamped;
            case.end.position = Some([1.0, 0.0, 0.0]);
            case.end.slide = Some([1.0, 0.0, 0.0]);
            case.end.turns = Some(1.0);
            case.load = vec![at_end(LoadKind::Force, [tension, 0.0, 0.0])];
            case
        };
        let found = critical_turns(&case(64), expected)?;
        let order = order_of_turns(case, expected)?;
        let name = format!("B2 clamped, T={tension}, 64 elements");
        rows.push(Row::relative(&name, "critical moment", found, expected, 1e-4).order(order));
    }
    for tension in [0.0, 5.0] {
        let expected = 2.0 * (tension + PI * PI).sqrt();
        let found = hinged_moment(64, tension, expected)?;
        let order =
            observed_order(64, 1e-5, |n| Ok((hinged_moment(n, tension, expected)? / expected - 1.0).abs()))?;
        let name = format!("B2 hinged, T={tension}, 64 elements");
        rows.push(Row::relative(&name, "critical moment", found, expected, 1e-4).order(order));
    }
    Ok(rows)
}

/// The dead end moments at which a hinged rod under tension buckles.
fn hinged_moment(elements: usize, tension: f64, expected: f64) -> Result<f64> {
    let mut case = unit_rod(elements);
    case.rod.section[0].gj = Some(1.0);
    case.start.kind = StartKind::Pinned;
    case.end.kind = EndKind::Pinned;
    case.end.position = Some([1.0, 0.0, 0.0]);
    case.end.slide = Some([1.0, 0.0, 0.0]);
    // Moments per unit of the factor; the tension must not be scaled with it.
    let mut start = at_end(LoadKind::Moment, [-1.0, 0.0, 0.0]);
    start.at = Some(0.0);
    case.load = vec![start, at_end(LoadKind::Moment, [1.0, 0.0, 0.0])];
    let mut problem = StaticProblem::new(&case)?;
    problem.pulled_by(tension);
    let probe = [0.0, 1e-8, 0.0];
    problem.critical_by_softening(Parameter::Loads, 0.80 * expected, 0.85 * expected, probe, 1e-6)
}

pub(super) fn ring() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for gj in [1.0, 0.77] {
        let expected = 10.882796185405 / gj;
        let case = |n: usize| {
            let mut case = unit_rod(n);
            case.rod.section[0].gj = Some(gj);
            case.end.kind = EndKind::Clamped;
            case.end.position = Some([0.0; 3]);
            case.initial = Some(Initial { curvature: [2.0 * PI, 0.0], ..Initial::default() });
            case
        };
        let found = critical_turns(&case(64), expected)?;
        let order = order_of_turns(case, expected)?;
        let name = format!("B3 GJ/EI={gj}, 64 elements");
        rows.push(Row::relative(&name, "critical twist", found, expected, 1e-4).order(order));
    }
    Ok(rows)
}

/// Love's localised solution as an initial shape: tangents of a rod of length L under tension T with m = M/√(BT), B =
/// 1.
fn love(elements: usize, length: f64, tension: f64, m: f64) -> Vec<Vec3> {
    let a = (1.0 - 0.25 * m * m).sqrt();
    (0..=elements)
        .map(|i| {
            let s = (i as f64 / elements as f64 - 0.5) * length * tension.sqrt();
            let sech = 1.0 / (a * s).cosh();
            let cos = 1.0 - 2.0 * a * a * sech * sech;
            let sin = (1.0 - cos * cos).max(0.0).sqrt();
            let psi = 0.5 * m * s + (a * (a * s).tanh()).atan2(0.5 * m);
            Vec3::new(cos, sin * psi.cos(), -sin * psi.sin())
        })
        .collect()
}

pub(super) fn localised() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let (gj, tension) = (0.77, 1.0f64);
    for (m, length, elements) in [(1.5, 50.0, 240), (1.6, 40.0, 240)] {
        let moment = m * tension.sqrt();
        let shortening = (16.0 / tension - 4.0 * moment * moment / (tension * tension)).sqrt();
        let rotation = moment * length / gj + 4.0 * (0.5f64 * m).acos();
        let mut case = unit_rod(elements);
        case.rod.length = length;
        case.rod.section = vec![section(length, 1.0)];
        case.rod.section[0].gj = Some(gj);
        case.end.kind = EndKind::Clamped;
        // Both ends are held: under a dead tension the localised state is a saddle point.
        case.end.position = Some([length - shortening, 0.0, 0.0]);
        case.end.turns = Some(rotation);
        let mut problem = StaticProblem::new(&case)?;
        let first = problem.initial.frames[0];
        let frames = love(elements, length, tension, m)
            .into_iter()
            .map(|t| Frame::new(t, Some(first.u)))
            .enumerate()
            .map(|(i, f)| if i == 0 { first } else { f })
            .collect();
        problem.lay(Vec3::zeros(), frames);
        let s = problem.solve()?.checked()?;
        let name = format!("B4 m={m}, {elements} elements");
        let end = &s.reactions.end;
        rows.push(Row::relative(&name, "tension", end.force[0], tension, 1e-3).iterations(s.iterations));
        rows.push(Row::relative(&name, "moment", end.torque, moment, 1e-3));
        let (t, m) = (end.force[0], end.torque);
        let found = (16.0 / t - 4.0 * m * m / (t * t)).sqrt();
        rows.push(Row::relative(&name, "shortening at that T and M", found, shortening, 1e-3));
    }
    Ok(rows)
}

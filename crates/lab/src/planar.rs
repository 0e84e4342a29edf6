//! Part A: planar cases without contact.

use super::{Row, at_end, observed_order, section, unit_rod};
use endowire_core::statics::{EndKind, LoadKind, Parameter, StartKind, StaticCase, StaticProblem};
use endowire_core::{Result, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

fn tip_load(elements: usize, force: [f64; 3]) -> StaticCase {
    let mut case = unit_rod(elements);
    case.load = vec![at_end(LoadKind::Force, force)];
    case
}

/// Distance of a solved tip from the reference.
pub(super) fn tip_error(case: &StaticCase, tip: [f64; 3]) -> Result<f64> {
    let s = case.solve()?.checked()?;
    Ok((Vec3::from(s.tip) - Vec3::from(tip)).norm())
}

/// Relative error of a critical load factor, searched from half of the reference to 1.4 times it.
fn critical_error(case: &StaticCase, expected: f64) -> Result<f64> {
    Ok((critical_load(case, expected)? / expected - 1.0).abs())
}

fn critical_load(case: &StaticCase, expected: f64) -> Result<f64> {
    StaticProblem::new(case)?.critical(Parameter::Loads, 0.5 * expected, 1.4 * expected, 1e-10)
}

/// Errors below this are due to the reference's last digits and rounding, not the mesh.
pub(super) const DIGITS: f64 = 1e-10;

/// The same for critical loads, whose uncertainty is due to bisection and regularisation.
pub(super) const CRITICAL_DIGITS: f64 = 1e-7;

/// A1: (a, tip angle, deflection, shortening), elements and bound of the tip error.
const CANTILEVER: [([f64; 4], usize, f64); 7] = [
    ([1.0, 0.461351949712, 0.301720773800, 0.0564332362834], 16, 1e-7),
    ([2.0, 0.781749831557, 0.493457480397, 0.160641720825], 16, 3e-7),
    ([5.0, 1.21536811761, 0.713791523612, 0.387628360724], 16, 1e-6),
    ([10.0, 1.43028553880, 0.810609024880, 0.554995597754], 16, 3e-6),
    ([10.0, 1.43028553880, 0.810609024880, 0.554995597754], 32, 2e-7),
    ([50.0, 1.56798190157, 0.917155447304, 0.800000396050], 32, 1e-5),
    ([50.0, 1.56798190157, 0.917155447304, 0.800000396050], 64, 1e-5),
];

pub(super) fn cantilever() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for ([a, angle, w, u], n, bound) in CANTILEVER {
        let name = format!("A1 a={a}, {n} elements");
        let tip = [1.0 - u, -w, 0.0];
        let case = |n: usize| tip_load(n, [0.0, -a, 0.0]);
        let s = case(n).solve()?.checked()?;
        let order = observed_order(n, DIGITS, |n| tip_error(&case(n), tip))?;
        rows.push(Row::point(&name, "tip", s.tip, tip, 1.0, bound).iterations(s.iterations).order(order));
        // The angle is a derivative: allow ten times the error of the position.
        rows.push(Row::relative(&name, "tip angle", s.tip_angle, angle, 10.0 * bound));
        if a == 10.0 {
            let limit = if n == 16 { 15.0 } else { 20.0 };
            let count = s.iterations as f64;
            rows.push(Row::with_error(&name, "iterations, one step", count, limit, count, limit));
        }
    }
    // The bound is on the shortfall of the order from 4.
    let (w, u) = (0.810609024880, 0.554995597754);
    let error = |n| tip_error(&tip_load(n, [0.0, -10.0, 0.0]), [1.0 - u, -w, 0.0]);
    let found = 0.5 * (error(8)? / error(32)?).log2();
    let name = "A1 a=10, 8 to 32 elements";
    rows.push(Row::with_error(name, "order of convergence", found, 4.0, 4.0 - found, 0.2).order(Some(found)));
    Ok(rows)
}

pub(super) fn end_moment() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for m in [0.5, FRAC_PI_2, PI, 5.0, 2.0 * PI] {
        let case = |n: usize| {
            let mut case = unit_rod(n);
            case.load = vec![at_end(LoadKind::Moment, [0.0, 0.0, m])];
            case
        };
        let s = case(32).solve()?.checked()?;
        let tip = [m.sin() / m, (1.0 - m.cos()) / m, 0.0];
        let order = observed_order(32, DIGITS, |n| tip_error(&case(n), tip))?;
        let name = format!("A2 m={m:.4}, 32 elements");
        rows.push(Row::point(&name, "tip", s.tip, tip, 1.0, 1e-6).iterations(s.iterations).order(order));
        rows.push(Row::relative(&name, "root moment", s.reactions.start.moment[2], -m, 1e-9));
    }
    Ok(rows)
}

/// A3: tip angle, load, tip along and across.
const POST_BUCKLED: [[f64; 4]; 2] = [
    [60.0, 2.84175425875, 0.741019606076, 0.593207646165],
    [120.0, 4.65055973791, 0.123159972405, 0.803170990007],
];

pub(super) fn column() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for [angle, p, x, y] in POST_BUCKLED {
        // The column may buckle to any side.
        let tip = |n: usize| -> Result<_> {
            let s = tip_load(n, [-p, 0.0, 0.0]).solve()?.checked()?;
            Ok(([s.tip[0], s.tip[1].hypot(s.tip[2]), 0.0], s))
        };
        let (found, s) = tip(64)?;
        let order = observed_order(64, DIGITS, |n| {
            let ([along, across, _], _) = tip(n)?;
            Ok((along - x).hypot(across - y))
        })?;
        let name = format!("A3 tip angle {angle}°, 64 elements");
        rows.push(
            Row::point(&name, "tip", found, [x, y, 0.0], 1.0, 1e-4).iterations(s.iterations).order(order),
        );
        rows.push(Row::relative(&name, "tip angle", s.tip_angle, angle.to_radians(), 1e-4));
    }
    type Mesh = fn(usize) -> StaticCase;
    let columns: [(&str, Mesh, f64); 5] = [
        ("clamped-free", |n| squeezed(n, StartKind::Clamped, EndKind::Free), 2.467401100272),
        ("pinned-pinned", |n| squeezed(n, StartKind::Pinned, EndKind::Pinned), 9.869604401089),
        ("clamped-pinned", |n| squeezed(n, StartKind::Clamped, EndKind::Pinned), 20.19072855643),
        ("clamped-clamped", |n| squeezed(n, StartKind::Clamped, EndKind::Clamped), 39.47841760436),
        ("self-weight", |n| weighed(n, [-1.0, 0.0, 0.0]), 7.837347438943),
    ];
    for (name, case, expected) in columns {
        let found = critical_load(&case(64), expected)?;
        let order = observed_order(64, CRITICAL_DIGITS, |n| critical_error(&case(n), expected))?;
        let name = format!("A3 {name}, 64 elements");
        rows.push(Row::relative(&name, "critical load", found, expected, 1e-4).order(order));
    }
    Ok(rows)
}

/// A rod along x under an axial load at its end.
fn squeezed(elements: usize, start: StartKind, end: EndKind) -> StaticCase {
    let mut case = tip_load(elements, [-1.0, 0.0, 0.0]);
    case.start.kind = start;
    case.end.kind = end;
    if end != EndKind::Free {
        case.end.position = Some([1.0, 0.0, 0.0]);
        case.end.slide = Some([1.0, 0.0, 0.0]);
    }
    case
}

fn weighed(elements: usize, weight: [f64; 3]) -> StaticCase {
    let mut case = unit_rod(elements);
    case.load = vec![at_end(LoadKind::Distributed, weight)];
    case
}

pub(super) fn precurved() -> Result<Vec<Row>> {
    let case = |n: usize| {
        let mut case = tip_load(n, [0.0, -1.0, 0.0]);
        case.rod.section[0].rest_curvature = [FRAC_PI_2, 0.0];
        case
    };
    let tip = [0.804105101290, 0.481870697044, 0.0];
    let s = case(32).solve()?.checked()?;
    let order = observed_order(32, DIGITS, |n| tip_error(&case(n), tip))?;
    let name = "A4 φ₀=π/2, 32 elements";
    // The root moment of the list is the rod's; the clamp exerts its opposite.
    Ok(vec![
        Row::point(name, "tip", s.tip, tip, 1.0, 1e-5).iterations(s.iterations).order(order),
        Row::relative(name, "tip angle", s.tip_angle, 1.22202359389, 1e-5),
        Row::relative(name, "root moment", -s.reactions.start.moment[2], -0.804105101290, 1e-5),
    ])
}

pub(super) fn own_weight() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (q, x, y) in [(1.0, 0.9912463953, -0.1234714020), (10.0, 0.6563537612, -0.7001997155)] {
        let case = |n: usize| weighed(n, [0.0, -q, 0.0]);
        let s = case(32).solve()?.checked()?;
        let order = observed_order(32, DIGITS, |n| tip_error(&case(n), [x, y, 0.0]))?;
        let name = format!("A6 qL³/EI={q}, 32 elements");
        rows.push(
            Row::point(&name, "tip", s.tip, [x, y, 0.0], 1.0, 1e-5).iterations(s.iterations).order(order),
        );
    }
    Ok(rows)
}

pub(super) fn floppy_tip() -> Result<Vec<Row>> {
    let two = |force: [f64; 3], n: usize| {
        let mut case = tip_load(n, force);
        case.rod.section = vec![section(0.7, 1.0), section(1.0, 0.1)];
        case
    };
    let (across, along) = (|n| two([0.0, 0.5, 0.0], n), |n| two([-1.0, 0.0, 0.0], n));
    let tip = [0.9731845852, 0.1951633542, 0.0];
    let s = across(32).solve()?.checked()?;
    let order = observed_order(32, DIGITS, |n| tip_error(&across(n), tip))?;
    let name = "A7 32 elements";
    let expected = 1.603056745715;
    let critical = critical_load(&along(64), expected)?;
    let critical_order = observed_order(64, CRITICAL_DIGITS, |n| critical_error(&along(n), expected))?;
    Ok(vec![
        Row::point(name, "tip", s.tip, tip, 1.0, 1e-5).iterations(s.iterations).order(order),
        Row::relative(name, "tip angle", s.tip_angle, 0.4265866725, 1e-5),
        Row::relative("A7 64 elements", "critical load", critical, expected, 1e-5).order(critical_order),
    ])
}

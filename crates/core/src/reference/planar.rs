//! Part A: planar cases without contact.

use super::{Row, at_end, order, section, unit_rod};
use crate::Result;
use crate::statics::{EndKind, LoadKind, Parameter, StartKind, StaticCase, StaticProblem};
use std::f64::consts::{FRAC_PI_2, PI};

fn tip_load(elements: usize, force: [f64; 3]) -> StaticCase {
    let mut case = unit_rod(elements);
    case.load = vec![at_end(LoadKind::Force, force)];
    case
}

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
        let s = tip_load(n, [0.0, -a, 0.0]).solve()?.checked()?;
        rows.push(Row::point(&name, "tip", s.tip, [1.0 - u, -w, 0.0], 1.0, bound).iterations(s.iterations));
        // The angle is a derivative: allow it ten times the error of the position.
        rows.push(Row::relative(&name, "tip angle", s.tip_angle, angle, 10.0 * bound));
    }
    let limit = |n: usize| if n == 16 { 15.0 } else { 20.0 };
    for n in [16, 32] {
        let s = tip_load(n, [0.0, -10.0, 0.0]).solve()?.checked()?;
        let count = s.iterations as f64;
        let name = format!("A1 a=10, {n} elements, from straight in one step");
        rows.push(Row::with_error(&name, "Newton iterations", count, limit(n), count, limit(n)));
    }
    let mut errors = Vec::new();
    for n in [8, 16, 32] {
        let s = tip_load(n, [0.0, -10.0, 0.0]).solve()?.checked()?;
        let (w, u) = (0.810609024880, 0.554995597754);
        errors.push((s.tip[0] - 1.0 + u).hypot(s.tip[1] + w));
    }
    let found = order(&errors);
    // The bound is on how far the order falls short of 4.
    let mut row =
        Row::with_error("A1 a=10, 8 to 32 elements", "order of convergence", found, 4.0, 4.0 - found, 0.2);
    row.order = Some(found);
    rows.push(row);
    Ok(rows)
}

pub(super) fn end_moment() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for m in [0.5, FRAC_PI_2, PI, 5.0, 2.0 * PI] {
        let mut case = unit_rod(32);
        case.load = vec![at_end(LoadKind::Moment, [0.0, 0.0, m])];
        let s = case.solve()?.checked()?;
        let tip = [m.sin() / m, (1.0 - m.cos()) / m, 0.0];
        let name = format!("A2 m={m:.4}, 32 elements");
        rows.push(Row::point(&name, "tip", s.tip, tip, 1.0, 1e-6).iterations(s.iterations));
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
        let s = tip_load(64, [-p, 0.0, 0.0]).solve()?.checked()?;
        let name = format!("A3 tip angle {angle}°, 64 elements");
        let across = s.tip[1].hypot(s.tip[2]);
        rows.push(
            Row::point(&name, "tip", [s.tip[0], across, 0.0], [x, y, 0.0], 1.0, 1e-4)
                .iterations(s.iterations),
        );
        rows.push(Row::relative(&name, "tip angle", s.tip_angle, angle.to_radians(), 1e-4));
    }
    let squeezed = |start: StartKind, end: EndKind| {
        let mut case = tip_load(64, [-1.0, 0.0, 0.0]);
        case.start.kind = start;
        case.end.kind = end;
        if end != EndKind::Free {
            case.end.position = Some([1.0, 0.0, 0.0]);
            case.end.slide = Some([1.0, 0.0, 0.0]);
        }
        case
    };
    let mut heavy = unit_rod(64);
    heavy.load = vec![at_end(LoadKind::Distributed, [-1.0, 0.0, 0.0])];
    for (name, case, expected) in [
        ("clamped-free", squeezed(StartKind::Clamped, EndKind::Free), 2.467401100272),
        ("pinned-pinned", squeezed(StartKind::Pinned, EndKind::Pinned), 9.869604401089),
        ("clamped-pinned", squeezed(StartKind::Clamped, EndKind::Pinned), 20.19072855643),
        ("clamped-clamped", squeezed(StartKind::Clamped, EndKind::Clamped), 39.47841760436),
        ("self-weight", heavy, 7.837347438943),
    ] {
        let found =
            StaticProblem::new(&case)?.critical(Parameter::Loads, 0.5 * expected, 1.4 * expected, 1e-10)?;
        rows.push(Row::relative(&format!("A3 {name}, 64 elements"), "critical load", found, expected, 1e-4));
    }
    Ok(rows)
}

pub(super) fn precurved() -> Result<Vec<Row>> {
    let mut case = tip_load(32, [0.0, -1.0, 0.0]);
    case.rod.section[0].rest_curvature = [FRAC_PI_2, 0.0];
    let s = case.solve()?.checked()?;
    let name = "A4 φ₀=π/2, 32 elements";
    // The root moment of the list is the rod's; the clamp exerts its opposite.
    Ok(vec![
        Row::point(name, "tip", s.tip, [0.804105101290, 0.481870697044, 0.0], 1.0, 1e-5)
            .iterations(s.iterations),
        Row::relative(name, "tip angle", s.tip_angle, 1.22202359389, 1e-5),
        Row::relative(name, "root moment", -s.reactions.start.moment[2], -0.804105101290, 1e-5),
    ])
}

pub(super) fn own_weight() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (q, x, y) in [(1.0, 0.9912463953, -0.1234714020), (10.0, 0.6563537612, -0.7001997155)] {
        let mut case = unit_rod(32);
        case.load = vec![at_end(LoadKind::Distributed, [0.0, -q, 0.0])];
        let s = case.solve()?.checked()?;
        let name = format!("A6 qL³/EI={q}, 32 elements");
        rows.push(Row::point(&name, "tip", s.tip, [x, y, 0.0], 1.0, 1e-5).iterations(s.iterations));
    }
    Ok(rows)
}

pub(super) fn floppy_tip() -> Result<Vec<Row>> {
    let two = |force: [f64; 3], n: usize| {
        let mut case = tip_load(n, force);
        case.rod.section = vec![section(0.7, 1.0), section(1.0, 0.1)];
        case
    };
    let s = two([0.0, 0.5, 0.0], 32).solve()?.checked()?;
    let name = "A7 32 elements";
    let critical =
        StaticProblem::new(&two([-1.0, 0.0, 0.0], 64))?.critical(Parameter::Loads, 1.0, 2.0, 1e-10)?;
    Ok(vec![
        Row::point(name, "tip", s.tip, [0.9731845852, 0.1951633542, 0.0], 1.0, 1e-5).iterations(s.iterations),
        Row::relative(name, "tip angle", s.tip_angle, 0.4265866725, 1e-5),
        Row::relative("A7 64 elements", "critical load", critical, 1.603056745715, 1e-5),
    ])
}

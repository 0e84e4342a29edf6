//! E2, E3, E6: self-contact of rods and contact between rods.

use super::Row;
use endowire_core::statics::{
    End, EndKind, Initial, Load, LoadKind, Rod, Section, Solver, Start, StartKind, StaticCase,
    StaticSolution, Surface,
};
use endowire_core::{Error, Result, Vec3};
use std::f64::consts::{PI, TAU};

type Point = [f64; 3];

/// A rod of length 1 and EI 1 with a curve as initial shape.
fn case(elements: usize, surface: Option<Surface>, gj: Option<f64>, points: Vec<Point>) -> StaticCase {
    let tangent = (Vec3::from(points[1]) - Vec3::from(points[0])).into();
    let section = Section { gj, ..super::section(1.0, 1.0) };
    StaticCase {
        rod: Rod { length: 1.0, elements, section: vec![section], instrument: vec![] },
        start: Start { kind: StartKind::Clamped, position: points[0], tangent, normal: None },
        end: End { kind: EndKind::Clamped, ..End::default() },
        load: vec![],
        self_contact: surface,
        initial: Some(Initial { points, ..Initial::default() }),
        solver: Solver { max_iterations: 3000, ..Solver::default() },
    }
}

/// A closed rod knotted as a trefoil; without a `radius` it passes through itself.
fn knotted(elements: usize, radius: Option<f64>) -> Result<StaticSolution> {
    let at = |i: i32| {
        let a = TAU * f64::from(i) / 600.0;
        let r = 2.0 + 0.5 * (3.0 * a).cos();
        [r * (2.0 * a).cos(), r * (2.0 * a).sin(), 0.5 * (3.0 * a).sin()]
    };
    let surface = radius.map(|radius| Surface { radius, modulus: None });
    let mut case = case(elements, surface, None, (0..=600).map(at).collect());
    let place = Some(case.start.position);
    case.end = End { position: place, tangent: Some(case.start.tangent), ..case.end };
    case.solve()?.checked()
}

/// Of all shapes of a thin elastic rod without twist that are a trefoil, the one of least energy is a doubly covered
/// circle: E L/B = 8π² (Gerlach, Reiter, von der Mosel, *The elastic trefoil is the doubly covered circle*, Arch.
/// Ration. Mech. Anal. 225 (2017)).
pub(super) fn trefoil() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (radius, bound) in [(5e-3, 0.01), (1e-3, 0.001)] {
        let found = knotted(96, Some(radius))?;
        let name = format!("E3 trefoil R/L={radius:e}");
        rows.push(Row::relative(&name, "E L/B", found.energy.total, 8.0 * PI * PI, bound));
        rows.push(deepest(&name, &found, radius));
    }
    Ok(rows)
}

/// Penetration of surfaces, relative to the radius: a hundredth at most.
fn deepest(name: &str, found: &StaticSolution, radius: f64) -> Row {
    let deepest = found.touching.iter().map(|touch| touch.penetration).fold(0.0, f64::max) / radius;
    Row::with_error(name, "penetration over radius", deepest, 0.0, deepest, 0.011)
}

/// Properties of a long plectoneme under a tension T, in units of B and R: helix angle, moment, force per length, and
/// shortening per turn added at constant moment.
struct Plectoneme {
    angle: f64,
    moment: f64,
    pressure: f64,
    shortening: f64,
}

impl Plectoneme {
    /// N. Clauvelin, B. Audoly, S. Neukirch, *Matched asymptotic expansions for twisted elastic knots*, J. Mech. Phys. Solids 57 (2009).
    fn under(tension: f64) -> Self {
        let (mut low, mut high) = (1e-6f64, 0.7);
        for _ in 0..200 {
            let angle: f64 = 0.5 * (low + high);
            let of_angle = angle.sin().powi(4) * (0.5 + 1.0 / (2.0 * angle).cos());
            *(if of_angle < tension { &mut low } else { &mut high }) = angle;
        }
        let (sin, cos, double) = (low.sin(), low.cos(), (2.0 * low).cos());
        Self {
            angle: low,
            moment: 2.0 * sin.powi(3) * cos / double,
            pressure: sin.powi(4) / double,
            shortening: 4.0 * PI / (2.0 * low).sin(),
        }
    }
}

/// Ratio of length to radius.
const SLENDERNESS: f64 = 400.0;
/// T R²/B.
const TENSION: f64 = 5e-2;
const GJ: f64 = 0.77;

/// A rod between tails along x, whose two halves are wound about each other along y `turns` times, and end in a loop.
fn wound(turns: f64, radius: f64, angle: f64) -> Vec<Point> {
    let high = turns * TAU * radius / angle.tan();
    let ring = 5.0 * radius;
    let open = 0.35;
    let tail = 0.5 * (1.0 - 2.0 * high / angle.cos() - ring * (TAU - 2.0 * open));
    let strand = |y: f64, from: f64| {
        let phi = from + y * angle.tan() / radius;
        [radius * phi.cos(), y, radius * phi.sin()]
    };
    let steps = |count: i32| (0..=count).map(move |k| f64::from(k) / f64::from(count));
    let top = PI + high * angle.tan() / radius;
    let mut points: Vec<Point> = steps(50).take(50).map(|k| [-radius - tail * (1.0 - k), 0.0, 0.0]).collect();
    points.extend(steps(400).map(|k| strand(high * k, PI)));
    points.extend(steps(60).skip(1).take(59).map(|k| {
        let a = open + (TAU - 2.0 * open) * k;
        let x = ring * a.sin();
        [top.cos() * x, high + ring * (1.2 - a.cos()), top.sin() * x]
    }));
    points.extend(steps(400).map(|k| strand(high * (1.0 - k), 0.0)));
    points.extend(steps(50).skip(1).map(|k| [radius + tail * k, 0.0, 0.0]));
    points
}

/// Results for a twisted rod under tension that is wound about itself.
struct Found {
    moment: f64,
    pressure: f64,
    tip: f64,
    solution: StaticSolution,
}

fn twisted(elements: usize, further_turns: f64, modulus: f64) -> Result<Found> {
    let exact = Plectoneme::under(TENSION);
    let radius = 1.0 / SLENDERNESS;
    let surface = Surface { radius, modulus: Some(modulus * SLENDERNESS.powi(4)) };
    let mut case = case(elements, Some(surface), Some(GJ), wound(7.0, 1.05 * radius, exact.angle));
    case.start.tangent = [1.0, 0.0, 0.0];
    case.start.normal = Some([0.0, 1.0, 0.0]);
    case.end = End {
        position: Some([0.0; 3]),
        slide: Some([1.0, 0.0, 0.0]),
        turns: Some(exact.moment * SLENDERNESS / GJ + TAU * further_turns),
        ..case.end
    };
    let pull = [TENSION * SLENDERNESS * SLENDERNESS, 0.0, 0.0];
    case.load = vec![Load { kind: LoadKind::Force, at: None, from: None, to: None, value: pull }];
    let solution = case.solve()?.checked()?;
    let arcs = || solution.touching.iter().map(|touch| touch.arcs[0]);
    let (first, last) = (arcs().fold(1.0, f64::min), arcs().fold(0.0, f64::max));
    let middle = 0.5 * (first + last);
    let ring = arcs().map(|s| (s - middle).abs()).fold(1.0, f64::min);
    // One strand, without its ends.
    let long = middle - ring - first;
    let (from, to) = (first + 0.3 * long, first + 0.7 * long);
    let within = |touch: &endowire_core::statics::TouchSolution| {
        touch.force * touch.arcs.iter().filter(|s| (from..to).contains(*s)).count() as f64
    };
    let pressing: f64 = solution.touching.iter().map(within).sum();
    Ok(Found {
        moment: solution.reactions.end.torque * radius,
        pressure: pressing / (to - from) * radius.powi(3),
        tip: solution.tip[0] * SLENDERNESS,
        solution,
    })
}

/// Twist stored in the rod by a change of moment is not a turn of the plectoneme.
fn shortening(before: &Found, after: &Found, turns: f64) -> f64 {
    let kept = (after.moment - before.moment) * SLENDERNESS * SLENDERNESS / (GJ * SLENDERNESS);
    (before.tip - after.tip) * TAU / (TAU * turns - kept)
}

pub(super) fn plectoneme() -> Result<Vec<Row>> {
    let exact = Plectoneme::under(TENSION);
    let [less, more] = [0.0, 1.0].map(|turns| twisted(240, turns, 30.0));
    let (less, more) = (less?, more?);
    let mut rows = Vec::new();
    for (found, turns) in [(&less, "fewer"), (&more, "more")] {
        let name = format!("E2 T R²/B={TENSION}, {turns} turns");
        rows.push(Row::relative(&name, "M R/B", found.moment, exact.moment, 0.005));
        rows.push(Row::relative(&name, "p R³/B", found.pressure, exact.pressure, 0.005));
        rows.push(deepest(&name, &found.solution, 1.0 / SLENDERNESS));
    }
    let found = shortening(&less, &more, 1.0);
    rows.push(Row::relative("E2", "shortening a turn over R", found, exact.shortening, 0.005));
    Ok(rows)
}

/// Radius of rods that cross.
const CROSSING: f64 = 0.005;

/// Two cantilevers across each other, the tip of the upper one under a load; a soft thread in a wide arc joins their
/// tips, so that both are one rod.
fn across(load: f64) -> Result<StaticSolution> {
    const THREAD: f64 = 1e-8;
    let arc = |k: i32| {
        let part = f64::from(k) / 200.0;
        let (sin, cos) = (PI * (1.5 * part - 0.5)).sin_cos();
        [0.5 + 0.5 * cos, 0.5 + 0.5 * sin, CROSSING * (1.0 - 2.0 * part)]
    };
    let mut points = vec![[-0.5, 0.0, CROSSING]];
    points.extend((0..=200).map(arc));
    points.push([0.0, -0.5, -CROSSING]);
    let length: f64 = points.windows(2).map(|pair| (Vec3::from(pair[1]) - Vec3::from(pair[0])).norm()).sum();
    // As stiff as the rods, not as the thread.
    let surface = Surface { radius: CROSSING, modulus: Some(100.0 / CROSSING.powi(4)) };
    let mut case = case(80, Some(surface), None, points);
    let sections = [(1.0, 1.0), (length - 1.0, THREAD), (length, 1.0)];
    case.rod.length = length;
    case.rod.section = sections.map(|(until, ei)| super::section(until, ei)).to_vec();
    let place = Some([0.0, -0.5, -CROSSING]);
    case.end = End { position: place, tangent: Some([0.0, -1.0, 0.0]), ..case.end };
    let value = [0.0, 0.0, -load];
    case.load = vec![Load { kind: LoadKind::Force, at: Some(1.0), from: None, to: None, value }];
    case.solve()?.checked()
}

/// Cantilevers of length 1 that cross in their middles, a = ½ from their clamps: w = P a²(3 − a)/6 − F a³/3 of the
/// upper one equals F a³/3 of the lower one.
pub(super) fn crossing() -> Result<Vec<Row>> {
    let load = 0.05;
    let found = across(load)?;
    let force: f64 = found.touching.iter().map(|touch| touch.force).sum();
    let a: f64 = 0.5;
    let exact = load * a * a * (3.0 - a) / 6.0 / (2.0 * a.powi(3) / 3.0);
    let name = "E6 crossing rods";
    if found.touching.is_empty() {
        return Err(Error::Computation("the rods do not touch".to_owned()));
    }
    Ok(vec![Row::relative(name, "force between them", force, exact, 0.005), deepest(name, &found, CROSSING)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rod_that_passes_through_itself_is_no_knot() {
        let found = knotted(96, None).unwrap();
        // A simply covered circle.
        assert!((found.energy.total / (2.0 * PI * PI) - 1.0).abs() < 0.01, "{}", found.energy.total);
    }

    #[test]
    fn a_soft_surface_is_reported_from_a_hard_one() {
        let exact = Plectoneme::under(TENSION);
        let soft = twisted(240, 0.0, 0.3).unwrap();
        assert!((soft.moment / exact.moment - 1.0).abs() > 0.01, "{} {}", soft.moment, exact.moment);
    }

    #[test]
    fn rods_that_are_lifted_off_each_other_do_not_press() {
        assert!(across(-0.05).unwrap().touching.is_empty());
    }
}

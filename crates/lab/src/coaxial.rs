//! Part D: several coaxial instruments on one centre line.

use super::planar::tip_error;
use super::{Row, at_end, section, unit_rod};
use endowire_core::statics::{Channel, Instrument, LoadKind, Parameter, Section, StaticCase, StaticProblem};
use endowire_core::{Error, Result, Vec3};

/// A straight instrument.
fn straight(name: &str, inserted: f64, ei: f64) -> Instrument {
    Instrument { name: name.to_owned(), inserted, hand: 0.0, clearance: 0.0, section: vec![section(2.0, ei)] }
}

/// A pre-curved one.
fn curved(name: &str, inserted: f64, [ei, gj, curvature]: [f64; 3]) -> Instrument {
    let section = Section { gj: Some(gj), rest_curvature: [curvature, 0.0], ..section(2.0, ei) };
    Instrument { name: name.to_owned(), inserted, hand: 0.0, clearance: 0.0, section: vec![section] }
}

/// Instruments that come out of a sheath at the origin along x.
fn stack(elements: usize, instruments: Vec<Instrument>) -> StaticCase {
    let mut case = unit_rod(elements);
    (case.rod.length, case.rod.section, case.rod.instrument) = (0.0, vec![], instruments);
    case
}

/// D1: A7's rod made of two instruments.
pub(super) fn stiffness_adds() -> Result<Vec<Row>> {
    let tip = [0.9731845852, 0.1951633542, 0.0];
    let buckling = 1.603056745715;
    let (outer, inner) = (straight("outer", 0.7, 0.9), straight("inner", 1.0, 0.1));
    let mut rows = Vec::new();
    for (order, instruments) in
        [("outer first", vec![outer.clone(), inner.clone()]), ("inner first", vec![inner, outer])]
    {
        let under = |force: [f64; 3], elements: usize| {
            let mut case = stack(elements, instruments.clone());
            case.load = vec![at_end(LoadKind::Force, force)];
            case
        };
        let across = under([0.0, 0.5, 0.0], 32);
        let solved = across.solve()?.checked()?;
        let along = StaticProblem::new(&under([-1.0, 0.0, 0.0], 64))?;
        let critical = along.critical(Parameter::Loads, 0.5 * buckling, 1.4 * buckling, 1e-10)?;
        let name = format!("D1 {order}, 32 elements");
        let error = tip_error(&across, tip)?;
        let distance = |p: [f64; 3]| Vec3::from(p).norm();
        let point = Row::with_error(&name, "tip", distance(solved.tip), distance(tip), error, 1e-6);
        rows.push(point.iterations(solved.iterations));
        rows.push(Row::relative(&name, "tip angle", solved.tip_angle, 0.4265866725, 1e-6));
        let name = format!("D1 {order}, 64 elements");
        rows.push(Row::relative(&name, "critical load", critical, buckling, 1e-6));
    }
    Ok(rows)
}

/// Two pre-curved instruments of length 1, of which the first is rotated.
struct Pair {
    problem: StaticProblem,
    iterations: usize,
}

impl Pair {
    const BENDING: [f64; 2] = [1.0, 2.0];
    const CURVATURES: [f64; 2] = [1.2, 0.8];
    /// Ratio of GJ of the second to that of the first.
    const TORSION: f64 = 1.5;

    /// λ² = κ₁κ₂ EI₁EI₂/(EI₁ + EI₂) (1/GJ₁ + 1/GJ₂).
    fn new(lambda: f64) -> Result<Self> {
        let [a, b] = Self::BENDING;
        let [p, q] = Self::CURVATURES;
        let torsion = p * q * a * b / (a + b) * (1.0 + 1.0 / Self::TORSION) / (lambda * lambda);
        Self::with_torsion(torsion)
    }

    fn with_torsion(torsion: f64) -> Result<Self> {
        let ([a, b], [p, q]) = (Self::BENDING, Self::CURVATURES);
        let first = curved("first", 1.0, [a, torsion, p]);
        let second = curved("second", 1.0, [b, Self::TORSION * torsion, q]);
        let problem = StaticProblem::new(&stack(64, vec![first, second]))?;
        Ok(Self { problem, iterations: 0 })
    }

    /// Rotates the first to an angle against the second, in degrees, from the current state; returns that of the
    /// tips.
    fn turn_to(&mut self, hand: f64) -> Result<f64> {
        let before = self.problem.initial.clone();
        self.problem.initial.angles[0] = hand.to_radians();
        let solved = self.problem.solve_state()?;
        self.problem.initial = before;
        let report = self.problem.solution(&solved);
        if !report.converged {
            return Err(Error::Computation(format!("D2: no equilibrium at {hand}°: {}", report.stop)));
        }
        self.iterations = report.iterations;
        self.problem.initial = solved.state;
        let state = &self.problem.initial;
        let tip = state.elements();
        Ok((state.angle(tip, 0) - state.angle(tip, 1)).to_degrees())
    }

    /// Angle of the hand at which the tips are at `tip` degrees, by the secant method.
    fn hand_for(&mut self, tip: f64) -> Result<f64> {
        let (mut hand, mut slope) = (tip, 1.0);
        let mut last = None;
        for _ in 0..30 {
            let off = tip - self.turn_to(hand)?;
            if off.abs() < 1e-9 {
                return Ok(hand);
            }
            if let Some((before, before_off)) = last {
                slope = (before_off - off) / (hand - before);
            }
            last = Some((hand, off));
            hand += off / slope;
        }
        Err(Error::Computation(format!("D2: no hand angle found for tips at {tip}°")))
    }

    /// Angle of the hand at which the tips snap through, and their angle just before, by bisection.
    fn snap(&mut self) -> Result<[f64; 2]> {
        /// Tip angle beyond which they have snapped through, degrees.
        const ROUND: f64 = 130.0;
        let (mut low, mut tip, mut step) = (0.0, 0.0, 5.0);
        while step > 1e-7 && low < 360.0 {
            let here = self.problem.initial.clone();
            let found = self.turn_to(low + step)?;
            if found < ROUND {
                (low, tip) = (low + step, found);
            } else {
                self.problem.initial = here;
                step *= 0.5;
            }
        }
        Ok([low, tip])
    }
}

/// D2: two pre-curved instruments rotated against each other.
pub(super) fn pair() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (lambda, hands) in [(0.8, [39.589933027, 108.272382565]), (1.5, [67.324275333, 151.898367219])] {
        let mut pair = Pair::new(lambda)?;
        for (tip, expected) in [30.0, 90.0].into_iter().zip(hands) {
            let hand = pair.hand_for(tip)?;
            let quantity = format!("hand for a tip at {tip}°");
            rows.push(Row::relative(&format!("D2 λ={lambda}"), &quantity, hand, expected, 1e-4));
        }
    }
    let [hand, tip] = Pair::new(2.5)?.snap()?;
    rows.push(Row::relative("D2 λ=2.5", "hand where it snaps", hand, 228.975789690, 1e-3));
    // The tip angle changes infinitely fast with the hand's there: its error is the square root of the hand's.
    rows.push(Row::relative("D2 λ=2.5", "tip where it snaps", tip, 92.41541, 1e-3));
    rows.push(rigid_torsion()?);
    Ok(rows)
}

/// If torsionally rigid, they bend to an arc with the stiffness-weighted mean of their curvatures.
fn rigid_torsion() -> Result<Row> {
    let mut pair = Pair::with_torsion(1e4)?;
    pair.turn_to(90.0)?;
    let ([a, b], [p, q]) = (Pair::BENDING, Pair::CURVATURES);
    // The first is rotated from y to z.
    let curvature = Vec3::new(0.0, b * q, a * p) / (a + b);
    let k = curvature.norm();
    let expected = Vec3::x() * (k.sin() / k) + curvature * ((1.0 - k.cos()) / (k * k));
    let state = &pair.problem.initial;
    let tip = state.positions[state.elements()];
    Ok(Row::point("D2 GJ = 10⁴ EI, 90°", "tip of the arc", tip.into(), expected.into(), 1.0, 1e-4))
}

/// D3: a curved inner in a straight outer.
pub(super) fn curved_in_straight() -> Result<Vec<Row>> {
    const CURVATURE: f64 = 1.3;
    const BENDING: [f64; 2] = [0.8, 1.7];
    let [a, b] = BENDING;
    let overlap = 0.5 * CURVATURE * CURVATURE * a * b / (a + b);
    let sheathed = 0.5 * CURVATURE * CURVATURE * a;
    let mut rows = Vec::new();
    for (name, lengths, forces) in [
        ("D3 inner beyond outer", [1.0, 0.6], [-sheathed, overlap]),
        ("D3 outer beyond inner", [0.6, 1.0], [overlap - sheathed, 0.0]),
    ] {
        let inner = curved("inner", lengths[0], [a, 0.7, CURVATURE]);
        let solved = stack(32, vec![inner, straight("outer", lengths[1], b)]).solve()?.checked()?;
        for (reported, expected) in solved.instruments.iter().zip(forces) {
            let force = reported.push_force.unwrap_or(f64::NAN);
            let quantity = format!("push force of the {}", reported.name);
            let error = (force - expected).abs() / overlap;
            rows.push(Row::with_error(name, &quantity, force, expected, error, 1e-4));
        }
        let k = a * CURVATURE / (a + b);
        let arc = [(k * 0.6f64).sin() / k, (1.0 - (k * 0.6f64).cos()) / k, 0.0];
        let shorter = solved.instruments.iter().min_by(|x, y| x.inserted.total_cmp(&y.inserted));
        let end = shorter.map_or([f64::NAN; 3], |i| i.tip);
        rows.push(Row::point(name, "end of the overlap", end, arc, 1.0, 1e-6));
    }
    Ok(rows)
}

/// D4: straight instruments in a close-fitting arc.
pub(super) fn straight_in_arc() -> Result<Vec<Row>> {
    const RADIUS: f64 = 1.25;
    let channel = Channel { radius: RADIUS, stiffness: 1e8 };
    let instruments =
        vec![straight("inner", 1.2, 0.4), straight("middle", 0.8, 1.0), straight("outer", 0.5, 2.0)];
    let stiffness: Vec<f64> = instruments.iter().map(|i| i.section[0].ei).collect();
    let problem = StaticProblem::new(&stack(384, instruments))?;
    let forces =
        problem.push_forces_in(&channel).map_err(|error| Error::Computation(format!("D4: {error}")))?;
    let names = ["inner", "middle", "outer"];
    let rows = forces.iter().zip(stiffness).zip(names).map(|((force, ei), name)| {
        let expected = 0.5 * ei / (RADIUS * RADIUS);
        let quantity = format!("push force of the {name}");
        Row::relative("D4 384 elements", &quantity, force.unwrap_or(f64::NAN), expected, 1e-4)
    });
    Ok(rows.collect())
}

//! Part C on flat walls: the elastica in a channel, and the compliant wall.

use super::channel::channel;

use super::{Row, observed_order};
use endowire_core::statics::{WallRod, WallRodSpec};
use endowire_core::{Error, Result, Vec3};
use std::f64::consts::PI;

/// Heights of the walls of C2 above and below the rod.
const HEIGHT: f64 = 0.05;
/// Radius of the rod of C2; only the difference of distance and radius counts.
const RADIUS: f64 = 0.02;
/// Foundation modulus of C2 over EI/L⁴, large enough to be practically rigid.
const RIGID: f64 = 1e10;

/// One equilibrium of C2.
struct Squeezed {
    shortening: f64,
    /// Height of the middle.
    height: f64,
    wall_force: f64,
    root_moment: f64,
    /// Bending moment in the middle.
    middle_moment: f64,
}

/// C2: a clamped-clamped rod of length and stiffness 1 under an axial load between walls. By symmetry this is its
/// first half: clamped at one end, guided at the other, which is the middle.
struct Elastica(WallRod);

impl Elastica {
    /// `elements` on the whole length.
    fn new(elements: usize, modulus: f64) -> Result<Self> {
        let (half, wall) = (elements / 2, HEIGHT + RADIUS);
        let setup = WallRodSpec { length: 0.5, bending: 1.0, radius: RADIUS, elements: half, modulus };
        let mut channel = channel(&setup, [-wall, wall])?;
        channel.supports.end_tangent = Some(Vec3::x());
        // The first buckling mode, nearly as high as the channel.
        let first = channel.state.frames[0];
        let slope = |i: usize| 0.9 * PI * HEIGHT * (PI * i as f64 / half as f64).sin();
        let frames = (0..=half).map(|i| first.transported(slope(i), 0.0)).collect();
        channel.lay(Vec3::zeros(), frames);
        Ok(Self(channel))
    }

    /// The equilibrium under `load`, starting from the last one.
    fn at(&mut self, load: f64) -> Result<Squeezed> {
        let Self(channel) = self;
        let half = channel.elements();
        channel.loads.forces = vec![(half, Vec3::x() * -load)];
        channel.solve()?;
        let clamp = channel.clamp();
        let wall_force = 2.0 * wall_force(channel).norm();
        let middle = channel.state.positions[half];
        Ok(Squeezed {
            shortening: 1.0 - 2.0 * middle.x,
            height: middle.y.abs(),
            wall_force,
            root_moment: clamp.moment.z.abs(),
            middle_moment: (clamp.moment - middle.cross(&clamp.force)).z * middle.y.signum(),
        })
    }

    /// The equilibrium under `load`, approached from below in steps of at most 10.
    fn reach(elements: usize, modulus: f64, load: f64) -> Result<Squeezed> {
        let mut rod = Self::new(elements, modulus)?;
        let mut at = 40.0;
        while at < load - 10.0 {
            rod.at(at)?;
            at += 10.0;
        }
        rod.at(load)
    }

    /// Load and shortening at which the middle first touches the wall.
    fn first_contact(elements: usize) -> Result<(f64, f64)> {
        let mut rod = Self::new(elements, RIGID)?;
        let (mut low, mut high) = (39.55, 39.65);
        if rod.at(low)?.height >= HEIGHT || rod.at(high)?.wall_force == 0.0 {
            return Err(Error::Computation("C2: first contact is not where it is looked for".to_owned()));
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if rod.at(middle)?.wall_force > 0.0 { high = middle } else { low = middle }
        }
        Ok((high, rod.at(high)?.shortening))
    }

    /// Load at which point contact becomes line contact: where the bending moment in the middle vanishes, by the
    /// parabola through three loads below it. (From there on the flat part soon buckles off the wall.)
    fn line_contact(elements: usize) -> Result<f64> {
        let mut rod = Self::new(elements, RIGID)?;
        let loads = [140.0, 145.0, 150.0, 155.0];
        let mut moments = [0.0; 4];
        for (load, moment) in loads.iter().zip(&mut moments) {
            *moment = rod.at(*load)?.middle_moment;
        }
        let [_, a, b, c] = moments;
        // In steps of 5 from 150: b + ½(c − a) x + ½(a − 2b + c) x² = 0.
        let (slope, curve) = (0.5 * (c - a), a - 2.0 * b + c);
        let root = (slope * slope - 2.0 * curve * b).sqrt();
        Ok(150.0 + 5.0 * 2.0 * b / (-slope + root))
    }
}

/// Sum of the wall's forces on the rod.
fn wall_force(rod: &mut WallRod) -> Vec3 {
    rod.touches().iter().map(|(_, touch)| touch.contact.normal * touch.contact.force_n).sum()
}

pub(super) fn elastica() -> Result<Vec<Row>> {
    const SHORTENING: f64 = 0.006192469422707;
    const POINT: [f64; 3] = [88.71619713996, 12.51618305077, 0.6635925966109];
    const LINE: [f64; 2] = [157.3163368633, 31.70246486741];
    let bound = 1e-3;
    let mut rows = Vec::new();

    let name = "C2 first contact, h = L/40";
    let (load, shortening) = Elastica::first_contact(40)?;
    let order = observed_order(40, 1e-9, |n| Ok((Elastica::first_contact(n)?.1 / SHORTENING - 1.0).abs()))?;
    rows.push(Row::relative(name, "load", load, 39.60107936982, bound));
    rows.push(Row::relative(name, "shortening", shortening, SHORTENING, bound).order(order));

    let [load, force, moment] = POINT;
    let name = "C2 point contact, h = L/40";
    let found = Elastica::reach(40, RIGID, load)?;
    rows.push(Row::relative(name, "wall force", found.wall_force, force, bound));
    rows.push(Row::relative(name, "root moment", found.root_moment, moment, bound));
    let errors: Vec<f64> = [1e6, 1e7, 1e8, 1e9]
        .into_iter()
        .map(|k| Ok((Elastica::reach(40, k, load)?.wall_force / force - 1.0).abs()))
        .collect::<Result<_>>()?;
    rows.push(falling("C2 point contact, h = L/40", "error of force, k = 10⁶ … 10⁹", &errors, 0.5));

    let [load, force] = LINE;
    let name = "C2 point to line, h = L/40";
    rows.push(Row::relative(name, "load", Elastica::line_contact(40)?, load, bound));
    rows.push(Row::relative(name, "wall force", Elastica::reach(40, RIGID, load)?.wall_force, force, bound));
    let errors: Vec<f64> = [10, 20, 40]
        .into_iter()
        .map(|n| Ok((Elastica::reach(n, RIGID, load)?.wall_force / force - 1.0).abs()))
        .collect::<Result<_>>()?;
    rows.push(falling("C2 point to line", "error of force, h = L/10 … L/40", &errors, 0.5));
    Ok(rows)
}

/// A row that passes if every error is at most `ratio` times the one before: computed and expected are the last and
/// the first.
pub(super) fn falling(name: &str, quantity: &str, errors: &[f64], ratio: f64) -> Row {
    let worst = errors.windows(2).map(|pair| pair[1] / pair[0]).fold(0.0, f64::max);
    let (first, last) = (errors[0], errors[errors.len() - 1]);
    Row::with_error(name, quantity, last, first, worst, ratio)
}

/// Rod of C6: EI in N·mm², radius in mm, foundation modulus in N/mm².
pub(crate) const BENDING: f64 = 10.0;
const WIRE_RADIUS: f64 = 0.45;
pub(crate) const MODULUS: f64 = 1.0;
/// Initial penetration of the rod of C6 into the floor, mm: so the floor also holds it where it would lift off.
const PRESSED: f64 = 0.02;

/// C6: a rod pressed into a soft floor by its weight, with `elements` in `length` mm.
fn pressed(elements: usize, length: f64) -> Result<WallRod> {
    let setup = WallRodSpec { length, bending: BENDING, radius: WIRE_RADIUS, elements, modulus: MODULUS };
    let mut channel = channel(&setup, [PRESSED - WIRE_RADIUS, 10.0])?;
    channel.loads.distributed = vec![(0, elements, Vec3::y() * -(MODULUS * PRESSED))];
    Ok(channel)
}

/// Depth by which a force presses the middle of the rod into the floor, mm.
fn sunk(elements: usize, force: f64) -> Result<f64> {
    let mut channel = pressed(elements, 60.0)?;
    channel.loads.forces = vec![(elements / 2, Vec3::y() * -force)];
    channel.solve()?;
    Ok(-channel.state.positions[elements / 2].y)
}

/// Axial load at which a rod of six half-waves, pinned at both ends, buckles on the floor, N.
pub(crate) fn buckling_load(elements: usize) -> Result<f64> {
    let length = 6.0 * PI * (BENDING / MODULUS).powf(0.25);
    let mut channel = pressed(elements, length)?;
    channel.supports.start_tangent = false;
    channel.supports.end_directions = vec![Vec3::y(), Vec3::z()];
    channel.supports.end_position = Vec3::x() * length;
    channel.solve()?;
    Ok(channel.buckling_load(20.0))
}

pub(super) fn compliant() -> Result<Vec<Row>> {
    let force = 0.1;
    let deep = force * (0.25 * MODULUS / BENDING).powf(0.25) / (2.0 * MODULUS);
    let critical = 2.0 * (MODULUS * BENDING).sqrt();
    let order = |expected: f64, find: &dyn Fn(usize) -> Result<f64>| {
        observed_order(80, 1e-6, |n| Ok((find(n)? / expected - 1.0).abs()))
    };
    let (name, bound) = ("C6 compliant wall, 80 elements", 1e-2);
    Ok(vec![
        Row::relative(name, "depth under a point load", sunk(80, force)?, deep, bound)
            .order(order(deep, &|n| sunk(n, force))?),
        Row::relative(name, "axial buckling load", buckling_load(80)?, critical, bound)
            .order(order(critical, &buckling_load)?),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_wall_and_another_load_are_seen() {
        let off = |found: f64, expected: f64, bound: f64| !Row::relative("", "", found, expected, bound).pass;
        let soft = Elastica::reach(40, 1e5, 88.71619713996).unwrap();
        assert!(off(soft.wall_force, 12.51618305077, 1e-3) && off(soft.root_moment, 0.6635925966109, 1e-3));
        let more = Elastica::reach(40, RIGID, 89.0).unwrap();
        assert!(off(more.wall_force, 12.51618305077, 1e-3));
        assert!(off(sunk(80, 0.1 * 1.02).unwrap(), sunk(80, 0.1).unwrap(), 1e-2));
        assert!(!falling("", "", &[1e-2, 6e-3], 0.5).pass && falling("", "", &[1e-2, 4e-3], 0.5).pass);
    }
}

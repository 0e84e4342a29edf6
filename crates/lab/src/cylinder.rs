//! C1: a rod in a cylinder with a clearance r: its helix under thrust, the loads at which it leaves the bottom of a
//! horizontal cylinder, and friction along the helix. In units of EI and r.

use super::Row;
use super::contact::falling;

use endowire_core::shape::Frame;
use endowire_core::statics::{WallRod, WallRodSpec};
use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_core::{Result, Vec3};
use std::f64::consts::{PI, SQRT_2, TAU};

/// Radius of the rod relative to the clearance; only the difference of distance and radius matters.
const RADIUS: f64 = 0.3;

/// The cylinder of clearance 1 about x, from −1 to `length` + 1: rings of `around` vertices, twice as far apart as
/// these.
fn cylinder(length: f64, around: u32) -> Result<Wall> {
    let radius = 1.0 + RADIUS;
    let apart = 2.0 * TAU * radius / f64::from(around);
    let rings = ((length + 2.0) / apart).ceil() as u32;
    let mut mesh = SurfaceMesh::default();
    for i in 0..=rings {
        let x = (length + 2.0) * f64::from(i) / f64::from(rings) - 1.0;
        for k in 0..around {
            // Every other ring is rotated by half an edge.
            let angle = TAU * (f64::from(k) + 0.5 * f64::from(i % 2)) / f64::from(around);
            mesh.vertices_mm.push(Vec3::new(x, -radius * angle.cos(), radius * angle.sin()));
        }
    }
    for i in 0..rings {
        for k in 0..around {
            let at = |i: u32, k: u32| i * around + k % around;
            let (p, q, r, s) = (at(i, k), at(i, k + 1), at(i + 1, k), at(i + 1, k + 1));
            let [first, second] = if i % 2 == 0 { [[p, q, r], [q, s, r]] } else { [[p, q, s], [p, s, r]] };
            mesh.triangles.extend([first, second]);
        }
    }
    Wall::from_surface(&mesh)
}

/// A position `turn` radians around the cylinder from its bottom, and the direction of a helix there.
fn on_helix(turn: f64, angle: f64) -> (Vec3, Vec3) {
    let (sin, cos) = turn.sin_cos();
    (Vec3::new(0.0, -cos, sin), Vec3::new(angle.cos(), angle.sin() * sin, angle.sin() * cos))
}

/// Resolution of a helix.
#[derive(Debug, Clone, Copy)]
struct Fineness {
    /// Elements per turn.
    elements: usize,
    /// Vertices around the cylinder.
    around: u32,
    /// Ratio of the clearance to the depth to which the helix presses itself into the wall.
    hardness: f64,
}

/// A rod wound into `turns` turns of about `angle` by the corresponding thrust: clamped at its start along the helix,
/// otherwise free, so no moment about the cylinder's axis acts. The influence of the ends decays by a factor of 10⁴
/// per turn.
struct Helix {
    rod: WallRod,
    turns: usize,
    per_turn: usize,
}

/// Measurements in a turn.
struct Turn {
    /// Mean sin²α.
    sine2: f64,
    /// Contact force per length.
    pressure: f64,
    /// Bending energy per length.
    bending: f64,
    /// Shortening along the cylinder per length.
    shortening: f64,
    /// Mean height above the bottom.
    height: f64,
}

/// Thrust 2 EI sin²α cos α/r² of a helix.
fn thrust(sine2: f64) -> f64 {
    2.0 * sine2 * (1.0 - sine2).sqrt()
}

impl Helix {
    fn new(fine: Fineness, angle: f64, turns: usize) -> Result<Self> {
        let Fineness { elements: per_turn, around, hardness } = fine;
        let sine = angle.sin();
        let length = TAU / sine * turns as f64;
        let (modulus, elements) = (hardness * sine.powi(4), per_turn * turns);
        let setup = WallRodSpec { length, bending: 1.0, radius: RADIUS, elements, modulus };
        let start = on_helix(0.0, angle).0;
        let shape = |s: f64| Frame::new(on_helix(s * sine, angle).1, None);
        let mut rod = WallRod::new(&cylinder(length, around)?, &setup, start, shape)?;
        rod.tolerance = 1e-8;
        rod.loads.forces = vec![(elements, Vec3::x() * -thrust(sine * sine))];
        rod.solve()?;
        Ok(Self { rod, turns, per_turn })
    }

    /// Arc lengths where turn `k` starts and ends, just before the nodes there.
    fn range(&self, k: usize) -> [f64; 2] {
        let h = self.rod.element_length(0);
        [k, k + 1].map(|k| h * ((self.per_turn * k) as f64 - 1e-6))
    }

    /// The turn in the middle.
    fn middle(&mut self) -> Turn {
        let k = self.turns / 2;
        let [from, to] = self.range(k);
        let touches = self.rod.touches();
        let inside = touches.iter().filter(|(s, _)| *s > from && *s < to);
        let force: f64 = inside.map(|(_, touch)| touch.contact.force_n).sum();
        let (rod, state) = (&self.rod, &self.rod.state);
        let range = self.per_turn * k..self.per_turn * (k + 1);
        let mean =
            |value: &dyn Fn(usize) -> f64| range.clone().map(value).sum::<f64>() / self.per_turn as f64;
        Turn {
            sine2: mean(&|i| 1.0 - state.frames[i].t.x.powi(2)),
            pressure: force / (to - from),
            bending: mean(&|e| rod.bending_energy(e) / rod.element_length(e)),
            shortening: 1.0 - (state.positions[range.end].x - state.positions[range.start].x) / (to - from),
            height: 1.0 + mean(&|i| state.positions[i].y),
        }
    }

    /// Thrust in the rod at the start of turn `k`.
    fn thrust_at(&mut self, k: usize) -> f64 {
        let [end, _] = self.range(k);
        let touches = self.rod.touches();
        let before = touches.iter().filter(|(s, _)| *s < end).map(|(_, touch)| touch.contact);
        let wall: f64 = before.map(|c| (c.normal * c.force_n + c.friction_n).x).sum();
        self.rod.clamp().force.x + wall
    }
}

/// Errors of thrust, contact force per length and push force of a helix.
fn helix_rows(name: &str, fine: Fineness, angle: f64) -> Result<[Row; 3]> {
    let mut helix = Helix::new(fine, angle, 3)?;
    let Turn { sine2, pressure, .. } = helix.middle();
    let clamp = helix.rod.clamp();
    let push = clamp.push_force(&helix.rod.state.frames[0].t, 1.0, 1.0, &Vec3::zeros());
    // n·t and the moment of a helix are −F cos α − EI sin⁴α/r² and EI sin²α/r, and the push force is the same along the rod.
    let (drive, bound) = (thrust(sine2) * (1.0 - sine2).sqrt() + 0.5 * sine2 * sine2, 1e-3);
    Ok([
        Row::relative(name, "thrust", clamp.force.x, thrust(sine2), bound),
        Row::relative(name, "contact force per length", pressure, sine2 * sine2, bound),
        Row::relative(name, "push force", push, drive, bound),
    ])
}

pub(super) fn helix() -> Result<Vec<Row>> {
    let fine = Fineness { elements: 32, around: 64, hardness: 1e4 };
    let mut rows = Vec::new();
    for angle in [0.25, 0.5] {
        rows.extend(helix_rows(&format!("C1 helix, α≈{angle}"), fine, angle)?);
    }
    let name = "C1 helix, α≈0.5";
    let error = |fine: Fineness| -> Result<f64> { Ok(helix_rows(name, fine, 0.5)?[0].error) };
    let found = rows[3].error;
    let at = |hardness: f64| error(Fineness { hardness, ..fine });
    rows.push(falling(name, "error of thrust, r/p = 10² … 10⁴", &[at(1e2)?, at(1e3)?, found], 0.5));
    let coarse = error(Fineness { around: 16, ..fine })?;
    rows.push(falling(name, "error of thrust, 16, 64 around", &[coarse, found], 0.5));
    Ok(rows)
}

/// Foundation modulus of the cylinder under the rod lying in it.
const FLOOR: f64 = 1e3;
/// Elements per half-wave of a rod that snakes.
const PER_HALF_WAVE: f64 = 8.0;

/// A rod that lies at the bottom of the cylinder, pinned at both ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lying {
    /// Half-waves of length π in it.
    pub(crate) half_waves: f64,
    /// Vertices around the cylinder.
    pub(crate) around: u32,
    /// Weight per length.
    pub(crate) weight: f64,
    /// Foundation modulus of the cylinder.
    pub(crate) modulus: f64,
}

/// Load at which a rod in the cylinder starts to snake.
pub(crate) fn snaking(rod: Lying) -> Result<f64> {
    let Lying { half_waves, around, weight, modulus } = rod;
    let (length, elements) = (half_waves * PI, (PER_HALF_WAVE * half_waves) as usize);
    let setup = WallRodSpec { length, bending: 1.0, radius: RADIUS, elements, modulus };
    // As deep as its weight presses it.
    let start = Vec3::y() * -(1.0 + weight / modulus);
    let along = Frame::new(Vec3::x(), None);
    let mut rod = WallRod::new(&cylinder(length, around)?, &setup, start, |_| along)?;
    rod.loads.distributed = vec![(0, elements, Vec3::y() * -weight)];
    rod.supports.start_tangent = false;
    rod.supports.end_directions = vec![Vec3::y(), Vec3::z()];
    rod.supports.end_position = start + Vec3::x() * length;
    rod.solve()?;
    Ok(rod.buckling_load(8.0))
}

/// F/√(EI w/r) of a helix without weight, for the weight w that would raise its energy to that of the straight rod at
/// the bottom.
///
/// Chen, Lin and Cheatham (1990) compare the straight rod with a uniform helix of the best pitch under the same load,
/// of energy ½ EI r² q⁴ − ½ F r² q² + w r per length: zero at F = 2√2 √(EI w/r). This is not a stability limit, and
/// weight makes the helix non-uniform: minimised over its shape too, the energy vanishes 1.34 % earlier, at 2.79043
/// √(EI w/r).
fn winding(angle: f64) -> Result<f64> {
    let mut helix = Helix::new(Fineness { elements: 32, around: 48, hardness: 1e3 }, angle, 3)?;
    let load = helix.rod.clamp().force.x;
    let turn = helix.middle();
    Ok(load / ((load * turn.shortening - turn.bending) / turn.height).sqrt())
}

pub(super) fn weight() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let bound = 1e-2;
    for waves in [6.0, 4.5] {
        // Between pins, n half-waves at F = EI (nπ/L)² + (w/r) (L/nπ)².
        let half_waves = |n: i32| (f64::from(n) / waves).powi(2) + (waves / f64::from(n)).powi(2);
        let expected = (1..20).map(half_waves).fold(f64::MAX, f64::min);
        let name = format!("C1 snaking, {waves} half-waves of length");
        let at = |around: u32| snaking(Lying { half_waves: waves, around, weight: 1.0, modulus: FLOOR });
        let loads = [at(16)?, at(32)?, at(64)?];
        rows.push(Row::relative(&name, "load", loads[2], expected, bound));
        let errors = loads.map(|load| (load / expected - 1.0).abs());
        rows.push(falling(&name, "error of load, 16 … 64 around", &errors, 0.5));
    }
    let expected = 2.0 * SQRT_2;
    let loads = [winding(0.3)?, winding(0.15)?];
    rows.push(Row::relative("C1 winding, α≈0.15", "load", loads[1], expected, bound));
    let errors = loads.map(|load| (load / expected - 1.0).abs());
    rows.push(falling("C1 winding", "error of load, α≈0.3, 0.15", &errors, 0.5));
    Ok(rows)
}

/// A rod that is pushed through its helix.
///
/// If friction acts along the axis alone, thrust and helix are related as without it, and F_in = F_out/(1 − x) with
/// x = μ r L F_out/(4EI). On a rod that slides along its own curve friction acts along that curve, which also rotates
/// it about the axis; then the whole helix keeps the pitch of its far end, presses with r F_out (2F − F_out)/(4EI)
/// where the thrust is F, and F_in = ½ F_out (1 + e^{2x}): the same up to x³/3. Both hold for small α.
struct Pushed {
    /// Thrust at the start and end of five turns, and at the end of the rod.
    thrust: [f64; 3],
    /// μ r L/(4EI) of these turns.
    friction: f64,
}

impl Pushed {
    fn new(angle: f64, friction: f64) -> Result<Self> {
        let mut helix = Helix::new(Fineness { elements: 16, around: 32, hardness: 1e3 }, angle, 7)?;
        helix.rod.slide(friction, 0.1)?;
        let length = helix.range(6)[0] - helix.range(1)[0];
        let thrust = [helix.thrust_at(1), helix.thrust_at(6), thrust(angle.sin().powi(2))];
        Ok(Self { thrust, friction: 0.25 * friction * length })
    }

    /// The ratio of the thrusts, and its value for friction along the axis.
    fn along_axis(&self) -> [f64; 2] {
        let [before, behind, _] = self.thrust;
        [before / behind, 1.0 / (1.0 - self.friction * behind)]
    }

    /// The ratio of F − ½F_out, and its value for friction along the curve.
    fn along_curve(&self) -> [f64; 2] {
        let [before, behind, out] = self.thrust;
        [(before - 0.5 * out) / (behind - 0.5 * out), (2.0 * self.friction * out).exp()]
    }
}

pub(super) fn rubbed() -> Result<Vec<Row>> {
    let bound = 1e-2;
    let [ratio, expected] = Pushed::new(0.15, 0.05)?.along_axis();
    let mut rows =
        vec![Row::relative("C1 pushed, α≈0.15, μ=0.05", "ratio of thrusts", ratio, expected, bound)];
    let [steep, flat] = [Pushed::new(0.2, 0.1)?, Pushed::new(0.1, 0.2)?].map(|pushed| pushed.along_curve());
    rows.push(Row::relative("C1 pushed, α≈0.1, μ=0.2", "ratio of F − ½F_out", flat[0], flat[1], bound));
    let errors = [steep, flat].map(|[ratio, expected]| (ratio / expected - 1.0).abs());
    rows.push(falling("C1 pushed, μα=0.02", "error of ratio, α≈0.2, 0.1", &errors, 0.5));
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_wall_another_weight_and_another_friction_are_seen() {
        let fine = Fineness { elements: 32, around: 48, hardness: 1e4 };
        assert!(helix_rows("", fine, 0.5).unwrap().iter().all(|row| row.pass));
        let soft = helix_rows("", Fineness { hardness: 100.0, around: 64, ..fine }, 0.5).unwrap();
        assert!(soft.iter().all(|row| !row.pass), "{soft:?}");
        // Heavier by 5 %: the load is 2.5 % higher.
        let rod = Lying { half_waves: 6.0, around: 48, weight: 1.05, modulus: FLOOR };
        let heavy = snaking(rod).unwrap();
        assert!(!Row::relative("", "", heavy, 2.0, 1e-2).pass, "{heavy}");
        let [ratio, _] = Pushed::new(0.15, 0.06).unwrap().along_axis();
        let [_, expected] = Pushed::new(0.15, 0.05).unwrap().along_axis();
        assert!(!Row::relative("", "", ratio, expected, 1e-2).pass, "{ratio} {expected}");
    }
}

//! The spine: vertebrae from the first cervical to the last lumbar one, no two alike.

use std::f64::consts::TAU;

use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Vec3, random};

use super::loft::{bar, ellipsoid, loft, smooth, tube};
use super::trunk::{Trunk, step};

/// Vertebrae by number: cervical from −6, thoracic from 1, lumbar to 17.
const VERTEBRAE: std::ops::RangeInclusive<i32> = -6..=17;
/// Numbers of vertebrae, and half width, half depth and half of the length between the transverse processes' tips there,
/// mm; between them they follow (Panjabi et al., Spine 1991 and 1992).
const SIZES_MM: [(f64, [f64; 3]); 9] = [
    (-6.0, [10.5, 8.0, 30.0]),
    (-1.0, [11.5, 8.5, 27.0]),
    (1.0, [14.5, 9.0, 36.0]),
    (4.0, [13.0, 10.5, 33.0]),
    (8.0, [14.5, 13.5, 30.0]),
    (12.0, [19.5, 15.5, 22.0]),
    (13.0, [20.5, 16.0, 36.0]),
    (15.0, [22.5, 17.0, 46.0]),
    (17.0, [25.5, 17.5, 42.0]),
];
/// Largest differences of a vertebra from these: part of its size, slope of its end plates, and how far aside it is.
const DIFFERS: f64 = 0.06;
const SLOPES: f64 = 0.05;
const ASIDE_MM: f64 = 1.2;
/// Height of a body as a part of the distance from one to the next: discs of the loins are thicker.
const TALL: [f64; 2] = [0.41, 0.375];

/// One vertebra.
struct Vertebra {
    number: i32,
    /// Middle of its body.
    at: Vec3,
    wide: f64,
    deep: f64,
    /// Half its body's height.
    half: f64,
    /// Half length between the tips of its transverse processes.
    reach: f64,
    /// Slopes of its end plates to the left and to the back.
    slope: [f64; 2],
}

impl Vertebra {
    fn is_lumbar(&self) -> bool {
        self.number > 12
    }

    /// A number from −1 to 1 of this vertebra.
    fn own(&self, index: u64) -> f64 {
        own(self.number, index)
    }

    /// A place at a distance to the left, back and up from its body's middle, as parts of half its width, depth and
    /// height.
    fn place(&self, [left, back, up]: [f64; 3]) -> Vec3 {
        let (x, y) = (left * self.wide, back * self.deep);
        self.at + Vec3::new(x, y, up * self.half + self.slope[0] * x + self.slope[1] * y)
    }
}

fn own(number: i32, index: u64) -> f64 {
    2.0 * random::unit(random::splitmix64((number - VERTEBRAE.start()) as u64, 16 + index)) - 1.0
}

impl Trunk {
    /// Adds the vertebrae, with all surfaces `inset` inside the bone's.
    pub(super) fn spine(&self, mesh: &mut SurfaceMesh, inset: f64) {
        for number in VERTEBRAE {
            let vertebra = self.vertebra_of(number);
            self::body(mesh, &vertebra, inset);
            arch(mesh, &vertebra, inset);
            spurs(mesh, &vertebra, inset);
        }
    }

    fn vertebra_of(&self, number: i32) -> Vertebra {
        let z = self.vertebra(number);
        let next = (self.vertebra(number - 1) - z).min(z - self.vertebra(number + 1));
        let after = SIZES_MM.iter().position(|row| row.0 >= f64::from(number)).unwrap_or(SIZES_MM.len() - 1);
        let [(from, a), (to, b)] = [SIZES_MM[after.saturating_sub(1)], SIZES_MM[after]];
        let part = if after == 0 { 0.0 } else { (f64::from(number) - from) / (to - from) };
        let size = |k: usize| (a[k] + (b[k] - a[k]) * part) * (1.0 + DIFFERS * own(number, k as u64));
        // Hardly anybody's spine is straight.
        let curve = 3.0 * libm::sin(0.42 * f64::from(number)) * step(f64::from(number), -3.0, 3.0);
        let [low, high] = TALL;
        let tall = low + (high - low) * step(f64::from(number), 10.0, 14.0);
        Vertebra {
            number,
            at: Vec3::new(self.spine[0] + curve + ASIDE_MM * own(number, 3), self.spine_y(z), z),
            wide: size(0),
            deep: size(1),
            half: tall * next * (1.0 + 0.5 * DIFFERS * own(number, 4)),
            reach: size(2),
            slope: [SLOPES * own(number, 5), 0.6 * SLOPES * own(number, 6) - 0.02],
        }
    }
}

/// The body: narrow in the middle, with concave end plates.
fn body(mesh: &mut SurfaceMesh, vertebra: &Vertebra, inset: f64) {
    const SIDES: i32 = 32;
    let waist = if vertebra.is_lumbar() { 0.84 } else { 0.88 };
    // Height, and part of the width: an end plate is deepest a little behind its middle.
    let profile: [(f64, f64); 12] = [
        (-0.8, 0.3),
        (-0.86, 0.66),
        (-0.99, 0.93),
        (-0.97, 0.99),
        (-0.82, 1.0),
        (-0.3, waist),
        (0.3, waist),
        (0.82, 1.0),
        (0.97, 0.99),
        (0.99, 0.93),
        (0.86, 0.66),
        (0.8, 0.3),
    ];
    let shrunk = |size: f64| (size - inset).max(0.3 * size) / size;
    let [wide, deep, half] = [vertebra.wide, vertebra.deep, vertebra.half].map(shrunk);
    let ring = |(up, out): (f64, f64)| -> Vec<Vec3> {
        let at = |k: i32| libm::sincos(TAU * f64::from(k) / f64::from(SIDES));
        let corner = |(s, c): (f64, f64)| {
            // Flat towards the canal behind, and squarer than an ellipse.
            let square = 1.0 + 0.06 * (2.0 * s * c).abs();
            let back = (s * square).min(0.82);
            vertebra.place([wide * out * c * square, deep * out * back, half * up])
        };
        (0..SIDES).map(at).map(corner).collect()
    };
    loft(mesh, &profile.map(ring));
}

/// Pedicles, laminae, joints, and transverse and spinous processes.
fn arch(mesh: &mut SurfaceMesh, vertebra: &Vertebra, inset: f64) {
    let (wide, deep, half) = (vertebra.wide, vertebra.deep, vertebra.half);
    let at = |out: f64, back: f64, up: f64| vertebra.at + Vec3::new(out, deep + back, up);
    let lumbar = vertebra.is_lumbar();
    let thick = (0.24 * wide).clamp(2.8, 5.6);
    let tall = (0.42 * half).max(thick);
    let apart = 0.68 * wide;
    for side in [-1.0, 1.0] {
        let high = 0.42 * half + 0.6 * vertebra.own(7);
        // Taller than wide: seen from the front, a ring on each side of the body.
        let up = Vec3::z() * tall;
        let root = [
            (at(side * apart, -2.0, high), thick, up),
            (at(side * (apart + 0.8), 9.0, high), 0.95 * thick, up * 0.95),
        ];
        bar(mesh, &root, inset);
        let reach = vertebra.reach * (1.0 + 0.5 * DIFFERS * side * vertebra.own(8));
        // Blades in the loins, which a picture hardly shows at their tips.
        let (slim, tip) = if lumbar { (2.5, 0.5) } else { (3.7, 0.9) };
        let rise = if lumbar { 0.25 * half } else { 3.0 } + 2.0 * vertebra.own(9);
        let process = [
            (at(side * (apart + 1.0), 8.5, high - 1.0), thick.min(slim + 1.0)),
            (at(side * 0.6 * (reach + apart), 10.0, high + 0.4 * rise), slim),
            (at(side * reach, 12.5, high + rise), tip * slim),
        ];
        tube(mesh, &smooth(&process, inset));
        let lamina = [
            (at(side * (apart - 0.5), 10.0, 0.15 * half), 0.75 * thick),
            (at(side * 0.55 * apart, 16.0, -0.25 * half), 0.7 * thick),
            (at(0.0, 19.0, -0.4 * half), 0.7 * thick),
        ];
        tube(mesh, &smooth(&lamina, inset));
        // The joints, one above the other.
        let joint = [(0.95, 0.9), (0.85, -0.95)];
        for (out, up) in joint {
            let size = Vec3::new(0.75 * thick, thick, 0.42 * half).add_scalar(-inset);
            if size.min() > 0.3 {
                ellipsoid(mesh, at(side * out * apart, 12.5, up * half), size);
            }
        }
    }
    // A hatchet in the loins, a long drooping blade in the chest.
    let droop = if lumbar { 0.55 * half } else { 1.1 * half };
    let long = if lumbar { 17.0 } else { 15.0 };
    let thin = if lumbar { 3.1 } else { 2.6 };
    let bent = 1.6 * vertebra.own(10);
    let blade = if lumbar { 0.42 * half } else { thin + 1.2 };
    let down = if lumbar { 0.6 * half } else { 0.5 * half };
    let spinous = [
        (at(0.0, 18.0, -down), thin, Vec3::z() * blade),
        (at(0.5 * bent, 18.0 + 0.6 * long, -down - 0.5 * droop), thin, Vec3::z() * (0.9 * blade)),
        (at(bent, 18.0 + long, -down - droop), 1.2 * thin, Vec3::z() * (0.8 * blade)),
    ];
    bar(mesh, &spinous, inset);
}

/// Spurs on the rims of some bodies, as most adults have.
fn spurs(mesh: &mut SurfaceMesh, vertebra: &Vertebra, inset: f64) {
    if vertebra.number < 5 {
        return;
    }
    for (index, (side, up)) in (20..).zip([(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]) {
        let size = 2.4 * (vertebra.own(index) - 0.1);
        if size < 0.5 {
            continue;
        }
        let root = vertebra.place([side * 0.93, -0.3, up * 0.88]);
        let tip =
            vertebra.place([side * 1.04, -0.3, up * 0.97]) + Vec3::new(side * size, 0.0, up * 0.6 * size);
        tube(mesh, &smooth(&[(root, 2.3), (tip, 1.2)], inset.min(0.6)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::check_closed;
    use crate::spec::TorsoSpec;

    fn trunk() -> Trunk {
        let vertices_mm = vec![Vec3::new(-40.0, -50.0, 0.0), Vec3::new(40.0, 30.0, 300.0)];
        Trunk::new(&TorsoSpec::default(), &SurfaceMesh { vertices_mm, triangles: vec![] })
    }

    #[test]
    fn no_two_vertebrae_are_alike_and_all_grow_downwards() {
        let trunk = trunk();
        let all: Vec<Vertebra> = VERTEBRAE.map(|number| trunk.vertebra_of(number)).collect();
        for (k, one) in all.iter().enumerate() {
            for other in &all[k + 1..] {
                let apart = (one.wide - other.wide).abs() + (one.half - other.half).abs();
                assert!(
                    apart + (one.slope[0] - other.slope[0]).abs() > 1e-3,
                    "{} {}",
                    one.number,
                    other.number
                );
            }
        }
        let wide = |number: i32| all.iter().find(|one| one.number == number).unwrap().wide;
        assert!(wide(17) > wide(12) && wide(12) > wide(6) && wide(6) > wide(-3));
        // The fifth lumbar body is 51 mm wide, the sixth thoracic one 28 (Panjabi).
        assert!((2.0 * wide(17) - 51.0).abs() < 4.0 && (2.0 * wide(6) - 27.5).abs() < 3.0);
    }

    #[test]
    fn a_spine_is_closed_and_its_marrow_inside() {
        let trunk = trunk();
        let of = |inset: f64| {
            let mut mesh = SurfaceMesh::default();
            trunk.spine(&mut mesh, inset);
            check_closed(&mesh).unwrap();
            mesh.signed_volume_mm3()
        };
        assert!(of(1.0) < 0.85 * of(0.0) && of(1.0) > 0.3 * of(0.0));
    }
}

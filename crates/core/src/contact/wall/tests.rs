//! The wall's energy in Newton's method, in small pieces of vessel.

use std::f64::consts::PI;

use super::*;
use crate::contact::surface::Hint;
use crate::contact::{ContactSurface, WallPotential, WallProperties};
use crate::rod::Frame;
use crate::tuning::ContactTuning;
use crate::vessel::{NoStore, SurfaceMesh, Wall};

/// A closed outline swept along a line: `place` gives the k-th of `rings` its middle, the direction of the outline's
/// first axis and its size; the second axis is y.
pub(super) fn swept(
    outline: &[(f64, f64)],
    rings: u32,
    place: impl Fn(u32) -> (Vec3, Vec3, f64),
) -> ContactSurface {
    surface(&sweep(outline, rings, place))
}

fn sweep(outline: &[(f64, f64)], rings: u32, place: impl Fn(u32) -> (Vec3, Vec3, f64)) -> SurfaceMesh {
    let count = outline.len() as u32;
    let mut mesh = SurfaceMesh::default();
    for k in 0..rings {
        let (middle, n, size) = place(k);
        mesh.vertices_mm.extend(outline.iter().map(|(u, v)| middle + (n * *u + Vec3::y() * *v) * size));
    }
    for k in 0..rings - 1 {
        for i in 0..count {
            let next = (i + 1) % count;
            let [a, b, c, d] = [(i, k), (next, k), (next, k + 1), (i, k + 1)].map(|(i, k)| k * count + i);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// The wall felt as it is meshed.
fn surface(mesh: &SurfaceMesh) -> ContactSurface {
    let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
    ContactSurface::new(&Wall::welded(mesh).unwrap(), (RADIUS_MM, RADIUS_MM), &properties, &NoStore).unwrap()
}

/// An ellipse with these half axes, mm.
pub(super) fn ellipse(a_mm: f64, b_mm: f64, count: u32) -> Vec<(f64, f64)> {
    let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(count);
    (0..count).map(|i| (a_mm * angle(i).cos(), b_mm * angle(i).sin())).collect()
}

/// Along the z axis from 0 to 40 mm.
fn along_z(k: u32) -> (Vec3, Vec3, f64) {
    (Vec3::z() * (0.5 * f64::from(k)), Vec3::x(), 1.0)
}

/// A tube of radius 2 mm.
pub(super) fn straight() -> ContactSurface {
    swept(&ellipse(2.0, 2.0, 24), 81, along_z)
}

/// A slit 0.8 mm high: both sides are near everywhere.
fn slit() -> ContactSurface {
    swept(&ellipse(3.0, 0.4, 48), 81, along_z)
}

pub(super) const RADIUS_MM: f64 = 0.45;

/// A rod in a wall, and its contact cache.
pub(super) struct Rod<'a> {
    pub(super) surface: &'a ContactSurface,
    pub(super) elements: Vec<ElementData>,
    pub(super) points: Vec<ContactPoint>,
    pub(super) cache: ContactCache,
    pub(super) friction: Friction,
}

/// A rod of elements of 1 mm with points at these decreasing ξ of each.
pub(super) fn rod<'a>(
    surface: &'a ContactSurface,
    elements: usize,
    places: &[f64],
    modulus_n_per_mm2: f64,
) -> Rod<'a> {
    let point = |element: usize, xi: f64| ContactPoint {
        element,
        xi,
        instrument: 0,
        set: 0,
        from_tip_mm: (elements - element) as f64 - xi,
        weight_mm: 1.0 / places.len() as f64,
        potential: WallPotential { modulus_n_per_mm2, radius_mm: RADIUS_MM },
    };
    Rod {
        surface,
        elements: vec![ElementData::plain(1.0, 10.0); elements],
        points: (0..elements).rev().flat_map(|e| places.iter().map(move |xi| point(e, *xi))).collect(),
        cache: ContactCache::new(surface),
        friction: Friction::default(),
    }
}

impl Rod<'_> {
    pub(super) fn contact(&mut self) -> WallContact<'_> {
        WallContact::new(self.surface, &self.points, &mut self.cache, &mut self.friction, 10.0)
    }

    /// Straight, from a position.
    pub(super) fn at(&self, start: Vec3) -> RodState {
        RodState::straight(&self.elements, start, Frame::new(Vec3::z(), Some(Vec3::x())))
    }
}

#[test]
fn a_place_has_a_reading_for_each_triangle() {
    let surface = slit();
    let x = Vec3::new(0.4, 0.1, 20.1);
    let about = |y: f64| surface.nearest_piece(&Vec3::new(0.4, y, 20.1), 1.0).unwrap().0;
    let (near, far) = (about(0.38), about(-0.38));
    let mut rod = rod(&surface, 1, &[1.0], 1e3);
    let mut contact = rod.contact();
    let ask = |contact: &mut WallContact<'_>, triangle: u32| {
        let known = &mut contact.cache.points[0];
        (known.base_looked_at, known.base_piece) = (x, Some(triangle));
        (known.looked_at, known.piece) = (x, Some(triangle));
        contact.read_within(0, &x, 1.0).distance_mm()
    };
    let direct = |triangle: u32| surface.nearness(&x, Hint::Near(triangle), 1.0).value_mm();
    assert!((direct(near) - 0.3).abs() < 0.02 && (direct(far) - 0.5).abs() < 0.02);
    for triangle in [near, far, near, near, far] {
        assert_eq!(ask(&mut contact, triangle), direct(triangle));
    }
    let counted = contact.count();
    assert_eq!((counted.near, counted.avoided), (4, 1));
    // What was read from one piece must not be used for the other.
    contact.cache.readings[0].hint = Hint::Near(near);
    assert_eq!(ask(&mut contact, near), direct(far));
}

#[test]
fn what_has_come_back_out_of_the_wall_reads_what_is_nearest() {
    let surface = slit();
    let place = |y: f64| Vec3::new(0.4, y, 20.1);
    let about = |y: f64| surface.nearest_piece(&place(y), 1.0).unwrap().0;
    let (near, far) = (about(0.38), about(-0.38));
    let mut rod = rod(&surface, 1, &[1.0], 1e3);
    let mut contact = rod.contact();
    let mut ask = |y: f64, side: u32| {
        let known = &mut contact.cache.points[0];
        (known.base_looked_at, known.base_piece) = (place(y), Some(side));
        known.side = Some(side);
        contact.read_within(0, &place(y), 1.0).distance_mm()
    };
    // Sunk in at one side it stays with that, also behind it; across the lumen it is in contact with the other.
    for (y, side) in [(0.3, near), (0.42, near), (-0.3, far), (-0.42, far)] {
        assert_eq!(ask(y, side), surface.nearness(&place(y), Hint::Side(side), 1.0).value_mm(), "{y}");
    }
    for (y, side, other) in [(0.3, far, near), (0.42, far, near), (-0.42, near, far)] {
        let across = surface.nearness(&place(y), Hint::Side(side), 1.0).value_mm();
        assert!(ask(y, side) < 0.15 && across > 0.6, "{y}: {across}");
        assert!(
            (ask(y, side) - surface.nearness(&place(y), Hint::Near(other), 1.0).value_mm()).abs() < 1e-9,
            "{y}"
        );
    }
}

/// The reading of a point after a motion of some hundredths of a millimetre, and its reading without any knowledge of
/// its earlier position.
fn on_the_way(contact: &mut WallContact<'_>, from: Vec3, to: Vec3) -> [f64; 2] {
    let (triangle, _) = contact.surface.nearest_piece(&from, 5.0).unwrap();
    let radius_mm = contact.points[0].potential.radius_mm;
    let known = &mut contact.cache.points[0];
    (known.base_looked_at, known.base_piece) = (from, Some(triangle));
    (known.looked_at, known.piece) = (from, Some(triangle));
    contact.read_within(0, &from, radius_mm);
    let reported = contact.read_within(0, &to, radius_mm).distance_mm();
    [reported, contact.surface.nearness(&to, Hint::Near(triangle), radius_mm).value_mm()]
        .map(|mm| mm.min(radius_mm))
}

#[test]
fn what_a_point_reads_hangs_on_where_it_is_not_on_where_it_was() {
    let surface = crate::contact::ridge_tests::surface();
    let mut rod = rod(&surface, 1, &[1.0], 1e3);
    rod.points[0].potential.radius_mm = 0.2;
    let mut contact = rod.contact();
    // Over the crest the distance changes by up to ten times the motion.
    let (mut presses, mut steep) = (0, 0);
    for (k, from) in crate::contact::ridge_tests::points().enumerate() {
        let k = k as f64;
        let to = from + Vec3::new((1.7 * k).sin(), (2.3 * k).sin(), (3.1 * k).cos()) * 0.05;
        let [reported, fresh] = on_the_way(&mut contact, from, to);
        assert!((reported - fresh).abs() < 1e-12, "{from:?} {to:?}: {reported} for {fresh}");
        presses += usize::from(fresh > 0.0 && fresh < 0.2);
        let (triangle, _) = surface.nearest_piece(&from, 5.0).unwrap();
        let lost_mm = surface.nearness(&from, Hint::Near(triangle), f64::INFINITY).value_mm() - 0.2;
        steep += usize::from(fresh > 0.0 && fresh < 0.2 && lost_mm > 2.0 * (to - from).norm());
    }
    assert!(presses > 200 && steep > 3, "{presses} {steep}");
}

/// Whether a straight rod from `start` towards `end`, 5 mm long, has passed through the wall.
fn has_passed(surface: &ContactSurface, start: Vec3, end: Vec3) -> bool {
    let mut rod = rod(surface, 5, &[0.5], 1e4);
    let state =
        RodState::straight(&rod.elements, start, Frame::new((end - start).normalize(), Some(Vec3::x())));
    let elements = rod.elements.clone();
    rod.contact().passes_through(&elements, &state)
}

#[test]
fn behind_a_coarse_facet_is_not_yet_through_the_wall() {
    // Middles of the sides are 0.76 mm nearer to the axis than corners, and the smooth wall is not.
    let coarse = swept(&ellipse(4.0, 4.0, 5), 21, |k| (Vec3::z() * (2.0 * f64::from(k)), Vec3::x(), 1.0));
    let side = Vec3::new((0.2 * PI).cos(), (0.2 * PI).sin(), 0.0);
    let along =
        |from_mm: f64, to_mm: f64| (side * from_mm + Vec3::z() * 16.0, side * to_mm + Vec3::z() * 20.9);
    let flat = |x: &Vec3| coarse.nearest_piece(x, 10.0).unwrap().1;
    let (start, end) = along(3.0, 3.6);
    assert!(
        flat(&start) > 0.2 && flat(&end) < -ContactTuning::DEFAULT.sunk * RADIUS_MM,
        "{} {}",
        flat(&start),
        flat(&end)
    );
    assert!(!has_passed(&coarse, start, end));
    // Through the wall into another vessel beside it.
    let (both, from) = (side_by_side(), Vec3::new(0.3, 0.0, 20.0));
    assert!(has_passed(&both, from, from + Vec3::x()));
    assert!(!has_passed(&both, from, from + Vec3::z()));
}

/// Two tubes of radius 2 mm along the z axis, 4.4 mm apart.
fn side_by_side() -> ContactSurface {
    let tube = |x: f64| sweep(&ellipse(2.0, 2.0, 24), 81, |k| (along_z(k).0 + Vec3::x() * x, Vec3::x(), 1.0));
    let (mut both, other) = (tube(0.0), tube(4.4));
    let first = both.vertices_mm.len() as u32;
    both.triangles.extend(other.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
    both.vertices_mm.extend(other.vertices_mm);
    surface(&both)
}

#[test]
fn what_lies_between_two_rods_passes_through_nothing() {
    let both = side_by_side();
    // A line in one vessel, and behind its tip a coil that points along `t`.
    let passed = |start: Vec3, t: Vec3| {
        let mut rod = rod(&both, 5, &[0.5], 1e4);
        let (mut state, of_coil) = (rod.at(Vec3::new(0.0, 0.0, 10.0)), rod.elements.clone());
        state.join(&RodState::straight(&of_coil, start, Frame::new(t, Some(Vec3::y()))));
        let moved = |point: &ContactPoint| ContactPoint { element: 6 + point.element, ..*point };
        rod.points.extend(rod.points.iter().map(moved).collect::<Vec<_>>());
        rod.elements.push(ElementData::BREAK);
        rod.elements.extend(of_coil);
        let elements = rod.elements.clone();
        rod.contact().passes_through(&elements, &state)
    };
    let beside = Vec3::new(4.1, 0.0, 20.0);
    assert!(!passed(beside, Vec3::z()));
    assert!(passed(beside, -Vec3::x()));
}

//! Tests of friction on the wall, at a single point.

use super::*;
use crate::contact::WallPotential;
use crate::rod::Frame;

const RADIUS_MM: f64 = 0.4;

fn friction(slip: Vec3) -> (Friction, Vec3) {
    let normal = Vec3::new(0.3, -0.5, 0.8).normalize();
    let along = normal.cross(&Vec3::new(0.9, 0.1, 0.2)).normalize();
    let slider = Slider {
        from_mm: Vec3::new(1.0, 2.0, 3.0),
        from_rad: 0.7,
        along,
        radius_mm: RADIUS_MM,
        seen: (normal, 2.0),
        ..Slider::default().with(normal, 2.0)
    };
    let at = slider.from_mm + (slip - normal * normal.dot(&slip));
    let law = Coulomb { stick_mm: 0.01, ..Coulomb::new(0.25, &FrictionTuning::DEFAULT) };
    (Friction { law, sliders: vec![slider], ..Friction::default() }, at)
}

#[test]
fn derivatives_are_those_of_the_value() {
    // Slipping, sticking, and across the change from one to the other.
    for slip in [Vec3::new(0.3, 0.2, -0.1), Vec3::new(0.003, -0.002, 0.001), Vec3::new(0.0, 0.01, 0.002)] {
        let (friction, x) = friction(slip);
        let (angle, h) = (0.705, 1e-6);
        let here = friction.derivatives(0, &x, angle).unwrap();
        let at =
            |x: &Vec3, angle: f64| (friction.value(0, x, angle), friction.derivatives(0, x, angle).unwrap());
        for k in 0..3 {
            let e = Vec3::ith(k, h);
            let (plus, minus) = (at(&(x + e), angle), at(&(x - e), angle));
            assert!(((plus.0 - minus.0) / (2.0 * h) - here.gradient[k]).abs() < 1e-8);
            let column = (plus.1.gradient - minus.1.gradient) / (2.0 * h);
            assert!((column - here.hessian.column(k)).norm() < 1e-4 * (1.0 + column.norm()));
            assert!(((plus.1.turn - minus.1.turn) / (2.0 * h) - here.mixed[k]).abs() < 1e-3);
        }
        let (plus, minus) = (at(&x, angle + h), at(&x, angle - h));
        assert!(((plus.0 - minus.0) / (2.0 * h) - here.turn).abs() < 1e-8);
        assert!(((plus.1.turn - minus.1.turn) / (2.0 * h) - here.turn2).abs() < 1e-4 * (1.0 + here.turn2));
    }
}

#[test]
fn what_sticks_is_held_by_more_where_it_sticks_within_less() {
    for (slip, sticks) in [(Vec3::new(0.003, -0.002, 0.001), true), (Vec3::new(0.3, 0.2, -0.1), false)] {
        let (mut friction, x) = friction(slip);
        let (angle, h, stick_mm) = (0.705, 1e-6, 0.01);
        let here = friction.derivatives(0, &x, angle).unwrap();
        let mut at = |smaller: f64| {
            friction.stick_at(stick_mm * (1.0 - smaller));
            friction.derivatives(0, &x, angle).unwrap()
        };
        let (plus, minus) = (at(h), at(-h));
        let force = (plus.gradient - minus.gradient) / (2.0 * h);
        assert!((force - here.hessian * here.slip_mm).norm() < 1e-8, "{force} {here:?}");
        assert!(((plus.turn - minus.turn) / (2.0 * h) - here.mixed.dot(&here.slip_mm)).abs() < 1e-8);
        assert_eq!(force.norm() > 1e-3, sticks, "{force}");
    }
}

#[test]
fn a_slipping_point_is_held_by_mu_times_its_normal_force_and_a_stuck_one_by_less() {
    let (sliding, x) = friction(Vec3::new(0.3, 0.2, -0.1));
    let force = sliding.derivatives(0, &x, 0.7).unwrap().gradient;
    assert!((force.norm() - 0.5).abs() < 1e-12 && force.dot(&(x - Vec3::new(1.0, 2.0, 3.0))) > 0.0);
    let (stuck, x) = friction(Vec3::new(0.002, 0.0, 0.0));
    assert!(stuck.derivatives(0, &x, 0.7).unwrap().gradient.norm() < 0.4);
}

/// A point at the end of a rod that has slipped to the end of `state`, after a step in which it stuck within
/// `stick_mm`.
struct Slipped {
    friction: Friction,
    elements: Vec<ElementData>,
    state: RodState,
    points: [ContactPoint; 1],
}

fn slipped(slip: Vec3, stick_mm: f64) -> Slipped {
    let (mut friction, at) = friction(slip);
    friction.law.stick_mm = stick_mm;
    let elements = vec![ElementData::plain(1.0, 1.0)];
    let tangent = Vec3::new(0.6, 0.0, 0.8);
    let state = RodState::straight(&elements, at - tangent, Frame::new(tangent, Some(Vec3::y())));
    let potential = WallPotential { modulus_n_per_mm2: 1.0, radius_mm: RADIUS_MM };
    let point = ContactPoint {
        element: 0,
        xi: 1.0,
        instrument: 0,
        set: 0,
        from_tip_mm: 0.0,
        weight_mm: 1.0,
        potential,
    };
    // It has also rotated, within sticking and beyond.
    friction.sliders[0].from_rad = -0.2 * stick_mm / RADIUS_MM;
    Slipped { friction, elements, state, points: [point] }
}

impl Slipped {
    fn surface(&self) -> FrictionDerivatives {
        let x = self.points[0].position(&self.elements, &self.state);
        self.friction.derivatives(0, &x, self.points[0].angle(&self.state)).unwrap()
    }

    fn dissipated_mj(&self) -> f64 {
        self.friction.dissipated_mj(&self.elements, &self.state, &self.points).1
    }

    fn anchor(&mut self) {
        self.friction.anchor(&self.elements, &self.state, &self.points);
    }

    /// Translates the rod.
    fn shift(&mut self, way: Vec3) {
        self.state.positions.iter_mut().for_each(|x| *x += way);
    }
}

/// Slips far beyond ε, a little beyond it and within it.
const SLIPS: [Vec3; 3] =
    [Vec3::new(0.3, 0.2, -0.1), Vec3::new(0.0, 0.02, 0.004), Vec3::new(0.003, -0.002, 0.001)];

#[test]
fn what_comes_to_rest_sticks_within_a_hundredth_and_no_less() {
    let mut point = slipped(SLIPS[0], 0.01);
    point.friction.law.stick_within(sticking_mm(0.01, &FrictionTuning::DEFAULT));
    let mut within_mm = || {
        point.anchor();
        point.friction.law.stick_mm
    };
    assert!((within_mm() - 0.003).abs() < 1e-15 && (within_mm() - 0.0009).abs() < 1e-15);
    for _ in 0..10 {
        within_mm();
    }
    assert!((within_mm() - 1e-4).abs() < 1e-15);
}

#[test]
fn what_is_anchored_anew_is_held_as_before_and_has_taken_as_much() {
    for (slip, slips) in SLIPS.into_iter().zip([true, true, false]) {
        let mut point = slipped(slip, 0.01);
        let (before, taken_mj) = (point.surface(), point.dissipated_mj());
        assert_eq!((before.gradient.norm() - 0.5).abs() < 1e-12, slips, "{}", before.gradient.norm());
        point.anchor();
        assert!(point.friction.law.stick_mm < 0.004);
        let after = point.surface();
        assert!((after.gradient - before.gradient).norm() < 1e-12, "{before:?} {after:?}");
        assert!((after.turn - before.turn).abs() < 1e-12 && before.turn.abs() > 1e-3, "{before:?} {after:?}");
        assert!((point.dissipated_mj() - taken_mj).abs() < 1e-15 * (1.0 + taken_mj));
    }
}

#[test]
fn what_goes_back_the_way_it_came_is_held_by_less_only_once_anchored() {
    for slip in [SLIPS[0], SLIPS[1]] {
        let mut point = slipped(slip, 0.01);
        let back = -0.5
            * LEAST_STICK_MM.max(FrictionTuning::DEFAULT.stick_at_rest * 0.01)
            * point.surface().gradient.normalize();
        let mut anchored = slipped(slip, 0.01);
        anchored.anchor();
        point.shift(back);
        anchored.shift(back);
        // Half of ε back: φ′ of a half.
        let (free_n, held_n) = (point.surface().gradient.norm(), anchored.surface().gradient.norm());
        assert!((held_n - 0.75 * 0.5).abs() < 1e-9, "{held_n}");
        assert!((free_n - 0.5).abs() < 1e-12, "{free_n}");
    }
}

/// From then on the last recorded forces act, and the dissipated energy is kept.
#[test]
fn other_normal_forces_change_what_holds_and_not_what_was_taken() {
    let mut point = slipped(SLIPS[0], 0.01);
    let taken_mj = point.dissipated_mj();
    point.friction.sliders[0].seen.1 = 3.0;
    point.anchor();
    assert!((point.surface().gradient.norm() - 0.75).abs() < 1e-12);
    assert!((point.dissipated_mj() - taken_mj).abs() < 1e-15 * (1.0 + taken_mj));
}

#[test]
fn a_hand_that_rests_sticks_within_a_part_of_the_radius() {
    let mut point = slipped(SLIPS[0], 0.01);
    let mut sticks = |to_mm: f64| {
        let hand = HandMotion { from_mm: 10.0, to_mm, turn_rad: 0.0, steer: 0.0 };
        let Slipped { friction, elements, state, points } = &mut point;
        friction.begin(elements, state, points, (&[], &[]), &[hand]);
        friction.law.stick_mm
    };
    assert_eq!(sticks(10.0), FrictionTuning::DEFAULT.stick * RADIUS_MM);
    assert_eq!(sticks(12.0), FrictionTuning::DEFAULT.stick * 2.0);
}

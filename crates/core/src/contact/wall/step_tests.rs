//! Newton steps on a wall: their effect on contacts and friction.

use super::tests::{RADIUS_MM, rod, straight};
use super::*;
use crate::contact::{ContactSurface, HandMotion};
use crate::rod::{Assembly, PLAIN, Supports};
use crate::solve::contacts::falls_until;
use crate::solve::{ContactMerit, Moved, Newton, NewtonOptions, NewtonReport};
use crate::tuning::NewtonTuning;

/// A wall and a force on the tip; unless `predicting`, the contacts at the end of a step are hidden from Newton's
/// method.
struct Pushed<'a> {
    wall: WallContact<'a>,
    force_n: Vec3,
    predicting: bool,
}

impl External for Pushed<'_> {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        let n = state.elements();
        into.add_node(n, &-self.force_n, &nalgebra::Matrix3::zeros());
        into.add_value(-self.force_n.dot(&state.positions[n]));
        self.wall.linearise(elements, state, into);
    }
    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        self.wall.value(elements, state) - self.force_n.dot(&state.positions[state.elements()])
    }
    fn safe_fraction(&mut self, elements: &[ElementData], to: &RodState) -> f64 {
        self.wall.safe_fraction(elements, to)
    }
    fn sizes(&self) -> Sizes {
        self.wall.sizes()
    }
    fn visit_contacts(&mut self, ask: &mut dyn FnMut(&mut dyn Contacts)) {
        ask(self);
    }
}

impl Contacts for Pushed<'_> {
    fn predict(&mut self, elements: &[ElementData], base: &RodState, moved: &dyn Moved) {
        self.wall.predict(elements, base, moved);
    }
    fn update_active_set(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &dyn Moved,
        into: &mut dyn Stencils,
    ) -> usize {
        if self.predicting { self.wall.update_active_set(elements, base, moved, into) } else { 0 }
    }
    fn set_direction(&mut self, moved: &dyn Moved) {
        self.wall.set_direction(moved);
    }
    fn slope(&mut self, part: f64) -> f64 {
        self.wall.slope(part)
    }
    fn advance(&mut self, part: f64) {
        self.wall.advance(part);
    }
    fn merit(&mut self, moved: &dyn Moved) -> ContactMerit {
        self.wall.merit(moved)
    }
    fn accept_forces(&mut self, part: f64) {
        self.wall.accept_forces(part);
    }
    fn settled(&mut self, tolerance: f64) -> bool {
        self.wall.settled(tolerance)
    }
}

/// Presses the tip of a rod of 20 mm on the practically rigid wall of a tube, and rotates the force about the axis.
fn turned(surface: &ContactSurface, predicting: bool) -> (NewtonReport, RodState) {
    let mut rod = rod(surface, 20, &[1.0, 0.75, 0.5, 0.25], 1e4);
    let (mut state, elements) = (rod.at(Vec3::z() * 10.0), rod.elements.clone());
    let mut supports = Supports { start_tangent: true, ..Supports::default() };
    let mut newton = Newton::<PLAIN>::new(20);
    let options = NewtonOptions::default();
    let mut pushed = Pushed { wall: rod.contact(), force_n: Vec3::x() * 0.2, predicting };
    let report = newton.solve(&elements, &mut supports, &mut pushed, &mut state, &options);
    assert!(report.converged, "{}", report.reason);
    pushed.force_n = Vec3::new(0.5, 0.866, 0.0) * 0.2;
    let report = newton.solve(&elements, &mut supports, &mut pushed, &mut state, &options);
    (report, state)
}

#[test]
fn a_rod_slides_around_a_hard_wall_in_few_steps() {
    let surface = straight();
    let ((with, end), (without, same)) = (turned(&surface, true), turned(&surface, false));
    assert!(with.converged && with.stable && without.converged, "{} {}", with.reason, without.reason);
    assert!(end.positions[20].y > 0.8 && (end.positions[20] - same.positions[20]).norm() < 1e-6);
    let (few, many) = (with.iterations, without.iterations);
    assert!(few <= 12 && many > few, "{few} iterations, {many} without contacts predicted");
}

/// Pushes the tip of a rod along the wall of a tube with friction, and releases it; returns the iterations of both,
/// and how far the tip went and came back, mm.
fn rubbed(surface: &ContactSurface, predicting: bool) -> ([usize; 2], [f64; 2]) {
    let mut rod = rod(surface, 20, &[1.0, 0.75, 0.5, 0.25], 1e4);
    rod.friction = Friction::new(0.3);
    let (mut state, elements) = (rod.at(Vec3::z() * 10.0), rod.elements.clone());
    let hand = HandMotion { from_mm: 20.0, to_mm: 20.0, turn_rad: 0.0, steer: 0.0 };
    rod.friction.begin(&elements, &state, &rod.points, (&[], &[]), &[hand]);
    let mut supports = Supports { start_tangent: true, ..Supports::default() };
    let mut newton = Newton::<PLAIN>::new(20);
    let options = NewtonOptions::default();
    let down = Vec3::x() * 0.2;
    let mut pushed = Pushed { wall: rod.contact(), force_n: down, predicting };
    let mut solve = |pushed: &mut Pushed<'_>, force_n: Vec3| {
        pushed.force_n = force_n;
        let report = newton.solve(&elements, &mut supports, pushed, &mut state, &options);
        assert!(report.converged && report.stable, "{}", report.reason);
        (report.iterations, state.positions[20].y)
    };
    solve(&mut pushed, down);
    // With held normal forces, iterations are those for slip alone.
    pushed.wall.hold_friction();
    let (there, went_mm) = solve(&mut pushed, down + Vec3::y() * 0.3);
    let (back, left_mm) = solve(&mut pushed, down);
    ([there, back], [went_mm, left_mm])
}

#[test]
fn a_rod_with_friction_slips_and_sticks_in_few_steps() {
    let surface = straight();
    let ((few, with), (many, without)) = (rubbed(&surface, true), rubbed(&surface, false));
    // Equal to the accuracy of the held normal forces.
    let apart = |k: usize| (with[k] - without[k]).abs() < 0.01;
    assert!(apart(0) && apart(1), "{with:?} {without:?}");
    // It returns to within the sticking distance, because friction is weaker than the bent rod.
    assert!(with[0] > 0.8 && with[1].abs() < 0.01, "{with:?}");
    assert!(few[0] + few[1] <= 30 && many[0] + many[1] > 2 * (few[0] + few[1]), "{few:?} {many:?}");
}

#[test]
fn a_search_ends_where_a_convex_function_falls_no_more() {
    // (x − 3)² / 2 and springs that press from 0.2 and 0.5 on.
    let slope = |x: f64| x - 3.0 + 4.0 * (x - 0.2f64).max(0.0) + 40.0 * (x - 0.5f64).max(0.0);
    let part = falls_until(&NewtonTuning::DEFAULT, slope);
    assert!(slope(part).abs() < 1e-2 && (part - 23.8 / 45.0).abs() < 1e-3, "{part}");
    // Without springs it decreases all the way; if it increases from the start there is nothing to search.
    assert_eq!(falls_until(&NewtonTuning::DEFAULT, |x| x - 3.0), 1.0);
    assert_eq!(falls_until(&NewtonTuning::DEFAULT, |x| x + 3.0), 1.0);
}

#[test]
fn a_point_is_active_by_its_depth_and_by_its_force() {
    let surface = straight();
    let mut rod = rod(&surface, 1, &[1.0], 1e4);
    let elements = rod.elements.clone();
    // A tip a micrometre off the wall; the tube has a radius of 2 mm.
    let off = rod.at(Vec3::new(2.0 - RADIUS_MM - 1e-3, 0.0, 20.0));
    let mut contact = rod.contact();
    let mut at = |force_n: f64| {
        contact.cache.points[0].force_n = force_n;
        contact.linearise(&elements, &off, &mut Assembly::<PLAIN>::new(1));
        let active = contact.cache.set.at_base().count();
        (active, contact.settled(1e-9), contact.cache.points[0].force_n)
    };
    // ρ is 1 N/mm: a force of 0.1 N is active up to a gap of 0.1 mm.
    assert_eq!(at(0.0), (0, true, 0.0));
    assert_eq!(at(0.5e-3).0, 0);
    // A point that pulls at an equilibrium is released.
    assert_eq!(at(2e-3), (1, false, 0.0));
    let sunk = rod.at(Vec3::new(2.0 - RADIUS_MM + 1e-3, 0.0, 20.0));
    let mut contact = rod.contact();
    contact.linearise(&elements, &sunk, &mut Assembly::<PLAIN>::new(1));
    assert!(contact.cache.set.at_base().count() == 1 && contact.settled(1e-9));
}

/// A motion of the whole rod along x, mm.
struct Sideways(f64);

impl Moved for Sideways {
    fn point(&self, _: (usize, f64, usize)) -> (Vec3, f64) {
        (Vec3::x() * self.0, 0.0)
    }

    fn element(&self, _: usize) -> [Vec3; 4] {
        let way = Vec3::x() * self.0;
        [way, Vec3::zeros(), way, Vec3::zeros()]
    }
}

#[test]
fn forces_go_where_the_step_leads_as_far_as_it_is_taken() {
    let surface = straight();
    let mut rod = rod(&surface, 1, &[1.0], 1e4);
    let (sunk_mm, elements) = (1e-3, rod.elements.clone());
    let base = rod.at(Vec3::new(2.0 - RADIUS_MM + sunk_mm, 0.0, 20.0));
    let mut contact = rod.contact();
    let mut after = |way_mm: f64, part: f64| {
        contact.cache.points[0].force_n = 0.0;
        let mut assembly = Assembly::<PLAIN>::new(1);
        contact.linearise(&elements, &base, &mut assembly);
        let on = Sideways(way_mm);
        contact.predict(&elements, &base, &on);
        let changed = contact.update_active_set(&elements, &base, &on, &mut assembly);
        contact.merit(&on);
        contact.accept_forces(part);
        (changed, contact.cache.points[0].force_n)
    };
    let spring = 1e4;
    let (none, whole_n) = after(2.0 * sunk_mm, 1.0);
    assert!(none == 0 && (whole_n / (3.0 * sunk_mm * spring) - 1.0).abs() < 0.05, "{whole_n}");
    assert!((after(2.0 * sunk_mm, 0.5).1 / whole_n - 0.5).abs() < 1e-9);
    // A force that would pull is released.
    assert_eq!(after(-5.0 * sunk_mm, 1.0), (1, 0.0));
}

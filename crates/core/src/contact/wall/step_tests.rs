//! Steps of Newton's method on a wall: what they do to contacts and to friction.

use super::foresight::falls_until;
use super::tests::{RADIUS_MM, rod, straight};
use super::*;
use crate::contact::{ContactSurface, HandMotion};
use crate::rod::{Assembly, PLAIN, Supports};
use crate::solve::{Newton, NewtonOptions, NewtonReport};

/// A wall and a force on the tip; where it is not `foreseeing`, Newton's method is told nothing of contacts within a step.
struct Pushed<'a> {
    wall: WallContact<'a>,
    force_n: Vec3,
    foreseeing: bool,
    /// How far trials have strayed, and what corrections have left of it.
    strays: Vec<f64>,
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
    fn foresee(&mut self, moved: &Moved<'_>) -> bool {
        self.foreseeing && self.wall.foresee(moved)
    }
    fn meet(
        &mut self,
        elements: &[ElementData],
        states: (&RodState, &RodState),
        part: f64,
        moved: &Moved<'_>,
    ) -> bool {
        self.foreseeing && self.wall.meet(elements, states, part, moved)
    }
    fn press_or_let_go(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &Moved<'_>,
        into: &mut dyn Stencils,
    ) -> usize {
        self.wall.press_or_let_go(elements, base, moved, into)
    }
    fn part_towards(&mut self, moved: &Moved<'_>, most: f64) -> f64 {
        self.wall.part_towards(moved, most)
    }
    fn hold_on(&mut self, elements: &[ElementData], base: &RodState, into: &mut dyn Stencils) -> usize {
        self.wall.hold_on(elements, base, into)
    }
    fn stray(
        &mut self,
        elements: &[ElementData],
        states: (&RodState, &RodState),
        part: f64,
        into: &mut dyn Stencils,
    ) -> f64 {
        let stray = self.wall.stray(elements, states, part, into);
        self.strays.push(stray);
        stray
    }
    fn is_steep(&self) -> bool {
        true
    }
    fn rounding(&self) -> f64 {
        self.wall.rounding()
    }
    fn scale(&self) -> [f64; 2] {
        self.wall.scale()
    }
}

/// Presses the tip of a rod of 20 mm on the wall of a tube, hard as a rigid one, and lets the force turn about it.
fn turned(surface: &ContactSurface, foreseeing: bool) -> (NewtonReport, RodState, Vec<f64>) {
    let mut rod = rod(surface, 20, &[1.0, 0.75, 0.5, 0.25], 1e4);
    let (mut state, elements) = (rod.at(Vec3::z() * 10.0), rod.elements.clone());
    let mut supports = Supports { start_tangent: true, ..Supports::default() };
    let mut newton = Newton::<PLAIN>::new(20);
    let options = NewtonOptions::default();
    let force_n = Vec3::x() * 0.2;
    let mut pushed = Pushed { wall: rod.contact(), force_n, foreseeing, strays: Vec::new() };
    let report = newton.solve(&elements, &mut supports, &mut pushed, &mut state, &options);
    assert!(report.converged, "{}", report.reason);
    pushed.force_n = Vec3::new(0.5, 0.866, 0.0) * 0.2;
    pushed.strays.clear();
    let report = newton.solve(&elements, &mut supports, &mut pushed, &mut state, &options);
    (report, state, pushed.strays)
}

#[test]
fn a_rod_slides_around_a_hard_wall_in_few_steps() {
    let surface = straight();
    let ((with, end, strays), (without, same, none)) = (turned(&surface, true), turned(&surface, false));
    assert!(with.converged && with.stable && without.converged, "{} {}", with.reason, without.reason);
    assert!(end.positions[20].y > 0.8 && (end.positions[20] - same.positions[20]).norm() < 1e-6);
    let (few, many) = (with.iterations, without.iterations);
    assert!(few <= 15 && many > 2 * few, "{few} iterations, {many} without contacts foreseen");
    // A trial that is off by a hundred times what was foreseen to press is brought back within two corrections.
    assert!(none.is_empty() && strays.windows(3).any(|s| s[0] > 100.0 && s[2] < 0.1), "{strays:?}");
}

/// Pushes the tip of a rod along the wall of a tube on which it rubs, and lets the push go; tells the iterations of both, and how far the tip
/// went and came back, mm.
fn rubbed(surface: &ContactSurface, foreseeing: bool) -> ([usize; 2], [f64; 2]) {
    let mut rod = rod(surface, 20, &[1.0, 0.75, 0.5, 0.25], 1e4);
    rod.friction = Friction::new(0.3);
    let (mut state, elements) = (rod.at(Vec3::z() * 10.0), rod.elements.clone());
    let hand = HandMotion { from_mm: 20.0, to_mm: 20.0, turn_rad: 0.0 };
    rod.friction.begin(&elements, &state, &rod.points, (&[], &[]), &[hand]);
    let mut supports = Supports { start_tangent: true, ..Supports::default() };
    let mut newton = Newton::<PLAIN>::new(20);
    let options = NewtonOptions::default();
    let down = Vec3::x() * 0.2;
    let mut pushed = Pushed { wall: rod.contact(), force_n: down, foreseeing, strays: Vec::new() };
    let mut solve = |force_n: Vec3| {
        pushed.force_n = force_n;
        let report = newton.solve(&elements, &mut supports, &mut pushed, &mut state, &options);
        assert!(report.converged && report.stable, "{}", report.reason);
        (report.iterations, state.positions[20].y)
    };
    solve(down);
    let (there, went_mm) = solve(down + Vec3::y() * 0.3);
    let (back, left_mm) = solve(down);
    ([there, back], [went_mm, left_mm])
}

#[test]
fn a_rod_that_rubs_slips_and_sticks_in_few_steps() {
    let surface = straight();
    let ((few, with), (many, without)) = (rubbed(&surface, true), rubbed(&surface, false));
    assert!(
        (with[0] - without[0]).abs() < 1e-6 && (with[1] - without[1]).abs() < 1e-6,
        "{with:?} {without:?}"
    );
    // It comes back to within what it sticks by, as it is held by less than it is bent.
    assert!(with[0] > 0.8 && with[1].abs() < 0.01, "{with:?}");
    assert!(few[0] + few[1] <= 30 && many[0] + many[1] > 2 * (few[0] + few[1]), "{few:?} {many:?}");
}

#[test]
fn a_search_ends_where_a_convex_function_falls_no_more() {
    // (x − 3)² / 2 and springs that press from 0.2 and 0.5 on.
    let slope = |x: f64| x - 3.0 + 4.0 * (x - 0.2f64).max(0.0) + 40.0 * (x - 0.5f64).max(0.0);
    let part = falls_until(slope);
    assert!(slope(part).abs() < 1e-2 && (part - 23.8 / 45.0).abs() < 1e-3, "{part}");
    // Without them it falls all the way, and where it rises from the beginning there is nothing to search.
    assert_eq!(falls_until(|x| x - 3.0), 1.0);
    assert_eq!(falls_until(|x| x + 3.0), 1.0);
}

#[test]
fn a_contact_that_is_met_again_is_at_the_base_as_it_was() {
    let surface = straight();
    let mut rod = rod(&surface, 1, &[1.0], 1e4);
    // A tip that presses where the step begins; the tube has a radius of 2 mm.
    let sunk_mm = 1e-3;
    let (base, elements) = (rod.at(Vec3::new(2.0 - RADIUS_MM + sunk_mm, 0.0, 20.0)), rod.elements.clone());
    let trial = rod.at(Vec3::new(2.0 - RADIUS_MM + 4.0 * sunk_mm, 0.0, 20.0));
    let mut contact = rod.contact();
    let mut assembly = Assembly::<PLAIN>::new(1);
    contact.linearise(&elements, &base, &mut assembly);
    // What the step seems to do at first, and what a trial of it has done, mm.
    let (off, on) = (Vec3::x() * -5.0 * sunk_mm, Vec3::x() * sunk_mm);
    assert!(contact.foresee(&|_| (off, 0.0)));
    assert_eq!(contact.press_or_let_go(&elements, &base, &|_| (off, 0.0), &mut assembly), 1);
    assert!(contact.meet(&elements, (&base, &trial), 1.0, &|_| (on, 0.0)));
    assert_eq!(contact.press_or_let_go(&elements, &base, &|_| (on, 0.0), &mut assembly), 1);
    // Of a step that is hardly begun there is nothing to correct.
    let mut stray = |part: f64, state: &RodState| {
        contact.stray(&elements, (&base, state), part, &mut Assembly::<PLAIN>::new(1))
    };
    assert!(stray(1e-9, &base) < 1e-6, "{}", stray(1e-9, &base));
    assert!(stray(1.0, &trial) > 0.1);
}

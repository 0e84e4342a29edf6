//! The solver alone on cantilevers.

use super::report::StepRecord;
use super::{External, Newton, NewtonOptions, NewtonReport};
use crate::Vec3;
use crate::rod::{ElementData, Frame, PLAIN, PointSum, RodState, Stencils, Supports};

struct Tip(Vec3);
impl External for Tip {
    fn value(&mut self, _: &[ElementData], state: &RodState) -> f64 {
        -self.0.dot(&state.positions[state.elements()])
    }
    fn linearise(&mut self, _: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        let n = state.elements();
        into.add_node(n, &-self.0, &nalgebra::Matrix3::zeros());
        into.add_value(-self.0.dot(&state.positions[n]));
    }
}

/// A spring from the middle of element `e` to a point: an energy between nodes, as a wall is.
struct Spring(usize, Vec3, f64);
impl External for Spring {
    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        0.5 * self.2 * (self.place(elements, state) - self.1).norm_squared()
    }
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        let off = self.place(elements, state) - self.1;
        into.add_value(self.value(elements, state));
        let hessian = nalgebra::Matrix3::identity() * self.2;
        let mut sum = PointSum::default();
        sum.add(0.3, &(off * self.2), Some(&hessian));
        into.add_points(state, &elements[self.0], self.0, &sum);
    }
}
impl Spring {
    fn place(&self, elements: &[ElementData], state: &RodState) -> Vec3 {
        let [a, b, c, d] = crate::rod::quadrature::hermite(0.3);
        let (e, h) = (self.0, elements[self.0].length);
        state.positions[e] * a
            + state.frames[e].t * (b * h)
            + state.positions[e + 1] * c
            + state.frames[e + 1].t * (d * h)
    }
}

/// A report and the steps to it.
struct Solution {
    report: NewtonReport,
    steps: Vec<StepRecord>,
}

impl std::ops::Deref for Solution {
    type Target = NewtonReport;
    fn deref(&self) -> &NewtonReport {
        &self.report
    }
}

fn cantilever(n: usize, outside: &mut dyn External) -> (RodState, Solution) {
    let data = ElementData::plain(1.0 / n as f64, 1.0);
    let elements = vec![data; n];
    let mut state = RodState::straight(&elements, Vec3::zeros(), Frame::new(Vec3::x(), Some(Vec3::y())));
    let mut supports = Supports { start_tangent: true, start_angles: [true; 3], ..Supports::default() };
    let mut newton = Newton::<PLAIN>::new(n);
    let report = newton.solve(&elements, &mut supports, outside, &mut state, &NewtonOptions::default());
    (state, Solution { report, steps: newton.steps })
}

#[test]
fn iterations_do_not_grow_with_the_mesh_or_the_load() {
    for a in [1.0, 10.0, 50.0, 1000.0] {
        for n in [8, 64, 512] {
            let (_, r) = cantilever(n, &mut Tip(Vec3::new(0.0, -a, 0.0)));
            assert!(
                r.converged && r.stable && r.iterations <= 10,
                "a {a}, n {n}: {} {}",
                r.iterations,
                r.reason
            );
        }
    }
}

#[test]
fn the_energy_falls_at_every_step() {
    for force in [Vec3::new(0.0, -10.0, 0.0), Vec3::new(-30.0, 0.0, 0.0), Vec3::new(-5.0, 1.0, 3.0)] {
        let (_, r) = cantilever(64, &mut Tip(force));
        assert!(r.steps.len() > 3);
        for s in &r.steps {
            assert!(s.energy_change <= 1e-13 * s.energy_scale, "{s:?}");
        }
    }
}

#[test]
fn a_column_stays_straight_below_its_euler_load_and_leaves_above() {
    let (s, r) = cantilever(16, &mut Tip(Vec3::new(-2.4, 0.0, 0.0)));
    assert!(r.stable && (s.positions[16].x - 1.0).abs() < 1e-12);
    let (s, r) = cantilever(16, &mut Tip(Vec3::new(-2.5, 0.0, 0.0)));
    assert!(r.stable && s.positions[16].x < 0.98);
}

#[test]
fn energies_between_nodes_converge_quadratically() {
    let (_, r) = cantilever(16, &mut Spring(11, Vec3::new(0.6, 0.2, 0.1), 500.0));
    assert!(r.converged && r.stable && r.iterations <= 12, "{} {}", r.iterations, r.reason);
    let last = &r.steps[r.steps.len() - 2..];
    assert!(last[1].residual < 1e2 * last[0].residual * last[0].residual + 1e-10, "{last:?}");
}

#[test]
fn a_force_that_is_not_a_number_is_named() {
    let (_, r) = cantilever(8, &mut Tip(Vec3::new(f64::NAN, 0.0, 0.0)));
    assert_eq!(r.reason, super::StopReason::NotFinite);
    assert!(!r.converged);
}

#[test]
fn an_element_that_would_fold_is_reported_and_shorter_ones_bend() {
    let back = || Tip(Vec3::new(-40.0, 1.0, 0.0));
    let is_folded = |state: &RodState| state.is_folded(&vec![ElementData::plain(1.0, 1.0); state.elements()]);
    let (state, r) = cantilever(1, &mut back());
    assert_eq!(r.reason, super::StopReason::Folded);
    assert!(!r.converged && is_folded(&state));
    let (state, r) = cantilever(32, &mut back());
    assert!(r.converged && r.stable && !is_folded(&state), "{}", r.reason);
    // The rod has turned round between its clamped end and its tip.
    assert!(state.frames[0].t.dot(&state.frames[32].t) < -0.9);
}

/// A force at a node, and springs that hold some nodes at their initial positions.
pub(crate) struct Held {
    pub(crate) force: (usize, Vec3),
    pub(crate) springs: Vec<(usize, Vec3)>,
    pub(crate) stiffness: f64,
}
impl Held {
    /// Total force of the springs.
    pub(crate) fn pulls(&self, state: &RodState) -> Vec3 {
        self.springs.iter().map(|(i, was)| (state.positions[*i] - was) * self.stiffness).sum()
    }
}
impl External for Held {
    fn value(&mut self, _: &[ElementData], state: &RodState) -> f64 {
        let off = self.springs.iter().map(|(i, was)| (state.positions[*i] - was).norm_squared());
        0.5 * self.stiffness * off.sum::<f64>() - self.force.1.dot(&state.positions[self.force.0])
    }
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        into.add_value(self.value(elements, state));
        into.add_node(self.force.0, &-self.force.1, &nalgebra::Matrix3::zeros());
        let stiffness = nalgebra::Matrix3::from_diagonal_element(self.stiffness);
        for (i, was) in &self.springs {
            into.add_node(*i, &((state.positions[*i] - was) * self.stiffness), &stiffness);
        }
    }
}

#[test]
fn rods_behind_a_gap_are_solved_for_together_and_do_not_feel_each_other() {
    const N: usize = 8;
    let elements = vec![ElementData::plain(1.0 / N as f64, 1.0); N];
    let frame = |along: Vec3| Frame::new(along, None);
    let clamped = RodState::straight(&elements, Vec3::zeros(), frame(Vec3::x()));
    let free = RodState::straight(&elements, Vec3::new(1.0, 0.2, 0.0), frame(-Vec3::x()));
    let bent = (N, Vec3::new(0.0, -2.0, 0.5));
    // Only a weight at one end and springs act on it: its mean displacement is their ratio, and it turns and bends.
    let sinks = (0, Vec3::new(0.1, 0.3, -0.2));
    let springs = |first: usize| (0..=N).map(|i| (first + i, free.positions[i])).collect::<Vec<_>>();
    let solve =
        |elements: &[ElementData], mut state: RodState, outside: &mut dyn External, start_free: bool| {
            let mut supports =
                Supports { start_free, start_tangent: true, start_angles: [true; 3], ..Supports::default() };
            let mut newton = Newton::<PLAIN>::new(elements.len());
            let options = NewtonOptions { tolerance: 1e-11, ..NewtonOptions::default() };
            let report = newton.solve(elements, &mut supports, outside, &mut state, &options);
            assert!(report.converged && report.stable, "{}", report.reason);
            state
        };
    let one = solve(
        &elements,
        clamped.clone(),
        &mut Held { force: bent, springs: Vec::new(), stiffness: 1.0 },
        false,
    );
    let other =
        solve(&elements, free.clone(), &mut Held { force: sinks, springs: springs(0), stiffness: 1.0 }, true);
    let mean = other.positions.iter().zip(&free.positions).map(|(x, was)| x - was).sum::<Vec3>();
    assert!((mean - sinks.1).norm() < 1e-9, "{mean}");
    let mut both = clamped;
    both.join(&free);
    let all = [&elements[..], &[ElementData::BREAK], &elements[..]].concat();
    let first = N + 1;
    let (mut on_one, mut on_other) = (
        Held { force: bent, springs: Vec::new(), stiffness: 1.0 },
        Held { force: (first + sinks.0, sinks.1), springs: springs(first), stiffness: 1.0 },
    );
    let mut outside = super::Together([Some(&mut on_one), Some(&mut on_other)]);
    let both = solve(&all, both, &mut outside, false);
    for (nodes, alone) in [(0..first, one), (first..2 * first, other)] {
        assert!(both.part(nodes).farthest_mm(&alone) < 1e-9);
    }
}

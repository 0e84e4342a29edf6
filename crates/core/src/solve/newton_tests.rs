//! First light: cantilevers through the bare solver.

use super::{External, Newton, NewtonOptions, NewtonReport};
use crate::Vec3;
use crate::rod::{Assembly, ElementData, Frame, PLAIN, RodState, Supports};

struct Tip(Vec3);
impl<const C: usize> External<C> for Tip {
    fn energy(&mut self, _: &[ElementData], state: &RodState) -> f64 {
        -self.0.dot(&state.positions[state.elements()])
    }
    fn add(&mut self, _: &[ElementData], state: &RodState, assembly: &mut Assembly<C>) {
        let n = state.elements();
        assembly.add_node(n, &-self.0, &nalgebra::Matrix3::zeros());
        assembly.external_energy -= self.0.dot(&state.positions[n]);
    }
}

fn cantilever(n: usize, force: Vec3, options: &NewtonOptions) -> (RodState, NewtonReport) {
    let h = 1.0 / n as f64;
    let data = ElementData {
        length: h,
        bending: [1.0; 3],
        torsion: [0.0; 3],
        rest_curvature: [[0.0; 2]; 3],
        rest_twist: [0.0; 3],
        flexibility: 0.0,
    };
    let elements = vec![data; n];
    let mut state = RodState::straight(&elements, Vec3::zeros(), Frame::new(Vec3::x(), Some(Vec3::y())));
    let mut supports = Supports { start_tangent: true, start_angle: true, ..Supports::default() };
    let mut newton = Newton::<PLAIN>::new(n);
    let report = newton.solve(&elements, &mut supports, &mut Tip(force), &mut state, options);
    (state, report)
}

#[test]
fn first_light() {
    for turn in [0.7, 1.0, 1.5] {
        for (a, w, u) in [
            (1.0, 0.301720773800, 0.0564332362834),
            (10.0, 0.810609024880, 0.554995597754),
            (50.0, 0.917155447304, 0.800000396050),
        ] {
            for n in [16, 32, 64] {
                let options = NewtonOptions { max_turn: turn, ..NewtonOptions::default() };
                let (s, r) = cantilever(n, Vec3::new(0.0, -a, 0.0), &options);
                let tip = s.positions[n];
                let e = (tip - Vec3::new(1.0 - u, -w, 0.0)).norm();
                println!("turn {turn} a {a} n {n}: err {e:.2e} it {} res {:.1e} {} {:?} {:?}", r.iterations, r.residual, r.stable, r.reason,
                  r.steps.iter().map(|s| s.fraction).filter(|f| *f<1.0).map(|f| (f*100.0).round()/100.0).collect::<Vec<_>>());
            }
        }
    }
}

#[test]
fn columns() {
    for p in [2.0, 2.5, 2.84175425875, 4.65055973791, 30.0, 100.0] {
        for n in [16, 64] {
            let (s, r) = cantilever(n, Vec3::new(-p, 0.0, 0.0), &NewtonOptions::default());
            let tip = s.positions[n];
            println!("P {p} n {n}: {:?} {:?} it {} res {:.1e} {:?} {} {:?}", tip.x, tip.y.hypot(tip.z), r.iterations, r.residual, r.inertia, r.stable, r.reason);
        }
    }
}

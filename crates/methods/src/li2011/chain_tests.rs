//! Properties of the two solves, without a vessel.

use super::chain::{Chain, Spring};
use super::{banded, dense};
use endowire_core::Vec3;

struct Solution {
    positions_mm: Vec<Vec3>,
    tangents: Vec<Vec3>,
}

fn solve_dense(chain: &Chain) -> Solution {
    let (mut positions_mm, mut tangents) = (Vec::new(), Vec::new());
    dense::solve(chain, &mut positions_mm, &mut tangents);
    Solution { positions_mm, tangents }
}

fn solve_banded(chain: &Chain) -> Solution {
    let (mut positions_mm, mut tangents) = (Vec::new(), Vec::new());
    banded::solve(chain, &mut banded::Workspace::default(), &mut positions_mm, &mut tangents);
    Solution { positions_mm, tangents }
}

fn largest_difference(a: &[Vec3], b: &[Vec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// A chain of unequal elements and stiffness, loaded at every node and held at every third.
fn irregular_chain(elements: usize) -> Chain {
    let mut chain =
        Chain::uniform(Vec3::new(3.0, -2.0, 1.0), Vec3::new(0.6, 0.8, 0.0), 100.0, elements, 20.0);
    for i in 0..elements {
        let wave = (i as f64 * 0.7).sin();
        chain.lengths_mm[i] *= 1.0 + 0.4 * wave;
        chain.bending_stiffness_nmm2[i] *= 1.0 - 0.5 * wave;
        chain.forces_n[i] = Vec3::new(wave, -0.5 * wave, 0.2) * 1e-3;
        if i % 3 == 1 {
            let normal = Vec3::new(wave, 1.0, -wave * wave).normalize();
            chain.springs.push(Spring {
                node: i + 1,
                direction: normal,
                offset_mm: normal.dot(&chain.start_mm) + 0.1 * i as f64,
                stiffness_n_per_mm: 1.0,
            });
        }
    }
    chain
}

/// The same with unit tangents about the directions of a helix, and a second spring at every sixth node.
fn unit_chain(elements: usize) -> Chain {
    let mut chain = irregular_chain(elements);
    chain.directions = (0..elements)
        .map(|i| {
            let angle = 0.9 + 0.15 * i as f64;
            Vec3::new(angle.cos(), angle.sin(), 0.4).normalize()
        })
        .collect();
    for spring in chain.springs.clone().iter().step_by(2) {
        let direction = spring.direction.cross(&chain.directions[spring.node - 1]).normalize();
        chain.springs.push(Spring { direction, stiffness_n_per_mm: 0.02, ..*spring });
    }
    chain.springs.sort_by_key(|spring| spring.node);
    chain
}

/// Largest component of ∂U/∂t that multipliers do not balance.
fn largest_slope(chain: &Chain, tangents: &[Vec3]) -> f64 {
    let (mut x, mut residual) = (Vec::new(), Vec::new());
    chain.integrate(tangents, &mut x);
    chain.residual(tangents, &x, &mut residual);
    for (r, direction) in residual.iter_mut().zip(&chain.directions) {
        *r -= direction * direction.dot(r);
    }
    residual.iter().map(|r| r.amax()).fold(0.0, f64::max)
}

#[test]
fn the_residual_is_minus_the_slope_of_the_energy() {
    let chain = irregular_chain(12);
    let tangents: Vec<Vec3> = (0..12).map(|i| Vec3::new(1.0, (i as f64).sin(), 0.1 * i as f64)).collect();
    let energy = |tangents: &[Vec3]| {
        let mut x = Vec::new();
        chain.integrate(tangents, &mut x);
        let work: f64 = x.iter().zip(&chain.forces_n).map(|(x, f)| x.dot(f)).sum();
        chain.bending_energy_mj(tangents) + chain.spring_energy_mj(&x) - work
    };
    let (mut x, mut residual) = (Vec::new(), Vec::new());
    chain.integrate(&tangents, &mut x);
    chain.residual(&tangents, &x, &mut residual);
    for i in 0..12 {
        for k in 0..3 {
            // Central differences of a quadratic are exact up to rounding.
            let (mut plus, mut minus) = (tangents.clone(), tangents.clone());
            plus[i][k] += 0.5;
            minus[i][k] -= 0.5;
            let slope = energy(&plus) - energy(&minus);
            assert!((slope + residual[i][k]).abs() < 1e-9 * (1.0 + slope.abs()), "t{i}[{k}]");
        }
    }
}

#[test]
fn without_load_or_contact_the_chain_stays_straight() {
    let chain = Chain::uniform(Vec3::new(1.0, 2.0, 3.0), Vec3::z(), 50.0, 10, 5.0);
    for solution in [solve_dense(&chain), solve_banded(&chain)] {
        let miss = (solution.positions_mm[9] - Vec3::new(1.0, 2.0, 53.0)).norm();
        assert!(miss < 1e-10, "{miss:e}");
        assert!((solution.tangents[9] - Vec3::z()).norm() < 1e-11);
    }
}

#[test]
fn both_solves_make_the_energy_stationary() {
    for chain in [irregular_chain(30), unit_chain(30)] {
        for mut solution in [solve_dense(&chain), solve_banded(&chain)] {
            assert!(largest_slope(&chain, &solution.tangents) < 1e-9);
            solution.tangents[7].x += 1e-8;
            assert!(largest_slope(&chain, &solution.tangents) > 1e-8, "the check must be able to fail");
        }
    }
}

#[test]
fn tangents_are_of_unit_length_about_their_directions() {
    let off = |chain: &Chain, tangents: &[Vec3]| {
        let rows = tangents.iter().zip(&chain.directions).map(|(t, d)| (t.dot(d) - 1.0).abs());
        rows.fold(0.0, f64::max)
    };
    let chain = unit_chain(40);
    for mut solution in [solve_dense(&chain), solve_banded(&chain)] {
        assert!(off(&chain, &solution.tangents) < 1e-12);
        chain.normalise(&mut solution.tangents, &mut solution.positions_mm);
        assert!(solution.tangents.iter().all(|t| (t.norm() - 1.0).abs() < 1e-15));
    }
    // Counter-check: free tangents have any length.
    let free = Chain { directions: Vec::new(), ..unit_chain(40) };
    assert!(off(&chain, &solve_banded(&free).tangents) > 0.1);
}

#[test]
fn positions_are_the_integral_of_the_tangents() {
    let chain = irregular_chain(40);
    for solution in [solve_dense(&chain), solve_banded(&chain)] {
        let mut x = Vec::new();
        chain.integrate(&solution.tangents, &mut x);
        assert!(largest_difference(&x, &solution.positions_mm) < 1e-10);
    }
}

#[test]
fn dense_and_banded_agree_far_below_a_nanometre() {
    for (elements, make) in [1, 2, 3, 17, 100]
        .into_iter()
        .flat_map(|n| [(n, irregular_chain as fn(usize) -> Chain), (n, unit_chain)])
    {
        let mut chain = make(elements);
        let dense = solve_dense(&chain);
        let difference = largest_difference(&dense.positions_mm, &solve_banded(&chain).positions_mm);
        assert!(difference < 1e-9, "{elements} elements: {difference:e} mm");
        chain.bending_stiffness_nmm2[0] *= 1.0 + 1e-6;
        let difference = largest_difference(&dense.positions_mm, &solve_banded(&chain).positions_mm);
        assert!(difference > 1e-9, "the comparison must be able to fail");
    }
}

#[test]
fn non_finite_input_gives_non_finite_output_and_no_panic() {
    let mut chain = irregular_chain(8);
    chain.forces_n[3].x = f64::NAN;
    assert!(solve_banded(&chain).positions_mm.iter().any(|x| !x.x.is_finite()));
    assert!(solve_dense(&chain).positions_mm.iter().any(|x| !x.x.is_finite()));
    chain.forces_n[3].x = 0.0;
    chain.bending_stiffness_nmm2[2] = f64::NAN;
    assert!(solve_banded(&chain).positions_mm.iter().any(|x| !x.x.is_finite()));
}

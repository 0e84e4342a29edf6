//! Beams on supports with exact answers, and the derivatives of the field.

use std::sync::Arc;

use super::*;
use crate::vessel::{CentrelineNode, Displacement};

/// A straight vessel along z, from 0 to a length, with rows every 10 mm.
fn straight(length_mm: f64, radius_mm: f64) -> CentrelineTree {
    let rows = (length_mm / 10.0) as usize;
    let node = |row: usize| CentrelineNode {
        position_mm: Vec3::new(0.0, 0.0, 10.0 * row as f64),
        radius_mm,
        parent: row.checked_sub(1),
    };
    CentrelineTree::new((0..=rows).map(node).collect()).unwrap()
}

fn made_of(bending: f64, support: f64, span_mm: f64) -> YieldingSpec {
    YieldingSpec {
        bending_stiffness_nmm2: Some(bending),
        support_n_per_mm2: Some(support),
        span_mm: Some(span_mm),
        ..YieldingSpec::default()
    }
}

/// Unknowns under a force on the material point on the axis at this height.
fn under(course: &Course, z_mm: f64, force: Vec3) -> Vec<Vec3> {
    let shares = course.weights(&Vec3::new(0.0, 0.0, z_mm), &force);
    let forces: Vec<(usize, Vec3)> =
        shares.iter().map(|(unknown, share)| (*unknown, share[0].tr_mul(&force))).collect();
    course.yields_mm(&forces)
}

/// E5: the infinite beam, w₀ = P β/(2 k).
#[test]
fn a_long_vessel_yields_to_one_force_as_a_beam_on_a_support() {
    let (bending, support, force) = (400.0, 0.05, Vec3::x() * 0.3);
    let beta = f64::sqrt(support / (4.0 * bending)).sqrt();
    let exact = force.x * beta / (2.0 * support);
    let off = |span_mm: f64| {
        let course =
            Arc::new(Course::new(&straight(240.0, 2.0), &made_of(bending, support, span_mm)).unwrap());
        let amplitudes = under(&course, 120.0, force);
        let bent = Bent::new(&course, &amplitudes);
        // Stored energy is half the work of the force.
        let w = bent.displacement_mm(&Vec3::new(0.0, 0.0, 120.0)).x;
        assert!((course.energy_mj(&amplitudes) - 0.5 * force.x * w).abs() < 1e-12);
        // Far away, and between: e^(−βs) (cos βs + sin βs).
        let s = 30.0;
        let there = bent.displacement_mm(&Vec3::new(1.5, 0.0, 150.0)).x;
        let exact_there = exact * (-beta * s).exp() * ((beta * s).cos() + (beta * s).sin());
        assert!((there - exact_there).abs() < 0.02 * exact);
        (w - exact).abs() / exact
    };
    assert!(off(0.5) < 1e-6, "{}", off(0.5));
    // The default is three quarters of (4 B/k)^¼.
    assert!(off(0.75 / beta) < 1e-2, "{}", off(0.75 / beta));
    assert!(off(0.75 / beta) > 10.0 * off(0.5));
}

#[test]
fn ends_are_held_or_free_and_tethers_hold() {
    let free = YieldingSpec { ends: Some(YieldingEnds::Free), ..made_of(400.0, 0.05, 5.0) };
    let at_end = |spec: &YieldingSpec| {
        let course = Arc::new(Course::new(&straight(300.0, 2.0), spec).unwrap());
        let bent = Bent::new(&course, &under(&course, 290.0, Vec3::x()));
        bent.displacement_mm(&Vec3::new(0.0, 0.0, 300.0)).x
    };
    assert!(at_end(&made_of(400.0, 0.05, 5.0)).abs() < 1e-12);
    let loose = at_end(&free);
    assert!(loose > 0.5, "{loose}");
    let tether = YieldingTether { at: None, at_mm: Some([0.0, 0.0, 300.0]), stiffness_n_per_mm: 1e5 };
    let tied = at_end(&YieldingSpec { tether: vec![tether], ..free });
    assert!(tied.abs() < 1e-4 * loose, "{tied}");
}

/// A trunk along z with a branch along x that starts on its axis.
fn forked() -> CentrelineTree {
    let node = |x: f64, z: f64, radius_mm: f64, parent: Option<usize>| CentrelineNode {
        position_mm: Vec3::new(x, 0.0, z),
        radius_mm,
        parent,
    };
    let mut nodes = vec![node(0.0, 0.0, 3.0, None)];
    nodes.extend((1..=20).map(|k| node(0.0, 5.0 * f64::from(k), 3.0, Some(k as usize - 1))));
    nodes.extend((1..=10).map(|k| {
        let x = 4.0 * f64::from(k);
        node(x, 50.0 + 0.02 * x * x, 1.5, Some(if k == 1 { 10 } else { 19 + k as usize }))
    }));
    CentrelineTree::new(nodes).unwrap()
}

#[test]
fn branches_share_the_place_where_they_part() {
    let course = Arc::new(Course::new(&forked(), &made_of(300.0, 0.05, 8.0)).unwrap());
    let pushed = under(&course, 50.0, Vec3::y() * 0.2);
    let bent = Bent::new(&course, &pushed);
    let trunk = bent.displacement_mm(&Vec3::new(0.0, 0.0, 50.0)).y;
    let at_wall = bent.displacement_mm(&Vec3::new(3.0, 0.0, 50.0)).y;
    let in_branch = bent.displacement_mm(&Vec3::new(12.0, 0.0, 52.9)).y;
    assert!(trunk > 0.1 && (at_wall / trunk - 1.0).abs() < 0.2, "{trunk} {at_wall}");
    assert!((0.1..0.95).contains(&(in_branch / trunk)), "{in_branch} of {trunk}");
}

#[test]
fn the_field_has_its_own_derivatives_and_an_inverse() {
    let course = Arc::new(Course::new(&forked(), &made_of(300.0, 0.05, 8.0)).unwrap());
    let amplitudes: Vec<Vec3> = (0..course.unknowns())
        .map(|k| {
            let k = k as f64;
            Vec3::new((0.9 * k).sin(), (1.7 * k).cos(), (0.3 * k).sin()) * 0.7
        })
        .collect();
    let field = Displacement::with_course(None, Bent::new(&course, &amplitudes));
    let h = 1e-5;
    let mut steepest: f64 = 0.0;
    for k in 0..40 {
        let k = f64::from(k);
        // Around the fork and along both.
        // Not where the branch begins: there the curvature of a run that is no equilibrium jumps.
        let x = Vec3::new(4.0 * (0.5 * k + 0.1).sin(), 1.2 * (0.8 * k).cos(), 50.0 + 8.0 * (0.31 * k).sin());
        let (f, local) = (field.gradient(&x), field.local(&x));
        assert!((local.inverse * f - Matrix3::identity()).norm() < 1e-12);
        steepest = steepest.max((f - Matrix3::identity()).norm());
        for axis in 0..3 {
            let (more, less) = (x + Vec3::ith(axis, h), x - Vec3::ith(axis, h));
            let slope = (field.place(&more) - field.place(&less)) / (2.0 * h);
            assert!((slope - f.column(axis)).norm() < 1e-7, "{slope} {f}");
            let bend = (field.gradient(&more) - field.gradient(&less)) / (2.0 * h);
            for of in 0..3 {
                let own = local.second[of].column(axis);
                assert!((bend.row(of).transpose() - own).norm() < 1e-5, "{k} {bend} {own}");
            }
        }
        let back = field.material(&field.place(&x));
        assert!((back - x).norm() < 1e-11, "{back} {x}");
        // u is what the weights say.
        let g = Vec3::new(0.4, -1.1, 0.7);
        let sum = |at: &Vec3| -> Vec3 {
            course.weights(at, &g).iter().map(|(unknown, [weight, _])| weight * amplitudes[*unknown]).sum()
        };
        assert!((field.place(&x) - x - sum(&x)).norm() < 1e-12);
        // And how these change with the place.
        let by_place: Vec3 = course
            .weights(&x, &g)
            .iter()
            .map(|(unknown, [_, by_place])| by_place * amplitudes[*unknown])
            .sum();
        for axis in 0..3 {
            let [more, less] = [h, -h].map(|h| sum(&(x + Vec3::ith(axis, h))).dot(&g));
            assert!(((more - less) / (2.0 * h) - by_place[axis]).abs() < 1e-6, "{by_place}");
        }
    }
    assert!(steepest > 0.1, "{steepest}");
}

#[test]
fn values_that_contradict_each_other_are_refused_by_name() {
    let tree = straight(100.0, 2.0);
    let fails = |spec: YieldingSpec| Course::new(&tree, &spec).unwrap_err().to_string();
    let good = made_of(400.0, 0.05, 5.0);
    for (spec, expected) in [
        (YieldingSpec::default(), "vessel.yielding.wall_modulus_n_per_mm2 = missing"),
        (
            YieldingSpec { thickness_per_radius: Some(0.1), ..good.clone() },
            "vessel.yielding.bending_stiffness_nmm2",
        ),
        (YieldingSpec { tissue_n_per_mm3: Some(0.1), ..good.clone() }, "vessel.yielding.support_n_per_mm2"),
        (
            YieldingSpec { support_n_per_mm2: Some(0.0), ..good.clone() },
            "vessel.yielding.support_n_per_mm2 = 0",
        ),
        (YieldingSpec { span_mm: Some(f64::NAN), ..good.clone() }, "vessel.yielding.span_mm = NaN"),
        (YieldingSpec { span_mm: Some(0.01), ..good.clone() }, "vessel.yielding.span_mm = 0.01: makes 10005"),
    ] {
        let reported = fails(spec);
        assert!(reported.starts_with(expected), "{reported}");
    }
    let branch = |to: &str| YieldingBranch {
        to: to.into(),
        preset: Some(YieldingPreset::Iliac),
        wall_modulus_n_per_mm2: None,
        thickness_per_radius: None,
        bending_stiffness_nmm2: None,
        tissue_n_per_mm3: None,
        support_n_per_mm2: None,
    };
    let reported = fails(YieldingSpec { branch: vec![branch("left")], ..good });
    assert!(reported.starts_with("vessel.yielding.branch[0].to = \"left\""), "{reported}");
}

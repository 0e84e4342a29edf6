use nalgebra::Matrix3;

use super::*;
use crate::random::{splitmix64, unit};
use crate::vessel::{CentrelineNode, anatomy};

fn field(tree: CentrelineTree) -> SweptField {
    SweptVessel::new(tree, Resolution::EdgeMm(0.3)).unwrap().field(2.0)
}

/// A tube along z whose radius goes from 3 mm to this over 40 mm.
fn cone(end_mm: f64) -> CentrelineTree {
    let node = |k: u32| CentrelineNode {
        position_mm: Vec3::z() * f64::from(4 * k),
        radius_mm: 3.0 + (end_mm - 3.0) * f64::from(k) / 10.0,
        parent: k.checked_sub(1).map(|parent| parent as usize),
    };
    CentrelineTree::new((0..=10).map(node).collect()).unwrap()
}

/// Places in front of the wall by up to `depth_mm` and behind it by a fifth of that, all over a vessel.
fn places(field: &SweptField, depth_mm: f64, count: u64) -> Vec<Vec3> {
    let knots: usize = field.axes.iter().map(Axis::len).sum();
    let place = |k: u64| {
        let number = |n: u64| unit(splitmix64(11, 4 * k + n));
        let (branch, knot) = field.blocks.knot((number(0) * knots as f64) as u32);
        let place = field.axes[branch].at(field.axes[branch].step() * knot as f64);
        let u = any_perpendicular(&place.first.normalize());
        let v = place.first.normalize().cross(&u);
        let angle = TAU * number(1);
        let away = place.radius[0] - depth_mm * (1.2 * number(2) - 0.2);
        place.position + (u * angle.cos() + v * angle.sin()) * away
    };
    (0..count).map(place).collect()
}

/// Distance, gradient and Hessian of a place.
fn at(field: &SweptField, x: &Vec3) -> (f64, Vec3, Matrix3<f64>) {
    let near = field.near(x);
    let closest = field.closest(x, From::Space(near.piece)).unwrap();
    (closest.distance_mm(), closest.normal(), closest.hessian())
}

/// Largest errors of the gradient and the Hessian against differences, over places; and how many are where branches are joined.
fn errors(field: &SweptField, depth_mm: f64, count: u64) -> ([f64; 2], usize) {
    let (mut worst, mut joints) = ([0.0_f64; 2], 0);
    let h = 1e-4;
    for x in places(field, depth_mm, count) {
        let near = field.near(&x);
        if !(-0.2 * depth_mm..=depth_mm).contains(&at(field, &x).0) {
            continue;
        }
        let (_, normal, hessian) = at(field, &x);
        let is_joint = field.closest(&x, From::Space(near.piece)).unwrap().is_in_joint();
        joints += usize::from(is_joint);
        for k in 0..3 {
            let [plus, minus] = [h, -h].map(|way| at(field, &(x + Vec3::ith(k, way))));
            let slope = (plus.0 - minus.0) / (2.0 * h);
            let bend = (plus.1 - minus.1) / (2.0 * h);
            let [gradient, bent] = [(slope - normal[k]).abs(), (bend - hessian.column(k)).norm()];
            if std::env::var("SHOW").is_ok() && (gradient > 1e-6 || bent > 1e-3) {
                eprintln!(
                    "{x:?} joint {is_joint} d {} gradient {gradient:e} bend {bent:e} of {}",
                    at(field, &x).0,
                    hessian.norm()
                );
            }
            worst = [worst[0].max(gradient), worst[1].max(bent)];
        }
    }
    (worst, joints)
}

#[test]
fn derivatives_are_those_of_the_distance() {
    for (tree, depth_mm) in [
        (cone(3.0), 1.0),
        (cone(1.5), 1.0),
        (anatomy::tree("curved_tube").unwrap(), 1.0),
        (anatomy::tree("aortic_arch").unwrap(), 1.0),
        (anatomy::tree("hepatic").unwrap(), 0.5),
    ] {
        let field = field(tree);
        let (worst, joints) = errors(&field, depth_mm, 4000);
        eprintln!("{worst:?} {joints}");
    }
}

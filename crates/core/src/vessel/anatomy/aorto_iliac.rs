//! The abdominal aorta with winding iliac arteries, with and without an aneurysm.

use std::f64::consts::PI;

use super::super::CentrelineNode;
use super::Course;
use crate::Vec3;

pub(super) const AORTO_ILIAC: &str =
    "aorto_iliac: abdominal aorta with renal, common, external and internal iliac arteries; the inlet is the right external iliac at the groin.
Diameters in mm: aorta below the renal arteries 20, common iliac 12 (K. W. Johnston et al., J. Vasc. Surg. 13, 1991, normal
diameters of men); external iliac 8.5, internal iliac 6.6, renal 5.2: usual in adults, not from one study. The way from the groin to the
aorta's end is 1.36 times as long as the straight line on the right, that of patients with an aneurysm, and 1.16 times on
the left, that of healthy ones (means; see the chapter on vessels that yield). Course of the axis drawn. Axes: +x left, +y posterior,
+z cranial; origin at the inlet.";

pub(super) const AORTO_ILIAC_ANEURYSM: &str = "aorto_iliac_aneurysm: as aorto_iliac, with an aneurysm of 54 mm, the size from which men are treated, between
a neck of 19 mm below the renal arteries and the aorta's end. Course drawn.";

/// Named rows; the same with and without an aneurysm.
pub(super) const TARGETS: [(usize, &str); 9] = [
    (27, "aortic bifurcation"),
    (35, "right renal ostium"),
    (36, "left renal ostium"),
    (38, "aorta"),
    (41, "right renal"),
    (44, "left renal"),
    (47, "right internal iliac"),
    (70, "left external iliac"),
    (73, "left internal iliac"),
];

/// Where the external iliac arteries leave the pelvis, and the aorta divides.
const RIGHT_GROIN: [f64; 3] = [-70.0, -40.0, -150.0];
const LEFT_GROIN: [f64; 3] = [70.0, -40.0, -150.0];
/// Points of an iliac artery on each side.
const RIGHT_PIECES: usize = 28;
const LEFT_PIECES: usize = 24;
/// How far both wind across the straight line, mm, in so many half waves.
const RIGHT_WINDS: [(f64, f64); 2] = [(29.0, 3.0), (21.0, 2.0)];
const LEFT_WINDS: [(f64, f64); 2] = [(25.5, 2.0), (15.0, 2.0)];
/// Radii of aorta and arteries, mm.
const AORTA_MM: f64 = 10.0;
const COMMON_MM: f64 = 6.0;
const EXTERNAL_MM: f64 = 4.25;
const INTERNAL_MM: f64 = 3.3;
const RENAL_MM: f64 = 2.6;
/// Where the internal iliac leaves, as a part of the way from the groin.
const INTERNAL_AT: f64 = 0.5;

/// A point of a winding artery, from the groin to the aorta's end, at this part of the straight way; and its radius.
fn iliac(groin: [f64; 3], winds: [(f64, f64); 2], part: f64) -> (Vec3, f64) {
    let from = Vec3::from(groin);
    let along = -from.normalize();
    let across = along.cross(&Vec3::y()).normalize();
    let beside = along.cross(&across);
    // As it leaves and arrives straight, it winds most in the middle.
    let most = libm::sin(PI * part);
    let [one, other] = winds.map(|(mm, half_waves)| mm * most * libm::sin(half_waves * PI * part));
    // From external to common beside the internal iliac.
    let rise = ((part - INTERNAL_AT) / 0.12).clamp(0.0, 1.0);
    (from * (1.0 - part) + across * one + beside * other, EXTERNAL_MM + (COMMON_MM - EXTERNAL_MM) * rise)
}

/// Radius of the aorta at a height above its end, mm: of a spindle between neck and end if it has an aneurysm.
fn aorta_mm(z_mm: f64, has_aneurysm: bool) -> f64 {
    const NECK_MM: f64 = 9.5;
    const LARGEST_MM: f64 = 27.0;
    // A cosine between 10 and 78 mm.
    let bulge = 0.5 - 0.5 * libm::cos(2.0 * PI * ((z_mm - 10.0) / 68.0).clamp(0.0, 1.0));
    if has_aneurysm { NECK_MM + (LARGEST_MM - NECK_MM) * bulge } else { AORTA_MM }
}

/// The rows of the tree.
pub(super) fn nodes(has_aneurysm: bool) -> Vec<CentrelineNode> {
    let mut nodes = about_bifurcation(has_aneurysm);
    nodes.iter_mut().for_each(|node| node.position_mm -= Vec3::from(RIGHT_GROIN));
    nodes
}

/// The same with the origin where the aorta divides.
fn about_bifurcation(has_aneurysm: bool) -> Vec<CentrelineNode> {
    let right = |k: usize| iliac(RIGHT_GROIN, RIGHT_WINDS, k as f64 / RIGHT_PIECES as f64);
    let left = |k: usize| iliac(LEFT_GROIN, LEFT_WINDS, k as f64 / LEFT_PIECES as f64);
    let (groin, radius_mm) = right(0);
    let mut course = Course::new().root(groin, radius_mm);
    // Where the vessel is wide, at its fork, points are farther apart.
    for k in 1..RIGHT_PIECES - 1 {
        let (place, radius_mm) = right(k);
        course = course.to(place, radius_mm);
    }
    course = course.to(Vec3::zeros(), 8.0);
    // The spine's curve pushes the aorta forward.
    let aorta = |z: f64| Vec3::new(0.0, -6.0 * libm::sin(PI * z / 130.0), z);
    let fork = course.nodes.len() - 1;
    for z in [22.0, 33.0, 44.0, 55.0, 66.0, 77.0, 87.0, 92.0, 97.0, 113.0, 130.0] {
        course = course.to(aorta(z), aorta_mm(z, has_aneurysm));
    }
    let renal = |course: Course, row: usize, side: f64| {
        let from = course.nodes[row].position_mm;
        let steps = [[16.0, 3.0, -3.0], [30.0, 9.0, -7.0], [44.0, 14.0, -8.0]];
        steps
            .into_iter()
            .fold(course.at(row), |course, [x, y, z]| course.to(from + Vec3::new(side * x, y, z), RENAL_MM))
    };
    course = renal(course, 35, -1.0);
    course = renal(course, 36, 1.0);
    let internal = |course: Course, row: usize, side: f64| {
        let from = course.nodes[row].position_mm;
        let steps = [[2.0, 13.0, -9.0], [0.0, 25.0, -24.0], [-6.0, 33.0, -42.0]];
        steps.into_iter().fold(course.at(row), |course, [x, y, z]| {
            course.to(from + Vec3::new(side * x, y, z), INTERNAL_MM)
        })
    };
    course = internal(course, (INTERNAL_AT * RIGHT_PIECES as f64) as usize, -1.0);
    course = course.at(fork);
    for k in (0..LEFT_PIECES - 1).rev() {
        let (place, radius_mm) = left(k);
        course = course.to(place, radius_mm);
    }
    let leaves = course.nodes.len() - 1 - (INTERNAL_AT * LEFT_PIECES as f64) as usize;
    internal(course, leaves, 1.0).nodes
}

#[cfg(test)]
mod tests {
    use super::super::tree;

    #[test]
    fn the_ways_wind_as_much_as_is_said_and_ostia_have_their_names() {
        for name in ["aorto_iliac", "aorto_iliac_aneurysm"] {
            let tree = tree(name).unwrap();
            let at = |name: &str| tree.target(name).unwrap().row;
            let right = tree.path_to(at("aortic bifurcation")).unwrap();
            let tortuosity = right.length_mm() / (right.end_mm() - tree.nodes()[0].position_mm).norm();
            assert!((tortuosity - 1.36).abs() < 0.02, "{tortuosity}");
            let end = at("left external iliac");
            let left = tree.path_to(end).unwrap().length_mm() - right.length_mm();
            let tortuosity = left / (tree.nodes()[end].position_mm - right.end_mm()).norm();
            assert!((tortuosity - 1.16).abs() < 0.02, "{tortuosity}");
            let children = tree.children();
            for (ostium, artery) in
                [("right renal ostium", "right renal"), ("left renal ostium", "left renal")]
            {
                assert_eq!(children[at(ostium)].len(), 2);
                assert!(children[at(artery)].is_empty());
                assert!((tree.nodes()[at(artery)].position_mm - right.end_mm()).x.abs() > 40.0);
            }
            assert!(tree.nodes()[at("left renal")].position_mm.x > right.end_mm().x);
            assert!(children[at("aorta")].is_empty() && children[at("right internal iliac")].is_empty());
            let widest = tree.nodes().iter().map(|node| node.radius_mm).fold(0.0, f64::max);
            assert_eq!(widest > 25.0, name.ends_with("aneurysm"), "{widest}");
        }
    }
}

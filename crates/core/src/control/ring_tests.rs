//! Where vessels meet again, hands reach a target by the arm that they are given.

use super::*;
use crate::Vec3;
use crate::device::{Device, Section};
use crate::insertion::Sheath;
use crate::methods::kirchhoff::KirchhoffOptions;
use crate::vessel::{
    CentrelineEnd, CentrelineLink, CentrelineNode, CentrelinePath, CentrelineTree, ExtractedCentreline,
    GeneratedWall, Resolution,
};

/// A dissected vessel: the true lumen straight along z, the false one beside it from an entry at 20 mm to a re-entry at
/// 100 mm.
fn dissected() -> CentrelineTree {
    let node = |x: f64, z: f64, radius_mm: f64, parent| CentrelineNode {
        position_mm: Vec3::new(x, 0.0, z),
        radius_mm,
        parent,
    };
    let mut nodes: Vec<CentrelineNode> =
        (0..=26).map(|k: usize| node(0.0, 5.0 * k as f64, 4.0, k.checked_sub(1))).collect();
    let mut at = 4;
    for part in (1..10).map(|k| 0.1 * f64::from(k)) {
        let aside = libm::pow(libm::sin(std::f64::consts::PI * part), 0.8);
        nodes.push(node(9.0 * aside, 20.0 + 80.0 * part, 3.0, Some(at)));
        at = nodes.len() - 1;
    }
    let links = vec![CentrelineLink { row: at, joins: 20 }];
    CentrelineTree::new(nodes).unwrap().with_links(links).unwrap()
}

/// A wire with a tip of this curvature at the inlet of the vessel, and the centre line that is found in its surface.
fn scene(curvature_per_mm: f64) -> (Simulation, CentrelineTree) {
    let made = GeneratedWall::new(&dissected(), Resolution::EdgeMm(0.8)).unwrap();
    let from = CentrelineEnd::Opening(made.inlet);
    let found = ExtractedCentreline::of(&made.wall, Some(from), &[]).unwrap();
    assert_eq!((found.rings, found.tree.links().len()), (Some(1), 1));
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0).unwrap();
    let tip = Section { rest_curvature_per_mm: [curvature_per_mm, 0.0], ..Section::straight(12.0, 0.3, 4.0) };
    let wire = Device::new(vec![tip, Section::straight(300.0, 0.3, 10.0)]).unwrap();
    let options = KirchhoffOptions { element_mm: 4.0, ..KirchhoffOptions::default() };
    (Simulation::builder(made.wall, wire, sheath).method(&options).build().unwrap(), found.tree)
}

/// The largest distance from the axis of the true lumen that the line has between 45 and 75 mm, and its tip.
fn lies(simulation: &Simulation) -> (f64, Vec3) {
    let inner = |x: &&Vec3| (45.0..75.0).contains(&x.z);
    let aside_mm = simulation.shape().positions_mm.iter().filter(inner).map(|x| x.x).fold(0.0, f64::max);
    (aside_mm, simulation.shape().tip_mm().unwrap())
}

/// The same once a hand has followed a path to its end.
fn reached(start: &Simulation, path: CentrelinePath) -> (f64, Vec3) {
    let mut simulation = start.clone();
    let mut hand = FollowPath::new(path, Team::default(), 4.0);
    let outcome = drive::<Error>(&mut simulation, &mut hand, 300, |_, _| Ok(())).unwrap();
    assert!(matches!(outcome, Outcome::Arrived), "{outcome:?} {:?}", lies(&simulation));
    lies(&simulation)
}

#[test]
fn a_wire_goes_through_the_false_lumen_and_comes_back_by_the_re_entry() {
    let (hooked, tree) = scene(0.08);
    let place = |name: &str| tree.nodes()[tree.target(name).unwrap().row].position_mm;
    let end = tree.targets()[0].name.clone();
    // A named target in the false lumen.
    let (aside_mm, tip) = reached(&hooked, tree.path_to_place(&place("arm 1")).unwrap());
    assert!(aside_mm > 5.0 && tip.x > 5.0, "{aside_mm} {tip:?}");
    // Through both tears to the far end.
    let way = tree.path_via(&place("arm 1"), &place(&end)).unwrap();
    let (aside_mm, tip) = reached(&hooked, way.clone());
    assert!(aside_mm > 5.0 && tip.z > 120.0 && tip.x.abs() < 4.0, "{aside_mm} {tip:?}");
    // The twin: a straight wire stays in the true lumen, which is the shorter way.
    let shorter = tree.path_to_place(&place(&end)).unwrap();
    assert!(shorter.length_mm() + 3.0 < way.length_mm(), "{} {}", shorter.length_mm(), way.length_mm());
    let (aside_mm, tip) = reached(&scene(0.0).0, shorter);
    assert!(aside_mm < 4.0 && tip.z > 120.0, "{aside_mm} {tip:?}");
}

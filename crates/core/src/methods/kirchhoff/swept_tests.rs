//! Vessels whose walls are given by centre lines.

use super::KirchhoffOptions;
use crate::Vec3;
use crate::contact::ContactSurface;
use crate::device::{Device, Section};
use crate::insertion::{Command, Sheath, Simulation, WallProperties, WallRegion};
use crate::vessel::{
    CentrelineNode, CentrelineTree, GeneratedWall, Lumen, NoStore, Resolution, SweptVessel, anatomy,
};

fn swept(tree: &CentrelineTree) -> Lumen {
    SweptVessel::new(tree.clone(), Resolution::EdgeMm(1.0)).unwrap().into()
}

/// The shape of a wire after every step of 2 mm.
fn pushed(lumen: Lumen, inlet: usize, friction: f64, steps: usize) -> Vec<Vec<Vec3>> {
    let sheath = Sheath::at_opening(&lumen, inlet, 2.0).unwrap();
    let wire = Device::uniform(600.0, 0.445, 60.0).unwrap();
    let properties = WallProperties { friction, ..WallProperties::default() };
    let mut simulation = Simulation::builder(lumen, wire, sheath).properties(properties).build().unwrap();
    let after = |_| {
        simulation.step(Command::advance(2.0)).unwrap();
        simulation.shape().positions_mm.clone()
    };
    (0..steps).map(after).collect()
}

fn farthest_mm(one: &[Vec<Vec3>], other: &[Vec<Vec3>]) -> f64 {
    let points = one.iter().zip(other).flat_map(|(a, b)| a.iter().zip(b));
    points.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn a_wire_goes_the_way_that_it_goes_in_a_fine_mesh() {
    for (name, steps) in [("curved_tube", 60), ("aortic_arch", 110)] {
        let tree = anatomy::tree(name).unwrap();
        let least_mm = tree.nodes().iter().map(|node| node.radius_mm).fold(f64::MAX, f64::min);
        for friction in [0.0, 0.1] {
            let in_mesh = |edge_mm: f64| {
                let made = GeneratedWall::new(&tree, Resolution::EdgeMm(edge_mm)).unwrap();
                pushed(made.wall.into(), made.inlet, friction, steps)
            };
            let lumen = swept(&tree);
            let felt = pushed(lumen.clone(), lumen.inlet().unwrap().index, friction, steps);
            let off_mm = farthest_mm(&felt, &in_mesh(least_mm / 4.0));
            assert!(off_mm < 0.02, "{name}, friction {friction}: {off_mm}");
            // With triangles half as large as the vessel the result differs.
            let coarse_mm = farthest_mm(&felt, &in_mesh(0.6 * least_mm));
            assert!(coarse_mm > 0.02, "{name}, friction {friction}: {coarse_mm}");
        }
    }
}

#[test]
fn a_centre_line_is_felt_by_a_mesh_where_the_wall_has_regions_or_the_device_is_thicker() {
    let lumen = swept(&anatomy::tree("curved_tube").unwrap());
    let meshed = |radius_mm: f64, properties: &WallProperties| {
        ContactSurface::of(&lumen, (0.2, radius_mm), properties, &NoStore).unwrap().mesh().is_some()
    };
    let plain = WallProperties::default();
    // The tube's radius is 4 mm.
    assert!(!meshed(0.2, &plain) && !meshed(3.9, &plain) && meshed(4.1, &plain));
    let place_mm = lumen.openings()[0].centre_mm;
    let region = WallRegion {
        centre_mm: Some(place_mm.into()),
        radius_mm: Some(8.0),
        modulus_n_per_mm2: Some(10.0),
        ..WallRegion::default()
    };
    assert!(meshed(0.2, &WallProperties { region: vec![region], ..plain }));
}

#[test]
fn a_soft_bent_wire_is_held_by_the_wall_of_a_widening() {
    // The radius of the vessel at places on its axis, mm.
    let profile =
        [(0.0, 1.5), (5.0, 1.5), (8.0, 3.0), (11.0, 5.0), (15.0, 5.0), (19.0, 3.5), (23.0, 1.5), (28.0, 1.5)];
    let node = |(row, (z, radius_mm)): (usize, &(f64, f64))| CentrelineNode {
        position_mm: Vec3::new(0.0, 0.0, *z),
        radius_mm: *radius_mm,
        parent: row.checked_sub(1),
    };
    let tree = CentrelineTree::new(profile.iter().enumerate().map(node).collect()).unwrap();
    let tip = Section { rest_curvature_per_mm: [0.4, 0.05], ..Section::straight(74.0, 0.2, 0.05) };
    let position_mm = Vec3::new(0.0, 0.0, 1.0);
    let sheath =
        Sheath { position_mm, direction: Vec3::z(), friction: 0.0, friction_n: 0.0, bends_towards: None };
    let properties = WallProperties { modulus_n_per_mm2: 1.0, friction: 0.0, ..WallProperties::default() };
    let method = KirchhoffOptions { element_mm: 1.0, self_contact: true, ..KirchhoffOptions::default() };
    let builder = Simulation::builder(swept(&tree), Device::new(vec![tip]).unwrap(), sheath);
    let mut simulation = builder.properties(properties).method(&method).build().unwrap();
    for step in 1..=70 {
        let report = simulation.step(Command::advance(0.2)).unwrap();
        assert!(report.converged, "step {step}: {}", report.imbalance);
        // A force of a hundredth of a newton on a stretch of a millimetre.
        assert!(report.max_penetration_mm < 0.1, "step {step}: {} mm", report.max_penetration_mm);
    }
}

//! Walls with regions of another stiffness or friction: conservation laws, forces, and what a region must not change.

use std::f64::consts::FRAC_PI_2;

use endowire_core::Vec3;
use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation, StepReport, WallProperties, WallRegion};
use endowire_core::methods::kirchhoff::{Accuracy, KirchhoffOptions};
use endowire_core::shape::Frame;
use endowire_core::statics::{WallRod, WallRodSpec};
use endowire_core::vessel::{GeneratedWall, NoStore, Resolution, SurfaceMesh, Wall, anatomy};
use endowire_tests::crossing::CrossingTest;

/// Where the tip passes along the outer side of the curved tube between 150 and 170 mm inserted.
const OUTER: [f64; 3] = [41.0, 0.0, 146.0];
const BENDING_NMM2: f64 = 10.0;

fn patch(modulus: f64) -> WallRegion {
    WallRegion {
        centre_mm: Some(OUTER),
        radius_mm: Some(10.0),
        modulus_n_per_mm2: Some(modulus),
        ..WallRegion::default()
    }
}

/// A wall of one modulus.
fn wall(modulus_n_per_mm2: f64) -> WallProperties {
    WallProperties { modulus_n_per_mm2, ..WallProperties::default() }
}

/// The same with a patch of another.
fn patched(modulus_n_per_mm2: f64, inside: f64) -> WallProperties {
    WallProperties { region: vec![patch(inside)], ..wall(modulus_n_per_mm2) }
}

fn in_curved_tube(properties: WallProperties) -> Simulation {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let wire = Device::uniform(400.0, 0.445, BENDING_NMM2).unwrap();
    Simulation::builder(made.wall, wire, sheath)
        .properties(properties)
        .method(&KirchhoffOptions::of(Accuracy::Fine))
        .build()
        .unwrap()
}

fn advance(simulation: &mut Simulation, length_mm: f64, step_mm: f64) -> StepReport {
    for _ in 0..(length_mm / step_mm).round() as usize {
        simulation.step(Command::advance(step_mm)).unwrap();
    }
    simulation.report().clone()
}

/// Slope of the energy with the inserted length. The tip crosses an edge of seven decades within a tenth of a millimetre: a
/// longer step would not see it.
fn slope_of_energy(simulation: &mut Simulation) -> f64 {
    let step = 0.002;
    let before = simulation.step(Command::retract(step)).unwrap().energy.total();
    let after = simulation.step(Command::advance(2.0 * step)).unwrap().energy.total();
    simulation.step(Command::retract(step)).unwrap();
    (after - before) / (2.0 * step)
}

/// What the hand must push with by the forces and moments of the contacts alone: −n·t − |m|²/2EI.
fn push_by_contacts(simulation: &Simulation) -> f64 {
    let sheath = simulation.sheath();
    let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
    for contact in &simulation.report().contacts {
        force += contact.total_n();
        moment += (contact.position_mm - sheath.position_mm).cross(&contact.total_n());
    }
    -force.dot(&sheath.direction) - moment.norm_squared() / (2.0 * BENDING_NMM2)
}

#[test]
fn the_push_force_is_the_slope_of_the_energy_across_the_edge_of_a_region() {
    for (outside, inside) in [(0.01, 10.0), (1e-3, 1e4), (10.0, 0.01)] {
        let mut simulation = in_curved_tube(patched(outside, inside));
        let mut same = in_curved_tube(wall(outside));
        advance(&mut simulation, 145.0, 5.0);
        advance(&mut same, 145.0, 5.0);
        let mut largest_change: f64 = 0.0;
        for _ in 0..30 {
            let push = advance(&mut simulation, 1.0, 1.0).push_force_n;
            let slope = slope_of_energy(&mut simulation);
            let at = format!("{outside} and {inside} N/mm², {} mm", simulation.report().inserted_mm);
            assert!((push / slope - 1.0).abs() < 1e-3, "{at}: push {push}, slope {slope}");
            let contacts = push_by_contacts(&simulation);
            assert!((push / contacts - 1.0).abs() < 1e-3, "{at}: push {push}, contacts {contacts}");
            let without = advance(&mut same, 1.0, 1.0).push_force_n;
            largest_change = largest_change.max((push / without - 1.0).abs());
        }
        // The patch is felt: its wall is not that of the tube.
        assert!(largest_change > 0.01, "{outside} and {inside} N/mm²: {largest_change:e}");
    }
}

#[test]
fn over_a_patch_and_back_returns_to_the_same_energy() {
    let mut simulation = in_curved_tube(patched(0.01, 10.0));
    let before = advance(&mut simulation, 145.0, 1.0);
    let mut on_patch = None;
    // In steps that resolve the edge of the patch: the force has a peak there, and what a step takes in is judged by its ends.
    for _ in 0..120 {
        let report = simulation.step(Command::advance(0.25)).unwrap();
        assert!(!report.jumped);
        on_patch =
            on_patch.or(Some(report.max_penetration_mm).filter(|p| *p < 0.5 * before.max_penetration_mm));
    }
    assert!(on_patch.is_some(), "the tip is as deep on the patch as before it");
    for _ in 0..120 {
        assert!(!simulation.step(Command::retract(0.25)).unwrap().jumped);
    }
    let after = simulation.report();
    let change = (after.energy.total() / before.energy.total() - 1.0).abs();
    assert!(change < 1e-8, "{change:e}");
    // An energy that forgets more is seen.
    let farther = simulation.step(Command::advance(1e-3)).unwrap().energy.total();
    assert!((farther / before.energy.total() - 1.0).abs() > 1e-6);
}

#[test]
fn patches_of_any_stiffness_are_met_and_never_passed_through() {
    for (outside, inside) in [(1e-3, 1e4), (1e4, 1e-3), (1.0, 1e4)] {
        let mut simulation = in_curved_tube(patched(outside, inside));
        let crossing = CrossingTest::new(simulation.lumen().wall(&NoStore).unwrap().mesh());
        for _ in 0..50 {
            let stepped = simulation.step(Command::advance(4.0));
            assert!(stepped.is_ok(), "{outside} and {inside} N/mm²: {}", stepped.unwrap_err());
            assert!(!crossing.is_crossed_by(&simulation), "{outside} and {inside} N/mm²");
        }
    }
}

/// Tip, push force and report with the tip on the patch.
fn end(properties: WallProperties) -> (Vec3, f64, StepReport) {
    let mut simulation = in_curved_tube(properties);
    let report = advance(&mut simulation, 160.0, 2.0);
    (simulation.shape().tip_mm().unwrap(), report.push_force_n, report)
}

#[test]
fn a_region_that_holds_the_vessel_is_the_wall() {
    let (tip, push, _) =
        end(WallProperties { modulus_n_per_mm2: 5.0, friction: 0.1, ..WallProperties::default() });
    let everywhere = |modulus: f64, friction: f64| WallProperties {
        region: vec![WallRegion {
            radius_mm: Some(1e4),
            friction: Some(friction),
            modulus_n_per_mm2: Some(modulus),
            ..patch(modulus)
        }],
        ..wall(0.02)
    };
    let (same_tip, same_push, _) = end(everywhere(5.0, 0.1));
    assert!((same_tip - tip).norm() < 1e-6 && (same_push / push - 1.0).abs() < 1e-6);
    let (other_tip, other_push, _) = end(everywhere(5.0, 0.11));
    assert!((other_tip - tip).norm() > 1e-4 && (other_push / push - 1.0).abs() > 1e-3);
}

#[test]
fn friction_in_a_region_acts_there_and_nowhere_else() {
    let rough = WallRegion { friction: Some(0.2), modulus_n_per_mm2: None, ..patch(1.0) };
    let (_, push, report) = end(WallProperties { region: vec![rough], ..wall(1.0) });
    let (centre, radius) = (Vec3::from(rough.centre_mm.unwrap()), rough.radius_mm.unwrap());
    let reach = radius + 3.0;
    let (mut inside, mut outside) = (0, 0);
    for contact in &report.contacts {
        // Contacts are on the axis, a wire's radius off the wall.
        let away = (contact.position_mm - centre).norm();
        let friction = contact.friction_n.norm() / contact.force_n;
        if away > reach {
            outside += 1;
            assert_eq!(friction, 0.0);
        } else if away < radius - 3.0 && contact.force_n > 1e-6 {
            inside += 1;
            assert!((friction / 0.2 - 1.0).abs() < 1e-2, "{friction}");
        }
    }
    assert!(inside > 0 && outside > 0, "{inside} {outside}");
    assert!(report.angles && report.dissipated_mj > 0.0);
    let smooth = end(wall(1.0));
    assert!(push > smooth.1 && !smooth.2.angles);
}

#[test]
fn a_rough_region_holds_a_device_that_is_turned_on_it() {
    let rough = WallRegion { friction: Some(0.2), modulus_n_per_mm2: None, ..patch(1.0) };
    let mut simulation = in_curved_tube(WallProperties { region: vec![rough], ..wall(1.0) });
    let turn = Command { advance_mm: 0.0, rotate_rad: FRAC_PI_2, ..Command::default() };
    let mut torques = |length_mm: f64| {
        advance(&mut simulation, length_mm, 2.0);
        let report = simulation.step(turn).unwrap();
        let most: f64 = report.contacts.iter().map(|c| 0.445 * c.friction_n.norm()).sum();
        (report.torque_nmm, most)
    };
    let (torque, most) = torques(160.0);
    assert!(torque > 0.5 * most && torque < 1.001 * most && most > 1e-4, "{torque} of {most}");
    // Past it nothing rubs.
    let (torque, most) = torques(20.0);
    assert!(torque.abs() < 1e-12 && most == 0.0, "{torque} of {most}");
}

/// Depth of a rod of radius 0.45 mm under 0.02 N/mm on a soft clot in a stiff artery (1 and 100 N/mm²), where the piece at this
/// place has the modulus of the clot.
fn sunk_mm(soft_at: [f64; 3]) -> f64 {
    const DEPTH_MM: f64 = 0.02;
    let setup = WallRodSpec { length: 40.0, bending: 0.16, radius: 0.45, elements: 80, modulus: 100.0 };
    // The clot's top is flat below the whole rod, which begins at the depth that 0.02 N/mm gives at 1 N/mm².
    // Read in the middle of a rod so soft that its ends are not felt there.
    let top = DEPTH_MM - setup.radius;
    let mut surface = SurfaceMesh::cuboid(Vec3::new(-30.0, -20.0, -20.0), Vec3::new(70.0, 20.0, 20.0), 2.0);
    let clot = SurfaceMesh::cuboid(Vec3::new(-12.0, top - 8.0, -12.0), Vec3::new(52.0, top, 12.0), 1.0);
    let first = surface.vertices_mm.len() as u32;
    surface.vertices_mm.extend(clot.vertices_mm);
    surface.triangles.extend(clot.triangles.into_iter().map(|triangle| triangle.map(|v| v + first)));
    let soft =
        WallRegion { piece_at_mm: Some(soft_at), modulus_n_per_mm2: Some(1.0), ..WallRegion::default() };
    let properties = WallProperties { deviation_mm: 0.0, region: vec![soft], ..wall(setup.modulus) };
    let straight = Frame::new(Vec3::x(), Some(Vec3::y()));
    let walls = Wall::from_surface(&surface).unwrap();
    assert_eq!(walls.report().bodies_in_lumen, 1);
    let mut rod = WallRod::on_wall(&walls, &properties, &setup, Vec3::zeros(), |_| straight).unwrap();
    rod.loads.distributed = vec![(0, setup.elements, Vec3::y() * -DEPTH_MM)];
    rod.solve().unwrap();
    DEPTH_MM - rod.state.positions[setup.elements / 2].y
}

#[test]
fn a_rod_sinks_into_a_soft_clot_by_load_over_modulus_and_into_a_stiff_one_a_hundredth_as_deep() {
    let soft = sunk_mm([20.0, -4.0, 0.0]);
    assert!((soft / 0.02 - 1.0).abs() < 1e-6, "{soft}");
    // With the artery soft in its place.
    let stiff = sunk_mm([20.0, -20.0, 0.0]);
    assert!((stiff / 2e-4 - 1.0).abs() < 0.02, "{stiff}");
}

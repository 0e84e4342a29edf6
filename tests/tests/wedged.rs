//! A thread wedged in a bend of a rigid wall, where lagged normal forces do not settle: every step ends in Coulomb's law.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use endowire_core::Vec3;
use endowire_core::device::Device;
use endowire_core::insertion::{Command, Contact, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution};

const FRICTION: f64 = 0.5;

/// 10 mm straight, a quarter circle of radius 20 mm, 40 mm straight; bore 3 mm.
fn thread(friction: f64) -> Simulation {
    let mut axis: Vec<Vec3> = (0..5).map(|i| Vec3::x() * (2.0 * f64::from(i))).collect();
    axis.extend((0..=15).map(|i| {
        let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_2 / 15.0).sin_cos();
        Vec3::new(10.0 + 20.0 * sin, 20.0 - 20.0 * cos, 0.0)
    }));
    axis.extend((1..=20).map(|i| Vec3::new(30.0, 20.0 + 2.0 * f64::from(i), 0.0)));
    let nodes = axis.into_iter().enumerate().map(|(i, position_mm)| CentrelineNode {
        position_mm,
        radius_mm: 3.0,
        parent: i.checked_sub(1),
    });
    let tree = CentrelineTree::new(nodes.collect()).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(0.8)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let properties = WallProperties { modulus_n_per_mm2: 1e4, friction, ..WallProperties::default() };
    let device = Device::uniform(100.0, 0.45, 1e-2).unwrap();
    let method = KirchhoffOptions { element_mm: 2.0, ..KirchhoffOptions::default() };
    Simulation::builder(made.wall, device, sheath).properties(properties).method(&method).build().unwrap()
}

/// Direction of the device near a place.
fn along(simulation: &Simulation, x: &Vec3) -> Vec3 {
    let shape = simulation.shape();
    let off = |i: &usize| (shape.positions_mm[*i] - x).norm();
    let nearest = (0..shape.positions_mm.len()).min_by(|i, j| off(i).total_cmp(&off(j))).unwrap();
    shape.tangents[nearest]
}

/// Whether friction at a contact is what Coulomb's law with coefficient μ allows.
fn obeys(contact: &Contact, friction: f64) -> bool {
    let (f, n) = (contact.friction_n, contact.force_n);
    f.norm() <= friction * n * (1.0 + 1e-3) + 1e-12 && f.dot(&contact.normal).abs() <= 1e-3 * n + 1e-12
}

#[test]
fn a_wedged_thread_settles_and_obeys_coulombs_law_at_every_point() {
    let mut simulation = thread(FRICTION);
    let (mut slipping, mut beyond_less) = (0, 0);
    for advance_mm in std::iter::repeat_n(2.0, 12).chain(std::iter::repeat_n(1.0, 5)) {
        let report = simulation.step(Command::advance(advance_mm)).unwrap();
        assert!(report.converged && report.iterations < 300, "{} iterations", report.iterations);
        let report = simulation.report();
        for contact in &report.contacts {
            assert!(obeys(contact, FRICTION), "{contact:?}");
            if contact.friction_n.norm() > 0.999 * FRICTION * contact.force_n {
                slipping += 1;
                // The hand pushes: a point that slips is held back.
                let t = along(&simulation, &contact.position_mm);
                assert!(contact.friction_n.dot(&t) < 0.5 * -contact.friction_n.norm(), "{contact:?}");
            }
            // The same points do not obey a law with less friction: the check can fail.
            beyond_less += usize::from(!obeys(contact, 0.9 * FRICTION));
        }
    }
    assert!(slipping > 4 && beyond_less >= slipping, "{slipping} {beyond_less}");
    assert!(simulation.report().push_force_n > 0.0);
    // Without friction the hand pushes less.
    let mut smooth = thread(0.0);
    for advance_mm in std::iter::repeat_n(2.0, 12).chain(std::iter::repeat_n(1.0, 5)) {
        smooth.step(Command::advance(advance_mm)).unwrap();
    }
    assert!(smooth.report().push_force_n < 0.8 * simulation.report().push_force_n);
}

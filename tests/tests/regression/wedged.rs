//! A thread wedged in a bend of a rigid wall, where lagged normal forces do not settle: every step ends in Coulomb's law.

use endowire_core::Vec3;
use endowire_core::device::Device;
use endowire_core::insertion::{Command, Contact, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_lab::insertion_stress::InsertionStress;

const FRICTION: f64 = 0.5;

/// In the vessel of the stress table, a quarter circle between straight lengths.
fn thread(friction: f64) -> Simulation {
    let InsertionStress { wall, sheath } = InsertionStress::new().unwrap();
    let properties = WallProperties { modulus_n_per_mm2: 1e4, friction, ..WallProperties::default() };
    let device = Device::uniform(100.0, 0.45, 1e-2).unwrap();
    let method = KirchhoffOptions { element_mm: 2.0, ..KirchhoffOptions::default() };
    Simulation::builder(wall, device, sheath).properties(properties).method(&method).build().unwrap()
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

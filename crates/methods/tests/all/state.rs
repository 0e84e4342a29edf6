//! The state of an insertion by any method determines its next step.

use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation};
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};
use endowire_methods::{AnyMethod, NAMES};

fn start(name: &str) -> Simulation {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.5)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let wire = Device::uniform(120.0, 0.445, 10.0).unwrap();
    let method = AnyMethod::named(name).unwrap().with_element_mm(6.0);
    Simulation::builder(made.wall, wire, sheath).method(&method).build().unwrap()
}

#[test]
fn every_method_goes_on_from_its_state_and_refuses_those_of_others() {
    let mut last = None;
    for name in NAMES {
        let mut simulation = start(name);
        let mut again = simulation.clone();
        for k in 0..30 {
            again.restore(&simulation.state()).unwrap();
            assert_eq!((again.shape(), again.report()), (simulation.shape(), simulation.report()));
            let command = Command {
                advance_mm: if k % 6 == 5 { -1.0 } else { 2.0 },
                rotate_rad: 0.1 * f64::from(k % 3),
                ..Command::default()
            };
            assert_eq!(simulation.step(command).is_ok(), again.step(command).is_ok(), "{name}");
            assert_eq!(again.shape(), simulation.shape(), "{name}, step {k}");
            assert_eq!(again.report(), simulation.report(), "{name}, step {k}");
        }
        assert!(simulation.report().inserted_mm > 30.0, "{name}");
        assert_eq!(simulation.state().method(), name);
        if let Some(other) = last.replace(simulation.state()) {
            let error = simulation.restore(&other).unwrap_err();
            assert!(error.is_input() && error.to_string().starts_with("state.method"), "{name}: {error}");
        }
    }
}

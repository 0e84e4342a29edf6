//! The paper's method over a whole insertion: both solves are one method.

use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation};
use endowire_core::methods::MethodChoice;
use endowire_core::vessel::{GeneratedWall, Resolution, Wall, anatomy};
use endowire_methods::AnyMethod;
use endowire_methods::li2011::Li2011Options;

fn curved_tube() -> (Wall, Sheath) {
    let generated =
        GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
    let sheath = Sheath::at_opening(&generated.wall, generated.inlet, 1.0).unwrap();
    (generated.wall, sheath)
}

/// Largest distance between nodes of two methods over the same insertion: in, a turn, and half way out again.
fn largest_difference(a: &dyn MethodChoice, b: &dyn MethodChoice) -> f64 {
    let (wall, sheath) = curved_tube();
    let start = |method| {
        Simulation::builder(wall.clone(), Device::uniform(300.0, 0.45, 10.0).unwrap(), sheath)
            .method(method)
            .build()
            .unwrap()
    };
    let (mut first, mut second) = (start(a), start(b));
    let mut commands = vec![Command::advance(1.5); 120];
    commands.push(Command::rotate(1.0));
    commands.extend(vec![Command::retract(2.0); 45]);
    let mut largest: f64 = 0.0;
    let mut most_contacts = 0;
    let mut converged = [0, 0];
    for command in commands {
        first.step(command).unwrap();
        second.step(command).unwrap();
        let (x, y) = (&first.shape().positions_mm, &second.shape().positions_mm);
        assert_eq!(x.len(), y.len());
        converged[usize::from(first.report().converged)] += 1;
        most_contacts = most_contacts.max(first.report().contacts.len());
        largest = x.iter().zip(y).map(|(x, y)| (x - y).norm()).fold(largest, f64::max);
    }
    assert!(most_contacts > 10, "the wire must lean on the wall");
    // Straight in, the contacts of a step (none) are those it ends with; in the bend one solve does not find them all.
    assert!(converged[1] > 40 && converged[0] > 10, "{converged:?}");
    largest
}

#[test]
fn dense_and_banded_agree_over_a_whole_insertion() {
    let options = Li2011Options { element_mm: 3.0, ..Default::default() };
    let difference = largest_difference(&AnyMethod::Li2011Dense(options), &AnyMethod::Li2011Banded(options));
    assert!(difference < 1e-8, "{difference:e} mm");
}

#[test]
fn another_wall_stiffness_is_seen_by_the_same_comparison() {
    let options = Li2011Options { element_mm: 3.0, ..Default::default() };
    let stiffer = Li2011Options { wall_stiffness_n_per_mm: 1.0 + 1e-6, ..options };
    let difference = largest_difference(&AnyMethod::Li2011Banded(options), &AnyMethod::Li2011Banded(stiffer));
    assert!(difference > 1e-8, "{difference:e} mm");
}

//! The paper's method over a whole insertion: both solves are one method, and with unit tangents it ends where the exact rod does.

use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation};
use endowire_core::methods::MethodChoice;
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::shape::Shape;
use endowire_core::vessel::{GeneratedWall, Resolution, Wall, anatomy};
use endowire_methods::AnyMethod;
use endowire_methods::li2011::{ContactReading, Li2011Options, TangentReading};

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
    assert!(most_contacts > 2, "the wire must lean on the wall");
    assert_eq!(converged[0], 0, "{converged:?}");
    largest
}

/// A wire of 10 N·mm² pushed 200 mm into the tube of Table 2 by increments; its shape, and steps that did not converge.
fn pushed(method: &dyn MethodChoice, h_mm: f64) -> (Shape, usize) {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(0.8)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let wire = Device::uniform(201.0, 0.445, 10.0).unwrap();
    let mut simulation = Simulation::builder(made.wall, wire, sheath).method(method).build().unwrap();
    let steps = (200.0 / h_mm - 1e-9).ceil() as usize;
    let mut unconverged = 0;
    for k in 1..=steps {
        let to_mm = if k == steps { 200.0 } else { h_mm * k as f64 };
        let report = simulation.step(Command::advance(to_mm - simulation.report().inserted_mm)).unwrap();
        unconverged += usize::from(!report.converged);
    }
    (simulation.shape().clone(), unconverged)
}

/// Root mean square distance of nodes from those of the truth at the same arc length, which has a node at each, mm.
fn rms_mm(shape: &Shape, truth: &Shape) -> f64 {
    let square = |(x, s): (&endowire_core::Vec3, &f64)| {
        let node = truth.from_tip_mm.iter().position(|t| (t - s).abs() < 1e-6).unwrap();
        (x - truth.positions_mm[node]).norm_squared()
    };
    let sum: f64 = shape.positions_mm.iter().zip(&shape.from_tip_mm).map(square).sum();
    (sum / shape.len() as f64).sqrt()
}

fn exact() -> Shape {
    pushed(&AnyMethod::Kirchhoff(KirchhoffOptions { element_mm: 0.5, ..Default::default() }), 1.0).0
}

fn paper(element_mm: f64) -> Li2011Options {
    Li2011Options { element_mm, wall_stiffness_n_per_mm: element_mm, ..Default::default() }
}

#[test]
fn the_papers_method_ends_where_the_exact_rod_does() {
    let truth = exact();
    // Segment and increment of Table 2, and the bound; the paper prints 0.96 to 1.62 mm there.
    for (l_mm, parts, bound_mm) in [(1.0, 5.0, 0.15), (2.0, 3.0, 0.15), (2.0, 10.0, 0.15), (3.0, 3.0, 0.5)] {
        let (shape, unconverged) = pushed(&AnyMethod::Li2011Banded(paper(l_mm)), l_mm / parts);
        let rms_mm = rms_mm(&shape, &truth);
        assert!(rms_mm < bound_mm, "l {l_mm}, l/h {parts}: {rms_mm} mm");
        assert_eq!(unconverged, 0, "l {l_mm}, l/h {parts}");
    }
}

#[test]
fn other_readings_of_the_paper_fail_the_same_bound() {
    let truth = exact();
    let triangles = Li2011Options { contact: ContactReading::Triangle, ..paper(2.0) };
    let printed = Li2011Options { tangents: TangentReading::Free, ..triangles };
    for (options, at_least_mm) in [(triangles, 0.15), (printed, 10.0)] {
        let (shape, unconverged) = pushed(&AnyMethod::Li2011Banded(options), 2.0 / 3.0);
        let (rms_mm, length_mm) = (rms_mm(&shape, &truth), length_mm(&shape));
        assert!(rms_mm > at_least_mm && unconverged > 0, "{options:?}: {rms_mm} mm");
        // With unit tangents the wire keeps its length, whatever it collides with; as printed a quarter of it is lost.
        let kept = (length_mm / 200.0 - 1.0).abs() < 1e-3;
        assert_eq!(kept, options.tangents == TangentReading::Unit, "{length_mm} mm");
    }
}

/// Length of the polygon of nodes, mm.
fn length_mm(shape: &Shape) -> f64 {
    shape.positions_mm.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum()
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

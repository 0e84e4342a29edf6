//! A device in a vessel that yields, against beams on supports (reference case E5), and its balance of energy.

use std::f64::consts::PI;

use crate::Vec3;
use crate::device::Device;
use crate::insertion::{Command, Sheath, Simulation, WallProperties};
use crate::methods::kirchhoff::{Accuracy, KirchhoffOptions};
use crate::vessel::motion::{Around, MotionMode, VesselMotion, Waveform};
use crate::vessel::{
    CentrelineNode, CentrelineTree, Course, Lumen, Resolution, SweptVessel, YieldingEnds, YieldingSpec,
};

/// A vessel along z that winds in x by this amplitude over this wavelength.
fn winding((amplitude_mm, wave_mm): (f64, f64), length_mm: f64, radius_mm: f64) -> CentrelineTree {
    let step_mm = 2.0;
    let node = |row: usize| {
        let z = step_mm * row as f64;
        let x = amplitude_mm * libm::sin(2.0 * PI * z / wave_mm);
        CentrelineNode { position_mm: Vec3::new(x, 0.0, z), radius_mm, parent: row.checked_sub(1) }
    };
    CentrelineTree::new((0..=(length_mm / step_mm) as usize).map(node).collect()).unwrap()
}

fn made_of(bending_nmm2: f64, support_n_per_mm2: f64) -> YieldingSpec {
    YieldingSpec {
        bending_stiffness_nmm2: Some(bending_nmm2),
        support_n_per_mm2: Some(support_n_per_mm2),
        ends: Some(YieldingEnds::Free),
        ..YieldingSpec::default()
    }
}

/// A straight wire of radius 0.4 mm in a vessel, a millimetre behind its first point.
fn wire(
    tree: &CentrelineTree,
    yields: Option<&YieldingSpec>,
    bending_nmm2: f64,
    how: (WallProperties, Accuracy),
) -> Simulation {
    wire_in_moving(tree, yields, bending_nmm2, how, &[])
}

/// The same in a vessel that moves.
fn wire_in_moving(
    tree: &CentrelineTree,
    yields: Option<&YieldingSpec>,
    bending_nmm2: f64,
    (properties, accuracy): (WallProperties, Accuracy),
    motion: &[MotionMode],
) -> Simulation {
    let edge_mm = 0.5 * tree.nodes()[0].radius_mm.min(1.0);
    let lumen = Lumen::from(SweptVessel::new(tree.clone(), Resolution::EdgeMm(edge_mm)).unwrap());
    let nodes = tree.nodes();
    let along = (nodes[1].position_mm - nodes[0].position_mm).normalize();
    let sheath = Sheath::new(nodes[0].position_mm + along, along).unwrap();
    let device = Device::uniform(600.0, 0.4, bending_nmm2).unwrap();
    let options = KirchhoffOptions::of(accuracy);
    let course = yields.map(|spec| Course::new(tree, spec).unwrap());
    let builder = Simulation::builder(lumen, device, sheath).properties(properties);
    builder.course(course).motion(VesselMotion::new(motion).unwrap()).method(&options).build().unwrap()
}

fn wall(modulus_n_per_mm2: f64, friction: f64) -> (WallProperties, Accuracy) {
    (WallProperties { modulus_n_per_mm2, friction, ..WallProperties::default() }, Accuracy::Balanced)
}

/// The amplitude of x = A sin qz that fits the line best over two waves about a height, mm.
fn amplitude_mm(simulation: &Simulation, middle_mm: f64, wave_mm: f64) -> f64 {
    let (mut square, mut sum) = (0.0, 0.0);
    for at in simulation.shape().positions_mm.iter().filter(|at| (at.z - middle_mm).abs() < wave_mm) {
        let sine = libm::sin(2.0 * PI * at.z / wave_mm);
        square += sine * sine;
        sum += sine * at.x;
    }
    sum / square
}

/// E5: of the amplitude a there is left a (B q⁴ + k)/((B_d + B) q⁴ + k), and with a soft wall in between the device's is
/// a/(1 + B_d q⁴ (1/K + 1/(B q⁴ + k))). Slopes are small, the ends far, and the play is a few hundred-thousandths of a.
#[test]
fn a_stiff_wire_straightens_a_winding_vessel_as_a_composite_beam() {
    let (high_mm, wave_mm, length_mm) = (0.05, 60.0, 540.0);
    let narrow = winding((high_mm, wave_mm), length_mm, 0.400_002);
    // Wider at the sheath's mouth.
    let mut nodes = narrow.nodes().to_vec();
    nodes.iter_mut().take(6).for_each(|node| node.radius_mm = 0.45);
    let tree = CentrelineTree::new(nodes).unwrap();
    let (bending, support, of_wire) = (3000.0, 0.2, 2000.0);
    let q4 = (2.0 * PI / wave_mm).powi(4);
    let of_vessel = bending * q4 + support;
    let left = |modulus: f64, of_vessel: f64| 1.0 / (1.0 + of_wire * q4 * (1.0 / modulus + 1.0 / of_vessel));
    for modulus in [2.0, 0.05] {
        let spec = YieldingSpec { span_mm: Some(6.0), ..made_of(bending, support) };
        let mut simulation = wire(&tree, Some(&spec), of_wire, wall(modulus, 0.0));
        for _ in 0..53 {
            simulation.step(Command::advance(10.0)).unwrap();
        }
        let found = amplitude_mm(&simulation, 0.5 * length_mm, wave_mm) / high_mm;
        let expected = left(modulus, of_vessel);
        assert!((found / expected - 1.0).abs() < 1e-4, "{modulus}: {found} {expected}");
        // A support that is stiffer by a thousandth would be seen.
        assert!((found / left(modulus, of_vessel + 1e-3 * support) - 1.0).abs() > 2e-5, "{modulus}: {found}");
    }
}

#[test]
fn what_the_hand_does_is_stored_or_rubbed_off() {
    let tree = winding((2.0, 120.0), 240.0, 1.5);
    let spec = made_of(300.0, 0.005);
    let closes = |friction: f64| {
        let mut simulation = wire(&tree, Some(&spec), 5000.0, wall(1.0, friction));
        let (mut work_mj, mut lost_mj, mut force_n) = (0.0, 0.0, 0.0);
        let mut most_mj: f64 = 0.0;
        for k in 0..160 {
            let step_mm = if k < 80 { 2.0 } else { -2.0 };
            let report = simulation.step(Command::advance(step_mm)).unwrap();
            work_mj += 0.5 * (force_n + report.push_force_n) * step_mm;
            (force_n, lost_mj) = (report.push_force_n, lost_mj + report.dissipated_mj);
            most_mj = most_mj.max(report.energy.total());
            assert!(report.energy.vessel >= 0.0 && report.converged);
        }
        ((work_mj - lost_mj).abs() / most_mj, lost_mj / most_mj)
    };
    let (off, lost) = closes(0.0);
    assert!(off < 1e-3 && lost == 0.0, "{off} {lost}");
    let (off, lost) = closes(0.2);
    assert!(off < 2e-2 * lost && lost > 0.1, "{off} {lost}");
}

#[test]
fn steps_of_any_size_end_at_the_same_place_and_states_go_on_to_the_bit() {
    let tree = winding((2.0, 120.0), 240.0, 1.5);
    let spec = made_of(300.0, 0.005);
    let at = |step_mm: f64, friction: f64| {
        let mut simulation = wire(&tree, Some(&spec), 5000.0, wall(1.0, friction));
        for _ in 0..(160.0 / step_mm) as usize {
            simulation.step(Command::advance(step_mm)).unwrap();
        }
        simulation
    };
    let off =
        |a: &Simulation, b: &Simulation| (a.shape().tip_mm().unwrap() - b.shape().tip_mm().unwrap()).norm();
    for friction in [0.0, 0.1] {
        let [small, large] = [2.0, 20.0].map(|step_mm| at(step_mm, friction));
        assert!(off(&small, &large) < 0.05, "{friction}: {}", off(&small, &large));
    }
    let mut first = at(20.0, 0.1);
    let mut again = wire(&tree, Some(&spec), 5000.0, wall(1.0, 0.1));
    again.restore(&first.state()).unwrap();
    for one in [&mut first, &mut again] {
        one.step(Command::advance(3.0)).unwrap();
    }
    assert_eq!(first.report(), again.report());
    assert_eq!(first.course_mm(), again.course_mm());
    // Ticks end where the step does.
    let mut ticked = at(20.0, 0.1);
    ticked.tick(&[crate::methods::Move { instrument: 0, command: Command::advance(3.0) }], 3, None).unwrap();
    for _ in 0..200 {
        ticked.tick(&[], 3, None).unwrap();
    }
    assert!(ticked.report().behind.is_empty());
    assert!(off(&ticked, &first) < 0.01, "{}", off(&ticked, &first));
    // Another vessel is refused.
    let other = YieldingSpec { span_mm: Some(5.0), ..spec.clone() };
    assert!(wire(&tree, Some(&other), 5000.0, wall(1.0, 0.1)).restore(&first.state()).is_err());
}

#[test]
fn a_very_stiff_course_gives_the_result_without_yielding() {
    let tree = winding((2.0, 120.0), 120.0, 1.5);
    let tip = |spec: Option<&YieldingSpec>| {
        let mut simulation = wire(&tree, spec, 50.0, wall(1.0, 0.0));
        for _ in 0..20 {
            simulation.step(Command::advance(5.0)).unwrap();
        }
        assert_eq!(simulation.displacement().is_some(), spec.is_some());
        simulation.shape().tip_mm().unwrap()
    };
    let still = tip(None);
    assert!((tip(Some(&made_of(1e6, 1e5))) - still).norm() < 1e-4);
    assert!((tip(Some(&made_of(1.0, 1e-4))) - still).norm() > 0.1);
}

#[test]
fn a_wire_lies_still_with_friction_in_an_artery_that_breathes_and_yields() {
    let tree = winding((2.0, 120.0), 240.0, 1.5);
    let spec = made_of(300.0, 0.005);
    let breath = MotionMode {
        waveform: Waveform::Breathing,
        period_s: Some(4.0),
        phase: 0.0,
        displacement_mm: [0.0, 1.5, 3.0],
        turn: None,
        still: None,
        within: Some(Around { centre_mm: [0.0, 0.0, 170.0], radius_mm: 20.0, fade_mm: 120.0 }),
    };
    let mut simulation = wire_in_moving(&tree, Some(&spec), 5000.0, wall(1.0, 0.1), &[breath]);
    for _ in 0..20 {
        simulation.step(Command::advance(8.0)).unwrap();
    }
    let mut tips = Vec::new();
    for k in 1..=24 {
        let report = simulation.step_until(&[], Some(0.5 * f64::from(k))).unwrap();
        assert!(report.converged, "{k}");
        tips.push(simulation.shape().tip_mm().unwrap());
    }
    // Friction lets it move with the breath, and back.
    for k in 8..16 {
        assert!((tips[k + 8] - tips[k]).norm() < 0.05, "{k}: {} {}", tips[k + 8], tips[k]);
    }
    let farthest = tips[8..16].iter().map(|tip| (tip - tips[8]).norm()).fold(0.0, f64::max);
    assert!(farthest > 0.2, "{farthest}");
}

//! Tips that touch a wall with friction: they stick, buckle and slide, for any step length.

use crate::Vec3;
use crate::device::{Device, Section};
use crate::insertion::{Command, Sheath, Simulation, WallProperties};
use crate::methods::StepReport;
use crate::methods::kirchhoff::KirchhoffOptions;
use crate::vessel::{
    CentrelineNode, CentrelineTree, GeneratedWall, Resolution, SurfaceMesh, SweptVessel, Wall,
};

/// A device in a straight tube along z, with a sheath at this place and direction.
fn in_tube(
    (radius_mm, edge_mm): (f64, f64),
    device: Device,
    (position_mm, direction): (Vec3, Vec3),
    (friction, modulus_n_per_mm2, element_mm): (f64, f64, f64),
) -> Simulation {
    let node = |i: usize| CentrelineNode {
        position_mm: Vec3::z() * (50.0 * i as f64),
        radius_mm,
        parent: i.checked_sub(1),
    };
    let tree = CentrelineTree::new((0..4).map(node).collect()).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(edge_mm)).unwrap();
    let sheath = Sheath { position_mm, direction, friction: 0.0, friction_n: 0.0, bends_towards: None };
    let properties = WallProperties { friction, modulus_n_per_mm2, ..WallProperties::default() };
    let method = KirchhoffOptions { element_mm, ..KirchhoffOptions::default() };
    Simulation::builder(made.wall, device, sheath).properties(properties).method(&method).build().unwrap()
}

/// A soft wire across a wide tube, on whose wall it will stand upright.
fn upright(friction: f64) -> Simulation {
    let wire = Device::uniform(100.0, 0.4, 0.2).unwrap();
    let sheath = (Vec3::new(-18.0, 0.0, 75.0), Vec3::x());
    let mut simulation = in_tube((20.0, 2.0), wire, sheath, (friction, 10.0, 2.0));
    go_on(&mut simulation, 37.0, 1.0);
    simulation
}

/// Pushes it in up to this length; returns the last report.
fn go_on(simulation: &mut Simulation, to_mm: f64, step_mm: f64) -> StepReport {
    while simulation.report().inserted_mm < to_mm - 1e-9 {
        let report = simulation.step(Command::advance(step_mm)).unwrap();
        assert!(report.converged);
    }
    simulation.report().clone()
}

fn lateral_mm(simulation: &Simulation) -> f64 {
    let tip = simulation.shape().tip_mm().unwrap();
    (tip - Vec3::new(tip.x, 0.0, 75.0)).norm()
}

#[test]
fn a_tip_that_first_touches_in_a_long_step_sticks_as_in_short_ones() {
    let [mut long, mut short] = [upright(0.3), upright(0.3)];
    let forces = [go_on(&mut long, 40.0, 1.0), go_on(&mut short, 40.0, 0.1)].map(|r| r.push_force_n);
    // The position where it sticks depends on the step by a millimetre or two, and with it the force by a few per
    // cent.
    assert!((forces[0] / forces[1] - 1.0).abs() < 0.07, "{forces:?}");
    // A column of 37.6 mm, clamped at one end and pinned at the other: 20.19 EI/L², and less the more it is bent.
    let euler_n = 20.19 * 0.2 / (37.6 * 37.6);
    assert!(forces[0] < euler_n && forces[0] > 0.7 * euler_n, "{forces:?} {euler_n}");
    assert!(
        lateral_mm(&long) < 3.0 && lateral_mm(&short) < 3.0,
        "{} {}",
        lateral_mm(&long),
        lateral_mm(&short)
    );
    // Counter-check: without friction it slides away.
    let mut free = upright(0.0);
    let slid = go_on(&mut free, 40.0, 1.0);
    assert!(lateral_mm(&free) > 8.0 && slid.push_force_n < 0.7 * forces[0]);
}

#[test]
fn a_column_buckles_in_a_step_that_presses_it_without_a_turn() {
    let wire = Device::uniform(100.0, 0.4, 5.0).unwrap();
    let sheath = (Vec3::new(0.0, 0.0, 75.0), Vec3::x());
    let mut simulation = in_tube((20.0, 2.0), wire, sheath, (0.3, 1.0, 1.0));
    // Pressed in by 1.4 mm it would carry 1.56 N, six times what buckles it.
    let report = go_on(&mut simulation, 21.0, 1.0);
    assert!(report.push_force_n < 20.19 * 5.0 / (20.0 * 20.0), "{}", report.push_force_n);
}

#[test]
fn a_hook_that_slides_takes_what_the_hand_gives() {
    let hook = Section { rest_curvature_per_mm: [0.0, 0.06], ..Section::straight(15.0, 0.3, 2.0) };
    let wire = Device::new(vec![hook, Section::straight(300.0, 0.3, 12.0)]).unwrap();
    let sheath = (Vec3::new(0.0, 0.0, 1.0), Vec3::z());
    let mut simulation = in_tube((4.0, 1.5), wire, sheath, (0.3, 1.0, 2.0));
    let mut before = go_on(&mut simulation, 16.0, 1.0);
    let (mut given, mut left, mut taken) = (0.0, 0.0, 0.0);
    while simulation.report().inserted_mm < 50.0 - 1e-9 {
        let report = simulation.step(Command::advance(0.5)).unwrap().clone();
        assert!(!report.jumped, "{}", report.inserted_mm);
        given += 0.25 * (before.push_force_n + report.push_force_n);
        left += report.energy.total() - before.energy.total();
        taken += report.dissipated_mj;
        // Coulomb's law: all of it slides along, with forces between those at both ends of the step.
        let rub =
            |report: &StepReport| report.contacts.iter().map(|c| 0.5 * c.friction_n.norm()).sum::<f64>();
        let [was_mj, is_mj] = [rub(&before), rub(&report)];
        let (least_mj, most_mj) = (0.98 * was_mj.min(is_mj), 1.02 * was_mj.max(is_mj));
        let taken_mj = report.dissipated_mj;
        assert!(
            (least_mj..=most_mj).contains(&taken_mj),
            "{}: {taken_mj} {was_mj} {is_mj}",
            report.inserted_mm
        );
        before = report;
    }
    assert!((given - left - taken).abs() < 1e-3 * taken, "{given} {left} {taken}");
}

/// A straight tube of radius 1 mm and 70 mm, from the open end at 0 to the closed one.
fn blind_tube() -> Wall {
    const AROUND: u32 = 32;
    let rings: Vec<(f64, f64)> = (0..=140)
        .map(|i| (0.5 * f64::from(i), 1.0))
        .chain((1..5).map(|i| (70.0, 1.0 - 0.2 * f64::from(i))))
        .collect();
    let mut mesh = SurfaceMesh::default();
    for (z, radius_mm) in &rings {
        let angles = (0..AROUND).map(|k| std::f64::consts::TAU * f64::from(k) / f64::from(AROUND));
        mesh.vertices_mm.extend(angles.map(|a| Vec3::new(radius_mm * a.cos(), radius_mm * a.sin(), *z)));
    }
    mesh.vertices_mm.push(Vec3::new(0.0, 0.0, 70.0));
    let last = rings.len() as u32 - 1;
    for k in 0..AROUND {
        let next = (k + 1) % AROUND;
        for i in 0..last {
            let [a, b] = [k, next].map(|k| i * AROUND + k);
            mesh.triangles.extend([[a, b, b + AROUND], [a, b + AROUND, a + AROUND]]);
        }
        mesh.triangles.push([last * AROUND + k, last * AROUND + next, (last + 1) * AROUND]);
    }
    Wall::from_surface(&mesh).unwrap()
}

/// A bent tip that is pushed through a straight tube keeps its shape: all that the hand gives is rubbed off, however long
/// elements are. Their curves change as nodes move on, and what slips does not.
#[test]
fn a_bent_tip_that_slides_along_takes_what_the_hand_gives() {
    for element_mm in [4.0, 2.0, 1.0] {
        let sheath = Sheath::new(Vec3::z(), Vec3::z()).unwrap();
        let properties = WallProperties { friction: 0.3, ..WallProperties::default() };
        let method = KirchhoffOptions { element_mm, ..KirchhoffOptions::default() };
        let tip = Section { rest_curvature_per_mm: [-0.03, 0.066], ..Section::straight(25.0, 0.32, 6.0) };
        let wire = Device::new(vec![tip, Section::straight(100.0, 0.32, 38.0)]).unwrap();
        let builder = Simulation::builder(blind_tube(), wire, sheath).properties(properties);
        let mut simulation = builder.method(&method).build().unwrap();
        let mut before = go_on(&mut simulation, 40.0, 1.0);
        let (mut given, mut left, mut taken) = (0.0, 0.0, 0.0);
        for _ in 0..60 {
            let report = simulation.step(Command::advance(0.2)).unwrap().clone();
            assert!(!report.jumped, "{}", report.inserted_mm);
            given += 0.1 * (before.push_force_n + report.push_force_n);
            left += report.energy.total() - before.energy.total();
            taken += report.dissipated_mj;
            before = report;
        }
        assert!((given - left - taken).abs() < 3e-3 * taken, "{element_mm}: {given} {left} {taken}");
    }
}

/// A wire pushed against a closed end winds up on the wall of its tube. A coil that grows turns the wire beyond it about
/// its axis, however little it is twisted, and its surface rubs on the wall.
#[test]
fn a_wire_that_winds_up_takes_what_the_hand_gives() {
    let sheath = Sheath {
        position_mm: Vec3::new(0.1, 0.0, 1.0),
        direction: Vec3::new(0.01, 0.02, 1.0).normalize(),
        friction: 0.0,
        friction_n: 0.0,
        bends_towards: None,
    };
    let properties = WallProperties { friction: 0.3, modulus_n_per_mm2: 50.0, ..WallProperties::default() };
    let method = KirchhoffOptions { element_mm: 1.0, ..KirchhoffOptions::default() };
    // Its soft tail would let it snap.
    let wire = Device::uniform(72.0, 0.5, 0.5).unwrap();
    let builder = Simulation::builder(blind_tube(), wire, sheath).properties(properties);
    let mut simulation = builder.method(&method).build().unwrap();
    let mut before = go_on(&mut simulation, 68.0, 2.0);
    let (mut given, mut left, mut taken, mut jumps) = (0.0, 0.0, 0.0, 0);
    while simulation.report().inserted_mm < 72.0 - 1e-9 {
        let report = simulation.step(Command::advance(0.1)).unwrap().clone();
        // Across a jump the force is not between those at its ends.
        if report.jumped {
            jumps += 1;
        } else {
            given += 0.05 * (before.push_force_n + report.push_force_n);
            left += report.energy.total() - before.energy.total();
            taken += report.dissipated_mj;
        }
        before = report;
    }
    assert!(jumps <= 2, "{jumps}");
    // It lies on the wall on all sides.
    let across = |axis: usize| {
        let each = simulation.shape().positions_mm.iter().map(|x| x[axis]);
        each.fold((0.0f64, 0.0f64), |(least, most), x| (least.min(x), most.max(x)))
    };
    assert!(
        [0, 1].iter().all(|axis| across(*axis).0 < -0.4 && across(*axis).1 > 0.4),
        "{:?}",
        [across(0), across(1)]
    );
    // The force in steps of 0.1 mm; without the turn half as much as friction takes would be missing.
    assert!((given - left - taken).abs() < 0.1 * taken, "{given} {left} {taken}");
}

#[test]
fn a_throat_is_passed_without_a_jump() {
    // The lumen narrows from 3 mm to 0.8 mm and widens again; without friction the push has no instability.
    let node = |i: usize| CentrelineNode {
        position_mm: Vec3::z() * i as f64,
        radius_mm: 3.0 - 2.2 * (-((i as f64 - 30.0) / 4.0).powi(2)).exp(),
        parent: i.checked_sub(1),
    };
    let tree = CentrelineTree::new((0..61).map(node).collect()).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(0.6)).unwrap();
    let passed = |step_mm: f64| {
        let sheath = Sheath::new(Vec3::zeros(), Vec3::z()).unwrap();
        let device = Device::uniform(100.0, 1.2, 50.0).unwrap();
        let method = KirchhoffOptions { element_mm: 2.0, ..KirchhoffOptions::default() };
        let builder = Simulation::builder(made.wall.clone(), device, sheath);
        let mut simulation = builder.method(&method).build().unwrap();
        let (mut largest_mj, mut jumps) = (0.0f64, 0);
        for _ in 0..(54.0 / step_mm) as usize {
            let report = simulation.step(Command::advance(step_mm)).unwrap();
            assert!(report.converged, "{step_mm}");
            largest_mj = largest_mj.max(report.energy.total());
            jumps += usize::from(report.jumped);
        }
        (largest_mj, jumps)
    };
    for step_mm in [2.0, 1.0] {
        let (largest_mj, jumps) = passed(step_mm);
        assert!(largest_mj > 0.01, "{largest_mj}");
        assert_eq!(jumps, 0, "{step_mm}");
    }
}

/// A straight wire of radius 0.4 mm without friction, from a mouth at `from_mm` through a throat of radius 0.3 mm from
/// 11 to 12 mm along its axis.
fn in_throat(from_mm: f64, element_mm: f64) -> Simulation {
    let rows = [(0.0, 1.0), (8.0, 1.0), (11.0, 0.3), (12.0, 0.3), (15.0, 1.0), (60.0, 1.0)];
    let node = |(row, (z, radius_mm)): (usize, &(f64, f64))| CentrelineNode {
        position_mm: Vec3::z() * *z,
        radius_mm: *radius_mm,
        parent: row.checked_sub(1),
    };
    let tree = CentrelineTree::new(rows.iter().enumerate().map(node).collect()).unwrap();
    let vessel = SweptVessel::new(tree, Resolution::EdgeMm(0.2)).unwrap();
    let sheath = Sheath::new(Vec3::z() * from_mm, Vec3::z()).unwrap();
    let wire = Device::uniform(100.0, 0.4, 2.0).unwrap();
    let method = KirchhoffOptions { element_mm, ..KirchhoffOptions::default() };
    let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
    let builder = Simulation::builder(vessel, wire, sheath).properties(properties);
    builder.method(&method).build().unwrap()
}

/// A narrow place near the sheath's mouth, where elements grow: what the hand gives is what is stored, and a wire that
/// is already through feels nothing on average. Where the mouth itself is in it, the part that comes in presses.
#[test]
fn what_comes_in_at_a_narrow_mouth_stores_what_the_hand_gives() {
    const STEP_MM: f64 = 0.04;
    for (from_mm, element_mm) in [(9.5, 4.0), (9.5, 1.0), (10.9, 4.0), (3.0, 4.0)] {
        let mut simulation = in_throat(from_mm, element_mm);
        // The tip, whose points are close together, has come in.
        let mut before = go_on(&mut simulation, 1.0, STEP_MM);
        let (first_mj, mut given_mj, mut most_mj) = (before.energy.wall, 0.0, 0.0f64);
        let (mut through_mj, mut was_mj) = (0.0, 0.0);
        while before.inserted_mm < 20.0 - 1e-9 {
            let report = simulation.step(Command::advance(STEP_MM)).unwrap().clone();
            let work_mj = 0.5 * STEP_MM * (before.push_force_n + report.push_force_n);
            given_mj += work_mj;
            most_mj = most_mj.max(report.energy.wall);
            if before.inserted_mm < 13.0 - 1e-9 {
                was_mj = report.energy.wall;
            } else {
                through_mj += work_mj;
            }
            before = report;
        }
        let stored_mj = before.energy.wall - first_mj;
        let reported = format!("{from_mm}, {element_mm}: {given_mj} {stored_mj} {most_mj}, {through_mj}");
        assert!(most_mj > 1e-3 && (given_mj - stored_mj).abs() < 0.02 * most_mj, "{reported}");
        assert!((through_mj + was_mj - before.energy.wall).abs() < 0.01 * most_mj, "{reported}");
    }
}

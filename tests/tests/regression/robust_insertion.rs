//! The insertion where it is hard: other meshes, large and small increments, tips that are stopped, thousands of commands.
//!
//! Every step is checked: the device's curve passes through no triangle, the step converged, and a command that failed left
//! everything as before. The long tables are ignored by default:
//! `cargo test --release -p endowire-tests --test regression robust_insertion:: -- --ignored --nocapture --test-threads 1`.

#![allow(clippy::print_stdout, reason = "tables are printed")]

use std::path::Path;

use endowire_core::Vec3;
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::scene::Scene;
use endowire_core::vessel::{
    CentrelineNode, CentrelineTree, GeneratedWall, NoStore, Resolution, SurfaceMesh, Wall, anatomy,
};
use endowire_lab::insertion_stress::InsertionStress;
use endowire_tests::crossing::CrossingTest;
use endowire_tests::noise::Noise;
use endowire_tests::sweep::Tally;

use super::arrival::{asset, run_scene, scene};

/// Resident memory of this process, MiB; none where the system does not tell.
fn resident_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// Random commands in the arch: pushes and pulls of up to 5 mm, turns of up to half a radian, alone and together.
fn wander(count: usize) -> Tally {
    let mut scene = Scene::read(&asset("scenes/arch_carotid.toml")).unwrap();
    scene.vessel.triangles = Some(20_000);
    let mut simulation = scene.simulation(&NoStore).unwrap();
    let crossing = CrossingTest::new(simulation.lumen().wall(&NoStore).unwrap().mesh());
    let mut noise = Noise(1);
    let mut tally = Tally::default();
    let clock = std::time::Instant::now();
    let mut early_mib = None;
    // Most of the time a hand pushes until it has arrived somewhere, then pulls back.
    let mut way = 1.0;
    for number in 0..count {
        let inserted = simulation.report().inserted_mm;
        if number % 500 == 499 {
            way = -way;
        }
        let drift = 0.3 * way;
        let mm = (5.0 * (noise.next() + drift)).clamp(-inserted, 500.0 - inserted);
        let command = match (noise.next() * 1.5).round() as i32 {
            -1 => Command::advance(mm),
            0 => Command { advance_mm: mm, rotate_rad: 0.5 * noise.next(), ..Command::default() },
            _ => Command::rotate(0.5 * noise.next()),
        };
        tally.step(&mut simulation, &crossing, command);
        if number == count / 10 {
            early_mib = resident_mib();
        }
        if number % 5_000 == 4_999 {
            let inside: f64 = tally.seconds.iter().sum();
            println!(
                "{:>6} commands in {:.0} s, {inside:.0} s of them in steps, {:?} MiB: {tally}",
                number + 1,
                clock.elapsed().as_secs_f64(),
                resident_mib()
            );
        }
    }
    let time: f64 = tally.seconds.iter().sum();
    println!(
        "{count} commands: {:.0} a second, {:?} MiB after a tenth, {:?} MiB at the end",
        count as f64 / time,
        early_mib,
        resident_mib()
    );
    let mut reasons: Vec<(String, usize)> = Vec::new();
    for (_, reason) in &tally.failures {
        // Without its numbers.
        let kind: String = reason.chars().filter(|c| !c.is_ascii_digit()).collect();
        match reasons.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, count)) => *count += 1,
            None => reasons.push((kind, 1)),
        }
    }
    reasons.iter().for_each(|(reason, count)| println!("{count} × {reason}"));
    tally
}

#[test]
fn random_commands_leave_the_vessel_and_the_rod_sound() {
    let tally = wander(400);
    // A solver that refuses every command would be safe. Some lead out of the vessel.
    assert!(tally.is_safe() && tally.steps >= 350, "{tally}");
}

#[test]
#[ignore = "minutes"]
fn a_hundred_thousand_random_commands() {
    let tally = wander(100_000);
    assert!(tally.is_safe() && tally.steps >= 87_500, "{tally}");
}

#[test]
fn the_bookkeeping_can_fail() {
    let mut tally = Tally::default();
    let mut scene = scene("curved_tube_exact", 5_000);
    let crossing = CrossingTest::new(scene.1.mesh());
    let (mut simulation, _) = run_scene(&mut scene, &crossing, 5.0);
    assert!(!tally.step(&mut simulation, &crossing, Command::advance(1e4)));
    assert!(tally.is_safe() && !tally.is_clean());
    // A wall right across the tube is crossed.
    let mut across = simulation.lumen().wall(&NoStore).unwrap().mesh().clone();
    let first = across.vertices_mm.len() as u32;
    across.vertices_mm.extend([[-9.0, -9.0], [9.0, -9.0], [0.0, 18.0]].map(|[x, y]| Vec3::new(x, y, 50.0)));
    across.triangles.push([first, first + 1, first + 2]);
    assert!(tally.step(&mut simulation, &CrossingTest::new(&across), Command::retract(0.5)));
    assert!(!tally.is_safe());
}

fn tube(axis: &[Vec3], radius_mm: impl Fn(usize) -> f64, resolution: Resolution) -> (Wall, usize) {
    let nodes = axis.iter().enumerate().map(|(i, x)| CentrelineNode {
        position_mm: *x,
        radius_mm: radius_mm(i),
        parent: i.checked_sub(1),
    });
    let made = GeneratedWall::new(&CentrelineTree::new(nodes.collect()).unwrap(), resolution).unwrap();
    (made.wall, made.inlet)
}

fn start(wall: Wall, sheath: Sheath, device: Device) -> (Simulation, CrossingTest) {
    let crossing = CrossingTest::new(wall.mesh());
    let method = KirchhoffOptions::default();
    let simulation = Simulation::builder(wall, device, sheath).method(&method).build().unwrap();
    (simulation, crossing)
}

/// Pushes in steps until the length is in or a command fails, then pulls all back out: that must always work.
fn in_and_out(simulation: &mut Simulation, crossing: &CrossingTest, length_mm: f64, step_mm: f64) -> Tally {
    let mut tally = Tally::default();
    let count = (length_mm / step_mm).round() as usize;
    tally.drive(simulation, crossing, &vec![Command::advance(step_mm); count]);
    let failed = tally.failures.len();
    while simulation.report().inserted_mm > 0.0 {
        let back = simulation.report().inserted_mm.min(5.0);
        assert!(tally.step(simulation, crossing, Command::retract(back)), "pulling back: {tally}");
    }
    assert!(tally.is_safe() && failed <= 1, "{tally}");
    // And in again.
    assert!(tally.step(simulation, crossing, Command::advance(1.0)), "{tally}");
    tally
}

fn straight(length_mm: f64) -> Vec<Vec3> {
    (0..=(length_mm / 2.0) as usize).map(|i| Vec3::z() * (2.0 * i as f64)).collect()
}

fn wire() -> Device {
    Device::uniform(300.0, 0.445, 10.0).unwrap()
}

#[test]
fn a_tip_pushed_straight_into_a_wall_turns_or_stops_with_a_reason() {
    let (wall, _) = tube(&straight(60.0), |_| 6.0, Resolution::EdgeMm(1.0));
    for slant in [0.0, 0.01, 0.3] {
        let sheath = Sheath::new(Vec3::new(0.0, 0.0, 30.0), Vec3::new(1.0, 0.0, slant)).unwrap();
        let (mut simulation, crossing) = start(wall.clone(), sheath, wire());
        let tally = in_and_out(&mut simulation, &crossing, 30.0, 1.0);
        println!("slant {slant}: {tally}");
    }
}

/// The wall is compliant and what touches it is the device's surface: a device squeezes into a tube somewhat narrower than
/// itself. It does not where its own curve would have to leave the tube.
#[test]
fn a_tube_narrower_than_the_device_crosses_no_wall_and_lets_it_back_out() {
    let axis = straight(60.0);
    for (narrow_mm, step_mm) in [(0.1, 1.0), (0.25, 1.0), (0.4, 1.0), (0.4, 5.0), (0.6, 5.0)] {
        let narrow = |i: usize| if i < 15 { 4.0 } else { (4.0 - 0.6 * (i - 14) as f64).max(narrow_mm) };
        let (wall, inlet) = tube(&axis, narrow, Resolution::EdgeMm(0.5));
        let sheath = Sheath::at_opening(&wall, inlet, 1.0).unwrap();
        let (mut simulation, crossing) = start(wall, sheath, wire());
        let tally = in_and_out(&mut simulation, &crossing, 55.0, step_mm);
        println!("radius {narrow_mm} mm, steps of {step_mm} mm: {tally}");
        // If it does not squeeze in, the reason is the room.
        assert!(tally.failures.iter().all(|(_, reason)| reason.starts_with("blocked at")), "{tally}");
    }
}

#[test]
fn sharp_bends_are_passed_on_coarse_fine_noisy_and_dirty_meshes() {
    // 40 mm straight, a half circle of radius 10 mm, straight again; bore 3 mm.
    let mut axis: Vec<Vec3> = (0..20).map(|i| Vec3::new(0.0, 0.0, 2.0 * f64::from(i))).collect();
    axis.extend((0..=18).map(|i| {
        let angle = f64::from(i) * 10.0f64.to_radians();
        Vec3::new(10.0 - 10.0 * angle.cos(), 0.0, 40.0 + 10.0 * angle.sin())
    }));
    axis.extend((1..10).map(|i| Vec3::new(20.0, 0.0, 40.0 - 2.0 * f64::from(i))));
    // 20 triangles around are 10 edges around.
    for (name, edge_mm) in [("coarse", 1.9), ("middle", 0.8), ("fine", 0.35)] {
        let (clean, inlet) = tube(&axis, |_| 3.0, Resolution::EdgeMm(edge_mm));
        let sheath = Sheath::at_opening(&clean, inlet, 1.0).unwrap();
        for dirt in ["clean", "noisy", "dirty"] {
            let mut surface = clean.mesh().clone();
            let mut noise = Noise(7);
            if dirt == "noisy" {
                let size = 0.1 * edge_mm.min(1.0);
                for v in &mut surface.vertices_mm {
                    *v += Vec3::new(noise.next(), noise.next(), noise.next()) * size;
                }
            }
            if dirt == "dirty" {
                let twice: Vec<[u32; 3]> = surface.triangles.iter().step_by(7).copied().collect();
                surface.triangles.extend(twice);
                let lines: Vec<[u32; 3]> =
                    surface.triangles.iter().step_by(11).map(|t| [t[0], t[1], t[1]]).collect();
                surface.triangles.extend(lines);
            }
            let wall = Wall::from_surface(&surface).unwrap();
            let (mut simulation, crossing) = start(wall, sheath, wire());
            let tally = in_and_out(&mut simulation, &crossing, 90.0, 1.0);
            println!("{name} {dirt}: {tally}");
            assert!(tally.failures.is_empty(), "{name} {dirt}: {tally}");
        }
    }
}

#[test]
fn a_sheath_that_touches_the_wall_lets_the_device_in() {
    let (wall, _) = tube(&straight(60.0), |_| 4.0, Resolution::EdgeMm(1.0));
    for lateral_mm in [3.5, 3.54] {
        let sheath = Sheath::new(Vec3::new(lateral_mm, 0.0, 5.0), Vec3::new(0.1, 0.0, 1.0)).unwrap();
        let (mut simulation, crossing) = start(wall.clone(), sheath, wire());
        let tally = in_and_out(&mut simulation, &crossing, 50.0, 1.0);
        println!("{lateral_mm} mm aside: {tally}");
        assert!(tally.failures.is_empty(), "{tally}");
    }
}

#[test]
fn leaving_through_an_opening_is_reported_and_ends_with_a_reason_at_any_increment() {
    for step_mm in [1.0, 5.0, 40.0] {
        let (wall, inlet) = tube(&straight(60.0), |_| 4.0, Resolution::EdgeMm(1.0));
        let sheath = Sheath::at_opening(&wall, inlet, 1.0).unwrap();
        let outlet = 1 - inlet;
        let (mut simulation, crossing) = start(wall, sheath, wire());
        let mut tally = Tally::default();
        tally.drive(&mut simulation, &crossing, &vec![Command::advance(step_mm); (200.0 / step_mm) as usize]);
        let reason = &tally.failures.first().unwrap().1;
        assert!(reason.contains(&format!("left the vessel through opening {outlet}")), "{reason}");
        let tip = simulation.shape().tip_mm().unwrap();
        assert!(tip.z < 90.5, "{tip}");
        if step_mm < 40.0 {
            assert_eq!(simulation.report().left_through, Some(outlet));
            assert!(tip.z > 60.0);
        }
        assert!(tally.is_safe() && tally.step(&mut simulation, &crossing, Command::retract(10.0)), "{tally}");
    }
}

#[test]
fn a_tip_on_a_carina_takes_a_side_or_stops_with_a_reason() {
    let arch = GeneratedWall::new(&anatomy::tree("hepatic").unwrap(), Resolution::Triangles(10_000)).unwrap();
    // From the coeliac trunk straight at the edge between its two branches.
    let sheath = Sheath::new(Vec3::new(-0.5, -14.0, 58.0), Vec3::new(-0.03, -1.0, 0.02)).unwrap();
    for (advance, bend) in [(1.0, 0.0), (4.0, 0.0), (1.0, 0.03)] {
        let tip = Section { rest_curvature_per_mm: [bend, 0.0], ..Section::straight(15.0, 0.3, 5.0) };
        let device = Device::new(vec![tip, Section::straight(200.0, 0.3, 15.0)]).unwrap();
        let (mut simulation, crossing) = start(arch.wall.clone(), sheath, device);
        let tally = in_and_out(&mut simulation, &crossing, 60.0, advance);
        println!("{advance} mm, tip of {bend}/mm: {tally}");
    }
}

/// A segmented surface as it came: folded in spots, edges of several radii in tight bends. `ENDOWIRE_SURFACES` is a folder with carotids.stl.
#[test]
#[ignore = "needs a surface that is not part of the project"]
fn a_real_carotid_is_passed() {
    let folder = std::env::var_os("ENDOWIRE_SURFACES").unwrap();
    let surface = SurfaceMesh::read(&Path::new(&folder).join("carotids.stl"), 1.0).unwrap();
    let wall = Wall::from_surface(&surface).unwrap();
    for (step_mm, radius_mm) in [(1.0, 0.3), (5.0, 0.3), (1.0, 0.445)] {
        let sheath = Sheath::at_opening(&wall, 0, 1.0).unwrap();
        let device = Device::uniform(300.0, radius_mm, 10.0).unwrap();
        let (mut simulation, crossing) = start(wall.clone(), sheath, device);
        let tally = in_and_out(&mut simulation, &crossing, 100.0, step_mm);
        println!("radius {radius_mm} mm, steps of {step_mm} mm: {tally}");
        assert!(tally.failures.is_empty(), "{tally}");
    }
}

/// The table of `endowire verify --stress`, row by row as it comes, with the time of each.
#[test]
#[ignore = "minutes"]
fn table_of_the_stress() {
    let stress = InsertionStress::new().unwrap();
    let (mut converged, mut stopped, mut bad) = (0, 0, Vec::new());
    let clock = std::time::Instant::now();
    for case in stress.cases() {
        let from = clock.elapsed().as_secs_f64();
        let row = stress.run(&case);
        println!("{:>7.2} s {row:?}", clock.elapsed().as_secs_f64() - from);
        match (row.pass, row.converged) {
            (true, true) => converged += 1,
            (true, false) => stopped += 1,
            (false, _) => bad.push(format!("{row:?}")),
        }
    }
    println!(
        "{converged} converged, {stopped} stopped with a reason, {} neither, in {:.0} s",
        bad.len(),
        clock.elapsed().as_secs_f64()
    );
    assert!(bad.is_empty(), "{}", bad.join("\n"));
}

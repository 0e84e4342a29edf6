//! The state of an insertion: what is saved goes on as if nothing had been, a command that fails leaves it as it was, and clones share
//! their vessel and nothing else. All of it to the bit.

use std::time::Instant;

use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, State, WallProperties, WallRegion};
use endowire_core::methods::MethodChoice;
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, anatomy};
use endowire_core::{Error, Vec3};
use endowire_methods::AnyMethod;
use endowire_methods::li2011::Li2011Options;
use endowire_tests::noise::Noise;

fn bytes(simulation: &Simulation) -> Vec<u8> {
    postcard::to_allocvec(&simulation.state()).unwrap()
}

fn state(bytes: &[u8]) -> State {
    postcard::from_bytes(bytes).unwrap()
}

fn kirchhoff() -> KirchhoffOptions {
    KirchhoffOptions { element_mm: 4.0, ..KirchhoffOptions::default() }
}

fn wire(curvature_per_mm: f64) -> Device {
    let tip =
        Section { rest_curvature_per_mm: [curvature_per_mm, 0.0], ..Section::straight(20.0, 0.445, 5.0) };
    Device::new(vec![tip, Section::straight(380.0, 0.445, 10.0)]).unwrap()
}

fn start(vessel: &str, properties: WallProperties, device: Device, method: &dyn MethodChoice) -> Simulation {
    start_at(2.0, vessel, properties, device, method)
}

fn start_at(
    depth_mm: f64,
    vessel: &str,
    properties: WallProperties,
    device: Device,
    method: &dyn MethodChoice,
) -> Simulation {
    let made = GeneratedWall::new(&anatomy::tree(vessel).unwrap(), Resolution::Triangles(5_000)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, depth_mm).unwrap();
    Simulation::builder(made.wall, device, sheath).properties(properties).method(method).build().unwrap()
}

fn with_friction() -> WallProperties {
    WallProperties { friction: 0.15, ..WallProperties::default() }
}

fn patched() -> WallProperties {
    let region = WallRegion {
        centre_mm: Some([41.0, 0.0, 146.0]),
        radius_mm: Some(12.0),
        modulus_n_per_mm2: Some(50.0),
        ..WallRegion::default()
    };
    WallProperties { region: vec![region], ..WallProperties::default() }
}

/// Commands of a hand that pushes on the whole, now and then pulls, turns or rests, and often repeats itself.
fn commands(seed: u64, count: usize) -> Vec<Command> {
    let mut noise = Noise::new(seed);
    let mut last = Command::advance(1.0);
    (0..count)
        .map(|_| {
            if noise.happens(0.6) {
                return last;
            }
            let advance_mm = if noise.happens(0.2) { 0.0 } else { 0.6 + 0.9 * noise.next() };
            let rotate_rad = if noise.happens(0.5) { 0.15 * noise.next() } else { 0.0 };
            last = Command { advance_mm, rotate_rad, ..Command::default() };
            last
        })
        .collect()
}

/// Every step of a run is taken once more from its state as it was written before, by a simulation that knows nothing else.
fn every_step_can_be_taken_again(mut simulation: Simulation, from_mm: f64, seed: u64) {
    let mut again = simulation.clone();
    for _ in 0..(from_mm / 2.0) as usize {
        simulation.step(Command::advance(2.0)).unwrap();
    }
    let (mut iterations, mut changed) = (0, 0);
    for (k, command) in commands(seed, 200).into_iter().enumerate() {
        let before = bytes(&simulation);
        again.restore(&state(&before)).unwrap();
        assert!(bytes(&again) == before, "step {k}: another state");
        assert_eq!((again.shape(), again.report()), (simulation.shape(), simulation.report()), "step {k}");
        if k % 5 == 0 {
            again.drop_workspace();
        }
        assert_eq!(simulation.step(command).is_ok(), again.step(command).is_ok(), "step {k}");
        assert!(bytes(&again) == bytes(&simulation), "step {k}: another result");
        assert_eq!(again.shape(), simulation.shape(), "step {k}");
        changed += usize::from(bytes(&simulation) != before);
        iterations += simulation.report().iterations;
    }
    assert!(iterations >= 100 && changed >= 100, "{iterations} {changed}");
}

#[test]
fn steps_with_friction_and_a_shaped_tip_can_be_taken_again() {
    every_step_can_be_taken_again(start("curved_tube", with_friction(), wire(0.03), &kirchhoff()), 120.0, 1);
}

#[test]
fn steps_over_regions_can_be_taken_again() {
    every_step_can_be_taken_again(start("curved_tube", patched(), wire(0.0), &kirchhoff()), 120.0, 2);
}

#[test]
fn steps_of_a_shaped_tip_can_be_taken_again() {
    let smooth = WallProperties::default();
    every_step_can_be_taken_again(start("aortic_arch", smooth, wire(0.05), &kirchhoff()), 120.0, 3);
}

#[test]
fn steps_of_the_papers_method_can_be_taken_again() {
    let options = Li2011Options { element_mm: 8.0, ..Li2011Options::default() };
    for method in [AnyMethod::Li2011Dense(options), AnyMethod::Li2011Banded(options)] {
        let simulation = start("curved_tube", WallProperties::default(), wire(0.0), &method);
        let mut again = simulation.clone();
        again.restore(&simulation.state()).unwrap();
        let mut simulation = simulation;
        for (k, command) in commands(4, 150).into_iter().enumerate() {
            again.restore(&state(&bytes(&simulation))).unwrap();
            assert_eq!(simulation.step(command).is_ok(), again.step(command).is_ok(), "step {k}");
            assert!(bytes(&again) == bytes(&simulation) && again.shape() == simulation.shape(), "step {k}");
        }
    }
}

#[test]
fn every_field_of_a_state_is_needed() {
    let mut simulation = start("curved_tube", with_friction(), wire(0.03), &kirchhoff());
    (0..60).for_each(|_| simulation.step(Command::advance(2.0)).map(|_| ()).unwrap());
    let text = serde_json::to_string(&simulation.state()).unwrap();
    let after = |text: &str| {
        let mut again = simulation.clone();
        again.restore(&serde_json::from_str(text).unwrap()).unwrap();
        again.step(Command { advance_mm: 2.0, rotate_rad: 0.0, ..Command::default() }).unwrap();
        bytes(&again)
    };
    let whole = after(&text);
    // JSON keeps every bit as well.
    assert!(whole == after(&serde_json::to_string(&serde_json::from_str::<State>(&text).unwrap()).unwrap()));
    // Without what was learnt, without the forces of friction, or with the wall elsewhere the next step is another.
    for key in ["departures", "force_n", "base_free_mm", "angles"] {
        let mut spoilt: serde_json::Value = serde_json::from_str(&text).unwrap();
        spoil(&mut spoilt, key);
        assert!(after(&spoilt.to_string()) != whole, "{key}");
    }
}

/// Changes every number under a key, or empties a list.
fn spoil(value: &mut serde_json::Value, key: &str) {
    match value {
        serde_json::Value::Object(map) => {
            for (name, inner) in map {
                match inner {
                    serde_json::Value::Number(number) if name == key => {
                        *inner = (0.5 * number.as_f64().unwrap() - 0.1).into();
                    }
                    serde_json::Value::Array(list)
                        if key == "departures"
                            && ["departures", "turns", "mouth"].contains(&name.as_str()) =>
                    {
                        list.clear();
                    }
                    serde_json::Value::Array(list) if name == key => {
                        list.iter_mut().for_each(|x| *x = (x.as_f64().unwrap() + 0.1).into());
                    }
                    _ => spoil(inner, key),
                }
            }
        }
        serde_json::Value::Array(list) => list.iter_mut().for_each(|inner| spoil(inner, key)),
        _ => {}
    }
}

#[test]
fn a_device_that_is_pulled_out_whole_leaves_no_trace() {
    let mut used = start("curved_tube", with_friction(), wire(0.03), &kirchhoff());
    let mut fresh = used.clone();
    for mm in [2.0, 2.0, 1.0, -1.0, -2.0, -2.0] {
        used.step(Command::advance(mm)).unwrap();
    }
    for k in 0..20 {
        used.step(Command::advance(2.0)).unwrap();
        fresh.step(Command::advance(2.0)).unwrap();
        assert_eq!(used.shape(), fresh.shape(), "step {k}");
    }
}

/// A bent tube that becomes narrower than the device, or stays wide and ends.
fn tube(narrow: bool, max_iterations: usize) -> Simulation {
    // In a wider funnel the wire buckles and folds behind its tip, and every command is followed.
    let radius = |i: f64| if narrow { (0.55 - 0.1 * (i - 14.0).max(0.0)).max(0.15) } else { 2.0 };
    let nodes = (0..30).map(|i| CentrelineNode {
        position_mm: Vec3::new(
            20.0 - 20.0 * (f64::from(i) / 20.0).cos(),
            0.0,
            20.0 * (f64::from(i) / 20.0).sin(),
        ),
        radius_mm: radius(f64::from(i)),
        parent: usize::try_from(i - 1).ok(),
    });
    let tree = CentrelineTree::new(nodes.collect()).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(if narrow { 0.35 } else { 0.7 })).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let tip = Section { rest_curvature_per_mm: [0.02, 0.0], ..Section::straight(8.0, 0.4, 6.0) };
    let device = Device::new(vec![tip, Section::straight(72.0, 0.4, 10.0)]).unwrap();
    let method = KirchhoffOptions { max_iterations, ..KirchhoffOptions::default() };
    let properties = WallProperties { modulus_n_per_mm2: 1e4, friction: 0.2, ..WallProperties::default() };
    Simulation::builder(made.wall, device, sheath).properties(properties).method(&method).build().unwrap()
}

/// Commands of which many cannot be followed, and the state after every one that could not. Returns how many failed, by their reason.
fn failures_change_nothing(mut simulation: Simulation, seed: u64, count: usize) -> [usize; 3] {
    let mut noise = Noise::new(seed);
    let mut failures = [0; 3];
    for k in 0..count {
        let mut command = Command {
            advance_mm: 0.4 + 1.2 * noise.next(),
            rotate_rad: 0.2 * noise.next(),
            ..Command::default()
        };
        match noise.below(12) {
            0 => command.advance_mm = 500.0,
            1 => command.rotate_rad = f64::NAN,
            2 => command.advance_mm = 6.0,
            _ => {}
        }
        let before = (bytes(&simulation), simulation.shape().clone());
        match simulation.step(command) {
            Ok(_) => continue,
            Err(Error::End(_)) => failures[0] += 1,
            Err(Error::Parameter { .. }) => failures[1] += 1,
            Err(_) => failures[2] += 1,
        }
        assert!(bytes(&simulation) == before.0, "command {k}, {command:?}");
        assert!(simulation.shape() == &before.1, "command {k}, {command:?}");
    }
    failures
}

#[test]
fn a_command_that_fails_leaves_the_state_to_the_byte() {
    let blocked = failures_change_nothing(tube(true, 500), 5, 56);
    let left = failures_change_nothing(tube(false, 500), 6, 300);
    let hurried = failures_change_nothing(tube(false, 1), 7, 80);
    println!("{blocked:?} {left:?} {hurried:?}");
    // How often a wedged wire is blocked, or finds no equilibrium, hangs on roundings of the wall.
    assert!(blocked[0] + blocked[2] > 1 && left[0] > 50 && left[1] > 50, "{blocked:?} {left:?} {hurried:?}");
}

#[test]
fn where_a_way_is_blocked_is_reported_whatever_was_tried_before() {
    let mut simulation = tube(true, 500);
    let mut last = simulation.clone();
    let said = loop {
        last.restore(&simulation.state()).unwrap();
        match simulation.step(Command::advance(1.0)) {
            Ok(_) => {}
            Err(error) => break error.to_string(),
        }
    };
    assert!(said.contains("blocked at") && simulation.report().inserted_mm > 15.0, "{said}");
    // A clone has tried nothing, and `last` was elsewhere before.
    for mut other in [simulation.clone(), last, simulation] {
        for _ in 0..2 {
            assert_eq!(other.step(Command::advance(1.0)).unwrap_err().to_string(), said);
        }
    }
}

#[test]
#[ignore = "minutes: ten thousand commands"]
fn ten_thousand_commands_that_fail_or_not_leave_the_state_to_the_byte() {
    let mut sum = [0; 3];
    for (narrow, most, count) in [(true, 500, 1_500), (false, 500, 7_000), (false, 1, 1_500)] {
        let failures = failures_change_nothing(tube(narrow, most), 8, count);
        println!("{count} commands: {failures:?} ended, impossible, without equilibrium");
        sum.iter_mut().zip(failures).for_each(|(a, b)| *a += b);
    }
    assert!(sum.iter().sum::<usize>() > 3_000, "{sum:?}");
}

#[test]
fn what_follows_a_failure_is_what_follows_without_it() {
    let mut with = tube(false, 500);
    while with.step(Command::advance(1.0)).is_ok() {}
    with.step(Command::advance(-35.0)).unwrap();
    let mut without = with.clone();
    let mut failures = 0;
    for (k, command) in commands(9, 15).into_iter().enumerate() {
        match with.step(Command::advance(40.0)) {
            Ok(_) => with.restore(&without.state()).unwrap(),
            Err(_) => failures += 1,
        }
        let command = Command { advance_mm: 0.5 * command.advance_mm - 0.3, ..command };
        assert_eq!(with.step(command).is_ok(), without.step(command).is_ok(), "{k}");
        assert!(with.shape() == without.shape() && bytes(&with) == bytes(&without), "{k}");
    }
    assert!(failures > 4, "{failures}");
}

#[test]
fn a_state_of_another_scene_is_refused_and_changes_nothing() {
    let smooth = WallProperties::default;
    let banded = AnyMethod::Li2011Banded(Li2011Options { element_mm: 8.0, ..Li2011Options::default() });
    let finer = KirchhoffOptions { element_mm: 3.0, ..KirchhoffOptions::default() };
    let mut there = start("curved_tube", smooth(), wire(0.0), &kirchhoff());
    (0..20).for_each(|_| there.step(Command::advance(2.0)).map(|_| ()).unwrap());
    let saved = there.state();
    let short = Device::uniform(30.0, 0.445, 10.0).unwrap();
    for (name, mut here) in [
        ("state.method", start("curved_tube", smooth(), wire(0.0), &banded)),
        ("state.elements", start("curved_tube", smooth(), wire(0.0), &finer)),
        ("state.scene", start("curved_tube", with_friction(), wire(0.0), &kirchhoff())),
        ("state.scene", start("curved_tube", smooth(), short, &kirchhoff())),
        ("state.scene", start_at(3.0, "curved_tube", smooth(), wire(0.0), &kirchhoff())),
    ] {
        let before = bytes(&here);
        match here.restore(&saved) {
            Err(Error::Parameter { name: reported, remedy, .. }) => {
                assert!(
                    reported == name && remedy.contains("restore a state of"),
                    "{name}: {reported}: {remedy}"
                );
            }
            other => panic!("{name}: {other:?}"),
        }
        assert!(bytes(&here) == before, "{name}");
    }
    start("curved_tube", smooth(), wire(0.0), &kirchhoff()).restore(&saved).unwrap();
}

#[test]
fn a_state_with_numbers_out_of_place_is_refused() {
    let mut simulation = start("curved_tube", with_friction(), wire(0.0), &kirchhoff());
    (0..40).for_each(|_| simulation.step(Command::advance(2.0)).map(|_| ()).unwrap());
    let whole = serde_json::to_value(simulation.state()).unwrap();
    let spoilt = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut spoilt = whole.clone();
        change(&mut spoilt["content"]["Kirchhoff"]);
        serde_json::from_value::<State>(spoilt).unwrap()
    };
    let rod = |change: &dyn Fn(&mut serde_json::Value)| spoilt(&|both| change(&mut both["state"]));
    let contact = serde_json::json!({
        "position_mm": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0], "force_n": 0.0, "friction_n": [0.0, 0.0, 0.0],
        "penetration_mm": 0.0, "triangle": 0,
    });
    let touch = serde_json::json!({"energy_mj": 0.0, "contact": contact, "friction_nmm": 0.0});
    for (change, reported) in [
        (rod(&|s| drop(s["rod"]["angles"].as_array_mut().unwrap().pop())), "state.rod"),
        (rod(&|s| s["known"]["points"][0]["piece"] = 4_000_000_000u32.into()), "state.known"),
        (rod(&|s| drop(s["forces"].as_array_mut().unwrap().pop())), "state.forces"),
        (rod(&|s| drop(s["correction"]["turns"].as_array_mut().unwrap().pop())), "state.correction"),
        (rod(&|s| s["hands"][0]["inserted_mm"] = (-1.0).into()), "state.inserted_mm"),
        (rod(&|s| drop(s["hands"].as_array_mut().unwrap().pop())), "state.instruments"),
        (rod(&|s| drop(s["hand_forces"].as_array_mut().unwrap().pop())), "state.hands"),
        (
            rod(&|s| {
                s["behind"] =
                    vec![serde_json::json!({"advance_mm": 1.0, "rotate_rad": 0.0, "steer": 0.0}); 2].into();
            }),
            "state.hands",
        ),
        (rod(&|s| s["touches"] = serde_json::json!([[1_000_000, touch]])), "state.touches"),
        (spoilt(&|both| both["report"]["inserted_mm"] = 1.0.into()), "state.report"),
    ] {
        let error = simulation.clone().restore(&change).unwrap_err();
        assert!(error.is_input() && error.to_string().starts_with(reported), "{reported}: {error}");
    }
}

#[test]
fn threads_on_one_vessel_have_the_bits_of_runs_one_after_another() {
    let first = start("curved_tube", with_friction(), wire(0.03), &kirchhoff());
    let run = |mut simulation: Simulation, seed: u64| {
        (0..50).for_each(|_| simulation.step(Command::advance(2.0)).map(|_| ()).unwrap());
        commands(seed, 40).into_iter().for_each(|command| drop(simulation.step(command).map(|_| ())));
        bytes(&simulation)
    };
    let alone: Vec<Vec<u8>> = (0..4).map(|seed| run(first.clone(), seed)).collect();
    let together: Vec<Vec<u8>> = std::thread::scope(|scope| {
        let runs: Vec<_> = (0..4).map(|seed| (first.clone(), seed)).collect();
        let threads: Vec<_> =
            runs.into_iter().map(|(clone, seed)| scope.spawn(move || run(clone, seed))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(alone == together);
    assert!(alone[0] != alone[1]);
}

/// 200 nodes in a vessel of 20,000 triangles.
fn large() -> Simulation {
    let made =
        GeneratedWall::new(&anatomy::tree("aortic_arch").unwrap(), Resolution::Triangles(20_000)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0).unwrap();
    let method = KirchhoffOptions { element_mm: 1.0, ..KirchhoffOptions::default() };
    let mut simulation = Simulation::builder(made.wall, wire(0.03), sheath)
        .properties(with_friction())
        .method(&method)
        .build()
        .unwrap();
    (0..100).for_each(|_| simulation.step(Command::advance(2.0)).map(|_| ()).unwrap());
    simulation
}

#[test]
fn a_clone_of_two_hundred_nodes_is_small() {
    let simulation = large();
    assert_eq!(simulation.shape().len(), 201);
    let mut kept = Vec::with_capacity(2);
    let alike = allocation_counter::measure(|| kept.push(simulation.clone())).bytes_current;
    // With a state of its own.
    let moved = allocation_counter::measure(|| {
        let mut clone = simulation.clone();
        clone.step(Command::advance(1.0)).unwrap();
        clone.drop_workspace();
        kept.push(clone);
    });
    println!(
        "200 nodes: {} bytes saved; a clone takes {alike} bytes, and {} after a step",
        bytes(&simulation).len(),
        moved.bytes_current
    );
    assert!(alike < 50_000 && moved.bytes_current < 500_000, "{alike} {}", moved.bytes_current);
    assert!(moved.bytes_current > 50_000 && kept[1].shape() != kept[0].shape());
}

#[test]
#[ignore = "timing: by hand, alone, with --release"]
fn a_clone_of_two_hundred_nodes_is_fast() {
    let simulation = large();
    let mut clones = Vec::with_capacity(1000);
    let mut micros: Vec<f64> = (0..1000)
        .map(|_| {
            let clock = Instant::now();
            clones.push(simulation.clone());
            clock.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    micros.sort_by(f64::total_cmp);
    println!("clone: median {:.1} µs, 99 % {:.1} µs", micros[500], micros[990]);
    assert!(micros[500] < 50.0, "{}", micros[500]);
}

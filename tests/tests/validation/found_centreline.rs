//! Scenes that give a surface alone: what needs a centre line takes the one that is found in it, and does nearly what it does with the one that
//! the surface was made from.

use std::path::Path;

use endowire_core::Vec3;
use endowire_core::control::{FollowPath, Outcome, Team, drive};
use endowire_core::insertion::{Script, Simulation};
use endowire_core::scene::Scene;
use endowire_core::vessel::{
    CentrelineNode, CentrelinePath, CentrelineTree, GeneratedWall, NoStore, Resolution, Target, anatomy,
};
use endowire_viewer::{FrameTime, Image, Renderer, ViewSpec};

/// A scene of a surface made from a built-in anatomy, entered at this opening, with more of `[vessel]` and of the scene.
fn scene(vessel: &str, opening: usize, in_vessel: &str, more: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/scenes/found.toml");
    let text = format!(
        "[vessel]\nfile = \"../vessels/{vessel}.stl\"\n{in_vessel}\n[device]\nfile = \"../devices/wire_035_hooked.toml\"\n\
         [sheath]\nopening = {opening}\ndepth_mm = 2.0\n[method]\nelement_mm = 5.0\n{more}"
    );
    Scene::from_toml(&text, &path).unwrap()
}

/// Carries out a script; how far it came.
fn inserted_mm(scene: &Scene, script: &Script) -> f64 {
    let mut simulation = scene.simulation(&NoStore).unwrap();
    let mut run = script.begin();
    while let Some(step) = run.next(&simulation).unwrap() {
        step.carry_out(&mut simulation).unwrap();
        run.carried_out();
    }
    simulation.report().inserted_mm
}

#[test]
fn a_line_ends_at_a_target_that_was_found_where_it_ends_at_the_known_one() {
    let more = "[[script]]\nadvance_mm = 250.0\nstep_mm = 1.0\nuntil = { tip_within_mm = 10.0, target = \"opening 0\" }\n";
    let scene = scene("curved_tube", 1, "", more);
    let stack = scene.stack().unwrap();
    assert!(scene.found_centreline().is_none() && scene.finds_centreline());
    let found = inserted_mm(&scene, &scene.steps(&stack, &NoStore).unwrap());
    assert_eq!(scene.found_centreline().unwrap().targets()[0].name, "opening 0");
    let tree = anatomy::tree("curved_tube").unwrap();
    // The sheath is at the last row's end.
    let known = |row: usize| {
        let named = tree.clone().with_targets(vec![Target { name: "opening 0".into(), row }]).unwrap();
        inserted_mm(&scene, &Script::new(&scene.script, &stack, &[0.0], Some(&named)).unwrap())
    };
    assert!((found - known(0)).abs() <= 1.0, "{found} {}", known(0));
    // The twin: a target elsewhere ends it elsewhere.
    assert!((found - known(5)).abs() > 2.0);
}

/// How far a path is from another one where that is farthest, over the vessel's radius there.
fn apart(path: &CentrelinePath, other: &CentrelinePath) -> f64 {
    let away = path.points().iter().map(|(x, radius_mm)| other.nearest(x).distance_mm / radius_mm);
    away.fold(0.0, f64::max)
}

#[test]
fn a_hand_follows_a_way_that_was_found_as_the_known_one() {
    let scene = scene("aortic_arch", 1, "", "");
    let found = scene.centreline(&NoStore).unwrap();
    let known = anatomy::tree("aortic_arch").unwrap();
    let ways = |name: &str| {
        let row = known.target(name).unwrap().row;
        let place = known.nodes()[row].position_mm;
        (known.path_to(row).unwrap(), found.path_to_place(&place).unwrap())
    };
    let start = scene.simulation(&NoStore).unwrap();
    let (known_way, found_way) = ways("left subclavian");
    let ends = [&known_way, &found_way].map(|way| {
        let mut simulation = start.clone();
        let mut hand = FollowPath::new(way.clone(), Team::default(), 6.0);
        let outcome = drive::<endowire_core::Error>(&mut simulation, &mut hand, 600, |_, _| Ok(())).unwrap();
        assert!(matches!(outcome, Outcome::Arrived), "{outcome:?}");
        simulation.shape().tip_mm().unwrap()
    });
    assert!(apart(&found_way, &known_way) < 0.5 && (ends[0] - ends[1]).norm() < 6.0);
    // The twin: the way into another branch is another.
    assert!(apart(&found_way, &ways("innominate").0) > 1.0);
}

#[test]
fn blood_drags_along_a_line_that_was_found_as_along_the_known_one() {
    let flow = "[vessel.flow]\ninflow_ml_per_s = 40.0\ninlet_mm = [0.0, 0.0, 0.0]\n";
    let scene = scene("curved_tube", 0, flow, "");
    let drag_n = |mut simulation: Simulation| {
        for _ in 0..30 {
            simulation.step(endowire_core::insertion::Command::advance(5.0)).unwrap();
        }
        simulation.report().drag_n
    };
    let found = drag_n(scene.simulation(&NoStore).unwrap());
    assert!(scene.found_centreline().is_some());
    let known = |wider: f64| {
        let tree = anatomy::tree("curved_tube").unwrap();
        let node = |node: &CentrelineNode| CentrelineNode { radius_mm: wider * node.radius_mm, ..*node };
        let tree = CentrelineTree::new(tree.nodes().iter().map(node).collect()).unwrap();
        let (wall, stack) = (scene.wall(&NoStore).unwrap(), scene.stack().unwrap());
        let sheath = scene.sheath(&wall).unwrap();
        let flow = endowire_core::flow::BloodFlow::new(&tree, scene.vessel.flow.as_ref().unwrap()).unwrap();
        let builder = Simulation::builder(wall, stack, sheath).flow(Some(flow)).method(&scene.method);
        drag_n(builder.build().unwrap())
    };
    let off = |other: Vec3| (found - other).norm() / other.norm();
    assert!(off(known(1.0)) < 0.05, "{found:?} {:?}", known(1.0));
    // The twin: it tells a vessel that is a twentieth wider.
    assert!(off(known(1.05)) > 0.1);
}

/// The mean difference of two pictures, in levels.
fn difference(a: &Image, b: &Image) -> f64 {
    let sum: u64 = a.data().iter().zip(b.data()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.data().len() as f64
}

#[test]
fn contrast_medium_flows_along_a_line_that_was_found_as_along_the_known_one() {
    let made = GeneratedWall::new(&anatomy::tree("aortic_arch").unwrap(), Resolution::EdgeMm(3.0)).unwrap();
    let view = "[view]\nviews = [\"fluoro\"]\nsize_px = [160, 160]\nbackend = \"cpu\"\n\
                injection = [{ start_s = 0.0, duration_s = 2.0, rate_ml_per_s = 20.0 }]\n";
    let scene = scene("aortic_arch", 1, "", view);
    let found = ViewSpec::of_scene(&scene, Path::new("found.toml")).unwrap();
    let mut known = found.clone();
    known.flow.tree = Some(scene.resolve(Path::new("../vessels/aortic_arch.csv")));
    let picture = |spec: &ViewSpec, time_s: f64| {
        let mut renderer = Renderer::of_wall(spec, &made.wall).unwrap();
        renderer.render_at(&[], FrameTime { frame: 0, time_s }).unwrap().fluoro.unwrap()
    };
    let (without, with) = (picture(&known, -1.0), picture(&known, 1.5));
    let off = difference(&picture(&found, 1.5), &with);
    assert!(off < 0.1 * difference(&without, &with), "{off}");
    // The twin: half a second earlier it is elsewhere.
    assert!(difference(&picture(&known, 1.0), &with) > 0.1 * difference(&without, &with));
}

#[test]
fn a_surface_without_a_way_through_says_how_to_give_a_line() {
    let closed = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(2.0)).unwrap();
    let file = std::env::temp_dir().join(format!("endowire_closed_{}.stl", std::process::id()));
    closed.wall.closed_mesh().write(&file).unwrap();
    let text = format!(
        "[vessel]\nfile = {file:?}\nflow = {{ inflow_ml_per_s = 4.0 }}\n[device]\nsection = [{{ length_mm = 50, radius_mm = 0.3, \
         bending_stiffness_nmm2 = 4 }}]\n[sheath]\nposition_mm = [0, 0, 5]\ndirection = [0, 0, 1]\n"
    );
    let reported = Scene::from_toml(&text, Path::new("a.toml"))
        .unwrap()
        .simulation(&NoStore)
        .map(drop)
        .unwrap_err()
        .to_string();
    std::fs::remove_file(&file).unwrap();
    assert!(reported.starts_with("vessel.centreline = none: none is found in the surface"), "{reported}");
    assert!(
        reported.contains("no opening") && reported.contains("endowire vessel centreline SURFACE --from"),
        "{reported}"
    );
}

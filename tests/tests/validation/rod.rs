//! The rod against exact solutions and against itself. Validation: nothing here was recorded from this program.
//! Every row of `endowire verify` is checked where the program is (`crates/cli/tests/cli/rod.rs`), once.

use endowire_core::statics::{LoadKind, StaticCase, StaticSolution};
use endowire_core::{Vec3, nalgebra};
use endowire_lab::{Row, stress};
use std::path::Path;

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cases")
}

fn case(name: &str) -> StaticCase {
    StaticCase::from_file(&folder().join(format!("{name}.toml"))).expect("an example case is valid")
}

fn solve(name: &str) -> StaticSolution {
    case(name).solve().expect("an example case is solvable")
}

fn parse(text: &str) -> Result<StaticCase, endowire_core::Error> {
    StaticCase::from_toml(text, Path::new("case"))
}

#[test]
fn a_wrong_reference_would_be_seen() {
    // Twin of the comparison: each kind of row fails on a value that is off by ten bounds.
    let tip = [0.4, -0.8, 0.0];
    assert!(!Row::relative("", "", 1.0 + 1e-5, 1.0, 1e-6).pass);
    assert!(!Row::point("", "", tip, [0.4, -0.8, 1e-5], 1.0, 1e-6).pass);
    assert!(!Row::relative("", "", f64::NAN, 1.0, 1e-6).pass);
    assert!(!Row::failed("", "").pass);
    assert!(Row::point("", "", tip, [0.4, -0.8, 1e-7], 1.0, 1e-6).pass);
}

#[test]
fn every_stressed_case_settles_in_a_minimum() {
    for case in stress::cases() {
        let row = case.run();
        assert!(row.pass, "{row:?}");
    }
}

#[test]
fn every_example_case_is_solved() {
    let mut count = 0;
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        let s = StaticCase::from_file(&path).unwrap().solve().unwrap();
        assert!(s.converged && s.stable && s.monotone, "{}: {} {:e}", path.display(), s.stop, s.residual);
        count += 1;
    }
    assert!(count >= 14);
}

/// Force and moment left over on the whole rod, about the origin, over the size of the start's reaction.
fn imbalance(case: &StaticCase, s: &StaticSolution) -> f64 {
    let (start, end) = (&s.reactions.start, &s.reactions.end);
    let mut force = Vec3::from(start.force) + Vec3::from(end.force);
    let at = Vec3::from(case.start.position);
    let mut moment = at.cross(&Vec3::from(start.force))
        + Vec3::from(s.tip).cross(&Vec3::from(end.force))
        + Vec3::from(start.moment)
        + Vec3::from(end.moment);
    for load in &case.load {
        let value = Vec3::from(load.value);
        let at = load.at.unwrap_or(case.rod.length);
        let node = s.arc_lengths.iter().position(|x| (x - at).abs() < 1e-9).expect("loads stand at nodes");
        if load.kind == LoadKind::Force {
            force += value;
            moment += Vec3::from(s.nodes[node]).cross(&value);
        } else {
            moment += value;
        }
    }
    (force.norm() + moment.norm()) / (Vec3::from(start.force).norm() + Vec3::from(start.moment).norm())
}

#[test]
fn reactions_balance_the_loads() {
    for name in [
        "tip_force",
        "end_moment",
        "j_tip",
        "bend_45",
        "pinned",
        "sliding",
        "guided",
        "clamped_turned",
        "load_steps",
    ] {
        let (c, s) = (case(name), solve(name));
        let off = imbalance(&c, &s);
        assert!(off < 1e-7, "{name}: {off:e} {:?}", s.reactions);
    }
}

#[test]
fn a_wrong_reaction_is_seen() {
    let (c, mut s) = (case("pinned"), solve("pinned"));
    s.reactions.end.force[0] *= 1.001;
    assert!(imbalance(&c, &s) > 1e-7);
}

#[test]
fn rotating_the_whole_problem_changes_nothing() {
    for name in ["tip_force", "j_tip", "bend_45", "pre_twisted", "clamped_turned"] {
        let base = case(name);
        let first = base.solve().unwrap();
        for (k, axis) in [Vec3::new(1.0, 2.0, -0.5), Vec3::new(-0.3, 0.1, 1.0)].iter().enumerate() {
            let turn =
                nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(*axis), 1.1 + k as f64);
            let turned = |v: [f64; 3]| -> [f64; 3] { (turn * Vec3::from(v)).into() };
            let mut other = base.clone();
            other.start.position = turned(other.start.position);
            other.start.tangent = turned(other.start.tangent);
            other.start.normal = other.start.normal.map(turned);
            other.end.position = other.end.position.map(turned);
            other.end.tangent = other.end.tangent.map(turned);
            other.end.normal = other.end.normal.map(turned);
            for load in &mut other.load {
                load.value = turned(load.value);
            }
            let second = other.solve().unwrap();
            let change = (second.energy.total - first.energy.total).abs() / first.energy.total;
            assert!(change <= 1e-13, "{name}: {change:e}");
            let tip = (Vec3::from(second.tip) - turn * Vec3::from(first.tip)).norm();
            assert!(tip <= 1e-9 * base.rod.length, "{name}: tip {tip:e}");
        }
    }
}

#[test]
fn same_input_same_bits() {
    for name in ["tip_force", "clamped_turned", "ring", "column"] {
        assert_eq!(solve(name), solve(name));
    }
}

#[test]
fn a_tolerance_saves_iterations_and_costs_what_it_says() {
    let mut case = case("tip_force");
    let exact = case.solve().expect("the case is valid");
    let mut last = exact.iterations;
    for tolerance in [1e-6, 1e-3] {
        case.solver.tolerance = tolerance;
        let s = case.solve().expect("the case is valid");
        assert!(s.converged && s.stable && s.residual <= tolerance, "{tolerance:e}: {:e}", s.residual);
        assert!(s.iterations < last, "{tolerance:e}: {} iterations, before {last}", s.iterations);
        last = s.iterations;
        // The load is PL²/EI = 10, and the tip gives by no more than L³/EI.
        let off = (Vec3::from(s.tip) - Vec3::from(exact.tip)).norm();
        assert!(off > 0.0 && off <= 10.0 * tolerance, "{tolerance:e}: the tip is off by {off:e}");
    }
}

#[test]
fn load_steps_and_one_step_agree() {
    let mut c = case("load_steps");
    let stepped = c.solve().unwrap();
    c.solver.load_steps = 1;
    let once = c.solve().unwrap();
    assert!((Vec3::from(stepped.tip) - Vec3::from(once.tip)).norm() < 1e-9);
}

#[test]
fn a_clamp_that_turns_whole_turns_twists() {
    let mut c = case("clamped_turned");
    c.end.position = None;
    for turns in [0.5, 7.0, -7.0] {
        c.end.turns = Some(turns);
        // Pulled straight, so that the rotation stays twist and does not become writhe.
        c.load = vec![endowire_core::statics::Load {
            kind: LoadKind::Force,
            at: None,
            from: None,
            to: None,
            value: [50.0, 0.0, 0.0],
        }];
        let s = c.solve().unwrap();
        assert!((s.twist - turns).abs() < 1e-9, "{} {}", s.twist, turns);
        assert!((s.reactions.end.torque - 0.77 * turns).abs() < 1e-8);
    }
}

#[test]
fn bad_cases_name_what_is_wrong() {
    let good = std::fs::read_to_string(folder().join("tip_force.toml")).unwrap();
    assert!(parse(&good).is_ok());
    for (from, to, named) in [
        ("EI = 1.0", "EI = -1.0", "rod.section[0].EI"),
        ("EI = 1.0", "EI = nan", "rod.section[0].EI"),
        ("EI = 1.0", "EI = 1.0\nstiffnes = 2.0", "stiffnes"),
        ("length = 1.0", "length = 2.0", "until"),
        ("elements = 32", "elements = 0", "rod.elements"),
        ("tangent = [1.0, 0.0, 0.0]", "tangent = [0.0, 0.0, 0.0]", "start.tangent"),
        ("normal = [0.0, 1.0, 0.0]", "normal = [2.0, 0.0, 0.0]", "start.normal"),
        ("type = \"free\"", "type = \"free\"\nposition = [0.5, 0.0, 0.0]", "end.position"),
        ("type = \"free\"", "type = \"pinned\"", "end.position"),
        ("type = \"free\"", "type = \"pinned\"\nposition = [1.5, 0.0, 0.0]", "inextensible"),
        ("type = \"free\"", "type = \"pinned\"\nposition = [0.5, 0.0, 0.0]\nturns = 1.0", "end.turns"),
        ("type = \"free\"", "type = \"welded\"", "welded"),
        ("at = 1.0", "at = 1.5", "load[0].at"),
        ("value = [0.0, -10.0, 0.0]", "value = [0.0, inf, 0.0]", "load[0].value"),
        ("[start]", "[solver]\ntolerance = 0.0\n[start]", "solver.tolerance"),
        ("[start]", "[solver]\ntolerance = 0.1\n[start]", "solver.tolerance"),
        ("[start]", "[solver]\ntolerance = nan\n[start]", "solver.tolerance"),
    ] {
        assert!(good.contains(from), "{from}");
        let error = parse(&good.replacen(from, to, 1)).unwrap_err();
        assert!(error.is_input());
        assert!(error.to_string().contains(named), "{to}: {error}");
    }
}

#[test]
fn a_torque_without_torsion_stiffness_is_refused() {
    let mut c = case("tip_force");
    c.load[0].kind = LoadKind::Moment;
    c.load[0].value = [1.0, 0.0, 0.0];
    assert!(c.solve().unwrap_err().to_string().contains("GJ"));
}

#[test]
fn a_follower_across_the_tip_never_loses_stability() {
    // A load fixed to the tip's triad has exactly one equilibrium (integrate from the tip), so none is ever lost.
    let mut c = case("follower");
    for p in [0.5, 2.0, 4.0, 8.0] {
        c.load[0].value = [0.0, p, 0.0];
        let s = c.solve().unwrap();
        assert!(s.converged && s.stable && s.iterations < 20, "{p}: {} {}", s.stop, s.iterations);
    }
}

#[test]
fn continuation_passes_the_limit_point_of_a_shallow_arch() {
    // A clamped arch pushed down at its crown: the load rises, falls and rises again.
    let mut c = case("ring");
    c.rod.section[0].gj = None;
    c.end.turns = None;
    c.initial = None;
    c.rod.section[0].rest_curvature = [0.0; 2];
    c.end.position = Some([0.98, 0.0, 0.0]);
    let bow = c.solve().unwrap();
    let crown = bow.nodes[16];
    let up = if crown[1].abs() > crown[2].abs() {
        [0.0, -crown[1].signum(), 0.0]
    } else {
        [0.0, 0.0, -crown[2].signum()]
    };
    c.load = vec![endowire_core::statics::Load {
        kind: LoadKind::Force,
        at: Some(0.5),
        from: None,
        to: None,
        value: up,
    }];
    let problem = endowire_core::statics::StaticProblem::new(&c).unwrap();
    let path = problem.continuation(0.004, 90).unwrap();
    let highest = path.iter().map(|p| p.factor).fold(0.0, f64::max);
    let at = path.iter().position(|p| p.factor == highest).unwrap();
    assert!(highest > 1.0 && at > 2 && at < path.len() - 10, "highest {highest} at {at} of {}", path.len());
    assert!(path[at..].iter().any(|p| p.factor < 0.5 * highest), "the load must fall beyond the limit point");
    assert!(path.iter().all(|p| p.residual < 1e-7));
    // In space the arch may also roll over sideways; the limit point adds one more unstable direction.
    assert!(path[at + 2].negative_modes > path[at - 2].negative_modes);
}

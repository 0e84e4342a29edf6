//! Ticks of fixed cost follow steps.

use crate::device::{Device, Instrument, Section, Stack};
use crate::insertion::{Command, Move, Sheath, Simulation, Tally, WallProperties};
use crate::methods::kirchhoff::KirchhoffOptions;
use crate::methods::{State, StepReport};
use crate::random::{splitmix64, unit};
use crate::tuning::Tuning;
use crate::vessel::motion::{MotionMode, VesselMotion, Waveform};
use crate::vessel::{GeneratedWall, Resolution, Wall, anatomy};

/// Linear solves of a tick: fewer than most parts need, so that most ticks leave work over.
const SOLVES: usize = 3;

/// A tube of radius 4 mm, straight for 100 mm and then bent.
fn tube() -> Wall {
    GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.5)).unwrap().wall
}

/// A bent wire in a bent catheter in the tube, inserted by 110 and 90 mm.
fn two(motion: &[MotionMode]) -> Simulation {
    let mut two = outside(motion, Tuning::default());
    for _ in 0..22 {
        two.step_together(&pushed([5.0, 0.0], [4.0, 0.0])).unwrap();
    }
    two
}

/// The same two before they are inserted.
fn outside(motion: &[MotionMode], tuning: Tuning) -> Simulation {
    let bent = |length_mm: f64, radius_mm: f64, bending: f64, inner_radius_mm: Option<f64>| {
        let shaft = Section { inner_radius_mm, ..Section::straight(length_mm, radius_mm, bending) };
        let tip = Section { rest_curvature_per_mm: [0.06, 0.0], length_mm: 15.0, ..shaft };
        Device::new(vec![tip, shaft]).unwrap()
    };
    let instrument = |name: &str, device: Device| Instrument { name: name.into(), device, may_lead: true };
    let stack = Stack::new(vec![
        instrument("wire", bent(285.0, 0.3, 5.0, None)),
        instrument("catheter", bent(225.0, 0.6, 15.0, Some(0.35))),
    ]);
    let properties = WallProperties { friction: 0.1, deviation_mm: 0.0, ..WallProperties::default() };
    let options =
        KirchhoffOptions { element_mm: 4.0, tolerance: 1e-6, tuning, ..KirchhoffOptions::default() };
    let sheath = Sheath::new(crate::Vec3::z() * 6.0, crate::Vec3::z()).unwrap();
    Simulation::builder(tube(), stack.unwrap().with_friction(vec![0.1, 0.0]).unwrap(), sheath)
        .properties(properties)
        .motion(VesselMotion::new(motion).unwrap())
        .method(&options)
        .build()
        .unwrap()
}

fn pushed(wire: [f64; 2], catheter: [f64; 2]) -> [Move; 2] {
    let mut instrument = 0..;
    [wire, catheter].map(|[advance_mm, rotate_rad]| Move {
        instrument: instrument.next().unwrap(),
        command: Command { advance_mm, rotate_rad, ..Command::default() },
    })
}

/// Hands moving back and forth at 1 kHz, with new speeds every 50 ms, after a rest of 20 ms.
fn hands(seed: u64, tick: u64) -> [Move; 2] {
    let speed = |k: u64, most: f64| most * (2.0 * unit(splitmix64(seed, 4 * (tick / 50) + k)) - 1.0);
    if tick % 50 >= 30 {
        return pushed([0.0; 2], [0.0; 2]);
    }
    pushed([speed(0, 0.04), speed(1, 0.01)], [speed(2, 0.03), speed(3, 0.01)])
}

fn apart_mm(a: &Simulation, b: &Simulation) -> f64 {
    (a.tip_of_mm(0).unwrap() - b.tip_of_mm(0).unwrap()).norm()
}

fn bytes(state: &State) -> Vec<u8> {
    serde_json::to_vec(state).unwrap()
}

#[test]
fn ticks_are_where_steps_are_once_hands_rest() {
    let (mut ticking, mut stepping) = (two(&[]), two(&[]));
    let (mut behind, mut most, mut farthest_mm) = (0, 0, 0.0f64);
    for tick in 0..400 {
        stepping.step_together(&hands(1, tick)).unwrap();
        let report = ticking.tick(&hands(1, tick), SOLVES, None).unwrap();
        assert!(report.converged);
        behind += usize::from(!report.behind.is_empty());
        most = most.max(report.solves);
        if tick % 50 == 49 {
            assert!(report.behind.is_empty() && report.iterations == 0, "{tick}");
            assert_eq!(ticking.report().lengths_mm().len(), 2);
            let off = ticking.report().lengths_mm()[0] - stepping.report().lengths_mm()[0];
            assert!(off.abs() < 1e-9, "{off}");
            farthest_mm = farthest_mm.max(apart_mm(&ticking, &stepping));
        }
    }
    assert!(farthest_mm < 0.02, "{farthest_mm}");
    // Ticks end within a part.
    assert!(behind > 100, "{behind}");
    // They exceed their solves by at most one iteration.
    assert!(most < 25, "{most}");
    // Counter-check: on its way a device lags behind its hands, and is elsewhere.
    for tick in 0..10 {
        stepping.step_together(&hands(2, tick)).unwrap();
        ticking.tick(&hands(2, tick), 1, None).unwrap();
    }
    assert!(apart_mm(&ticking, &stepping) > 0.02);
}

#[test]
fn what_a_tick_leaves_over_the_next_step_does() {
    let (mut ticking, mut stepping) = (two(&[]), two(&[]));
    let moves = pushed([0.4, 0.1], [0.2, 0.0]);
    ticking.tick(&moves, 1, None).unwrap();
    let behind = ticking.report().behind.clone();
    assert_eq!(behind.len(), 2);
    assert!((behind[0].advance_mm - 0.4).abs() < 1e-12 && (behind[1].advance_mm - 0.2).abs() < 1e-12);
    // The hands' motion, including what is queued, is complete.
    let room_mm = 300.0 - ticking.report().lengths_mm()[0];
    let refused = ticking.tick(&pushed([room_mm - 0.3, 0.0], [0.0; 2]), 1, None).unwrap_err().to_string();
    assert!(refused.contains("wire.advance_mm"), "{refused}");
    // It is refused for what is behind, and says so.
    assert!(
        refused.contains("0.400 mm and 0.100 rad of \"wire\"") && refused.contains("forget"),
        "{refused}"
    );
    let mut forgetful = ticking.clone();
    forgetful.forget();
    // So it is where instruments have no place together.
    let far = pushed([37.9, 0.0], [0.0; 2]);
    let refused = ticking.tick(&far, 1, None).unwrap_err().to_string();
    assert!(refused.contains("0.200 mm and 0.000 rad of \"catheter\" are behind"), "{refused}");
    forgetful.tick(&far, 1, None).unwrap();
    let too_far = forgetful.tick(&pushed([room_mm + 1.0, 0.0], [0.0; 2]), 1, None).unwrap_err().to_string();
    assert!(!too_far.contains("0.400 mm and"), "{too_far}");
    ticking.step_together(&[]).unwrap();
    stepping.step_together(&moves).unwrap();
    assert!(ticking.report().behind.is_empty());
    assert!(apart_mm(&ticking, &stepping) < 1e-4);
    let refused = ticking.tick(&moves, 0, None).unwrap_err().to_string();
    assert!(refused.contains("solves"), "{refused}");
}

#[test]
fn a_clone_and_a_saved_state_go_on_in_the_midst_of_a_part() {
    let mut ticking = two(&[]);
    for tick in 0..7 {
        ticking.tick(&hands(1, tick), SOLVES, None).unwrap();
    }
    assert!(!ticking.report().behind.is_empty());
    let saved = bytes(&ticking.state());
    let mut clone = ticking.clone();
    let mut restored = two(&[]);
    restored.restore(&serde_json::from_slice(&saved).unwrap()).unwrap();
    for tick in 7..60 {
        for each in [&mut ticking, &mut clone, &mut restored] {
            each.tick(&hands(1, tick), SOLVES, None).unwrap();
        }
        clone.drop_workspace();
    }
    let [a, b, c] = [&ticking, &clone, &restored].map(|each| bytes(&each.state()));
    assert!(a == b, "the clone");
    assert!(a == c, "the restored one");
    // A state with an unfinished part of another scene is rejected.
    let text = String::from_utf8(saved).unwrap();
    // So are attempts without end.
    let endless = text.replace("\"again\":4", "\"again\":9999999999");
    assert!(endless != text);
    let refused = restored.restore(&serde_json::from_str(&endless).unwrap()).unwrap_err().to_string();
    assert!(refused.contains("state.unfinished.control.again"), "{refused}");
    let hands = text.rfind("\"inserted_mm\"").unwrap();
    let wrong = format!("{}\"inserted_mm\":99.0,\"was\"{}", &text[..hands], &text[hands + 13..]);
    assert!(serde_json::from_str::<State>(&wrong).map_or(true, |state| restored.restore(&state).is_err()));
}

/// A bent wire before a bent tube, in which it whips when rotated.
fn whipping(tuning: Tuning) -> Simulation {
    let bent = Section { rest_curvature_per_mm: [0.02, 0.0], ..Section::straight(60.0, 0.4, 10.0) };
    let wire = Device::new(vec![bent, Section::straight(103.0, 0.4, 10.0)]).unwrap();
    let sheath = Sheath::new(crate::Vec3::z() * 6.0, crate::Vec3::z()).unwrap();
    let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
    let options = KirchhoffOptions { element_mm: 4.0, tuning, ..KirchhoffOptions::default() };
    let built = Simulation::builder(tube(), wire, sheath).properties(properties).method(&options).build();
    built.unwrap()
}

/// Numbers with which a snap is a flight, and a command with these linear solves.
fn flights(solves: usize) -> Tuning {
    let mut tuning = Tuning::default();
    (tuning.steps.snap_radii, tuning.steps.solves, tuning.steps.solves_per_mm) = (0.0, solves, 0.0);
    tuning
}

/// A whipping wire in the tube, which is on its way from a snap after a tick.
fn in_flight() -> Simulation {
    let mut ticking = whipping(flights(ENOUGH));
    for _ in 0..32 {
        ticking.step(Command::advance(5.0)).unwrap();
    }
    for _ in 0..200 {
        if !ticking
            .tick(&[Move { instrument: 0, command: Command::rotate(0.05) }], 2, None)
            .unwrap()
            .converged
        {
            return ticking;
        }
    }
    panic!("it does not whip");
}

/// Linear solves of one Newton iteration, at most, in these scenes.
const ITERATION: usize = 30;

#[test]
fn a_step_costs_what_is_known_before_and_what_is_left_goes_on() {
    let (mut small, mut none) = (Tuning::default(), Tuning::default());
    (small.steps.solves, small.steps.solves_per_mm) = (20, 0.5);
    none.steps.solves = usize::MAX;
    let start = two(&[]);
    let [mut bounded, mut free] = [small, none].map(|tuning| {
        let mut simulation = outside(&[], tuning);
        simulation.restore(&start.state()).unwrap();
        simulation
    });
    // The turn counts as 30 mm, so the advance decides.
    let moves = pushed([40.0, 3.0], [30.0, 0.0]);
    let default = Tuning::default().steps;
    assert_eq!(start.most_solves(&moves), Some(default.solves + 40 * default.solves_per_mm as usize));
    assert_eq!(bounded.most_solves(&moves), Some(40));
    assert_eq!(free.most_solves(&moves), Some(usize::MAX));
    // Counter-check: without the limit it costs more.
    let all = free.step_together(&moves).unwrap();
    assert!(all.behind.is_empty() && all.solves as usize > 40 + ITERATION, "{}", all.solves);
    let mut left = &moves[..];
    let mut steps = 0;
    loop {
        let most = bounded.most_solves(left).unwrap();
        let before_mm = bounded.report().lengths_mm()[0];
        let report = bounded.step_together(left).unwrap();
        assert!(report.solves as usize <= most + ITERATION, "{} of {most}", report.solves);
        (left, steps) = (&[], steps + 1);
        if !report.is_under_way() {
            break;
        }
        // Nothing is lost.
        let told_mm = report.lengths_mm()[0] + report.behind[0].advance_mm;
        assert!((told_mm - 150.0).abs() < 1e-9 && report.lengths_mm()[0] >= before_mm, "{told_mm}");
        assert!(steps < 100);
    }
    assert!(steps > 1, "{steps}");
    assert_eq!(bounded.report().lengths_mm(), free.report().lengths_mm());
    assert!(apart_mm(&bounded, &free) < 0.02, "{}", apart_mm(&bounded, &free));
}

#[test]
fn a_snap_counts_as_well_and_is_seen_on_its_way() {
    let flying = in_flight();
    let (mut bounded, mut free) = (whipping(flights(10)), flying.clone());
    bounded.restore(&flying.state()).unwrap();
    assert_eq!(bounded.most_solves(&[]), Some(10));
    let mut tally = Tally::default();
    tally.count(1, &flying);
    assert!(flying.report().imbalance > 0.0 && tally.max_imbalance == 0.0 && tally.ends_under_way);
    let all = free.step_together(&[]).unwrap();
    assert!(all.solves as usize > 10 + ITERATION && all.behind.is_empty() && all.jumped, "{}", all.solves);
    let (mut steps, mut jumps) = (0, 0);
    while bounded.report().is_under_way() && steps < 400 {
        let report = bounded.step_together(&[]).unwrap();
        assert!(report.solves as usize <= 10 + ITERATION, "{}", report.solves);
        (steps, jumps) = (steps + 1, jumps + usize::from(report.jumped));
    }
    assert!((2..400).contains(&steps) && jumps == 1, "{steps} {jumps}");
    assert!(bounded.report().converged && apart_mm(&bounded, &free) < 1e-3);
}

#[test]
fn what_is_forgotten_has_no_effect() {
    let (mut asked, mut spared) = (two(&[]), two(&[]));
    let moves = pushed([0.4, 0.1], [0.2, 0.0]);
    asked.tick(&moves, 1, None).unwrap();
    assert!(asked.report().is_under_way());
    let mut remembering = asked.clone();
    asked.forget();
    let [a, b] = [&asked, &spared].map(|each| each.report());
    assert!(a.behind.is_empty() && a.hands() == b.hands());
    asked.forget();
    for tick in 0..10 {
        for each in [&mut asked, &mut spared, &mut remembering] {
            each.step_together(&pushed([1.0, 0.1], [0.5, 0.0])).unwrap();
            each.tick(&hands(1, tick), SOLVES, None).unwrap();
        }
    }
    let [a, b, c] = [&asked, &spared, &remembering].map(|each| bytes(&each.state()));
    assert!(a == b && a != c);
}

#[test]
fn after_forgetting_the_hands_are_where_the_device_is_and_it_rests() {
    let (mut asked, mut spared) = (two(&[]), two(&[]));
    let from = asked.report().hands();
    let moves = pushed([40.0, 3.0], [30.0, 0.0]);
    asked.tick(&moves, 1, None).unwrap();
    while asked.report().hands() == from {
        asked.tick(&[], SOLVES, None).unwrap();
    }
    let reached = asked.report().clone();
    assert!(reached.behind[0].advance_mm > 1.0 && reached.converged);
    asked.forget();
    let shape = asked.shape().clone();
    let report = asked.step_together(&[]).unwrap();
    assert!(report.iterations == 0 && report.behind.is_empty());
    assert!(report.hands() == reached.hands() && asked.shape() == &shape);
    // It is where a command of that much leads.
    let by: Vec<Move> = (0..2)
        .map(|k| {
            let (to, from) = (reached.hand(k), from[k]);
            let advance_mm = to.inserted_mm - from.inserted_mm;
            let command =
                Command { advance_mm, rotate_rad: to.rotation_rad - from.rotation_rad, ..Command::default() };
            Move { instrument: k, command }
        })
        .collect();
    spared.step_together(&by).unwrap();
    assert!(apart_mm(&asked, &spared) < 0.02, "{}", apart_mm(&asked, &spared));
}

#[test]
fn a_device_on_its_way_comes_to_rest_where_its_hands_were_when_they_forgot() {
    let mut flying = in_flight();
    flying.tick(&[Move { instrument: 0, command: Command::rotate(0.5) }], 1, None).unwrap();
    assert!(flying.report().behind[0].rotate_rad >= 0.5);
    let turned_rad = flying.report().rotation_rad;
    flying.forget();
    assert_eq!(flying.report().behind, [Command::default()]);
    let report = flying.step_together(&[]).unwrap();
    assert!(report.converged && report.behind.is_empty() && report.jumped);
    assert_eq!(report.rotation_rad, turned_rad);
}

#[test]
fn a_snap_is_one_jump_however_many_ticks_it_takes_and_ends_as_in_a_step() {
    const TURN_RAD: f64 = 0.05;
    let mut stepping = whipping(Tuning::default());
    for _ in 0..32 {
        stepping.step(Command::advance(5.0)).unwrap();
    }
    let mut ticking = stepping.clone();
    let (mut jumps, mut deepest_mm) = ([0, 0], 0.0f64);
    let mut released_mj = [0.0, 0.0];
    let mut add = |which: usize, report: &StepReport| {
        jumps[which] += usize::from(report.jumped);
        released_mj[which] += report.jump.map_or(0.0, |jump| jump.released_mj);
    };
    let mut seen = |report: &StepReport| deepest_mm = deepest_mm.max(report.max_penetration_mm);
    // Where in a part it snaps is not known, and so not with which of the hand's torques before and after.
    let (mut torque_nmm, mut unknown_mj) = (0.0, 0.0);
    for _ in 0..100 {
        let moves = [Move { instrument: 0, command: Command::rotate(TURN_RAD) }];
        let report = stepping.step_together(&moves).unwrap();
        if report.jumped {
            unknown_mj += TURN_RAD * (report.torque_nmm - torque_nmm).abs();
        }
        torque_nmm = report.torque_nmm;
        add(0, report);
        let report = ticking.tick(&moves, 2, None).unwrap();
        add(1, report);
        seen(report);
    }
    let mut ticks = 0;
    while !ticking.report().behind.is_empty() && ticks < 400 {
        let report = ticking.tick(&[], 2, None).unwrap();
        add(1, report);
        seen(report);
        ticks += 1;
    }
    // It takes several ticks, in which the device waits.
    assert!(jumps == [1, 1] && (5..400).contains(&ticks), "{jumps:?} {ticks}");
    assert!(unknown_mj < 0.1 * released_mj[0], "{unknown_mj} {released_mj:?}");
    assert!((released_mj[1] - released_mj[0]).abs() < unknown_mj, "{unknown_mj} {released_mj:?}");
    let [a, b] = [&ticking, &stepping].map(|each| each.shape().tip_mm().unwrap());
    assert!((a - b).norm() < 1e-3, "{a} {b}");
    // On its way its axis stays in the lumen, up to the distance of the contact surface from its triangles.
    assert!(deepest_mm < 0.4 + 0.01, "{deepest_mm}");
}

/// To and fro by 1.5 mm in a second.
fn heaving() -> MotionMode {
    MotionMode {
        waveform: Waveform::Breathing,
        period_s: Some(1.0),
        phase: 0.0,
        displacement_mm: [1.5, 0.0, 0.0],
        turn: None,
        still: None,
        within: None,
    }
}

/// Solves of a tick that are enough for any of these commands.
const ENOUGH: usize = 1_000_000;

#[test]
fn ticks_with_enough_solves_are_steps_to_the_bit() {
    for motion in [&[][..], &[heaving()]] {
        let (mut ticking, mut stepping, mut hurried) = (two(motion), two(motion), two(motion));
        for tick in 1..=40u32 {
            let moves = pushed([1.0, 0.1], [0.5, 0.0]);
            let time_s = (!motion.is_empty()).then(|| 5e-3 * f64::from(tick));
            stepping.step_until(&moves, time_s).unwrap();
            let report = ticking.tick(&moves, ENOUGH, time_s).unwrap();
            assert!(report.behind.is_empty());
            hurried.tick(&moves, 1, time_s).unwrap();
        }
        let [a, b, c] = [&ticking, &stepping, &hurried].map(|each| bytes(&each.state()));
        assert!(a == b, "{}", apart_mm(&ticking, &stepping));
        // Counter-check: with few solves they are not.
        assert!(a != c);
    }
}

#[test]
fn a_vessel_that_moves_takes_the_device_along_in_every_tick() {
    let mut ticking = two(&[heaving()]);
    for tick in 1..=150u32 {
        let time_s = 1e-3 * f64::from(tick);
        let report = ticking.tick(&hands(1, u64::from(tick)), 6, Some(time_s)).unwrap();
        assert!(report.max_penetration_mm < 0.1, "{}", report.max_penetration_mm);
        assert_eq!(ticking.time_s(), time_s);
    }
    // Once the hands rest, ticks reach an equilibrium at the vessel's position.
    let mut ticks = 0;
    while !ticking.report().behind.is_empty() && ticks < 100 {
        ticking.tick(&[], 6, None).unwrap();
        ticks += 1;
    }
    assert!(ticks < 100 && ticking.report().converged);
}

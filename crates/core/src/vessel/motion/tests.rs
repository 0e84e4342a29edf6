use nalgebra::{Matrix3, Rotation3, Unit};

use super::*;
use crate::random::{splitmix64, unit};

fn mode(waveform: Waveform) -> MotionMode {
    MotionMode {
        waveform,
        period_s: (waveform != Waveform::Steady).then_some(4.0),
        phase: 0.0,
        displacement_mm: [0.0, 1.0, 10.0],
        turn: None,
        still: None,
        within: None,
    }
}

fn around(radius_mm: f64, fade_mm: f64) -> Around {
    Around { centre_mm: [3.0, -2.0, 5.0], radius_mm, fade_mm }
}

fn turn(angle_deg: f64) -> Turn {
    Turn { centre_mm: [5.0, 0.0, 1.0], axis: [1.0, 2.0, 0.5], angle_deg }
}

/// A motion with all modes at once, at its maximum.
fn field() -> Displacement {
    let still = MotionMode { still: Some(around(10.0, 90.0)), ..mode(Waveform::Breathing) };
    let displacement_mm = [2.0, -1.0, 0.0];
    let beat = MotionMode {
        displacement_mm,
        turn: Some(turn(2.0)),
        within: Some(around(20.0, 60.0)),
        ..mode(Waveform::Breathing)
    };
    let turned = MotionMode { turn: Some(turn(2.0)), ..mode(Waveform::Steady) };
    VesselMotion::new(&[still, beat, turned]).unwrap().unwrap().at(2.0)
}

fn places(seed: u64) -> impl Iterator<Item = Vec3> {
    (0..200).map(move |k| Vec3::from_fn(|i, _| 240.0 * (unit(splitmix64(seed, 3 * k + i as u64)) - 0.5)))
}

#[test]
fn derivatives_are_those_of_the_field() {
    let field = field();
    let h = 1e-4;
    let mut largest: f64 = 0.0;
    for x in places(1) {
        let (gradient, local) = (field.gradient(&x), field.local(&x));
        for l in 0..3 {
            let step = Vec3::ith(l, h);
            let slope = (field.place(&(x + step)) - field.place(&(x - step))) / (2.0 * h);
            assert!((slope - gradient.column(l)).norm() < 1e-9, "{x}");
            let bend = (field.gradient(&(x + step)) - field.gradient(&(x - step))) / (2.0 * h);
            for k in 0..3 {
                for m in 0..3 {
                    assert!((bend[(k, m)] - local.second[k][(m, l)]).abs() < 1e-9, "{x} {k} {l} {m}");
                    largest = largest.max(bend[(k, m)].abs());
                }
            }
        }
        assert!((gradient * local.inverse - Matrix3::identity()).norm() < 1e-14);
        assert!((gradient - Matrix3::identity()).norm() < 3.0 * STEEPEST);
    }
    assert!(largest > 1e-3);
}

#[test]
fn every_place_has_its_material_point() {
    let field = field();
    let mut farthest: f64 = 0.0;
    for x in places(2) {
        let material = field.material(&x);
        assert!((field.place(&material) - x).norm() < 1e-13, "{x}");
        assert!((field.material(&field.place(&x)) - x).norm() < 1e-12, "{x}");
        farthest = farthest.max((x - material).norm());
    }
    assert!(farthest > 10.0);
}

#[test]
fn the_bound_of_the_gradient_is_one() {
    let mut modes = [mode(Waveform::Steady); 2];
    modes[0].still = Some(around(10.0, 90.0));
    (modes[1].turn, modes[1].within) = (Some(turn(2.0)), Some(around(5.0, 80.0)));
    modes[1].displacement_mm = [2.0, 0.0, 0.0];
    let motion = VesselMotion::new(&modes).unwrap().unwrap();
    let field = motion.at(0.0);
    let mut largest: f64 = 0.0;
    for x in places(3).chain(places(4)) {
        let steep = (field.gradient(&x) - Matrix3::identity()).svd(false, false).singular_values.max();
        assert!(steep <= motion.steepest);
        largest = largest.max(steep);
        assert!(field.displacement_mm(&x).norm() <= motion.farthest_mm(&x, 0.0) + 1e-12);
        assert!(field.displacement_mm(&x).norm() <= motion.farthest_mm(&(x + Vec3::x()), 1.0) + 1e-12);
    }
    assert!(largest > 0.3 * motion.steepest);
}

#[test]
fn a_rigid_motion_is_one() {
    let mut rigid = mode(Waveform::Steady);
    rigid.turn = Some(turn(20.0));
    let field = VesselMotion::new(&[rigid]).unwrap().unwrap().at(7.0);
    let axis = Unit::new_normalize(Vec3::new(1.0, 2.0, 0.5));
    let rotation = Rotation3::from_axis_angle(&axis, 20f64.to_radians());
    let centre = Vec3::new(5.0, 0.0, 1.0);
    for x in places(5) {
        let moved = centre + rotation * (x - centre) + Vec3::new(0.0, 1.0, 10.0);
        assert!((field.place(&x) - moved).norm() < 1e-13);
        assert!((field.material(&moved) - x).norm() < 1e-13);
        assert_eq!(field.local(&x).second, [Matrix3::zeros(); 3]);
    }
}

#[test]
fn waveforms_begin_and_end_at_rest_and_reach_what_they_are_said_to() {
    for (waveform, peak_s) in [(Waveform::Breathing, 2.0), (Waveform::Heartbeat, 0.8)] {
        let mut one = mode(waveform);
        let motion = VesselMotion::new(&[one]).unwrap().unwrap();
        let moved = |time_s: f64| motion.at(time_s).displacement_mm(&Vec3::zeros());
        assert_eq!(moved(0.0), Vec3::zeros());
        assert_eq!(moved(8.0), Vec3::zeros());
        assert!((moved(peak_s) - Vec3::new(0.0, 1.0, 10.0)).norm() < 1e-12);
        assert!((moved(peak_s + 400.0) - moved(peak_s)).norm() < 1e-9);
        one.phase = 0.25;
        let later = VesselMotion::new(&[one]).unwrap().unwrap().at(peak_s - 1.0);
        assert!((later.displacement_mm(&Vec3::zeros()) - moved(peak_s)).norm() < 1e-12);
        assert!(motion.changes());
    }
    assert!(!VesselMotion::new(&[mode(Waveform::Steady)]).unwrap().unwrap().changes());
    assert!(VesselMotion::new(&[]).unwrap().is_none());
}

#[test]
fn what_makes_no_sense_is_refused_with_its_key() {
    let reported = |change: &dyn Fn(&mut MotionMode)| {
        let mut one = mode(Waveform::Breathing);
        change(&mut one);
        VesselMotion::new(&[mode(Waveform::Steady), one]).unwrap_err().to_string()
    };
    type Change<'a> = &'a dyn Fn(&mut MotionMode);
    let cases: [(Change<'_>, &str); 11] = [
        (&|m| m.period_s = None, "vessel.motion[1].period_s = none"),
        (&|m| m.period_s = Some(-1.0), "vessel.motion[1].period_s"),
        (&|m| m.waveform = Waveform::Steady, "what is steady has no period"),
        (&|m| m.phase = 1.5, "vessel.motion[1].phase"),
        (&|m| m.displacement_mm = [f64::NAN, 0.0, 0.0], "vessel.motion[1].displacement_mm"),
        (&|m| m.displacement_mm = [0.0; 3], "nothing moves"),
        (&|m| m.turn = Some(Turn { axis: [0.0; 3], ..turn(1.0) }), "vessel.motion[1].turn.axis"),
        (&|m| m.turn = Some(turn(f64::INFINITY)), "vessel.motion[1].turn.angle_deg"),
        (&|m| (m.turn, m.within) = (Some(turn(40.0)), Some(around(20.0, 60.0))), "below 0.5"),
        (&|m| m.still = Some(around(1.0, 0.0)), "vessel.motion[1].still.fade_mm"),
        (&|m| m.within = Some(around(1.0, 30.0)), "fade over a longer way"),
    ];
    for (change, words) in cases {
        assert!(reported(change).contains(words), "{words}: {}", reported(change));
    }
    let both = reported(&|m| (m.still, m.within) = (Some(around(1.0, 90.0)), Some(around(1.0, 90.0))));
    assert!(both.contains("keep one of the two"), "{both}");
}

#[test]
fn a_whole_vessel_may_turn_by_any_angle_and_keeps_its_lengths() {
    let turned = |angle_deg: f64, within: Option<Around>| {
        let one = MotionMode { turn: Some(turn(angle_deg)), within, ..mode(Waveform::Steady) };
        VesselMotion::new(&[one])
    };
    let field = turned(170.0, None).unwrap().unwrap().at(0.0);
    assert_eq!(field.stretch(), 1.0);
    for x in places(5) {
        assert!((field.material(&field.place(&x)) - x).norm() < 1e-10, "{x}");
    }
    // A part of it may not.
    let refused = turned(30.0, Some(around(20.0, 60.0))).unwrap_err().to_string();
    assert!(refused.contains("vessel.motion") && refused.contains("turn less"), "{refused}");
}

use super::*;
use crate::device::Section;
use crate::vessel::anatomy;

/// A path along z of radius 2 mm that narrows to 1 mm in the middle.
fn narrowing() -> CentrelinePath {
    let radius_mm = |z: f64| 0.5 + 1.5 * ((z - 50.0).abs() / 10.0).min(1.0);
    let points = (0..=100).map(f64::from).map(|z| (Vec3::z() * z, radius_mm(z)));
    CentrelinePath::new(points.collect()).unwrap()
}

/// Straight for 60 mm, a bend, and straight again, with this radius of the lumen.
fn bend(bend_mm: f64, degrees: f64, radius_mm: f64) -> CentrelinePath {
    bend_between(60.0, bend_mm, degrees, radius_mm)
}

/// As [`bend`], with straight pieces of this length.
fn bend_between(leg: f64, bend_mm: f64, degrees: f64, radius_mm: f64) -> CentrelinePath {
    let arc = bend_mm * degrees.to_radians();
    let at = |s: f64| {
        let angle = (s - leg).clamp(0.0, arc) / bend_mm;
        let corner = Vec3::new(bend_mm * (1.0 - angle.cos()), 0.0, s.min(leg) + bend_mm * angle.sin());
        corner + Vec3::new(angle.sin(), 0.0, angle.cos()) * (s - leg - arc).max(0.0)
    };
    let count = ((2.0 * leg + arc) / 0.5) as usize;
    let points = (0..=count).map(|k| (at((2.0 * leg + arc) * k as f64 / count as f64), radius_mm));
    CentrelinePath::new(points.collect()).unwrap()
}

fn wire(radius_mm: f64, stiffness: f64) -> Device {
    Device::uniform(400.0, radius_mm, stiffness).unwrap()
}

#[test]
fn a_narrowing_lets_pass_what_is_thinner() {
    for (radius_mm, passage) in
        [(0.4, Passage::Passes), (0.48, Passage::Tight), (0.515, Passage::Tight), (0.56, Passage::Blocked)]
    {
        let found = passable(&narrowing(), &wire(radius_mm, 10.0), NO_FORCE_N).unwrap();
        assert_eq!(found.passage, passage, "{radius_mm}: {:?}", found.narrowest);
        assert!((found.narrowest.arc_mm - 50.0).abs() < 1.0, "{:?}", found.narrowest);
        assert!((found.narrowest.clearance_mm - (0.5 - radius_mm)).abs() < 0.08, "{:?}", found.narrowest);
        // A blocked device gets to where the lumen, with the possible error of the wall, is as wide as the device.
        let reaches_mm =
            if passage == Passage::Blocked { 50.0 - 10.0 * (0.56 / 1.05 - 0.5) / 1.5 } else { 100.0 };
        assert!((found.reaches_mm - reaches_mm).abs() < 0.3, "{radius_mm}: {}", found.reaches_mm);
    }
    // A thick shaft that stays before the narrow point does not block, and one that must enter does.
    let shaft = |tip_mm: f64| {
        let sections = vec![Section::straight(tip_mm, 0.3, 10.0), Section::straight(300.0, 1.0, 10.0)];
        passable(&narrowing(), &Device::new(sections).unwrap(), NO_FORCE_N).unwrap().passage
    };
    assert_eq!([shaft(60.0), shaft(40.0)], [Passage::Passes, Passage::Blocked]);
    let short = passable(&narrowing(), &Device::uniform(80.0, 0.3, 10.0).unwrap(), NO_FORCE_N).unwrap();
    assert_eq!(short.passage, Passage::Short);
    assert!((short.reaches_mm - 80.0).abs() < 0.1, "{}", short.reaches_mm);
}

#[test]
fn the_room_lets_a_device_cut_a_bend() {
    let sharpest = |way: &CentrelinePath| passable(way, &wire(0.5, 10.0), NO_FORCE_N).unwrap().sharpest;
    // With almost no clearance the path is the centre line's.
    let narrow = sharpest(&bend(30.0, 90.0, 0.52));
    assert!((narrow.cut_radius_mm / 30.0 - 1.0).abs() < 0.1, "{narrow:?}");
    // The moment of a wire that touches the outer wall, the inner one in the middle of the bend and the outer one
    // again is a triangle: for a small angle θ the radius in the middle is ¾ρ + 12 room/θ².
    let (bend_mm, degrees, room_mm) = (100.0, 20.0_f64, 1.0);
    let expected_mm = 0.75 * bend_mm + 12.0 * room_mm / degrees.to_radians().powi(2);
    // It enters at the middle, far away.
    let wide = sharpest(&bend_between(160.0, bend_mm, degrees, 0.5 + room_mm));
    assert!((wide.cut_radius_mm / expected_mm - 1.0).abs() < 0.05, "{wide:?} {expected_mm}");
    assert!((wide.bend_radius_mm / bend_mm - 1.0).abs() < 0.1, "{wide:?}");
    // A slight bend is straight for a wire with clearance.
    let [slight, narrow] = [4.0, 0.52].map(|lumen_mm| sharpest(&bend(30.0, 3.0, lumen_mm)));
    assert!(slight.cut_radius_mm > 1e4 && narrow.cut_radius_mm < 200.0, "{slight:?} {narrow:?}");
}

#[test]
fn a_sharp_corner_in_a_wide_lumen_is_cut() {
    // An artery of 4 mm leaves one of 11 mm at a right angle, as in tables of anatomies.
    let points = [(0.0, 0.0, 11.0), (0.0, 60.0, 11.0), (14.0, 60.0, 4.0), (60.0, 60.0, 4.0)];
    let way = points.map(|(x, z, radius_mm)| (Vec3::new(x, 0.0, z), radius_mm)).to_vec();
    let found = passable(&CentrelinePath::new(way).unwrap(), &wire(0.3, 1.0), NO_FORCE_N).unwrap();
    assert!(found.sharpest.cut_radius_mm > 8.0, "{:?}", found.sharpest);
}

#[test]
fn a_device_lies_on_the_outer_side_of_a_wide_bend_and_is_longer_there() {
    let (bend_mm, room_mm) = (33.0, 13.0);
    let way = bend(bend_mm, 180.0, room_mm);
    let found = passable(&way, &wire(0.01, 1.0), NO_FORCE_N).unwrap();
    // Half a circle about the outer side; slightly less, because a wire cuts the start and end of the bend.
    let longer_mm = found.taken_mm - found.length_mm;
    assert!((0.75..1.0).contains(&(longer_mm / (std::f64::consts::PI * room_mm))), "{longer_mm}");
    assert!((bend_mm..bend_mm + room_mm).contains(&found.sharpest.cut_radius_mm), "{:?}", found.sharpest);
    // So a device with the length of the centre line is too short.
    let short = Device::uniform(found.length_mm, 0.01, 1.0).unwrap();
    assert_eq!(passable(&way, &short, NO_FORCE_N).unwrap().passage, Passage::Short);
}

#[test]
fn a_stiff_device_is_tight_in_a_bend_that_a_soft_or_a_curved_one_takes() {
    let way = bend(30.0, 90.0, 1.0);
    let of = |device: &Device| passable(&way, device, NO_FORCE_N).unwrap();
    // √(EI / 2F): 22 mm and 71 mm.
    let (soft, stiff) = (of(&wire(0.5, 100.0)), of(&wire(0.5, 1000.0)));
    assert_eq!([soft.passage, stiff.passage], [Passage::Passes, Passage::Tight]);
    assert!((stiff.sharpest.bears_radius_mm - 5000.0_f64.sqrt()).abs() < 1e-9);
    assert!((60.0..120.0).contains(&stiff.sharpest.arc_mm), "{:?}", stiff.sharpest);
    let curved =
        Section { rest_curvature_per_mm: [0.0, 1.0 / 30.0], ..Section::straight(400.0, 0.5, 1000.0) };
    assert_eq!(of(&Device::new(vec![curved]).unwrap()).passage, Passage::Passes);
    let more = passable(&way, &wire(0.5, 1000.0), 2.0).unwrap();
    assert_eq!(more.passage, Passage::Passes);
    for force_n in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(passable(&way, &wire(0.5, 10.0), force_n).unwrap_err().to_string().starts_with("force_n = "));
    }
}

#[test]
fn a_whole_anatomy_is_looked_at() {
    let tree = anatomy::tree("hepatic").unwrap();
    let way = tree.path_to(tree.target("left hepatic").unwrap().row).unwrap();
    let thin = passable(&way, &wire(0.4, 5.0), NO_FORCE_N).unwrap();
    let thick = passable(&way, &wire(1.4, 5.0), NO_FORCE_N).unwrap();
    assert_eq!(thick.passage, Passage::Blocked);
    assert_ne!(thin.passage, Passage::Blocked);
    assert!((thick.narrowest.lumen_radius_mm - 1.25).abs() < 1e-9, "{:?}", thick.narrowest);
}

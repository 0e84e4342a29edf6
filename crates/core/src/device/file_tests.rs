//! Device files: units, tapers, arcs, and all kinds of errors.

use std::f64::consts::PI;
use std::path::Path;

use super::{CutError, DeviceFile, Kind};
use crate::Vec3;

/// A valid catheter, to be invalidated one value at a time.
const GOOD: &str = r#"
name = "test"
kind = "catheter"
length_cm = 10.0
source = "all of it"

[[part]]
name = "tip"
bend = { radius_mm = 10.0, angle_deg = 90.0 }
outer_diameter_french = 6.0
inner_diameter_mm = 1.0
flexural_modulus_mpa = 100.0
material = "pebax_baso4_40"
coat = { material = "platinum", thickness_mm = 0.1 }
source = "the tip"

[[part]]
name = "taper"
length_mm = 20.0
outer_diameter_mm = [2.0, 3.0]
inner_diameter_mm = 1.0
bending_stiffness_nmm2 = [50.0, 100.0]
sections = 10

[[part]]
name = "shaft"
outer_diameter_mm = 3.0
inner_diameter_mm = 1.0
bending_stiffness_nmm2 = 100.0
torsional_stiffness_nmm2 = 70.0
"#;

fn read(text: &str) -> Result<DeviceFile, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("d.toml");
    std::fs::write(&path, text).unwrap();
    DeviceFile::read(&path).map_err(|e| e.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn a_whole_file_is_read() {
    let file = read(GOOD).unwrap();
    assert_eq!((file.name.as_str(), file.kind), ("test", Some(Kind::Catheter)));
    let names: Vec<&str> = file.parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["tip", "taper", "shaft"]);
    let sources: Vec<_> = file.parts.iter().map(|part| part.source.as_deref()).collect();
    assert_eq!(sources, [Some("the tip"), Some("all of it"), Some("all of it")]);
    let sections = file.device.sections();
    assert_eq!(sections.len(), 12);
    assert_eq!(file.device.length_mm(), 100.0);
    // The arc's length follows from radius and angle, and the shaft gets the remaining length.
    assert!((sections[0].length_mm - 5.0 * PI).abs() < 1e-12);
    assert!((sections[11].length_mm - (80.0 - 5.0 * PI)).abs() < 1e-12);
    // E π (D⁴ − d⁴)/64.
    assert!((sections[0].bending_stiffness_nmm2 - 100.0 * PI * 15.0 / 64.0).abs() < 1e-12);
    assert!((sections[0].torsion_nmm2() - sections[0].bending_stiffness_nmm2 / 1.3).abs() < 1e-12);
    assert_eq!(sections[11].torsional_stiffness_nmm2, Some(70.0));
    assert!(sections.iter().all(|section| section.inner_radius_mm == Some(0.5)));
}

#[test]
fn a_size_is_the_same_in_every_unit() {
    // 0.5 mm of radius, and 6 F of outer diameter.
    let outer =
        |key: &str| read(&GOOD.replace("outer_diameter_french = 6.0", key)).unwrap().device.sections()[0];
    let six_french = outer("outer_diameter_french = 6");
    assert_eq!(six_french.radius_mm, 1.0);
    for key in ["outer_diameter_mm = 2.0", "radius_mm = 1.0", "outer_diameter_inch = 0.07874015748031496"] {
        assert!((outer(key).radius_mm - 1.0).abs() < 1e-15, "{key}");
        let ei = outer(key).bending_stiffness_nmm2;
        assert!((ei / six_french.bending_stiffness_nmm2 - 1.0).abs() < 1e-14, "{key}");
    }
    let inner = |key: &str| {
        read(&GOOD.replacen("inner_diameter_mm = 1.0", key, 1)).unwrap().device.sections()[0].inner_radius_mm
    };
    for key in
        ["inner_diameter_french = 3.0", "inner_radius_mm = 0.5", "inner_diameter_inch = 0.03937007874015748"]
    {
        assert!((inner(key).unwrap() - 0.5).abs() < 1e-15, "{key}");
    }
    let gpa = read(&GOOD.replace("flexural_modulus_mpa = 100.0", "flexural_modulus_gpa = 0.1")).unwrap();
    assert_eq!(gpa, read(GOOD).unwrap());
    assert_eq!(read(&GOOD.replace("length_cm = 10.0", "length_mm = 100.0")).unwrap(), read(GOOD).unwrap());
}

#[test]
fn an_arc_turns_by_its_angle_in_its_direction() {
    for (angle_deg, direction_deg) in [(90.0f64, 0.0f64), (185.0, 180.0), (30.0, 90.0), (360.0, -45.0)] {
        let bend =
            format!("{{ radius_mm = 4.0, angle_deg = {angle_deg:?}, direction_deg = {direction_deg:?} }}");
        let file = read(&GOOD.replace("{ radius_mm = 10.0, angle_deg = 90.0 }", &bend)).unwrap();
        let tip = file.device.sections()[0];
        assert!((tip.length_mm - 4.0 * angle_deg.to_radians()).abs() < 1e-12);
        let shape = file.device.rest_shape(100.0, 0.5);
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let (side, ahead) = direction_deg.to_radians().sin_cos();
        let expected = Vec3::new(sin * ahead, sin * side, cos);
        assert!((shape.tangents.last().unwrap() - expected).norm() < 1e-12, "{angle_deg} {direction_deg}");
    }
}

#[test]
fn a_taper_is_cut_within_the_error_that_is_stated() {
    let cut_into = |count: usize| {
        let file = read(&GOOD.replace("sections = 10", &format!("sections = {count}"))).unwrap();
        let taper = file.parts[1].clone();
        assert_eq!(taper.sections().len(), count);
        // At dense samples the difference nowhere exceeds the stated one.
        let CutError { radius_mm, stiffness } = taper.cut_error();
        let mut largest = (0.0f64, 0.0f64);
        for k in 0..1000 {
            let place = (f64::from(k) + 0.5) / 1000.0;
            let truth = taper.at(place);
            let section = file.device.section_at(taper.from_tip_mm[0] + 20.0 * place);
            largest.0 = largest.0.max((section.radius_mm - truth.radius_mm).abs());
            largest.1 =
                largest.1.max((section.bending_stiffness_nmm2 / truth.bending_stiffness_nmm2 - 1.0).abs());
        }
        assert!(
            largest.0 <= radius_mm * (1.0 + 1e-9) && largest.0 > 0.9 * radius_mm,
            "{largest:?} {radius_mm}"
        );
        assert!(
            largest.1 <= stiffness * (1.0 + 1e-9) && largest.1 > 0.9 * stiffness,
            "{largest:?} {stiffness}"
        );
        // Half of a cut: the radius changes by 0.5 mm and EI by 50 of 50 N·mm² along the part.
        assert!((radius_mm - 0.25 / count as f64).abs() < 1e-12);
        assert!((stiffness - 0.5 / count as f64).abs() < 1e-12);
        stiffness
    };
    assert!((cut_into(10) / cut_into(20) - 2.0).abs() < 1e-9);
    cut_into(1);
    // With a given modulus EI follows the fourth power of the diameter.
    let wire = "name = \"w\"\nkind = \"microwire\"\n[[part]]\nname = \"core\"\nlength_mm = 40.0\nsections = 4\n\
                outer_diameter_inch = [0.005, 0.010]\nflexural_modulus_gpa = 60\n";
    let core = read(wire).unwrap().parts[0].clone();
    assert!((core.at(1.0).bending_stiffness_nmm2 / core.at(0.0).bending_stiffness_nmm2 - 16.0).abs() < 1e-12);
    assert_eq!(
        core.cut_error().stiffness,
        core.sections()[0].bending_stiffness_nmm2 / core.at(0.0).bending_stiffness_nmm2 - 1.0
    );
}

#[test]
fn a_file_of_sections_is_a_file_of_parts() {
    let text = "[[section]]\nlength_mm = 5\nradius_mm = 0.4\nbending_stiffness_nmm2 = 1\ninner_radius_mm = 0.2\n\
                [[section]]\nlength_mm = 7\nradius_mm = 0.5\nbending_stiffness_nmm2 = 2\n";
    let file = read(text).unwrap();
    assert_eq!((file.name.as_str(), file.kind), ("d", None));
    assert_eq!((file.parts[1].name.as_str(), file.parts[1].from_tip_mm), ("section 1", [5.0, 12.0]));
    let of_parts: Vec<_> = file.parts.iter().flat_map(super::Part::sections).collect();
    assert_eq!(of_parts, file.device.sections());
}

#[test]
#[allow(clippy::too_many_lines, reason = "a table of faults and what is said of them")]
fn what_is_wrong_is_named_by_file_part_key_and_value() {
    let out_of_range = "must be a number above 0 and at most";
    for (from, to, reported) in [
        // Values.
        (
            "french = 6.0",
            "french = -6.0",
            "part \"tip\".outer_diameter_french = -6: must be a number above 0 and at most 300",
        ),
        ("length_mm = 20.0", "length_mm = nan", "part \"taper\".length_mm = NaN: must be"),
        ("radius_mm = 10.0", "radius_mm = 0.0", "part \"tip\".bend.radius_mm = 0: must be"),
        (
            "radius_mm = 10.0",
            "radius_mm = 0.5",
            "part \"tip\".bend.radius_mm = 0.5: must be at least the part's own radius, 1.0000 mm",
        ),
        ("angle_deg = 90.0", "angle_deg = 2000.0", "part \"tip\".bend.angle_deg = 2000: must be"),
        (
            "90.0 }",
            "90.0, direction_deg = 400.0 }",
            "part \"tip\".bend.direction_deg = 400: must be a number from -360 to 360",
        ),
        ("mpa = 100.0", "mpa = 1e9", "part \"tip\".flexural_modulus_mpa = 1e9: must be"),
        ("[50.0, 100.0]", "[50.0, -1.0]", "part \"taper\".bending_stiffness_nmm2 = -1: must be"),
        ("nmm2 = 70.0", "nmm2 = 0.0", "part \"shaft\".torsional_stiffness_nmm2 = 0: must be"),
        ("length_cm = 10.0", "length_cm = 1e5", "device.length_cm = 100000: must be"),
        ("sections = 10", "sections = 0", "part \"taper\".sections = 0: must be 1 to 200"),
        ("sections = 10", "sections = 201", "part \"taper\".sections = 201: must be 1 to 200"),
        // Layers.
        (
            "inner_diameter_mm = 1.0",
            "inner_diameter_french = 6.0",
            "part \"tip\".inner_diameter_french = 6: is a radius of 1.0000 mm: must be less",
        ),
        (
            "[2.0, 3.0]",
            "[0.9, 3.0]",
            "part \"taper\".inner_diameter_mm = 1: is a radius of 0.5000 mm: must be less than the outer one, 0.4500 mm",
        ),
        (
            "thickness_mm = 0.1",
            "thickness_mm = 0.5",
            "part \"tip\".coat.thickness_mm = 0.5: must be above 0 and less than the wall, 0.5000 mm",
        ),
        ("thickness_mm = 0.1", "thickness_mm = 0.0", "part \"tip\".coat.thickness_mm = 0: must be above 0"),
        // Missing values.
        (
            "outer_diameter_french = 6.0",
            "",
            "part \"tip\".outer_diameter_mm = absent: give outer_diameter_mm, outer_diameter_inch",
        ),
        (
            "flexural_modulus_mpa = 100.0",
            "",
            "part \"tip\".bending_stiffness_nmm2 = absent: give bending_stiffness_nmm2",
        ),
        (
            "inner_diameter_mm = 1.0",
            "",
            "part \"tip\".inner_diameter_mm = absent: the device is a tube by its kind",
        ),
        ("sections = 10", "", "part \"taper\".sections = absent: the part is tapered"),
        ("kind = \"catheter\"", "", "kind = absent: say what it is"),
        ("length_cm = 10.0", "", "part \"shaft\".length_mm = absent: give it, or the device's own"),
        ("length_mm = 20.0", "", "part \"shaft\".length_mm = absent: part \"taper\" leaves it out too"),
        // Values given twice or without effect.
        (
            "length_cm = 10.0",
            "length_cm = 10.0\nlength_mm = 100.0",
            "device.length_cm = 10: length_mm is given too: keep one",
        ),
        (
            "french = 6.0",
            "french = 6.0\nouter_diameter_mm = 2.0",
            "part \"tip\".outer_diameter_french = 6: outer_diameter_mm is given too",
        ),
        (
            "inner_diameter_mm = 1.0",
            "inner_diameter_mm = 1.0\ninner_radius_mm = 0.5",
            "part \"tip\".inner_diameter_mm = 1: inner_radius_mm is given too",
        ),
        (
            "mpa = 100.0",
            "mpa = 100.0\nflexural_modulus_gpa = 0.1",
            "part \"tip\".flexural_modulus_gpa = 0.1: flexural_modulus_mpa is given too",
        ),
        (
            "mpa = 100.0",
            "mpa = 100.0\nbending_stiffness_nmm2 = 5",
            "part \"tip\".flexural_modulus_mpa = 100: bending_stiffness_nmm2 is given too",
        ),
        ("bend = ", "length_mm = 15.7\nbend = ", "part \"tip\".length_mm = 15.7: bend has the length"),
        (
            "bend = ",
            "rest_curvature_per_mm = [0.1, 0.0]\nbend = ",
            "part \"tip\".rest_curvature_per_mm = [0.1, 0.0]: bend is given too",
        ),
        (
            "nmm2 = 70.0",
            "nmm2 = 70.0\nsections = 3",
            "part \"shaft\".sections = 3: nothing in the part is tapered",
        ),
        // Lengths that do not add up.
        (
            "length_mm = 20.0",
            "length_mm = 90.0",
            "part \"shaft\".length_mm = absent: the other parts have 105.7",
        ),
        ("nmm2 = 70.0", "nmm2 = 70.0\nlength_mm = 60.0", "device.length_cm = 10: the parts have 95.7"),
        // Keys and words.
        ("outer_diameter_french", "outer_diameter_frensh", "unknown field `outer_diameter_frensh`"),
        ("outer_diameter_french", "outer_diameter_frensh", "did you mean `outer_diameter_french`?"),
        ("angle_deg", "angle_rad", "did you mean `angle_deg`?"),
        ("thickness_mm", "thicknes_mm", "did you mean `thickness_mm`?"),
        ("kind = \"catheter\"", "kind = \"cateter\"", "did you mean `catheter`?"),
        ("french = 6.0", "french = \"6 F\"", "outer_diameter_french: must be a number, or two"),
        ("[50.0, 100.0]", "[1, 2, 3]", "must be a number, or two of a taper"),
        (
            "source = \"the tip\"",
            "source = \"the tip\"\n[[section]]\nlength_mm = 1\nradius_mm = 1\nbending_stiffness_nmm2 = 1",
            "part = 3 tables: section is given too",
        ),
    ] {
        assert!(GOOD.contains(from), "{from}");
        let error = read(&GOOD.replacen(from, to, 1)).expect_err(reported);
        assert!(
            error.starts_with("d.toml: ") && error.contains(reported),
            "wanted: {reported}\ngot: {error}"
        );
        assert!(!reported.ends_with("must be") || error.contains(out_of_range), "{error}");
    }
    let error = DeviceFile::read(Path::new("no/such.toml")).unwrap_err();
    assert!(error.to_string().starts_with("no/such.toml: "), "{error}");
}

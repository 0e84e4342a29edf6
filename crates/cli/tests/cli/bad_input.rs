//! Bad input ends with exit code 2 and one clear line that names file, key and value; nothing panics.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::said;

/// A working scene in a folder of its own, to be spoilt one value at a time.
struct Scene {
    folder: tempfile::TempDir,
    text: String,
}

const GOOD: &str = r#"
[vessel]
tree = "tube.csv"
edge_mm = 2.0

[[device.section]]
length_mm = 60.0
radius_mm = 0.5
bending_stiffness_nmm2 = 10.0

[sheath]
position_mm = [1.0, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]

[[script]]
advance_mm = 20.0
step_mm = 2.0
"#;

const TUBE: &str = "0 0 0 4 -1\n80 0 0 4 0\n";

impl Scene {
    fn good() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("tube.csv"), TUBE).unwrap();
        Self { folder, text: GOOD.to_owned() }
    }

    fn with(mut self, from: &str, to: &str) -> Self {
        assert!(self.text.contains(from), "{from} is not in the scene");
        self.text = self.text.replace(from, to);
        self
    }

    fn file(self, name: &str, bytes: &[u8]) -> Self {
        std::fs::write(self.path(name), bytes).unwrap();
        self
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self) -> Output {
        std::fs::write(self.path("scene.toml"), &self.text).unwrap();
        endowire(&[
            "run".as_ref(),
            self.path("scene.toml").as_ref(),
            "--out".as_ref(),
            self.path("out").as_ref(),
        ])
    }

    /// Runs, expects exit code 2 and a single line with all of `words`.
    fn is_refused(&self, words: &[&str]) {
        let output = self.run();
        let text = said(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert_eq!(text.trim_end().lines().count(), 1, "one line is wanted: {text}");
        for word in words {
            assert!(text.contains(word), "`{word}` is missing in: {text}");
        }
    }
}

fn endowire(args: &[&Path]) -> Output {
    crate::common::endowire().args(args).output().unwrap()
}

#[test]
fn the_scene_that_is_spoilt_below_is_good() {
    let output = Scene::good().run();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
}

#[test]
fn a_missing_scene_is_named() {
    let output = endowire(&["run".as_ref(), "no/such/scene.toml".as_ref()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("no/such/scene.toml"));
}

#[test]
fn a_missing_vessel_or_device_file_is_named() {
    Scene::good().with("tube.csv", "gone.csv").is_refused(&["vessel.tree", "gone.csv"]);
    Scene::good().with("tube.csv", "aortic_arch").is_refused(&[
        "vessel.tree",
        "a scene names a table",
        "endowire new DIR --vessel aortic_arch",
    ]);
    Scene::good()
        .with("[[device.section]]", "[device]\nfile = \"gone.toml\"\n[[device.section]]")
        .is_refused(&["device"]);
    let sections = &GOOD[GOOD.find("[[device.section]]").unwrap()..GOOD.find("[sheath]").unwrap()];
    Scene::good().with(sections, "[device]\nfile = \"gone.toml\"\n").is_refused(&["gone.toml"]);
}

#[test]
fn a_wrong_key_comes_with_the_nearest_right_one() {
    Scene::good().with("radius_mm", "radius").is_refused(&[
        "scene.toml",
        "line 8",
        "`radius`",
        "did you mean `radius_mm`?",
    ]);
    Scene::good().with("step_mm", "stepmm").is_refused(&["`stepmm`", "did you mean `step_mm`?"]);
    Scene::good().with("[sheath]", "[sheat]").is_refused(&["`sheat`", "did you mean `sheath`?"]);
    Scene::good()
        .with("[sheath]", "[view]\nsise_px = [8, 8]\n[sheath]")
        .is_refused(&["`sise_px`", "did you mean `size_px`?"]);
    Scene::good()
        .with("[sheath]", "[method]\nname = \"li2011-bandet\"\n[sheath]")
        .is_refused(&["li2011-bandet", "did you mean `li2011-banded`?"]);
}

#[test]
fn lists_that_are_too_long_are_named_by_line_and_key() {
    for (from, to, words) in [
        (
            "position_mm = [1.0, 0.0, 0.0]",
            "position_mm = [1, 0, 0, 77]",
            ["line 12: position_mm: must be a list of 3", "not of 4"],
        ),
        (
            "radius_mm = 0.5",
            "radius_mm = 0.5\nrest_curvature_per_mm = [0.02, 0.0, 0.5]",
            ["line 9: rest_curvature_per_mm: must be a list of 2", "not of 3"],
        ),
        ("[sheath]", "[view]\nsize_px = [8, 8, 8]\n[sheath]", ["size_px: must be a list of 2", "not of 3"]),
        (
            "[sheath]",
            "[[vessel.wall.region]]\ncentre_mm = [1, 2, 3, 4]\nradius_mm = 1\nfriction = 0.1\n[sheath]",
            ["centre_mm: must be a list of 3", "not of 4"],
        ),
    ] {
        Scene::good().with(from, to).is_refused(&words);
    }
}

#[test]
fn a_table_of_the_method_without_a_name_is_that_of_the_default() {
    let with = |table: &str| Scene::good().with("[sheath]", &format!("[method]\n{table}\n[sheath]"));
    let output = with("element_mm = 4.0").run();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(said(&output).contains("kirchhoff"), "{}", said(&output));
    with("wall_stiffness_n_per_mm = 1.0").is_refused(&["unknown field `wall_stiffness_n_per_mm`"]);
    with("element_mm = true").is_refused(&["element_mm: must be a number, not true"]);
}

#[test]
fn values_that_are_not_finite_are_named() {
    Scene::good().with("radius_mm = 0.5", "radius_mm = nan").is_refused(&[
        "scene.toml",
        "device.section[0].radius_mm",
        "NaN",
    ]);
    Scene::good().with("= 10.0", "= inf").is_refused(&["bending_stiffness_nmm2", "inf"]);
    Scene::good()
        .with("[1.0, 0.0, 0.0]\ndirection", "[nan, 0.0, 0.0]\ndirection")
        .is_refused(&["sheath.position_mm", "NaN"]);
    Scene::good().with("advance_mm = 20.0", "advance_mm = nan").is_refused(&["script[0].advance_mm", "NaN"]);
    Scene::good().file("tube.csv", b"0 0 0 4 -1\n80 0 nan 4 0\n").is_refused(&["tube.csv", "line 2"]);
}

#[test]
fn a_device_without_length_is_refused() {
    Scene::good()
        .with("length_mm = 60.0", "length_mm = 0.0")
        .is_refused(&["device.section[0].length_mm = 0"]);
    Scene::good().with("length_mm = 60.0", "length_mm = -60.0").is_refused(&["length_mm = -60"]);
}

#[test]
fn a_sheath_outside_the_vessel_is_refused() {
    Scene::good().with("position_mm = [1.0, 0.0, 0.0]", "position_mm = [1.0, 9.0, 0.0]").is_refused(&[
        "sheath.position_mm",
        "[1, 9, 0]",
        "outside",
    ]);
    Scene::good()
        .with("position_mm = [1.0, 0.0, 0.0]\ndirection = [1.0, 0.0, 0.0]", "opening = 7")
        .is_refused(&["sheath.opening = 7", "2 openings"]);
}

#[test]
fn a_sheath_without_direction_is_refused() {
    Scene::good()
        .with("direction = [1.0, 0.0, 0.0]", "direction = [0.0, 0.0, 0.0]")
        .is_refused(&["sheath.direction"]);
}

#[test]
fn an_empty_mesh_is_refused() {
    for (name, bytes) in [
        ("empty.stl", &b"solid nothing\nendsolid nothing\n"[..]),
        ("empty.stl", &[0; 84][..]),
        ("empty.stl", &b""[..]),
        ("empty.obj", &b"# nothing\n"[..]),
    ] {
        Scene::good()
            .file(name, bytes)
            .with("tree = \"tube.csv\"\nedge_mm = 2.0", &format!("file = \"{name}\""))
            .is_refused(&[name]);
    }
}

#[test]
fn a_sheath_between_sheets_that_enclose_nothing_is_refused() {
    // Three sheets that meet in one edge: one is taken away, and the sheath lies between the others.
    let obj = b"v 0 5 0\nv 80 5 0\nv 0 -5 5\nv 80 -5 5\nv 0 -5 -5\nv 80 -5 -5\nv 0 15 0\nv 80 15 0\n\
        f 1 2 4 3\nf 2 1 5 6\nf 1 2 8 7\n";
    Scene::good()
        .file("sheets.obj", obj)
        .with("tree = \"tube.csv\"\nedge_mm = 2.0", "file = \"sheets.obj\"")
        .is_refused(&["sheath.position_mm", "outside the vessel"]);
}

#[test]
fn absurd_sizes_are_refused_before_memory_is() {
    Scene::good().with("edge_mm = 2.0", "edge_mm = 1e-9").is_refused(&["edge_mm"]);
    Scene::good().with("step_mm = 2.0", "step_mm = 1e-30").is_refused(&["script[0]"]);
    Scene::good().with("length_mm = 60.0", "length_mm = 6e30").is_refused(&["length_mm"]);
    Scene::good()
        .with("[sheath]", "[method]\nname = \"kirchhoff\"\nelement_mm = 1e-6\n[sheath]")
        .is_refused(&["method.element_mm", "gigabytes"]);
    Scene::good()
        .with("[sheath]", "[method]\nname = \"li2011-dense\"\nelement_mm = 1e-6\n[sheath]")
        .is_refused(&["element_mm"]);
    Scene::good()
        .with("[sheath]", "[view]\nviews = [\"3d\"]\nsize_px = [100000000, 4]\n[sheath]")
        .is_refused(&["size_px"]);
    let mut huge = vec![0; 84];
    huge[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    Scene::good()
        .file("huge.stl", &huge)
        .with("tree = \"tube.csv\"\nedge_mm = 2.0", "file = \"huge.stl\"")
        .is_refused(&["huge.stl"]);
}

#[test]
fn moving_beyond_the_ends_of_the_device_is_refused_before_the_run() {
    Scene::good().with("advance_mm = 20.0", "advance_mm = 61.0").is_refused(&["advance_mm", "60 mm long"]);
    Scene::good()
        .with("advance_mm", "retract_mm")
        .is_refused(&["script[0].retract_mm = 20", "0 mm are inserted"]);
    let second =
        "[[script]]\nadvance_mm = 20.0\nstep_mm = 2.0\n[[script]]\nadvance_mm = 45.0\nstep_mm = 2.0\n";
    Scene::good()
        .with("[[script]]\nadvance_mm = 20.0\nstep_mm = 2.0\n", second)
        .is_refused(&["script[1].advance_mm = 45", "60 mm long"]);
}

#[test]
fn contradicting_keys_are_refused() {
    Scene::good().with("edge_mm = 2.0", "edge_mm = 2.0\nunit_mm = 10.0").is_refused(&["vessel.unit_mm = 10"]);
    Scene::good().with("edge_mm = 2.0", "file = \"a.stl\"").is_refused(&["vessel.file"]);
    Scene::good()
        .with("tree = \"tube.csv\"", "file = \"a.stl\"")
        .is_refused(&["vessel.edge_mm = 2: only with vessel.tree"]);
    Scene::good()
        .with("position_mm = [1.0, 0.0, 0.0]", "opening = 0")
        .is_refused(&["sheath = {opening, direction}"]);
    Scene::good().with("tree = \"tube.csv\"\nedge_mm = 2.0", "").is_refused(&["vessel"]);
}

#[test]
fn a_centre_line_beside_a_tree_is_refused_whatever_it_is_for() {
    Scene::good()
        .with("edge_mm", "centreline = \"tube.csv\"\nedge_mm")
        .is_refused(&["vessel.centreline = tube.csv: vessel.tree is given too"]);
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let scene = Scene::good().file("taken", b"a file, not a folder");
    std::fs::write(scene.path("scene.toml"), &scene.text).unwrap();
    let output = endowire(&[
        "run".as_ref(),
        scene.path("scene.toml").as_ref(),
        "--out".as_ref(),
        scene.path("taken").as_ref(),
    ]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("taken"));
}

#[test]
fn values_of_the_wrong_type_are_named_by_line_and_key() {
    Scene::good()
        .with("radius_mm = 0.5", "radius_mm = \"x\"")
        .is_refused(&["line 8: radius_mm: must be a number, not"]);
    Scene::good()
        .with("[sheath]", "[method]\nname = \"li2011-banded\"\nelement_mm = \"x\"\n[sheath]")
        .is_refused(&["line 13: element_mm: must be a number, not"]);
}

#[test]
fn what_is_wrong_with_a_generated_wall_is_said_of_the_key_that_asked_for_it() {
    Scene::good().with("edge_mm = 2.0", "edge_mm = -2.0").is_refused(&["vessel.edge_mm = -2", "tube.csv"]);
    Scene::good().with("edge_mm = 2.0", "triangles = 1").is_refused(&["vessel.triangles = 1:", "tube.csv"]);
    Scene::good()
        .with("edge_mm = 2.0", "triangles = 10000000000")
        .is_refused(&["vessel.triangles = 1e10:", "tube.csv"]);
}

#[test]
fn a_sheath_too_deep_or_before_the_opening_blames_its_depth() {
    for (depth, words) in [("-5.0", "sheath.depth_mm = -5"), ("500.0", "sheath.depth_mm = 500")] {
        Scene::good()
            .with(
                "position_mm = [1.0, 0.0, 0.0]\ndirection = [1.0, 0.0, 0.0]",
                &format!("opening = 0\ndepth_mm = {depth}"),
            )
            .is_refused(&[words]);
    }
}

#[test]
fn a_device_thicker_than_the_vessel_at_the_sheath_is_refused() {
    Scene::good()
        .with("radius_mm = 0.5", "radius_mm = 4.1")
        .is_refused(&["device.section[0].radius_mm = 4.1", "the wall is 4.000 mm"]);
    // Further in the vessel may be narrower: then the device stops there.
    let narrowing = Scene::good().file("tube.csv", b"0 0 0 4 -1\n40 0 0 1 0\n80 0 0 1 1\n");
    let output = narrowing.with("radius_mm = 0.5", "radius_mm = 1.5").run();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
}

#[test]
fn a_name_that_is_no_folder_is_refused() {
    for name in ["../x", "/x", "a\\nb", "..", "a\\\\b"] {
        Scene::good().with("\n[vessel]", &format!("name = \"{name}\"\n[vessel]")).is_refused(&["name = "]);
    }
}

#[test]
fn a_scene_without_a_script_has_nothing_to_run() {
    Scene::good()
        .with("[[script]]\nadvance_mm = 20.0\nstep_mm = 2.0\n", "")
        .is_refused(&["script", "[[script]]"]);
}

#[test]
fn a_vessel_in_the_wrong_unit_is_refused_by_its_size() {
    let obj = b"v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    Scene::good()
        .file("box.obj", obj)
        .with("tree = \"tube.csv\"\nedge_mm = 2.0", "file = \"box.obj\"\nunit_mm = 1e99")
        .is_refused(&["box.obj", "unit_mm = 1e99"]);
}

#[test]
fn a_broken_ply_is_reported_in_one_line() {
    Scene::good()
        .file("broken.ply", b"ply\nformat ascii 9.0\nelement nonsense\n")
        .with("tree = \"tube.csv\"\nedge_mm = 2.0", "file = \"broken.ply\"")
        .is_refused(&["broken.ply"]);
}

#[test]
fn arguments_are_named_by_their_flag() {
    for (args, words) in [
        (&["experiment", "timing", "--nodes", "100000"][..], "--nodes 100000"),
        (&["experiment", "timing", "--repeats", "1000000000"][..], "--repeats 1000000000"),
        (&["vessel", "generate", "curved_tube", "--out", "a.stl", "--edge-mm", "-1"][..], "--edge-mm = -1"),
    ] {
        let args: Vec<&Path> = args.iter().map(Path::new).collect();
        let output = endowire(&args);
        let text = said(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(words) && text.trim_end().lines().count() == 1, "{text}");
    }
}

#[cfg(unix)]
#[test]
fn a_run_needs_no_folder_for_temporary_files() {
    let scene = Scene::good();
    std::fs::write(scene.path("scene.toml"), &scene.text).unwrap();
    let output = crate::common::endowire()
        .env("TMPDIR", "/no/such/folder")
        .args([
            "run".as_ref(),
            scene.path("scene.toml").as_path(),
            "--out".as_ref(),
            scene.path("out").as_path(),
        ])
        .output()
        .unwrap();
    let text = said(&output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(scene.path("out/shapes.npz").exists());
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_no_input_files() {
    let scene = Scene::good();
    std::os::unix::fs::symlink("/dev/zero", scene.path("endless.stl")).unwrap();
    scene
        .with("tree = \"tube.csv\"\nedge_mm = 2.0", "file = \"endless.stl\"")
        .is_refused(&["endless.stl", "regular file"]);
    let output = endowire(&["run".as_ref(), "/dev/zero".as_ref()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("regular file"));
}

#[test]
fn a_region_of_the_wall_that_cannot_be_is_refused_by_its_key() {
    let scene = |region: &str| {
        let regions = "[[vessel.wall.region]]\ncentre_mm = [20, 4, 0]\nradius_mm = 5.0\nfriction = 0.1\n";
        Scene::good().with("[[device", &format!("{regions}[[vessel.wall.region]]\n{region}\n[[device"))
    };
    let good = "centre_mm = [40, 4, 0]\nradius_mm = 5.0\nmodulus_n_per_mm2 = 20.0\nfriction = 0.3\ntransition_mm = 1.0";
    let output = scene(good).run();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    for (from, to, words) in [
        ("[40, 4, 0]", "[40, nan, 0]", &["region[1].centre_mm = [40, NaN, 0]"][..]),
        ("[40, 4, 0]", "[40, 4]", &["line 11", "centre_mm"]),
        ("[40, 4, 0]", "[40, 20, 0]", &["region[1].radius_mm = 5", "no vertex", "16.", "[40, 20, 0]"]),
        ("radius_mm = 5.0", "radius_mm = 0.0", &["region[1].radius_mm = 0", "above 0"]),
        ("radius_mm = 5.0", "radius_mm = -5.0", &["region[1].radius_mm = -5"]),
        ("radius_mm = 5.0", "radius_mm = 1e-9", &["region[1].transition_mm = 1", "1e-9 mm"]),
        (
            "radius_mm = 5.0\n",
            "",
            &["vessel.wall.region[1] = centre_mm: ", "radius_mm of a sphere", "piece_at_mm"],
        ),
        (
            "radius_mm",
            "piece_at_mm = [1, 2, 3]\nradius_mm",
            &["region[1] = centre_mm and radius_mm and piece_at_mm"],
        ),
        (
            "centre_mm = [40, 4, 0]\nradius_mm = 5.0",
            "piece_at_mm = [40, 4, 0]",
            &["region[1].transition_mm = 1", "piece"],
        ),
        (
            "centre_mm = [40, 4, 0]\nradius_mm = 5.0",
            "piece_at_mm = [40, nan, 0]",
            &["region[1].piece_at_mm = [40, NaN, 0]"],
        ),
        ("= 20.0", "= -20.0", &["vessel.wall.region[1].modulus_n_per_mm2 = -20"]),
        ("= 20.0", "= 0.0", &["vessel.wall.region[1].modulus_n_per_mm2 = 0"]),
        ("= 20.0", "= 1e300", &["vessel.wall.region[1].modulus_n_per_mm2 = 1e300"]),
        ("= 0.3", "= -0.3", &["vessel.wall.region[1].friction = -0.3"]),
        ("= 0.3", "= nan", &["vessel.wall.region[1].friction = NaN"]),
        ("= 1.0", "= 11.0", &["region[1].transition_mm = 11", "twice", "5 mm"]),
        ("= 1.0", "= -1.0", &["region[1].transition_mm = -1"]),
        ("friction = 0.3", "frction = 0.3", &["line 14", "frction", "friction"]),
        (
            "modulus_n_per_mm2 = 20.0\nfriction = 0.3\n",
            "",
            &["vessel.wall.region[1]", "give modulus_n_per_mm2"],
        ),
    ] {
        assert!(good.contains(from), "{from}");
        scene(&good.replace(from, to)).is_refused(words);
    }
    for method in ["li2011-banded", "li2011-dense"] {
        scene(&format!("{good}\n[method]\nname = \"{method}\""))
            .is_refused(&["vessel.wall.region = 2 given", "kirchhoff"]);
    }
}

#[test]
fn a_flow_that_cannot_be_is_refused_by_its_key() {
    let good = "inflow_ml_per_s = 20.0\ninlet_mm = [0, 0, 0]\n";
    let scene = |flow: &str| Scene::good().with("[sheath]", &format!("[vessel.flow]\n{flow}\n[sheath]"));
    let output = scene(good).run();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    for (from, to, words) in [
        ("20.0", "-20.0", &["vessel.flow.inflow_ml_per_s = -20", "above 0"][..]),
        ("20.0", "1e4", &["vessel.flow.inflow_ml_per_s = 10000", "1000"]),
        ("inflow_ml_per_s = 20.0", "", &["inflow_ml_per_s"]),
        ("[0, 0, 0]", "[0, nan, 0]", &["vessel.flow.inlet_mm = [0, NaN, 0]"]),
        ("inlet_mm", "split_exponent = 0.0\ninlet_mm", &["vessel.flow.split_exponent = 0"]),
        ("inlet_mm", "viscosity_mpa_s = inf\ninlet_mm", &["vessel.flow.viscosity_mpa_s = inf"]),
        ("inlet_mm", "inlet", &["inlet"]),
        ("[0, 0, 0]", "[5000, 0, 50]", &["vessel.flow.inlet_mm = [5000, 0, 50]", "[80, 0, 0]"]),
    ] {
        scene(&good.replace(from, to)).is_refused(words);
    }
    let other = scene(good).with("[[script]]", "[method]\nname = \"li2011-banded\"\n\n[[script]]");
    other.is_refused(&["vessel.flow = given", "the paper's method", "kirchhoff"]);
    // In a surface alone the centre line is found, or the blood comes in where none of it ends.
    let surface = scene(good).with("tree = \"tube.csv\"\nedge_mm = 2.0", "file = \"tube.stl\"");
    let tree = surface.path("tube.csv");
    std::fs::copy(&tree, surface.path("tree.csv")).unwrap();
    let made = endowire(&[
        "vessel".as_ref(),
        "generate".as_ref(),
        tree.as_ref(),
        "--out".as_ref(),
        surface.path("tube.stl").as_ref(),
    ]);
    assert_eq!(made.status.code(), Some(0), "{}", said(&made));
    let output = surface.run();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(said(&output).contains("the centre line is found in the surface"), "{}", said(&output));
    let beside = surface.with("file = \"tube.stl\"", "file = \"tube.stl\"\ncentreline = \"tree.csv\"");
    let output = beside.run();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(!said(&output).contains("is found"), "{}", said(&output));
}

#[test]
fn a_motion_of_the_vessel_that_cannot_be_is_refused_by_its_key() {
    let good = "waveform = \"breathing\"\nperiod_s = 4.0\ndisplacement_mm = [0, 5, 0]\n\
                still = { centre_mm = [0, 0, 0], radius_mm = 10.0, fade_mm = 60.0 }\n";
    let scene = |motion: &str| {
        let scene = Scene::good().with("[sheath]", &format!("[[vessel.motion]]\n{motion}\n[sheath]"));
        scene.with("step_mm = 2.0", "step_mm = 2.0\nspeed_mm_per_s = 10.0")
    };
    let output = scene(good).run();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    for (from, to, words) in [
        ("breathing", "breath", &["line 12", "breath", "breathing"][..]),
        ("period_s = 4.0\n", "", &["vessel.motion[0].period_s = none"]),
        ("[0, 5, 0]", "[0, nan, 0]", &["vessel.motion[0].displacement_mm = [0, NaN, 0]"]),
        ("fade_mm = 60.0", "fade_mm = 12.0", &["vessel.motion = 0.78", "below 0.5", "fade_mm"]),
        ("radius_mm = 10.0", "radius_mm = -1.0", &["vessel.motion[0].still.radius_mm = -1"]),
        ("[0, 0, 0]", "[60, 0, 0]", &["vessel.motion = 4.934 mm", "sheath's mouth", "still"]),
        ("still", "stil", &["stil", "still"]),
    ] {
        assert!(good.contains(from), "{from}");
        scene(&good.replace(from, to)).is_refused(words);
    }
    let timeless = scene(good).with("\nspeed_mm_per_s = 10.0", "");
    timeless.is_refused(&["vessel.motion = 1 given", "no time goes by", "wait_s"]);
    let other = scene(good).with("[[script]]", "[method]\nname = \"li2011-banded\"\n\n[[script]]");
    other.is_refused(&["vessel.motion = given", "the paper's method", "kirchhoff"]);
}

#[test]
fn a_roadmap_whose_first_picture_comes_before_any_injection_is_refused_before_the_first_step() {
    let view = "[view]\nviews = [\"fluoro\"]\nsize_px = [32, 32]\nbackend = \"cpu\"\nevery = EVERY\nxray.mode = \"roadmap\"\n";
    let scene = |every: usize, injects: &str| {
        let last = format!(
            "step_mm = 2.0\n{injects}[[script]]\nadvance_mm = 4.0\nstep_mm = 2.0\n{}",
            view.replace("EVERY", &every.to_string())
        );
        Scene::good()
            .with("radius_mm = 0.5", "radius_mm = 0.5\ninner_radius_mm = 0.3")
            .with("step_mm = 2.0\n", &last)
    };
    let injects = "[[script]]\ninject = { ml = 4.0, ml_per_s = 4.0 }\n";
    let without = scene(5, "");
    without.is_refused(&["view.xray.mode = roadmap", "shows an angiogram", "[[view.injection]]"]);
    assert!(!without.path("out").exists());
    // The script injects after its first ten steps.
    scene(5, injects).is_refused(&["view.xray.mode = roadmap", "10 steps", "step 5 ", "view.every above 10"]);
    for every in [11, 200] {
        let output = scene(every, injects).run();
        assert_eq!(output.status.code(), Some(0), "{every}: {}", said(&output));
    }
}

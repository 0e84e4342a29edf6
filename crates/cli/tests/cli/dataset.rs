//! Datasets as a user gets them: the same whatever the threads, in both planes, gone on with where they were.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Output;

use crate::common::{assets, bytes, document, reported, said, scene_text, text};
use serde_json::Value;

fn endowire(args: &[&str], threads: &str) -> Output {
    crate::common::endowire().env("RAYON_NUM_THREADS", threads).args(args).output().unwrap()
}

/// A specification of a short course in the curved tube with two devices.
fn specification(folder: &Path, more: &str) -> std::path::PathBuf {
    let assets = assets().display().to_string();
    // The paper's method, that of the other scene of this tube, has no shaped devices.
    let changes =
        [("advance_mm = 220.0", "advance_mm = 30.0"), ("size_px = [640, 640]", "size_px = [96, 64]")];
    let scene = scene_text("curved_tube_exact.toml", &changes);
    std::fs::write(folder.join("scene.toml"), scene).unwrap();
    let spec = folder.join("spec.toml");
    let text = format!(
        "scenes = [\"scene.toml\"]\ndevices = [\"{assets}/devices/wire_035_soft.toml\", \
         \"{assets}/devices/catheter_4f_vertebral.toml\"]\nposes = 2\nmoments = 3\nbiplane_deg = 90.0\n{more}\n[vary]\n\
         dose_ngy = [20.0, 90.0]\nkvp = [70.0, 80.0]\nprogress = [0.5, 1.0]\n[view]\nsize_px = [256, 192]\nbackend = \"cpu\"\n"
    );
    std::fs::write(&spec, text).unwrap();
    spec
}

/// All files of a folder and its folders, with what is in them.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            all.extend(files(&path).into_iter().map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)));
        } else {
            all.insert(name, std::fs::read(&path).unwrap());
        }
    }
    all
}

#[test]
fn a_dataset_is_the_same_with_any_threads_and_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let spec = specification(folder.path(), "");
    let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
    let first = reported(&endowire(&["dataset", text(&spec), "--out", text(&one), "--json"], "1"));
    assert_eq!((first["pictures"].as_u64(), first["drawn"].as_u64()), (Some(24), Some(24)));
    reported(&endowire(&["dataset", text(&spec), "--out", text(&two), "--json"], "2"));
    let whole = files(&one);
    assert!(whole == files(&two));
    // One call at a time draws into a folder.
    let lock = std::fs::File::options().write(true).open(two.join(".endowire-lock")).unwrap();
    lock.try_lock().unwrap();
    let refused = endowire(&["dataset", text(&spec), "--out", text(&two)], "2");
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("another endowire dataset is drawing"), "{}", said(&refused));
    drop(lock);
    // What a call that was ended has left: a shot without its list, and a picture that is half there.
    std::fs::remove_file(two.join("parts/000001.json")).unwrap();
    std::fs::write(two.join("images/0000007.png"), "half").unwrap();
    let again = reported(&endowire(&["dataset", text(&spec), "--out", text(&two), "--json"], "2"));
    assert_eq!(again["drawn"].as_u64(), Some(6));
    assert!(whole == files(&two));
    // A picture of a dataset that is whole, and the arrays of another, go missing.
    std::fs::remove_file(two.join("images/0000001.png")).unwrap();
    std::fs::remove_file(two.join("arrays/0000023.npz")).unwrap();
    let again = reported(&endowire(&["dataset", text(&spec), "--out", text(&two), "--json"], "2"));
    assert_eq!(again["drawn"].as_u64(), Some(12));
    assert!(whole == files(&two));
    // The twin: another seed is another dataset, and is not mixed with this one.
    let spec = specification(folder.path(), "seed = 2");
    let refused = endowire(&["dataset", text(&spec), "--out", text(&two)], "2");
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("another dataset"));
    let other = folder.path().join("other");
    reported(&endowire(&["dataset", text(&spec), "--out", text(&other), "--json"], "2"));
    assert!(files(&other)["images/0000000.png"] != whole["images/0000000.png"]);
}

#[test]
fn annotations_are_those_of_coco_and_planes_know_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let spec = specification(folder.path(), "");
    // Pictures so small that tips are in some and not in others.
    let small = "[view]\nc_arm.isocentre_mm = [0.0, 0.0, 10.0]\nc_arm.field_mm = 40.0\n";
    let whole = std::fs::read_to_string(&spec).unwrap();
    std::fs::write(&spec, whole.replace("[view]\n", small)).unwrap();
    let out = folder.path().join("out");
    reported(&endowire(&["dataset", text(&spec), "--out", text(&out), "--json"], "2"));
    let document = document(out.join("annotations.json"));
    let images = document["images"].as_array().unwrap();
    assert_eq!(images.len(), 24);
    for (id, image) in images.iter().enumerate() {
        assert_eq!(image["id"], id);
        assert!(out.join(image["file_name"].as_str().unwrap()).exists());
        let other = &images[image["pair"].as_u64().unwrap() as usize];
        let turn = other["primary_deg"].as_f64().unwrap() - image["primary_deg"].as_f64().unwrap();
        assert!((turn.abs() - 90.0).abs() < 1e-9 && other["step"] == image["step"]);
        assert!(other["camera_matrix"] != image["camera_matrix"]);
        assert_eq!(other["pose"], image["pose"]);
        // One vessel alone is for training.
        assert_eq!(image["split"], "train");
    }
    let annotations = document["annotations"].as_array().unwrap();
    let categories = document["categories"].as_array().unwrap();
    let name = |row: &Value| {
        let category = categories.iter().find(|c| c["id"] == row["category_id"]).unwrap();
        category["name"].as_str().unwrap().to_owned()
    };
    for kind in ["vessel", "guidewire", "catheter", "part"] {
        assert!(annotations.iter().any(|row| name(row) == kind), "{kind}");
    }
    let ids: BTreeSet<u64> = annotations.iter().map(|row| row["id"].as_u64().unwrap()).collect();
    assert!(ids.len() == annotations.len() && !ids.contains(&0), "0 is no match for pycocotools");
    for category in categories {
        let is_device = ["guidewire", "catheter", "coil"].contains(&category["name"].as_str().unwrap());
        let tip = is_device.then(|| serde_json::json!(["tip"]));
        assert_eq!(category.get("keypoints"), tip.as_ref());
        assert_eq!(category.get("skeleton").is_some(), tip.is_some());
    }
    let poses: BTreeSet<u64> = images.iter().map(|image| image["pose"].as_u64().unwrap()).collect();
    assert!(poses.len() > 1 && images.len().is_multiple_of(poses.len()), "{poses:?}");
    // What is large and dense is seen, and no label stands out by more than pictures have of grey levels.
    let seen: Vec<f64> = annotations.iter().filter_map(|row| row["visible"].as_f64()).collect();
    assert!(seen.len() * 10 > annotations.len() * 9 && seen.iter().all(|cnr| (0.0..256.0).contains(cnr)));
    assert!(seen.iter().any(|cnr| *cnr > 1.0) && seen.iter().any(|cnr| *cnr < 1.0), "{seen:?}");
    for row in annotations {
        let counts: Vec<u64> =
            row["segmentation"]["counts"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect();
        assert_eq!(counts.iter().sum::<u64>(), 256 * 192);
        assert_eq!(counts.iter().skip(1).step_by(2).sum::<u64>(), row["area"].as_u64().unwrap());
    }
    // The tip projects by the matrix of its picture to where its picture says.
    let tips = annotations.iter().filter(|row| ["guidewire", "catheter"].contains(&name(row).as_str()));
    assert!(annotations.iter().any(|row| name(row) == "part" && row["part"].is_string()), "parts have names");
    let (mut compared, mut outside) = (0, 0);
    for row in tips {
        let image = &images[row["image_id"].as_u64().unwrap() as usize];
        let tip: Vec<f64> = row["tip_mm"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        let [u, v, w] = [0, 1, 2].map(|k| {
            let m = |j: usize| image["camera_matrix"][k][j].as_f64().unwrap();
            m(0) * tip[0] + m(1) * tip[1] + m(2) * tip[2] + m(3)
        });
        let at = |k: usize| row["keypoints"][k].as_f64().unwrap();
        if (0.0..=256.0).contains(&(u / w)) && (0.0..=192.0).contains(&(v / w)) {
            assert!((u / w - at(0)).abs() < 1e-9 && (v / w - at(1)).abs() < 1e-9);
            assert_eq!((at(2), row["num_keypoints"].as_u64()), (2.0, Some(1)));
            compared += 1;
        } else {
            assert_eq!(([0, 1, 2].map(at), row["num_keypoints"].as_u64()), ([0.0; 3], Some(0)));
            outside += 1;
        }
    }
    assert!(compared > 6 && outside > 0, "{compared} {outside}");
}

#[test]
fn a_specification_that_does_not_fit_is_refused_by_its_key() {
    let folder = tempfile::tempdir().unwrap();
    for (more, named) in [("pose = 3", "poses"), ("biplane = 1", "biplane_deg"), ("seed = -1", "seed")] {
        let spec = specification(folder.path(), more);
        let output = endowire(&["dataset", text(&spec), "--out", text(&folder.path().join("out"))], "1");
        let reported = said(&output);
        assert!(output.status.code() == Some(2) && reported.contains(named), "{reported}");
    }
    let spec = specification(folder.path(), "");
    let whole = std::fs::read_to_string(&spec).unwrap();
    for (from, to, named) in [
        ("dose_ngy = [20.0, 90.0]", "dose_ngy = [90.0, 20.0]", "vary.dose_ngy"),
        ("dose_ngy = [20.0, 90.0]", "magnification = [0.01, 2.0]", "vary.magnification"),
        ("moments = 3", "moments = 0", "moments"),
        ("size_px = [256, 192]", "size_px = [0, 192]", "size_px"),
        ("kvp = [70.0, 80.0]", "kvp = [71.0]", "vary.kvp: view.xray.kvp = 71: the table has 50, 55"),
        ("kvp = [70.0, 80.0]", "kvp = []", "vary.kvp = []"),
        ("\"scene.toml\"", "\"nix.toml\"", "spec.toml: scenes = [\"nix.toml\"]"),
        ("devices = [", "devices = [\"nix.toml\", ", "spec.toml: devices = [\"nix.toml\"]"),
        ("[view]\n", "[view]\nviews = [\"3d\"]\n", "view.views = [\"3d\"]"),
        (
            "[view]\n",
            "[view]\nxray.mode = \"dsa\"\n",
            "view.xray.mode = \"dsa\": pictures are of single moments",
        ),
        ("[view]\n", "[view]\nc_arm.pose = \"LAO 30\"\n", "view.c_arm.pose = \"LAO 30\""),
    ] {
        std::fs::write(&spec, whole.replace(from, to)).unwrap();
        let output = endowire(&["dataset", text(&spec), "--out", text(&folder.path().join("out"))], "1");
        let reported = said(&output);
        assert!(output.status.code() == Some(2) && reported.contains(named), "{to}: {reported}");
    }
    // The scene has no body whose width could vary.
    std::fs::write(&spec, whole.replace("dose_ngy = [20.0, 90.0]", "width_mm = [300.0, 350.0]")).unwrap();
    let output = endowire(&["dataset", text(&spec), "--out", text(&folder.path().join("wide"))], "1");
    let reported = said(&output);
    assert!(reported.contains("vary.width_mm is that of a generated body"), "{reported}");
}

#[test]
fn varied_values_are_drawn_for_each_pose_and_written_with_its_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let spec = specification(folder.path(), "");
    let whole = std::fs::read_to_string(&spec).unwrap();
    let images = |vary: &str, name: &str| -> Vec<Value> {
        let text_of = whole.replace("[vary]\n", &format!("[vary]\n{vary}"));
        std::fs::write(&spec, text_of + "[view.patient.torso]\n").unwrap();
        let out = folder.path().join(name);
        reported(&endowire(&["dataset", text(&spec), "--out", text(&out), "--json"], "2"));
        document(out.join("annotations.json"))["images"].as_array().unwrap().clone()
    };
    let ranges = [
        ("magnification", [1.0, 2.0]),
        ("width_mm", [280.0, 380.0]),
        ("scatter_fraction", [0.1, 0.6]),
        ("contrast_fraction", [0.0, 0.3]),
    ];
    let vary: String =
        ranges.iter().map(|(key, [low, high])| format!("{key} = [{low:?}, {high:?}]\n")).collect();
    let (drawn, fixed) = (images(&vary, "drawn"), images("", "fixed"));
    for (key, [low, high]) in ranges {
        let values = |images: &[Value]| -> BTreeSet<String> {
            images.iter().map(|image| image[key].as_f64().unwrap().to_string()).collect()
        };
        let all = values(&drawn);
        // One for each pose of each device.
        assert!(all.len() == 4, "{key}: {all:?}");
        assert!(
            all.iter().all(|value| (low..=high).contains(&value.parse::<f64>().unwrap())),
            "{key}: {all:?}"
        );
        assert_eq!(values(&fixed).len(), 1, "the twin: {key} of the scene");
    }
    assert_ne!(drawn[0]["camera_matrix"], fixed[0]["camera_matrix"]);
}

/// A scene whose table of materials is that of a catheter, and a wire in its place.
#[test]
fn a_table_of_a_scene_never_dresses_another_device() {
    let folder = tempfile::tempdir().unwrap();
    let table = "[[view.device]]\nmaterial = \"pebax_baso4_40\"\ninner_radius_mm = 0.3\n";
    std::fs::write(folder.path().join("scene.toml"), scene_text("curved_tube_exact.toml", &[]) + table)
        .unwrap();
    let wire = assets().join("devices/microwire_014.toml");
    let spec = folder.path().join("spec.toml");
    let more = format!(
        "scenes = [\"scene.toml\"]\ndevices = [{:?}]\nposes = 2\nmoments = 2\n[vary]\nprogress = [0.5, 1.0]\n[view]\nsize_px = [128, 128]\n",
        text(&wire)
    );
    std::fs::write(&spec, &more).unwrap();
    let out = folder.path().join("out");
    reported(&endowire(&["dataset", text(&spec), "--out", text(&out), "--json"], "2"));
    let document = document(out.join("annotations.json"));
    let annotations = document["annotations"].as_array().unwrap();
    let materials: BTreeSet<&str> = annotations.iter().filter_map(|row| row["material"].as_str()).collect();
    assert!(materials.contains("platinum") && !materials.contains("pebax_baso4_40"), "{materials:?}");
    // Alone, another device is refused beside that table, and so is a bore that leaves nothing of the own one.
    let scene = folder.path().join("scene.toml");
    let set = format!("device.file={:?}", text(&wire));
    let wide = folder.path().join("wide.toml");
    let whole = std::fs::read_to_string(&scene).unwrap();
    std::fs::write(&wide, whole.replace("inner_radius_mm = 0.3", "inner_radius_mm = 9.0")).unwrap();
    for (args, named) in [
        (vec!["run", text(&scene), "--set", set.as_str()], "[[view.device]]"),
        (vec!["fluoro", text(&wide)], "view.device[0].inner_radius_mm = 9"),
    ] {
        let output = endowire(&args, "1");
        assert!(output.status.code() == Some(2) && said(&output).contains(named), "{}", said(&output));
    }
}

#[test]
fn what_a_script_injects_is_in_pictures_of_its_steps_and_later() {
    let folder = tempfile::tempdir().unwrap();
    let tree = assets().join("vessels/curved_tube.csv");
    let view = format!(
        "[view]\nviews = [\"fluoro\"]\nsize_px = [64, 64]\nbackend = \"cpu\"\ndetector.noise = false\ndetector.lag = 0.0\n\
         xray.window = [0.5, 6.0]\nxray.brightness_s = 0.0\nflow.tree = {:?}\nc_arm = {{ primary_deg = 20.0, field_mm = 200.0 }}\n",
        text(&tree)
    );
    let scene = |injects: &str| {
        let head = scene_text("curved_tube.toml", &[]);
        let head = &head[..head.find("[[script]]").unwrap()];
        let line =
            |mm: f64| format!("[[script]]\nadvance_mm = {mm:?}\nstep_mm = 4.0\nspeed_mm_per_s = 20.0\n");
        format!("{head}{}{injects}{}{view}", line(20.0), line(12.0))
    };
    let injects = "[[script]]\ninject = { ml = 4.0, ml_per_s = 4.0 }\n";
    // The picture of a step, of a dataset with these times of injections.
    let picture = |name: &str, injects: &str, progress: f64, time_s: f64| {
        std::fs::write(folder.path().join("scene.toml"), scene(injects)).unwrap();
        let spec = folder.path().join("spec.toml");
        let more = format!(
            "scenes = [\"scene.toml\"]\nposes = 1\nmoments = 1\n[vary]\nprimary_deg = [20.0, 20.0]\nsecondary_deg = [0.0, 0.0]\n\
             progress = [{progress:?}, {progress:?}]\ntime_s = [{time_s:?}, {time_s:?}]\n"
        );
        std::fs::write(&spec, more).unwrap();
        let out = folder.path().join(name);
        reported(&endowire(&["dataset", text(&spec), "--out", text(&out), "--json"], "2"));
        bytes(out.join("images/0000000.png"))
    };
    let medium = picture("medium", injects, 1.0, 0.0);
    assert!(medium != picture("dry", "", 1.0, 0.0), "the twin: a script that injects nothing");
    assert!(medium != picture("later", injects, 1.0, 3.0), "it flows on");
    let times = |name: &str| {
        let annotations = document(folder.path().join(name).join("annotations.json"));
        ["step_time_s", "time_s"].map(|key| annotations["images"][0][key].as_f64().unwrap())
    };
    // 32 mm at 20 mm/s, whatever goes on to flow.
    let near =
        |name: &str, reported: [f64; 2]| times(name).iter().zip(reported).all(|(a, b)| (a - b).abs() < 1e-9);
    assert!(near("medium", [1.6, 1.6]) && near("dry", [1.6, 0.0]) && near("later", [1.6, 4.6]));
    // Before it is injected there is none: steps 1 to 5 are those before the line.
    assert!(picture("before", injects, 0.5, 0.0) == picture("before_dry", "", 0.5, 0.0));
    // That of `fluoro` at the end of the last step, 32 mm at 20 mm/s.
    std::fs::write(folder.path().join("scene.toml"), scene(injects)).unwrap();
    let (path, out) = (folder.path().join("scene.toml"), folder.path().join("fluoro"));
    reported(&endowire(&["fluoro", text(&path), "--time", "1.6", "--out", text(&out), "--json"], "2"));
    assert!(medium == bytes(out.join("frame_000000_fluoro.png")));
}

#[test]
fn a_dataset_leaves_the_files_of_others() {
    let folder = tempfile::tempdir().unwrap();
    let spec = specification(folder.path(), "");
    for (k, theirs) in
        ["images/0000000.png", "annotations.json", "dataset.json", "parts/000001.json"].iter().enumerate()
    {
        let out = folder.path().join(k.to_string());
        let path = out.join(theirs);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, "theirs").unwrap();
        let refused = endowire(&["dataset", text(&spec), "--out", text(&out)], "2");
        assert_eq!(refused.status.code(), Some(2), "{theirs}: {}", said(&refused));
        assert_eq!(files(&out), BTreeMap::from([((*theirs).to_owned(), b"theirs".to_vec())]));
    }
    // The twin: what lies in no place of a dataset is no reason.
    let out = folder.path().join("beside");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("notes.txt"), "mine").unwrap();
    reported(&endowire(&["dataset", text(&spec), "--out", text(&out), "--json"], "2"));
    assert_eq!(files(&out)["notes.txt"], b"mine");
}

#[test]
fn a_recording_is_not_mixed_with_a_dataset() {
    let folder = tempfile::tempdir().unwrap();
    let spec = specification(folder.path(), "");
    let (scene, run) = (folder.path().join("scene.toml"), folder.path().join("run"));
    let views = ["--set", "view.views=[]", "--quiet"];
    let ran = endowire(&[&["run", text(&scene), "--out", text(&run)], &views[..]].concat(), "2");
    assert!(ran.status.success(), "{}", said(&ran));
    let before = files(&run);
    let refused = endowire(&["dataset", text(&spec), "--out", text(&run)], "2");
    assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
    assert!(said(&refused).contains("holds a recording of endowire run"), "{}", said(&refused));
    assert!(files(&run) == before);
}

#[test]
fn a_scene_of_subtractions_gives_the_same_live_pictures_as_one_without() {
    let folder = tempfile::tempdir().unwrap();
    let spec = specification(folder.path(), "");
    let scene = folder.path().join("scene.toml");
    let live = std::fs::read_to_string(&scene).unwrap();
    // The first picture of a scene in a mode, and what is said.
    let picture = |mode: &str| {
        let xray = "[view.xray]\n";
        assert!(live.contains(xray));
        std::fs::write(&scene, live.replace(xray, &format!("{xray}mode = {mode:?}\n"))).unwrap();
        let out = folder.path().join(mode);
        let output = endowire(&["dataset", text(&spec), "--out", text(&out)], "2");
        assert!(output.status.success(), "{}", said(&output));
        (bytes(out.join("images/0000000.png")), said(&output))
    };
    let (fluoro, quiet) = picture("fluoro");
    let (dsa, reported) = picture("dsa");
    assert!(dsa == fluoro);
    assert!(
        reported.contains("live fluoroscopy, whatever view.xray.mode") && !quiet.contains("whatever"),
        "{reported}"
    );
}

#[test]
fn coils_are_labelled_on_their_pushers_and_where_they_were_left() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let part = |name: &str, mm: f64, more: &str| {
        format!("[[part]]\nname = \"{name}\"\nlength_mm = {mm:?}\nouter_diameter_mm = 0.5\n{more}\n")
    };
    let winding = "winding = { wire_diameter_mm = 0.05, modulus_gpa = 170.0, poisson_ratio = 0.38 }\nmaterial = \"platinum\"";
    let pusher = "bending_stiffness_nmm2 = 0.5\nmaterial = \"steel_316l\"";
    let [coil, pusher] = [part("winding", 10.0, winding), part("pusher", 300.0, pusher)];
    write("coil.toml", &format!("name = \"coil\"\nkind = \"coil\"\n{coil}{pusher}"));
    write("tube.csv", "x_mm,y_mm,z_mm,radius_mm,parent\n0,0,0,4,-1\n0,0,40,4,0\n");
    write(
        "scene.toml",
        r#"
        name = "coils"
        vessel.tree = "tube.csv"
        sheath = { opening = 0, depth_mm = 2.0 }
        method = { name = "kirchhoff", element_mm = 1.5, self_contact = true }
        instrument = [{ name = "first", file = "coil.toml" }, { name = "second", file = "coil.toml" }]
        script = [
            { instrument = "first", advance_mm = 14.0, step_mm = 2.0 },
            { instrument = "first", detach = true },
            { instrument = "second", advance_mm = 14.0, step_mm = 2.0 },
        ]
        "#,
    );
    write(
        "spec.toml",
        "scenes = [\"scene.toml\"]\nposes = 1\nmoments = 2\n[vary]\nprogress = [1.0, 1.0]\n[view]\nsize_px = [256, 256]\nbackend = \"cpu\"\n",
    );
    let (spec, out) = (folder.path().join("spec.toml"), folder.path().join("out"));
    reported(&endowire(&["dataset", text(&spec), "--out", text(&out), "--json"], "2"));
    let document = document(out.join("annotations.json"));
    // The one that is in comes first, and then what was left behind, without a pusher.
    assert_eq!(document["images"][0]["instruments"], serde_json::json!(["second", "first"]));
    let of = |instrument: &str, key: &str, value: &Value| {
        let rows = document["annotations"].as_array().unwrap().iter();
        let mut rows = rows.filter(|row| row["instrument"] == instrument && row["image_id"] == 0);
        rows.any(|row| row[key] == *value)
    };
    for instrument in ["first", "second"] {
        assert!(of(instrument, "category_id", &5.into()), "{instrument}");
        assert!(!of(instrument, "category_id", &2.into()), "{instrument}");
        assert!(of(instrument, "part", &"winding".into()), "{instrument}");
    }
    assert!(of("second", "part", &"pusher".into()) && !of("first", "part", &"pusher".into()));
}

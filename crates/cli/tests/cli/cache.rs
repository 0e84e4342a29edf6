//! Walls kept from run to run: the same bits with and without, and nothing but time lost where the cache is no good.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::{assets, endowire, said};

/// A few steps into the wall of a tree with forks, which takes long to make.
fn scene(folder: &Path) -> PathBuf {
    let text = format!(
        "name = \"arch\"\n\
         [vessel]\ntree = \"{}\"\nedge_mm = 3.0\n\
         [[device.section]]\nlength_mm = 300.0\nradius_mm = 0.45\nbending_stiffness_nmm2 = 20.0\n\
         [sheath]\nposition_mm = [9.0, 0.0, 2.0]\ndirection = [0.2, 0.0, 1.0]\n\
         [method]\nname = \"kirchhoff\"\nelement_mm = 4.0\n\
         [[script]]\nadvance_mm = 40.0\nstep_mm = 8.0\n\
         [view]\nsize_px = [24, 16]\nviews = [\"3d\", \"fluoro\"]\nevery = 3\n",
        assets().join("vessels/aortic_arch.csv").display()
    );
    let path = folder.join("arch.toml");
    std::fs::write(&path, text).unwrap();
    path
}

fn run(scene: &Path, cache: &Path, out: &Path, more: &[&str]) -> Output {
    let mut command = endowire();
    command.args(["run".as_ref(), scene, "--out".as_ref(), out]).args(more).env("ENDOWIRE_CACHE", cache);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    output
}

/// The files of a folder and their bytes, but for the summary, which tells of time.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .filter(|path| path.is_file() && !path.ends_with("summary.json"))
        .map(|path| (path.strip_prefix(folder).unwrap().to_path_buf(), std::fs::read(&path).unwrap()))
        .collect()
}

fn recording(out: &Path) -> [BTreeMap<PathBuf, Vec<u8>>; 2] {
    [files(out), files(&out.join("frames"))]
}

#[test]
fn a_recording_has_the_same_bytes_with_and_without_kept_walls() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, cache) = (scene(folder.path()), folder.path().join("cache"));
    let out = |name: &str| folder.path().join(name);
    run(&scene, &cache, &out("none"), &["--no-cache"]);
    assert!(!cache.exists(), "nothing was to be kept");
    run(&scene, &cache, &out("cold"), &[]);
    let kept = files(&cache.join("walls"));
    assert_eq!(kept.len(), 1, "the mesh that pictures are drawn with: a centre line is felt without");
    run(&scene, &cache, &out("warm"), &[]);
    assert_eq!(files(&cache.join("walls")), kept);
    let first = recording(&out("none"));
    assert!(first[0].contains_key(Path::new("shapes.npz")) && first[1].len() == 4, "{:?}", first[1].keys());
    assert!(first == recording(&out("cold")) && first == recording(&out("warm")));

    // Frames of a recording are drawn with the wall that the run has kept, and are the same without.
    let render = |frames: &str, more: &[&str]| {
        let mut command = endowire();
        command.args(["render".as_ref(), out("warm").as_path(), "--out".as_ref(), out(frames).as_path()]);
        let output = command.args(more).env("ENDOWIRE_CACHE", &cache).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        files(&out(frames))
    };
    let drawn = render("drawn", &[]);
    assert!(drawn.len() > 5 && drawn == render("drawn anew", &["--no-cache"]));
    assert_eq!(files(&cache.join("walls")), kept, "drawing needs no other wall");
}

#[test]
fn a_cache_that_is_damaged_or_cannot_be_written_costs_time_alone() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, cache) = (scene(folder.path()), folder.path().join("cache"));
    let out = |name: &str| folder.path().join(name);
    run(&scene, &cache, &out("first"), &[]);
    let kept = files(&cache.join("walls"));
    for (name, bytes) in &kept {
        std::fs::write(cache.join("walls").join(name), &bytes[..bytes.len() / 2]).unwrap();
    }
    run(&scene, &cache, &out("damaged"), &[]);
    assert!(files(&cache.join("walls")) == kept, "written anew");
    let file = folder.path().join("file");
    std::fs::write(&file, "mine").unwrap();
    let reported = String::from_utf8(run(&scene, &file, &out("unwritable"), &[]).stderr).unwrap();
    assert_eq!(reported.matches("is not kept").count(), 1, "{reported}");
    assert_eq!(std::fs::read(&file).unwrap(), b"mine");
    let first = recording(&out("first"));
    assert!(first == recording(&out("damaged")) && first == recording(&out("unwritable")));
}

#[test]
fn runs_at_the_same_time_share_a_cache() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, cache) = (scene(folder.path()), folder.path().join("cache"));
    let out = |k: usize| folder.path().join(format!("out{k}"));
    std::thread::scope(|scope| {
        for k in 0..3 {
            let (scene, cache, out) = (&scene, &cache, out(k));
            scope.spawn(move || run(scene, cache, &out, &[]));
        }
    });
    assert!(recording(&out(0)) == recording(&out(1)) && recording(&out(0)) == recording(&out(2)));
    assert_eq!(files(&cache.join("walls")).len(), 1);
}

#[test]
fn a_matrix_of_insertions_has_the_same_rows_with_and_without_kept_walls() {
    let folder = tempfile::tempdir().unwrap();
    let (surfaces, cache) = (folder.path().join("surfaces"), folder.path().join("cache"));
    std::fs::create_dir(&surfaces).unwrap();
    std::fs::copy(assets().join("vessels/curved_tube.stl"), surfaces.join("tube.stl")).unwrap();
    std::fs::write(surfaces.join("tube.toml"), "length_mm = 8.0\n").unwrap();
    let rows = |more: &[&str]| {
        let mut command = endowire();
        command.args(["verify", "--json", "--cells", "step2 k100 turn0", "--surfaces"]).arg(&surfaces);
        let output = command.args(more).env("ENDOWIRE_CACHE", &cache).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        let mut document: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        for cell in document["cells"].as_array_mut().unwrap() {
            let cell = cell.as_object_mut().unwrap();
            cell.retain(|key, _| !["setup_s", "total_s", "median_ms", "slowest_ms"].contains(&key.as_str()));
        }
        assert!(document["cells"].as_array().unwrap().len() > 1);
        document["cells"].take()
    };
    let first = rows(&["--no-cache"]);
    assert!(!cache.exists(), "nothing was to be kept");
    assert_eq!(rows(&[]), first);
    let kept = files(&cache.join("walls"));
    assert_eq!(kept.len(), 2, "the repaired surface and its even mesh");
    assert_eq!(rows(&[]), first);
    assert_eq!(files(&cache.join("walls")), kept);
}

//! The examples in C and C++: compiled, linked and run; and what they print is what the library itself computes.

use std::mem::size_of;
use std::path::{Path, PathBuf};
use std::process::Command;

use endowire_c::{EndowireContact, EndowireInstrument, EndowireMove, EndowireReport};
use endowire_core::vessel::NoStore;
use endowire_methods::Scene;

/// A file of this crate.
fn of_crate(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The scene that is run.
fn scene() -> PathBuf {
    of_crate("../../assets/scenes/arch_carotid.toml")
}

/// The folder with the shared library: it was built beside this test.
fn libraries() -> PathBuf {
    let folder = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    let name = format!("{}endowire_c{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    assert!(folder.join(&name).exists(), "{name} is not in {}, beside this test", folder.display());
    folder
}

/// Compiles a program for these flags, and runs it with these arguments; what it printed.
fn run(compiler: &str, flags: &[&str], source: &str, arguments: &[&Path]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("program");
    let libraries = libraries();
    let compiled = Command::new(compiler)
        .args(flags)
        .args(["-Wall", "-Wextra", "-Werror", "-pedantic"])
        .arg(of_crate(source))
        .arg("-I")
        .arg(of_crate("include"))
        .arg("-L")
        .arg(&libraries)
        .arg("-lendowire_c")
        .arg(format!("-Wl,-rpath,{}", libraries.display()))
        .arg("-o")
        .arg(&program)
        .output();
    let compiled = compiled.unwrap_or_else(|e| panic!("{compiler} is needed for this test, install it: {e}"));
    assert!(compiled.status.success(), "{source}: {}", String::from_utf8_lossy(&compiled.stderr));
    // In the folder from which the guide's programs read `assets`.
    let done = Command::new(&program).args(arguments).current_dir(of_crate("../..")).output().unwrap();
    let (said, warned) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{source}: {}\n{said}{warned}", done.status);
    said.into_owned()
}

/// The numbers of all lines that begin with this word.
fn numbers(said: &str, word: &str) -> Vec<Vec<f64>> {
    let lines = said.lines().filter_map(|line| line.strip_prefix(word)?.strip_prefix(' '));
    lines.map(|line| line.split(' ').map(|number| number.parse().unwrap()).collect()).collect()
}

/// Length, force and tip after the commands of the examples, without the C interface.
fn expected() -> (f64, f64, Vec<f64>) {
    let mut simulation = Scene::read(&scene()).unwrap().simulation(&NoStore).unwrap();
    for _ in 0..30 {
        let command = endowire_core::Command { advance_mm: 2.0, rotate_rad: 0.1, steer: 0.0 };
        simulation.step(command).unwrap();
    }
    let report = simulation.report();
    (report.inserted_mm, report.push_force_n, simulation.shape().tip_mm().unwrap().iter().copied().collect())
}

#[test]
fn programs_in_c_and_cpp_arrive_where_the_library_does_to_the_bit() {
    let (inserted_mm, push_force_n, tip_mm) = expected();
    assert!((inserted_mm - 60.0).abs() < 1e-9 && push_force_n.abs() > 1e-4, "it touches the wall");

    let said = run("cc", &["-std=c99"], "examples/insert.c", &[&scene()]);
    assert_eq!(numbers(&said, "tip_mm"), std::slice::from_ref(&tip_mm), "{said}");
    assert_eq!(numbers(&said, "inserted_mm"), [[inserted_mm]]);
    assert_eq!(numbers(&said, "push_force_n"), [[push_force_n]]);

    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("picture.pgm");
    let said = run("c++", &["-std=c++17"], "examples/insert.cpp", &[&scene(), &picture]);
    // The simulation, and its clone after another way and a restored state.
    assert_eq!(numbers(&said, "tip_mm"), [tip_mm.clone(), tip_mm], "{said}");
    let picture = std::fs::read(picture).unwrap();
    let grey = picture.strip_prefix(b"P5 128 128 255\n").unwrap();
    assert_eq!(grey.len(), 128 * 128);
    let (least, most) = (grey.iter().min().unwrap(), grey.iter().max().unwrap());
    assert!(most - least > 50, "{least} to {most}: nothing is seen");
}

#[test]
fn the_program_of_the_guide_works() {
    let chapter = std::fs::read_to_string(of_crate("../../docs/guide/21-c.md")).unwrap();
    let (_, program) = chapter.split_once("```c\n").unwrap();
    let (program, _) = program.split_once("```").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("program.c");
    std::fs::write(&source, program).unwrap();
    let said = run("cc", &["-std=c99"], source.to_str().unwrap(), &[]);
    assert!(said.starts_with("60.0 mm in, push ") && !said.contains("nan"), "{said}");
}

#[test]
fn errors_in_c_are_as_the_header_says() {
    let said = run("cc", &["-std=c99"], "tests/all/errors.c", &[&scene()]);
    let sizes = [
        size_of::<EndowireMove>(),
        size_of::<EndowireReport>(),
        size_of::<EndowireInstrument>(),
        size_of::<EndowireContact>(),
    ];
    assert_eq!(numbers(&said, "sizes"), [sizes.map(|bytes| bytes as f64)]);
    assert!(said.contains("text nowhere.toml: No such file"), "{said}");
    let points = &numbers(&said, "points")[0];
    assert!(points[0] > 1.0 && points[0] == points[1], "{said}");

    let [ok, input, null, small] = [0, 1, 4, 5];
    let expected = [
        (ok, "read made no_motion step report instrument renderer"),
        (
            input,
            "missing not_utf8 wrong_key no_such_instrument too_far no_solves back_in_time no_coil no_instrument no_such_coil \
             not_a_state no_size no_c_arm no_lumen",
        ),
        (null, "no_path no_out no_scene no_simulation no_moves no_report no_points no_count no_renderer"),
        (small, "small_report few_points few_pixels"),
    ];
    let mut told: Vec<&str> = said.lines().filter(|line| line.split(' ').count() == 2).collect();
    for (status, names) in expected {
        for name in names.split(' ') {
            assert!(told.contains(&format!("{name} {status}").as_str()), "{name} is not {status}:\n{said}");
            told.retain(|line| !line.starts_with(&format!("{name} ")));
        }
    }
    assert_eq!(told, Vec::<&str>::new(), "told, and not expected");
}

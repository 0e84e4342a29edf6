//! The examples by task run. They are compiled in here, so that no program of theirs must be built before.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

#[path = "../../../crates/viewer/examples/film_of_a_push.rs"]
mod film_of_a_push;
#[path = "../../../crates/core/examples/gradient_of_a_tip.rs"]
mod gradient_of_a_tip;
#[path = "../../../crates/core/examples/magnet_at_the_tip.rs"]
mod magnet_at_the_tip;
#[path = "../../../crates/core/examples/many_on_all_cores.rs"]
mod many_on_all_cores;
#[path = "../../../crates/core/examples/my_own_controller.rs"]
mod my_own_controller;
#[path = "../../../crates/core/examples/my_own_field.rs"]
mod my_own_field;
#[path = "../../../crates/recording/examples/record_and_read_back.rs"]
mod record_and_read_back;
#[path = "../../examples/scene_recorded_and_drawn.rs"]
mod scene_recorded_and_drawn;
#[path = "../../../crates/core/examples/step_a_simulation.rs"]
mod step_a_simulation;

/// A test for each of these examples, and the list of their names.
macro_rules! run {
    ($($name:ident)*) => {
        mod runs {
            $(#[test]
            fn $name() {
                super::$name::main().unwrap();
            })*
        }

        const RUN: &[&str] = &[$(stringify!($name)),*];
    };
}

run! {
    film_of_a_push gradient_of_a_tip magnet_at_the_tip many_on_all_cores my_own_controller my_own_field
    record_and_read_back scene_recorded_and_drawn step_a_simulation
}

/// Rust files that the guide's first page links.
fn linked() -> BTreeSet<PathBuf> {
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/guide");
    let page = std::fs::read_to_string(guide.join("README.md")).unwrap();
    let links = page.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    links.filter(|link| link.ends_with(".rs")).map(|link| guide.join(link)).collect()
}

#[test]
fn examples_that_the_guide_links_run_and_are_short() {
    let linked = linked();
    assert!(linked.len() >= 8, "{linked:?}");
    for file in &linked {
        let name = file.file_stem().unwrap().to_str().unwrap();
        assert!(RUN.contains(&name), "{name} is not run");
        let lines = std::fs::read_to_string(file).unwrap().lines().count();
        assert!(lines < 40, "{name}: {lines} lines");
    }
}

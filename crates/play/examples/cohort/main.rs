//! A cohort of simulated trainees in the training subjects, and the score of each kind:
//! `cargo run --release -p endowire-play --example cohort -- left_carotid`, or without a name in all of them.

#![allow(clippy::unwrap_used, reason = "a subject that cannot be played is to stop it")]

mod plan;
mod trainee;

use std::path::Path;

use plan::Place;
use trainee::KINDS;

fn main() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/subjects");
    let named: Vec<String> = std::env::args().skip(1).collect();
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|end| end == "toml"));
    files.sort();
    for path in files {
        let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
        if !named.is_empty() && !named.contains(&stem) {
            continue;
        }
        let place = Place::of(&path);
        let plan = place.plan();
        println!("{stem}");
        for kind in &KINDS {
            let score = kind.score(&place, &plan);
            let verdict = &score.verdict;
            let missed = score.asked().filter(|(one, _)| one.passed != Some(true));
            let missed: Vec<String> =
                missed.map(|(one, _)| format!("{} {}", one.metric.name, one.value_words())).collect();
            let of = |name: &str| {
                score.metrics.iter().find(|one| one.metric.name == name).and_then(|one| one.metric.value)
            };
            println!(
                "  {:<9} {:<18} {:>5.1}  {:<8} {:>6.1} s  {:>7.1} µGy  {}",
                format!("{:?}", kind.class),
                kind.name,
                verdict.score,
                verdict.ended.map_or("left", |ended| match ended.by {
                    endowire_assess::EndedBy::Goal => "goal",
                    _ => "limit",
                }),
                of("total_s").unwrap_or(0.0),
                of("entrance_ugy").unwrap_or(0.0),
                missed.join(", ")
            );
        }
    }
}

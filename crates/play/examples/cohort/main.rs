//! A cohort of simulated trainees in the training subjects, the score of each kind, and how well scores tell those whom a
//! teacher would pass from the others (area under the receiver operating characteristic):
//! `cargo run --release -p endowire-play --example cohort -- left_carotid`, or without a name in all of them.

#![allow(clippy::unwrap_used, reason = "a subject that cannot be played is to stop it")]

mod plan;
mod trainee;

use std::path::Path;

use endowire_assess::auc;
use plan::Place;
use trainee::{Class, KINDS};

fn main() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/subjects");
    let named: Vec<String> = std::env::args().skip(1).collect();
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|end| end == "toml"));
    files.sort();
    // Scores of novices and of experts, in all subjects.
    let mut all = [vec![], vec![]];
    for path in files {
        let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
        if !named.is_empty() && !named.contains(&stem) {
            continue;
        }
        let place = Place::of(&path);
        let plan = place.plan();
        println!("{stem}");
        let (mut scores, mut by_kind) = ([vec![], vec![]], vec![]);
        for kind in &KINDS {
            let score = kind.score(&place, &plan);
            let verdict = &score.verdict;
            scores[usize::from(kind.class.passes())].push(verdict.score);
            by_kind.push(verdict.score);
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
        let order = Class::ALL.map(|class| {
            let of =
                KINDS.iter().zip(&by_kind).filter(|(kind, _)| kind.class == class).map(|(_, score)| *score);
            (of.clone().fold(f64::MAX, f64::min), of.fold(f64::MIN, f64::max))
        });
        let ordered = order.windows(2).all(|pair| pair[0].0 > pair[1].1);
        println!(
            "  AUC {:.3}, {}",
            auc(&scores[0], &scores[1]),
            if ordered { "in order" } else { "not in order" }
        );
        all.iter_mut().zip(scores).for_each(|(all, scores)| all.extend(scores));
    }
    println!("all subjects: AUC {:.3}", auc(&all[0], &all[1]));
}

//! `passable` says what a simulation does: some of the questions of `cargo run --release -p endowire-benches --bin passages`.

use endowire_core::passable::Passage;
use endowire_tests::passages::{Row, disagreement};

/// Seeds, and what is said of them.
const SEEDS: [(u64, Passage); 5] = [
    (1, Passage::Passes),
    (14, Passage::Passes),
    (17, Passage::Tight),
    (7, Passage::Blocked),
    (63, Passage::Short),
];

#[test]
fn vessel_passable_agrees_with_simulations() {
    let rows: Vec<Row> = SEEDS.iter().map(|(seed, _)| Row::new(*seed).unwrap()).collect();
    for (row, (_, passage)) in rows.iter().zip(SEEDS) {
        assert_eq!((row.reported.passage, &row.against), (passage, &None), "{row}");
    }
    // The twin: what is said of one and done by another that is reported something else.
    let arrives = |row: &Row| [Passage::Passes, Passage::Tight].contains(&row.reported.passage);
    for (reported, done) in rows.iter().flat_map(|reported| rows.iter().map(move |done| (reported, done))) {
        // What is tight may stop at any of its tight places.
        if reported.reported.passage != Passage::Tight && arrives(reported) != arrives(done) {
            let against = disagreement(&reported.reported, &reported.question.device, &done.pushed);
            assert!(against.is_some(), "{reported}\n{done}");
        }
    }
}

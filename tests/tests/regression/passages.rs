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
fn what_is_said_is_what_is_done_and_of_others_it_is_not() {
    let rows: Vec<Row> = SEEDS.iter().map(|(seed, _)| Row::new(*seed).unwrap()).collect();
    for (row, (_, passage)) in rows.iter().zip(SEEDS) {
        assert_eq!((row.told.passage, &row.against), (passage, &None), "{row}");
    }
    // The twin: what is said of one and done by another that is told something else.
    let arrives = |row: &Row| [Passage::Passes, Passage::Tight].contains(&row.told.passage);
    for (told, done) in rows.iter().flat_map(|told| rows.iter().map(move |done| (told, done))) {
        // What is tight may stop at any of its tight places.
        if told.told.passage != Passage::Tight && arrives(told) != arrives(done) {
            let against = disagreement(&told.told, &told.question.device, &done.pushed);
            assert!(against.is_some(), "{told}\n{done}");
        }
    }
}

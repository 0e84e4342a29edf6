//! Coils that are pushed, pulled, turned and detached at random do not pass each other: one of the three hundred deployments of `endowire verify --stress`.

use endowire_lab::deployments::run;

#[test]
fn coils_do_not_pass_each_other_the_wall_or_what_is_in() {
    let row = run(1).unwrap();
    // A solver that refuses every command would be right.
    assert!(row.pass && row.commands >= 40 && row.detached >= 1, "{row}");
}

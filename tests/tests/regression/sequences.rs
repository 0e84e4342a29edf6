//! Random commands of up to 40 mm end where their parts do: two of the three hundred sequences of `endowire verify --stress`.

use endowire_lab::sequences::run;

#[test]
fn large_commands_end_where_their_parts_do() {
    for seed in [0, 4] {
        let row = run(seed).unwrap();
        // A solver that refuses every command would be right.
        assert!(row.pass && row.commands >= 45 && row.unconverged == 0, "{row}");
    }
}

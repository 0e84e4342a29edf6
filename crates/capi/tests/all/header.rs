//! The header in the repository is that of the source.

use std::collections::BTreeSet;

use crate::generate::header;

/// Words that begin with `endowire_` and are followed by a bracket: functions that are declared.
fn functions(text: &str) -> BTreeSet<&str> {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let calls = text.split('(').filter_map(|before| before.rsplit(|c| !is_name(c)).next());
    calls.filter(|name| name.starts_with("endowire_")).collect()
}

#[test]
fn the_header_is_that_of_the_source() {
    let kept = include_str!("../../include/endowire.h");
    assert!(
        kept == header(),
        "include/endowire.h is not that of the source: cargo run -p endowire-capi --example header"
    );
}

#[test]
fn every_exported_function_is_declared() {
    // What cbindgen leaves out, because it does not understand a signature, would be missing silently.
    let mut exported = BTreeSet::new();
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/src")).unwrap() {
        let source = std::fs::read_to_string(entry.unwrap().path()).unwrap();
        let after = source.split("#[unsafe(no_mangle)]").skip(1);
        let names = after.filter_map(|text| Some(text.split_once("fn ")?.1.split_once('(')?.0.to_owned()));
        exported.extend(names);
    }
    let kept = include_str!("../../include/endowire.h");
    let declared: BTreeSet<String> = functions(kept).into_iter().map(str::to_owned).collect();
    assert_eq!(declared.difference(&exported).collect::<Vec<_>>(), Vec::<&String>::new());
    assert_eq!(exported.difference(&declared).collect::<Vec<_>>(), Vec::<&String>::new());
    assert!(exported.len() > 25 && exported.contains("endowire_step"), "{exported:?}");
}

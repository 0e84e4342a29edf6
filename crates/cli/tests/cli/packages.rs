//! What is published says under which licence, and for which compiler.

use std::path::Path;

#[test]
fn every_crate_has_the_licences_and_the_compiler_of_the_workspace() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap();
    let read =
        |path: &Path| std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut count = 0;
    for folder in std::fs::read_dir(&crates).unwrap().map(|e| e.unwrap().path()) {
        let manifest = read(&folder.join("Cargo.toml"));
        for key in ["license", "rust-version", "repository", "version"] {
            assert!(manifest.contains(&format!("\n{key}.workspace = true\n")), "{}: {key}", folder.display());
        }
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            let own = read(&folder.join(licence));
            assert!(own == read(&crates.join("..").join(licence)), "{}: {licence}", folder.display());
        }
        count += 1;
    }
    assert_eq!(count, 13);
}

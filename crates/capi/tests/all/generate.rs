//! Makes the header from the source of this crate.

use std::path::Path;

/// The header, as `cbindgen.toml` has it.
pub(crate) fn header() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("cbindgen.toml");
    let mut builder = cbindgen::Builder::new().with_config(config);
    // In the order in which one reads them.
    for part in ["version", "status", "scene", "simulation", "report", "shape", "state", "picture"] {
        builder = builder.with_src(root.join("src").join(part).with_extension("rs"));
    }
    let mut text = Vec::new();
    builder.generate().expect("a header").write(&mut text);
    String::from_utf8(text).expect("UTF-8")
}

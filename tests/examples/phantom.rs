//! Writes the tomogram and the label map of `assets/ct`:
//!
//! `cargo run -p endowire-tests --example phantom -- assets/ct`

fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "assets/ct".into());
    endowire_tests::phantom::write(std::path::Path::new(&folder))
}

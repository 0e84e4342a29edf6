//! Writes `include/endowire.h` from the source of this crate. A test compares the two.

#[path = "../tests/all/generate.rs"]
mod generate;

fn main() -> std::io::Result<()> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/include/endowire.h");
    std::fs::write(path, generate::header())?;
    println!("{path}");
    Ok(())
}

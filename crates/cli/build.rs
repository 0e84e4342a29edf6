//! Tells the program which revision of its source it was built from.

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=../../.git/HEAD");
    println!("cargo:rerun-if-changed=../../.git/refs/heads");
    println!("cargo:rustc-env=ENDOWIRE_GIT_REVISION={}", revision().unwrap_or_else(|| "unknown".to_owned()));
}

/// The revision of a packaged crate is in the file that cargo puts there, that of a checkout in git.
fn revision() -> Option<String> {
    if let Ok(info) = std::fs::read_to_string(".cargo_vcs_info.json") {
        return info
            .split('"')
            .find(|s| s.len() == 40 && s.bytes().all(|b| b.is_ascii_hexdigit()))
            .map(str::to_owned);
    }
    // A crate unpacked inside somebody else's repository must not take that one's revision.
    if !std::path::Path::new("../../crates/cli/build.rs").exists() {
        return None;
    }
    let output = Command::new("git").args(["rev-parse", "HEAD"]).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

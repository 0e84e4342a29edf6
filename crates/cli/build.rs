//! Tells the program, and the Python package, which revision of its source it was built from.

use std::process::Command;

fn main() {
    // Where git keeps what a commit changes: elsewhere in a second worktree, and there the commits of others are none of ours, so the
    // log of this worktree's head is watched and not all branches. A path that is not there would rebuild always.
    let watched = ["HEAD", "logs/HEAD"].map(|name| git(&["rev-parse", "--git-path", name]));
    for path in watched.into_iter().flatten().filter(|path| std::path::Path::new(path).exists()) {
        println!("cargo:rerun-if-changed={path}");
    }
    for path in ["src", "../core/src", "../methods/src", "../sweep/src", "../viewer/src", "../cli/build.rs"] {
        println!("cargo:rerun-if-changed={path}");
    }
    println!("cargo:rustc-env=ENDOWIRE_GIT_REVISION={}", revision().unwrap_or_else(|| "unknown".to_owned()));
}

/// The revision of a packaged crate is in the file that cargo puts there, that of a checkout in git; "-dirty" where the
/// sources differ from it.
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
    let revision = git(&["rev-parse", "HEAD"])?;
    let changed = git(&["status", "--porcelain", "--", "..", "../../Cargo.toml", "../../Cargo.lock"]);
    Some(if changed.is_none_or(|list| !list.is_empty()) { revision + "-dirty" } else { revision })
}

fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

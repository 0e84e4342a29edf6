//! Hard insertions: whether where a device ends depends on how the hand's motion is cut into commands.
//!
//! ```sh
//! cargo run --release -p endowire-benches --bin hard -- cases [NAME]         # scenes of benches/hard, each against steps of 0.1 mm
//! cargo run --release -p endowire-benches --bin hard -- lines [NAME]         # what each of them takes
//! cargo run --release -p endowire-benches --bin hard -- turned [SCENE]       # 480 insertions of four scenes against steps of 0.25 mm
//! cargo run --release -p endowire-benches --bin hard -- sequences [SEEDS]    # random commands, each against its parts of 1 mm
//! cargo run --release -p endowire-benches --bin hard -- ticks [DEVICE]       # steps, ticks and small steps of one motion of the hand
//! cargo run --release -p endowire-benches --bin hard -- deployments [SEEDS]  # two coils out of a catheter and detached, by random commands
//! ```
//!
//! Ends with 1 where one ends elsewhere in silence.
#![allow(clippy::print_stdout, reason = "a table is what it is for")]

use std::path::Path;
use std::process::ExitCode;

use endowire_core::Result;

fn main() -> Result<ExitCode> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let wrong = endowire_lab::hard::run(&arguments, &repository, &mut |line| println!("{line}"))?;
    Ok(ExitCode::from(u8::from(wrong.is_some_and(|count| count > 0))))
}

//! Records a run beside a simulation, and reads it back. `endowire report` and `endowire export` open the folder, too.
//! `cargo run -p endowire-recording --example record_and_read_back`

use endowire_core::{Command, Device, GeneratedWall, Move, Resolution, Sheath, Simulation, anatomy};
use endowire_recording::{Program, Provenance, Recorder, Recording};

pub(crate) fn main() -> endowire_core::Result<()> {
    let vessel =
        GeneratedWall::new(&anatomy::tree("curved_tube").expect("built in"), Resolution::EdgeMm(2.0))?;
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0)?;
    let mut simulation =
        Simulation::builder(vessel.wall, Device::uniform(300.0, 0.45, 10.0)?, sheath).build()?;

    let folder = std::path::Path::new("out/recorded"); // one that is there is replaced
    let mut recorder = Recorder::new(folder, &simulation)?;
    for step in 1..=40 {
        let moves = [Move { instrument: 0, command: Command::advance(4.0) }];
        simulation.step_together(&moves)?;
        recorder.record(&moves, 0.1 * f64::from(step), &simulation)?; // on disk, whatever happens next
    }
    let program = Program { version: env!("CARGO_PKG_VERSION"), git_revision: "" };
    let mut summary = recorder.summary(&Provenance::new(program, &[""; 0], 0), &simulation);
    recorder.finish(&mut summary)?;

    let recording = Recording::read(folder)?;
    let largest_n = recording.rows().iter().map(|row| row.push_force_n).fold(0.0, f64::max);
    println!("{} steps, {largest_n:.4} N at most", recording.steps());
    println!("tip at the end: {:?} mm", recording.shape(recording.steps()).tip_mm());
    Ok(())
}

//! A program of one's own that records.

use std::path::Path;

use endowire_core::insertion::{Command, Move};
use endowire_core::{Device, GeneratedWall, Resolution, Sheath, Simulation, anatomy};
use endowire_recording::{
    Among, EndedBy, INSTRUMENTS, Program, Provenance, Recorder, Recording, SHAPES, STEPS, SUMMARY, read_steps,
};

fn simulation() -> Simulation {
    let tree = anatomy::tree("curved_tube").unwrap();
    let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(3.0)).unwrap();
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0).unwrap();
    let device = Device::uniform(200.0, 0.45, 10.0).unwrap();
    Simulation::builder(vessel.wall, device, sheath).build().unwrap()
}

fn provenance() -> Provenance {
    Provenance::new(Program { version: "1.0", git_revision: "none" }, &[""; 0], 0)
}

fn steps(recorder: &mut Recorder, simulation: &mut Simulation, steps: std::ops::Range<usize>) {
    for step in steps {
        let moves = [Move { instrument: 0, command: Command::advance(6.0) }];
        simulation.step(moves[0].command).unwrap();
        recorder.record(&moves, 0.5 * (step + 1) as f64, simulation).unwrap();
    }
}

/// A whole recording of so many steps.
pub(crate) fn recorded(folder: &Path, count: usize) -> Simulation {
    let mut simulation = simulation();
    let mut recorder = Recorder::new(folder, &simulation).unwrap();
    steps(&mut recorder, &mut simulation, 0..count);
    let mut summary = recorder.summary(&provenance(), &simulation);
    recorder.finish(&mut summary).unwrap();
    simulation
}

#[test]
fn what_a_program_records_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let simulation = recorded(folder.path(), 5);
    let recording = Recording::read(folder.path()).unwrap();
    assert_eq!((recording.steps(), recording.shape(5)), (5, simulation.shape().clone()));
    let contacts = simulation.report().contacts.iter().map(|one| (one.position_mm, one.total_n()));
    let read = recording.contacts(5).into_iter().map(|one| (one.position_mm, one.force_n));
    assert!(read.eq(contacts));
    let rows = recording.rows().unwrap();
    assert_eq!((rows[4].inserted_mm, rows[4].time_s), (30.0, Some(2.5)));
    assert_eq!(rows[4].push_force_n, simulation.report().push_force_n);
    assert_eq!((recording.about().is_complete(), recording.about().steps), (true, Some(5)));
    let text = std::fs::read_to_string(folder.path().join(SUMMARY)).unwrap();
    assert!(text.contains(&format!("\"ended_by\": \"{}\"", EndedBy::Closed.name())), "{text}");
}

#[test]
fn a_recording_that_goes_on_has_the_bytes_of_one_that_was_never_left() {
    let [whole, left] = [0, 1].map(|_| tempfile::tempdir().unwrap());
    recorded(whole.path(), 5);
    let mut simulation = simulation();
    let mut recorder = Recorder::new(left.path(), &simulation).unwrap();
    steps(&mut recorder, &mut simulation, 0..3);
    let state = simulation.state();
    steps(&mut recorder, &mut simulation, 3..4);
    // As a program that is killed leaves it, one step ahead of the state.
    drop(recorder);
    assert_eq!(Recording::read_in(left.path(), Path::new("")).unwrap().steps(), 4);
    simulation.restore(&state).unwrap();
    let (mut recorder, earlier) = Recorder::go_on(left.path(), Among::Nothing, 3, &simulation).unwrap();
    assert_eq!(earlier.unwrap().steps(), 3);
    steps(&mut recorder, &mut simulation, 3..5);
    let mut summary = recorder.summary(&provenance(), &simulation);
    recorder.finish(&mut summary).unwrap();
    for name in [STEPS, INSTRUMENTS, SHAPES] {
        let [a, b] = [&whole, &left].map(|folder| std::fs::read(folder.path().join(name)).unwrap());
        assert!(a == b, "{name}");
    }
}

#[test]
fn folders_of_others_and_later_versions_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mine.txt"), "mine").unwrap();
    let refused = Recorder::new(folder.path(), &simulation()).unwrap_err().to_string();
    assert!(refused.contains("mine.txt") && !refused.contains("--"), "{refused}");
    assert!(!folder.path().join(STEPS).exists());
    let (recorder, replaced) = Recorder::among(folder.path(), Among::OtherFiles, &simulation()).unwrap();
    drop(recorder);
    assert!(!replaced.recording && replaced.names.is_empty() && folder.path().join("mine.txt").exists());

    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), 2);
    let text = std::fs::read_to_string(folder.path().join(SUMMARY)).unwrap();
    std::fs::write(folder.path().join(SUMMARY), text.replace("\"schema\": 1", "\"schema\": 9")).unwrap();
    let refused = Recording::read(folder.path()).unwrap_err().to_string();
    assert!(refused.contains("schema = 9") && refused.contains("later version"), "{refused}");
}

#[test]
fn a_damaged_row_is_named_by_its_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), 2);
    let path = folder.path().join(STEPS);
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replacen("\n2,6.0,", "\n2,six,", 1)).unwrap();
    let refused = read_steps(folder.path()).unwrap_err().to_string();
    assert!(refused.contains("line 3") && refused.contains("advance_mm"), "{refused}");
    // An incomplete last row is no damage.
    std::fs::write(&path, &text[..text.len() - 4]).unwrap();
    assert_eq!(read_steps(folder.path()).unwrap().len(), 1);
}

#[cfg(unix)]
#[test]
fn links_in_the_folder_are_not_followed() {
    let folder = tempfile::tempdir().unwrap();
    let victim = folder.path().join("victim");
    std::fs::write(&victim, "mine").unwrap();
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    for name in [STEPS, INSTRUMENTS] {
        std::os::unix::fs::symlink(&victim, out.join(name)).unwrap();
    }
    let simulation = simulation();
    drop(Recorder::among(&out, Among::OtherFiles, &simulation).unwrap());
    assert_eq!(std::fs::read_to_string(&victim).unwrap(), "mine");
}

//! A program of one's own that records.

use std::path::Path;

use endowire_core::insertion::{Command, Move};
use endowire_core::{Device, GeneratedWall, Resolution, Sheath, Simulation, anatomy};
use endowire_recording::{
    Among, EndedBy, INSTRUMENTS, Program, Provenance, Recorder, Recording, SHAPES, STEPS, SUMMARY, read_steps,
};

pub(crate) fn simulation() -> Simulation {
    let tree = anatomy::tree("curved_tube").unwrap();
    let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(3.0)).unwrap();
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0).unwrap();
    let device = Device::uniform(200.0, 0.45, 10.0).unwrap();
    Simulation::builder(vessel.wall, device, sheath).build().unwrap()
}

pub(crate) fn provenance() -> Provenance {
    Provenance::new(Program { version: "1.0", git_revision: "none" }, &[""; 0], 0)
}

pub(crate) fn steps(recorder: &mut Recorder, simulation: &mut Simulation, steps: std::ops::Range<usize>) {
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
    let rows = recording.rows();
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

/// The text of a table with a changed line, from 1, or without it.
pub(crate) fn changed(text: &str, line: usize, to: Option<&str>) -> String {
    let lines = text.lines().enumerate();
    let lines = lines.filter_map(|(index, own)| if index + 1 == line { to } else { Some(own) });
    lines.map(|line| format!("{line}\n")).collect()
}

#[test]
fn tables_that_are_not_of_the_steps_of_the_shapes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), 4);
    let read = |name: &str, text: Option<String>| {
        let path = folder.path().join(name);
        let whole = std::fs::read(&path).unwrap();
        match text {
            Some(text) => std::fs::write(&path, text).unwrap(),
            None => std::fs::remove_file(&path).unwrap(),
        }
        let read = Recording::read(folder.path()).map(|recording| recording.steps());
        std::fs::write(&path, whole).unwrap();
        read.map_err(|error| error.to_string())
    };
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let [steps, instruments] = [STEPS, INSTRUMENTS].map(text);
    assert_eq!(read(STEPS, Some(steps.clone())), Ok(4), "the twin");
    let half = |text: &str| text[..text.len() - 6].to_owned();
    let swapped = changed(&changed(&steps, 3, steps.lines().nth(3)), 4, steps.lines().nth(2));
    // Column 10 is where the tip is along z.
    let columns = steps.lines().nth(2).unwrap().split(',').enumerate();
    let columns: Vec<&str> = columns.map(|(k, cell)| if k == 10 { "0.125" } else { cell }).collect();
    let other = changed(&steps, 3, Some(&columns.join(",")));
    for (name, text, reported) in [
        (
            STEPS,
            Some(changed(&steps, 3, None)),
            "steps.csv: line 3: step = 3: comes after step 1: rows are missing",
        ),
        (
            STEPS,
            Some(changed(&steps, 2, None)),
            "instruments.csv: line 2: step = 1: steps.csv has step 2 there",
        ),
        (
            STEPS,
            Some(changed(&steps, 5, None)),
            "steps.csv: step = 3: is the last one, and summary.json counts 4",
        ),
        (STEPS, Some(changed(&steps, 3, Some("2,6.0"))), "steps.csv: CSV error: record 2 (line: 3"),
        (STEPS, Some(swapped), "steps.csv: line 3: step = 3: comes after step 1"),
        (STEPS, Some(other), "steps.csv: line 3: step 2 has "),
        (STEPS, Some(half(&steps)), "steps.csv: step = 3: is the last one"),
        (STEPS, Some(steps.clone() + "5,6"), "steps.csv: line = 6: summary.json says that the run has ended"),
        (STEPS, None, "steps.csv: "),
        (
            INSTRUMENTS,
            Some(changed(&instruments, 3, None)),
            "instruments.csv: line 3: step = 3: steps.csv has step 2",
        ),
        (
            INSTRUMENTS,
            Some(changed(&instruments, 5, None)),
            "instruments.csv: step = 4: is missing from line 5 on",
        ),
        (INSTRUMENTS, Some(half(&instruments)), "instruments.csv: step = 4: is missing from line 5 on"),
        (
            INSTRUMENTS,
            Some(instruments.replace("\n3,device,", "\n3,wire,")),
            "line 4: step[3].instrument = [wire]",
        ),
        (
            INSTRUMENTS,
            Some(instruments.replace(",device,", ",wire,")),
            "line 2: step[1].instrument = [wire]: those of the run",
        ),
        (INSTRUMENTS, None, "instruments.csv: is missing, and steps.csv needs it"),
        (SUMMARY, Some("[]".to_owned()), "summary.json: schema: the version of the format"),
        (SUMMARY, Some("{}".to_owned()), "summary.json: schema: the version of the format"),
    ] {
        let error = read(name, text).unwrap_err();
        assert!(error.contains(reported) && error.contains("endowire run"), "{error}\n{reported}");
    }
    // The same last rows are what a kill leaves.
    let summary = text(SUMMARY).replace("\"complete\": true", "\"complete\": false");
    std::fs::write(folder.path().join(SUMMARY), summary.replace("\"steps\": 4", "\"steps\": 2")).unwrap();
    for (name, text) in
        [(STEPS, half(&steps)), (STEPS, changed(&steps, 5, None)), (INSTRUMENTS, half(&instruments))]
    {
        let path = folder.path().join(name);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, text).unwrap();
        let recording = Recording::read(folder.path()).unwrap();
        assert_eq!((recording.steps(), recording.rows().len()), (3, 3));
        assert!(recording.left_out().unwrap().contains(name), "{:?}", recording.left_out());
        std::fs::write(&path, whole).unwrap();
    }
    assert!(read(STEPS, Some(changed(&steps, 3, None))).unwrap_err().contains("comes after step 1"));
    assert_eq!(Recording::read(folder.path()).unwrap().left_out(), None, "the twin");
}

#[test]
fn a_step_that_is_not_the_next_one_of_the_simulation_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut simulation = simulation();
    let mut recorder = Recorder::new(folder.path(), &simulation).unwrap();
    let moves = [Move { instrument: 0, command: Command { rotate_rad: 0.2, ..Command::advance(6.0) } }];
    let step = |simulation: &mut Simulation| simulation.step(moves[0].command).map(drop).unwrap();
    let refused = |recorder: &mut Recorder, simulation: &Simulation, time_s: f64| {
        recorder.record(&moves, time_s, simulation).unwrap_err().to_string()
    };
    step(&mut simulation);
    recorder.record(&moves, 1.0, &simulation).unwrap();
    let twice = refused(&mut recorder, &simulation, 2.0);
    assert!(
        twice.contains("step 2 is not the next one")
            && twice.contains("to 12 mm and 0.4 rad, and it is at 6 mm"),
        "{twice}"
    );
    step(&mut simulation);
    let earlier = refused(&mut recorder, &simulation, 0.5);
    assert!(earlier.contains("time_s = 0.5: must be a time from that of the last step, 1 s"), "{earlier}");
    let mut beyond = simulation.clone();
    step(&mut beyond);
    assert!(refused(&mut recorder, &beyond, 2.0).contains("it is at 18 mm"), "a gap");
    let stiffer = [(endowire_core::methods::Parameter::BendingStiffness { instrument: 0, section: 0 }, 12.0)];
    let other = refused(&mut recorder, &simulation.changed(&stiffer).unwrap(), 2.0);
    assert!(other.contains("other instruments"), "{other}");
    let mut nan = moves;
    nan[0].command.steer = f64::NAN;
    assert!(recorder.record(&nan, 2.0, &simulation).unwrap_err().to_string().starts_with("steer = NaN"));
    // The step that is the next one, also of a copy.
    recorder.record(&moves, 2.0, &simulation.clone()).unwrap();
    assert_eq!(recorder.steps(), 2);
    // Motion that was left over belongs to the hands until it is dropped.
    let far = [Move { instrument: 0, command: Command::advance(120.0) }];
    simulation.tick(&far, 1, None).unwrap();
    assert!(simulation.report().is_under_way());
    recorder.record(&far, 3.0, &simulation).unwrap();
    simulation.forget();
    step(&mut simulation);
    recorder.record(&moves, 4.0, &simulation).unwrap();
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

//! What the tables of a recording may say: finite numbers, and rows of its steps.

use std::path::Path;

use endowire_recording::{
    COILS, INJECTIONS, INSTRUMENTS, PACKING, PLACES, Recording, Rows, STEPS, SUMMARY, VESSEL,
};

use crate::program::{changed, recorded};

/// What is said of a recording in a folder with another table, which is then as before.
fn read_with(folder: &Path, name: &str, text: &str) -> Result<Option<String>, String> {
    let path = folder.join(name);
    let before = std::fs::read(&path).ok();
    std::fs::write(&path, text).unwrap();
    let read = Recording::read(folder).map(|recording| recording.left_out().map(str::to_owned));
    match before {
        Some(before) => std::fs::write(&path, before).unwrap(),
        None => std::fs::remove_file(&path).unwrap(),
    }
    read.map_err(|error| error.to_string())
}

const VESSELS: &str = "\
step,unknown,x_mm,y_mm,z_mm
1,0,0,0,0.5
2,0,0,0,0.5
3,0,0,0,0.5
4,0,0,0,0.5
";
const PLACE_ROWS: &str = "\
step,place,x_mm,y_mm,z_mm,displacement_mm
1,left,0,0,0,0.5
2,left,0,0,0,0.5
3,left,0,0,0,0.5
4,left,0,0,0,0.5
";
const PACKINGS: &str = "\
step,coils_mm3,packing,neck_coverage,outside_mm,herniated,dome_force_n
2,2,0.02,0.1,0,false,0.5
3,3,0.03,0.1,0,false,0.5
4,4,0.04,0.1,0,false,0.5
";
const COIL_ROWS: &str = "\
step,coil,instrument,from_tip_mm,x_mm,y_mm,z_mm,tangent_x,tangent_y,tangent_z
2,0,device,3,0,0,0.5,0,0,1
2,0,device,0,0,0,3,0,0,1
4,0,device,3,0,0,0.5,0,0,1
4,0,device,0,0,0,3,0,0,1
4,1,device,0,0,0,3,0,0,1
";
const INJECTED: &str = "\
after_step,time_s,instrument,volume_ml,rate_ml_per_s,inserted_mm,tip_x_mm,tip_y_mm,tip_z_mm,tip_force_n
0,0,device,2,1,0,0,0,0.5,
3,1.5,device,2,1,18,0,0,0.5,0
";

/// The tables above, each of the recording of four steps.
const TABLES: [(&str, &str); 5] = [
    (VESSEL, VESSELS),
    (PLACES, PLACE_ROWS),
    (PACKING, PACKINGS),
    (COILS, COIL_ROWS),
    (INJECTIONS, INJECTED),
];

#[test]
fn a_number_that_is_not_finite_is_refused_with_its_table_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), 4);
    let own = [STEPS, INSTRUMENTS].map(|name| {
        // The places of tips along z, columns 10 and 11, are numbers in each table.
        (name, std::fs::read_to_string(folder.path().join(name)).unwrap())
    });
    let all = own.into_iter().chain(TABLES.map(|(name, text)| (name, text.to_owned())));
    for (name, text) in all {
        assert_eq!(read_with(folder.path(), name, &text), Ok(None), "{name}: the twin");
        let columns: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let cells: Vec<&str> = text.lines().nth(2).unwrap().split(',').collect();
        let mut tried = 0;
        for (index, column) in columns.iter().enumerate() {
            let counts = ["step", "coil", "unknown", "after_step", "nodes", "contacts", "iterations"];
            let is_number = cells[index].parse::<f64>().is_ok()
                && !counts.contains(column)
                && !["substeps", "nodes_solved", "relaxations"].contains(column);
            if !is_number {
                continue;
            }
            for number in ["NaN", "inf", "-inf"] {
                let mut cells = cells.clone();
                cells[index] = number;
                let text = changed(&text, 3, Some(&cells.join(",")));
                let error = read_with(folder.path(), name, &text).unwrap_err();
                let expected = format!("{name}: line 3: {column} = {number}: must be a finite number");
                assert!(error.contains(&expected), "{error}\n{expected}");
            }
            tried += 1;
        }
        assert!(tried >= 3, "{name}: {tried}");
    }
}

#[test]
fn packing_coils_and_injections_are_of_the_steps() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), 4);
    let read = |name: &str, text: &str| read_with(folder.path(), name, text);
    let without = |text: &str, line: usize| changed(text, line, None);
    let half = |text: &str| text[..text.len() - 3].to_owned();
    for (name, text, reported) in [
        (PACKING, without(PACKINGS, 3), "line 3: step = 4: steps.csv has step 3 there"),
        (PACKING, without(PACKINGS, 4), "step = 4: is missing from line 4 on"),
        (PACKING, half(PACKINGS), "step = 4: is missing from line 4 on"),
        (PACKING, PACKINGS.replace("\n4,", "\n4,4,0.04,0.1,0,false,0.5\n5,"), "line 5: step = 5: is no step"),
        (PACKING, PACKINGS.replace("\n3,", "\n2,"), "line 2: step[2].rows = [packing, packing]"),
        (COILS, COIL_ROWS.replace("\n4,", "\n5,"), "line 4: step = 5: is no step of steps.csv"),
        (COILS, without(COIL_ROWS, 3), "line 2: from_tip_mm = 3: is where coil 0 ends in step 2"),
        (COILS, without(COIL_ROWS, 5), "line 4: from_tip_mm = 3: is where coil 0 ends in step 4"),
        (COILS, half(COIL_ROWS), "line = 6: summary.json says that the run has ended, and this row is cut"),
        (COILS, COIL_ROWS.replace("\n4,1,", "\n4,2,"), "line 6: coil = 2: comes first, and 1 is the next"),
        (COILS, COIL_ROWS.replace("\n4,", "\n1,"), "line 4: coil = 0: of step 1 comes after coils"),
        (
            COILS,
            COIL_ROWS.replace("\n4,1,device", "\n4,1,wire"),
            "line 6: instrument = wire: those of the run",
        ),
        (INJECTIONS, INJECTED.replace("\n3,", "\n5,"), "line 3: after_step = 5: steps.csv ends with step 4"),
        (INJECTIONS, INJECTED.replace("\n0,", "\n4,"), "line 3: after_step = 3: comes after 4"),
        (INJECTIONS, INJECTED.replace("1.5", "-1.5"), "line 3: time_s = -1.5: comes after 0"),
        (
            INJECTIONS,
            INJECTED.replace("device", "wire"),
            "line 2: instrument = wire: those of the run are [device]",
        ),
    ] {
        let error = read(name, &text).unwrap_err();
        let all = format!("{name}: {reported}");
        assert!(error.contains(&all) && error.contains("run the scene again"), "{error}\n{all}");
    }
    // The same last rows are what a kill leaves.
    let summary = std::fs::read_to_string(folder.path().join(SUMMARY)).unwrap();
    let killed = summary.replace("\"complete\": true", "\"complete\": false");
    std::fs::write(folder.path().join(SUMMARY), killed.replace("\"steps\": 4", "\"steps\": 2")).unwrap();
    for (name, text, left) in [
        (PACKING, without(PACKINGS, 4), Some("packing.csv has not all rows of a later step")),
        (PACKING, half(PACKINGS), Some("packing.csv has not all rows of a later step")),
        (COILS, without(&without(COIL_ROWS, 6), 5), Some("coils.csv has not all rows of a later step")),
        (COILS, COIL_ROWS.replace("\n4,", "\n5,"), None),
        (INJECTIONS, INJECTED.replace("\n3,", "\n5,"), Some("injections.csv has some after later steps")),
    ] {
        assert_eq!(read(name, &text), Ok(left.map(str::to_owned)), "{name}");
    }
    let path = folder.path().join(INJECTIONS);
    std::fs::write(path, INJECTED.replace("\n3,", "\n5,")).unwrap();
    let about = endowire_recording::About::read(folder.path()).unwrap();
    assert_eq!(Rows::read(folder.path(), &about).unwrap().injections.len(), 1);
}

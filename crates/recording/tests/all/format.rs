//! What the repository says of the format is true.

use std::collections::BTreeSet;
use std::path::Path;

use endowire_recording::schema::{TABLES, document};
use endowire_recording::{STEPS, StepRow, VERSION};
use serde_json::Value;

use crate::program::recorded;

fn repository(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

#[test]
fn the_schema_in_the_repository_is_that_of_the_program() {
    let there: Value = serde_json::from_str(&repository("recording.schema.json")).unwrap();
    assert!(
        there == document(),
        "cargo run -p endowire-recording --example schema > crates/recording/recording.schema.json"
    );
}

/// First lines of the tables as they have always been: whoever reads them by position can go on.
#[test]
fn columns_stay_where_they_are() {
    let begins = [
        (
            "steps.csv",
            "step,advance_mm,rotate_rad,inserted_mm,rotation_rad,mouth_rotation_rad,tip_rotation_rad,nodes,tip_x_mm,tip_y_mm,tip_z_mm,push_force_n,torque_nmm,bend_mj,twist_mj,wall_mj,field_mj,tail_mj,vessel_mj,dissipated_mj,contacts,max_penetration_mm,largest_bend_rad,iterations,substeps,jumped,left_through,nodes_solved,angles,converged,relaxations,imbalance,released_mj,wall_force_sum_n,wall_force_largest_n,wall_force_tip_n,drag_n,vessel_displacement_mm,time_s",
        ),
        (
            "instruments.csv",
            "step,instrument,advance_mm,rotate_rad,inserted_mm,rotation_rad,mouth_rotation_rad,tip_rotation_rad,steer,tip_x_mm,tip_y_mm,tip_z_mm,push_force_n,torque_nmm,felt_mm,felt_radius_mm,lateral_n",
        ),
        (
            "injections.csv",
            "after_step,time_s,instrument,volume_ml,rate_ml_per_s,inserted_mm,tip_x_mm,tip_y_mm,tip_z_mm,tip_force_n",
        ),
        ("coils.csv", "step,coil,instrument,from_tip_mm,x_mm,y_mm,z_mm,tangent_x,tangent_y,tangent_z"),
        ("vessel.csv", "step,unknown,x_mm,y_mm,z_mm"),
        ("places.csv", "step,place,x_mm,y_mm,z_mm,displacement_mm"),
        ("packing.csv", "step,coils_mm3,packing,neck_coverage,outside_mm,herniated,dome_force_n"),
    ];
    for ((name, columns), (expected, begin)) in TABLES.iter().zip(begins) {
        let names: Vec<&str> = columns.iter().map(|column| column.name).collect();
        assert_eq!((*name, names.join(",")), (expected, begin.to_owned()));
    }
}

#[test]
fn the_guide_explains_each_column_of_steps() {
    let guide = repository("../../docs/guide/4-forces.md") + &repository("../../docs/guide/22-yielding.md");
    let missing = |guide: &str| -> Vec<&str> {
        let names = StepRow::COLUMNS.iter().map(|column| column.name);
        names.filter(|name| !guide.contains(&format!("`{name}`"))).collect()
    };
    assert_eq!(missing(&guide), [""; 0]);
    assert_eq!(missing(&guide.replace("`drag_n`", "")), ["drag_n"], "the twin");
}

/// The keys of a document that the schema does not have, and those that it requires and the document has not.
fn wrong_keys(document: &Value, schema: &Value) -> BTreeSet<String> {
    let (there, known) = (document.as_object().unwrap(), schema["properties"].as_object().unwrap());
    let kind = |value: &Value| match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    let fits = |value: &Value, types: &Value| {
        let is = |one: &Value| one == kind(value) || one == "number" && kind(value) == "integer";
        types.as_array().map_or_else(|| is(types), |types| types.iter().any(is))
    };
    let odd = there.iter().filter(|(key, value)| !known.get(*key).is_some_and(|k| fits(value, &k["type"])));
    let required = schema["required"].as_array().unwrap().iter().filter_map(Value::as_str);
    let absent = required.filter(|key| !there.contains_key(*key));
    odd.map(|(key, _)| key.clone()).chain(absent.map(str::to_owned)).collect()
}

#[test]
fn a_summary_is_as_the_schema_says() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), 3);
    let text = std::fs::read_to_string(folder.path().join("summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(wrong_keys(&summary, &document()), BTreeSet::new());
    assert_eq!(summary["schema"], VERSION);
    // The twins: a key that nobody declares, one of another type, and one that is missing.
    let mut other = summary;
    other["more"] = 1.into();
    other["method"] = Value::Null;
    other.as_object_mut().unwrap().remove("jumps");
    let wrong: Vec<String> = wrong_keys(&other, &document()).into_iter().collect();
    assert_eq!(wrong, ["jumps", "method", "more"]);
    // Rows, too.
    let rows = endowire_recording::read_steps(folder.path()).unwrap();
    let row = serde_json::to_value(&rows[2]).unwrap();
    let schema = document()["$defs"][STEPS].clone();
    let wrong = wrong_keys(&row, &schema);
    assert_eq!(wrong, BTreeSet::from(["left_through".to_owned()]), "empty while it is inside");
}

//! The format of recordings as a JSON schema: that of summary.json, with the columns of tables and arrays as definitions.

use serde_json::{Map, Value, json};

use crate::arrays::{MEMBERS, SHAPES};
use crate::columns::{Column, unit};
use crate::npz::Kind;
use crate::{
    COILS, CoilRow, INJECTIONS, INSTRUMENTS, InjectionRow, InstrumentRow, PACKING, PLACES, PackingRow,
    PlaceRow, STEPS, SUMMARY, StepRow, UnknownRow, VERSION, VESSEL,
};

/// Keys of summary.json: name, type in words of JSON Schema (with "?" if it may be null, "-" if it may be absent), and
/// meaning.
const KEYS: &[(&str, &str, &str)] = &[
    ("schema", "integer", "Version of the format."),
    ("version", "string", "Version of the program."),
    ("git_revision", "string", "Git revision of its source."),
    ("scene_hash", "string", "SHA-256 of the scene's text and of the files it names."),
    ("seed", "integer", "Seed of all that is random."),
    ("set", "array-", "Keys of the scene that were set beside its file, KEY=VALUE."),
    ("complete", "boolean", "Whether the run has ended and everything is written."),
    ("scene", "string", "Name of the scene; empty without one."),
    ("scene_file", "string-", "File of the scene."),
    ("script_file", "string-", "File of its script, if that is not the scene's own."),
    ("method", "string", "Name of the method."),
    ("centreline_found", "boolean", "Whether the vessel's centre line was extracted from its surface."),
    ("start_mm", "array-", "Place of the foremost tip before the first step."),
    ("steps", "integer", "Number of steps carried out."),
    ("steps_asked", "integer", "Number of steps in the script."),
    ("converged", "boolean", "Whether all steps were carried out and all of them converged."),
    ("ended_by", "string?", "Reason for the end; null while the run goes on."),
    ("failure", "object?", "The step that failed, if one did: step, reason and kind."),
    ("inserted_mm", "number", "Inserted length at the end."),
    ("rotation_rad", "number", "Rotation of the hand at the end."),
    ("mouth_rotation_rad", "number", "Rotation at the sheath's mouth at the end."),
    ("tip_rotation_rad", "number", "Rotation of the tip at the end."),
    ("tip_mm", "array?", "Place of the tip at the end."),
    ("push_force_n", "number", "Push force at the end."),
    ("torque_nmm", "number", "Torque at the end."),
    (
        "until",
        "array-",
        "Lines of the script with a condition that have ended: line, steps, after_step and met.",
    ),
    ("instruments", "array-", "The instruments at the end: name, motion and reaction forces."),
    ("energy_mj", "object", "Energies at the end: bend, twist, wall, field, tail and vessel."),
    ("wall_force", "object", "Wall forces at the end: sum_n, largest_n and tip_n."),
    ("unconverged_steps", "integer", "Number of steps that are no equilibria."),
    ("first_unconverged_step", "integer?", "The first of them."),
    ("jumps", "integer", "Number of steps with a jump."),
    ("relaxations", "integer", "Relaxations of all steps."),
    ("max_imbalance", "number", "Largest imbalance of any step after which the device lies still."),
    ("max_penetration_mm", "number", "Deepest penetration of the wall in any step."),
    ("max_wall_force", "object", "Largest wall forces of any step: sum_n, largest_n and tip_n."),
    ("max_turn_deg", "number", "Largest angle by which an element bends in any step."),
    ("max_push_force_n", "number", "Largest push force of any step."),
    ("max_torque_nmm", "number", "Largest torque of any step, in either direction."),
    ("max_tip_lag_rad", "number", "Largest angle between the rotations of hand and tip."),
    ("ends_under_way", "boolean", "Whether the last step has left motion to the next."),
    ("left_through", "integer?", "Number of the opening through which the device has left at the end."),
    ("packing", "object-", "Packing of the scene's sac at the end."),
    ("step_time_s", "number", "Time of the simulation, without recording and frames."),
    ("wall_time_s", "number", "Time of the whole run."),
    ("renderer", "string?", "Backend that drew the frames."),
    ("planes", "array", "Planes of fluoroscopy: primary_deg, secondary_deg, camera_matrix and exposure."),
    ("frames", "array", "Paths of the frames, relative to the folder."),
    ("film", "string?", "File name of the film."),
];

/// The tables of a recording with their columns.
pub const TABLES: [(&str, &[Column]); 7] = [
    (STEPS, StepRow::COLUMNS),
    (INSTRUMENTS, InstrumentRow::COLUMNS),
    (INJECTIONS, InjectionRow::COLUMNS),
    (COILS, CoilRow::COLUMNS),
    (VESSEL, UnknownRow::COLUMNS),
    (PLACES, PlaceRow::COLUMNS),
    (PACKING, PackingRow::COLUMNS),
];

/// The JSON schema (draft 2020-12) of summary.json, with a definition for a row of each table and for the arrays.
pub fn document() -> Value {
    let mut definitions: Map<String, Value> = TABLES
        .iter()
        .map(|(name, columns)| {
            let required: Vec<&str> =
                columns.iter().filter(|one| !one.optional).map(|one| one.name).collect();
            let columns = columns.iter().map(|one| (one.name.to_owned(), of_column(one)));
            let row = json!({
                "description": format!("A row of {name}."),
                "type": "object",
                "properties": columns.collect::<Map<_, _>>(),
                "required": required,
            });
            ((*name).to_owned(), row)
        })
        .collect();
    let arrays = MEMBERS.iter().map(|one| {
        let kind = match one.kind {
            Kind::F64 => "number",
            Kind::I64 => "integer",
        };
        let item = match one.columns {
            1 => json!({"type": kind}),
            columns => {
                json!({"type": "array", "items": {"type": kind}, "minItems": columns, "maxItems": columns})
            }
        };
        let array = json!({"description": one.meaning, "type": "array", "items": item});
        (one.name.to_owned(), with_unit(array, one.name))
    });
    let arrays = json!({
        "description": format!("The arrays of {SHAPES}."),
        "type": "object",
        "properties": arrays.collect::<Map<_, _>>(),
    });
    definitions.insert(SHAPES.to_owned(), arrays);
    let absent = |kind: &str| kind.ends_with('-');
    let required: Vec<&str> =
        KEYS.iter().filter(|(_, kind, _)| !absent(kind)).map(|(name, ..)| *name).collect();
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": format!("Recordings of endowire, version {VERSION}"),
        "description": format!("{SUMMARY}; rows of the tables beside it, and arrays, are the definitions of their names."),
        "type": "object",
        "properties": KEYS.iter().map(|key| (key.0.to_owned(), of_key(key))).collect::<Map<_, _>>(),
        "required": required,
        "$defs": definitions,
    })
}

fn of_key((name, kind, meaning): &(&str, &str, &str)) -> Value {
    let bare = kind.trim_end_matches(['?', '-']);
    let kind = if kind.ends_with('?') { json!([bare, "null"]) } else { json!(bare) };
    with_unit(json!({"description": meaning, "type": kind}), name)
}

fn of_column(column: &Column) -> Value {
    with_unit(json!({"description": column.meaning.trim(), "type": column.kind}), column.name)
}

fn with_unit(mut described: Value, name: &str) -> Value {
    if let (Some(unit), Some(described)) = (unit(name), described.as_object_mut()) {
        described.insert("unit".to_owned(), unit.into());
    }
    described
}

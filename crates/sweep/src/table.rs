//! Rows as a Parquet file.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use endowire_core::file::whole;
use endowire_core::{Error, Result};
use endowire_recording::{InstrumentOutcome, RunOutcome};
use parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::Result as ParquetResult;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{Type, TypePtr};
use serde_json::Value as Json;

use crate::row::{Columns, ParameterKind, Row};

/// The values of a column, one per row.
enum Cells {
    Booleans(Vec<Option<bool>>),
    Integers(Vec<Option<i64>>),
    Numbers(Vec<Option<f64>>),
    Texts(Vec<Option<String>>),
}

impl Cells {
    /// The value of a row as text; empty if missing.
    fn text(&self, row: usize) -> String {
        match self {
            Self::Booleans(cells) => cells[row].map(|v| v.to_string()),
            Self::Integers(cells) => cells[row].map(|v| v.to_string()),
            Self::Numbers(cells) => cells[row].map(|v| v.to_string()),
            Self::Texts(cells) => cells[row].clone(),
        }
        .unwrap_or_default()
    }
}

struct Column {
    name: String,
    cells: Cells,
}

/// Writes rows, in order of runs, to a file that is written completely or not at all.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(path: &Path, columns: &Columns, rows: &[Row]) -> Result<()> {
    let columns = self::columns(columns, rows);
    let written =
        whole::write(path, |file| write_to(file.try_clone()?, &columns).map_err(std::io::Error::other));
    written.map_err(|e| Error::file(path, e))
}

/// Names of all columns, and the rows with their values as text.
pub(crate) fn as_texts(columns: &Columns, rows: &[Row]) -> (Vec<String>, Vec<Vec<String>>) {
    let columns = self::columns(columns, rows);
    let row = |index: usize| columns.iter().map(|column| column.cells.text(index)).collect();
    let rows = (0..rows.len()).map(row).collect();
    (columns.into_iter().map(|column| column.name).collect(), rows)
}

/// All columns of a table.
fn columns(columns: &Columns, rows: &[Row]) -> Vec<Column> {
    let mut all = vec![integers("run", rows, |row| Some(row.run as i64))];
    for (index, (key, kind)) in columns.parameters.iter().enumerate() {
        all.push(parameter(key, *kind, rows, index));
    }
    all.extend(results(rows));
    for (index, name) in columns.instruments.iter().enumerate() {
        all.extend(instrument(name, index, rows));
    }
    all.push(texts("scene_hash", rows, |row| Some(row.scene_hash.clone())));
    // An axis may vary the scene's seed; then the column exists already.
    if columns.parameters.iter().all(|(key, _)| key != "seed") {
        all.push(integers("seed", rows, |row| i64::try_from(row.seed).ok()));
    }
    all.push(texts("version", rows, |row| Some(row.version.clone())));
    all.push(texts("git_revision", rows, |row| Some(row.git_revision.clone())));
    all
}

/// The column of an axis.
fn parameter(key: &str, kind: ParameterKind, rows: &[Row], index: usize) -> Column {
    let value = |row: &Row| row.parameters[index].clone();
    match kind {
        ParameterKind::Boolean => Column {
            name: key.to_owned(),
            cells: Cells::Booleans(rows.iter().map(|row| value(row).as_bool()).collect()),
        },
        ParameterKind::Integer => integers(key, rows, |row| value(row).as_i64()),
        ParameterKind::Number => numbers(key, rows, |row| value(row).as_f64()),
        ParameterKind::Text => texts(key, rows, |row| value(row).as_str().map(str::to_owned)),
        ParameterKind::Json => texts(key, rows, |row| Some(value(row).to_string())),
    }
}

/// The columns of outcomes.
fn results(rows: &[Row]) -> Vec<Column> {
    let integer = |name: &str, of: fn(&RunOutcome) -> Option<i64>| {
        integers(name, rows, |row| row.outcome.as_ref().and_then(of))
    };
    let number = |name: &str, of: fn(&RunOutcome) -> Option<f64>| {
        numbers(name, rows, |row| row.outcome.as_ref().and_then(of))
    };
    let count = |number: usize| Some(number as i64);
    let ended_by = |row: &Row| Some(row.outcome.as_ref()?.ended_by?.name().to_owned());
    let converged = |row: &Row| Some(row.outcome.as_ref().is_some_and(|outcome| outcome.converged));
    let until = |row: &Row| {
        let lines = row.outcome.as_ref().filter(|outcome| !outcome.until.is_empty())?;
        serde_json::to_value(&lines.until).ok().as_ref().map(Json::to_string)
    };
    vec![
        integers("steps", rows, |row| count(row.outcome.as_ref().map_or(0, |o| o.steps))),
        integer("steps_asked", |o| Some(o.steps_asked as i64)),
        Column { name: "converged".to_owned(), cells: Cells::Booleans(rows.iter().map(converged).collect()) },
        integer("failed_step", |o| o.failure.as_ref().map(|failure| failure.step as i64)),
        texts("failure", rows, |row| row.failure().map(str::to_owned)),
        number("inserted_mm", |o| Some(o.inserted_mm)),
        number("rotation_rad", |o| Some(o.rotation_rad)),
        number("mouth_rotation_rad", |o| Some(o.mouth_rotation_rad)),
        number("tip_rotation_rad", |o| Some(o.tip_rotation_rad)),
        number("tip_x_mm", |o| o.tip_mm.map(|tip| tip[0])),
        number("tip_y_mm", |o| o.tip_mm.map(|tip| tip[1])),
        number("tip_z_mm", |o| o.tip_mm.map(|tip| tip[2])),
        number("push_force_n", |o| Some(o.push_force_n)),
        number("torque_nmm", |o| Some(o.torque_nmm)),
        number("max_push_force_n", |o| Some(o.tally.max_push_force_n)),
        number("max_torque_nmm", |o| Some(o.tally.max_torque_nmm)),
        number("max_tip_lag_rad", |o| Some(o.tally.max_tip_lag_rad)),
        number("bend_mj", |o| Some(o.energy_mj.bend)),
        number("twist_mj", |o| Some(o.energy_mj.twist)),
        number("wall_mj", |o| Some(o.energy_mj.wall)),
        number("field_mj", |o| Some(o.energy_mj.field)),
        number("tail_mj", |o| Some(o.energy_mj.tail)),
        number("vessel_mj", |o| Some(o.energy_mj.vessel)),
        number("max_penetration_mm", |o| Some(o.tally.max_penetration_mm)),
        number("wall_force_sum_n", |o| Some(o.wall_force.sum_n)),
        number("wall_force_largest_n", |o| Some(o.wall_force.largest_n)),
        number("wall_force_tip_n", |o| Some(o.wall_force.tip_n)),
        number("max_wall_force_sum_n", |o| Some(o.tally.max_wall_force.sum_n)),
        number("max_wall_force_largest_n", |o| Some(o.tally.max_wall_force.largest_n)),
        number("max_wall_force_tip_n", |o| Some(o.tally.max_wall_force.tip_n)),
        integer("unconverged_steps", |o| Some(o.tally.unconverged_steps as i64)),
        integer("jumps", |o| Some(o.tally.jumps as i64)),
        integer("relaxations", |o| i64::try_from(o.tally.relaxations).ok()),
        number("max_imbalance", |o| Some(o.tally.max_imbalance)),
        texts("ended_by", rows, ended_by),
        integer("left_through", |o| o.left_through.map(|opening| opening as i64)),
        texts("until", rows, until),
    ]
}

/// The columns of one of several instruments.
fn instrument(name: &str, index: usize, rows: &[Row]) -> Vec<Column> {
    let number = |what: &str, of: fn(&InstrumentOutcome) -> Option<f64>| {
        let one =
            |row: &Row| row.outcome.as_ref().and_then(|outcome| outcome.instruments.get(index)).and_then(of);
        numbers(&format!("{name}.{what}"), rows, one)
    };
    vec![
        number("inserted_mm", |one| Some(one.report.inserted_mm)),
        number("rotation_rad", |one| Some(one.report.rotation_rad)),
        number("mouth_rotation_rad", |one| Some(one.report.mouth_rotation_rad)),
        number("tip_rotation_rad", |one| Some(one.report.tip_rotation_rad)),
        number("steer", |one| Some(one.report.steer)),
        number("push_force_n", |one| one.report.push_force_n),
        number("torque_nmm", |one| Some(one.report.torque_nmm)),
    ]
}

fn integers(name: &str, rows: &[Row], of: impl Fn(&Row) -> Option<i64>) -> Column {
    Column { name: name.to_owned(), cells: Cells::Integers(rows.iter().map(of).collect()) }
}

fn numbers(name: &str, rows: &[Row], of: impl Fn(&Row) -> Option<f64>) -> Column {
    Column { name: name.to_owned(), cells: Cells::Numbers(rows.iter().map(of).collect()) }
}

fn texts(name: &str, rows: &[Row], of: impl Fn(&Row) -> Option<String>) -> Column {
    Column { name: name.to_owned(), cells: Cells::Texts(rows.iter().map(of).collect()) }
}

/// Writes all rows as one row group.
fn write_to(file: File, columns: &[Column]) -> ParquetResult<()> {
    let types = columns.iter().map(Column::parquet_type).collect::<ParquetResult<Vec<TypePtr>>>()?;
    let schema = Type::group_type_builder("runs").with_fields(types).build()?;
    let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::default())?;
    let mut group = writer.next_row_group()?;
    for column in columns {
        if let Some(writer) = group.next_column()? {
            column.write(writer)?;
        }
    }
    group.close()?;
    // Writes the footer.
    writer.into_inner()?.sync_all()?;
    Ok(())
}

impl Column {
    fn parquet_type(&self) -> ParquetResult<TypePtr> {
        let (physical, logical) = match self.cells {
            Cells::Booleans(_) => (PhysicalType::BOOLEAN, None),
            Cells::Integers(_) => (PhysicalType::INT64, None),
            Cells::Numbers(_) => (PhysicalType::DOUBLE, None),
            Cells::Texts(_) => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
        };
        Type::primitive_type_builder(&self.name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical)
            .build()
            .map(Arc::new)
    }

    fn write(&self, writer: SerializedColumnWriter<'_>) -> ParquetResult<()> {
        match &self.cells {
            Cells::Booleans(cells) => write_cells::<BoolType>(writer, cells.iter().copied()),
            Cells::Integers(cells) => write_cells::<Int64Type>(writer, cells.iter().copied()),
            Cells::Numbers(cells) => write_cells::<DoubleType>(writer, cells.iter().copied()),
            Cells::Texts(cells) => {
                let texts = cells.iter().map(|cell| cell.as_deref().map(ByteArray::from));
                write_cells::<ByteArrayType>(writer, texts)
            }
        }
    }
}

/// Writes the values that exist, with their definition levels.
fn write_cells<T: DataType>(
    mut writer: SerializedColumnWriter<'_>,
    cells: impl Iterator<Item = Option<T::T>>,
) -> ParquetResult<()> {
    let cells: Vec<Option<T::T>> = cells.collect();
    let there: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    let values: Vec<T::T> = cells.into_iter().flatten().collect();
    writer.typed::<T>().write_batch(&values, Some(&there), None)?;
    writer.close()
}

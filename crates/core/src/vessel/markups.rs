//! Centre lines in markups files of 3D Slicer (`.mrk.json`).

use serde::Deserialize;

use super::CentrelineNode;
use super::files::PatientAxes;
use super::line_files::{Lines, NO_RADII, is_radius};
use crate::Vec3;

/// A markups file, as far as it is read.
#[derive(Deserialize)]
struct Markups {
    markups: Vec<Markup>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Markup {
    coordinate_system: Option<String>,
    coordinate_units: Option<serde_json::Value>,
    #[serde(default)]
    control_points: Vec<ControlPoint>,
    #[serde(default)]
    measurements: Vec<Measurement>,
}

#[derive(Deserialize)]
struct ControlPoint {
    position: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Measurement {
    #[serde(default)]
    name: String,
    #[serde(default)]
    control_point_values: Vec<f64>,
}

/// The curves of 3D Slicer's markups, with their measurement `Radius`.
pub(super) fn curves(bytes: &[u8]) -> Lines {
    let file: Markups = serde_json::from_slice(bytes)
        .map_err(|error| format!("is no markups file of 3D Slicer that can be read: {error}"))?;
    let mut lines = Vec::new();
    for (number, markup) in file.markups.iter().enumerate() {
        if let Some(unit) = markup.coordinate_units.as_ref().and_then(serde_json::Value::as_str)
            && unit != "mm"
        {
            return Err(format!("markup {number}: coordinateUnits = {unit:?}: write it in mm"));
        }
        let axes: PatientAxes = match markup.coordinate_system.as_deref() {
            None => PatientAxes::Lps,
            Some(name) => name
                .parse()
                .map_err(|_| format!("markup {number}: coordinateSystem = {name:?}: must be LPS or RAS"))?,
        };
        // Points that are not placed have no position.
        let places: Vec<Vec3> =
            markup.control_points.iter().filter_map(|p| p.position).map(Vec3::from).collect();
        if places.len() < 2 {
            continue;
        }
        let radii = markup.measurements.iter().find(|one| is_radius(&one.name)).ok_or(NO_RADII)?;
        let radii = &radii.control_point_values;
        if radii.len() != places.len() {
            return Err(format!(
                "markup {number}: {} control points have {} radii: write both again",
                places.len(),
                radii.len()
            ));
        }
        let node = |(place, radius): (&Vec3, &f64)| CentrelineNode {
            position_mm: axes.to_lps(*place),
            radius_mm: *radius,
            parent: None,
        };
        lines.push(places.iter().zip(radii).map(node).collect());
    }
    match lines.is_empty() {
        true => Err("holds no curve of two points or more".into()),
        false => Ok(lines),
    }
}

//! Parts of a device as table rows.

use endowire_core::device::{Part, Section, SoftPlane};
use serde::Serialize;

/// One part. Pairs are its values at the end towards the tip and at the other end.
#[derive(Debug, Serialize)]
pub(super) struct PartRow {
    part: String,
    /// Arc length from the tip.
    from_mm: f64,
    to_mm: f64,
    outer_diameter_mm: [f64; 2],
    inner_diameter_mm: Option<[f64; 2]>,
    bending_stiffness_nmm2: [f64; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    soft_plane: Option<SoftPlane>,
    torsional_stiffness_nmm2: [f64; 2],
    /// If the part has several arcs, that of the arc next to the tip.
    rest_curvature_per_mm: [f64; 2],
    /// Number of arcs of its rest shape.
    arcs: usize,
    /// Total bending angle of its rest shape, summed over the arcs.
    bend_deg: f64,
    /// Number of sections that represent it.
    sections: usize,
    /// Largest deviations of the sections from the taper that they represent; relative for EI.
    cut_radius_error_mm: f64,
    cut_stiffness_error: f64,
    material: Option<String>,
    coat: Option<CoatRow>,
    source: Option<String>,
}

#[derive(Debug, Serialize)]
struct CoatRow {
    material: String,
    thickness_mm: f64,
}

impl PartRow {
    pub(super) fn new(part: &Part) -> Self {
        let ends = [part.at(0.0), part.at(1.0)];
        let both = |value: fn(&Section) -> f64| [value(&ends[0]), value(&ends[1])];
        let [from_mm, to_mm] = part.from_tip_mm;
        let [first, second] = ends[0].rest_curvature_per_mm;
        let cut = part.cut_error();
        let sections = part.sections();
        Self {
            part: part.name.clone(),
            from_mm,
            to_mm,
            outer_diameter_mm: both(|s| 2.0 * s.radius_mm),
            inner_diameter_mm: match ends.map(|s| s.inner_radius_mm) {
                [Some(near), Some(far)] => Some([2.0 * near, 2.0 * far]),
                _ => None,
            },
            bending_stiffness_nmm2: both(|s| s.bending_stiffness_nmm2),
            soft_plane: ends[0].soft_plane,
            torsional_stiffness_nmm2: both(Section::torsion_nmm2),
            rest_curvature_per_mm: [first, second],
            arcs: if part.has_secondary_shape() { sections.len() } else { 1 },
            bend_deg: sections.iter().map(bend_rad).sum::<f64>().to_degrees(),
            sections: sections.len(),
            cut_radius_error_mm: cut.radius_mm,
            cut_stiffness_error: cut.stiffness,
            material: part.material.clone(),
            coat: part
                .coat
                .as_ref()
                .map(|coat| CoatRow { material: coat.material.clone(), thickness_mm: coat.thickness_mm }),
            source: part.source.clone(),
        }
    }

    /// A curvature as radius and angle, with its direction if it leaves the first plane.
    fn bend(&self) -> String {
        if self.arcs > 1 {
            let mean_per_mm = self.bend_deg.to_radians() / (self.to_mm - self.from_mm);
            return format!("{mean_per_mm:.3} ({:.1} turns in {} arcs)", self.bend_deg / 360.0, self.arcs);
        }
        let [first, second] = self.rest_curvature_per_mm;
        let curvature = first.hypot(second);
        if curvature == 0.0 {
            return "–".to_owned();
        }
        let direction_deg = second.atan2(first).to_degrees();
        let direction =
            if direction_deg.abs() < 0.05 { String::new() } else { format!(" to {direction_deg:.0}°") };
        format!("{:.3} ({:.0}°{direction})", curvature, self.bend_deg)
    }

    /// EI, with that in the soft plane.
    fn stiffness(&self) -> String {
        let across = range(self.bending_stiffness_nmm2, 3);
        self.soft_plane.map_or(across.clone(), |SoftPlane { plane_deg, bending_stiffness_nmm2 }| {
            format!("{across}, {} at {plane_deg:.0}°", digits(bending_stiffness_nmm2, 3))
        })
    }

    fn material(&self) -> String {
        let wall = self.material.as_deref().unwrap_or("–");
        match &self.coat {
            Some(coat) => format!("{wall}, {} mm {}", coat.thickness_mm, coat.material),
            None => wall.to_owned(),
        }
    }

    fn sections(&self) -> String {
        match self.sections {
            count if self.cut_stiffness_error == 0.0 => count.to_string(),
            count => format!("{count} (EI ±{} %)", digits(100.0 * self.cut_stiffness_error, 2)),
        }
    }
}

/// Bending angle of a section at rest, rad.
fn bend_rad(section: &Section) -> f64 {
    let [first, second] = section.rest_curvature_per_mm;
    first.hypot(second) * section.length_mm
}

/// The table as text.
pub(super) fn text(parts: &[PartRow]) -> String {
    let head = [
        "part",
        "from mm",
        "to mm",
        "OD mm",
        "OD F",
        "OD inch",
        "ID mm",
        "EI N·mm²",
        "GJ N·mm²",
        "bend 1/mm",
        "sections",
        "material",
        "source",
    ];
    let rows = parts.iter().map(|row| {
        let [mm, french, inch] = diameters(row.outer_diameter_mm);
        vec![
            row.part.clone(),
            format!("{:.1}", row.from_mm),
            format!("{:.1}", row.to_mm),
            mm,
            french,
            inch,
            row.inner_diameter_mm.map_or_else(|| "–".to_owned(), |inner| diameters(inner)[0].clone()),
            row.stiffness(),
            range(row.torsional_stiffness_nmm2, 3),
            row.bend(),
            row.sections(),
            row.material(),
            row.source.clone().unwrap_or_else(|| "–".to_owned()),
        ]
    });
    columns(&head, rows)
}

/// A range of diameters in millimetres, French and inches.
pub(super) fn diameters(mm: [f64; 2]) -> [String; 3] {
    let in_unit = |per_mm: f64, places: usize| {
        let [a, b] = mm.map(|value| format!("{:.places$}", value * per_mm));
        if a == b { a } else { format!("{a}–{b}") }
    };
    [in_unit(1.0, 3), in_unit(3.0, 1), in_unit(1.0 / 25.4, 4)]
}

/// Two values, or one if both have the same text.
pub(super) fn range(values: [f64; 2], significant: i32) -> String {
    let [a, b] = values.map(|value| digits(value, significant));
    if a == b { a } else { format!("{a}–{b}") }
}

/// A positive number with `significant` digits, and with all digits before the decimal point.
pub(in crate::commands) fn digits(value: f64, significant: i32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let before = value.abs().log10().floor() as i32 + 1;
    format!("{value:.*}", (significant - before).clamp(0, 9) as usize)
}

/// Aligned columns; the last column has any width.
pub(in crate::commands) fn columns(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let head: Vec<String> = head.iter().map(|text| (*text).to_owned()).collect();
    let lines: Vec<Vec<String>> = std::iter::once(head).chain(rows).collect();
    let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..lines[0].len()).map(width).collect();
    let text = |line: &Vec<String>| {
        let cells: Vec<String> =
            line.iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}")).collect();
        cells.join("  ").trim_end().to_owned()
    };
    lines.iter().map(text).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_significant_digits() {
        assert_eq!(digits(291.27, 3), "291");
        assert_eq!(digits(4856.6, 3), "4857");
        assert_eq!(digits(0.5, 3), "0.500");
        assert_eq!(digits(0.0, 3), "0");
        assert_eq!(range([3.0, 15.0], 3), "3.00–15.0");
        assert_eq!(diameters([2.0, 2.0]), ["2.000", "6.0", "0.0787"]);
        assert_eq!(diameters([0.8, 0.9])[0], "0.800–0.900");
    }

    #[test]
    fn columns_are_aligned() {
        let rows = [vec!["·".to_owned(), "long text".to_owned(), "c".to_owned()]];
        assert_eq!(columns(&["ab", "b", "last"], rows.into_iter()), "ab  b          last\n·   long text  c");
    }
}

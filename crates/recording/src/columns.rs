//! Columns of tables and arrays of numbers, each declared once: name, unit and meaning are those of a field of the row's
//! type.

/// A column of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    /// Its name.
    pub name: &'static str,
    /// What it means, in a sentence or more.
    pub meaning: &'static str,
    /// The type of its values, in words of JSON Schema.
    pub kind: &'static str,
    /// Whether it may be empty, or absent in recordings of earlier versions.
    pub optional: bool,
}

/// Ends of names with the units that they stand for.
const UNITS: [(&str, &str); 11] = [
    ("_ml_per_s", "ml/s"),
    ("_mm3", "mm³"),
    ("_nmm", "N·mm"),
    ("_mm", "mm"),
    ("_mj", "mJ"),
    ("_ml", "ml"),
    ("_rad", "rad"),
    ("_deg", "°"),
    ("_ngy", "nGy"),
    ("_n", "N"),
    ("_s", "s"),
];

impl Column {
    /// Its unit, which its name ends with; `None` for numbers without one, names and answers.
    pub fn unit(&self) -> Option<&'static str> {
        unit(self.name)
    }
}

/// The unit of a name.
pub(crate) fn unit(name: &str) -> Option<&'static str> {
    UNITS.iter().find(|(end, _)| name.ends_with(end)).map(|(_, unit)| *unit)
}

/// A row of a table of a recording.
pub trait Row {
    /// Name and value of the first number that is infinite or NaN, which no table may have.
    fn not_finite(&self) -> Option<(&'static str, f64)>;
}

/// A value of a cell.
pub(crate) trait Cell {
    const KIND: &'static str;
    const OPTIONAL: bool = false;

    /// The value, if it is infinite or NaN.
    fn not_finite(&self) -> Option<f64> {
        None
    }
}

impl Cell for f64 {
    const KIND: &'static str = "number";

    fn not_finite(&self) -> Option<f64> {
        Some(*self).filter(|number| !number.is_finite())
    }
}

impl Cell for bool {
    const KIND: &'static str = "boolean";
}

impl Cell for String {
    const KIND: &'static str = "string";
}

impl Cell for usize {
    const KIND: &'static str = "integer";
}

impl Cell for u64 {
    const KIND: &'static str = "integer";
}

impl Cell for u32 {
    const KIND: &'static str = "integer";
}

impl<T: Cell> Cell for Option<T> {
    const KIND: &'static str = T::KIND;
    const OPTIONAL: bool = true;

    fn not_finite(&self) -> Option<f64> {
        self.as_ref()?.not_finite()
    }
}

/// Declares the type of a table's rows, and its columns as `COLUMNS`, from fields with their meanings. `..hand` stands for
/// the columns of a hand and what it moves, which tables of steps and of instruments have alike.
macro_rules! columns {
    (
        $(#[doc = $about:literal])+
        pub struct $row:ident {
            $($(#[doc = $before_means:literal])+ pub $before:ident: $before_kind:ty,)+
            ..hand,
            $($(#[doc = $meaning:literal])+ pub $name:ident: $kind:ty,)+
        }
    ) => {
        $crate::columns::columns! {
            $(#[doc = $about])+
            pub struct $row {
                $($(#[doc = $before_means])+ pub $before: $before_kind,)+
                /// Advance of the hand in the step; negative when pulled back.
                pub advance_mm: f64,
                /// Rotation of the hand in the step.
                pub rotate_rad: f64,
                /// Length beyond the sheath's mouth.
                pub inserted_mm: f64,
                /// Rotation of the hand since the start.
                pub rotation_rad: Option<f64>,
                /// Rotation at the sheath's mouth: the hand's, less the twist of the tail between.
                pub mouth_rotation_rad: Option<f64>,
                /// Rotation of the tip, against a frame that is carried along the device without twist.
                pub tip_rotation_rad: Option<f64>,
                $($(#[doc = $meaning])+ pub $name: $kind,)+
            }
        }
    };
    (
        $(#[doc = $about:literal])+
        pub struct $row:ident {
            $($(#[doc = $meaning:literal])+ pub $name:ident: $kind:ty,)+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        pub struct $row {
            $($(#[doc = $meaning])+ pub $name: $kind,)+
        }

        impl $row {
            /// The columns of the table, in order.
            pub const COLUMNS: &'static [crate::columns::Column] = &[
                $(crate::columns::Column {
                    name: stringify!($name),
                    meaning: concat!($($meaning),+),
                    kind: <$kind as crate::columns::Cell>::KIND,
                    optional: <$kind as crate::columns::Cell>::OPTIONAL,
                },)+
            ];
        }

        impl crate::columns::Row for $row {
            fn not_finite(&self) -> Option<(&'static str, f64)> {
                let cells = [
                    $((stringify!($name), crate::columns::Cell::not_finite(&self.$name)),)+
                ];
                cells.into_iter().find_map(|(name, number)| Some((name, number?)))
            }
        }
    };
}
pub(crate) use columns;

#[cfg(test)]
mod tests {
    use super::unit;

    #[test]
    fn units_are_the_ends_of_names() {
        for (name, of) in [
            ("tip_x_mm", Some("mm")),
            ("torque_nmm", Some("N·mm")),
            ("coils_mm3", Some("mm³")),
            ("rate_ml_per_s", Some("ml/s")),
            ("wall_force_tip_n", Some("N")),
            ("iterations", None),
            ("rotation", None),
        ] {
            assert_eq!(unit(name), of, "{name}");
        }
    }
}

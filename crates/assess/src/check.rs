//! What a record may say. Every reader of records checks them here, so measures need no checks of their own.

use endowire_core::{Error, Result, Vec3};

use crate::injection::Injection;
use crate::record::{BeamState, Hand, Sample};

/// Requirements of a value, and the words for them.
enum Must {
    /// A finite number.
    BeNumber,
    /// A finite number of 0 or more.
    NotBeBelowZero,
    /// A finite number above 0.
    BeAboveZero,
}

impl Must {
    fn holds(&self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::BeNumber => true,
                Self::NotBeBelowZero => value >= 0.0,
                Self::BeAboveZero => value > 0.0,
            }
    }

    fn words(&self) -> &'static str {
        match self {
            Self::BeNumber => "must be a finite number",
            Self::NotBeBelowZero => "must be a finite number of 0 or more",
            Self::BeAboveZero => "must be a finite number above 0",
        }
    }
}

/// A value with its key and what it must be.
type Asked = (&'static str, f64, Must);

/// Refuses the first value that is not what it must be; `entry` is the name of the entry that holds them.
fn values(entry: &str, asked: impl IntoIterator<Item = Asked>) -> Result<()> {
    match asked.into_iter().find(|(_, value, must)| !must.holds(*value)) {
        None => Ok(()),
        Some((key, value, must)) => Err(Error::parameter(format!("{entry}.{key}"), value, must.words())),
    }
}

fn place(entry: &str, key: &str, place: Option<Vec3>) -> Result<()> {
    match place.filter(|place| !place.iter().all(|value| value.is_finite())) {
        None => Ok(()),
        Some(place) => {
            let value = format!("[{}, {}, {}]", place.x, place.y, place.z);
            Err(Error::parameter(format!("{entry}.{key}"), value, "must be three finite numbers"))
        }
    }
}

/// Checks that times do not go back; `list` is the name of their entries.
fn forward(list: &str, times_s: impl Iterator<Item = f64>) -> Result<()> {
    let mut before_s = 0.0;
    for (index, time_s) in times_s.enumerate() {
        if time_s < before_s {
            let mend = format!(
                "comes after {before_s}: put {list} in order of time, or leave out what is not of this session"
            );
            return Err(Error::parameter(format!("{list}[{index}].time_s"), time_s, mend));
        }
        before_s = time_s;
    }
    Ok(())
}

/// Checks steps.
pub(crate) fn samples(samples: &[Sample]) -> Result<()> {
    for (index, sample) in samples.iter().enumerate() {
        let entry = format!("samples[{index}]");
        values(
            &entry,
            [
                ("time_s", sample.time_s, Must::NotBeBelowZero),
                ("wall_force_n", sample.wall_force_n, Must::NotBeBelowZero),
                ("tip_force_n", sample.tip_force_n, Must::NotBeBelowZero),
            ],
        )?;
        place(&entry, "tip_mm", sample.tip_mm)?;
        place(&entry, "tip_at_rest_mm", sample.tip_at_rest_mm)?;
        if let Some(packed) = sample.packing {
            let packing = [
                ("density", packed.density, Must::NotBeBelowZero),
                ("outside_mm", packed.outside_mm, Must::NotBeBelowZero),
            ];
            values(&format!("{entry}.packing"), packing)?;
        }
        for (number, hand) in sample.hands.iter().enumerate() {
            self::hand(&format!("{entry}.hands[{number}]"), hand)?;
        }
    }
    forward("samples", samples.iter().map(|sample| sample.time_s))
}

fn hand(entry: &str, hand: &Hand) -> Result<()> {
    let number = |key, value| (key, value, Must::BeNumber);
    values(
        entry,
        [
            number("advance_mm", hand.advance_mm),
            number("rotate_rad", hand.rotate_rad),
            number("inserted_mm", hand.inserted_mm),
            number("push_force_n", hand.push_force_n.unwrap_or(0.0)),
            number("torque_nmm", hand.torque_nmm),
        ],
    )?;
    place(entry, "tip_mm", hand.tip_mm)?;
    place(entry, "tip_at_rest_mm", hand.tip_at_rest_mm)
}

/// Checks injections.
pub(crate) fn injections(injections: &[Injection]) -> Result<()> {
    for (index, one) in injections.iter().enumerate() {
        let entry = format!("injections[{index}]");
        values(
            &entry,
            [
                ("time_s", one.time_s, Must::NotBeBelowZero),
                ("volume_ml", one.volume_ml, Must::BeAboveZero),
                ("rate_ml_per_s", one.rate_ml_per_s, Must::BeAboveZero),
            ],
        )?;
        if let Some(outlet) = &one.outlet {
            let entry = format!("{entry}.outlet");
            place(&entry, "at_mm", Some(outlet.at_mm))?;
            let force_n = outlet.tip_force_n.unwrap_or(0.0);
            values(&entry, [("tip_force_n", force_n, Must::NotBeBelowZero)])?;
        }
    }
    forward("injections", injections.iter().map(|one| one.time_s))
}

/// Checks a log of the beam. Without any state it says nothing about the beam, not that it was off.
pub(crate) fn beam(beam: &[BeamState]) -> Result<()> {
    if beam.is_empty() {
        let mend = "no state of the beam: give one for each change, or leave the log out if the beam was not recorded";
        return Err(Error::parameter("beam", "empty", mend));
    }
    for (index, state) in beam.iter().enumerate() {
        values(
            &format!("beam[{index}]"),
            [
                ("time_s", state.time_s, Must::NotBeBelowZero),
                ("frames_per_s", state.frames_per_s, Must::NotBeBelowZero),
                ("dose_ngy", state.dose_ngy, Must::NotBeBelowZero),
                ("field_mm2", state.field_mm2, Must::NotBeBelowZero),
                ("primary_deg", state.primary_deg, Must::BeNumber),
                ("secondary_deg", state.secondary_deg, Must::BeNumber),
            ],
        )?;
    }
    forward("beam", beam.iter().map(|state| state.time_s))
}

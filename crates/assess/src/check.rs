//! What a record may say. Every reader of records checks them here, so measures need no checks of their own.

use endowire_core::device::Stack;
use endowire_core::error::{nearest_name, number};
use endowire_core::{Error, Result, Vec3};

use crate::record::{BeamState, Hand, Packed, Record, Sample};

/// Largest coordinate of a place, mm, as of a centre line; and largest size of any other value.
const FARTHEST_MM: f64 = 1e6;
const LARGEST: f64 = 1e12;
/// Lengths that differ by less count as equal, mm.
const SLACK_MM: f64 = 1e-6;

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
        value.abs() <= LARGEST
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
        Some((key, value, must)) => {
            let remedy = format!("{}, and at most {LARGEST:e} in size", must.words());
            Err(Error::parameter(format!("{entry}.{key}"), value, remedy))
        }
    }
}

/// Checks a place.
pub(crate) fn place(name: &str, place: Option<Vec3>) -> Result<()> {
    let is_there = |value: &f64| value.abs() <= FARTHEST_MM;
    match place.filter(|place| !place.iter().all(is_there)) {
        None => Ok(()),
        Some(place) => {
            let value = format!("[{}, {}, {}]", number(place.x), number(place.y), number(place.z));
            let remedy = format!("must be three finite numbers, from -{FARTHEST_MM} to {FARTHEST_MM}");
            Err(Error::parameter(name, value, remedy))
        }
    }
}

/// Checks that times do not go back; `list` is the name of their entries, which are given by their numbers.
pub(crate) fn forward(list: &str, times_s: impl Iterator<Item = (usize, f64)>) -> Result<()> {
    let mut before_s = 0.0;
    for (number, time_s) in times_s {
        if time_s < before_s {
            let remedy = format!(
                "comes after {before_s}: put {list} in order of time, or leave out what is not of this session"
            );
            return Err(Error::parameter(format!("{list}[{number}].time_s"), time_s, remedy));
        }
        before_s = time_s;
    }
    Ok(())
}

/// Checks that a list of names contains a name.
fn named(key: String, name: &str, names: &[String]) -> Result<()> {
    if names.iter().any(|one| one == name) {
        return Ok(());
    }
    let nearest = nearest_name(names.iter().map(String::as_str), name).unwrap_or_default();
    let remedy =
        format!("is no instrument of the record, which has {}; did you mean {nearest:?}?", names.join(", "));
    Err(Error::parameter(key, format!("{name:?}"), remedy))
}

/// Refuses a record in which nothing was done.
pub(crate) fn done(record: &Record) -> Result<()> {
    if record.is_empty() {
        let remedy = "nothing was done: give a session in which time went by";
        return Err(Error::parameter("samples", "[]", remedy));
    }
    Ok(())
}

/// Checks the steps of a session, each with a hand for every instrument. A record that names none is of one device.
pub(crate) fn samples(record: &Record) -> Result<()> {
    let Record { instruments, samples, .. } = record;
    for (index, name) in instruments.iter().enumerate() {
        if name.is_empty() || instruments[..index].contains(name) {
            let remedy = "each instrument has a name of its own";
            return Err(Error::parameter(format!("instruments[{index}]"), format!("{name:?}"), remedy));
        }
    }
    for (index, one) in samples.iter().enumerate() {
        let entry = format!("samples[{index}]");
        let hands = one.hands.len();
        if hands != instruments.len().max(1) {
            let named = if instruments.is_empty() { "no names".to_owned() } else { instruments.join(", ") };
            let remedy = format!("must be one for each of instruments, which has {named}");
            return Err(Error::parameter(format!("{entry}.hands"), format!("{hands} hands"), remedy));
        }
        sample(&entry, one)?;
        one.packing.iter().try_for_each(|packed| self::packed(&entry, packed))?;
        for (number, hand) in one.hands.iter().enumerate() {
            self::hand(&format!("{entry}.hands[{number}]"), hand)?;
        }
    }
    forward("samples", samples.iter().map(|sample| sample.time_s).enumerate())
}

/// Checks a step, apart from its hands and its packing.
pub(crate) fn sample(entry: &str, sample: &Sample) -> Result<()> {
    values(
        entry,
        [
            ("time_s", sample.time_s, Must::NotBeBelowZero),
            ("wall_force_n", sample.wall_force_n, Must::NotBeBelowZero),
            ("tip_force_n", sample.tip_force_n, Must::NotBeBelowZero),
        ],
    )?;
    place(&format!("{entry}.tip_mm"), sample.tip_mm)?;
    place(&format!("{entry}.tip_at_rest_mm"), sample.tip_at_rest_mm)
}

/// Checks the packing of a step.
pub(crate) fn packed(entry: &str, packed: &Packed) -> Result<()> {
    let packing = [
        ("density", packed.density, Must::NotBeBelowZero),
        ("outside_mm", packed.outside_mm, Must::NotBeBelowZero),
    ];
    values(&format!("{entry}.packing"), packing)
}

/// Checks a hand.
pub(crate) fn hand(entry: &str, hand: &Hand) -> Result<()> {
    let number = |key, value| (key, value, Must::BeNumber);
    // Sums of advances are rounded.
    let below = hand.inserted_mm < 0.0 && hand.inserted_mm > -SLACK_MM;
    let inserted_mm = if below { 0.0 } else { hand.inserted_mm };
    values(
        entry,
        [
            number("advance_mm", hand.advance_mm),
            number("rotate_rad", hand.rotate_rad),
            number("steer_by", hand.steer_by),
            ("inserted_mm", inserted_mm, Must::NotBeBelowZero),
            number("push_force_n", hand.push_force_n.unwrap_or(0.0)),
            number("torque_nmm", hand.torque_nmm),
        ],
    )?;
    place(&format!("{entry}.tip_mm"), hand.tip_mm)?;
    place(&format!("{entry}.tip_at_rest_mm"), hand.tip_at_rest_mm)
}

/// Checks injections; where the record names instruments, medium leaves one of them or the sheath.
pub(crate) fn injections(record: &Record) -> Result<()> {
    let Record { instruments, injections, .. } = record;
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
            place(&format!("{entry}.at_mm"), Some(outlet.at_mm))?;
            let force_n = outlet.tip_force_n.unwrap_or(0.0);
            values(&entry, [("tip_force_n", force_n, Must::NotBeBelowZero)])?;
            if let Some(name) = outlet.instrument.as_ref().filter(|_| !instruments.is_empty()) {
                named(format!("{entry}.instrument"), name, instruments)?;
            }
        }
    }
    forward("injections", injections.iter().map(|one| one.time_s).enumerate())
}

/// Checks a record against the instruments of its scene: their names, and that no more of one is in than there is.
pub(crate) fn in_scene(record: &Record, stack: &Stack) -> Result<()> {
    let names: Vec<String> = stack.instruments().iter().map(|one| one.name.clone()).collect();
    // Recordings of a single device need not name it.
    let unnamed = record.instruments.is_empty() && !stack.is_several();
    if record.instruments != names && !unnamed {
        let remedy = format!(
            "the scene has [{}]: give the record of this scene (of a run, its folder with instruments.csv)",
            names.join(", ")
        );
        return Err(Error::parameter("instruments", format!("[{}]", record.instruments.join(", ")), remedy));
    }
    for (index, one) in record.injections.iter().enumerate() {
        if let Some(name) = one.outlet.as_ref().and_then(|outlet| outlet.instrument.as_ref()) {
            named(format!("injections[{index}].outlet.instrument"), name, &names)?;
        }
    }
    for (index, sample) in record.samples.iter().enumerate() {
        for (number, (hand, one)) in sample.hands.iter().zip(stack.instruments()).enumerate() {
            let length_mm = one.device.length_mm();
            if hand.inserted_mm > length_mm + SLACK_MM {
                let name = format!("samples[{index}].hands[{number}].inserted_mm");
                let remedy = format!("{} is {length_mm} mm long: give the record of this scene", one.name);
                return Err(Error::parameter(name, hand.inserted_mm, remedy));
            }
        }
    }
    Ok(())
}

/// Checks a log of the beam. Without any state it says nothing about the beam, not that it was off.
pub(crate) fn beam(beam: &[BeamState]) -> Result<()> {
    if beam.is_empty() {
        let remedy = "no state of the beam: give one for each change, or leave the log out if the beam was not recorded";
        return Err(Error::parameter("beam", "empty", remedy));
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
                ("entrance_ngy", state.entrance_ngy.unwrap_or(0.0), Must::NotBeBelowZero),
                ("entrance_mm2", state.entrance_mm2.unwrap_or(0.0), Must::NotBeBelowZero),
            ],
        )?;
    }
    forward("beam", beam.iter().map(|state| state.time_s).enumerate())
}

//! Checks of a case before anything is computed. Every error names the key at fault.

use super::case::{EndKind, Initial, LoadKind, Section, StartKind, StaticCase, Surface};
use crate::{Error, Result, Vec3};
use std::fmt::Display;

/// Largest number of elements: far beyond practical use, and about a gigabyte of memory with twist.
const MAX_ELEMENTS: usize = 200_000;

/// Largest numbers of iterations per load step, of load steps, and of load steps times elements: beyond them a
/// solution takes many minutes.
const MAX_ITERATIONS: usize = 100_000;
const MAX_LOAD_STEPS: usize = 1_000_000;
const MAX_WORK: usize = 10_000_000;

/// Useful tolerances: below, there is only rounding; above, a shape that is not an equilibrium would be accepted.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-14..=1e-2;

/// Self-contact: smallest ratio of a rod's length to its radius, and largest number of contact sites.
const LEAST_SLENDERNESS: f64 = 10.0;
const MAX_SITES: f64 = 1e6;

/// A key of an entry of a list, formatted only for errors.
struct Key<'a> {
    list: &'a str,
    index: usize,
    key: &'static str,
}

impl Display for Key<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}[{}].{}", self.list, self.index, self.key)
    }
}

fn positive(name: impl Display, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::parameter(name, value, "must be a positive, finite number"))
}

fn finite(name: impl Display, values: &[f64]) -> Result<()> {
    for v in values {
        if !v.is_finite() {
            return Err(Error::parameter(name, v, "must be a finite number"));
        }
    }
    Ok(())
}

fn direction(name: &str, value: &[f64; 3]) -> Result<()> {
    finite(name, value)?;
    if Vec3::from(*value).norm() < 1e-12 {
        return Err(Error::parameter(name, format!("{value:?}"), "is a direction and must not be zero"));
    }
    Ok(())
}

fn across(name: &str, normal: &[f64; 3], tangent: &[f64; 3]) -> Result<()> {
    direction(name, normal)?;
    let (n, t) = (Vec3::from(*normal).normalize(), Vec3::from(*tangent).normalize());
    if n.cross(&t).norm() < 1e-6 {
        return Err(Error::parameter(
            name,
            format!("{normal:?}"),
            "is along the tangent; give a direction across it",
        ));
    }
    Ok(())
}

/// The points of an initial curve: at least two, no two in a row equal.
fn check_points(initial: &Initial) -> Result<()> {
    let points = &initial.points;
    points.iter().try_for_each(|point| finite("initial.points", point))?;
    if points.len() == 1 {
        return Err(Error::parameter("initial.points", 1, "a curve has two points at least"));
    }
    if let Some(twice) = points.windows(2).find(|pair| pair[0] == pair[1]) {
        let remedy = "comes twice in a row; leave one out";
        return Err(Error::parameter("initial.points", format!("{:?}", twice[0]), remedy));
    }
    Ok(())
}

/// Sections of a rod or an instrument: in order, with valid values.
fn check_sections(list: &str, sections: &[Section]) -> Result<()> {
    if sections.is_empty() {
        return Err(Error::parameter(list, "none", format!("there must be at least one [[{list}]]")));
    }
    let mut begin = 0.0;
    for (k, section) in sections.iter().enumerate() {
        let name = |key| Key { list, index: k, key };
        positive(name("until"), section.until)?;
        if section.until <= begin {
            let remedy = format!("sections come in order: more than {begin}");
            return Err(Error::parameter(name("until"), section.until, remedy));
        }
        begin = section.until;
        let Section { ei, ei_end, gj, gj_end, ea, ea_end, .. } = section;
        positive(name("EI"), *ei)?;
        for (key, value) in
            [("EI_end", ei_end), ("GJ", gj), ("GJ_end", gj_end), ("EA", ea), ("EA_end", ea_end)]
        {
            if let Some(value) = value {
                positive(name(key), *value)?;
            }
        }
        for (key, end, begin) in [("GJ_end", gj_end, gj), ("EA_end", ea_end, ea)] {
            if end.is_some() && begin.is_none() {
                return Err(Error::parameter(
                    name(key),
                    "given",
                    "needs the value at the section's begin too",
                ));
            }
        }
        finite(name("rest_curvature"), &section.rest_curvature)?;
        finite(name("rest_curvature_end"), &section.rest_curvature_end.unwrap_or_default())?;
        finite(name("rest_twist"), &[section.rest_twist])?;
    }
    let known = sections.iter().filter(|s| s.gj.is_some()).count();
    if known != 0 && known != sections.len() {
        return Err(Error::parameter(
            format!("{list}.GJ"),
            "missing in some sections",
            "give it in all or in none",
        ));
    }
    Ok(())
}

impl StaticCase {
    /// Checks every value, and that none contradicts another.
    pub(crate) fn check(&self) -> Result<()> {
        if self.rod.instrument.is_empty() {
            positive("rod.length", self.rod.length)?;
        }
        if self.rod.elements == 0 || self.rod.elements > MAX_ELEMENTS {
            return Err(Error::parameter(
                "rod.elements",
                self.rod.elements,
                format!("must be 1 to {MAX_ELEMENTS}: more would take gigabytes"),
            ));
        }
        if self.rod.instrument.is_empty() {
            self.check_rod()?;
        } else {
            self.check_instruments()?;
        }
        let length = self.rod.line_length();
        direction("start.tangent", &self.start.tangent)?;
        finite("start.position", &self.start.position)?;
        if let Some(n) = &self.start.normal {
            across("start.normal", n, &self.start.tangent)?;
        }
        self.check_end()?;
        for (k, load) in self.load.iter().enumerate() {
            let name = |key| Key { list: "load", index: k, key };
            finite(name("value"), &load.value)?;
            let span = |key: &'static str, s: Option<f64>| match s {
                Some(s) if !(0.0..=length).contains(&s) => {
                    Err(Error::parameter(name(key), s, format!("must lie on the rod, 0 to {length}")))
                }
                _ => Ok(()),
            };
            span("at", load.at)?;
            span("from", load.from)?;
            span("to", load.to)?;
            let spread = load.kind == LoadKind::Distributed;
            if spread && load.at.is_some() {
                return Err(Error::parameter(
                    name("at"),
                    "given",
                    "a distributed load has no point; use from and to",
                ));
            }
            if !spread && (load.from.is_some() || load.to.is_some()) {
                return Err(Error::parameter(
                    name("from"),
                    "given",
                    "only a distributed load has from and to; use at",
                ));
            }
            if load.from.unwrap_or(0.0) >= load.to.unwrap_or(length) {
                return Err(Error::parameter(name("from"), load.from.unwrap_or(0.0), "must be less than to"));
            }
        }
        if let Some(initial) = &self.initial {
            finite("initial.curvature", &initial.curvature)?;
            check_points(initial)?;
        }
        if let Some(surface) = &self.self_contact {
            self.check_surface(surface)?;
        }
        for (key, value, most) in [
            ("solver.max_iterations", self.solver.max_iterations, MAX_ITERATIONS),
            ("solver.load_steps", self.solver.load_steps, MAX_LOAD_STEPS),
        ] {
            if value == 0 || value > most {
                return Err(Error::parameter(key, value, format!("must be 1 to {most}")));
            }
        }
        let work = self.solver.load_steps.saturating_mul(self.rod.elements);
        if work > MAX_WORK {
            let remedy = format!(
                "with {} elements that is {work} elements to solve for, and at most {MAX_WORK} are begun: use fewer steps or elements",
                self.rod.elements
            );
            return Err(Error::parameter("solver.load_steps", self.solver.load_steps, remedy));
        }
        let tolerance = self.solver.tolerance;
        if !TOLERANCES.contains(&tolerance) {
            let (least, most) = (TOLERANCES.start(), TOLERANCES.end());
            return Err(Error::parameter(
                "solver.tolerance",
                tolerance,
                format!("must be {least:e} to {most:e}: a part of the largest force in the rod"),
            ));
        }
        Ok(())
    }

    /// The surface of a rod that touches itself.
    fn check_surface(&self, surface: &Surface) -> Result<()> {
        crate::contact::pairs::check_built("self_contact")?;
        positive("self_contact.radius", surface.radius)?;
        let most = self.rod.line_length() / LEAST_SLENDERNESS;
        if surface.radius > most {
            let remedy = format!("must be less than {most}: a rod is many times as long as it is thick");
            return Err(Error::parameter("self_contact.radius", surface.radius, remedy));
        }
        let sites = self.rod.line_length() / surface.radius;
        if sites > MAX_SITES {
            let remedy =
                format!("makes {sites:.0e} places that may touch, and at most {MAX_SITES:.0e} are looked at");
            return Err(Error::parameter("self_contact.radius", surface.radius, remedy));
        }
        if let Some(modulus) = surface.modulus {
            positive("self_contact.modulus", modulus)?;
        }
        if !self.rod.instrument.is_empty() {
            let remedy = "it is for a single rod: leave it out, or give rod.section";
            return Err(Error::parameter("self_contact", "given with instruments", remedy));
        }
        Ok(())
    }

    /// The sections of a single rod.
    fn check_rod(&self) -> Result<()> {
        let (length, sections) = (self.rod.length, &self.rod.section);
        check_sections("rod.section", sections)?;
        for (k, section) in sections.iter().enumerate() {
            if section.until > length * (1.0 + 1e-9) {
                let begin = if k == 0 { 0.0 } else { sections[k - 1].until };
                return Err(Error::parameter(
                    Key { list: "rod.section", index: k, key: "until" },
                    section.until,
                    format!("sections come in order: more than {begin}, at most the length {length}"),
                ));
            }
        }
        let end = sections[sections.len() - 1].until;
        if (end - length).abs() > 1e-9 * length {
            return Err(Error::parameter(
                format!("rod.section[{}].until", sections.len() - 1),
                end,
                format!("the last section must end at the rod's length {length}"),
            ));
        }
        Ok(())
    }

    /// Checks several coaxial instruments.
    fn check_instruments(&self) -> Result<()> {
        let given = |key: &str, remedy: &str| Err(Error::parameter(key, "given", remedy));
        if self.rod.length != 0.0 || !self.rod.section.is_empty() {
            let key = if self.rod.length != 0.0 { "rod.length" } else { "rod.section" };
            return given(key, "instruments have lengths and sections of their own; leave it out");
        }
        if self.start.kind != StartKind::Clamped {
            let remedy = "instruments come out of a sheath that holds them; use clamped";
            return Err(Error::parameter("start.type", "pinned", remedy));
        }
        if !matches!(self.end.kind, EndKind::Free | EndKind::Pinned) {
            let kind = format!("{:?}", self.end.kind).to_lowercase();
            let remedy = "several instruments end where they end; use free or pinned";
            return Err(Error::parameter("end.type", kind, remedy));
        }
        if self.initial.is_some() {
            return given(
                "initial",
                "instruments start from the shape that they take untwisted; leave it out",
            );
        }
        for (index, load) in self.load.iter().enumerate() {
            if !matches!(load.kind, LoadKind::Force | LoadKind::Distributed) {
                let kind = format!("{:?}", load.kind).to_lowercase();
                let remedy = "of several instruments none is said to carry it; use force or distributed";
                return Err(Error::parameter(Key { list: "load", index, key: "kind" }, kind, remedy));
            }
        }
        for (index, instrument) in self.rod.instrument.iter().enumerate() {
            let name = |key| Key { list: "rod.instrument", index, key };
            positive(name("inserted"), instrument.inserted)?;
            finite(name("hand"), &[instrument.hand])?;
            self.check_clearance(index)?;
            let list = format!("rod.instrument[{index}].section");
            check_sections(&list, &instrument.section)?;
            let length = instrument.section[instrument.section.len() - 1].until;
            if length < instrument.inserted {
                let remedy =
                    format!("the instrument is {length} long, as its last section says: insert no more");
                return Err(Error::parameter(name("inserted"), instrument.inserted, remedy));
            }
            for (k, section) in instrument.section.iter().enumerate() {
                let key = |key| Key { list: &list, index: k, key };
                if section.ea.is_some() {
                    return Err(Error::parameter(
                        key("EA"),
                        "given",
                        "instruments are inextensible; leave it out",
                    ));
                }
                if instrument.is_shaped() && section.gj.is_none() {
                    let remedy = "an instrument with rest curvature or twist is twisted by the others: give the torsion stiffness";
                    return Err(Error::parameter(key("GJ"), "missing", remedy));
                }
            }
        }
        Ok(())
    }

    /// Checks the play of an instrument in the next one.
    fn check_clearance(&self, index: usize) -> Result<()> {
        let name = || Key { list: "rod.instrument", index, key: "clearance" };
        let clearance = self.rod.instrument[index].clearance;
        if clearance == 0.0 {
            return Ok(());
        }
        positive(name(), clearance)?;
        if index + 1 == self.rod.instrument.len() {
            let remedy = "the last instrument lies in none: list instruments from the innermost outwards, or leave it out";
            return Err(Error::parameter(name(), clearance, remedy));
        }
        Ok(())
    }

    fn check_end(&self) -> Result<()> {
        let end = &self.end;
        let wrong = |key: &str, remedy: &str| {
            Err(Error::parameter(
                format!("end.{key}"),
                format!("given with type {:?}", end.kind).to_lowercase(),
                remedy,
            ))
        };
        if end.kind == EndKind::Free || end.kind == EndKind::Guided {
            if end.position.is_some() {
                return wrong("position", "this end is free to move; use clamped or pinned");
            }
            if end.slide.is_some() {
                return wrong("slide", "this end is free to move already");
            }
        }
        if end.kind == EndKind::Free || end.kind == EndKind::Pinned {
            if end.tangent.is_some() {
                return wrong("tangent", "this end is free to turn; use clamped or guided");
            }
            if end.normal.is_some() {
                return wrong("normal", "this end is free to turn; use clamped or guided");
            }
            if end.turns.is_some() {
                return wrong("turns", "this end is free to turn; use clamped or guided");
            }
        }
        if end.kind == EndKind::Pinned && end.position.is_none() {
            return Err(Error::parameter("end.position", "missing", "a pinned end needs its position"));
        }
        if end.slide.is_some() && end.position.is_none() {
            return wrong("slide", "needs a position to slide from");
        }
        if let Some(t) = &end.tangent {
            direction("end.tangent", t)?;
        }
        if let Some(s) = &end.slide {
            direction("end.slide", s)?;
        }
        if let Some(n) = &end.normal {
            across("end.normal", n, &end.tangent.unwrap_or(self.start.tangent))?;
        }
        finite("end.turns", &[end.turns.unwrap_or(0.0)])?;
        if let Some(p) = &end.position {
            finite("end.position", p)?;
            let mut span = Vec3::from(*p) - Vec3::from(self.start.position);
            if let Some(s) = &end.slide {
                let s = Vec3::from(*s).normalize();
                span -= s * s.dot(&span);
            }
            let inextensible = self.rod.section.iter().all(|s| s.ea.is_none());
            let length = self.rod.line_length();
            if inextensible && span.norm() > length * (1.0 + 1e-12) {
                return Err(Error::parameter(
                    "end.position",
                    format!("{p:?}"),
                    format!(
                        "is {} away from the start, but the rod is inextensible and {} long; bring it nearer or give EA",
                        span.norm(),
                        length
                    ),
                ));
            }
            if inextensible && end.slide.is_none() && span.norm() > length * (1.0 - 1e-12) {
                self.check_straight(&span)?;
            }
        }
        Ok(())
    }

    /// A rod as long as its span is straight: held tangents must lie along it.
    fn check_straight(&self, span: &Vec3) -> Result<()> {
        let clamped = self.start.kind == StartKind::Clamped;
        let held =
            self.end.tangent.or(Some(self.start.tangent)).filter(|_| self.end.kind == EndKind::Clamped);
        for (name, tangent) in
            [("start.tangent", clamped.then_some(self.start.tangent)), ("end.tangent", held)]
        {
            let Some(tangent) = tangent else { continue };
            if Vec3::from(tangent).normalize().cross(&(span / span.norm())).norm() > 1e-9 {
                return Err(Error::parameter(
                    name,
                    format!("{tangent:?}"),
                    "the ends are as far apart as the rod is long, so it is straight; turn this along it or give EA",
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn work_that_never_ends_is_refused_by_key_and_number() {
        let reported = |elements: usize, solver: &str| {
            let text = format!(
                "[rod]\nlength = 1.0\nelements = {elements}\n[[rod.section]]\nuntil = 1.0\nEI = 1.0\n[start]\ntype = \"clamped\"\n\
                 [solver]\n{solver}\n"
            );
            StaticCase::from_toml(&text, Path::new("a.toml"))
                .err()
                .map_or_else(String::new, |e| e.to_string())
        };
        assert_eq!(reported(100, "load_steps = 10\nmax_iterations = 50"), "");
        for (elements, solver, words) in [
            (1_000_000, "", "rod.elements = 1000000: must be 1 to 200000"),
            (
                200_000,
                "load_steps = 1000",
                "solver.load_steps = 1000: with 200000 elements that is 200000000",
            ),
            (10, "load_steps = 2000000", "solver.load_steps = 2000000: must be 1 to 1000000"),
            (10, "max_iterations = 0", "solver.max_iterations = 0: must be 1 to 100000"),
            (10, "max_iterations = 100001", "solver.max_iterations = 100001: must be 1 to 100000"),
        ] {
            let error = reported(elements, solver);
            assert!(error.contains(words), "{words}: {error}");
        }
    }
}

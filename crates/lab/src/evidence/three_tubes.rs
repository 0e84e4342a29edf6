//! Three nested pre-curved tubes that a robot turns and pushes, against measured positions of their tip.
//!
//! The tubes are the instruments of a static case: each is turned at its base, behind the plate through which they
//! come, where a guide keeps them straight. They slide and turn in each other without friction.

use std::f64::consts::PI;

use endowire_core::statics::{End, EndKind, Instrument, Rod, Section, Solver, Start, StartKind, StaticCase};
use endowire_core::{Error, Result, Vec3};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Study;
use super::driven_tubes::{self, Driven};

/// The study in words.
pub const STUDY: Study = Study {
    name: "three-tubes",
    title: "Three nested pre-curved tubes",
    question: "Where does the tip of pre-curved instruments end that are turned and pushed inside one another?",
    data: "1,307 measured tips of a robot of three concentric tubes, in the public repository hjhdog1/ConcentricTubes on GitHub, which states no licence: get the file \
           jointTipTrajectory_measured_short.txt there (commit 2add607) and give its path. A row has an index, three turns in rad, three positions of the tubes' bases in mm (negative behind the \
           plate), the tip x y z in mm, and three axes of the tip.",
    computed: "The static equilibrium of every row, without friction and play, the bases of the tubes behind a plate, so that their straight ends twist. First with the \
               published numbers; then with 17 numbers (curvatures, stiffness ratios, lengths, zeros of the turns, pose of the plate) fitted to every eighth row, and \
               judged on the others. On request with play as well, and with friction along the path in the order of the rows.",
    not_shown: "Without --friction, what depends on the path: the same joints reached from elsewhere differ by 0.25 mm in the median and by millimetres in one pair of ten. The fitted numbers also \
                take up what is not modelled, and are not measurements of the tubes. One robot, free space: no vessel, no wall.",
};

/// Straight length, curved length, mm, curvature, 1/mm, and EI relative to that of the first, of each tube, the outermost
/// first, as published with the measurements.
pub(super) const TUBES: [Tube; 3] = [
    Tube { straight_mm: 0.0, curved_mm: 150.0, curvature_per_mm: 1.0 / 265.0, stiffness: 1.0 },
    Tube { straight_mm: 17.0, curved_mm: 150.0, curvature_per_mm: 1.0 / 265.0, stiffness: 1.0 },
    Tube { straight_mm: 184.0, curved_mm: 86.394, curvature_per_mm: 1.0 / 55.0, stiffness: 2.0 / 7.0 },
];
/// Ratio of EI to GJ of a tube of Poisson ratio 0.3.
const BEND_TO_TWIST: f64 = 1.3;
/// EI of the guide behind the plate and GJ of what would be behind a tube's base: rigid against the tubes.
const GUIDE_STIFFNESS: f64 = 1e5;
/// EI of what would be behind a tube's base: nothing against the tubes.
const LIMP: f64 = 1e-4;
/// Length of an element, mm.
pub(super) const ELEMENT_MM: f64 = 8.0;
/// Shortest length that a tube may stick out of the plate, mm.
const LEAST_OUT_MM: f64 = 1.0;
/// The parameters are fitted to every so-many-th row.
const FITTED_EVERY: usize = 8;
/// Number of columns of a row: index, three turns, three lengths, the tip and three axes.
const COLUMNS: usize = 19;
/// Largest number of iterations of a fit, and relative decrease of the misfit at which it ends.
const ITERATIONS: usize = 14;
const ENOUGH: f64 = 2e-3;
/// Distance, mm, beyond which a row counts by its distance and no longer by the square: joints in which the tubes lie
/// otherwise than modelled do not decide.
const FAR_MM: f64 = 4.0;

/// A pre-curved tube.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tube {
    pub(super) straight_mm: f64,
    pub(super) curved_mm: f64,
    pub(super) curvature_per_mm: f64,
    pub(super) stiffness: f64,
}

/// A measured row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Angle of each tube's base, rad, the outermost first.
    pub turns_rad: [f64; 3],
    /// Position of each tube's base before the plate, mm; negative behind it.
    pub bases_mm: [f64; 3],
    /// Measured tip, mm.
    pub tip_mm: Vec3,
}

/// Number of parameters, of those without friction, and of those without play.
const PARAMETERS: usize = 20;
const WITHOUT_FRICTION: usize = 19;
const WITHOUT_PLAY: usize = 17;
/// Play and coefficient of friction that a fit begins with, mm.
const PLAY_MM: f64 = 0.1;
const FRICTION: f64 = 0.1;

/// What is not known exactly, as differences from the nominal values, each in its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    values: [f64; PARAMETERS],
    between: Between,
}

/// What there is between the tubes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Between {
    Nothing,
    Play,
    /// Play, and friction with the path that it remembers.
    PlayAndFriction,
}

impl Between {
    /// Number of parameters that are fitted.
    fn parameters(self) -> usize {
        match self {
            Self::Nothing => WITHOUT_PLAY,
            Self::Play => WITHOUT_FRICTION,
            Self::PlayAndFriction => PARAMETERS,
        }
    }
}

/// Names of the parameters, with units, and the step by which their influence is measured.
pub const NAMES: [(&str, f64); PARAMETERS] = [
    ("curvature of tube 1, relative", 1e-3),
    ("curvature of tube 2, relative", 1e-3),
    ("curvature of tube 3, relative", 1e-3),
    ("EI of tube 2 over tube 1, logarithm", 1e-2),
    ("EI of tube 3 over tube 1, logarithm", 1e-2),
    ("GJ of all tubes over EI, logarithm", 1e-2),
    ("zero of turn 1, rad", 1e-3),
    ("zero of turn 2, rad", 1e-3),
    ("zero of turn 3, rad", 1e-3),
    ("length of tube 1, mm", 1e-1),
    ("length of tube 2, mm", 1e-1),
    ("length of tube 3, mm", 1e-1),
    ("plate, x, mm", 1e-1),
    ("plate, y, mm", 1e-1),
    ("plate, z, mm", 1e-1),
    ("tilt of the plate about x, rad", 1e-3),
    ("tilt of the plate about y, rad", 1e-3),
    ("play of tube 2 in tube 1 over 0.1 mm, logarithm", 1e-1),
    ("play of tube 3 in tube 2 over 0.1 mm, logarithm", 1e-1),
    ("coefficient of friction over 0.1, logarithm", 1e-1),
];

impl Default for Parameters {
    /// The published values, without play.
    fn default() -> Self {
        Self { values: [0.0; PARAMETERS], between: Between::Nothing }
    }
}

/// Distances between computed and measured tips.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Misfit {
    /// Number of rows compared.
    pub rows: usize,
    /// Number of rows for which no equilibrium was found; they are not among the others.
    pub unsolved: usize,
    /// Mean distance, mm.
    pub mean_mm: f64,
    /// Mean distance relative to the length of the line outside the plate, per cent.
    pub mean_percent_of_length: f64,
    /// Distance that 95 % of the rows do not exceed, mm.
    pub p95_mm: f64,
}

/// Misfit of fitted parameters on rows that were not used for fitting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fitted {
    /// Number of rows that the parameters were fitted to.
    pub rows_fitted: usize,
    /// Number of rows that they were tested on.
    pub rows_tested: usize,
    /// The misfit on the tested rows.
    #[serde(flatten)]
    pub misfit: Misfit,
    /// Names and values of the parameters, as differences from the published values.
    pub parameters: Vec<(&'static str, f64)>,
}

/// Results of the study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ThreeTubes {
    /// With the published numbers, on all rows.
    pub nominal: Misfit,
    /// With fitted numbers.
    pub fitted: Fitted,
    /// With play, and numbers that are fitted with it, if asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with_play: Option<Fitted>,
    /// With these and friction along the driven path, fitted; if asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with_friction: Option<Fitted>,
    /// With the numbers that were fitted with play along the driven path, for each coefficient of friction; if asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub driven: Vec<Driven>,
    /// Distances on the tested rows with the published and with fitted numbers, mm, in ascending order.
    #[serde(skip)]
    pub distances_mm: [Vec<f64>; 2],
}

/// What a study computes beside the tubes without friction and play.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Also {
    /// With play.
    pub play: bool,
    /// With play, and friction along the driven path.
    pub friction: bool,
}

/// Reads the table of measurements; `name` is its name in errors.
///
/// # Errors
/// Names line and column of a value that is missing or no number, and lengths that leave a tube behind the plate.
pub fn read(text: &str, name: &std::path::Path) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let at = |what: String| Error::content(name, format!("line {}: {what}", index + 1));
        let mut values = [0.0; COLUMNS];
        let mut words = line.split_whitespace();
        for (column, value) in values.iter_mut().enumerate() {
            let word = words.next().ok_or_else(|| {
                at(format!(
                    "has {column} columns: give {COLUMNS}, index, three turns in rad, three lengths in mm, tip x y z in mm and three axes"
                ))
            })?;
            let number = word.parse::<f64>().ok().filter(|value| value.is_finite());
            *value = number.ok_or_else(|| at(format!("column {}: {word} is no number", column + 1)))?;
        }
        let three = |from: usize| [values[from], values[from + 1], values[from + 2]];
        let row = Row { turns_rad: three(1), bases_mm: three(4), tip_mm: three(7).into() };
        for (tube, base_mm) in TUBES.iter().zip(row.bases_mm) {
            let out_mm = tube.straight_mm + tube.curved_mm + base_mm;
            if base_mm > 0.0 || out_mm < LEAST_OUT_MM {
                let length_mm = tube.straight_mm + tube.curved_mm;
                return Err(at(format!(
                    "a base {base_mm} mm before the plate: must be 0 or less, and a tube of {length_mm} mm must come out of it"
                )));
            }
        }
        rows.push(row);
    }
    if rows.len() < 2 * FITTED_EVERY {
        let text = format!("has {} rows: a fit needs {} at least", rows.len(), 2 * FITTED_EVERY);
        return Err(Error::content(name, text));
    }
    Ok(rows)
}

impl Parameters {
    /// GJ of a tube over its EI.
    pub(super) fn torsion(&self) -> f64 {
        libm::exp(self.values[5]) / BEND_TO_TWIST
    }

    pub(super) fn tube(&self, index: usize) -> Tube {
        let tube = TUBES[index];
        let stiffer = if index == 0 { 0.0 } else { self.values[2 + index] };
        Tube {
            curvature_per_mm: tube.curvature_per_mm * (1.0 + self.values[index]),
            straight_mm: tube.straight_mm,
            curved_mm: tube.curved_mm + self.values[9 + index],
            stiffness: tube.stiffness * libm::exp(stiffer),
        }
    }

    /// Play of a tube in the next one outside, mm.
    pub(super) fn play_mm(&self, index: usize) -> f64 {
        let is_inside = self.between != Between::Nothing && index > 0;
        if is_inside { PLAY_MM * libm::exp(self.values[WITHOUT_PLAY + index - 1]) } else { 0.0 }
    }

    /// Coefficient of friction between tubes.
    pub(super) fn friction(&self) -> f64 {
        match self.between {
            Between::PlayAndFriction => FRICTION * libm::exp(self.values[WITHOUT_FRICTION]),
            _ => 0.0,
        }
    }

    /// Angle of a tube's base, rad.
    pub(super) fn hand_rad(&self, row: &Row, index: usize) -> f64 {
        row.turns_rad[index] + self.values[6 + index]
    }

    /// The static case of a row: the line begins behind all bases and goes through the plate.
    fn case(&self, row: &Row) -> StaticCase {
        let behind_mm = row.bases_mm.iter().map(|base_mm| -base_mm).fold(LEAST_OUT_MM, f64::max);
        let section = |until: f64, ei: f64, gj: f64, curvature_per_mm: f64| Section {
            gj: Some(gj),
            rest_curvature: [curvature_per_mm, 0.0],
            ..crate::section(until, ei)
        };
        // From the innermost outwards.
        let mut instrument: Vec<Instrument> = (0..TUBES.len())
            .rev()
            .map(|index| {
                let tube = self.tube(index);
                let (ei, gj) = (tube.stiffness, tube.stiffness / BEND_TO_TWIST * libm::exp(self.values[5]));
                let length_mm = tube.straight_mm + tube.curved_mm;
                // A base is where the hand is: what the line has behind it neither bends nor twists.
                let inserted = length_mm + row.bases_mm[index] + behind_mm;
                let mut sections = vec![section(tube.curved_mm, ei, gj, tube.curvature_per_mm)];
                for (until, ei, gj) in [(length_mm, ei, gj), (inserted + 1.0, LIMP, GUIDE_STIFFNESS)] {
                    if until > sections[sections.len() - 1].until + 1e-6 {
                        sections.push(section(until, ei, gj, 0.0));
                    }
                }
                Instrument {
                    name: format!("tube {}", index + 1),
                    inserted,
                    hand: self.hand_rad(row, index),
                    clearance: self.play_mm(index),
                    section: sections,
                }
            })
            .collect();
        instrument.push(Instrument {
            name: "guide".to_owned(),
            inserted: behind_mm,
            hand: 0.0,
            clearance: 0.0,
            section: vec![section(behind_mm + 1.0, GUIDE_STIFFNESS, GUIDE_STIFFNESS, 0.0)],
        });
        let line_mm = instrument.iter().map(|one| one.inserted).fold(0.0, f64::max);
        let elements = (line_mm / ELEMENT_MM).ceil() as usize;
        StaticCase {
            rod: Rod { length: 0.0, elements, section: vec![], instrument },
            start: Start {
                kind: StartKind::Clamped,
                position: [0.0, 0.0, -behind_mm],
                tangent: [0.0, 0.0, 1.0],
                normal: Some([1.0, 0.0, 0.0]),
            },
            end: End { kind: EndKind::Free, ..End::default() },
            load: vec![],
            self_contact: None,
            initial: None,
            solver: Solver { tolerance: 1e-8, ..Solver::default() },
        }
    }

    /// The computed tip of a row, mm; `None` without an equilibrium.
    fn tip_mm(&self, row: &Row) -> Option<Vec3> {
        let solution = self.case(row).solve().ok().filter(|solution| solution.converged)?;
        Some(self.off_plate_mm(Vec3::from(solution.tip)))
    }

    /// A place before the plate in the axes of the measurements, mm.
    pub(super) fn off_plate_mm(&self, place_mm: Vec3) -> Vec3 {
        let [_, _, _, _, _, _, _, _, _, _, _, _, x, y, z, about_x, about_y, ..] = self.values;
        place_mm + Vec3::new(about_x, about_y, 0.0).cross(&place_mm) + Vec3::new(x, y, z)
    }

    /// Vectors from measured to computed tips.
    fn errors_mm(&self, rows: &[Row], parallel: &Parallel<'_>) -> Vec<Option<Vec3>> {
        parallel(rows.len(), &|index| self.tip_mm(&rows[index]).map(|tip_mm| tip_mm - rows[index].tip_mm))
    }
}

/// Computes vectors for 0, 1, … in any order, on threads of the caller, and returns them in this one.
pub type Parallel<'a> =
    dyn Fn(usize, &(dyn Fn(usize) -> Option<Vec3> + Sync)) -> Vec<Option<Vec3>> + Sync + 'a;

/// Length of the line outside the plate, mm.
fn out_mm(row: &Row) -> f64 {
    let each = TUBES.iter().zip(row.bases_mm).map(|(tube, base)| tube.straight_mm + tube.curved_mm + base);
    each.fold(0.0, f64::max)
}

fn distances(rows: &[Row], errors_mm: &[Option<Vec3>]) -> Vec<(f64, f64)> {
    let each = rows.iter().zip(errors_mm);
    each.filter_map(|(row, error)| error.map(|error| (error.norm(), out_mm(row)))).collect()
}

impl Misfit {
    pub(super) fn of(rows: &[Row], errors_mm: &[Option<Vec3>]) -> Self {
        let mut all = distances(rows, errors_mm);
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let count = all.len().max(1) as f64;
        let at = ((0.95 * count).ceil() as usize).saturating_sub(1);
        Self {
            rows: all.len(),
            unsolved: rows.len() - all.len(),
            mean_mm: all.iter().map(|(mm, _)| mm).sum::<f64>() / count,
            mean_percent_of_length: 100.0 * all.iter().map(|(mm, length)| mm / length).sum::<f64>() / count,
            p95_mm: all.get(at).map_or(f64::NAN, |(mm, _)| *mm),
        }
    }
}

/// Weight of a row in the squares: 1 near by, and as 1/distance far away (Huber 1964).
fn weight(error: &Vec3) -> f64 {
    (FAR_MM / error.norm()).min(1.0)
}

/// What a fit reduces: squares near by, distances far away.
fn cost(errors_mm: &[Option<Vec3>]) -> f64 {
    let each = errors_mm.iter().flatten().map(Vec3::norm);
    each.map(|mm| if mm <= FAR_MM { 0.5 * mm * mm } else { FAR_MM * (mm - 0.5 * FAR_MM) }).sum()
}

/// Vectors from measured to computed tips of the rows that are fitted, for each of several sets of parameters.
type Errors<'a> = dyn Fn(&[Parameters]) -> Result<Vec<Vec<Option<Vec3>>>> + 'a;

/// Fits the parameters by Levenberg's and Marquardt's method with derivatives by differences; `told` is called after every iteration.
///
/// # Errors
/// As `of`.
fn fit(start: Parameters, of: &Errors<'_>, told: &dyn Fn(usize)) -> Result<Parameters> {
    let count = start.between.parameters();
    let mut best = start;
    let mut errors = of(&[best])?.remove(0);
    let mut damping = 1e-3;
    for iteration in 0..ITERATIONS {
        let (mut normal, mut gradient) = (DMatrix::<f64>::zeros(count, count), DVector::<f64>::zeros(count));
        let moved = |k: usize| {
            let mut moved = best;
            moved.values[k] += NAMES[k].1;
            moved
        };
        let columns = of(&(0..count).map(moved).collect::<Vec<_>>())?;
        for (row, error) in errors.iter().enumerate() {
            let Some(error) = error else { continue };
            // A row that another branch of equilibria is near to says nothing about slopes.
            let slope = |k: usize| columns[k][row].map(|moved| (moved - error) / NAMES[k].1);
            let Some(slopes) = (0..count).map(slope).collect::<Option<Vec<Vec3>>>() else { continue };
            let is_smooth = slopes.iter().zip(NAMES).all(|(slope, (_, step))| slope.norm() * step < FAR_MM);
            if !is_smooth {
                continue;
            }
            let weight = weight(error);
            for i in 0..count {
                gradient[i] += weight * slopes[i].dot(error);
                for j in 0..count {
                    normal[(i, j)] += weight * slopes[i].dot(&slopes[j]);
                }
            }
        }
        let before = cost(&errors);
        let mut improved = false;
        for _ in 0..6 {
            let mut damped = normal.clone();
            (0..count).for_each(|k| damped[(k, k)] *= 1.0 + damping);
            let Some(step) = damped.cholesky().map(|factor| factor.solve(&gradient)) else { break };
            let mut next = best;
            (0..count).for_each(|k| next.values[k] -= step[k]);
            let found = of(&[next])?.remove(0);
            // A row without an equilibrium must not count as one without an error.
            let lost = found.iter().flatten().count() < errors.iter().flatten().count();
            if !lost && cost(&found) < before {
                (best, errors, damping, improved) = (next, found, damping * 0.3, true);
                break;
            }
            damping *= 6.0;
        }
        told(iteration + 1);
        if !improved || cost(&errors) > (1.0 - ENOUGH) * before {
            break;
        }
    }
    Ok(best)
}

/// Compares the measured tips with the computed ones: with the published numbers on all rows, and with numbers that were
/// fitted to every eighth row on the others, and what is asked for beside that. `told` is called after every iteration of a fit, of at most
/// [`MOST_STEPS`].
///
/// # Errors
/// Tubes that cannot be driven along the path.
pub fn study(rows: &[Row], also: Also, parallel: &Parallel<'_>, told: &dyn Fn(usize)) -> Result<ThreeTubes> {
    let nominal = Parameters::default();
    let errors = nominal.errors_mm(rows, parallel);
    let is_fitted = |index: &usize| index.is_multiple_of(FITTED_EVERY);
    let of = |wanted: bool| -> Vec<Row> {
        (0..rows.len()).filter(|index| is_fitted(index) == wanted).map(|index| rows[index]).collect()
    };
    let (seen, unseen) = (of(true), of(false));
    let judged = |parameters: &Parameters, errors: &[Option<Vec3>]| Fitted {
        rows_fitted: seen.len(),
        rows_tested: unseen.len(),
        misfit: Misfit::of(&unseen, errors),
        parameters: (NAMES.iter().map(|(name, _)| *name).zip(parameters.values))
            .take(parameters.between.parameters())
            .collect(),
    };
    let each_row = |sets: &[Parameters]| -> Result<Vec<Vec<Option<Vec3>>>> {
        Ok(sets.iter().map(|parameters| parameters.errors_mm(&seen, parallel)).collect())
    };
    let without = fit(nominal, &each_row, told)?;
    let fitted_errors = without.errors_mm(&unseen, parallel);
    let fitted = judged(&without, &fitted_errors);
    let (mut with_play, mut with_friction, mut driven) = (None, None, Vec::new());
    if also.play || also.friction {
        // Ends that share a node are apart with fitted lengths: play is fitted from those.
        let playing = fit(Parameters { between: Between::Play, ..without }, &each_row, told)?;
        with_play = Some(judged(&playing, &playing.errors_mm(&unseen, parallel)));
        if also.friction {
            driven = driven_tubes::driven(&playing, rows, &|index| !is_fitted(&index), parallel)?;
            let on = |errors: Vec<Option<Vec3>>, wanted: bool| -> Vec<Option<Vec3>> {
                let each = errors.into_iter().enumerate();
                each.filter(|(index, _)| is_fitted(index) == wanted).map(|(_, error)| error).collect()
            };
            let along = |sets: &[Parameters]| -> Result<Vec<Vec<Option<Vec3>>>> {
                let each = driven_tubes::along(sets, rows, parallel)?;
                Ok(each.into_iter().map(|errors| on(errors, true)).collect())
            };
            // Without play all press without bound where they are turned against each other.
            let mut begin = Parameters { between: Between::PlayAndFriction, ..playing };
            begin.values[WITHOUT_PLAY..].fill(0.0);
            let rubbing = fit(begin, &along, told)?;
            let errors = driven_tubes::along(&[rubbing], rows, parallel)?.remove(0);
            with_friction = Some(judged(&rubbing, &on(errors, false)));
        }
    }
    let before = (0..rows.len()).filter(|index| !is_fitted(index)).map(|index| errors[index]);
    let before: Vec<Option<Vec3>> = before.collect();
    let distances_mm = [&before, &fitted_errors].map(|errors| {
        let mut all: Vec<f64> = distances(&unseen, errors).into_iter().map(|(mm, _)| mm).collect();
        all.sort_by(f64::total_cmp);
        all
    });
    let nominal = Misfit::of(rows, &errors);
    Ok(ThreeTubes { nominal, fitted, with_play, with_friction, driven, distances_mm })
}

/// Largest number of iterations of the fit.
pub const MOST_STEPS: usize = ITERATIONS;

/// A table of invented measurements: tips that the model itself gives with `changed` curvature of the third tube,
/// for tests and for trying the command without the data.
///
/// # Errors
/// A row without an equilibrium.
pub fn invented(count: usize, changed: f64) -> Result<Vec<Row>> {
    let mut parameters = Parameters::default();
    parameters.values[2] = changed;
    let row = |index: usize| {
        // Joints that no two rows share, from multiples of irrational numbers.
        let part = |k: f64| (index as f64 * k).fract();
        let mut row = Row {
            turns_rad: [0.0, PI * (part(0.618_034) - 0.5), PI * (part(0.414_214) - 0.5)],
            bases_mm: [0.0, -17.0 - 20.0 * part(0.732_051), -110.0 - 30.0 * part(0.236_068)],
            tip_mm: Vec3::zeros(),
        };
        row.tip_mm = parameters
            .tip_mm(&row)
            .ok_or_else(|| Error::Computation(format!("invented row {index}: no equilibrium")))?;
        Ok(row)
    };
    (0..count).map(row).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn in_turn(count: usize, of: &(dyn Fn(usize) -> Option<Vec3> + Sync)) -> Vec<Option<Vec3>> {
        (0..count).map(of).collect()
    }

    #[test]
    fn a_changed_curvature_is_found_and_unseen_rows_follow() {
        let rows = invented(48, 0.05).unwrap();
        let found = study(&rows, Also::default(), &in_turn, &|_| ()).unwrap();
        assert!(found.nominal.mean_mm > 0.5, "{:?}", found.nominal);
        assert!(found.fitted.misfit.mean_mm < 0.05 * found.nominal.mean_mm, "{:?}", found.fitted);
        assert_eq!((found.fitted.rows_fitted, found.fitted.rows_tested), (6, 42));
        // The twin: measurements of other joints are not explained.
        let mut wrong = rows;
        wrong.reverse();
        let tips: Vec<Vec3> = wrong.iter().map(|row| row.tip_mm).rev().collect();
        wrong.iter_mut().zip(tips).for_each(|(row, tip_mm)| row.tip_mm = tip_mm);
        assert!(Misfit::of(&wrong, &Parameters::default().errors_mm(&wrong, &in_turn)).mean_mm > 5.0);
    }

    #[test]
    fn unusable_tables_are_refused_by_line() {
        let line = "0 0 0 0 0 -17 -104 53 0 154 1 0 0 0 1 0 0 0 1\n";
        let reported = |text: &str| read(text, Path::new("tips.txt")).unwrap_err().to_string();
        assert!(read(&line.repeat(16), Path::new("tips.txt")).is_ok());
        assert!(reported(&line.repeat(15)).contains("has 15 rows"));
        assert!(reported(&line.replace("53", "x")).contains("line 1: column 8: x is no number"));
        assert!(reported("1 2 3\n").contains("line 1: has 3 columns"));
        assert!(reported(&line.replace("-104", "-300")).contains("a base -300 mm before the plate"));
        assert!(reported(&line.replace("-17", "5")).contains("must be 0 or less"));
    }
}

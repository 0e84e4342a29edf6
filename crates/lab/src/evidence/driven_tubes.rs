//! The three tubes along the path by which they were driven: with friction between them, where they end depends on that.
//!
//! They are pushed out of the mouth of a sheath into free space and go from row to row as the robot did, with the numbers that were
//! fitted with play. Radii and stiffness have no influence without friction; with it, friction takes the product of coefficient and
//! radius, so that the coefficient is one for tubes of these radii.

use std::sync::Mutex;

use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Sheath, Simulation};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution};
use endowire_core::{Result, Vec3};
use serde::Serialize;

use super::three_tubes::{ELEMENT_MM, Misfit, Parallel, Parameters, Row, TUBES};

/// Coefficients of friction.
const FRICTIONS: [f64; 4] = [0.0, 0.1, 0.2, 0.3];
/// EI of the first tube, N·mm².
const STIFFNESS_NMM2: f64 = 5e4;
/// Outer radius of the innermost tube and thickness of the others' walls, mm.
const RADIUS_MM: f64 = 0.8;
const WALL_MM: f64 = 0.15;
/// Radius and length of the free space, mm, and distance of the sheath's mouth from where it begins.
const SPACE_MM: [f64; 2] = [300.0, 420.0];
const MOUTH_MM: f64 = 40.0;
/// Longest step on the way to the first row, mm.
const STEP_MM: f64 = 4.0;

/// Misfit along the driven path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Driven {
    /// Coefficient of friction.
    pub friction: f64,
    /// On the rows that were not used for fitting.
    #[serde(flatten)]
    pub misfit: Misfit,
    /// Mean distance relative to the length on the rows that were, per cent: by which a coefficient would be chosen.
    pub fitted_rows_percent_of_length: f64,
}

/// The tubes at the mouth of the sheath.
fn tubes(parameters: &Parameters, friction: f64) -> Result<Simulation> {
    let mut radius_mm = RADIUS_MM;
    let mut instruments = Vec::new();
    for index in (0..TUBES.len()).rev() {
        let tube = parameters.tube(index);
        let inner_radius_mm = if instruments.is_empty() { 0.5 * radius_mm } else { radius_mm - WALL_MM };
        let straight = Section {
            inner_radius_mm: Some(inner_radius_mm),
            torsional_stiffness_nmm2: Some(STIFFNESS_NMM2 * tube.stiffness * parameters.torsion()),
            ..Section::straight(tube.straight_mm, radius_mm, STIFFNESS_NMM2 * tube.stiffness)
        };
        let curved = Section {
            length_mm: tube.curved_mm,
            rest_curvature_per_mm: [tube.curvature_per_mm, 0.0],
            ..straight
        };
        let sections = if tube.straight_mm > 0.0 { vec![curved, straight] } else { vec![curved] };
        let name = format!("tube {}", index + 1);
        instruments.push(Instrument { name, device: Device::new(sections)?, may_lead: true });
        radius_mm += parameters.play_mm(index) + WALL_MM;
    }
    let node = |k: u32| {
        let position_mm = Vec3::z() * (SPACE_MM[1] * f64::from(k) / 8.0);
        CentrelineNode { position_mm, radius_mm: SPACE_MM[0], parent: (k as usize).checked_sub(1) }
    };
    let tree = CentrelineTree::new((0..=8).map(node).collect())?;
    let space = GeneratedWall::new(&tree, Resolution::EdgeMm(0.25 * SPACE_MM[0]))?;
    let sheath = Sheath::new(Vec3::z() * MOUTH_MM, Vec3::z())?.bending_towards(Vec3::x())?;
    let stack = Stack::new(instruments)?.with_friction(vec![friction, friction, 0.0])?;
    let options = KirchhoffOptions { element_mm: ELEMENT_MM, ..KirchhoffOptions::default() };
    Simulation::builder(space.wall, stack.with_clearance(vec![true, true, false])?, sheath)
        .method(&options)
        .build()
}

/// Moves all tubes towards a row, by this part of the way.
fn towards(simulation: &mut Simulation, parameters: &Parameters, row: &Row, part: f64) -> Result<()> {
    let reported = &simulation.report().instruments;
    let moves: Vec<Move> = (0..TUBES.len())
        .map(|instrument| {
            let index = TUBES.len() - 1 - instrument;
            let tube = parameters.tube(index);
            let inserted_mm = tube.straight_mm + tube.curved_mm + row.bases_mm[index];
            let here = &reported[instrument];
            let command = Command {
                advance_mm: part * (inserted_mm - here.inserted_mm),
                rotate_rad: part * (parameters.hand_rad(row, index) - here.rotation_rad),
                ..Command::default()
            };
            Move { instrument, command }
        })
        .collect();
    simulation.step_together(&moves).map(|_| ())
}

/// Vectors from measured to computed tips along the whole path.
fn errors_mm(parameters: &Parameters, rows: &[Row], friction: f64) -> Result<Vec<Option<Vec3>>> {
    let mut simulation = tubes(parameters, friction)?;
    let length_mm = TUBES.iter().map(|tube| tube.straight_mm + tube.curved_mm).fold(0.0, f64::max);
    let steps = (length_mm / STEP_MM).ceil() as usize;
    for left in (1..=steps).rev() {
        towards(&mut simulation, parameters, &rows[0], 1.0 / left as f64)?;
    }
    let each = rows.iter().map(|row| {
        let went = towards(&mut simulation, parameters, row, 1.0);
        let tip_mm = simulation.tip_of_mm(0).filter(|_| went.is_ok() && simulation.report().converged)?;
        Some(parameters.off_plate_mm(tip_mm - Vec3::z() * MOUTH_MM) - row.tip_mm)
    });
    Ok(each.collect())
}

/// Vectors from measured to computed tips along the whole path, for each of several sets of parameters.
pub(super) fn along(
    sets: &[Parameters],
    rows: &[Row],
    parallel: &Parallel<'_>,
) -> Result<Vec<Vec<Option<Vec3>>>> {
    each(sets.len(), &|index| errors_mm(&sets[index], rows, sets[index].friction()), parallel)
}

/// The errors along a path; none where no equilibrium was found.
type Errors = Vec<Option<Vec3>>;

/// Computes so many paths side by side.
fn each(
    count: usize,
    of: &(dyn Fn(usize) -> Result<Errors> + Sync),
    parallel: &Parallel<'_>,
) -> Result<Vec<Errors>> {
    let found: Mutex<Vec<(usize, Result<Errors>)>> = Mutex::default();
    parallel(count, &|index| {
        let errors = of(index);
        if let Ok(mut found) = found.lock() {
            found.push((index, errors));
        }
        None
    });
    let mut found = found.into_inner().unwrap_or_default();
    found.sort_by_key(|(index, _)| *index);
    found.into_iter().map(|(_, errors)| errors).collect()
}

/// The misfit along the path for every coefficient, on the rows that `is_tested` and on the others.
pub(super) fn driven(
    parameters: &Parameters,
    rows: &[Row],
    is_tested: &dyn Fn(usize) -> bool,
    parallel: &Parallel<'_>,
) -> Result<Vec<Driven>> {
    let paths = each(FRICTIONS.len(), &|index| errors_mm(parameters, rows, FRICTIONS[index]), parallel)?;
    let each = paths.into_iter().zip(FRICTIONS).map(|(errors, friction)| {
        let misfit = |tested: bool| {
            let of = (0..rows.len()).filter(|index| is_tested(*index) == tested);
            let (rows, errors): (Vec<Row>, Vec<Option<Vec3>>) =
                of.map(|index| (rows[index], errors[index])).unzip();
            Misfit::of(&rows, &errors)
        };
        let fitted_rows_percent_of_length = misfit(false).mean_percent_of_length;
        Driven { friction, misfit: misfit(true), fitted_rows_percent_of_length }
    });
    Ok(each.collect())
}

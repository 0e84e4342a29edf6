//! Our method: the exact rod in equilibrium with the wall, after every command.
//!
//! The inserted length is a Kirchhoff rod ([`crate::rod`]) clamped in the sheath's mouth and free at its tip, in the
//! energy of the wall ([`crate::contact`]). A command changes the inserted length and turns the tail; the rod slides
//! along its own curve and Newton's method takes it from there to the next minimum of the potential energy. What
//! the hand feels follows from the equilibrium: with n and m the internal force and moment in the sheath's mouth,
//!
//! ```text
//! F = −n·t − ½ EI |κ|² − ½ GJ τ²,    M = m·t
//! ```
//!
//! of which the terms after the first are configurational: the energy that the next piece takes up as it leaves the
//! straight sheath ([`push_force`](crate::rod::Clamp::push_force)). F is the derivative of the stored energy with respect
//! to the inserted length.

mod blocked;
mod configuration;
mod guess;
mod hold;
pub(crate) mod mesh;
mod readout;
mod repeat;
mod search;
mod settle;
mod slide;
mod substep;

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::contact::extension::{LEAVE_MM, left_through};
use crate::contact::{FeltWall, KnownPoints, WallMemory};
use crate::device::Device;
use crate::insertion::{Command, StepReport, Surroundings};
use crate::methods::Method;
use crate::rod::Layout;
use crate::shape::Shape;
use crate::solve::Newton;
use crate::{Error, PhysicalEnd, Result};
use configuration::Configuration;
use guess::Guess;
use mesh::MOST_POINTS;
use settle::Settle;
use slide::Extension;
use substep::Attempt;

/// Options of the exact rod.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KirchhoffOptions {
    /// Element length, mm.
    pub element_mm: f64,
    /// Force or moment that an equilibrium leaves at a node, over the largest in the device, its wall and its supports.
    pub tolerance: f64,
    /// Most Newton iterations of one solution; a command may take ten times as many.
    pub max_iterations: usize,
    /// Whether work that cannot change the result is skipped; off only to show that it does not.
    pub skip: bool,
}

impl Default for KirchhoffOptions {
    fn default() -> Self {
        Self { element_mm: 2.0, tolerance: 1e-9, max_iterations: 500, skip: true }
    }
}

/// A residual above this tells nothing of an equilibrium.
const LARGEST_TOLERANCE: f64 = 1e-2;
/// Most elements.
const ELEMENT_LIMIT: f64 = 100_000.0;
/// Retracting to within this of the sheath, mm, is retracting to it.
const ZERO_LENGTH_MM: f64 = 1e-9;
/// Most sub-steps that one command may be cut into, …
const SUBSTEP_LIMIT: usize = 4096;
/// … and the least part of it that one is.
const LEAST_SHARE: f64 = 1e-4;
/// Newton iterations that a command may take in all its sub-steps for every millimetre and every [`WORK_RAD`], those in vain
/// included, before it comes to rest as it can: its cost is bounded.
const WORK: f64 = 180.0;
/// See [`WORK`], rad.
const WORK_RAD: f64 = 0.1;
/// … and never more than so many times what one solution may take.
const WORK_OF_ONE: usize = 10;
/// How often the last resort may find nothing in a command; after that what it comes to is taken whatever is left over.
const RESORTS: usize = 6;
/// A step is a jump if more than this part of the stored energy was set free.
const JUMP: f64 = 0.02;
/// Stored energy below which nothing is called a jump, mJ.
const JUMP_FLOOR_MJ: f64 = 1e-6;

/// The exact rod as an insertion method, with or without material angles.
pub struct Kirchhoff<const C: usize> {
    options: KirchhoffOptions,
    felt: FeltWall,
    newton: Newton<C>,
    current: Configuration,
    /// The sub-step under way.
    next: Configuration,
    /// Where the command began, once its first sub-step is taken.
    before: Configuration,
    guess: Guess,
    settle: Settle<C>,
    extension: Extension,
    memory: WallMemory,
    /// What the points knew where the sub-step under way began, …
    known_now: KnownPoints,
    /// … and where the command did.
    known_before: KnownPoints,
    shape: Shape,
    report: StepReport,
}

impl<const C: usize> Kirchhoff<C> {
    /// The method with nothing inserted.
    ///
    /// # Errors
    /// An element length that is not positive or cuts the device into too many elements.
    pub fn new(options: KirchhoffOptions, surroundings: &Surroundings<'_>) -> Result<Self> {
        let length_mm = surroundings.device.length_mm();
        crate::error::in_range("method.element_mm", options.element_mm, length_mm)?;
        crate::error::in_range("method.tolerance", options.tolerance, LARGEST_TOLERANCE)?;
        if length_mm / options.element_mm > ELEMENT_LIMIT {
            return Err(Error::parameter(
                "method.element_mm",
                options.element_mm,
                format!(
                    "cuts the device of {length_mm} mm into more than {ELEMENT_LIMIT} elements: use longer ones"
                ),
            ));
        }
        if options.max_iterations == 0 {
            return Err(Error::parameter("method.max_iterations", 0, "allow at least one"));
        }
        let friction = surroundings.properties.largest_friction();
        let nothing = Configuration::at(surroundings.sheath, friction);
        let felt = FeltWall::new(surroundings.wall, surroundings.device, surroundings.properties)?;
        let mut method = Self {
            options,
            memory: WallMemory::new(&felt),
            felt,
            newton: Newton::new(1),
            current: nothing.clone(),
            next: nothing.clone(),
            before: nothing,
            guess: Guess::new(surroundings.device.shaped_mm()),
            settle: Settle::default(),
            extension: Extension::default(),
            known_now: KnownPoints::default(),
            known_before: KnownPoints::default(),
            shape: Shape::default(),
            report: StepReport { converged: true, angles: Layout::<C>::TWIST, ..Default::default() },
        };
        method.reserve(surroundings);
        method.write_shape();
        Ok(method)
    }

    /// Goes back to where the command began, if sub-steps have been taken since.
    fn go_back(&mut self, moved: bool) {
        if moved {
            std::mem::swap(&mut self.current, &mut self.before);
        }
        self.memory.restore(&self.known_before);
        self.guess.restore();
    }

    /// Takes memory for the whole device, so that steps take none.
    fn reserve(&mut self, surroundings: &Surroundings<'_>) {
        let device = surroundings.device;
        let modulus = surroundings.properties.modulus_n_per_mm2;
        let (mut elements, mut points) = (0, 0);
        for configuration in [&mut self.current, &mut self.next, &mut self.before] {
            let mesh = &mut configuration.mesh;
            // The first element may have more contact points than any other.
            mesh.build(device, device.length_mm(), self.options.element_mm, modulus);
            (elements, points) = (mesh.elements.len() + 1, mesh.points.len() + MOST_POINTS);
            mesh.reserve(1, MOST_POINTS);
            mesh.clear();
            configuration.state.reserve(elements);
            configuration.friction.reserve(points);
        }
        self.memory.reserve(points);
        self.known_now.reserve(points);
        self.known_before.reserve(points);
        self.report.contacts.reserve(points);
        self.newton.reserve(elements);
        self.guess.reserve(elements);
        self.settle.reserve(elements);
        let nodes = self.current.mesh.from_tip_mm.capacity();
        self.shape.positions_mm.reserve(nodes);
        self.shape.tangents.reserve(nodes);
        self.shape.from_tip_mm.reserve(nodes);
    }
}

impl<const C: usize> Method for Kirchhoff<C> {
    fn step(&mut self, surroundings: &Surroundings<'_>, command: Command) -> Result<()> {
        if command == Command::default() {
            (self.report.iterations, self.report.substeps) = (0, 0);
            (self.report.dissipated_mj, self.report.jumped) = (0.0, false);
            (self.report.relaxations, self.report.slides) = (0, 0);
            return Ok(());
        }
        let tip = self.current.state.positions[self.current.state.elements()];
        if command.advance_mm > 0.0
            && let Some((opening, beyond)) = left_through(surroundings.wall, &tip)
            && beyond + command.advance_mm > LEAVE_MM
        {
            return Err(left(opening, beyond));
        }
        let start = self.report.inserted_mm;
        let target = (start + command.advance_mm).min(surroundings.device.length_mm());
        let target = if target < ZERO_LENGTH_MM { 0.0 } else { target };
        let (rotation, push, torque, energy) = {
            let r = &self.report;
            (r.rotation_rad, r.push_force_n, r.torque_nmm, r.energy.total())
        };
        self.memory.keep(&mut self.known_before);
        self.guess.keep();
        let (mut iterations, mut substeps, mut dissipated_mj) = (0, 0, 0.0);
        let (mut relaxations, mut slides, mut imbalance, mut balanced) = (0, 0, 0.0f64, true);
        let most = self.options.max_iterations;
        let travel = (target - start).abs().max(command.rotate_rad.abs() / WORK_RAD).max(1.0);
        let mut budget = ((WORK * travel) as usize).min(WORK_OF_ONE.saturating_mul(most));
        let mut moved = false;
        // Progress of the command, 0 to 1: advance and turn go together.
        let mut done = 0.0f64;
        let mut share = 1.0f64;
        // Last resorts that found nothing.
        let mut failures = 0;
        let mut failure = Cow::from("the way is too long for one step");
        while done < 1.0 {
            let rest = 1.0 - done;
            // Where the way is lost, the device is let come to rest as far as the command goes; if it does not, in parts; and in the end
            // wherever it is.
            let relax = budget == 0 || share < LEAST_SHARE;
            if relax && (failures == 0 || failures == RESORTS) {
                share = rest;
            }
            let part = rest.min(share);
            let wanted = (target - start) * part;
            let mut blocked = false;
            self.extension = Extension::default();
            if wanted > 0.0 {
                let last = self.current.state.elements();
                let (tip, tangent) = (self.current.state.positions[last], self.current.state.frames[last].t);
                let radius = surroundings.device.section_at(0.0).radius_mm;
                let way = self.extension.trace((&self.felt, &mut self.memory), tip, tangent, radius, wanted);
                blocked = way < (1.0 - 1e-9) * wanted;
            }
            // A rest that is rounding is none.
            let next = if part >= (1.0 - 1e-9) * rest { 1.0 } else { done + part };
            let inserted = if next == 1.0 { target } else { start + (target - start) * next };
            let tail = rotation + command.rotate_rad * next;
            substeps += 1;
            if inserted == 0.0 {
                self.current.withdraw(tail);
                break;
            }
            let resort = if relax { Some(failures == RESORTS) } else { None };
            let attempt = Attempt { inserted_mm: inserted, tail_rad: tail, blocked, resort };
            match self.try_step(surroundings, attempt, &mut budget) {
                Ok(found) => {
                    iterations += found.iterations;
                    relaxations += u32::from(relax);
                    slides += found.slides;
                    if relax {
                        imbalance = imbalance.max(found.residual.max(found.unsettled));
                    }
                    balanced &= found.balanced;
                    dissipated_mj += found.dissipated_mj;
                    let state = &self.next.state;
                    if let Some((opening, beyond)) =
                        left_through(surroundings.wall, &state.positions[state.elements()])
                        && beyond > LEAVE_MM
                    {
                        self.go_back(moved);
                        return Err(left(opening, beyond));
                    }
                    std::mem::swap(&mut self.current, &mut self.next);
                    if !moved {
                        std::mem::swap(&mut self.before, &mut self.next);
                        moved = true;
                    }
                    done = next;
                    share = (2.0 * part).min(1.0);
                }
                Err(reason) => {
                    failure = reason;
                    share = 0.25 * part;
                    if relax {
                        budget = 0;
                        failures += 1;
                    }
                }
            }
            if done < 1.0 && (failures > RESORTS || substeps > SUBSTEP_LIMIT) {
                self.go_back(moved);
                return Err(Error::Computation(format!(
                    "kirchhoff: no equilibrium between {start:.3} and {target:.3} mm inserted: {failure}"
                )));
            }
        }
        // No equilibrium: unless the vessel is too narrow to go on, that is told.
        if !balanced
            && command.advance_mm > 0.0
            && let Some(end) = self.narrowest(surroundings)
        {
            self.go_back(moved);
            return Err(Error::End(end));
        }
        self.report.rotation_rad = rotation + command.rotate_rad;
        self.report.iterations = iterations as u32;
        self.report.substeps = substeps as u32;
        self.report.dissipated_mj = dissipated_mj;
        (self.report.relaxations, self.report.slides, self.report.imbalance) =
            (relaxations, slides, imbalance);
        self.report.converged = balanced;
        self.write_report(surroundings);
        self.write_shape();
        // The least that the hand put in on a way without jumps, and the rod did not keep: along one the force stays between
        // what it is at the ends.
        let least = |before: f64, after: f64, way: f64| (before * way).min(after * way);
        let work = least(push, self.report.push_force_n, target - start)
            + least(torque, self.report.torque_nmm, command.rotate_rad);
        let lost = work - self.report.dissipated_mj - (self.report.energy.total() - energy);
        self.report.jumped = lost > JUMP * energy.max(self.report.energy.total()).max(JUMP_FLOOR_MJ);
        Ok(())
    }

    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn report(&self) -> &StepReport {
        &self.report
    }
}

/// The tip would be farther beyond an opening than anything is known.
fn left(opening: usize, beyond_mm: f64) -> Error {
    Error::End(PhysicalEnd::Left { opening, beyond_mm, limit_mm: LEAVE_MM })
}

/// Least bending stiffness of a device, N·mm².
fn softest(device: &Device) -> f64 {
    device.sections().iter().map(|s| s.bending_stiffness_nmm2).fold(f64::MAX, f64::min)
}

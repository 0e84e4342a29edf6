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
//! straight sheath ([`Clamp::push_force`]). F is the derivative of the stored energy with respect to the inserted length.

pub(crate) mod mesh;
mod slide;

use serde::{Deserialize, Serialize};

use crate::contact::extension::{LEAVE_MM, extended, left_through};
use crate::contact::{Friction, HandMotion, KnownPoint, SmoothWall, WallContact};
use crate::device::Device;
use crate::insertion::{Command, Energy, StepReport, Surroundings};
use crate::methods::Method;
use crate::rod::{Clamp, Frame, Layout, RodState, Supports};
use crate::shape::Shape;
use crate::solve::{Newton, NewtonOptions};
use crate::vessel::{Wall, WallQuery};
use crate::{Error, Result};
use mesh::Mesh;
use slide::{Extension, carry, slide};

/// Options of the exact rod.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KirchhoffOptions {
    /// Element length, mm.
    pub element_mm: f64,
    /// Most Newton iterations of one sub-step.
    pub max_iterations: usize,
    /// Whether work that cannot change the result is skipped; off only to show that it does not.
    pub skip: bool,
}

impl Default for KirchhoffOptions {
    fn default() -> Self {
        Self { element_mm: 2.0, max_iterations: 500, skip: true }
    }
}

/// Most elements.
const ELEMENT_LIMIT: f64 = 100_000.0;
/// Retracting to within this of the sheath, mm, is retracting to it.
const ZERO_LENGTH_MM: f64 = 1e-9;
/// Most sub-steps that one command may be cut into.
const SUBSTEP_LIMIT: usize = 4096;
/// Residual over force scale at which a state is an equilibrium.
const TOLERANCE: f64 = 1e-9;
/// How far beyond its radius and the step a point looks for the wall, mm: what it sees it need not ask for again.
const LOOK_MM: f64 = 3.0;
/// Where the wall is stiffer than this many elements of the rod, EI/h⁴, it is approached from softer walls, …
const SOFTEST: f64 = 30.0;
/// … each solved to this residual.
const LOOSE: f64 = 1e-3;
/// Equilibria that may be found before friction and the forces it follows from have settled.
const RENEWALS: usize = 100;
/// Part of the tip's radius by which a device is pushed on at least, where its tip stands head-on against the wall.
const LEAST_WAY: f64 = 0.05;
/// A step is a jump if more than this part of the stored energy was set free.
const JUMP: f64 = 0.02;
/// Stored energy below which nothing is called a jump, mJ.
const JUMP_FLOOR_MJ: f64 = 1e-6;

/// The exact rod as an insertion method, with or without material angles.
pub struct Kirchhoff<const C: usize> {
    options: KirchhoffOptions,
    /// The vessel as the device feels it, extended beyond its openings.
    smooth: SmoothWall,
    query: WallQuery,
    newton: Newton<C>,
    mesh: Mesh,
    state: RodState,
    friction: Friction,
    next_mesh: Mesh,
    next: RodState,
    /// The other guess at it.
    carried: RodState,
    /// Length from the tip within which the device has a shape of its own, mm.
    shaped_mm: f64,
    next_friction: Friction,
    extension: Extension,
    known: Vec<KnownPoint>,
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
        let sheath = surroundings.sheath;
        let state = RodState {
            frames: vec![Frame::new(sheath.direction, None)],
            angles: vec![0.0],
            positions: vec![sheath.position_mm],
            ..RodState::default()
        };
        let mut mesh = Mesh::default();
        mesh.from_tip_mm.push(0.0);
        let radius_mm = surroundings.device.max_radius_mm();
        let felt = Wall::from_surface(&extended(surroundings.wall, radius_mm))?;
        let mut method = Self {
            options,
            smooth: SmoothWall::new(&felt, surroundings.device.min_radius_mm(), radius_mm),
            query: WallQuery::new(&felt)?,
            newton: Newton::new(1),
            mesh,
            state,
            next_mesh: Mesh::default(),
            friction: Friction::new(surroundings.properties.friction),
            next: RodState::default(),
            carried: RodState::default(),
            shaped_mm: surroundings.device.shaped_mm(),
            next_friction: Friction::new(surroundings.properties.friction),
            extension: Extension::default(),
            known: Vec::new(),
            shape: Shape::default(),
            report: StepReport { converged: true, ..Default::default() },
        };
        method.write_shape();
        Ok(method)
    }

    fn write_shape(&mut self) {
        self.shape.positions_mm.clone_from(&self.state.positions);
        self.shape.tangents.clear();
        self.shape.tangents.extend(self.state.frames.iter().map(|f| f.t));
        self.shape.from_tip_mm.clone_from(&self.mesh.from_tip_mm);
    }

    /// One sub-step: slides and solves on `self.next`; the current state is not touched. Where the tip's way is blocked,
    /// the guess that slides is none: the one that carries the tip's shape must do.
    fn try_step(
        &mut self,
        surroundings: &Surroundings<'_>,
        inserted_mm: f64,
        tail_rad: f64,
        blocked: bool,
    ) -> std::result::Result<(usize, f64), String> {
        let modulus = surroundings.properties.modulus_n_per_mm2;
        self.next_mesh.build(surroundings.device, inserted_mm, self.options.element_mm, modulus);
        slide(&self.mesh, &self.state, &self.extension, &self.next_mesh, &mut self.next);
        let hand = HandMotion {
            from_mm: self.mesh.from_tip_mm[0],
            to_mm: inserted_mm,
            turn_rad: tail_rad - self.state.angles[0],
        };
        self.next_friction.begin(
            &self.next_mesh.elements,
            &self.next,
            &self.next_mesh.points,
            (&self.mesh.points, &self.friction),
            hand,
        );
        self.next.angles[0] = tail_rad;
        let elements = self.next_mesh.elements.len();
        self.newton.resize(elements);
        let travel = (inserted_mm - self.mesh.from_tip_mm[0]).abs();
        let reach = surroundings.device.max_radius_mm() + travel + LOOK_MM;
        let mut contact = WallContact::new(
            &self.smooth,
            &self.query,
            &self.next_mesh.points,
            &mut self.known,
            &mut self.next_friction,
            softest(surroundings.device),
            reach,
            self.options.skip,
        );
        let mut outside = contact.is_outside(&self.next_mesh.elements, &self.next);
        if self.shaped_mm > 0.0 {
            self.carried.clone_from(&self.next);
            self.carried.angles[0] = tail_rad;
            carry(
                (&self.mesh, &self.state),
                &self.next_mesh,
                self.shaped_mm,
                hand.turn_rad,
                &mut self.carried,
            );
            let elements = &self.next_mesh.elements;
            if !contact.is_outside(elements, &self.carried)
                && (outside
                    || blocked
                    || self.newton.energy_at(elements, &mut contact, &self.carried)
                        < self.newton.energy_at(elements, &mut contact, &self.next))
            {
                std::mem::swap(&mut self.next, &mut self.carried);
                outside = false;
            } else {
                outside |= blocked;
            }
        }
        if outside {
            return Err("the slid rod is beyond the wall".to_owned());
        }
        let mut supports = Supports { start_tangent: true, start_angle: true, ..Supports::default() };
        // A wall much stiffer than an element of the rod is approached by softer ones, ten times stiffer each.
        let data = &self.next_mesh.elements[elements - 1];
        let element_stiffness = data.bending[2] / self.options.element_mm.powi(4);
        let mut softness = (SOFTEST * element_stiffness / modulus).min(1.0);
        let mut iterations = 0;
        let mut renewals = 0;
        let found = loop {
            contact.softness = softness;
            let options = NewtonOptions {
                max_iterations: self.options.max_iterations,
                tolerance: if softness < 1.0 { LOOSE } else { TOLERANCE },
                ..NewtonOptions::default()
            };
            let found = self.newton.solve(
                &self.next_mesh.elements,
                &mut supports,
                &mut contact,
                &mut self.next,
                &options,
            );
            iterations += found.iterations;
            if !found.converged {
                break found;
            }
            if softness < 1.0 {
                softness = (10.0 * softness).min(1.0);
                continue;
            }
            if surroundings.properties.friction == 0.0 || contact.friction_settled() {
                break found;
            }
            renewals += 1;
            if renewals > RENEWALS {
                return Err("friction and wall forces do not settle".to_owned());
            }
        };
        self.report.counters.add(&contact.counters);
        if !found.converged {
            return Err(format!("{} (residual {:.1e})", found.reason, found.residual));
        }
        Ok((
            iterations,
            self.next_friction.dissipated_mj(&self.next_mesh.elements, &self.next, &self.next_mesh.points),
        ))
    }

    /// Takes over the solved sub-step.
    fn accept(&mut self) {
        std::mem::swap(&mut self.mesh, &mut self.next_mesh);
        std::mem::swap(&mut self.state, &mut self.next);
        std::mem::swap(&mut self.friction, &mut self.next_friction);
    }

    /// Goes back to where a command began.
    fn restore(&mut self, saved: (Mesh, RodState, Friction), report: StepReport) {
        (self.mesh, self.state, self.friction) = saved;
        self.report = report;
    }

    /// Read-outs at the current state.
    fn write_report(&mut self, surroundings: &Surroundings<'_>) {
        let report = &mut self.report;
        report.contacts.clear();
        report.max_penetration_mm = 0.0;
        report.inserted_mm = self.mesh.from_tip_mm[0];
        report.tip_rotation_rad = report.rotation_rad;
        let tip = self.state.positions[self.state.elements()];
        report.left_through = left_through(surroundings.wall, &tip).map(|(opening, _)| opening);
        if self.mesh.elements.is_empty() {
            report.energy = Energy::default();
            (report.push_force_n, report.torque_nmm) = (0.0, 0.0);
            return;
        }
        let reach = surroundings.device.max_radius_mm() + LOOK_MM;
        let mut contact = WallContact::new(
            &self.smooth,
            &self.query,
            &self.mesh.points,
            &mut self.known,
            &mut self.friction,
            softest(surroundings.device),
            reach,
            self.options.skip,
        );
        let stored = self.newton.assembly.energy;
        report.energy = Energy { bend: stored.bend, twist: stored.twist, wall: 0.0 };
        for index in 0..self.mesh.points.len() {
            let Some(touch) = contact.touch(&self.mesh.elements, &self.state, index) else { continue };
            report.energy.wall += touch.energy_mj;
            report.max_penetration_mm = report.max_penetration_mm.max(touch.contact.penetration_mm);
            report.contacts.push(touch.contact);
        }

        let clamp = Clamp::new::<C>(&self.newton.start_residual, &self.state);
        let frame = self.state.material_frame(0);
        let data = &self.mesh.elements[0];
        let rest = frame.u * data.rest_curvature[0][0] + frame.v * data.rest_curvature[0][1];
        report.push_force_n = clamp.push_force(&frame.t, data.bending[0], data.torsion[0], &rest);
        report.torque_nmm = clamp.torque;
        if Layout::<C>::TWIST {
            report.tip_rotation_rad += self.state.twist();
        }
    }
}

impl<const C: usize> Method for Kirchhoff<C> {
    fn step(&mut self, surroundings: &Surroundings<'_>, command: Command) -> Result<()> {
        let tip = self.state.positions[self.state.elements()];
        if command.advance_mm > 0.0
            && let Some((opening, beyond)) = left_through(surroundings.wall, &tip)
            && beyond + command.advance_mm > LEAVE_MM
        {
            return Err(left(opening, beyond));
        }
        let start = self.report.inserted_mm;
        let target = (start + command.advance_mm).min(surroundings.device.length_mm());
        let target = if target < ZERO_LENGTH_MM { 0.0 } else { target };
        let before = self.report.clone();
        self.report.iterations = 0;
        self.report.substeps = 0;
        self.report.dissipated_mj = 0.0;
        self.report.jumped = false;
        let saved = (self.mesh.clone(), self.state.clone(), self.friction.clone());
        // Progress of the command, 0 to 1: advance and turn go together.
        let mut done = 0.0f64;
        let mut share = 1.0f64;
        let mut failure = String::new();
        let mut may_carry = self.shaped_mm > 0.0;
        while done < 1.0 {
            let rest = 1.0 - done;
            let mut part = rest.min(share);
            let wanted = (target - start) * part;
            let mut blocked = false;
            if wanted > 0.0 {
                let last = self.state.elements();
                let (tip, tangent) = (self.state.positions[last], self.state.frames[last].t);
                let radius = surroundings.device.section_at(0.0).radius_mm;
                let way = self.extension.trace((&self.smooth, &self.query), tip, tangent, radius, wanted);
                blocked = may_carry && way < (1.0 - 1e-9) * wanted;
                if !blocked {
                    part *= (way.max(LEAST_WAY * radius) / wanted).min(1.0);
                }
            }
            // A rest that is rounding is none.
            let next = if part >= (1.0 - 1e-9) * rest { 1.0 } else { done + part };
            let inserted = if next == 1.0 { target } else { start + (target - start) * next };
            let tail = before.rotation_rad + command.rotate_rad * next;
            self.report.substeps += 1;
            if inserted == 0.0 {
                self.state.frames.truncate(1);
                self.state.positions.truncate(1);
                self.state.angles.truncate(1);
                for list in
                    [&mut self.state.tensions, &mut self.state.bubbles, &mut self.state.reference_twists]
                {
                    list.clear();
                }
                self.state.chords.clear();
                self.mesh = Mesh { from_tip_mm: vec![0.0], ..Mesh::default() };
                done = next;
                continue;
            }
            match self.try_step(surroundings, inserted, tail, blocked) {
                Ok((iterations, dissipated_mj)) => {
                    self.report.iterations += iterations as u32;
                    self.report.dissipated_mj += dissipated_mj;
                    let tip = self.next.positions[self.next.elements()];
                    if let Some((opening, beyond)) = left_through(surroundings.wall, &tip)
                        && beyond > LEAVE_MM
                    {
                        self.restore(saved, before);
                        return Err(left(opening, beyond));
                    }
                    self.accept();
                    done = next;
                    share = (2.0 * part).min(1.0);
                    may_carry = self.shaped_mm > 0.0;
                }
                Err(reason) => {
                    failure = reason;
                    share = if blocked { part } else { 0.25 * part };
                    may_carry = false;
                }
            }
            if share < 1e-7 || self.report.substeps as usize > SUBSTEP_LIMIT {
                self.restore(saved, before);
                return Err(Error::Computation(format!(
                    "kirchhoff: no equilibrium between {start:.3} and {target:.3} mm inserted: {failure}"
                )));
            }
        }
        self.report.rotation_rad = before.rotation_rad + command.rotate_rad;
        self.report.converged = true;
        self.write_report(surroundings);
        self.write_shape();
        // What the hand put in and the rod did not keep.
        // At the least: forces lie between those of the step's ends, unless it jumps.
        let least = |first: f64, last: f64, by: f64| (first * by).min(last * by);
        let work = least(before.push_force_n, self.report.push_force_n, target - start)
            + least(before.torque_nmm, self.report.torque_nmm, command.rotate_rad);
        let lost = work - self.report.dissipated_mj - (self.report.energy.total() - before.energy.total());
        self.report.jumped =
            lost > JUMP * before.energy.total().max(self.report.energy.total()).max(JUMP_FLOOR_MJ);
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
    Error::Computation(format!(
        "the tip has left the vessel through opening {opening} by {beyond_mm:.1} mm, and beyond {LEAVE_MM} mm nothing is \
         known: stop the script earlier or use a vessel that goes on"
    ))
}

/// Least bending stiffness of a device, N·mm².
fn softest(device: &Device) -> f64 {
    device.sections().iter().map(|s| s.bending_stiffness_nmm2).fold(f64::MAX, f64::min)
}

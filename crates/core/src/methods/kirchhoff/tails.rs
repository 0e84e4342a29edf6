//! The tails of all instruments in a part of a command: what they do to the rod in the body and to the hands. For one tail
//! see [`super::tail`].

use super::Environment;
use super::hands::{Hand, HandForce, ROUNDED_MM};
use super::state::KirchhoffState;
use super::tail::{Grip, LEAST, Place, Tail, Twist};
use crate::Vec3;
use crate::device::Stack;
use crate::methods::Sheath;
use crate::rod::{ElementData, MAX_ANGLES, RodState, Stencils};
use crate::solve::External;

/// The tails of all instruments in a part of a command.
#[derive(Debug, Clone, Default)]
pub(super) struct Tails {
    each: Vec<Tail>,
}

impl Tails {
    /// Begins a part from the state `start` to these positions of the hands.
    pub(super) fn begin(
        &mut self,
        environment: &Environment<'_>,
        (start, hands): (&KirchhoffState, &[Hand]),
    ) {
        let (options, surroundings) = (environment.options, &environment.surroundings);
        let grip_radii = options.tuning.friction.grip_radii;
        let place = Place { surroundings, start, hands, grip_radii, least_mm: LEAST * options.element_mm };
        self.each.clear();
        self.each.extend((0..hands.len()).map(|k| Tail::new(&place, k)));
    }

    /// Angle, rad, that the material of an instrument at this distance from its tip had before the part, in its tail.
    pub(super) fn angle_before(&self, stack: &Stack, instrument: usize, from_tip_mm: f64) -> f64 {
        let tail = &self.each[instrument];
        let (twist, inserted_mm) = &tail.before;
        match *inserted_mm > 0.0 {
            true => twist.angle_rad(&stack.instruments()[instrument].device, *inserted_mm, from_tip_mm),
            false => tail.hand_rad,
        }
    }

    /// Sets of angles that are held at the mouth: those of instruments that are not inserted.
    pub(super) fn held(&self) -> [bool; MAX_ANGLES] {
        let mut held = [true; MAX_ANGLES];
        self.turning().for_each(|(set, _)| held[set] = false);
        held
    }

    /// The tails, of each instrument one.
    pub(super) fn each(&self) -> &[Tail] {
        &self.each
    }

    /// Whether any of them acts on the rod.
    pub(super) fn act(&self) -> bool {
        self.turning().next().is_some()
    }

    /// The tails that act on a set of angles.
    fn turning(&self) -> impl Iterator<Item = (usize, &Tail)> {
        self.each.iter().filter_map(|tail| Some((tail.set?, tail)))
    }

    /// Torque of all tails on the rod, N·mm.
    pub(super) fn body_nmm(&self, rod: &RodState) -> f64 {
        self.turning().map(|(_, tail)| tail.on(rod).body_nmm).sum()
    }

    /// Writes twists of the tails, and what they add to the forces of the hands: torques, the twist that comes in, and friction at
    /// the grips along the line, with this force across it at the mouth, N. Returns the stored energy, mJ, and what friction took.
    pub(super) fn write(
        &self,
        (sheath, across_n): (&Sheath, f64),
        rod: &RodState,
        twists: &mut Vec<Twist>,
        forces: &mut [HandForce],
    ) -> (f64, GripFriction) {
        twists.clear();
        let (mut stored_mj, mut dissipated) = (0.0, GripFriction::default());
        for (k, tail) in self.each.iter().enumerate() {
            dissipated.around_mj = dissipated.around_mj.map(|mj| mj + tail.let_go_mj);
            if !tail.is_in {
                twists.push(Twist::relaxed(tail.hand_rad));
                dissipated.along_mj += tail.friction_n * tail.advance_mm.abs();
                continue;
            }
            let turned = tail.on(rod);
            twists.push(tail.twist(rod, &turned));
            stored_mj += turned.stored_mj;
            forces[k].torque_nmm += turned.hand_nmm;
            forces[k].push_n += 0.5 * turned.body_nmm * turned.body_nmm / tail.torsion_nmm2;
            if let Grip::Valve(outer) = tail.grip {
                forces[outer].torque_nmm -= turned.hand_nmm - turned.body_nmm;
            }
            let slip_mm = libm::hypot(tail.advance_mm, tail.radius_mm * turned.slip_rad);
            if slip_mm <= ROUNDED_MM {
                continue;
            }
            let friction_n = match tail.grip {
                Grip::Sheath => sheath.friction_n + sheath.friction * across_n,
                _ => tail.friction_n,
            };
            let along_n = friction_n * tail.advance_mm / slip_mm;
            forces[k].outside_n += along_n;
            if let Grip::Valve(outer) = tail.grip {
                forces[outer].outside_n -= along_n;
            }
            dissipated.along_mj += along_n * tail.advance_mm;
            let around_mj = tail.around_mj(&turned);
            dissipated.around_mj = [0, 1].map(|k| dissipated.around_mj[k] + around_mj[k]);
        }
        (stored_mj, dissipated)
    }
}

/// Energy dissipated by friction outside the body, mJ.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct GripFriction {
    /// Against advance: hands do it at once, beside what they do on the device.
    pub(super) along_mj: f64,
    /// Against turning, of what hands do by their torque, at least and at most.
    pub(super) around_mj: [f64; 2],
}

impl External for Tails {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        for (set, tail) in self.turning() {
            let turned = tail.at(Some(state.angle(0, set)));
            into.add_value(tail.energy_mj(&turned));
            let spin = (-turned.body_nmm, turned.stiffness_nmm);
            into.add_spin(state, &elements[0], (0, 0.0, set), &Vec3::zeros(), spin);
        }
    }

    fn value(&mut self, _elements: &[ElementData], state: &RodState) -> f64 {
        self.turning().map(|(set, tail)| tail.energy_mj(&tail.at(Some(state.angle(0, set))))).sum()
    }
}

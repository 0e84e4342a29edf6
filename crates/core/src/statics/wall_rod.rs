//! A rod in equilibrium with walls and loads, without an insertion.

use nalgebra::Matrix3;

use super::Loads;
use crate::contact::{
    ContactCache, ContactPoint, ContactSurface, Friction, HandMotion, Touch, WallContact, WallProperties,
};
use crate::device::Device;
use crate::methods::kirchhoff::{Fineness, Mesh};
use crate::rod::{Clamp, ElementData, Frame, PLAIN, RodState, Stencils, Supports, element_energy};
use crate::solve::{Contacts, External, Newton, NewtonOptions, Sizes};
use crate::vessel::{NoStore, Wall};
use crate::{Error, Result, Vec3};

/// What a [`WallRod`] is.
#[derive(Debug, Clone, Copy)]
pub struct WallRodSpec {
    /// Length of the rod.
    pub length: f64,
    /// Its bending stiffness.
    pub bending: f64,
    /// Its radius.
    pub radius: f64,
    /// Elements.
    pub elements: usize,
    /// Foundation modulus of the walls.
    pub modulus: f64,
}

/// An untwisted rod, clamped at its start, among walls.
pub struct WallRod {
    surface: ContactSurface,
    setup: WallRodSpec,
    mesh: Mesh,
    cache: ContactCache,
    friction: Friction,
    newton: Newton<PLAIN>,
    /// Stiffness at a node of two plates without clearance along the plane z = 0, between which the rod lies.
    pub plates: f64,
    /// Residual, relative to the force scale, at which a state is an equilibrium.
    pub tolerance: f64,
    /// Loads on the nodes.
    pub loads: Loads,
    /// Supports of the ends.
    pub supports: Supports,
    /// State of the rod.
    pub state: RodState,
}

/// The walls, the plates and the loads as one energy.
struct Outside<'a> {
    contact: WallContact<'a>,
    loads: &'a mut Loads,
    plates: f64,
}

impl External for Outside<'_> {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        self.loads.linearise(elements, state, into);
        self.contact.linearise(elements, state, into);
        if self.plates == 0.0 {
            return;
        }
        for (i, x) in state.positions.iter().enumerate() {
            let force = Vec3::z() * (self.plates * x.z);
            into.add_value(0.5 * force.z * x.z);
            into.add_node(i, &force, &(Matrix3::from_diagonal(&Vec3::z()) * self.plates));
        }
    }

    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        let off: f64 = state.positions.iter().map(|x| x.z * x.z).sum();
        0.5 * self.plates * off + self.contact.value(elements, state) + self.loads.value(elements, state)
    }

    fn safe_fraction(&mut self, elements: &[ElementData], to: &RodState) -> f64 {
        self.contact.safe_fraction(elements, to)
    }

    fn sizes(&self) -> Sizes {
        Sizes { rounding_n: self.contact.sizes().rounding_n, ..self.loads.sizes() }
    }

    fn visit_contacts(&mut self, ask: &mut dyn FnMut(&mut dyn Contacts)) {
        self.contact.visit_contacts(ask);
    }
}

impl WallRod {
    /// A rod from `start` on with the node tangents given by `tangents` as a function of arc length.
    ///
    /// # Errors
    /// Numbers that are none of a rod, and walls that cannot be felt.
    pub fn new(
        wall: &Wall,
        setup: &WallRodSpec,
        start: Vec3,
        tangents: impl Fn(f64) -> Frame,
    ) -> Result<Self> {
        let properties = WallProperties { modulus_n_per_mm2: setup.modulus, ..WallProperties::default() };
        Self::on_wall(wall, &properties, setup, start, tangents)
    }

    /// The same with regions of the wall.
    ///
    /// # Errors
    /// See [`WallRod::new`].
    pub fn on_wall(
        wall: &Wall,
        properties: &WallProperties,
        setup: &WallRodSpec,
        start: Vec3,
        tangents: impl Fn(f64) -> Frame,
    ) -> Result<Self> {
        let WallRodSpec { length, bending, radius, elements, modulus } = *setup;
        let device = Device::uniform(length, radius, bending)?;
        let mut mesh = Mesh::default();
        mesh.build(&device, length, Fineness::of_elements(length / elements as f64), modulus);
        let frames = mesh.from_tip_mm.iter().map(|from_tip| tangents(length - from_tip)).collect();
        let surface = ContactSurface::new(wall, (radius, radius), properties, &NoStore)?;
        Ok(Self {
            cache: ContactCache::new(&surface),
            surface,
            setup: *setup,
            friction: Friction::default(),
            newton: Newton::new(mesh.elements.len()),
            plates: 0.0,
            tolerance: NewtonOptions::default().tolerance,
            loads: Loads::default(),
            supports: Supports { start_tangent: true, start_angles: [true; 3], ..Supports::default() },
            state: RodState::from_frames(&mesh.elements, start, frames),
            mesh,
        })
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.mesh.elements.len()
    }

    /// Length of an element.
    pub fn element_length(&self, element: usize) -> f64 {
        self.mesh.elements[element].length
    }

    /// Bending energy of an element in the current state.
    pub fn bending_energy(&self, element: usize) -> f64 {
        element_energy::<PLAIN>(&self.mesh.elements[element], &self.state.element::<PLAIN>(element)).bend
    }

    /// Lays the rod anew: from `start` on, with the frames of its nodes.
    pub fn lay(&mut self, start: Vec3, frames: Vec<Frame>) {
        self.state = RodState::from_frames(&self.mesh.elements, start, frames);
    }

    /// Runs `job` with Newton's method and all external energies.
    fn with<T>(
        &mut self,
        job: impl FnOnce(&mut Newton<PLAIN>, &[ElementData], &mut Supports, &mut Outside<'_>, &mut RodState) -> T,
    ) -> T {
        let (points, bending) = (&self.mesh.points, self.setup.bending);
        let contact = WallContact::new(&self.surface, points, &mut self.cache, &mut self.friction, bending);
        let mut outside = Outside { contact, loads: &mut self.loads, plates: self.plates };
        job(&mut self.newton, &self.mesh.elements, &mut self.supports, &mut outside, &mut self.state)
    }

    /// Moves the rod to a minimum of the energy, with friction to where Coulomb's law holds.
    ///
    /// # Errors
    /// No equilibrium.
    pub fn solve(&mut self) -> Result<()> {
        let options = NewtonOptions { tolerance: self.tolerance, ..NewtonOptions::default() };
        self.with(|newton, elements, supports, outside, state| {
            let found = newton.solve(elements, supports, outside, state, &options);
            if found.converged {
                return Ok(());
            }
            Err(Error::Computation(format!("{} (residual {:.1e})", found.reason, found.residual)))
        })
    }

    /// The rod has slid along its own curve by `advance` to its current position, and moves on to equilibrium with
    /// friction and loads.
    ///
    /// # Errors
    /// No equilibrium.
    pub fn slide(&mut self, coefficient: f64, advance: f64) -> Result<()> {
        let length = self.setup.length;
        let hands = [HandMotion { from_mm: length, to_mm: length + advance, turn_rad: 0.0, steer: 0.0 }];
        self.friction = Friction::new(coefficient);
        let nothing = (&[][..], &[][..]);
        self.friction.begin(&self.mesh.elements, &self.state, &self.mesh.points, nothing, &hands);
        self.solve()
    }

    /// Whether the current state, assumed to be an equilibrium, is a minimum.
    fn is_stable(&mut self) -> bool {
        self.with(|newton, elements, supports, outside, state| {
            newton.assemble(elements, supports, outside, state);
            let minimum = elements.len() + supports.conditions();
            newton.factor(elements, supports).is_some_and(|inertia| inertia.negative == minimum)
        })
    }

    /// The axial load up to `most` at which the current rod, straight and so an equilibrium under every load, is no
    /// longer a minimum.
    pub fn buckling_load(&mut self, most: f64) -> f64 {
        let (mut low, mut high) = (0.0, most);
        for _ in 0..40 {
            let load = 0.5 * (low + high);
            self.state.tensions.fill(-load);
            if self.is_stable() { low = load } else { high = load }
        }
        low
    }

    /// Reaction of the clamp at the start, at the state solved last.
    pub fn clamp(&self) -> Clamp {
        Clamp::new::<PLAIN>(&self.newton.start_residual, &self.state)
    }

    /// Contacts with the wall, with their arc lengths from the start.
    pub fn touches(&mut self) -> Vec<(f64, Touch)> {
        let (length, points) = (self.setup.length, self.mesh.points.clone());
        self.with(|_, elements, _, outside, state| {
            let touch = |(index, point): (usize, &ContactPoint)| {
                let touch = outside.contact.touch(elements, state, index)?;
                Some((length - point.from_tip_mm, touch))
            };
            points.iter().enumerate().filter_map(touch).collect()
        })
    }
}

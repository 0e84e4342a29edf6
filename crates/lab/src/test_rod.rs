//! A rod in equilibrium with walls and loads, without an insertion: the test bench of the contact cases.

use endowire_core::contact::Touch;
use endowire_core::contact::{ContactCache, ContactSurface, Friction, HandMotion, WallContact};
use endowire_core::device::Device;
use endowire_core::insertion::WallProperties;
use endowire_core::methods::kirchhoff::{Fineness, Mesh};
use endowire_core::rod::{Clamp, ElementData, PLAIN, RodState, Stencils, Supports};
use endowire_core::solve::{Contacts, External, Newton, NewtonOptions, Sizes};
use endowire_core::statics::Loads;
use endowire_core::vessel::{NoStore, Wall};
use endowire_core::{Error, Result, Vec3};
use nalgebra::Matrix3;

/// Parameters of the bench.
#[derive(Debug, Clone, Copy)]
pub(super) struct Setup {
    /// Length of the rod.
    pub(super) length: f64,
    /// Its bending stiffness.
    pub(super) bending: f64,
    /// Its radius.
    pub(super) radius: f64,
    /// Elements.
    pub(super) elements: usize,
    /// Foundation modulus of the walls.
    pub(super) modulus: f64,
}

/// An untwisted rod, clamped at its start, among walls.
pub(super) struct TestRod {
    surface: ContactSurface,
    setup: Setup,
    mesh: Mesh,
    cache: ContactCache,
    friction: Friction,
    newton: Newton<PLAIN>,
    /// Stiffness at a node of two plates without clearance along the plane z = 0, between which the rod lies.
    pub(super) plates: f64,
    /// Residual, relative to the force scale, at which a state is an equilibrium.
    pub(super) tolerance: f64,
    /// Loads on the nodes.
    pub(super) loads: Loads,
    /// Supports of the ends.
    pub(super) supports: Supports,
    /// State of the rod.
    pub(super) state: RodState,
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

impl TestRod {
    /// A rod from `start` on with the node tangents given by `tangents` as a function of arc length.
    pub(super) fn new(
        wall: &Wall,
        setup: &Setup,
        start: Vec3,
        tangents: impl Fn(f64) -> endowire_core::rod::Frame,
    ) -> Result<Self> {
        let properties = WallProperties { modulus_n_per_mm2: setup.modulus, ..WallProperties::default() };
        Self::on_wall(wall, &properties, setup, start, tangents)
    }

    /// The same with regions of the wall.
    pub(super) fn on_wall(
        wall: &Wall,
        properties: &WallProperties,
        setup: &Setup,
        start: Vec3,
        tangents: impl Fn(f64) -> endowire_core::rod::Frame,
    ) -> Result<Self> {
        let Setup { length, bending, radius, elements, modulus } = *setup;
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

    /// Elements of the rod.
    pub(super) fn elements(&self) -> &[ElementData] {
        &self.mesh.elements
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
    pub(super) fn solve(&mut self) -> Result<()> {
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
    pub(super) fn slide(&mut self, coefficient: f64, advance: f64) -> Result<()> {
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
    pub(super) fn buckling_load(&mut self, most: f64) -> f64 {
        let (mut low, mut high) = (0.0, most);
        for _ in 0..40 {
            let load = 0.5 * (low + high);
            self.state.tensions.fill(-load);
            if self.is_stable() { low = load } else { high = load }
        }
        low
    }

    /// Reaction of the clamp at the start, at the state solved last.
    pub(super) fn clamp(&self) -> Clamp {
        Clamp::new::<PLAIN>(&self.newton.start_residual, &self.state)
    }

    /// Contacts with the wall, with their arc lengths from the start.
    pub(super) fn touches(&mut self) -> Vec<(f64, Touch)> {
        let (length, points) = (self.setup.length, self.mesh.points.clone());
        self.with(|_, elements, _, outside, state| {
            let touch = |(index, point): (usize, &endowire_core::contact::ContactPoint)| {
                let touch = outside.contact.touch(elements, state, index)?;
                Some((length - point.from_tip_mm, touch))
            };
            points.iter().enumerate().filter_map(touch).collect()
        })
    }
}

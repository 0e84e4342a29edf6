//! Any of the methods as an insertion: implements the core's trait `Method`.

use std::sync::Arc;

use endowire_core::contact::ContactSurface;
use endowire_core::contact::extension::left_through;
use endowire_core::error::in_range;
use endowire_core::insertion::{Command, Energy, StepReport, Surroundings, nodes_from_tip};
use endowire_core::methods::{Content, Method, MethodChoice, NodesState, State, check_inserted};
use endowire_core::shape::Shape;
use endowire_core::vessel::WallStore;
use endowire_core::{Error, Result, Vec3};
use nalgebra::Rotation3;

use crate::beam_fem::smallest_rotation;
use crate::wall_load::WallLoad;
use crate::{Chain, Outcome, Posture, RodModel, Strain};

/// Discretisation and tolerance of an insertion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InsertionOptions {
    /// Length of a segment, mm.
    pub element_mm: f64,
    /// Total force that may be out of balance, in units of EI/L².
    pub tolerance: f64,
}

impl Default for InsertionOptions {
    fn default() -> Self {
        Self { element_mm: 2.0, tolerance: 1e-2 }
    }
}

/// A model with its insertion options: the choice from which a simulation starts.
#[derive(Debug, Clone)]
pub struct Inserted {
    model: Arc<dyn RodModel>,
    options: InsertionOptions,
}

impl Inserted {
    /// A model with given parameters.
    pub fn new(model: Arc<dyn RodModel>, options: InsertionOptions) -> Self {
        Self { model, options }
    }
}

impl MethodChoice for Inserted {
    fn name(&self) -> &'static str {
        self.model.name()
    }

    fn start(&self, surroundings: &Surroundings<'_>, store: &dyn WallStore) -> Result<Box<dyn Method>> {
        Ok(Box::new(Insertion::new(Arc::clone(&self.model), self.options, surroundings, store)?))
    }
}

/// Largest number of segments.
const SEGMENT_LIMIT: f64 = 100_000.0;
/// Retracting to within this distance of the sheath, mm, counts as retracting completely.
const ZERO_LENGTH_MM: f64 = 1e-9;
/// Largest part of a command, in radii: a tip that is pushed straight ahead must touch the wall with its surface.
const PART_RADII: f64 = 2.0;

/// A running insertion. Nodes are marks on the device, as in the core's methods.
#[derive(Clone)]
pub struct Insertion {
    model: Arc<dyn RodModel>,
    options: InsertionOptions,
    wall: Arc<ContactSurface>,
    progress: Progress,
    shape: Shape,
    report: StepReport,
}

/// Progress of an insertion. The chain follows from the arc lengths and the rotation.
#[derive(Clone)]
struct Progress {
    chain: Chain,
    posture: Posture,
    from_tip_mm: Vec<f64>,
}

impl Insertion {
    /// The method with nothing inserted; the uniform mesh of the wall comes from `store`.
    ///
    /// # Errors
    /// A device that the method rejects, or options out of range.
    pub fn new(
        model: Arc<dyn RodModel>,
        options: InsertionOptions,
        surroundings: &Surroundings<'_>,
        store: &dyn WallStore,
    ) -> Result<Self> {
        model.check(surroundings.device)?;
        surroundings.properties.refuse_regions(model.name())?;
        surroundings.refuse_motion(model.name())?;
        surroundings.sheath.refuse_friction(model.name())?;
        let friction = surroundings.properties.friction;
        if friction != 0.0 {
            return Err(Error::parameter(
                "vessel.wall.friction",
                friction,
                format!("{} has no friction here: set it to 0 or use another method", model.name()),
            ));
        }
        let length_mm = surroundings.device.length_mm();
        in_range("method.element_mm", options.element_mm, length_mm)?;
        in_range("method.tolerance", options.tolerance, 1.0)?;
        if length_mm / options.element_mm > SEGMENT_LIMIT {
            return Err(Error::parameter(
                "method.element_mm",
                options.element_mm,
                format!("cuts the device into more than {SEGMENT_LIMIT} segments: use longer ones"),
            ));
        }
        let sheath = surroundings.sheath;
        let chain = Chain {
            start_mm: sheath.position_mm,
            direction: sheath.direction,
            bends_towards: sheath.bends_towards,
            ..Chain::default()
        };
        let progress = Progress { posture: chain.straight(), chain, from_tip_mm: vec![0.0] };
        let Surroundings { lumen, stack, properties, .. } = surroundings;
        let wall = ContactSurface::of(lumen, stack.radii_mm(), properties, store)?;
        let mut insertion = Self {
            model,
            options,
            wall: Arc::new(wall),
            progress,
            shape: Shape::default(),
            report: StepReport { converged: true, ..StepReport::default() },
        };
        insertion.write_shape();
        Ok(insertion)
    }

    /// One part of a command from `progress`: the chain slides along its own curve and relaxes.
    fn part(
        &self,
        surroundings: &Surroundings<'_>,
        progress: &mut Progress,
        inserted_mm: f64,
    ) -> Result<Outcome> {
        let mut from_tip_mm = Vec::new();
        nodes_from_tip(inserted_mm, self.options.element_mm, &mut from_tip_mm);
        let mut posture = progress.slid(&from_tip_mm);
        progress.fill_chain(surroundings, &from_tip_mm);
        let mut load = WallLoad::new(&self.wall, surroundings, &from_tip_mm);
        let outcome = self.model.relax(&progress.chain, &mut load, &mut posture, self.options.tolerance);
        if !posture.is_finite() {
            return Err(Error::Computation(format!(
                "{}: diverged at {inserted_mm:.3} mm inserted: use longer segments or a softer wall",
                self.model.name()
            )));
        }
        (progress.posture, progress.from_tip_mm) = (posture, from_tip_mm);
        Ok(outcome)
    }

    fn write_shape(&mut self) {
        let Progress { chain, posture, from_tip_mm } = &self.progress;
        self.shape.positions_mm.clone_from(&posture.positions_mm);
        self.shape.tangents = tangents(chain, posture);
        self.shape.from_tip_mm.clone_from(from_tip_mm);
    }

    fn write_report(&mut self, surroundings: &Surroundings<'_>) {
        let Progress { chain, posture, from_tip_mm } = &self.progress;
        let report = &mut self.report;
        report.inserted_mm = from_tip_mm[0];
        let line = posture.positions_mm.iter().copied();
        report.left_through =
            left_through(surroundings.lumen.openings(), line).map(|(opening, _)| opening.index);
        let mut load = WallLoad::new(&self.wall, surroundings, from_tip_mm);
        let wall = load.contacts(&posture.positions_mm, &mut report.contacts);
        let Strain { bend_mj, twist_mj, twist_rad } = self.model.strain(chain, posture);
        report.energy = Energy { bend: bend_mj, twist: twist_mj, wall, ..Energy::default() };
        report.mouth_rotation_rad = report.rotation_rad;
        report.tip_rotation_rad = report.rotation_rad + twist_rad;
        report.max_penetration_mm = report.contacts.iter().map(|c| c.penetration_mm).fold(0.0, f64::max);
        report.push_force_n = 0.0;
        if chain.segments() > 0 {
            let held: Vec3 = report.contacts.iter().map(|c| c.normal * c.force_n).sum();
            let (t, d) = (chain.direction, posture.chord(0).normalize());
            // EI times the curvature, that at rest included: the first joint is half a segment.
            let moment = chain.joint_stiffness(0) * t.cross(&d).norm().atan2(t.dot(&d));
            report.push_force_n = -held.dot(&t) - 0.5 * moment * moment / chain.bending_nmm2[0];
        }
    }
}

impl Progress {
    fn fill_chain(&mut self, surroundings: &Surroundings<'_>, from_tip_mm: &[f64]) {
        let chain = &mut self.chain;
        chain.lengths_mm.clear();
        chain.bending_nmm2.clear();
        chain.torsion_nmm2.clear();
        chain.rest_curvature_per_mm.clear();
        for ends in from_tip_mm.windows(2) {
            let section = surroundings.device.section_at(0.5 * (ends[0] + ends[1]));
            chain.lengths_mm.push(ends[0] - ends[1]);
            chain.bending_nmm2.push(section.bending_stiffness_nmm2);
            chain.torsion_nmm2.push(section.torsion_nmm2());
            chain.rest_curvature_per_mm.push(section.rest_curvature_per_mm);
        }
    }

    /// The new nodes on the current curve, which continues straight beyond its tip.
    fn slid(&self, from_tip_mm: &[f64]) -> Posture {
        let inserted = from_tip_mm[0];
        let tangents = tangents(&self.chain, &self.posture);
        let n = from_tip_mm.len() - 1;
        let mut posture = Posture::default();
        let mut element = 0;
        let mut at = |from_sheath: f64| self.on_curve(&tangents, from_sheath, &mut element);
        let mut directions = Vec::with_capacity(n + 1);
        for s in from_tip_mm {
            let (x, t) = at(inserted - s);
            posture.positions_mm.push(x);
            directions.push(t);
        }
        // The triads of the same marks on the device, rotated to their new directions.
        let known = self.posture.frames.len();
        let clamp = self.chain.clamp_frame();
        for (i, direction) in directions.iter().enumerate() {
            let frame: Rotation3<f64> = match known.checked_sub(n + 1 - i).filter(|k| *k > 0) {
                Some(k) => self.posture.frames[k],
                None => clamp,
            };
            let t: Vec3 = frame.matrix().column(0).into();
            posture.frames.push(smallest_rotation(&t, direction) * frame);
        }
        posture.frames[0] = clamp;
        posture
    }

    /// Position and direction at an arc length from the sheath: cubic between nodes. Calls go from the sheath to the
    /// tip.
    fn on_curve(&self, tangents: &[Vec3], from_sheath_mm: f64, element: &mut usize) -> (Vec3, Vec3) {
        let x = &self.posture.positions_mm;
        let last = x.len() - 1;
        let s = self.from_tip_mm[0] - from_sheath_mm;
        if s <= 0.0 {
            return (x[last] - tangents[last] * s, tangents[last]);
        }
        while *element + 1 < last && self.from_tip_mm[*element + 1] > s {
            *element += 1;
        }
        let (a, b) = (*element, *element + 1);
        let h = self.from_tip_mm[a] - self.from_tip_mm[b];
        let u = (self.from_tip_mm[a] - s) / h;
        let (v, chord) = (1.0 - u, x[b] - x[a]);
        let length = chord.norm();
        let (p, q) = (tangents[a] * length, tangents[b] * length);
        let position = x[a] + chord * (u * u * (3.0 - 2.0 * u)) + (p * v - q * u) * (u * v);
        let slope = chord * (6.0 * u * v) + p * (v * (1.0 - 3.0 * u)) + q * (u * (3.0 * u - 2.0));
        (position, slope.normalize())
    }
}

impl Method for Insertion {
    fn step(&mut self, surroundings: &Surroundings<'_>, command: Command) -> Result<()> {
        let start = self.report.inserted_mm;
        let target = (start + command.advance_mm).min(surroundings.device.length_mm());
        let target = if target < ZERO_LENGTH_MM { 0.0 } else { target };
        let radius = surroundings.device.section_at(0.0).radius_mm;
        let parts = (command.advance_mm.abs() / (PART_RADII * radius)).ceil().max(1.0);
        let mut progress = self.progress.clone();
        let rotation_rad = self.report.rotation_rad;
        let (mut iterations, mut converged) = (0u32, true);
        for k in 1..=parts as usize {
            let share = k as f64 / parts;
            let inserted = if k as f64 == parts { target } else { start + (target - start) * share };
            progress.chain.turn_rad = rotation_rad + command.rotate_rad * share;
            if inserted == 0.0 {
                progress.fill_chain(surroundings, &[0.0]);
                (progress.posture, progress.from_tip_mm) = (progress.chain.straight(), vec![0.0]);
                continue;
            }
            let outcome = self.part(surroundings, &mut progress, inserted)?;
            iterations = iterations.saturating_add(outcome.iterations as u32);
            converged &= outcome.converged;
        }
        self.progress = progress;
        let report = &mut self.report;
        (report.iterations, report.converged, report.substeps) = (iterations, converged, parts as u32);
        report.rotation_rad = rotation_rad + command.rotate_rad;
        self.write_report(surroundings);
        self.report.write_alone();
        self.write_shape();
        self.report.largest_bend_rad = self.shape.largest_turn_rad();
        Ok(())
    }

    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn report(&self) -> &StepReport {
        &self.report
    }

    fn state(&self) -> State {
        let Progress { chain, posture, from_tip_mm } = self.progress.clone();
        let nodes = NodesState {
            positions_mm: posture.positions_mm,
            frames: posture.frames,
            from_tip_mm,
            turn_rad: chain.turn_rad,
            report: self.report.clone(),
        };
        State::new(self.model.name(), Content::Nodes(Box::new(nodes)))
    }

    fn restore(&mut self, surroundings: &Surroundings<'_>, state: &State) -> Result<()> {
        let name = self.model.name();
        let Content::Nodes(state) = state.of(name)? else { return Err(state.of_another(name)) };
        check_inserted(state.report.inserted_mm, surroundings.device)?;
        let mut from_tip_mm = Vec::new();
        nodes_from_tip(state.report.inserted_mm, self.options.element_mm, &mut from_tip_mm);
        let nodes = from_tip_mm.len();
        let moved = state.positions_mm.first() != Some(&surroundings.sheath.position_mm);
        if state.from_tip_mm != from_tip_mm
            || state.positions_mm.len() != nodes
            || state.frames.len() != nodes
            || moved
        {
            let remedy =
                format!("{nodes} nodes are in this vessel from this sheath: restore a state of this scene");
            return Err(Error::parameter("state.nodes", state.positions_mm.len(), remedy));
        }
        let posture = Posture { positions_mm: state.positions_mm.clone(), frames: state.frames.clone() };
        self.progress.chain.turn_rad = state.turn_rad;
        self.progress.fill_chain(surroundings, &from_tip_mm);
        (self.progress.posture, self.progress.from_tip_mm) = (posture, from_tip_mm);
        self.report = state.report.clone();
        self.write_shape();
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Method> {
        Box::new(self.clone())
    }
}

/// Unit tangents at the nodes: the clamp's, the mean of the adjacent chords, and at the tip the last chord rotated by
/// its angle to the mean at its other end.
fn tangents(chain: &Chain, posture: &Posture) -> Vec<Vec3> {
    let n = posture.positions_mm.len() - 1;
    let mut tangents = vec![chain.direction];
    for i in 1..=n {
        let before = posture.chord(i - 1).normalize();
        let after = if i < n { posture.chord(i).normalize() } else { before * 2.0 - tangents[n - 1] };
        let sum = if i < n { before + after } else { after };
        tangents.push(sum.try_normalize(1e-12).unwrap_or(before));
    }
    tangents
}

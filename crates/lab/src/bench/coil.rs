//! Coils pushed out of a microcatheter into the sac of an aneurysm, and detached one after another.
//!
//! The vessel is the built-in side-wall aneurysm, scaled to the volume that is asked for; a catheter lies in its sac.

use std::path::PathBuf;

use endowire_core::device::{Device, DeviceFile, Instrument, Section, Stack};
use endowire_core::file::InMemory;
use endowire_core::insertion::{Command, Move, Packing, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, Sac, anatomy};
use endowire_core::{Error, Result, Vec3};

/// Volume of the sac of the anatomy, mm³ (`endowire vessel sac`), its centre, the artery beside it, and the position
/// of the catheter's tip, mm.
const SAC_MM3: f64 = 178.4;
const DOME_MM: [f64; 3] = [2.0, 5.81, 36.0];
const ARTERY_MM: [f64; 3] = [2.0, 0.0, 36.0];
const TIP_MM: [f64; 3] = [2.0, 4.4, 36.4];
/// Diameter of the largest inscribed sphere, and edge length of its triangles, mm.
const BALL_MM: f64 = 6.9;
const EDGE_MM: f64 = 0.5;
/// Modulus of the wall, N/mm².
const MODULUS_N_PER_MM2: f64 = 1.0;
/// A 1.7 F microcatheter with a very soft end: outer and inner radius, mm, and bending stiffness, N·mm².
const CATHETER: (f64, f64, f64) = (0.28, 0.2, 0.8);
/// Length of a coil's pusher, longer than any way here, mm.
const PUSHER_MM: f64 = 60.0;
/// Largest packing density that was ever reached.
pub const MOST_PACKING: f64 = 0.5;

/// Shape of a coil's loops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loops {
    /// A helix with a pitch of 0.5 mm.
    Helix,
    /// Loops in planes of many directions: what is sold as 3D.
    Complex,
}

/// A coil as its maker describes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoilKind {
    /// Outer diameter of the primary coil, mm.
    pub outer_diameter_mm: f64,
    /// Diameter of the platinum wire that it is wound of, mm.
    pub wire_diameter_mm: f64,
    /// Diameter of its loops relative to that of the sac.
    pub loops_to_sac: f64,
    /// Shape of its loops.
    pub loops: Loops,
}

impl CoilKind {
    /// Frames a sac.
    pub const FRAMING: Self = Self {
        outer_diameter_mm: 0.3175,
        wire_diameter_mm: 0.0508,
        loops_to_sac: 0.9,
        loops: Loops::Complex,
    };
    /// Fills the framed sac.
    pub const FILLING: Self =
        Self { outer_diameter_mm: 0.254, wire_diameter_mm: 0.04445, loops_to_sac: 0.7, loops: Loops::Helix };
    /// Fills the rest.
    pub const FINISHING: Self =
        Self { outer_diameter_mm: 0.254, wire_diameter_mm: 0.03175, loops_to_sac: 0.45, loops: Loops::Helix };

    /// Volume of a length of it, mm³: π/4 D² L, gaps of the winding included.
    pub fn volume_mm3(&self, length_mm: f64) -> f64 {
        std::f64::consts::FRAC_PI_4 * self.outer_diameter_mm.powi(2) * length_mm
    }

    /// A coil of this length on its pusher for a sac of this diameter, mm.
    fn device(&self, length_mm: f64, sac_mm: f64) -> Result<Device> {
        let Self { outer_diameter_mm, wire_diameter_mm, loops_to_sac, loops } = *self;
        let loop_mm = loops_to_sac * sac_mm;
        let secondary = match loops {
            Loops::Complex => {
                format!(
                    "{{ shape = \"complex\", diameter_mm = {loop_mm}, tilt_deg = 60.0, turn_deg = 50.0 }}"
                )
            }
            Loops::Helix => format!("{{ shape = \"helix\", diameter_mm = {loop_mm}, pitch_mm = 0.5 }}"),
        };
        let text = format!(
            "kind = \"coil\"\n[[part]]\nname = \"coil\"\nlength_mm = {length_mm}\nouter_diameter_mm = {outer_diameter_mm}\n\
             winding = {{ wire_diameter_mm = {wire_diameter_mm}, modulus_gpa = 170.0, poisson_ratio = 0.38 }}\nsecondary = {secondary}\n\
             [[part]]\nname = \"pusher\"\nlength_mm = {PUSHER_MM}\nouter_diameter_mm = {outer_diameter_mm}\nbending_stiffness_nmm2 = 0.5\n"
        );
        let path = PathBuf::from("coil.toml");
        let files = InMemory([(path.clone(), text.into_bytes())].into());
        Ok(DeviceFile::read_of(&files, &path)?.device)
    }
}

/// Settings of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoilTest {
    /// Volume of the sac, mm³.
    pub volume_mm3: f64,
    /// Length of each coil, mm.
    pub length_mm: f64,
    /// Length between two readings, mm.
    pub step_mm: f64,
    /// Element length, mm.
    pub element_mm: f64,
    /// Coefficient of friction of the wall.
    pub friction: f64,
    /// That of coils on themselves and on each other.
    pub self_friction: f64,
    /// Height of the catheter's tip above the plane of the neck, as a fraction of the height of the sac; 0.25 if absent.
    pub tip_height: Option<f64>,
}

impl CoilTest {
    /// Smallest and largest volume of a sac, mm³.
    pub const VOLUMES_MM3: (f64, f64) = (5.0, 2000.0);
    /// Smallest and largest length of a coil, mm.
    pub const LENGTHS_MM: (f64, f64) = (1.0, 1000.0);
    /// Smallest and largest step, mm.
    pub const STEPS_MM: (f64, f64) = (0.05, 5.0);
    /// Smallest and largest element, mm.
    pub const ELEMENTS_MM: (f64, f64) = (0.1, 2.0);
    /// Smallest and largest coefficient of friction.
    pub const FRICTIONS: (f64, f64) = (0.0, 2.0);
    /// Smallest and largest height of the catheter's tip, as fractions of the sac's.
    pub const TIP_HEIGHTS: (f64, f64) = (0.1, 0.8);
    /// Largest number of coils: instruments of a stack, less the catheter.
    pub const MOST_COILS: usize = 15;

    /// Every setting as `(name, value, smallest, largest)`.
    pub fn ranges(&self) -> Vec<(&'static str, f64, (f64, f64))> {
        let mut all = vec![
            ("volume_mm3", self.volume_mm3, Self::VOLUMES_MM3),
            ("length_mm", self.length_mm, Self::LENGTHS_MM),
            ("step_mm", self.step_mm, Self::STEPS_MM),
            ("element_mm", self.element_mm, Self::ELEMENTS_MM),
            ("friction", self.friction, Self::FRICTIONS),
            ("self_friction", self.self_friction, Self::FRICTIONS),
        ];
        all.extend(self.tip_height.map(|height| ("tip_height", height, Self::TIP_HEIGHTS)));
        all
    }

    /// The vessel with the catheter in the sac, and coils with these names, which are not yet in the catheter.
    ///
    /// # Errors
    /// A setting out of range, or a catheter that does not get there.
    pub fn begin(&self, coils: &[(String, CoilKind)]) -> Result<Deployment> {
        for (name, value, (low, high)) in self.ranges() {
            if !(low..=high).contains(&value) {
                return Err(Error::parameter(name, value, format!("must be from {low} to {high}")));
            }
        }
        if coils.is_empty() || coils.len() > Self::MOST_COILS {
            let remedy = format!("must be 1 to {}", Self::MOST_COILS);
            return Err(Error::parameter("number of coils", coils.len(), remedy));
        }
        let by = libm::cbrt(self.volume_mm3 / SAC_MM3);
        let name = "sidewall_aneurysm";
        let tree = anatomy::tree(name)
            .ok_or_else(|| Error::parameter("anatomy", name, "must be a built-in vessel"))?;
        let nodes = tree.nodes().iter().map(|node| CentrelineNode {
            position_mm: node.position_mm * by,
            radius_mm: node.radius_mm * by,
            parent: node.parent,
        });
        let scaled = CentrelineTree::new(nodes.collect())?.with_closed_ends(tree.closed_ends().to_vec())?;
        let generated = GeneratedWall::new(&scaled, Resolution::EdgeMm(EDGE_MM * by))?;
        let place = |[x, y, z]: [f64; 3]| Vec3::new(x, y, z) * by;
        let sac = Sac::measure(&generated.wall, place(DOME_MM), place(ARTERY_MM))?;
        let mouth = place(ARTERY_MM);
        let sheath = Sheath::new(mouth, place(TIP_MM) - mouth)?;
        let way_mm = match self.tip_height {
            Some(height) => {
                let above_mm = height * sac.height_mm + (sac.neck_mm - mouth).dot(&sac.normal);
                above_mm / sheath.direction.dot(&sac.normal)
            }
            None => (place(TIP_MM) - mouth).norm(),
        };
        let coil = |(name, kind): &(String, CoilKind)| {
            let device = kind.device(self.length_mm, BALL_MM * by)?;
            Ok(Instrument { name: name.clone(), device, may_lead: true })
        };
        let mut instruments = coils.iter().map(coil).collect::<Result<Vec<_>>>()?;
        let (radius_mm, lumen_mm, stiffness_nmm2) = CATHETER;
        let section =
            Section { inner_radius_mm: Some(lumen_mm), ..Section::straight(50.0, radius_mm, stiffness_nmm2) };
        let catheter = Device::new(vec![section])?;
        instruments.push(Instrument { name: "microcatheter".to_owned(), device: catheter, may_lead: true });
        let method = KirchhoffOptions {
            element_mm: self.element_mm,
            tolerance: 1e-6,
            self_contact: true,
            self_friction: self.self_friction,
            ..KirchhoffOptions::default()
        };
        let properties = WallProperties {
            modulus_n_per_mm2: MODULUS_N_PER_MM2,
            friction: self.friction,
            ..WallProperties::default()
        };
        let builder = Simulation::builder(generated.wall, Stack::new(instruments)?, sheath);
        let mut simulation = builder.properties(properties).method(&method).build()?;
        let count = (way_mm / self.step_mm).ceil();
        for _ in 0..count as usize {
            let command = Command::advance(way_mm / count);
            simulation.step_together(&[Move { instrument: coils.len(), command }])?;
        }
        Ok(Deployment { simulation, sac, step_mm: self.step_mm })
    }
}

/// A reading.
#[derive(Debug, Clone, PartialEq)]
pub struct CoilReading {
    /// Length of the coil beyond where the catheter's tip was before it, mm.
    pub inserted_mm: f64,
    /// How full the sac is.
    pub packing: Packing,
    /// Push force on the coil, N; negative where it is held back.
    pub push_force_n: f64,
    /// Push force on the catheter, N; `None` where it jumps.
    pub catheter_force_n: Option<f64>,
    /// Distance of the catheter's tip from its position before this coil, mm.
    pub kick_back_mm: f64,
    /// Largest penetration of loops into each other or into the wall, mm.
    pub max_penetration_mm: f64,
    /// Number of places where axes are closer than half the touching distance.
    pub crossings: usize,
    /// Whether the step jumped.
    pub jumped: bool,
    /// Whether it ended in an equilibrium.
    pub converged: bool,
}

/// Coils on their way into a sac.
pub struct Deployment {
    /// The simulation: coils first, and then the catheter.
    pub simulation: Simulation,
    /// The sac.
    pub sac: Sac,
    step_mm: f64,
}

impl Deployment {
    fn catheter(&self) -> usize {
        self.simulation.stack().instruments().len() - 1
    }

    fn tip_mm(&self) -> Vec3 {
        self.simulation.tip_of_mm(self.catheter()).unwrap_or_default()
    }

    fn advance(&mut self, coil: usize, advance_mm: f64) -> Result<()> {
        let command = Command::advance(advance_mm);
        self.simulation.step_together(&[Move { instrument: coil, command }]).map(drop)
    }

    /// Pushes coil `number` through the catheter and `out_mm` out of it, with a reading after each step.
    ///
    /// # Errors
    /// A step that could not be carried out.
    pub fn push(&mut self, number: usize, out_mm: f64, read: &mut dyn FnMut(CoilReading)) -> Result<()> {
        let rests_at = self.tip_mm();
        let covered_mm = self.simulation.report().lengths_mm()[self.catheter()];
        // Within the catheter it touches nothing, so that one step suffices.
        self.advance(number, covered_mm)?;
        let count = (out_mm / self.step_mm).ceil();
        for _ in 0..count as usize {
            self.advance(number, out_mm / count)?;
            read(self.reading(number, covered_mm, &rests_at)?);
        }
        Ok(())
    }

    fn reading(&self, number: usize, covered_mm: f64, rests_at: &Vec3) -> Result<CoilReading> {
        let report = self.simulation.report();
        let touching = self.simulation.touching();
        let deepest_mm = touching.iter().map(|touch| touch.penetration_mm);
        let is_crossed = |touch: &&endowire_core::contact::Touching| {
            let [a, b] = touch.positions_mm;
            (a - b).norm() < touch.penetration_mm
        };
        Ok(CoilReading {
            inserted_mm: report.lengths_mm()[number] - covered_mm,
            packing: Packing::of(&self.simulation, &self.sac)?,
            push_force_n: report.hand(number).push_force_n.unwrap_or(f64::NAN),
            catheter_force_n: report.hand(self.catheter()).push_force_n,
            kick_back_mm: (self.tip_mm() - rests_at).norm(),
            max_penetration_mm: deepest_mm.fold(report.max_penetration_mm, f64::max),
            crossings: touching.iter().filter(is_crossed).count(),
            jumped: report.jumped,
            converged: report.converged,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEST: CoilTest = CoilTest {
        volume_mm3: 30.0,
        length_mm: 6.0,
        step_mm: 1.0,
        element_mm: 0.75,
        friction: 0.1,
        self_friction: 0.2,
        tip_height: None,
    };

    #[test]
    fn a_coil_fills_its_share_of_the_sac() {
        let mut begun = TEST.begin(&[("one".to_owned(), CoilKind::FILLING)]).unwrap();
        let mut readings = Vec::new();
        begun.push(0, 6.0, &mut |reading| readings.push(reading)).unwrap();
        let last = readings.last().unwrap();
        assert_eq!((readings.len(), last.crossings), (6, 0));
        let expected = CoilKind::FILLING.volume_mm3(6.0) / begun.sac.volume_mm3;
        assert!((last.packing.density / expected - 1.0).abs() < 1e-6, "{last:?}");
        // The twin: another kind would fill it otherwise.
        assert!(CoilKind::FRAMING.volume_mm3(6.0) > 1.5 * CoilKind::FILLING.volume_mm3(6.0));
    }

    #[test]
    fn a_setting_out_of_range_is_named() {
        let coils = [("one".to_owned(), CoilKind::FILLING)];
        let refused = CoilTest { tip_height: Some(0.95), ..TEST }.begin(&coils).err().unwrap();
        assert!(refused.to_string().contains("tip_height"), "{refused}");
        let refused = TEST.begin(&[]).err().unwrap();
        assert!(refused.to_string().contains("number of coils"), "{refused}");
    }
}

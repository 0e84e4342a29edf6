//! Three-point bending: a length of the device on two supports, pressed down halfway between them.

use endowire_core::device::Device;
use endowire_core::statics::{
    End, EndKind, Load, LoadKind, Rod, Section, Solver, Start, StartKind, StaticCase,
};
use endowire_core::{Error, Result};
use serde::Serialize;

use super::check_positive;

/// Elements between the supports.
const ELEMENTS: usize = 24;
/// Deflection, as a part of the span, from whose force the flexural rigidity is read: the nonlinear part of the
/// force is then below 10⁻⁴ of it.
const SMALL: f64 = 2e-3;
/// Number of readings of the force up to the largest deflection.
const READINGS: usize = 10;

/// Settings of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BendTest {
    /// Distance between the supports, mm.
    pub span_mm: f64,
    /// Largest deflection, mm.
    pub deflection_mm: f64,
}

impl Default for BendTest {
    fn default() -> Self {
        Self { span_mm: 20.0, deflection_mm: 1.0 }
    }
}

/// Flexural rigidity at a place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rigidity {
    /// Distance of the place from the tip, mm.
    pub from_tip_mm: f64,
    /// F L³/(48 δ) at a small deflection δ, N·mm²: that of a uniform length with the same force.
    pub rigidity_nmm2: f64,
}

/// A reading of the force.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BendPoint {
    /// Deflection under the load, mm.
    pub deflection_mm: f64,
    /// Force, N.
    pub force_n: f64,
}

impl BendTest {
    /// Checks the settings.
    ///
    /// # Errors
    /// A span that is not of millimetres or centimetres, and a deflection beyond a fifth of it.
    pub fn check(&self) -> Result<()> {
        check_positive("span_mm", self.span_mm, 1000.0, "mm")?;
        let most_mm = 0.2 * self.span_mm;
        if self.deflection_mm > 0.0 && self.deflection_mm <= most_mm {
            return Ok(());
        }
        let remedy = format!(
            "must be above 0 and at most a fifth of the span, {most_mm} mm: beyond it a device slips off its supports"
        );
        Err(Error::parameter("deflection_mm", self.deflection_mm, remedy))
    }

    /// Whether a place is far enough from both ends of a device for the supports.
    pub fn reaches(&self, device: &Device, from_tip_mm: f64) -> bool {
        let half_mm = 0.5 * self.span_mm;
        // Lengths are sums of sections: equal up to rounding.
        let slack_mm = 1e-9 * device.length_mm();
        from_tip_mm >= half_mm - slack_mm && from_tip_mm + half_mm <= device.length_mm() + slack_mm
    }

    /// Flexural rigidity at a place.
    ///
    /// # Errors
    /// Settings out of range, and a place that is closer to an end than half a span.
    pub fn rigidity(&self, device: &Device, from_tip_mm: f64) -> Result<Rigidity> {
        let (case, mm_per_n) = self.loaded(device, from_tip_mm)?;
        let force_n = SMALL * self.span_mm / mm_per_n;
        let deflection_mm = deflection_mm(&case, force_n)?;
        let rigidity_nmm2 = force_n * self.span_mm.powi(3) / (48.0 * deflection_mm);
        Ok(Rigidity { from_tip_mm, rigidity_nmm2 })
    }

    /// Force over deflection at a place, from no deflection on.
    ///
    /// # Errors
    /// As [`Self::rigidity`].
    pub fn forces(&self, device: &Device, from_tip_mm: f64) -> Result<Vec<BendPoint>> {
        let (case, mm_per_n) = self.loaded(device, from_tip_mm)?;
        let mut points = vec![BendPoint { deflection_mm: 0.0, force_n: 0.0 }];
        for reading in 1..=READINGS {
            let force_n = self.deflection_mm * reading as f64 / READINGS as f64 / mm_per_n;
            points.push(BendPoint { deflection_mm: deflection_mm(&case, force_n)?, force_n });
        }
        Ok(points)
    }

    /// The length between the supports as a static case, and its compliance under the load at small deflections.
    fn loaded(&self, device: &Device, from_tip_mm: f64) -> Result<(StaticCase, f64)> {
        self.check()?;
        if device.has_soft_plane() {
            let remedy =
                "on its supports it would roll into that plane: measure a section of either stiffness alone";
            return Err(Error::parameter("device.section.soft_plane", "given", remedy));
        }
        if !self.reaches(device, from_tip_mm) {
            let remedy = format!(
                "must be at least half a span, {} mm, from both ends of the device, which is {} mm long",
                0.5 * self.span_mm,
                device.length_mm()
            );
            return Err(Error::parameter("at_mm", from_tip_mm, remedy));
        }
        let case = self.case(device, from_tip_mm - 0.5 * self.span_mm);
        // By unit loads: the moment is half of the distance from the nearer support. A bend of the softest section
        // alone would be far off in a taper.
        let half_mm = 0.5 * self.span_mm;
        let cubes = |until_mm: f64| match until_mm <= half_mm {
            true => until_mm.powi(3),
            false => 2.0 * half_mm.powi(3) - (self.span_mm - until_mm).powi(3),
        };
        let mut begin_mm = 0.0;
        let mut mm_per_n = 0.0;
        for section in &case.rod.section {
            mm_per_n += (cubes(section.until) - cubes(begin_mm)) / (12.0 * section.ei);
            begin_mm = section.until;
        }
        Ok((case, mm_per_n))
    }

    /// The length on its supports, which begins so far from the tip: it pivots on one and slides along the other.
    ///
    /// A rest shape is left out: what is measured is the rigidity of the cross-sections.
    fn case(&self, device: &Device, begins_mm: f64) -> StaticCase {
        let mut section: Vec<Section> = Vec::new();
        let mut end_mm = 0.0;
        for one in device.sections() {
            end_mm += one.length_mm;
            let until = (end_mm - begins_mm).min(self.span_mm);
            if until > section.last().map_or(0.0, |last| last.until) + 1e-9 * self.span_mm {
                section.push(crate::section(until, one.bending_stiffness_nmm2));
            }
        }
        // Rounding may end the last one short of the support.
        if let Some(last) = section.last_mut() {
            last.until = self.span_mm;
        }
        StaticCase {
            rod: Rod { length: self.span_mm, elements: ELEMENTS, section, instrument: vec![] },
            start: Start {
                kind: StartKind::Pinned,
                position: [0.0; 3],
                tangent: [1.0, 0.0, 0.0],
                normal: Some([0.0, 1.0, 0.0]),
            },
            end: End {
                kind: EndKind::Pinned,
                position: Some([self.span_mm, 0.0, 0.0]),
                slide: Some([1.0, 0.0, 0.0]),
                ..End::default()
            },
            load: vec![],
            self_contact: None,
            initial: None,
            solver: Solver::default(),
        }
    }
}

/// Deflection of a case under a force in the middle, mm.
fn deflection_mm(case: &StaticCase, force_n: f64) -> Result<f64> {
    let middle_mm = 0.5 * case.rod.length;
    let load = Load {
        kind: LoadKind::Force,
        at: Some(middle_mm),
        from: None,
        to: None,
        value: [0.0, -force_n, 0.0],
    };
    let solution = StaticCase { load: vec![load], ..case.clone() }.solve()?.checked()?;
    let nodes = solution.arc_lengths.iter().zip(&solution.nodes);
    let middle = nodes.min_by(|a, b| (a.0 - middle_mm).abs().total_cmp(&(b.0 - middle_mm).abs()));
    middle
        .map(|(_, position)| -position[1])
        .filter(|deflection_mm| *deflection_mm > 0.0)
        .ok_or_else(|| Error::Computation("the load does not deflect the device".to_owned()))
}

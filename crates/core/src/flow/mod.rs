//! Blood flow, and its drag on devices.
//!
//! The flow is steady, laminar and developed: Poiseuille flow in a tube of the local radius R, with the local share
//! of the inflow ([`FlowGraph`]),
//!
//! ```text
//! G = 8 μ Q / π R⁴
//! ```
//!
//! the pressure gradient. This is a fair estimate in small arteries, and too low in large ones because of the pulse
//! and the unsteady profile. The obstruction by a device is neglected: Q is given, and G is that of the tube without
//! it.
//!
//! The drag on a thread of radius a along the tube, e off its axis, is
//!
//! ```text
//! f = ½ π G (S / acosh((R² + a² − e²) / 2aR) − 2a²),    S² = ((R − e)² − a²) ((R + e)² − a²)
//! ```
//!
//! per length. It is exact: u + G|x|²/4μ is harmonic between two eccentric circles; under the conformal map that
//! makes them concentric, its flux out of the inner circle is 2π/acosh(…) times the difference of its means over both
//! circles, and that over the inner one is the value of a² − e² + 2ex at the limiting point within it, x = (R² + e² −
//! a² − S)/2e. At e = 0 it is that of the annulus, f = ½πG ((R² − a²)/ln(R/a) − 2a²) (Bird, Stewart and Lightfoot,
//! *Transport Phenomena*, section 2.4); next to the wall, πGa(R − a). The drag on a thread across the flow is twice
//! that along it (Cox, *Journal of Fluid Mechanics* 44, 1970), so for a tangent t that is not along the flow's
//! direction d it is f (2d − (d·t) t).
//!
//! Pressure is neglected: its force on the ends of a device is πa² times the pressure at the tip, which decreases by
//! πa²G per length downstream. That is a fraction a/(R − a) of the drag of a thread on the wall, and less on the
//! axis.

mod drag;
mod rings;
mod tree;

#[cfg(test)]
pub(crate) use drag::drag_n_per_mm;
pub use rings::Rings;
pub use tree::{FlowGraph, FlowLink, FlowNode, check_place};

use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::Polyline;
use serde::{Deserialize, Serialize};

use crate::error::{self, in_range};
use crate::vessel::{CentrelineTree, Lumen};
use crate::{Error, Result, Vec3};

/// Largest inflow, ml/s: ten times the heart's.
const MOST_INFLOW_ML_PER_S: f64 = 1000.0;
/// Largest viscosity, mPa·s.
const MOST_VISCOSITY_MPA_S: f64 = 1000.0;
/// Largest exponent of the division of flow.
const MOST_EXPONENT: f64 = 10.0;
/// Largest number of points of the centre line that are tested for being inside a vessel.
const POINTS_ASKED: usize = 200;
/// Distance from the axis, in radii, beyond which there is no flow.
const OUTSIDE_RADII: f64 = 2.0;

/// `[vessel.flow]`: the flow through the vessel's centre line, with its drag on devices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VesselFlow {
    /// Inflow, ml/s, averaged over a heartbeat.
    pub inflow_ml_per_s: f64,
    /// A position next to the end of the centre line that is the inlet, mm; if absent, the widest end, or of several
    /// about as wide the one nearest to the head.
    #[serde(default)]
    pub inlet_mm: Option<[f64; 3]>,
    /// Exponent n of the division: flow is proportional to radiusⁿ.
    #[serde(default = "murray")]
    pub split_exponent: f64,
    /// Viscosity of the blood, mPa·s; 3.5 if absent: in tubes wider than a millimetre blood with a hematocrit of 45 %
    /// is 3.2 times as viscous as its plasma (Pries, Neuhaus and Gaehtgens, *American Journal of Physiology* 263,
    /// 1992), which has about 1.1 mPa·s.
    #[serde(default = "blood")]
    pub viscosity_mpa_s: f64,
}

fn murray() -> f64 {
    3.0
}

fn blood() -> f64 {
    3.5
}

/// The flow at a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowAt {
    /// Downstream along the centre line, unit length.
    pub direction: Vec3,
    /// Radius of the lumen, mm.
    pub radius_mm: f64,
    /// Distance from the centre line, mm.
    pub offset_mm: f64,
    /// Pressure gradient, N/mm³.
    pub gradient_n_per_mm3: f64,
}

/// The flow in a vessel.
#[derive(Debug, Clone)]
pub struct BloodFlow {
    nodes: Vec<FlowNode>,
    /// Stretches, each between a node and the one before it.
    line: Polyline,
    /// The downstream node of each stretch.
    downstream: Vec<u32>,
    inflow_mm3_per_s: f64,
    viscosity_ns_per_mm2: f64,
}

impl BloodFlow {
    /// The flow through `tree`.
    ///
    /// # Errors
    /// Values out of range, an inlet that is not next to an end, and a centre line that is not a tree of usable size.
    pub fn new(tree: &CentrelineTree, flow: &VesselFlow) -> Result<Self> {
        in_range("vessel.flow.inflow_ml_per_s", flow.inflow_ml_per_s, MOST_INFLOW_ML_PER_S)?;
        in_range("vessel.flow.viscosity_mpa_s", flow.viscosity_mpa_s, MOST_VISCOSITY_MPA_S)?;
        in_range("vessel.flow.split_exponent", flow.split_exponent, MOST_EXPONENT)?;
        let inlet_mm = flow.inlet_mm.map(Vec3::from);
        if let Some(inlet) = inlet_mm.filter(|inlet| !inlet.iter().all(|c| c.is_finite())) {
            let remedy = "must be finite, in mm";
            return Err(Error::parameter("vessel.flow.inlet_mm", error::vector(&inlet), remedy));
        }
        let keys = ["vessel.flow", "vessel.flow.inlet_mm"];
        // The last stretch of an arm, by its link, lies within the branch that it joins.
        let nodes = FlowGraph::new(tree, inlet_mm, flow.split_exponent, keys)?.nodes;
        let mut stretches = Vec::new();
        let mut downstream = Vec::new();
        for (index, node) in nodes.iter().enumerate() {
            if let Some(upstream) = node.upstream.filter(|_| !node.within_trunk) {
                stretches.push([upstream as u32, index as u32]);
                downstream.push(index as u32);
            }
        }
        let vertices = nodes.iter().map(|node| vector(&node.position_mm)).collect();
        Ok(Self {
            nodes,
            line: Polyline::new(vertices, Some(stretches)),
            downstream,
            inflow_mm3_per_s: 1e3 * flow.inflow_ml_per_s,
            viscosity_ns_per_mm2: 1e-9 * flow.viscosity_mpa_s,
        })
    }

    /// Rejects a centre line with no part within the vessel; its ends may stick out.
    pub(crate) fn check_within(&self, lumen: &Lumen) -> Result<()> {
        let Some((low, high)) = lumen.bounds_mm() else { return Ok(()) };
        let points = self.nodes.iter().map(|node| node.position_mm);
        let near: Vec<Vec3> =
            points.clone().filter(|x| (*x - x.sup(&low).inf(&high)).norm() == 0.0).collect();
        let asked = near.iter().step_by(near.len().div_ceil(POINTS_ASKED).max(1));
        if asked.into_iter().any(|x| lumen.holds(x)) {
            return Ok(());
        }
        let nowhere = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let (from, to) = points.fold(nowhere, |(low, high), x| (low.inf(&x), high.sup(&x)));
        let remedy = format!(
            "no point of it is in the vessel, which lies in {} to {}: give the centre line of this surface, in its coordinates and in mm",
            error::vector(&low),
            error::vector(&high)
        );
        let value = format!("{} to {}", error::vector(&from), error::vector(&to));
        Err(Error::parameter("vessel.centreline", value, remedy))
    }

    /// The flow at a position, from the nearest stretch of the centre line; `None` outside the vessel.
    pub fn at(&self, x: &Vec3) -> Option<FlowAt> {
        if !x.iter().all(|c| c.is_finite()) {
            return None;
        }
        let (near, (stretch, place)) = self.line.project_local_point_and_get_location(vector(x), false);
        let node = &self.nodes[self.downstream[stretch as usize] as usize];
        let from = &self.nodes[node.upstream?];
        let [_, part] = place.barycentric_coordinates();
        let radius_mm = node.from_radius_mm + (node.radius_mm - node.from_radius_mm) * part;
        let onwards = (node.position_mm - from.position_mm).normalize();
        // In a ring blood may flow against the order of points.
        let direction = if node.share < 0.0 { -onwards } else { onwards };
        // Beyond an end of the centre line the tube continues straight.
        let away = x - Vec3::new(near.point.x, near.point.y, near.point.z);
        let offset_mm = (away - direction * away.dot(&direction)).norm();
        let flow = node.share.abs() * self.inflow_mm3_per_s;
        (away.norm() < OUTSIDE_RADII * radius_mm).then(|| FlowAt {
            direction,
            radius_mm,
            offset_mm,
            gradient_n_per_mm3: 8.0 * self.viscosity_ns_per_mm2 * flow
                / (std::f64::consts::PI * radius_mm.powi(4)),
        })
    }
}

fn vector(x: &Vec3) -> Vector {
    Vector::new(x.x, x.y, x.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::{CentrelineNode, SurfaceMesh, anatomy};

    /// A straight centre line along z.
    fn line(x_mm: f64, z_mm: [f64; 2]) -> CentrelineTree {
        let node =
            |z: f64, parent| CentrelineNode { position_mm: Vec3::new(x_mm, 0.0, z), radius_mm: 4.0, parent };
        CentrelineTree::new(vec![node(z_mm[0], None), node(z_mm[1], Some(0))]).unwrap()
    }

    fn flow(tree: &CentrelineTree, inlet_mm: Option<[f64; 3]>) -> Result<BloodFlow> {
        let spec = VesselFlow { inflow_ml_per_s: 20.0, inlet_mm, split_exponent: 3.0, viscosity_mpa_s: 3.5 };
        BloodFlow::new(tree, &spec)
    }

    #[test]
    fn an_inlet_is_next_to_an_end() {
        let tree = line(0.0, [0.0, 100.0]);
        for inlet in [[0.0; 3], [0.0, 0.0, 118.0], [3.0, 4.0, 85.0]] {
            assert!(flow(&tree, Some(inlet)).is_ok(), "{inlet:?}");
        }
        for inlet in [[5000.0, 0.0, 50.0], [0.0, 0.0, 50.0]] {
            let error = flow(&tree, Some(inlet)).unwrap_err().to_string();
            assert!(
                error.starts_with("vessel.flow.inlet_mm = [") && error.contains("nearest end"),
                "{error}"
            );
        }
    }

    #[test]
    fn what_a_sac_takes_in_comes_back() {
        let vessel = anatomy::tree("basilar_aneurysm").unwrap();
        let shares = |tree: &CentrelineTree| {
            let nodes = FlowGraph::new(tree, Some(Vec3::zeros()), 3.0, ["a", "b"]).unwrap().nodes;
            let at = |name: &str| tree.nodes()[tree.target(name).unwrap().row].position_mm;
            let share = |name: &str| {
                nodes.iter().find(|node| node.position_mm == at(name)).map_or(f64::NAN, |node| node.share)
            };
            ["dome", "left posterior cerebral", "right posterior cerebral"].map(share)
        };
        assert_eq!(shares(&vessel), [0.2, 0.5, 0.5]);
        // With an open end its share would be lost.
        let open = vessel.with_closed_ends(vec![]).unwrap();
        assert!((shares(&open).iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_centre_line_that_is_nowhere_in_the_vessel_is_refused() {
        let cuboid = SurfaceMesh::cuboid(Vec3::new(-4.0, -4.0, 0.0), Vec3::new(4.0, 4.0, 50.0), 2.0);
        let lumen = Lumen::from(crate::vessel::Wall::from_surface(&cuboid).unwrap());
        let within = |x_mm, z_mm| flow(&line(x_mm, z_mm), None).unwrap().check_within(&lumen);
        // It may stick out at its ends, or belong to a longer vessel.
        for z_mm in [[0.0, 50.0], [-3.0, 55.0], [-200.0, 300.0], [45.0, 300.0]] {
            assert!(within(0.0, z_mm).is_ok(), "{z_mm:?}");
        }
        for (x_mm, z_mm) in [(500.0, [0.0, 50.0]), (0.0, [60.0, 110.0]), (4.5, [0.0, 50.0])] {
            let error = within(x_mm, z_mm).unwrap_err().to_string();
            let reported = format!("vessel.centreline = [{x_mm}, 0, {}] to", z_mm[0]);
            assert!(error.starts_with(&reported) && error.contains("[4, 4, 50]"), "{error}");
        }
    }
}

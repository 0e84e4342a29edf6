//! The laboratory: reference cases with exact or independently computed solutions (`endowire verify`), methods [compared](compare) with
//! each other, [bench](mod@bench) tests of devices, and studies of [evidence].
//!
//! Each case is data and a function, independent of the solver's results. Further modules are the [`stress`] tests of
//! rods and of insertions ([`insertion_stress`]), random commands on several instruments ([`instrument_stress`]) and
//! of any size ([`sequences`]), random deployments of coils ([`deployments`]), insertions into the [`surfaces`] of a
//! folder, and the exact test for a device that [crosses](crossing) its wall.

pub mod ablation;
pub mod bench;
mod capstan;
mod capstan_within;
mod channel;
mod clearance;
mod coaxial;
pub mod compare;
mod contact;
pub mod crossing;
mod cylinder;
pub mod deployments;
mod ends;
pub mod evidence;
pub mod experiment;
mod flow_drag;
pub mod hard;
mod insertion;
pub mod insertion_stress;
pub mod instrument_stress;
pub mod noise;
mod on_bench;
mod planar;
mod quadratic;
mod regions;
mod self_contact;
pub mod sequences;
mod spatial;
pub mod stress;
pub mod studies;
pub mod surfaces;
mod turned_within;
mod whip;

use endowire_core::statics::{
    End, EndKind, Load, LoadKind, Rod, Section, Solver, Start, StartKind, StaticCase,
};
use endowire_core::{Result, Vec3};
use serde::Serialize;

/// One compared number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Case, for example `A1 a=10, 16 elements`.
    pub name: String,
    /// The quantity compared.
    pub quantity: String,
    /// Computed value.
    pub computed: f64,
    /// Reference.
    pub expected: f64,
    /// Error, as defined by the quantity.
    pub error: f64,
    /// Largest error allowed.
    pub bound: f64,
    /// Whether the error is within the bound.
    pub pass: bool,
    /// Newton iterations, if the number is from a single solve.
    pub iterations: Option<usize>,
    /// Observed order of convergence, if several meshes were used.
    pub order: Option<f64>,
}

impl Row {
    /// A number with its relative error.
    pub fn relative(name: &str, quantity: &str, computed: f64, expected: f64, bound: f64) -> Self {
        let error = (computed - expected).abs() / expected.abs().max(f64::MIN_POSITIVE);
        Self::with_error(name, quantity, computed, expected, error, bound)
    }

    /// A point with its distance from the reference relative to `scale`; the numbers shown are the distances from the
    /// origin.
    pub fn point(
        name: &str,
        quantity: &str,
        computed: [f64; 3],
        expected: [f64; 3],
        scale: f64,
        bound: f64,
    ) -> Self {
        let (c, e) = (Vec3::from(computed), Vec3::from(expected));
        Self::with_error(name, quantity, c.norm(), e.norm(), (c - e).norm() / scale, bound)
    }

    /// An error computed by the caller.
    pub fn with_error(
        name: &str,
        quantity: &str,
        computed: f64,
        expected: f64,
        error: f64,
        bound: f64,
    ) -> Self {
        Self {
            name: name.to_owned(),
            quantity: quantity.to_owned(),
            computed,
            expected,
            error,
            bound,
            pass: error <= bound,
            iterations: None,
            order: None,
        }
    }

    /// Adds the number of iterations.
    #[must_use]
    pub fn iterations(mut self, iterations: usize) -> Self {
        self.iterations = Some(iterations);
        self
    }

    /// Adds the observed order of convergence.
    #[must_use]
    pub fn order(mut self, order: Option<f64>) -> Self {
        self.order = order;
        self
    }

    /// A computation that did not finish: an infinite error.
    pub fn failed(name: &str, reason: &str) -> Self {
        Self::with_error(name, reason, f64::NAN, f64::NAN, f64::INFINITY, 0.0)
    }
}

/// A family of reference cases.
#[derive(Debug, Clone, Copy)]
pub struct Family {
    /// Its identifier in the reference list.
    pub id: &'static str,
    /// Its description, and who computed it first.
    pub title: &'static str,
    run: fn() -> Result<Vec<Row>>,
}

impl Family {
    /// Runs the family. A computation that fails becomes a row that does not pass.
    pub fn run(&self) -> Vec<Row> {
        (self.run)().unwrap_or_else(|e| vec![Row::failed(self.id, &e.to_string())])
    }
}

/// All families.
pub const FAMILIES: &[Family] = &[
    Family {
        id: "A1",
        title: "Cantilever under a dead transverse tip load (Bisshopp and Drucker 1945)",
        run: planar::cantilever,
    },
    Family { id: "A2", title: "End moment, up to the full circle", run: planar::end_moment },
    Family {
        id: "A3",
        title: "Column: post-buckled shapes and critical loads (Euler, Greenhill)",
        run: planar::column,
    },
    Family { id: "A4", title: "Pre-curved cantilever (J-tip)", run: planar::precurved },
    Family {
        id: "A5",
        title: "The quadratic energy of Li et al. 2011 on the cantilever of A1",
        run: quadratic::cantilever,
    },
    Family { id: "A6", title: "Cantilever under its own weight", run: planar::own_weight },
    Family { id: "A7", title: "Stiff shaft with a floppy tip", run: planar::floppy_tip },
    Family {
        id: "B1",
        title: "45° bend under an out-of-plane load (Bathe and Bolourchi 1979)",
        run: spatial::bend,
    },
    Family {
        id: "B2",
        title: "Twisted straight rod under tension (Greenhill 1883)",
        run: spatial::twisted_rod,
    },
    Family { id: "B3", title: "Closed ring under twist (Michell 1889, Zajac 1962)", run: spatial::ring },
    Family {
        id: "B4",
        title: "Localised buckle of a long twisted rod (Coyne 1990)",
        run: spatial::localised,
    },
    Family { id: "B5", title: "Whip of a pre-curved wire in a curved tube", run: whip::whip },
    Family { id: "B5", title: "Whip: where the tip jumps", run: whip::jumps },
    Family {
        id: "C1",
        title: "Helix of a compressed rod in a cylinder (Lubinski et al. 1962)",
        run: cylinder::helix,
    },
    Family {
        id: "C1",
        title: "Rod that lies in a horizontal cylinder (Dawson and Paslay 1984, Chen et al. 1990)",
        run: cylinder::weight,
    },
    Family { id: "C1", title: "Rod pushed through its helix with friction", run: cylinder::rubbed },
    Family {
        id: "C2",
        title: "Clamped-clamped elastica in a channel (Domokos, Holmes and Royce 1997)",
        run: contact::elastica,
    },
    Family { id: "C3", title: "Wire pushed into a circular bend", run: insertion::bend },
    Family {
        id: "C4",
        title: "Frictionless sleeve under a transverse load at the tip (Bigoni et al. 2015)",
        run: insertion::sleeve,
    },
    Family { id: "C5", title: "Soft-walled tube", run: insertion::soft_tube },
    Family { id: "C6", title: "Capstan (Euler 1769, Eytelwein)", run: capstan::capstan },
    Family { id: "C6", title: "Compliant wall (Winkler, Hetényi 1946)", run: contact::compliant },
    Family {
        id: "C7",
        title: "Wall with regions: two moduli (Hetényi 1946), friction over a part of a bend",
        run: regions::regions,
    },
    Family { id: "C8", title: "Deep in a soft wall", run: insertion::yielding_tube },
    Family { id: "C9", title: "Blood that drags at a wire (Poiseuille)", run: flow_drag::drag },
    Family {
        id: "D1",
        title: "Instruments on one line: stiffness adds, in any order",
        run: coaxial::stiffness_adds,
    },
    Family {
        id: "D2",
        title: "Two pre-curved instruments turned against each other (Dupont et al. 2010)",
        run: coaxial::pair,
    },
    Family {
        id: "D3",
        title: "A curved instrument in a straight one: what pushing costs",
        run: coaxial::curved_in_straight,
    },
    Family {
        id: "D4",
        title: "Straight instruments in a close-fitting arc: what pushing costs",
        run: coaxial::straight_in_arc,
    },
    Family {
        id: "D5",
        title: "A wire pulled through a catheter that rubs on it",
        run: capstan_within::capstan,
    },
    Family {
        id: "D6",
        title: "An end passes through the mesh: energy without jumps, forces its slopes",
        run: ends::pass,
    },
    Family { id: "D7", title: "A wire in the valve of a catheter's hub", run: capstan_within::valve },
    Family {
        id: "D8",
        title: "A wire in a catheter with play: the tilt where it comes out",
        run: clearance::clearance,
    },
    Family {
        id: "D9",
        title: "A wire turned and pushed in a bent catheter that rubs on it",
        run: turned_within::turned,
    },
    Family {
        id: "E2",
        title: "Twisted rod wound about itself (Clauvelin, Audoly, Neukirch 2009)",
        run: self_contact::plectoneme,
    },
    Family {
        id: "E3",
        title: "Elastic trefoil (Gerlach, Reiter, von der Mosel 2017)",
        run: self_contact::trefoil,
    },
    Family { id: "E6", title: "Two cantilevers that cross", run: self_contact::crossing },
    Family {
        id: "G1",
        title: "Three-point bending of uniform and tapered wires",
        run: on_bench::three_point,
    },
    Family {
        id: "G2",
        title: "Torque response: straight wire, whip of a pre-curved one (B5)",
        run: on_bench::torque,
    },
    Family { id: "G3", title: "Push: straight tube, bend, capstan behind a bend", run: on_bench::push },
    Family { id: "G4", title: "Tip load: columns that slide or are held", run: on_bench::tip_load },
];

/// A straight inextensible rod of length 1 and EI 1 along x, clamped at the origin, free at its end.
pub(crate) fn unit_rod(elements: usize) -> StaticCase {
    StaticCase {
        rod: Rod { length: 1.0, elements, section: vec![section(1.0, 1.0)], instrument: vec![] },
        start: Start {
            kind: StartKind::Clamped,
            position: [0.0; 3],
            tangent: [1.0, 0.0, 0.0],
            normal: Some([0.0, 1.0, 0.0]),
        },
        end: End { kind: EndKind::Free, ..End::default() },
        load: vec![],
        self_contact: None,
        initial: None,
        solver: Solver::default(),
    }
}

/// An inextensible section.
pub(crate) fn section(until: f64, ei: f64) -> Section {
    Section {
        until,
        ei,
        ei_end: None,
        gj: None,
        gj_end: None,
        ea: None,
        ea_end: None,
        rest_curvature: [0.0; 2],
        rest_curvature_end: None,
        rest_twist: 0.0,
    }
}

/// A load at the end.
pub(crate) fn at_end(kind: LoadKind, value: [f64; 3]) -> Load {
    Load { kind, at: None, from: None, to: None, value }
}

/// Observed order of convergence: between the finest two meshes, halved from `elements`, on which the error is above
/// `digits`, the accuracy of reference and computation.
pub(crate) fn observed_order(
    elements: usize,
    digits: f64,
    error: impl Fn(usize) -> Result<f64>,
) -> Result<Option<f64>> {
    let mut n = elements;
    let mut fine = error(n)?;
    while n >= 16 {
        let coarse = error(n / 2)?;
        if fine > digits {
            return Ok(Some((coarse / fine).log2()));
        }
        (n, fine) = (n / 2, coarse);
    }
    Ok(None)
}

//! Starts all compared methods, of the core and from the literature, in the same way.

use crate::{at_end, unit_rod};
use endowire_core::device::Device;
use endowire_core::insertion::{Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::statics::LoadKind;
use endowire_core::vessel::Wall;
use endowire_core::{Error, Result, Vec3};
use endowire_methods::li2011::{Chain, ContactReading, Li2011Options, TangentReading, banded, dense};
use endowire_methods::{AnyMethod, static_model};

use crate::studies::{PRINTED, TRIANGLE};

/// Tolerance of `kirchhoff` that is comparable with those of the others in an insertion. They may leave a total force
/// of 0.01 EI/L² out of balance ([`endowire_methods::InsertionOptions`]); this is the fraction of the largest force
/// that may remain at a node, and walls push with up to 24 EI/L² in these scenes.
pub const INSERTION_TOLERANCE: f64 = 1e-4;

/// Creates a simulation of a device in a vessel by `method`, with elements of `element_mm` and the method's own
/// tolerance.
///
/// # Errors
/// Those of the method or the simulation.
pub fn insertion(
    method: &str,
    element_mm: f64,
    wall: Wall,
    properties: WallProperties,
    device: Device,
    sheath: Sheath,
) -> Result<Simulation> {
    let tolerance = KirchhoffOptions::default().tolerance;
    insertion_within(method, (element_mm, tolerance), wall, properties, device, sheath)
}

/// The same with a tolerance for `kirchhoff`.
pub fn insertion_within(
    method: &str,
    (element_mm, tolerance): (f64, f64),
    wall: Wall,
    properties: WallProperties,
    device: Device,
    sheath: Sheath,
) -> Result<Simulation> {
    let mut choice = named(method)?.with_element_mm(element_mm);
    match &mut choice {
        AnyMethod::Kirchhoff(options) => options.tolerance = tolerance,
        // Li et al. define wall stiffness per node: the modulus times the element length gives the same wall.
        AnyMethod::Li2011Dense(options) | AnyMethod::Li2011Banded(options) => {
            options.wall_stiffness_n_per_mm = properties.modulus_n_per_mm2 * element_mm;
        }
        _ => {}
    }
    Simulation::builder(wall, device, sheath).properties(properties).method(&choice).build()
}

/// The method of a candidate: by name, or a variant of the paper's method.
///
/// # Errors
/// An unknown name.
pub fn named(candidate: &str) -> Result<AnyMethod> {
    let readings = match candidate {
        TRIANGLE => Some(TangentReading::Unit),
        PRINTED => Some(TangentReading::Free),
        _ => None,
    };
    match readings {
        Some(tangents) => Ok(AnyMethod::Li2011Banded(Li2011Options {
            tangents,
            contact: ContactReading::Triangle,
            ..Default::default()
        })),
        None => AnyMethod::named(candidate),
    }
}

/// Limits of a static solve by the paper's method with unit tangents: the largest number of inputs, the number of
/// initial inputs over which the load grows linearly, and the tip motion, relative to the length, below which an
/// input is the last.
const STATIC_INPUTS: (usize, usize) = (200, 10);
const STATIC_MOTION: f64 = 1e-10;

/// Tip and number of inputs of a cantilever by the paper's method with unit tangents. Each input is one linear solve
/// with the tangents of the previous one.
fn unit_cantilever(
    mut chain: Chain,
    force: Vec3,
    solve: impl Fn(&Chain, &mut Vec<Vec3>, &mut Vec<Vec3>),
) -> Result<(Vec3, usize)> {
    let last = chain.elements() - 1;
    let (mut x, mut t) = (Vec::new(), Vec::new());
    chain.directions = vec![chain.start_tangent; chain.elements()];
    let mut tip = Vec3::zeros();
    for input in 1..=STATIC_INPUTS.0 {
        chain.forces_n[last] = force * (input as f64 / STATIC_INPUTS.1 as f64).min(1.0);
        solve(&chain, &mut x, &mut t);
        chain.normalise(&mut t, &mut x);
        chain.directions.clone_from(&t);
        let motion = (x[last] - tip).norm();
        tip = x[last];
        if input > STATIC_INPUTS.1 && motion < STATIC_MOTION {
            return Ok((tip, input));
        }
    }
    Err(Error::Computation(format!("li2011: no equilibrium after {} inputs", STATIC_INPUTS.0)))
}

/// Out-of-balance force of a static solve on n elements, in EI/L² times 1/n²: below the discretisation error.
const STATIC_TOLERANCE: f64 = 0.5;

/// Tip and iterations of a cantilever of unit length and stiffness along x under the dead load (0, −a, 0).
///
/// # Errors
/// A solve without an equilibrium.
pub fn cantilever(method: &str, elements: usize, a: f64) -> Result<(Vec3, usize)> {
    match method {
        "kirchhoff" => {
            let mut case = unit_rod(elements);
            case.load = vec![at_end(LoadKind::Force, [0.0, -a, 0.0])];
            // The error of these elements is of order 4, that of the others of order 2; the out-of-balance force is
            // chosen accordingly and, as theirs, shared among the nodes. The solver's own tolerance is relative to
            // the sum of the force a and the moment, at most a, in the rod.
            let n = elements as f64;
            let out_of_balance = (STATIC_TOLERANCE / (n * n)).powi(2);
            case.solver.tolerance = (out_of_balance / n / (2.0 * a)).max(case.solver.tolerance);
            let solution = case.solve()?.checked()?;
            Ok((Vec3::from(solution.tip), solution.iterations))
        }
        "li2011-dense" | "li2011-banded" | TRIANGLE | PRINTED => {
            let mut chain = Chain::uniform(Vec3::zeros(), Vec3::x(), 1.0, elements, 1.0);
            let force = Vec3::new(0.0, -a, 0.0);
            let solve_banded = |chain: &Chain, x: &mut Vec<Vec3>, t: &mut Vec<Vec3>| {
                banded::solve(chain, &mut banded::Workspace::default(), x, t);
            };
            match method {
                "li2011-dense" => unit_cantilever(chain, force, dense::solve),
                PRINTED => {
                    chain.forces_n[elements - 1] = force;
                    let (mut x, mut t) = (Vec::new(), Vec::new());
                    solve_banded(&chain, &mut x, &mut t);
                    Ok((x[elements - 1], 1))
                }
                _ => unit_cantilever(chain, force, solve_banded),
            }
        }
        _ => {
            let model = static_model(method)
                .ok_or_else(|| Error::parameter("method", method, "has no static solution"))?;
            let tolerance = STATIC_TOLERANCE / (elements * elements) as f64;
            let force = Vec3::new(0.0, -a, 0.0);
            let solution = endowire_methods::cantilever(&*model, elements, force, tolerance)?;
            if !solution.converged {
                return Err(Error::Computation(format!(
                    "{method}: no equilibrium with {elements} elements after {} iterations",
                    solution.iterations
                )));
            }
            Ok((solution.nodes[elements], solution.iterations))
        }
    }
}

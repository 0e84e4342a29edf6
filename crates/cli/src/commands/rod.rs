//! `endowire rod`: one static rod.

use endowire_core::statics::{Reaction, StaticCase, StaticSolution};
use serde::Serialize;

use crate::args::RodArgs;
use crate::failure::Failure;
use crate::output::answer;
use crate::output::provenance::{Provenance, read_input};

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    case: String,
    #[serde(flatten)]
    solution: StaticSolution,
}

/// Solves the case and prints the solution, even if it is not an equilibrium.
pub(crate) fn rod(args: &RodArgs) -> Result<(), Failure> {
    let provenance = Provenance::new(&[&read_input(&args.case)?], 0);
    let case = StaticCase::from_file(&args.case)?;
    let solution = case.solve().map_err(|e| Failure::from(e).at(args.case.display()))?;
    let document = Document { provenance, case: args.case.display().to_string(), solution };
    answer(&document, args.json, || lines(&document).join("\n"))?;
    match document.solution.failure() {
        Some(reason) => Err(Failure::Computation(format!("{}: {reason}", args.case.display()))),
        None => Ok(()),
    }
}

fn lines(document: &Document) -> Vec<String> {
    let s = &document.solution;
    let verdict = match (s.converged, s.stable) {
        (true, true) => "stable equilibrium".to_owned(),
        (true, false) => format!("unstable equilibrium, {} unstable directions", s.negative_modes),
        (false, _) => "no equilibrium".to_owned(),
    };
    let mut lines = vec![
        format!("{}: {verdict}", document.case),
        format!("  solver        {} iterations, residual {:.1e}: {}", s.iterations, s.residual, s.stop),
        format!("  elements      {}", s.tensions.len()),
        format!("  tip           {}", vector(&s.tip)),
        format!("  tip tangent   {}, {:.9} rad from the start's", vector(&s.tip_tangent), s.tip_angle),
    ];
    if s.twisted && s.instruments.is_empty() {
        lines.push(format!("  twist         {:.9} rad", s.twist));
    }
    let e = &s.energy;
    lines.push(format!(
        "  energy        {:.9} = bend {:.9} + twist {:.9} + axial {:.9}; load {:.9}",
        e.total, e.bend, e.twist, e.axial, e.load
    ));
    lines.extend(reaction("start", &s.reactions.start));
    lines.extend(reaction("end", &s.reactions.end));
    if let Some(force) = s.push_force {
        lines.push(format!("  push force    {force:.9} if the clamped start is a sleeve without friction"));
    }
    lines.extend(s.instruments.iter().map(|i| {
        let push = i.push_force.map_or("jumps here".to_owned(), |force| format!("{force:.9}"));
        format!(
            "  {:<13} {} beyond the start, tip {}, twist {:.9} rad, push force {push}, torque {:.9}",
            i.name,
            i.inserted,
            vector(&i.tip),
            i.twist,
            i.torque
        )
    }));
    lines
}

fn reaction(end: &str, r: &Reaction) -> Option<String> {
    (*r != Reaction::default()).then(|| {
        format!(
            "  {end:<5} exerts  force {}, moment {}, torque {:.6}",
            vector(&r.force),
            vector(&r.moment),
            r.torque
        )
    })
}

fn vector(v: &[f64; 3]) -> String {
    // Values that round to zero are printed without a sign.
    let [x, y, z] = v.map(|c| if c.abs() < 5e-10 { 0.0 } else { c });
    format!("[{x:.9}, {y:.9}, {z:.9}]")
}

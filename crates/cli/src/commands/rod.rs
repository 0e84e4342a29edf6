//! `endowire rod`: one static rod.

use endowire_core::statics::{Reaction, StaticCase, StaticSolution};
use serde::Serialize;

use crate::args::RodArgs;
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::{print_json, printable};

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
    if args.json {
        print_json(&document)?;
    } else {
        print_solution(&document);
    }
    match document.solution.failure() {
        Some(reason) => Err(Failure::Computation(format!("{}: {reason}", args.case.display()))),
        None => Ok(()),
    }
}

fn print_solution(document: &Document) {
    let s = &document.solution;
    let verdict = match (s.converged, s.stable) {
        (true, true) => "stable equilibrium".to_owned(),
        (true, false) => format!("unstable equilibrium, {} unstable directions", s.negative_modes),
        (false, _) => "no equilibrium".to_owned(),
    };
    println!("{}: {verdict}", printable(&document.case));
    println!("  solver        {} iterations, residual {:.1e}: {}", s.iterations, s.residual, s.stop);
    println!("  elements      {}", s.tensions.len());
    println!("  tip           {}", vector(&s.tip));
    println!("  tip tangent   {}, {:.9} rad from the start's", vector(&s.tip_tangent), s.tip_angle);
    if s.twisted && s.instruments.is_empty() {
        println!("  twist         {:.9} rad", s.twist);
    }
    let e = &s.energy;
    println!(
        "  energy        {:.9} = bend {:.9} + twist {:.9} + axial {:.9}; load {:.9}",
        e.total, e.bend, e.twist, e.axial, e.load
    );
    print_reaction("start", &s.reactions.start);
    print_reaction("end", &s.reactions.end);
    if let Some(force) = s.push_force {
        println!("  push force    {force:.9} if the clamped start is a sleeve without friction");
    }
    for i in &s.instruments {
        let push = i.push_force.map_or("jumps here".to_owned(), |force| format!("{force:.9}"));
        println!(
            "  {:<13} {} beyond the start, tip {}, twist {:.9} rad, push force {push}, torque {:.9}",
            printable(&i.name),
            i.inserted,
            vector(&i.tip),
            i.twist,
            i.torque
        );
    }
}

fn print_reaction(end: &str, r: &Reaction) {
    if *r == Reaction::default() {
        return;
    }
    println!(
        "  {end:<5} exerts  force {}, moment {}, torque {:.6}",
        vector(&r.force),
        vector(&r.moment),
        r.torque
    );
}

fn vector(v: &[f64; 3]) -> String {
    // Values that round to zero are printed without a sign.
    let [x, y, z] = v.map(|c| if c.abs() < 5e-10 { 0.0 } else { c });
    format!("[{x:.9}, {y:.9}, {z:.9}]")
}

//! What hands have done as a script, which does it again to the bit: motions, how fast they were, and contrast medium.

use std::fmt::Write as _;

use endowire_core::device::Stack;

use crate::hand::Motion;
use crate::history::{Done, Injected};

/// Least increment of a line, mm and degrees: less than that a line does in one step.
const LEAST: f64 = 1e-9;

/// Steps with what was injected between them, by steps rising. Alike steps in a row are one line where that has the same bits.
pub(crate) fn script<'a>(
    steps: &[Done],
    injected: impl Iterator<Item = &'a Injected>,
    stack: &Stack,
) -> String {
    let mut text = String::new();
    let mut told = 0;
    for one in injected {
        lines(&mut text, &steps[told..one.after_step], stack);
        told = one.after_step;
        inject(&mut text, one, stack);
    }
    lines(&mut text, &steps[told..], stack);
    text
}

fn lines(text: &mut String, steps: &[Done], stack: &Stack) {
    for run in steps.chunk_by(|a, b| a == b) {
        let mut left = run.len();
        while left > 0 {
            let count = (1..=left).rev().find(|count| cuts_evenly(&run[0].motions, *count)).unwrap_or(1);
            line(text, stack, &run[0], count);
            left -= count;
        }
    }
}

/// Whether a line of `count` times these motions is cut into them to the bit (see `Motion::steps` of scripts).
fn cuts_evenly(motions: &[Motion], count: usize) -> bool {
    let share = 1.0 / count as f64;
    let small = |value: f64| value != 0.0 && value.abs() < LEAST;
    motions.iter().all(|one| {
        if small(one.advance_mm) || small(one.rotate_deg) {
            return count == 1;
        }
        let whole_mm = one.advance_mm * count as f64;
        let whole_deg = one.rotate_deg * count as f64;
        whole_mm * share == one.advance_mm && whole_deg.to_radians() * share == one.rotate_deg.to_radians()
    })
}

/// Writes a line of a script.
fn line(text: &mut String, stack: &Stack, Done { motions, per_s }: &Done, count: usize) {
    let keys = |one: &Motion| {
        let mut keys = Vec::new();
        if stack.is_several() {
            keys.push(format!("instrument = {:?}", stack.instruments()[one.instrument].name));
        }
        let key = if one.advance_mm < 0.0 { "retract_mm" } else { "advance_mm" };
        if one.advance_mm != 0.0 {
            keys.push(format!("{key} = {:?}", one.advance_mm.abs() * count as f64));
            keys.push(format!("step_mm = {:?}", one.advance_mm.abs().max(LEAST)));
            keys.push(format!("speed_mm_per_s = {:?}", one.advance_mm.abs() * per_s));
        }
        if one.rotate_deg != 0.0 {
            keys.push(format!("rotate_deg = {:?}", one.rotate_deg * count as f64));
            keys.push(format!("step_deg = {:?}", one.rotate_deg.abs().max(LEAST)));
            keys.push(format!("speed_deg_per_s = {:?}", one.rotate_deg.abs() * per_s));
        }
        keys
    };
    let Some((first, others)) = motions.split_first() else { return };
    let with: Vec<String> = others.iter().map(|one| format!("{{ {} }}", keys(one).join(", "))).collect();
    // Writing into a string cannot fail.
    let _ = writeln!(text, "[[script]]\n{}", keys(first).join("\n"));
    if !with.is_empty() {
        let _ = writeln!(text, "with = [{}]", with.join(", "));
    }
    text.push('\n');
}

/// Writes a line that injects, or says why there is none.
fn inject(text: &mut String, one: &Injected, stack: &Stack) {
    let (ml, ml_per_s) = (one.ml, one.ml_per_s);
    let _ = match one.instrument {
        Some(instrument) if stack.is_several() => {
            let through = &stack.instruments()[instrument].name;
            writeln!(
                text,
                "[[script]]\ninject = {{ ml = {ml:?}, ml_per_s = {ml_per_s:?}, through = {through:?} }}\n"
            )
        }
        Some(_) => writeln!(text, "[[script]]\ninject = {{ ml = {ml:?}, ml_per_s = {ml_per_s:?} }}\n"),
        None => writeln!(
            text,
            "# {ml:?} ml were injected here through the sheath, for which a script has no line.\n"
        ),
    };
}

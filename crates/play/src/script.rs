//! Writes a session as a script that repeats it to the bit: motions, their speeds, and contrast medium.

use std::fmt::Write as _;
use std::path::Path;

use endowire_core::device::Stack;
use endowire_methods::Setting;

use crate::hand::Motion;
use crate::history::{Done, Injected};

/// Smallest step of a script line, mm, degrees and of the steering: a smaller motion is a single step.
const LEAST: f64 = 1e-9;

/// The head of a script to be saved as `file`: its scene, and the command that carries it out with these settings.
pub fn script_head(scene: &Path, settings: &[Setting], file: &Path) -> String {
    // A line break in a name would end the comment.
    let shown = |path: &Path| path.display().to_string().replace(char::is_control, " ");
    let set = settings.iter().filter(|setting| setting.key.begins() != "script");
    let set: String =
        set.map(|setting| format!(" --set '{setting}'").replace(char::is_control, " ")).collect();
    format!(
        "# What hands have done in {0}; carried out again by\n# endowire run {0} --script {1}{set}\n\n",
        shown(scene),
        shown(file)
    )
}

/// Converts steps to script lines.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lines<'a> {
    pub(crate) stack: &'a Stack,
    /// Whether results depend on time; lines then reproduce times to the bit too.
    pub(crate) timed: bool,
}

impl Lines<'_> {
    /// The script of steps with the injections between them, in order. Equal consecutive steps become one line if
    /// that gives the same bits.
    pub(crate) fn of<'a>(self, steps: &[Done], injected: impl Iterator<Item = &'a Injected>) -> String {
        let (mut text, mut steered) = (String::new(), vec![0.0; self.stack.instruments().len()]);
        let mut reported = 0;
        for one in injected {
            self.write(&mut text, &mut steered, &steps[reported..one.after_step]);
            reported = one.after_step;
            inject(&mut text, one, self.stack);
        }
        self.write(&mut text, &mut steered, &steps[reported..]);
        text
    }

    /// Writes steps that begin with instruments steered to these values.
    fn write(self, text: &mut String, steered: &mut [f64], steps: &[Done]) {
        for run in steps.chunk_by(|a, b| a == b) {
            let mut left = run.len();
            while left > 0 {
                let count = (1..=left).rev().find(|count| self.cuts_evenly(&run[0], *count)).unwrap_or(1);
                for one in &run[0].motions {
                    steered[one.instrument] += one.steer * count as f64;
                }
                line(text, (self.stack, steered), &run[0], count);
                if let Some(instrument) = run[0].detach {
                    steered[instrument] = 0.0;
                }
                left -= count;
            }
        }
    }

    /// Whether a line of `count` such steps is divided into exactly these steps.
    fn cuts_evenly(self, step: &Done, count: usize) -> bool {
        if step.detach.is_some() {
            return count == 1;
        }
        moves_evenly(&step.motions, count) && !(self.timed && step_s(step, count) != step_s(step, 1))
    }
}

/// Duration, s, of each step of a line of `count` such steps, with the same bits as in `Motion::steps` of scripts.
pub(crate) fn step_s(Done { motions, per_s, .. }: &Done, count: usize) -> f64 {
    let many = count as f64;
    let each = motions.iter().map(|one| {
        let (mm, deg) = (one.advance_mm.abs(), (one.rotate_deg * many).to_radians().to_degrees().abs());
        let length_s = if mm == 0.0 { 0.0 } else { mm * many / (mm * per_s) };
        let steer = one.steer.abs();
        let steers_s = if steer == 0.0 { 0.0 } else { steer * many / (steer * per_s) };
        let turns_s = if deg == 0.0 { 0.0 } else { deg / (one.rotate_deg.abs() * per_s) };
        length_s.max(turns_s).max(steers_s)
    });
    let duration_s = if motions.is_empty() { many / per_s } else { each.fold(0.0, f64::max) };
    duration_s * (1.0 / many)
}

/// The same for the motions alone (see `Motion::steps` of scripts).
fn moves_evenly(motions: &[Motion], count: usize) -> bool {
    let share = 1.0 / count as f64;
    let small = |value: f64| value != 0.0 && value.abs() < LEAST;
    motions.iter().all(|one| {
        if small(one.advance_mm) || small(one.rotate_deg) || small(one.steer) {
            return count == 1;
        }
        let whole_mm = one.advance_mm * count as f64;
        let whole_deg = one.rotate_deg * count as f64;
        whole_mm * share == one.advance_mm
            && whole_deg.to_radians() * share == one.rotate_deg.to_radians()
            && (one.steer * count as f64) * share == one.steer
    })
}

/// Writes a line of a script, at whose end instruments are steered to these values.
fn line(
    text: &mut String,
    (stack, steered): (&Stack, &[f64]),
    Done { motions, per_s, detach, solves }: &Done,
    count: usize,
) {
    if let Some(instrument) = detach {
        let name = &stack.instruments()[*instrument].name;
        let key = if stack.is_several() { format!("instrument = {name:?}\n") } else { String::new() };
        // Writing into a string cannot fail.
        let _ = writeln!(text, "[[script]]\n{key}detach = true\n");
        return;
    }
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
        if one.steer != 0.0 {
            keys.push(format!("steer = {:?}", steered[one.instrument]));
            keys.push(format!("step_steer = {:?}", one.steer.abs().max(LEAST)));
            keys.push(format!("speed_steer_per_s = {:?}", one.steer.abs() * per_s));
        }
        keys
    };
    let of_tick = solves.map_or(String::new(), |solves| format!("\nsolves = {solves}"));
    let Some((first, others)) = motions.split_first() else {
        let (wait_s, step_s) = (count as f64 / per_s, 1.0 / per_s);
        let _ = writeln!(text, "[[script]]\nwait_s = {wait_s:?}\nstep_s = {step_s:?}{of_tick}\n");
        return;
    };
    let with: Vec<String> = others.iter().map(|one| format!("{{ {} }}", keys(one).join(", "))).collect();
    let _ = writeln!(text, "[[script]]\n{}{of_tick}", keys(first).join("\n"));
    if !with.is_empty() {
        let _ = writeln!(text, "with = [{}]", with.join(", "));
    }
    text.push('\n');
}

/// Writes an injection, or a comment if a script cannot express it.
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

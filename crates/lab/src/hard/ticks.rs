//! The same hand motion in steps, in ticks with enough solves, in ticks of a few, and in small steps.

use std::path::Path;

use endowire_core::Result;
use endowire_core::insertion::{Command, Move, Simulation};
use endowire_core::scene::Scene;
use endowire_core::vessel::NoStore;

use super::course::Course;

/// Devices of the assets.
const DEVICES: [&str; 2] = ["wire_035_shaped", "wire_035_hooked"];
/// Coefficients of friction.
const FRICTIONS: [f64; 4] = [0.1, 0.3, 0.5, 0.8];
/// Number of commands, their advance, mm, and the turn of every seventh, rad.
const COMMANDS: usize = 90;
const ADVANCE_MM: f64 = 3.0;
const TURN_RAD: f64 = 0.3;
/// Number of small steps in a command.
const PARTS: usize = 12;
/// Solves of a tick that are enough for any command, and those of one at 1 kHz.
const ENOUGH: usize = 1_000_000;
const FEW: usize = 8;
/// Largest distance of tips without a jump that both report, mm.
const APART_MM: f64 = 0.5;

fn simulation(repository: &Path, device: &str, friction: f64) -> Result<Simulation> {
    let text = format!(
        "[vessel]\ntree = \"vessels/aortic_arch.csv\"\nedge_mm = 3.0\n[vessel.wall]\nmodulus_n_per_mm2 = 1.0\nfriction = {friction}\n\
         [device]\nfile = \"devices/{device}.toml\"\n[sheath]\nopening = 1\n[method]\nname = \"kirchhoff\"\n"
    );
    let assets = repository.join("assets/scene.toml");
    Scene::from_toml(&text, &assets)?.simulation(&NoStore)
}

/// Ticks that take up a command, and what they leave over.
fn tick(course: &mut Course, moves: &[Move], solves: usize) {
    course.tick(moves, solves);
    while course.end.is_none() && course.simulation.report().is_under_way() {
        course.tick(&[], solves);
    }
}

/// Courses in which ticks are not steps, or end elsewhere than small steps without a reported jump.
pub(super) fn ticks(repository: &Path, only: Option<&str>, say: &mut dyn FnMut(String)) -> Result<usize> {
    say("device             friction  ticks = steps  apart mm: steps  few solves  jumps: steps  ticks  few  small"
        .to_owned());
    let mut wrong = 0;
    for device in DEVICES.iter().filter(|name| only.is_none_or(|only| name.contains(only))) {
        for friction in FRICTIONS {
            let start = simulation(repository, device, friction)?;
            let [mut stepping, mut ticking, mut few, mut small] =
                [(); 4].map(|()| Course::new(start.clone()));
            for k in 0..COMMANDS {
                let rotate_rad = if k % 7 == 0 { TURN_RAD } else { 0.0 };
                let command = Command { advance_mm: ADVANCE_MM, rotate_rad, ..Command::default() };
                let moves = [Move { instrument: 0, command }];
                stepping.go(&moves, None, 1);
                small.go(&moves, None, PARTS);
                tick(&mut ticking, &moves, ENOUGH);
                tick(&mut few, &moves, FEW);
            }
            let same = stepping.simulation.shape() == ticking.simulation.shape()
                && stepping.jumps == ticking.jumps
                && stepping.end.is_some() == ticking.end.is_some();
            let apart_mm = [&stepping, &few].map(|course| course.apart_mm(&small));
            let is_reported = [&stepping, &few].map(|course| course.jumps > 0 || small.jumps > 0);
            let stays =
                apart_mm.iter().zip(is_reported).all(|(mm, is_reported)| *mm <= APART_MM || is_reported);
            wrong += usize::from(!(same && stays));
            say(format!(
                "{device:18} {friction:8.1} {:>14} {:16.3} {:11.3} {:13} {:6} {:4} {:6}",
                if same { "yes" } else { "NO" },
                apart_mm[0],
                apart_mm[1],
                stepping.jumps,
                ticking.jumps,
                few.jumps,
                small.jumps
            ));
        }
    }
    Ok(wrong)
}

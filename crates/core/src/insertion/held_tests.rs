//! Derivatives against differences at fixed contacts: equilibria solved anew in the same parts, with the same contacts and triads.

use super::gradient_tests::{Numbers, SCENES, half, parameters, simulation, then_s};
use super::{Move, Simulation};
use crate::methods::{Gradient, Parameter};

/// Largest error of 99 in 100, and of all, relative to the derivative of tip, push force, torques and energy together, or to how a hundredth of them changes if the
/// parameter doubles.
const MOST: [f64; 2] = [1e-6, 1e-5];
/// The same of all by the direction of the sheath where something rubs: what is missing there is not known.
const BY_DIRECTION: f64 = 1e-3;

/// Errors, and how far derivatives by other parameters would be off.
#[derive(Default)]
struct Compared {
    errors: Vec<f64>,
    others: Vec<f64>,
    /// By the direction of the sheath, with friction.
    directions: Vec<f64>,
    /// Not compared, since another mesh is there.
    left_out: usize,
    states: usize,
}

impl Compared {
    /// The error that this part of all does not exceed.
    fn at(&mut self, part: f64) -> f64 {
        self.errors.sort_by(f64::total_cmp);
        self.errors[(part * (self.errors.len() - 1) as f64) as usize]
    }

    fn is_exact(&mut self) -> bool {
        let turned = self.directions.iter().all(|off| *off < BY_DIRECTION);
        turned && self.at(0.99) < MOST[0] && self.at(1.0) < MOST[1]
    }

    fn told(&mut self) -> String {
        let [half, most, nearly_all, all] = [0.5, 0.9, 0.99, 1.0].map(|part| self.at(part));
        let Self { errors, directions, left_out, states, .. } = self;
        let turned = directions.iter().fold(0.0, |most: f64, off| most.max(*off));
        format!(
            "{} derivatives in {states} states, {left_out} not compared: errors 50 % {half:.1e}, 90 % {most:.1e}, 99 % {nearly_all:.1e}, \
             largest {all:.1e}; by the sheath's direction with friction {turned:.1e}",
            errors.len()
        )
    }
}

/// Tip, push forces, torques and energy.
fn list(one: &Gradient) -> Vec<f64> {
    let one = &one.slopes[0];
    let pushes = one.push_force_n.iter().map(|push_n| push_n.unwrap_or(0.0));
    let forces = pushes.chain(one.torque_nmm.iter().copied());
    compared(one.tip_mm.iter().copied().chain(forces).chain([one.energy_mj]).collect(), one.torque_nmm.len())
}

/// What is compared of these: push forces of several instruments are differences themselves, with fewer digits.
fn compared(mut all: Vec<f64>, hands: usize) -> Vec<f64> {
    all.truncate(3 + 2 * hands + 1);
    if hands > 1 {
        all.drain(3..3 + hands);
    }
    all
}

fn size(list: &[f64]) -> f64 {
    list.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Compares the derivatives of one command.
fn compare(now: &Simulation, (moves, time_s): (&[Move], f64), by: &[Parameter], all: &mut Compared) {
    let recording = now.record(&[moves.to_vec()], &[time_s]).unwrap();
    let along = now.sheath().direction;
    let mut before: Option<Vec<f64>> = None;
    all.states += 1;
    for parameter in by {
        // What is changed along the sheath is not changed at all.
        if matches!(*parameter, Parameter::EntryDirection { axis } if along[axis].abs() > 0.9) {
            continue;
        }
        let own = list(&recording.jvp(&[(*parameter, 1.0)]).unwrap()[0]);
        // Two central differences, and what both lead to without their errors of the second order.
        let h = half(*parameter);
        let led: crate::Result<Vec<Vec<f64>>> = [-h, -0.5 * h, 0.5 * h, h]
            .iter()
            .map(|by| Ok(compared(recording.solved((*parameter, *by))?.remove(0), moves.len())))
            .collect();
        let Ok(led) = led else {
            all.left_out += 1;
            continue;
        };
        let differences: Vec<f64> = (0..own.len())
            .map(|i| {
                let [far, near] = [(0, 3, 2.0 * h), (1, 2, h)].map(|(a, b, by)| (led[b][i] - led[a][i]) / by);
                (4.0 * near - far) / 3.0
            })
            .collect();
        let value = now.value(parameter).unwrap().map_or(1.0, |value| value.abs().max(1e-3));
        let whole = size(&differences).max(1e-2 / value);
        let off = |own: &[f64]| {
            let off: Vec<f64> = differences.iter().zip(own).map(|(a, b)| a - b).collect();
            size(&off) / whole
        };
        if off(&own) > MOST[0] {
            println!("{parameter:?}: {:.1e} of {whole:.1e}", off(&own));
        }
        let is_direction =
            matches!(*parameter, Parameter::EntryDirection { .. }) && by.contains(&Parameter::WallFriction);
        let errors = if is_direction { &mut all.directions } else { &mut all.errors };
        errors.push(off(&own));
        all.others.extend(before.replace(own).map(|before| off(&before)));
    }
}

/// Compares after every third of random commands but the first nine.
fn compare_scene(scene: usize, (steps, seed): (usize, u64), compared: &mut Compared) {
    let mut now = simulation(SCENES[scene]);
    let hands = now.stack().instruments().len();
    let by = parameters(hands, SCENES[scene].friction);
    let mut numbers = Numbers(seed);
    for k in 0..steps {
        let (moves, time_s) = (numbers.moves(hands), then_s(&now));
        if k > 8 && k % 3 == 0 {
            compare(&now, (&moves, time_s), &by, compared);
        }
        now.step_until(&moves, Some(time_s)).unwrap();
    }
}

#[test]
fn derivatives_are_those_of_equilibria_at_the_same_contacts() {
    for scene in 0..SCENES.len() {
        let mut compared = Compared::default();
        compare_scene(scene, (13, 0), &mut compared);
        let told = compared.told();
        println!("{:?}: {told}", SCENES[scene]);
        assert!(compared.errors.len() > 20 && compared.is_exact(), "{told}");
        // Those of the parameter before it are others.
        assert!(compared.others.iter().filter(|off| **off > 0.1).count() > 20, "{:?}", compared.others);
    }
}

/// `cargo test -p endowire-core --lib at_the_same_contacts_in_two_hundred_states -- --ignored --nocapture`.
#[test]
#[ignore = "takes minutes: measures"]
fn derivatives_at_the_same_contacts_in_two_hundred_states() {
    let mut all = Compared::default();
    for scene in 0..SCENES.len() {
        let mut compared = Compared::default();
        for seed in 0..10 {
            compare_scene(scene, (21, 1000 * seed), &mut compared);
        }
        println!("{:?}: {}", SCENES[scene], compared.told());
        all.errors.extend(&compared.errors);
        all.directions.extend(&compared.directions);
        (all.states, all.left_out) = (all.states + compared.states, all.left_out + compared.left_out);
    }
    let told = all.told();
    println!("all: {told}");
    assert!(all.states >= 200 && all.is_exact(), "{told}");
}

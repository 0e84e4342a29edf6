//! The rows of the table: what is taken out, and which numbers are changed.

use endowire_core::tuning::Tuning;
use endowire_core::{Error, Result};

/// A change of one number, or of the few that make up a mechanism.
pub(super) struct Row {
    /// The part of the solver that it belongs to.
    pub(super) group: &'static str,
    pub(super) name: String,
    pub(super) change: fn(&mut Tuning),
}

/// A mechanism without which scenes are run, and what switches it off.
macro_rules! without {
    ($name:literal, $($part:ident . $field:ident = $value:expr),+) => {
        ($name.to_owned(), (|tuning| { $(tuning.$part.$field = $value;)+ }) as fn(&mut Tuning))
    };
}

/// A number that is changed; its name has the value that it has.
macro_rules! other {
    ($part:ident . $field:ident = $value:expr) => {{
        let (part, field) = (stringify!($part), stringify!($field));
        let name = format!("{part}.{field} {:?} → {:?}", Tuning::default().$part.$field, $value);
        (name, (|tuning| tuning.$part.$field = $value) as fn(&mut Tuning))
    }};
}

/// Far below any slope: Armijo's condition then accepts all trials.
const ALL: f64 = -1e30;
/// Far above any distance and number, but finite.
const FAR: f64 = 1e30;

/// Part of the solver, and its rows.
type Group = (&'static str, Vec<(String, fn(&mut Tuning))>);

#[allow(clippy::too_many_lines, reason = "a table")]
fn groups() -> [Group; 15] {
    [
        (
            "Parts of a command",
            vec![
                without!(
                    "a limit to the distance from the prediction",
                    newton.rooms = FAR,
                    newton.room_rad = FAR
                ),
                other!(newton.rooms = 1.0),
                other!(newton.rooms = 8.0),
                without!("a nearer limit at a saddle", newton.indefinite_rooms = 1.0),
                other!(newton.indefinite_rooms = 0.1),
                other!(newton.room_rad = 0.5),
                other!(newton.room_rad = 3.0),
                other!(steps.nearer = 0.05),
                other!(steps.nearer = 0.5),
                other!(steps.fold_mm = 0.01),
                other!(steps.fold_mm = 0.2),
                without!("a part that may end in a snap", steps.snap_radii = 0.0),
                other!(steps.snap_radii = 0.5),
                other!(steps.snap_radii = 5.0),
                other!(steps.least_mm = 1e-2),
            ],
        ),
        (
            "What is given up",
            vec![
                without!("a solution that strays", newton.stray = f64::INFINITY),
                other!(newton.stray = 1.0),
                without!("a solution that takes many iterations", steps.most_near = 500),
                other!(steps.most_near = 30),
                other!(steps.most_near = 120),
            ],
        ),
        (
            "A course that yields",
            vec![
                without!("steps that go back", course.rises = FAR),
                other!(course.rises = 0.1),
                without!("steps that are halved", course.least_part = 1.0),
                other!(course.least_part = 0.0625),
                other!(course.narrows = 0.25),
                other!(course.near_enough = 0.01),
                other!(course.most_radii = 1.0),
                other!(course.most_radii = 4.0),
                other!(course.most_turn_rad = 0.1),
                other!(course.most_turn_rad = 1.0),
                without!("more work where the course yields", steps.work_of_course = 1.0),
            ],
        ),
        ("The prediction", vec![without!("what the last step changed", steps.repeats = false)]),
        (
            "Friction near a fold",
            vec![
                without!("friction that is held", steps.held_mm = 0.0),
                other!(steps.held_mm = 0.1),
                other!(steps.held_mm = 2.0),
                without!("friction that follows what was held", steps.following = 0),
                other!(steps.following = 10),
                other!(steps.following = 60),
                without!("slides while the hand holds still", steps.slides = 0),
                other!(steps.slides = 20),
            ],
        ),
        (
            "Friction",
            vec![
                without!("renewals of drag and of forces between instruments", steps.lagged_renewals = 0),
                other!(steps.lagged_renewals = 5),
                other!(friction.stick = 1e-4),
                other!(friction.stick = 1e-2),
                without!("slip that shrinks while the hand holds still", friction.stick_at_rest = 1.0),
                other!(friction.stick_at_rest = 0.1),
                other!(friction.least_at_rest = 1e-3),
                other!(friction.least_at_rest = 0.1),
                without!(
                    "friction at the end of a step",
                    friction.changed = f64::INFINITY,
                    friction.renewed = f64::INFINITY
                ),
                without!("further rounds of a step for friction alone", friction.changed = f64::INFINITY),
                other!(friction.changed = 0.01),
                other!(friction.renewed = 0.05),
                other!(friction.settled = 1e-5),
                other!(friction.settled = 1e-3),
                without!("own normal forces near the tip", friction.tip_radii = 0.0),
                without!("normal forces that stay where the wall is", friction.tip_radii = FAR),
                other!(friction.tip_radii = 30.0),
                without!("iterations for friction between instruments", friction.lateral_rounds = 1),
                other!(friction.lateral_rounds = 4),
                other!(friction.grip_radii = 0.1),
                other!(friction.grip_radii = 10.0),
            ],
        ),
        (
            "Contacts",
            vec![
                without!("contacts at the end of a step", newton.contact_rounds = 0),
                other!(newton.contact_rounds = 10),
                other!(newton.contact_rounds = 30),
                other!(newton.contact_turn_rad = 0.5),
                other!(newton.searched = 1e-1),
                other!(newton.searches = 10),
                without!("cuts of trials before the wall", newton.safe_cuts = 0),
                other!(newton.safe_cuts = 1),
                without!("the test for a way through the wall", steps.tests_passing = false),
                other!(contact.penalty = 0.01),
                other!(contact.penalty = 1.0),
                other!(contact.steepest = 1.0),
                other!(contact.steepest = 4.0),
                other!(contact.safe = 0.5),
                other!(contact.safe = 0.99),
                without!("the side of the wall of what has sunk in", contact.sunk = -FAR),
                other!(contact.sunk = 0.1),
                other!(contact.sunk = 0.6),
                without!("the refusal of deeper predictions", contact.deeper = FAR),
                other!(contact.deeper = 0.1),
                other!(contact.gentlest_bend_mm = 30.0),
                other!(contact.gentlest_bend_mm = 300.0),
            ],
        ),
        (
            "Distances from the wall",
            vec![
                other!(contact.follow = 0.25),
                other!(contact.follow = 1.0),
                without!("what was found nearby", contact.look_again = 0.0),
                other!(contact.look_again = 0.25),
                other!(contact.look_again = 1.0),
                without!("a reach beyond what is needed", contact.look_mm = 0.0),
                other!(contact.look_mm = 2.0),
                without!("searches that grow", contact.farther = 0),
                other!(contact.farther_by = 2.0),
            ],
        ),
        (
            "Loops and coils",
            vec![
                without!("the resistance of detached coils", steps.coil_resistance_per_mm4 = 0.0),
                other!(steps.coil_resistance_per_mm4 = 1e-6),
                other!(steps.coil_resistance_per_mm4 = 1e-4),
            ],
        ),
        (
            "Contact between loops",
            vec![
                other!(pairs.spacing_radii = 0.25),
                other!(pairs.spacing_radii = 1.0),
                without!("ends of a stretch at shoulders", pairs.shoulder = FAR),
                other!(pairs.near = 1.1),
                other!(pairs.near = 2.0),
                other!(pairs.known = 3.0),
                without!("bases that need no search", pairs.free = -1.0),
                other!(pairs.free = 1.5),
                other!(pairs.clear = 4.0),
                other!(pairs.clear = 16.0),
                other!(pairs.beyond = 0.01),
                other!(pairs.splits = 4),
                other!(pairs.slide = 0.02),
                other!(pairs.slide = 0.5),
                other!(pairs.window = 1.0),
                other!(pairs.window = 4.0),
                other!(pairs.descents = 10),
                other!(pairs.short = 1e-4),
                other!(pairs.parabolic = 0.5),
                without!("descents that end early", pairs.promised = f64::INFINITY),
                other!(pairs.promised = 2.0),
                other!(pairs.convex = 1e-2),
                without!("forces of pairs from base to base", pairs.same = 0.0),
                other!(pairs.same = 0.5),
                other!(pairs.twice = 1e-2),
            ],
        ),
        (
            "Newton's method",
            vec![
                other!(newton.regularisation = 1e-10),
                other!(newton.regularisation = 1e-6),
                without!("the shift", newton.shifts = 0),
                other!(newton.least_shift = 1e4),
                other!(newton.least_shift = 1e6),
                other!(newton.shift_growth = 2.0),
                other!(newton.shift_growth = 10.0),
                without!("a beginning at a part of the last shift", newton.shift_decay = 0.0),
                other!(newton.shift_decay = 0.5),
                without!("the line search", newton.armijo = ALL),
                other!(newton.armijo = 1e-2),
                other!(newton.trials = 8),
                other!(newton.least_cut = 0.25),
                other!(newton.largest_cut = 0.5),
                other!(newton.largest_turn_rad = 0.7),
                without!("a way out of saddles", newton.saddle_halvings = 0),
                other!(newton.saddle_rad = 0.1),
                other!(newton.saddle_iterations = 2),
                other!(newton.correction_rad = 0.1),
                other!(newton.corrections = 0),
                other!(newton.patience = 2),
                other!(newton.residual_falls = 0.5),
                other!(newton.residual_grows = 1.0),
            ],
        ),
        (
            "The end of an iteration",
            vec![
                without!(
                    "steps with the factors of an earlier state",
                    newton.short_rad = -1.0,
                    newton.near_rad = -1.0
                ),
                without!(
                    "the residual alone where quadratic convergence promises it",
                    newton.near_rad = -1.0
                ),
                other!(newton.quadratic = 100.0),
                other!(newton.chord = 100.0),
                other!(newton.chord = 1.0),
                other!(newton.short_rad = 1e-6),
                other!(newton.stiffening = 1e-1),
                other!(newton.stiffening = 1e-3),
                other!(newton.hidden = 1),
                other!(newton.hidden = 6),
            ],
        ),
        (
            "Energy",
            vec![
                without!("the balance of energy", steps.notable = f64::INFINITY),
                other!(steps.notable = 0.005),
                other!(steps.notable = 0.1),
                other!(steps.notable_floor_mj = 1e-8),
                other!(steps.notable_floor_mj = 1e-4),
            ],
        ),
        (
            "Limits and ticks",
            vec![
                without!("the budget of a command", steps.work = 1e12, steps.work_of_one = usize::MAX),
                other!(steps.work = 140.0),
                other!(steps.work = 560.0),
                other!(steps.work_of_one = 2),
                without!("the solves after which a command ends", steps.solves = usize::MAX),
                other!(steps.solves = 2_000),
                other!(steps.work_rad = 0.02),
                other!(steps.work_steer = 0.01),
                without!("further relaxations at the end of a command", steps.again = 0),
                other!(steps.again = 10),
                other!(steps.rest_radii = 1e-2),
                other!(steps.at_rest = 0.5),
                other!(steps.at_rest = 0.005),
                other!(steps.most_moving = 100),
                other!(steps.longest = 500),
                other!(steps.substep_limit = 256),
                without!("what a part of a tick counts of its own", steps.of_a_part = 0),
                other!(steps.of_a_part = 4),
                without!("the refusal of wedged devices before a flight", passage.wedged = f64::INFINITY),
                other!(passage.wedged = 0.0),
                other!(passage.ahead = 3.0),
                other!(passage.beside = 1.0),
                other!(passage.front = 20),
                other!(passage.most_asked = 100_000),
                other!(passage.spacings = [0.25, 0.25]),
            ],
        ),
        (
            "Elements and contact points",
            vec![
                other!(mesh.largest_turn_rad = 0.25),
                other!(mesh.largest_turn_rad = 0.75),
                other!(mesh.alike = 0.05),
                other!(mesh.alike = 1.0),
                other!(mesh.alike_rad = 0.02),
                other!(mesh.alike_rad = 0.5),
                other!(mesh.tip_spacing_radii = 1.0),
                other!(mesh.tip_spacing_radii = 1.0 / 16.0),
                other!(mesh.fewest_intervals = 1.0),
                other!(mesh.fewest_intervals = 4.0),
            ],
        ),
    ]
}

/// All rows.
///
/// # Errors
/// A row that changes nothing, or has the name of another.
pub(super) fn all() -> Result<Vec<Row>> {
    let mut rows: Vec<Row> = Vec::new();
    for (group, of_group) in groups() {
        for (name, change) in of_group {
            let mut tuning = Tuning::default();
            change(&mut tuning);
            if tuning == Tuning::default() {
                return Err(Error::parameter("row", name, "changes nothing: give another value"));
            }
            if rows.iter().any(|row| row.name == name) {
                return Err(Error::parameter("row", name, "is there twice: leave one out"));
            }
            rows.push(Row { group, name, change });
        }
    }
    Ok(rows)
}

//! Commands as they were carried out, and derivatives of sums of what they lead to, backwards.
//!
//! The parts of the last commands are kept, up to a bound; of those before them only the state in which each begins. Their parts are
//! carried out again when the way back comes to them.

use std::sync::Arc;

use super::super::command::Driven;
use super::super::configuration::{Configuration, Start};
use super::super::hands::{Hand, lengths};
use super::super::workspace::Workspace;
use super::super::{Environment, Kirchhoff, KirchhoffOptions, write_line};
use super::columns::Beside;
use super::linear::Linear;
use super::numbers::{Numbers, Push, Wanted};
use super::recorded::{Piece, Recorder};
use super::{STEP, Scene, scale};
use crate::contact::ContactSurface;
use crate::methods::{
    Command, Margin, Move, Parameter, Passed, Pulled, Slope, StepReport, Surroundings, Tape, Timed, Together,
    Weights,
};
use crate::shape::Shape;
use crate::{Error, Result};

/// How far the next change of a contact is.
fn margin(end: Start<'_>) -> Margin {
    let Start { mesh, state } = end;
    let forces = state.touches.iter().map(|(_, touch)| touch.contact.force_n);
    let radii_mm = mesh.points.iter().map(|point| point.potential.radius_mm);
    Margin {
        least_force_n: forces.fold(f64::INFINITY, f64::min),
        least_gap_mm: state.known.gaps_mm(radii_mm).fold(f64::INFINITY, f64::min),
    }
}

/// Parts that are kept, each some tenths of a megabyte: the bound of memory is about a hundred megabytes.
const MOST_KEPT: usize = 256;

/// A command that was carried out.
pub(super) struct Recorded {
    moves: Vec<Move>,
    time_s: [f64; 2],
    pub(super) from: Configuration,
    way: [Vec<Hand>; 2],
    /// None once dropped; empty where nothing moved.
    pub(super) pieces: Option<Vec<Piece>>,
    pub(super) is_first: bool,
}

/// Commands that were carried out.
pub(super) struct Record<const C: usize> {
    pub(super) options: KirchhoffOptions,
    pub(super) surface: Arc<ContactSurface>,
    pub(super) commands: Vec<Recorded>,
    pub(super) passed: Vec<Passed>,
}

impl<const C: usize> Kirchhoff<C> {
    /// Checks that commands from here have derivatives.
    ///
    /// # Errors
    /// A vessel that yields, loops that touch, detached coils, and earlier commands that are not done.
    fn check_differentiable(&self, surroundings: &Surroundings<'_>) -> Result<()> {
        if surroundings.course.is_some() {
            let remedy = "derivatives of a vessel that yields are not there: leave it out";
            return Err(Error::parameter("vessel.yielding", "given", remedy));
        }
        if self.options.self_contact || !self.state.coils.is_empty() {
            let remedy = "gradients know no contact between loops, and no coils: set it to false";
            return Err(Error::parameter("method.self_contact", self.options.self_contact, remedy));
        }
        if self.state.unfinished.is_some() {
            let remedy = "earlier commands are not done: finish them, or drop them with forget";
            return Err(Error::parameter("gradient", "behind", remedy));
        }
        Ok(())
    }

    /// Carries out commands on a copy, and records them.
    ///
    /// # Errors
    /// As [`Method::record`](crate::methods::Method::record).
    pub(in super::super) fn recorded(
        &self,
        surroundings: &Surroundings<'_>,
        (commands, times_s): Timed<'_>,
        checked: &dyn Fn(&StepReport, &[Move]) -> Result<()>,
    ) -> Result<Box<dyn Tape>> {
        self.check_differentiable(surroundings)?;
        let mut surroundings = *surroundings;
        let environment = Environment::new(&surroundings, &self.surface, &self.options);
        let (mut state, mut report) = (Arc::clone(&self.state), StepReport::clone(&self.report));
        let mut workspace = Workspace::<C>::new(&environment, &state);
        let mut record = Record::<C> {
            options: self.options,
            surface: Arc::clone(&self.surface),
            commands: Vec::with_capacity(commands.len()),
            passed: Vec::with_capacity(commands.len()),
        };
        for (moves, time_s) in commands.iter().zip(times_s) {
            checked(&report, moves)?;
            surroundings.time_s = [surroundings.time_s[1], *time_s];
            let from = Configuration { mesh: workspace.mesh.clone(), state: Arc::clone(&state) };
            let is_first = record.commands.is_empty();
            let environment = Environment::new(&surroundings, &self.surface, &self.options);
            workspace.way.begin(surroundings.stack, (&state.hands, &[]), moves);
            let way = [state.hands.clone(), workspace.way.target.clone()];
            let still = workspace.way.is_done() && !surroundings.moves() && !surroundings.fields_change();
            let mut command = Recorded {
                moves: moves.clone(),
                time_s: surroundings.time_s,
                from,
                way,
                pieces: Some(Vec::new()),
                is_first,
            };
            match record.passed.last() {
                Some(last) if still => {
                    let mut same = last.clone();
                    same.report.rest();
                    record.passed.push(same);
                }
                _ if still || lengths(&command.way[1]).all(|inserted_mm| inserted_mm == 0.0) => {
                    let remedy = "nothing moves, or nothing is in: give a command that moves what is in";
                    return Err(Error::parameter("gradient.moves", moves.len(), remedy));
                }
                _ => {
                    command.pieces =
                        Some(command.carried_out(&mut workspace, &environment, Some(&mut report))?);
                    let end = workspace.now.start();
                    let mut shape = Shape::default();
                    write_line(end.state, &end.mesh.from_tip_mm, &mut shape);
                    record.passed.push(Passed { report: report.clone(), shape, margin: margin(end) });
                    state = Arc::clone(&workspace.now.state);
                    let Workspace { mesh, now, .. } = &mut *workspace;
                    std::mem::swap(mesh, &mut now.mesh);
                }
            }
            record.commands.push(command);
            surroundings.fields[0] = surroundings.fields[1];
            record.forget_most();
        }
        Ok(Box::new(record))
    }
}

impl Recorded {
    /// Its parts, carried out in this workspace, whose mesh is that of its start.
    fn carried_out<const C: usize>(
        &self,
        workspace: &mut Workspace<C>,
        environment: &Environment<'_>,
        report: Option<&mut StepReport>,
    ) -> Result<Vec<Piece>> {
        let mut recorder = Recorder::new(self.way.clone());
        let on = (&self.moves[..], usize::MAX);
        let Driven::Moved(took) =
            workspace.carry_out_recorded(environment, &self.from.state, on, Some(&mut recorder))?
        else {
            return Err(Error::Computation("gradient: the command has no end".to_owned()));
        };
        let mut own = StepReport::default();
        let report = report.unwrap_or(&mut own);
        took.write(environment, workspace.now.start(), report);
        if report.is_under_way() || !report.converged {
            return Err(Error::Computation("gradient: the command does not end in equilibrium".to_owned()));
        }
        Ok(recorder.pieces)
    }
}

impl<const C: usize> Record<C> {
    /// Drops the parts of the first commands until those that are left are within the bound.
    fn forget_most(&mut self) {
        let kept = |command: &Recorded| command.pieces.as_ref().map_or(0, Vec::len);
        let mut count: usize = self.commands.iter().map(kept).sum();
        let last = self.commands.len().saturating_sub(1);
        for command in &mut self.commands[..last] {
            if count <= MOST_KEPT {
                break;
            }
            if kept(command) > 0 {
                count -= kept(command);
                command.pieces = None;
            }
        }
    }

    /// The surroundings of a command, from those of the first.
    pub(super) fn surroundings<'a>(&self, first: &Surroundings<'a>, command: &Recorded) -> Surroundings<'a> {
        let [before, after] = first.fields;
        let fields = if command.is_first { [before, after] } else { [after, after] };
        Surroundings { time_s: command.time_s, fields, ..*first }
    }

    /// Scenes beside that of the commands, in which one parameter is a little less and more; none for those of the first command.
    pub(super) fn scenes(&self, surroundings: &Surroundings<'_>, by: &[Parameter]) -> Result<Vec<Beside>> {
        let environment = Environment::new(surroundings, &self.surface, &self.options);
        let mut scenes = Vec::new();
        for parameter in by {
            let together = vec![(*parameter, 1.0)];
            let step = STEP * scale(&environment, &together)?;
            if motion(parameter).is_none() {
                let side = |by: f64| Ok::<_, Error>((by, Scene::new(surroundings, &together, by)?));
                scenes.push(Beside { parameter: *parameter, sides: [side(-step)?, side(step)?] });
            }
        }
        Ok(scenes)
    }

    /// Calls `walk` with the parts of a command, which are carried out again if they were dropped.
    pub(super) fn with_pieces<T>(
        &self,
        workspace: &mut Workspace<C>,
        (command, environment): (&Recorded, &Environment<'_>),
        walk: impl FnOnce(&mut Workspace<C>, &[Piece]) -> Result<T>,
    ) -> Result<T> {
        match &command.pieces {
            Some(pieces) => walk(workspace, pieces),
            None => {
                workspace.mesh.clone_from(&command.from.mesh);
                let pieces = command.carried_out(workspace, environment, None)?;
                walk(workspace, &pieces)
            }
        }
    }
}

/// Instrument and kind of a motion of the hand.
pub(super) fn motion(parameter: &Parameter) -> Option<(usize, usize)> {
    match *parameter {
        Parameter::Advance { instrument } => Some((instrument, 0)),
        Parameter::Rotation { instrument } => Some((instrument, 1)),
        Parameter::Steering { instrument } => Some((instrument, 2)),
        _ => None,
    }
}

/// Weights of the numbers of a part, from those that are given.
fn weighted(weights: &Weights, numbers: &Numbers) -> Result<Vec<f64>> {
    let mut all = vec![0.0; numbers.len()];
    let mut add = |first: usize, count: usize, name: &str, list: &[f64]| {
        if !list.is_empty() && list.len() != count {
            let remedy = format!("there are {count} after this command: give one for each, or none");
            return Err(Error::parameter(format!("vjp.{name}"), format!("{} weights", list.len()), remedy));
        }
        all[first..].iter_mut().zip(list).for_each(|(to, weight)| *to += weight);
        Ok(())
    };
    let hands = numbers.instruments;
    let places: Vec<f64> = weights.positions_mm.iter().flat_map(|place| place.iter().copied()).collect();
    add(numbers.place(0), 3 * numbers.nodes, "positions_mm", &places)?;
    add(numbers.place(numbers.nodes - 1), 3, "tip_mm", weights.tip_mm.as_slice())?;
    add(numbers.push(0), hands, "push_force_n", &weights.push_force_n)?;
    add(numbers.torque(0), hands, "torque_nmm", &weights.torque_nmm)?;
    add(numbers.energy(), 1, "energy_mj", &[weights.energy_mj])?;
    add(numbers.contact(0), numbers.touches.len(), "contact_forces_n", &weights.contact_forces_n)?;
    Ok(all)
}

impl Weights {
    /// What of it costs more.
    fn wanted(&self) -> Wanted {
        let any = |list: &[f64]| list.iter().any(|weight| *weight != 0.0);
        let push = if any(&self.push_force_n) { Push::Rows } else { Push::Unread };
        Wanted { push, energy: self.energy_mj != 0.0, hands: false }
    }
}

impl<const C: usize> Tape for Record<C> {
    fn passed(&self) -> &[Passed] {
        &self.passed
    }

    fn pull(
        &self,
        first: &Surroundings<'_>,
        weights: &[Weights],
        (by, hands): (&[Parameter], bool),
    ) -> Result<Pulled> {
        let instruments = first.stack.instruments().len();
        let wants_hands = hands || by.iter().any(|parameter| motion(parameter).is_some());
        let scenes = self.scenes(first, by)?;
        let environment = Environment::new(first, &self.surface, &self.options);
        let nothing = Arc::clone(&self.commands[0].from.state);
        let mut workspace = Workspace::<C>::new(&environment, &nothing);
        let mut next = self.commands[0].from.clone();
        let mut memory: Vec<f64> = Vec::new();
        let mut scene = vec![(0.0, false); scenes.len()];
        // What both positions of a hand in all later parts add to each motion before them.
        let mut later = vec![[0.0; 3]; instruments];
        let mut moved = vec![vec![[0.0; 3]; instruments]; self.commands.len()];
        let mut one_sided = vec![[false; 3]; instruments];
        let mut waiting: Vec<&Weights> = Vec::new();
        for (k, command) in self.commands.iter().enumerate().rev() {
            waiting.extend(weights.get(k));
            moved[k].clone_from(&later);
            if command.pieces.as_ref().is_some_and(Vec::is_empty) {
                continue;
            }
            let own = std::mem::take(&mut waiting);
            let unread = Wanted { hands: wants_hands, ..Wanted::default() };
            let wanted = own.iter().map(|one| one.wanted()).fold(unread, |a, b| Wanted {
                push: if a.push == Push::Unread { b.push } else { a.push },
                energy: a.energy || b.energy,
                hands: a.hands,
            });
            let surroundings = self.surroundings(first, command);
            let environment = Environment::new(&surroundings, &self.surface, &self.options);
            self.with_pieces(&mut workspace, (command, &environment), |workspace, pieces| {
                for piece in pieces.iter().rev() {
                    let on = (environment, piece);
                    let linear = Linear::<C>::new(&mut workspace.tools, on, (wanted, &scenes), &mut next)?;
                    let mut numbers = vec![0.0; linear.numbers.len()];
                    if piece.is_last {
                        for one in &own {
                            let more = weighted(one, &linear.numbers)?;
                            numbers.iter_mut().zip(more).for_each(|(to, more)| *to += more);
                        }
                    }
                    memory.resize(linear.leaves(), 0.0);
                    let (before, found) = linear.backwards(&memory, &numbers)?;
                    memory = before;
                    for ((sum, sided), column) in scene.iter_mut().zip(&linear.scene) {
                        *sum += found.of(column);
                        *sided |= column.one_sided;
                    }
                    for (instrument, motions) in linear.hands.iter().enumerate() {
                        for (motion, columns) in motions.iter().enumerate() {
                            let Some(columns) = columns else { continue };
                            for (column, share) in columns.iter().zip(piece.shares) {
                                let weight = found.of(column);
                                moved[k][instrument][motion] += weight * share;
                                later[instrument][motion] += weight;
                                one_sided[instrument][motion] |= column.one_sided;
                            }
                        }
                    }
                }
                Ok(())
            })?;
        }
        let mut scene = scene.into_iter();
        let each = by.iter().map(|parameter| match motion(parameter) {
            Some((instrument, kind)) => (moved[0][instrument][kind], one_sided[instrument][kind]),
            None => scene.next().unwrap_or_default(),
        });
        let (by, sided) = each.unzip();
        let command = |&[advance_mm, rotate_rad, steer]: &[f64; 3]| Command { advance_mm, rotate_rad, steer };
        let hands = match hands {
            true => moved.iter().map(|all| all.iter().map(command).collect()).collect(),
            false => Vec::new(),
        };
        Ok(Pulled { by, one_sided: sided, hands })
    }

    fn push(&self, first: &Surroundings<'_>, along: &[Together]) -> Result<Vec<Vec<Slope>>> {
        self.pushed(first, along)
    }

    #[cfg(test)]
    fn solved(&self, first: &Surroundings<'_>, by: (Parameter, f64)) -> Result<Vec<Vec<f64>>> {
        self.solved_beside(first, by)
    }
}

//! Equilibria beside recorded commands, solved anew: what derivatives are measured by.
//!
//! Contacts, the division of commands into parts and the triads from which spin is measured are as they were. Derivatives are frozen in just these,
//! so central differences of such equilibria have no error but that of differences.

use super::super::Environment;
use super::super::configuration::Configuration;
use super::super::workspace::Workspace;
use super::forces::{go, rows, spins};
use super::linear::Linear;
use super::numbers::{Around, Wanted};
use super::reverse::Record;
use super::{End, Scene, moved, singular};
use crate::Result;
use crate::methods::{Parameter, Surroundings};

/// Corrections by the matrix of the part itself: each is smaller than the last by as much as the parts differ.
const ROUNDS: usize = 6;

impl<const C: usize> Record<C> {
    /// What each command leads to where a parameter is larger by so much: the place of the tip, push forces, torques, the energy and contact
    /// forces.
    pub(super) fn solved_beside(
        &self,
        first: &Surroundings<'_>,
        (parameter, by): (Parameter, f64),
    ) -> Result<Vec<Vec<f64>>> {
        let together = vec![(parameter, 1.0)];
        let environment = Environment::new(first, &self.surface, &self.options);
        let mut at: Configuration = self.commands[0].from.clone();
        let mut workspace = Workspace::<C>::new(&environment, &at.state);
        let (mut next, mut all) = (at.clone(), Vec::new());
        for command in &self.commands {
            let surroundings = self.surroundings(first, command);
            let environment = Environment::new(&surroundings, &self.surface, &self.options);
            let scene = Scene::new(&surroundings, &together, by)?;
            let nominal = Scene::new(&surroundings, &Vec::new(), 0.0)?;
            self.with_pieces(&mut workspace, (command, &environment), |workspace, pieces| {
                let tools = &mut workspace.tools;
                for piece in pieces {
                    let linear =
                        Linear::<C>::new(tools, (environment, piece), (Wanted::default(), &[]), &mut next)?;
                    let environment = piece.environment(&environment);
                    let touches = linear.numbers.touches.clone();
                    let end = End { state: piece.end(), spins: Vec::new() };
                    let mut around = Around { environment, piece, end, reads: true, touches };
                    let own = (piece.was.start(), &piece.hands[..]);
                    let slid = piece.with(&environment, &nominal, own, |acting, _| {
                        tools.beside(acting, &around.end, &mut next, |_, _, _| ()).unwrap().1
                    });
                    around.end.spins = spins(&piece.end().rod, &slid);
                    let share = if command.is_first { piece.shares[1] } else { 1.0 };
                    let hands = moved(&together, &piece.hands, by * share);
                    let mut way = vec![0.0; linear.after.rows];
                    for round in 0..=ROUNDS {
                        piece.with(&environment, &scene, (at.start(), &hands), |acting, own| {
                            let found =
                                tools.beside(acting, &around.end, &mut next, |search, lagged, triads| {
                                    go(search, &search.state.clone(), (&way, 1.0), triads);
                                    search.assemble(lagged, false);
                                    rows(search)
                                });
                            let Some((found, _)) = found else { return Err(singular()) };
                            if round < ROUNDS {
                                let right: Vec<f64> = found.iter().map(|force| -force).collect();
                                let more = linear.solve(&right, false)?;
                                way.iter_mut().zip(&more).for_each(|(way, more)| *way += more);
                                return Ok(());
                            }
                            if piece.is_last {
                                let numbers = &linear.numbers;
                                let values = around.numbers(tools, &own, &mut next);
                                all.push(values[numbers.place(numbers.nodes - 1)..].to_vec());
                            }
                            let (mesh, after) = next.parts();
                            tools.keep(acting.start, mesh, after);
                            tools.write_forces(&own, &mut next);
                            Ok::<_, crate::Error>(())
                        })?;
                    }
                    std::mem::swap(&mut at, &mut next);
                }
                Ok(())
            })?;
        }
        Ok(all)
    }
}

//! The unknowns of the course that contacts reach, and what they and the device do to each other: W, Q, p, Z and M of the
//! derivation in [`super`].

use std::ops::Range;

use nalgebra::{DMatrix, Matrix3};

use crate::Vec3;
use crate::contact::Reaction;
use crate::methods::kirchhoff::search::Search;
use crate::rod::Layout;
use crate::rod::scatter::{angle_weights, point_columns};
use crate::vessel::{Course, Displacement};

/// The unknowns that contacts reach.
pub(super) struct Touched {
    /// In ascending order.
    pub(super) unknowns: Vec<usize>,
    /// Of each contact the numbers among these with their blocks of Wᵢ and Qᵢ.
    weights: Vec<Vec<(usize, [Matrix3<f64>; 2])>>,
}

impl Touched {
    pub(super) fn new(course: &Course, displacement: &Displacement, reactions: &[Reaction]) -> Self {
        let of = |reaction: &Reaction| {
            let back = displacement.local(&reaction.material).inverse.transpose();
            let mut all = course.weights(&reaction.material, &reaction.force_n);
            all.iter_mut().for_each(|(_, [_, by_place])| *by_place = back * *by_place);
            all
        };
        let mut weights: Vec<_> = reactions.iter().map(of).collect();
        let mut unknowns: Vec<usize> = weights.iter().flatten().map(|(unknown, _)| *unknown).collect();
        unknowns.sort_unstable();
        unknowns.dedup();
        for (unknown, _) in weights.iter_mut().flatten() {
            *unknown = unknowns.partition_point(|touched| touched < unknown);
        }
        Self { unknowns, weights }
    }

    /// p, N.
    pub(super) fn forces(&self, reactions: &[Reaction]) -> Vec<Vec3> {
        let mut forces = vec![Vec3::zeros(); self.unknowns.len()];
        for (reaction, weights) in reactions.iter().zip(&self.weights) {
            weights.iter().for_each(|(k, [weight, _])| forces[*k] += weight.tr_mul(&reaction.force_n));
        }
        forces
    }

    /// r, what a narrower friction does to the device: its gradient where ε is smaller by this part.
    pub(super) fn narrow<const C: usize>(
        &self,
        search: &Search<'_, '_, C>,
        reactions: &[Reaction],
        by: f64,
        gradient: &mut [f64],
    ) {
        for reaction in reactions {
            let (e, xi, _) = reaction.place;
            let (force_n, couple) = reaction.by_stick;
            let ways = point_columns::<C>(search.state, &search.elements[e], e, xi);
            ways.iter().for_each(|(row, way)| gradient[*row] += by * way.dot(&force_n));
            if Layout::<C>::ANGLES > 0 {
                let turns = angle_weights::<C>(reaction.place);
                turns.iter().for_each(|(row, share)| gradient[*row] += by * share * couple);
            }
        }
        for row in search.supports.held::<C>().into_iter().flatten() {
            gradient[row] = 0.0;
        }
    }

    /// Adds to p what a narrower friction adds.
    pub(super) fn narrowed(&self, reactions: &[Reaction], by: f64, forces: &mut [Vec3]) {
        for (reaction, weights) in reactions.iter().zip(&self.weights) {
            let force_n = reaction.by_stick.0 * by;
            weights.iter().for_each(|(k, [weight, _])| forces[*k] += weight.tr_mul(&force_n));
        }
    }

    /// What each of the unknowns does to the device.
    pub(super) fn pulls<const C: usize>(&self, search: &Search<'_, '_, C>, reactions: &[Reaction]) -> Pulls {
        let (elements, state) = (search.elements, &*search.state);
        let rows = Layout::<C>::dimension(elements.len());
        let mut columns = vec![vec![0.0; rows]; 3 * self.unknowns.len()];
        let mut reached = vec![rows..0; self.unknowns.len()];
        for (reaction, weights) in reactions.iter().zip(&self.weights) {
            let (e, xi, _) = reaction.place;
            let ways = point_columns::<C>(state, &elements[e], e, xi);
            let turns = angle_weights::<C>(reaction.place);
            let turns = if Layout::<C>::ANGLES > 0 { &turns[..] } else { &[] };
            for (k, [weight, turning]) in weights {
                let all = ways.iter().map(|(row, _)| *row).chain(turns.iter().map(|(row, _)| *row));
                reached[*k] = all.fold(reached[*k].clone(), |reached, row| {
                    reached.start.min(row)..reached.end.max(row + 1)
                });
                for axis in 0..3 {
                    let column = &mut columns[3 * k + axis];
                    let moved = weight.column(axis);
                    let pull = -(reaction.stiffness * moved + turning.column(axis));
                    ways.iter().for_each(|(row, way)| column[*row] += way.dot(&pull));
                    let turn = -reaction.by_angle.dot(&moved);
                    turns.iter().for_each(|(row, share)| column[*row] += share * turn);
                }
            }
        }
        for row in search.supports.held::<C>().into_iter().flatten() {
            columns.iter_mut().for_each(|column| column[row] = 0.0);
        }
        Pulls { columns, reached }
    }

    /// M of a device that does not respond.
    pub(super) fn held_stiffness(&self, reactions: &[Reaction]) -> DMatrix<f64> {
        let size = 3 * self.unknowns.len();
        let mut matrix = DMatrix::zeros(size, size);
        for (reaction, weights) in reactions.iter().zip(&self.weights) {
            for (i, [one, turning]) in weights {
                for (j, [other, turned]) in weights {
                    let mut block = matrix.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                    block += one.tr_mul(&(reaction.stiffness * other + turned)) + turning.tr_mul(other);
                }
            }
        }
        matrix
    }
}

/// Forces on the device where unknowns are displaced: −Σ Nᵢᵀ (Hᵢ Wᵢ + Qᵢ).
pub(super) struct Pulls {
    /// Three for each unknown.
    columns: Vec<Vec<f64>>,
    /// Of each unknown the rows outside of which its columns are zero.
    reached: Vec<Range<usize>>,
}

impl Pulls {
    /// The columns of Z.
    pub(super) fn responses<const C: usize>(&self, search: &Search<'_, '_, C>) -> Vec<Vec<f64>> {
        let mut responses = self.columns.clone();
        responses.iter_mut().for_each(|column| search.newton.apply_inverse(search.elements, column));
        responses
    }

    /// Adds to p what a motion of the device takes from it, of which this is the opposite.
    pub(super) fn by_device(&self, opposite: &[f64], forces: &mut [Vec3]) {
        for (column, pull) in self.columns.iter().enumerate() {
            let rows = self.reached[column / 3].clone();
            let work: f64 = pull[rows.clone()].iter().zip(&opposite[rows]).map(|(a, b)| a * b).sum();
            forces[column / 3][column % 3] += work;
        }
    }

    /// Adds to M of a device that does not respond what its response does.
    pub(super) fn soften(&self, responses: &[Vec<f64>], matrix: &mut DMatrix<f64>) {
        for (i, pull) in self.columns.iter().enumerate() {
            let rows = self.reached[i / 3].clone();
            for (j, response) in responses.iter().enumerate().skip(i) {
                let softer: f64 =
                    pull[rows.clone()].iter().zip(&response[rows.clone()]).map(|(a, b)| a * b).sum();
                matrix[(i, j)] -= softer;
                if i != j {
                    matrix[(j, i)] -= softer;
                }
            }
        }
    }
}

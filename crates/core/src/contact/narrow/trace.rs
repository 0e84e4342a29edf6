//! Follows narrow round stretches of a wall, section by section, and fits an axis to each.
//!
//! A vertex that bends around a narrow lumen tells where its axis is and where it leads ([`Corner`]). From there
//! sections are fitted to the vertices around ([`section`]), each a step ahead of the last, until none fits. Then the
//! axis is a spline through their centres, and sections are fitted again relative to it: in a round tube nothing is
//! left over, so that neither its bend nor uneven vertices shift the axis.

use super::section::{Fit, Spot, across, combined, fitted};
use super::vertices::{Corner, Vertices};
use crate::vessel::Tube;
use crate::{Vec3, parallel};

/// Height up to which a section is fitted, in radii.
const HEIGHT: f64 = 1.0;
/// Distance of sections, in radii.
const STEP: f64 = 0.25;
/// Distances from the axis, in radii, between which vertices belong to a section that is not yet fitted.
const AROUND: [f64; 2] = [0.4, 1.6];
/// Least cosine between the inward normal of such a vertex and the direction to the axis.
const FACING: f64 = 0.5;
/// Passes of a fit from a vertex, and from the section before.
const PASSES: [usize; 2] = [6, 2];
/// Largest shift in the last pass, in radii.
const SETTLED: f64 = 0.1;
/// Largest product of the axis's curvature and the radius.
const SHARPEST: f64 = 0.4;
/// Largest number of sections in one direction.
const MOST: usize = 20_000;
/// Rounds of fitting relative to the axis.
const ROUNDS: usize = 3;
/// Height up to which vertices tell how far a section is off, in radii.
const LOCAL: f64 = 0.5;
/// Least number of sections of a stretch.
const LEAST: usize = 12;

/// A round stretch of the wall.
pub(super) struct Traced {
    pub(super) tube: Tube,
    /// How far the wall is off the tube around each of its centres, mm; infinite where no section fits.
    pub(super) off_mm: Vec<f64>,
    /// Its vertices, and the centre next to each.
    pub(super) vertices: Vec<(u32, u32)>,
}

/// A section on the way.
#[derive(Debug, Clone, Copy)]
struct Section {
    centre: Vec3,
    along: Vec3,
    radius_mm: f64,
    /// Curvature of the axis, 1/mm.
    bend: Vec3,
}

/// Looks for stretches with radii up to `widest_mm`, from these vertices on.
pub(super) fn traced(vertices: &Vertices, seeds: &[u32], widest_mm: f64) -> Vec<Traced> {
    let count = vertices.all.len();
    let mut tracing =
        Tracing { vertices, widest_mm, owner: vec![0; count], number: 0, tried: vec![false; count] };
    seeds.iter().filter_map(|seed| tracing.from(*seed)).collect()
}

struct Tracing<'a> {
    vertices: &'a Vertices,
    widest_mm: f64,
    /// The number of the stretch of each vertex; 0 for none.
    owner: Vec<u32>,
    number: u32,
    /// Vertices next to one from which no stretch was found.
    tried: Vec<bool>,
}

impl Tracing<'_> {
    /// The stretch about a vertex that belongs to none yet.
    fn from(&mut self, seed: u32) -> Option<Traced> {
        if self.owner[seed as usize] != 0 || self.tried[seed as usize] {
            return None;
        }
        let Corner { position, normal, along, curvature } = self.vertices.all[seed as usize];
        let radius_mm = curvature[0].recip();
        let first = Section { centre: position + normal * radius_mm, along, radius_mm, bend: Vec3::zeros() };
        self.number += 1;
        let Some(first) = self.settled(first, PASSES[0]) else {
            for v in self.vertices.within(&position, STEP * radius_mm) {
                self.tried[v as usize] = true;
            }
            return None;
        };
        let mut line = self.followed(first, -1.0);
        line.reverse();
        line.push(first);
        line.extend(self.followed(first, 1.0));
        (line.len() >= LEAST).then(|| self.refined(&line)).flatten()
    }

    /// The sections ahead of one, or behind it.
    fn followed(&mut self, first: Section, sense: f64) -> Vec<Section> {
        let (mut line, mut last) = (Vec::new(), first);
        while line.len() < MOST {
            let by = sense * STEP * last.radius_mm;
            let ahead = Section {
                centre: last.centre + last.along * by + last.bend * (0.5 * by * by),
                along: (last.along + last.bend * by).normalize(),
                ..last
            };
            let Some(next) = self.settled(ahead, PASSES[1]) else { break };
            // Around a ring, back at the first.
            let is_closed =
                line.len() > LEAST && (next.centre - first.centre).norm() < STEP * first.radius_mm;
            let way = (next.centre - last.centre).dot(&last.along) * sense;
            if is_closed || way < 0.5 * STEP * last.radius_mm {
                break;
            }
            line.push(next);
            last = next;
        }
        line
    }

    /// A section fitted to the wall around it; `None` if the wall is not a narrow tube there that no other stretch
    /// contains.
    fn settled(&mut self, mut at: Section, passes: usize) -> Option<Section> {
        let mut around = Vec::new();
        let mut spots = Vec::new();
        for pass in 0..passes {
            let r = at.radius_mm;
            let directions = across(&at.along);
            around.clear();
            spots.clear();
            for v in self.vertices.within(&at.centre, r * (HEIGHT * HEIGHT + AROUND[1] * AROUND[1]).sqrt()) {
                let corner = &self.vertices.all[v as usize];
                let y = corner.position - at.centre;
                let z = at.along.dot(&y);
                if let Some(spot) = spot(corner, &(y - at.along * z), (z, r), &directions) {
                    around.push(v);
                    spots.push(spot);
                }
            }
            let Fit { wider, shift, slope, bend } = fitted(spots.iter().copied(), HEIGHT)?;
            at = Section {
                centre: at.centre + combined(&directions, shift) * r,
                along: (at.along + combined(&directions, slope)).normalize(),
                radius_mm: r * (1.0 + wider),
                bend: combined(&directions, bend) * (2.0 / r),
            };
            let moved = libm::hypot(shift[0], shift[1]).max(wider.abs());
            let is_wild = moved > 1.0 || at.radius_mm > 1.5 * self.widest_mm;
            if is_wild || (pass + 1 == passes && moved > SETTLED) {
                return None;
            }
        }
        if at.radius_mm > self.widest_mm || at.bend.norm() * at.radius_mm > SHARPEST {
            return None;
        }
        let taken = |v: &&u32| ![0, self.number].contains(&self.owner[**v as usize]);
        if 2 * around.iter().filter(taken).count() > around.len() {
            return None;
        }
        for v in around {
            let owner = &mut self.owner[v as usize];
            *owner = if *owner == 0 { self.number } else { *owner };
        }
        Some(at)
    }

    /// The stretch along these sections.
    fn refined(&self, line: &[Section]) -> Option<Traced> {
        let (mut centres, mut radii) = even(line)?;
        let members = self.members(&centres, &radii);
        let mut fits = vec![None; centres.len()];
        let mut tube = Tube::new(&centres, &radii);
        for _ in 0..ROUNDS {
            let spots = self.spots(&tube, &members);
            let step_mm = tube.step_mm();
            fits = parallel::map(centres.len(), |k| {
                let (s, r) = (step_mm * k as f64, radii[k]);
                let directions = across(&tube.tangent(s));
                let seen = about(&spots, s, HEIGHT * r).iter().map(|(at, towards, excess_mm)| Spot {
                    height: (at - s) / r,
                    towards: directions.map(|d| d.dot(towards)),
                    excess: excess_mm / r,
                });
                let fit = fitted(seen, HEIGHT)?;
                Some((combined(&directions, fit.shift) * r, fit.wider * r))
            });
            for (k, fit) in fits.iter().enumerate() {
                if let Some((shift, wider_mm)) = fit {
                    centres[k] += shift;
                    radii[k] += wider_mm;
                }
            }
            tube = Tube::new(&centres, &radii);
        }
        let spots = self.spots(&tube, &members);
        let off_mm = |k: usize| match fits[k] {
            Some(_) => {
                let near = about(&spots, tube.step_mm() * k as f64, LOCAL * radii[k]);
                near.iter().map(|(.., excess_mm)| excess_mm.abs()).fold(0.0, f64::max)
            }
            None => f64::INFINITY,
        };
        let off_mm = (0..centres.len()).map(off_mm).collect();
        Some(Traced { tube, off_mm, vertices: members })
    }

    /// Vertices around centres, each with that next to it.
    fn members(&self, centres: &[Vec3], radii: &[f64]) -> Vec<(u32, u32)> {
        let mut found: Vec<(u32, f64, u32)> = Vec::new();
        for (k, (centre, r)) in centres.iter().zip(radii).enumerate() {
            let near = self.vertices.within(centre, AROUND[1] * r);
            found.extend(
                near.map(|v| (v, (self.vertices.all[v as usize].position - centre).norm_squared(), k as u32)),
            );
        }
        found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        found.dedup_by_key(|one| one.0);
        found.into_iter().map(|(v, _, k)| (v, k)).collect()
    }

    /// Arc length, direction and excess, mm, of those vertices that are the wall of a tube, along it.
    fn spots(&self, tube: &Tube, members: &[(u32, u32)]) -> Vec<(f64, Vec3, f64)> {
        let of = |&(v, k): &(u32, u32)| {
            let corner = &self.vertices.all[v as usize];
            let (s, place, r) = tube.foot(&corner.position, tube.step_mm() * f64::from(k));
            let offset = corner.position - place;
            let off_mm = offset.norm();
            let is_spot = tube.holds(s) && is_wall(corner, &offset, r);
            is_spot.then(|| (s, offset / off_mm, off_mm - r))
        };
        let mut spots: Vec<_> = members.iter().filter_map(of).collect();
        spots.sort_by(|a, b| a.0.total_cmp(&b.0));
        spots
    }
}

/// Those of sorted spots whose arc length is within `reach_mm` of one.
fn about(spots: &[(f64, Vec3, f64)], s: f64, reach_mm: f64) -> &[(f64, Vec3, f64)] {
    let from = spots.partition_point(|spot| spot.0 <= s - reach_mm);
    &spots[from..spots.partition_point(|spot| spot.0 < s + reach_mm)]
}

/// Whether a vertex at an offset from the axis of a section with radius r is its wall.
fn is_wall(corner: &Corner, offset: &Vec3, r: f64) -> bool {
    let off_mm = offset.norm();
    off_mm > AROUND[0] * r && off_mm < AROUND[1] * r && corner.normal.dot(offset) < -FACING * off_mm
}

/// A vertex at a height, mm, and an offset from the axis of a section with radius r; `None` if it is not its wall.
fn spot(corner: &Corner, offset: &Vec3, (z, r): (f64, f64), directions: &[Vec3; 2]) -> Option<Spot> {
    let off_mm = offset.norm();
    let is_spot = z.abs() < HEIGHT * r && is_wall(corner, offset, r);
    let towards = directions.map(|d| d.dot(offset) / off_mm);
    is_spot.then_some(Spot { height: z / r, towards, excess: off_mm / r - 1.0 })
}

/// Centres and radii at equal distances along sections.
fn even(line: &[Section]) -> Option<(Vec<Vec3>, Vec<f64>)> {
    let mut way = vec![0.0];
    for ends in line.windows(2) {
        way.push(way[way.len() - 1] + (ends[1].centre - ends[0].centre).norm());
    }
    let least_mm = line.iter().map(|section| section.radius_mm).fold(f64::INFINITY, f64::min);
    let (length_mm, last) = (way[way.len() - 1], line.len() - 1);
    let pieces = (length_mm / (STEP * least_mm)).ceil() as usize;
    if !(LEAST..=2 * MOST).contains(&pieces) {
        return None;
    }
    let (mut centres, mut radii, mut side) = (Vec::new(), Vec::new(), 0);
    for k in 0..=pieces {
        let at = length_mm * k as f64 / pieces as f64;
        while side + 1 < last && way[side + 1] < at {
            side += 1;
        }
        let part = ((at - way[side]) / (way[side + 1] - way[side])).clamp(0.0, 1.0);
        let (a, b) = (&line[side], &line[side + 1]);
        centres.push(a.centre + (b.centre - a.centre) * part);
        radii.push(a.radius_mm + (b.radius_mm - a.radius_mm) * part);
    }
    Some((centres, radii))
}

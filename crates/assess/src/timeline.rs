//! A procedure over time, reduced for drawing to a fixed number of equal intervals.

use endowire_core::Vec3;
use serde::Serialize;

use crate::injection::Injection;
use crate::record::{BeamState, Record, Sample};
use crate::way::Way;

/// Shortest interval, s: hands do little that is faster.
const SHORTEST_S: f64 = 0.1;

/// Motion of one instrument over time.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct HandLine {
    /// Mean speed in each interval, mm/s; negative when pulled back.
    pub push_mm_per_s: Vec<f64>,
    /// Mean rotation speed, °/s.
    pub turn_deg_per_s: Vec<f64>,
    /// Mean rate of steering, 1/s.
    pub steer_per_s: Vec<f64>,
    /// Inserted length at the end of the interval, mm.
    pub inserted_mm: Vec<f64>,
    /// Largest magnitude of the push force, N.
    pub force_n: Vec<f64>,
}

/// A procedure in equal intervals of time.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Timeline {
    /// Length of an interval, s.
    pub piece_s: f64,
    /// End of the procedure, s.
    pub end_s: f64,
    /// Position of the foremost tip at the end of each interval, to be compared with the centre line; `None` while
    /// nothing is inserted.
    pub tip_mm: Vec<Option<Vec3>>,
    /// The same for the tip of the instrument that must arrive, if the way names one; otherwise empty.
    pub arriving_mm: Vec<Option<Vec3>>,
    /// Whether the foremost tip is in a branch off the way.
    pub wrong: Vec<bool>,
    /// Largest sum of wall forces in each interval, N.
    pub wall_force_n: Vec<f64>,
    /// Largest wall force at the tip in each interval, N.
    pub tip_force_n: Vec<f64>,
    /// Volume of the coils in the sac over the volume of the sac, at the end of each interval; empty if no sac is
    /// packed.
    pub packing_density: Vec<f64>,
    /// The instruments, innermost first.
    pub hands: Vec<HandLine>,
    /// States of the beam, each from its time on; `None` if the beam was not recorded.
    pub beam: Option<Vec<BeamState>>,
    /// Injections.
    pub injections: Vec<Injection>,
}

impl Timeline {
    /// The timeline of a record in at most `most_pieces` intervals; `way` is the way to the target, if known.
    pub fn of(record: &Record, way: Option<&Way>, most_pieces: usize) -> Self {
        let end_s = record.end_s();
        let pieces = ((end_s / SHORTEST_S).ceil() as usize).min(most_pieces).max(1);
        let hands = record.hand_count();
        let mut line = Self {
            piece_s: end_s / pieces as f64,
            end_s,
            tip_mm: vec![None; pieces],
            arriving_mm: vec![],
            wrong: vec![false; pieces],
            wall_force_n: vec![0.0; pieces],
            tip_force_n: vec![0.0; pieces],
            packing_density: vec![],
            hands: vec![HandLine::of(pieces); hands],
            beam: record.beam.clone(),
            injections: record.injections.clone(),
        };
        if end_s <= 0.0 {
            return line;
        }
        let arriving = way.and_then(|way| way.instrument);
        if arriving.is_some() {
            line.arriving_mm = vec![None; pieces];
        }
        if record.samples.iter().any(|sample| sample.packing.is_some()) {
            line.packing_density = vec![0.0; pieces];
        }
        for (took_s, sample) in record.timed() {
            line.add(took_s, sample, arriving);
        }
        if let Some(way) = way {
            let wrong = |tip: &Option<Vec3>| tip.is_some_and(|tip| way.wrong_branch(&tip).is_some());
            line.wrong = line.tip_mm.iter().map(wrong).collect();
        }
        line
    }

    /// Adds a sample to the intervals that it overlaps.
    fn add(&mut self, took_s: f64, sample: &Sample, arriving: Option<usize>) {
        let (from_s, to_s) = (sample.time_s - took_s, sample.time_s);
        let pieces = self.tip_mm.len();
        let piece_of = |time_s: f64| ((time_s / self.piece_s) as usize).min(pieces - 1);
        // The boundary between two intervals belongs to the earlier one.
        let first = piece_of(from_s);
        let last = piece_of(to_s - 1e-9 * self.end_s).max(first);
        for piece in first..=last {
            let begin_s = piece as f64 * self.piece_s;
            let share_s = to_s.min(begin_s + self.piece_s) - from_s.max(begin_s);
            // A sample of zero duration counts in full in its interval.
            let share = if took_s > 0.0 { (share_s / took_s).clamp(0.0, 1.0) } else { 1.0 };
            self.tip_mm[piece] = sample.on_centreline_mm();
            if let Some(tip) = self.arriving_mm.get_mut(piece) {
                *tip = sample.tip_of_mm(arriving);
            }
            if let (Some(density), Some(packed)) = (self.packing_density.get_mut(piece), sample.packing) {
                *density = packed.density;
            }
            self.wall_force_n[piece] = self.wall_force_n[piece].max(sample.wall_force_n);
            self.tip_force_n[piece] = self.tip_force_n[piece].max(sample.tip_force_n);
            for (line, hand) in self.hands.iter_mut().zip(&sample.hands) {
                line.push_mm_per_s[piece] += hand.advance_mm * share / self.piece_s;
                line.turn_deg_per_s[piece] += hand.rotate_rad.to_degrees() * share / self.piece_s;
                line.steer_per_s[piece] += hand.steer_by * share / self.piece_s;
                line.inserted_mm[piece] = hand.inserted_mm;
                let force_n = hand.push_force_n.map_or(0.0, f64::abs);
                line.force_n[piece] = line.force_n[piece].max(force_n);
            }
        }
    }
}

impl HandLine {
    fn of(pieces: usize) -> Self {
        let none = || vec![0.0; pieces];
        Self {
            push_mm_per_s: none(),
            turn_deg_per_s: none(),
            steer_per_s: none(),
            inserted_mm: none(),
            force_n: none(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Hand, Packed};

    fn sample(time_s: f64, x: f64, advance_mm: f64, wall_force_n: f64) -> Sample {
        Sample {
            time_s,
            tip_mm: Some(Vec3::new(x, 0.0, 0.0)),
            hands: vec![Hand {
                advance_mm,
                inserted_mm: x,
                push_force_n: Some(-wall_force_n),
                ..Hand::default()
            }],
            wall_force_n,
            ..Sample::default()
        }
    }

    #[test]
    fn lengths_are_shared_out_and_forces_are_the_largest() {
        let samples =
            vec![sample(1.0, 10.0, 10.0, 0.1), sample(2.0, 30.0, 20.0, 0.5), sample(4.0, 30.0, 0.0, 0.2)];
        let record = Record { samples, ..Record::default() };
        let line = Timeline::of(&record, None, 2);
        assert_eq!((line.piece_s, line.end_s, line.tip_mm.len()), (2.0, 4.0, 2));
        assert_eq!(line.hands[0].push_mm_per_s, [15.0, 0.0]);
        assert_eq!(line.hands[0].inserted_mm, [30.0, 30.0]);
        assert_eq!(line.hands[0].steer_per_s, [0.0, 0.0]);
        assert_eq!(
            (line.wall_force_n.clone(), line.hands[0].force_n.clone()),
            (vec![0.5, 0.2], vec![0.5, 0.2])
        );
        assert_eq!(line.tip_mm[0], Some(Vec3::new(30.0, 0.0, 0.0)));
        let mut steered = record.clone();
        steered.samples[2].hands[0].steer_by = -0.5;
        assert_eq!(Timeline::of(&steered, None, 2).hands[0].steer_per_s, [0.0, -0.25]);
        // No interval is shorter than 0.1 s, however many are requested; the total advance is preserved.
        let fine = Timeline::of(&record, None, 1000);
        assert_eq!(fine.tip_mm.len(), 40);
        let pushed_mm: f64 = fine.hands[0].push_mm_per_s.iter().map(|speed| speed * fine.piece_s).sum();
        assert!((pushed_mm - 30.0).abs() < 1e-9, "{pushed_mm}");
        assert_eq!(Timeline::of(&Record::default(), None, 10).tip_mm, [None]);
        // Packing is filled in only for a sac.
        assert!(line.packing_density.is_empty());
        let mut packed = record;
        packed.samples[1].packing = Some(Packed { density: 0.1, outside_mm: 0.0 });
        packed.samples[2].packing = Some(Packed { density: 0.2, outside_mm: 0.0 });
        assert_eq!(Timeline::of(&packed, None, 2).packing_density, [0.1, 0.2]);
    }
}

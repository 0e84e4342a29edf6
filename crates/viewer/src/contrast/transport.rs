//! Transport of contrast medium through a vessel tree: one-dimensional finite volumes.
//!
//! The stretch from each point of the tree to the one before it is a cell. Blood enters at the inlet as pumped by the
//! heart, Q(t), and leaves through the ends; the resistances beyond them determine its division, so each end takes a
//! fixed share s of everything that enters, injections included. An injection of q therefore drives s q through every
//! face and, on the path from the inlet to its position, takes q back:
//!
//! ```text
//! F = s (Q + Σ q) − Σ q over injections at or below the face
//! ```
//!
//! Where branches meet again, a link is one more face, and the flows so found are divided among the arms of the ring by
//! their resistances.
//!
//! F < 0 is reflux: medium injected faster than blood arrives flows upstream to where a branch carries it away. Every
//! cell is mixed, faces carry the fraction of the upstream cell, so the medium is conserved to rounding. That spreads
//! fronts like a dispersion of v Δx/2; the excess of the wanted one, k² v²/2, is added as diffusion.
//!
//! Steps are those of one time grid, so that a moment does not depend on which frames came before it.

use endowire_core::Vec3;

use super::flow::Flow;
use super::tip_way::TipWay;
use crate::spec::InjectionSpec;

/// Time step, as a fraction of that in which a cell would be emptied.
const COURANT: f64 = 0.8;
/// Longest step, s: a hundredth of a heartbeat.
const LONGEST_S: f64 = 0.008;
/// Largest number of stored moments. Beyond it, every second one is dropped.
const MOST_MARKS: usize = 64;
/// Fraction of the injected medium that may remain when all has passed, and how long to wait for that, s.
const LEFT: f64 = 0.01;
const WAITED_S: f64 = 20.0;

/// The medium at a step of the grid.
#[derive(Debug, Clone)]
pub(super) struct Transport {
    step_s: f64,
    /// Steps since time zero.
    steps: i64,
    /// Fraction of each cell, now and one step before.
    fractions: Vec<f64>,
    before: Vec<f64>,
    /// Medium in the tissue behind each end, mm³.
    tissue_mm3: Vec<f64>,
    /// Total medium that has left through the ends and tissues, mm³.
    left_mm3: f64,
    /// Flows through the faces upstream of cells, and then through those of links, mm³/s.
    faces: Vec<f64>,
    /// The cells of each injection, with their parts of it.
    places: Vec<Vec<(usize, f64)>>,
    /// Stored moments, ascending, and the smallest number of steps between them.
    marks: Vec<Self>,
    apart: i64,
}

impl Transport {
    /// Before the first injection of `flow`.
    pub(super) fn new(flow: &Flow) -> Self {
        let step_s = step_s(flow);
        let cells = flow.nodes.len();
        let first = flow.injections.iter().map(|i| i.start_s).fold(f64::INFINITY, f64::min);
        Self {
            step_s,
            steps: if first.is_finite() { (first / step_s).floor() as i64 } else { 0 },
            fractions: vec![0.0; cells],
            before: vec![0.0; cells],
            tissue_mm3: vec![0.0; cells],
            left_mm3: 0.0,
            faces: vec![0.0; cells + flow.links.len()],
            places: flow.injections.iter().map(|i| parts(flow, i.at_mm.map(Vec3::from))).collect(),
            marks: vec![],
            apart: 1,
        }
    }

    /// Advances to a time; to an earlier one, starts from a stored moment before it or from the first. `tip` is the
    /// path of the tip, if one injects.
    pub(super) fn advance(&mut self, flow: &Flow, time_s: f64, tip: &TipWay) {
        let wanted = (time_s / self.step_s).ceil() as i64;
        if wanted < self.steps {
            self.go_back(flow, wanted);
        }
        while self.steps < wanted {
            self.wait(flow, wanted);
            if self.steps < wanted {
                self.step(flow, tip);
                self.mark();
            }
        }
    }

    /// Discards what depends on the tip after a time.
    pub(super) fn forget_after(&mut self, flow: &Flow, time_s: f64) {
        // A step uses the tip position at its start.
        let last = (time_s / self.step_s).floor().clamp(-1e18, 1e18) as i64 + 1;
        if last < self.steps {
            self.go_back(flow, last);
            let known = self.marks.partition_point(|mark| mark.steps <= last);
            self.marks.truncate(known);
        }
    }

    /// Returns to the last stored moment not after a step.
    fn go_back(&mut self, flow: &Flow, step: i64) {
        let (marks, apart) = (std::mem::take(&mut self.marks), self.apart);
        let before = marks.partition_point(|mark| mark.steps <= step).checked_sub(1);
        *self = before.map_or_else(|| Self::new(flow), |place| marks[place].clone());
        (self.marks, self.apart) = (marks, apart);
    }

    /// Stores this moment unless a near one is stored.
    fn mark(&mut self) {
        if self.marks.last().is_some_and(|mark| self.steps < mark.steps + self.apart) {
            return;
        }
        let mut marks = std::mem::take(&mut self.marks);
        if marks.len() >= MOST_MARKS {
            let mut first = false;
            marks.retain(|_| {
                first = !first;
                first
            });
            self.apart *= 2;
        }
        marks.push(self.clone());
        self.marks = marks;
    }

    /// If all medium has gone, skips to the next injection or to a step: it does not return.
    fn wait(&mut self, flow: &Flow, wanted: i64) {
        let now_s = self.steps as f64 * self.step_s;
        let flows = |i: &InjectionSpec| i.start_s <= now_s && now_s <= i.start_s + i.duration_s;
        if flow.injections.iter().any(flows) || !self.all_gone() {
            return;
        }
        let next_s = flow.injections.iter().map(|i| i.start_s).filter(|start| *start > now_s);
        let next = (next_s.fold(f64::INFINITY, f64::min) / self.step_s).floor();
        self.steps = self.steps.max((next as i64).min(wanted));
    }

    fn all_gone(&self) -> bool {
        self.fractions.iter().all(|f| *f < 1e-6) && self.tissue_mm3.iter().all(|v| *v < 1e-3)
    }

    /// Fraction of each cell at a time within the last step.
    pub(super) fn at(&self, time_s: f64) -> Vec<f32> {
        let back = (self.steps as f64 - time_s / self.step_s).clamp(0.0, 1.0);
        let mix = |(now, before): (&f64, &f64)| (now + (before - now) * back) as f32;
        self.fractions.iter().zip(&self.before).map(mix).collect()
    }

    /// Medium in the tissue behind each end, mm³.
    pub(super) fn tissue_mm3(&self) -> &[f64] {
        &self.tissue_mm3
    }

    /// The largest fraction that each cell ever reaches.
    pub(super) fn largest(flow: &Flow) -> Vec<f32> {
        let (mut transport, nowhere) = (Self::new(flow), TipWay::new(&[]));
        let last = flow.injections.iter().map(|i| i.start_s + i.duration_s).fold(0.0, f64::max);
        let injected: f64 = flow.injections.iter().map(|i| i.rate_ml_per_s * i.duration_s * 1000.0).sum();
        let mut largest = vec![0.0_f64; flow.nodes.len()];
        loop {
            let now_s = transport.steps as f64 * transport.step_s;
            let over = now_s > last && transport.inside_mm3(flow) < LEFT * injected;
            if over || now_s > last + WAITED_S {
                return largest.into_iter().map(|f| f as f32).collect();
            }
            transport.wait(flow, (last / transport.step_s).ceil() as i64);
            transport.step(flow, &nowhere);
            largest.iter_mut().zip(&transport.fractions).for_each(|(most, f)| *most = most.max(*f));
        }
    }

    /// Medium in the tree, mm³.
    fn inside_mm3(&self, flow: &Flow) -> f64 {
        self.fractions.iter().zip(&flow.nodes).map(|(f, node)| f * node.volume_mm3).sum()
    }

    /// Advances by one step.
    fn step(&mut self, flow: &Flow, tip: &TipWay) {
        let [start, end] = [self.steps, self.steps + 1].map(|n| n as f64 * self.step_s);
        let blood = flow.mean_inflow_mm3_per_s * flow.pulse(f64::midpoint(start, end));
        // Rates are means over the step, so injections are complete.
        let rates: Vec<f64> = flow
            .injections
            .iter()
            .map(|i| {
                // Nothing comes out of a tip that is not inserted.
                if i.at_tip && tip.at(start).is_none() {
                    return 0.0;
                }
                let overlap = end.min(i.start_s + i.duration_s) - start.max(i.start_s);
                1000.0 * i.rate_ml_per_s * overlap.max(0.0) / self.step_s
            })
            .collect();
        for ((place_of, injection), rate) in self.places.iter_mut().zip(&flow.injections).zip(&rates) {
            if injection.at_tip && *rate > 0.0 {
                *place_of = parts(flow, tip.at(start));
            }
        }
        let all = blood + rates.iter().sum::<f64>();
        let shares = flow.nodes.iter().map(|node| node.share);
        let shares = shares.chain(flow.links.iter().map(|link| link.share));
        for (face, share) in self.faces.iter_mut().zip(shares) {
            *face = share * all;
        }
        let places = self.places.iter().zip(&rates).filter(|(_, rate)| **rate > 0.0);
        let injected = || {
            places
                .clone()
                .flat_map(|(parts, rate)| parts.iter().map(move |&(cell, part)| (cell, part * rate)))
        };
        for (cell, rate) in injected() {
            let mut cell = Some(cell);
            while let Some(at) = cell {
                self.faces[at] -= rate;
                cell = flow.nodes[at].upstream;
            }
        }
        flow.settle(&mut self.faces);
        std::mem::swap(&mut self.before, &mut self.fractions);
        let before = &self.before;
        // Change of the medium in each cell, mm³.
        let mut change = vec![0.0; before.len()];
        for (i, node) in flow.nodes.iter().enumerate() {
            if let Some(up) = node.upstream {
                let face = self.faces[i];
                let carried = face * before[if face > 0.0 { up } else { i }];
                let spread = flow.exchange_mm3_per_s(i, face) * (before[up] - before[i]);
                let moved = (carried + spread) * self.step_s;
                change[i] += moved;
                change[up] -= moved;
            }
            if node.is_end {
                let out = node.share * all * before[i] * self.step_s;
                change[i] -= out;
                self.tissue_mm3[i] += out;
                let washed = self.tissue_mm3[i] * (1.0 - libm::exp(-self.step_s / flow.tissue_s));
                self.tissue_mm3[i] -= washed;
                self.left_mm3 += washed;
            }
        }
        for (link, &face) in flow.links.iter().zip(&self.faces[flow.nodes.len()..]) {
            let moved = face * before[if face > 0.0 { link.from } else { link.to }] * self.step_s;
            change[link.to] += moved;
            change[link.from] -= moved;
        }
        injected().for_each(|(cell, rate)| change[cell] += rate * self.step_s);
        for (((now, before), change), node) in
            self.fractions.iter_mut().zip(before).zip(&change).zip(&flow.nodes)
        {
            *now = before + change / node.volume_mm3;
        }
        self.steps += 1;
    }
}

/// The cells with the blood at a point, or at the inlet without one, and their parts of an injection there, which sum
/// to 1.
fn parts(flow: &Flow, point_mm: Option<Vec3>) -> Vec<(usize, f64)> {
    let mut shares = Vec::new();
    flow.mixing.shares(&point_mm.unwrap_or(flow.nodes[0].position_mm), &mut shares);
    let all: f64 = shares.iter().map(|share| f64::from(share.1)).sum();
    if all <= 0.0 {
        return vec![(0, 1.0)];
    }
    shares.iter().map(|&(cell, share)| (cell as usize, f64::from(share) / all)).collect()
}

/// The step in which no cell loses more than a fraction of its content, whatever is injected anywhere.
fn step_s(flow: &Flow) -> f64 {
    let most: f64 = flow.injections.iter().map(|i| 1000.0 * i.rate_ml_per_s).sum();
    let all = flow.mean_inflow_mm3_per_s * flow.highest_pulse() + most;
    let mut given: Vec<f64> = flow.nodes.iter().map(|node| node.share.abs() * all + most).collect();
    // In a ring blood also comes in by links, and from points behind.
    for link in &flow.links {
        given[link.to] += link.share.abs() * all + most;
        given[link.from] += link.share.abs() * all + most;
    }
    for node in flow.nodes.iter().filter(|node| node.share < 0.0) {
        node.upstream.into_iter().for_each(|up| given[up] -= node.share * all);
    }
    for (i, node) in flow.nodes.iter().enumerate() {
        let exchanged = flow.exchange_mm3_per_s(i, node.share.abs() * all + most);
        given[i] += exchanged;
        if let Some(up) = node.upstream {
            given[up] += exchanged;
        }
    }
    let fastest = given.iter().zip(&flow.nodes).map(|(rate, node)| rate / node.volume_mm3);
    (COURANT / fastest.fold(f64::MIN_POSITIVE, f64::max)).min(LONGEST_S)
}

#[cfg(test)]
mod tests {
    use endowire_core::vessel::{CentrelineNode, CentrelineTree};

    use super::*;
    use crate::spec::FlowSpec;

    /// A trunk of 100 mm and radius 5 with branches of radii 4 and 2, of 60 mm each.
    fn flow(spec: &FlowSpec, at_mm: Option<[f64; 3]>, rate_ml_per_s: f64) -> Flow {
        let node = |x: f64, y: f64, radius_mm: f64, parent: Option<usize>| CentrelineNode {
            position_mm: Vec3::new(x, y, 0.0),
            radius_mm,
            parent,
        };
        let tree = CentrelineTree::new(vec![
            node(0.0, 0.0, 5.0, None),
            node(100.0, 0.0, 5.0, Some(0)),
            node(136.0, 48.0, 4.0, Some(1)),
            node(136.0, -48.0, 2.0, Some(1)),
        ])
        .unwrap();
        let injection =
            InjectionSpec { start_s: 1.003, duration_s: 0.517, rate_ml_per_s, at_mm, at_tip: false };
        Flow::in_cones(&tree, spec, &[injection]).unwrap()
    }

    fn nowhere() -> TipWay {
        TipWay::new(&[])
    }

    fn steady() -> FlowSpec {
        FlowSpec {
            inflow_ml_per_s: 20.0,
            split_exponent: 3.0,
            pulsatility: 0.0,
            tissue_s: 2.0,
            ..FlowSpec::default()
        }
    }

    /// An inlet and an outlet of 50 mm and radius 4, and a ring of arms of radius 3 between them, of 60 and 120 mm.
    fn ring(injection: InjectionSpec) -> Flow {
        let places = [
            ([0.0, 0.0], 4.0, None),
            ([50.0, 0.0], 4.0, Some(0)),
            ([52.0, 0.0], 3.0, Some(1)),
            ([108.0, 0.0], 3.0, Some(2)),
            ([110.0, 0.0], 4.0, Some(3)),
            ([160.0, 0.0], 4.0, Some(4)),
            ([50.0, 30.0], 3.0, Some(1)),
            ([110.0, 30.0], 3.0, Some(6)),
        ];
        let node = |&([x, y], radius_mm, parent): &([f64; 2], f64, Option<usize>)| CentrelineNode {
            position_mm: Vec3::new(x, y, 0.0),
            radius_mm,
            parent,
        };
        let tree = CentrelineTree::new(places.iter().map(node).collect()).unwrap();
        let links = vec![endowire_core::vessel::CentrelineLink { row: 7, joins: 4 }];
        let spec = FlowSpec { inlet_mm: Some([0.0; 3]), dispersion: 0.0, ..steady() };
        Flow::in_cones(&tree.with_links(links).unwrap(), &spec, &[injection]).unwrap()
    }

    #[test]
    fn medium_takes_both_arms_of_a_ring_and_is_kept() {
        let injection =
            |at_mm| InjectionSpec { start_s: 0.5, duration_s: 0.5, rate_ml_per_s: 4.0, at_mm, at_tip: false };
        for at_mm in [None, Some([80.0, 30.0, 0.0])] {
            let flow = ring(injection(at_mm));
            let mut transport = Transport::new(&flow);
            let mut most = [0.0_f32; 3];
            for time in (1..400).map(|k| 0.02 * f64::from(k)) {
                transport.advance(&flow, time, &nowhere());
                let now = transport.at(time);
                let at = |x: f64, y: f64| now[flow.nearest(&Vec3::new(x, y, 0.0))];
                let here = [at(80.0, 0.0), at(95.0, 30.0), at(140.0, 0.0)];
                most.iter_mut().zip(here).for_each(|(most, here)| *most = most.max(here));
                let until = transport.steps as f64 * transport.step_s;
                let injected = 4000.0 * (until - 0.5).clamp(0.0, 0.5);
                let found = transport.inside_mm3(&flow)
                    + transport.tissue_mm3.iter().sum::<f64>()
                    + transport.left_mm3;
                assert!((found - injected).abs() < 1e-9 * injected.max(1.0), "{time}: {found} {injected}");
                assert!(transport.fractions.iter().all(|f| (-1e-12..=1.0 + 1e-9).contains(f)));
            }
            // From the inlet by both arms; into the long arm alone, not by the short one.
            let expected = [if at_mm.is_none() { 0.15 } else { -1.0 }, 0.15, 0.1];
            assert!(most.iter().zip(expected).all(|(most, least)| *most > least), "{most:?}");
            assert!(at_mm.is_none() || most[0] < 1e-6, "{most:?}");
        }
    }

    const IN_SMALL: Option<[f64; 3]> = Some([127.0, -36.0, 0.0]);

    #[test]
    fn what_is_injected_is_in_the_tree_in_the_tissue_or_gone_whichever_way_it_went() {
        for (pulsatility, at, rate) in
            [(0.0, None, 8.0), (0.8, None, 8.0), (0.8, IN_SMALL, 1.0), (0.8, IN_SMALL, 9.0)]
        {
            let flow = flow(&FlowSpec { pulsatility, ..steady() }, at, rate);
            let mut transport = Transport::new(&flow);
            for time in [1.2, 1.6, 2.0, 3.0, 9.0, 40.0] {
                transport.advance(&flow, time, &nowhere());
                let until = transport.steps as f64 * transport.step_s;
                let injected = 1000.0 * rate * (until - 1.003).clamp(0.0, 0.517);
                let found = transport.inside_mm3(&flow)
                    + transport.tissue_mm3.iter().sum::<f64>()
                    + transport.left_mm3;
                assert!((found - injected).abs() < 1e-9 * injected.max(1.0), "{time}: {found} {injected}");
                assert!(transport.fractions.iter().all(|f| (-1e-12..=1.0 + 1e-9).contains(f)));
            }
            assert!(transport.inside_mm3(&flow) < 1e-6, "all has gone");
        }
    }

    #[test]
    fn an_injection_faster_than_the_stream_goes_against_it_and_a_slower_one_does_not() {
        let reach = |rate| {
            let flow = flow(&FlowSpec { dispersion: 0.0, ..steady() }, IN_SMALL, rate);
            let mut transport = Transport::new(&flow);
            transport.advance(&flow, 1.5, &nowhere());
            let late = transport.at(1.5);
            let at = |x: f64, y: f64| late[flow.nearest(&Vec3::new(x, y, 0.0))];
            // Before its position, in the other branch, at its end, in the trunk.
            [at(118.0, -24.0), at(118.0, 24.0), at(136.0, -48.0), at(80.0, 0.0)]
        };
        // A ninth of 20 ml/s arrives there.
        let [before, other, end, trunk] = reach(1.0);
        assert!(before < 1e-6 && other < 1e-6 && trunk < 1e-6, "{before} {other} {trunk}");
        // q/(F + q) with F = (20 + 1)/9 − 1.
        assert!((end - 3.0 / 7.0).abs() < 0.01, "{end}");
        let [before, other, end, trunk] = reach(9.0);
        assert!(before > 0.99 && end > 0.99, "{before} {end}");
        assert!(other > 0.05 && other < 0.4 && trunk < 1e-6, "{other} {trunk}");
    }

    #[test]
    fn a_moment_is_the_same_whatever_was_asked_before() {
        let flow = flow(&FlowSpec { pulsatility: 0.7, ..steady() }, None, 8.0);
        let mut often = Transport::new(&flow);
        for k in 0..70 {
            often.advance(&flow, 0.04 * f64::from(k), &nowhere());
        }
        let mut once = Transport::new(&flow);
        often.advance(&flow, 1.777, &nowhere());
        once.advance(&flow, 1.777, &nowhere());
        assert_eq!(often.at(1.777), once.at(1.777));
        assert!(once.at(1.777).iter().any(|f| *f > 0.1));
        // Back from a stored moment: few are stored, and none after the requested time is used.
        assert!(often.marks.len() <= MOST_MARKS && often.apart > 1, "{}", often.apart);
        for time in [1.21, 2.4, 1.003, 1.777] {
            often.advance(&flow, time, &nowhere());
            let mut alone = Transport::new(&flow);
            alone.advance(&flow, time, &nowhere());
            assert_eq!((often.at(time), often.steps), (alone.at(time), alone.steps), "{time}");
            assert_eq!(often.tissue_mm3, alone.tissue_mm3);
        }
        let near = often.marks.partition_point(|mark| mark.steps <= often.steps);
        assert!(
            near > 0 && often.steps - often.marks[near - 1].steps < often.apart,
            "the twin: from the first moment"
        );
    }

    #[test]
    fn a_heart_beats_without_changing_what_passes() {
        let flow = flow(&FlowSpec { pulsatility: 0.9, heart_rate_per_min: 60.0, ..steady() }, None, 8.0);
        let pulse: Vec<f64> = (0..1000).map(|k| flow.pulse(f64::from(k) * 1e-3)).collect();
        let mean = pulse.iter().sum::<f64>() / 1e3;
        assert!((mean - 1.0).abs() < 1e-3, "{mean}");
        let most = pulse.iter().copied().fold(0.0, f64::max);
        assert!((most - flow.highest_pulse()).abs() < 1e-3 && most > 2.0, "{most}");
        assert!(pulse.iter().all(|p| *p > 0.09));
    }

    #[test]
    fn between_injections_far_apart_nothing_is_computed_and_the_later_one_is_as_it_is_alone() {
        let one = |start_s: f64| InjectionSpec {
            start_s,
            duration_s: 0.5,
            rate_ml_per_s: 8.0,
            at_mm: None,
            at_tip: false,
        };
        let carried = |injections: &[InjectionSpec], time_s: f64| {
            let spec = FlowSpec { tissue_s: 0.05, ..steady() };
            let flow = flow(&spec, None, 8.0).injected(injections);
            let mut transport = Transport::new(&flow);
            transport.advance(&flow, time_s, &nowhere());
            (flow, transport)
        };
        // When the first has gone, the next step is that of the second, eleven days later.
        let (flow, mut waiting) = carried(&[one(0.5), one(1e6)], 300.0);
        let now_s = |transport: &Transport| transport.steps as f64 * transport.step_s;
        assert!(now_s(&waiting) < 301.0);
        waiting.wait(&flow, i64::MAX);
        assert!((0.0..=waiting.step_s).contains(&(1e6 - now_s(&waiting))), "{}", now_s(&waiting));
        let (flow, mut early) = carried(&[one(0.5), one(1e6)], 1.2);
        early.wait(&flow, i64::MAX);
        assert!(now_s(&early) < 1.3, "the twin: the first is still there");
        let [both, alone] = [&[one(0.5), one(1e6)][..], &[one(1e6)]].map(|injections| {
            let (_, transport) = carried(injections, 1e6 + 0.4);
            transport.at(1e6 + 0.4)
        });
        let most = both.iter().zip(&alone).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        // Two injections have shorter steps.
        assert!(most < 0.02, "{most}");
        assert!(alone.iter().any(|f| *f > 0.2), "the twin: there is medium");
    }
}

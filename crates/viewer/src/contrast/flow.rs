//! A bolus in a vessel tree.
//!
//! Blood enters the centre-line tree at its inlet and divides at bifurcations in proportion to radiusⁿ: n = 2 gives all branches
//! the same mean velocity, as in large arteries, n = 3 is Murray's law for small ones (Proceedings of the National Academy of
//! Sciences 12, 1926). Contrast medium injected at a rate q where the flow is Q mixes at once to the
//! fraction q/(Q + q) and travels downstream with the mean velocity (Q + q)/πr², so it reaches a point after the transit time
//! τ = ∫ πr²/(Q + q) ds. Fronts spread on the way (velocity profiles, curvature, pulsation): the fraction at a point is
//!
//! ```text
//! f(t) = q/(Q + q) · [G((t − t₀ − τ)/σ) − G((t − t₀ − T − τ)/σ)],   σ² = σ₀² + k² τ
//! ```
//!
//! with the logistic distribution G of deviation one. Nothing flows upstream.

use endowire_core::vessel::{CentrelineNode, CentrelineTree};
use endowire_core::{Error, Result, Vec3};

use crate::spec::{FlowSpec, InjectionSpec, ViewSpec};

/// Points of the tree are set at most this far apart, mm.
const SPACING_MM: f64 = 2.0;
/// Most points: every cell of the lumen asks all of them which is nearest.
const MOST_NODES: f64 = 50_000.0;
/// Ends of at least this part of the widest's radius are about as wide.
const ABOUT_AS_WIDE: f64 = 0.95;
/// Deviation of a front where it is injected, s.
const FIRST_SPREAD_S: f64 = 0.05;

/// A point of the vessel, after those upstream of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub(super) position_mm: Vec3,
    pub(super) radius_mm: f64,
    /// The point before it, towards the inlet.
    pub(super) upstream: Option<usize>,
    /// Share of the inflow that passes here.
    share: f64,
    /// Lumen between the point before and this one, mm³.
    volume_mm3: f64,
}

/// When and how much of one injection arrives at each node.
#[derive(Debug, Clone)]
struct Bolus {
    start_s: f64,
    duration_s: f64,
    fraction: f64,
    /// Transit time; `None` where nothing arrives.
    transit_s: Vec<Option<f64>>,
}

/// The tree directed from its inlet, with its injections.
#[derive(Debug, Clone)]
pub(crate) struct Flow {
    pub(super) nodes: Vec<Node>,
    boluses: Vec<Bolus>,
    dispersion: f64,
}

impl Flow {
    /// The flow that the injections of `spec` go with; `None` where there are none.
    ///
    /// # Errors
    /// [`Error::Parameter`] without a centre line or for one that cannot be followed; [`Error::Content`] for its file.
    pub(crate) fn of_view(spec: &ViewSpec) -> Result<Option<Self>> {
        if spec.injection.is_empty() {
            return Ok(None);
        }
        let Some(path) = &spec.flow.tree else {
            let mend = "contrast medium flows along a centre line; give view.flow.tree";
            return Err(Error::parameter("view.injection", format!("{} tables", spec.injection.len()), mend));
        };
        let tree = CentrelineTree::read(path).map_err(|error| match error {
            Error::File { path, source } => {
                Error::parameter("view.flow.tree", path.display(), source.to_string())
            }
            other => other,
        })?;
        Self::new(&tree, &spec.flow, &spec.injection).map(Some)
    }

    pub(super) fn new(tree: &CentrelineTree, spec: &FlowSpec, injections: &[InjectionSpec]) -> Result<Self> {
        let nodes = directed(tree, spec)?;
        let flow_mm3 = spec.inflow_ml_per_s * 1000.0;
        let boluses = injections
            .iter()
            .map(|injection| {
                let at = injection.at_mm.map_or(0, |point| nearest(&nodes, &Vec3::from(point)));
                let q = injection.rate_ml_per_s * 1000.0;
                let blood = flow_mm3 * nodes[at].share;
                let mut transit_s: Vec<Option<f64>> = vec![None; nodes.len()];
                transit_s[at] = Some(0.0);
                for i in at + 1..nodes.len() {
                    let Some(before) = nodes[i].upstream.and_then(|up| transit_s[up]) else {
                        continue;
                    };
                    let flow = (blood + q) * nodes[i].share / nodes[at].share;
                    transit_s[i] = Some(before + nodes[i].volume_mm3 / flow);
                }
                Bolus {
                    start_s: injection.start_s,
                    duration_s: injection.duration_s,
                    fraction: q / (blood + q),
                    transit_s,
                }
            })
            .collect();
        Ok(Self { nodes, boluses, dispersion: spec.dispersion })
    }

    /// Fraction of contrast medium at each node.
    pub(super) fn fractions(&self, time_s: f64) -> Vec<f32> {
        (0..self.nodes.len())
            .map(|node| {
                let sum: f64 = self.boluses.iter().map(|bolus| self.fraction(bolus, node, time_s)).sum();
                sum.min(1.0) as f32
            })
            .collect()
    }

    fn fraction(&self, bolus: &Bolus, node: usize, time_s: f64) -> f64 {
        let Some(transit) = bolus.transit_s[node] else { return 0.0 };
        let spread = (FIRST_SPREAD_S.powi(2) + self.dispersion.powi(2) * transit).sqrt();
        let passed = |since: f64| logistic(since / spread);
        let since = time_s - bolus.start_s - transit;
        bolus.fraction * (passed(since) - passed(since - bolus.duration_s))
    }

    /// Largest fraction of contrast medium that each node ever sees from one injection.
    pub(super) fn largest(&self) -> Vec<f32> {
        (0..self.nodes.len())
            .map(|node| {
                let peak = |bolus: &Bolus| {
                    let transit = bolus.transit_s[node]?;
                    // The middle of the passage.
                    Some(self.fraction(bolus, node, bolus.start_s + transit + bolus.duration_s / 2.0))
                };
                self.boluses.iter().filter_map(peak).fold(0.0, f64::max) as f32
            })
            .collect()
    }
}

/// Logistic distribution function of mean zero and deviation one.
fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x * std::f64::consts::PI / 3.0_f64.sqrt()).exp())
}

pub(super) fn nearest(nodes: &[Node], point: &Vec3) -> usize {
    let distance = |i: &usize| (nodes[*i].position_mm - point).norm_squared();
    (0..nodes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

/// The end where an artery is supplied: the widest, and of those about as wide the one nearest to the head.
fn supplying(points: &[CentrelineNode], ends: impl Iterator<Item = usize> + Clone) -> Option<usize> {
    let widest = ends.clone().map(|i| points[i].radius_mm).fold(0.0, f64::max);
    let wide = ends.filter(|&i| points[i].radius_mm >= ABOUT_AS_WIDE * widest);
    wide.max_by(|&a, &b| points[a].position_mm.z.total_cmp(&points[b].position_mm.z))
}

/// The tree's points and some between them, from the inlet downstream, with the shares of the flow.
fn directed(tree: &CentrelineTree, spec: &FlowSpec) -> Result<Vec<Node>> {
    let points = tree.nodes();
    let pieces = |a: &Vec3, b: &Vec3| ((b - a).norm() / SPACING_MM).ceil().max(1.0);
    let parent = |i: usize| points[i].parent.map(|parent| points[parent].position_mm);
    let count: f64 = (0..points.len())
        .filter_map(|i| parent(i).map(|before| pieces(&before, &points[i].position_mm)))
        .sum();
    if count > MOST_NODES {
        let mend = format!(
            "with a point each {SPACING_MM} mm it has {count:.0} points, at most {MOST_NODES} are followed: mend the unit (mm), or \
             leave out branches or points"
        );
        return Err(Error::parameter("view.flow.tree", format!("{} rows", points.len()), mend));
    }
    let mut neighbours: Vec<Vec<usize>> = vec![vec![]; points.len()];
    for (i, point) in points.iter().enumerate() {
        if let Some(parent) = point.parent {
            neighbours[i].push(parent);
            neighbours[parent].push(i);
        }
    }
    let ends = (0..points.len()).filter(|&i| neighbours[i].len() == 1);
    let inlet = match spec.inlet_mm {
        None => supplying(points, ends),
        Some(near) => {
            let near = Vec3::from(near);
            let distance = |i: &usize| (points[*i].position_mm - near).norm();
            ends.min_by(|a, b| distance(a).total_cmp(&distance(b)))
        }
    };
    let inlet = inlet.ok_or_else(|| {
        Error::parameter(
            "view.flow.tree",
            format!("{} rows", points.len()),
            "has no end where blood comes in",
        )
    })?;
    let place = |i: usize| (points[i].position_mm, points[i].radius_mm);
    let (position_mm, radius_mm) = place(inlet);
    let mut nodes = vec![Node { position_mm, radius_mm, upstream: None, share: 1.0, volume_mm3: 0.0 }];
    // Points whose downstream neighbours are still to come, with the point before and the node they became.
    let mut open = vec![(inlet, usize::MAX, 0_usize)];
    while let Some((at, before, becomes)) = open.pop() {
        let onwards: Vec<usize> = neighbours[at].iter().copied().filter(|&n| n != before).collect();
        let weight = |i: usize| points[i].radius_mm.powf(spec.split_exponent);
        let total: f64 = onwards.iter().map(|&i| weight(i)).sum();
        let widest = onwards.iter().map(|&i| points[i].radius_mm).fold(0.0, f64::max);
        for &next in &onwards {
            let share = nodes[becomes].share * weight(next) / total;
            let ((x0, r0), (x1, r1)) = (place(at), place(next));
            // A side branch begins where it leaves the trunk, and has its own radius from there on.
            let is_side = r1 < widest;
            let steps = pieces(&x0, &x1) as usize;
            let step = (x1 - x0).norm() / steps as f64;
            let mut last = becomes;
            for k in 1..=steps {
                let w = k as f64 / steps as f64;
                let radius_mm = if is_side { r1 } else { r0 + (r1 - r0) * w };
                let within = is_side && w * (x1 - x0).norm() < r0;
                let [ra, rb] = [if is_side { r1 } else { nodes[last].radius_mm }, radius_mm];
                let cone = std::f64::consts::PI * step * (ra * ra + ra * rb + rb * rb) / 3.0;
                nodes.push(Node {
                    position_mm: x0 + (x1 - x0) * w,
                    radius_mm,
                    upstream: Some(last),
                    share,
                    volume_mm3: if within { 0.0 } else { cone },
                });
                last = nodes.len() - 1;
            }
            open.push((next, at, last));
        }
    }
    Ok(nodes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trunk of 100 mm and radius 5 that divides into radii 4 and 2.
    fn tree() -> CentrelineTree {
        let node = |x: f64, y: f64, radius_mm: f64, parent: Option<usize>| CentrelineNode {
            position_mm: Vec3::new(x, y, 0.0),
            radius_mm,
            parent,
        };
        CentrelineTree::new(vec![
            node(0.0, 0.0, 5.0, None),
            node(100.0, 0.0, 5.0, Some(0)),
            node(140.0, 30.0, 4.0, Some(1)),
            node(140.0, -30.0, 2.0, Some(1)),
        ])
        .unwrap()
    }

    fn injection(at_mm: Option<[f64; 3]>) -> InjectionSpec {
        InjectionSpec { start_s: 1.0, duration_s: 2.0, rate_ml_per_s: 5.0, at_mm }
    }

    fn flow(at_mm: Option<[f64; 3]>) -> Flow {
        let spec = FlowSpec { inflow_ml_per_s: 20.0, split_exponent: 3.0, ..FlowSpec::default() };
        Flow::new(&tree(), &spec, &[injection(at_mm)]).unwrap()
    }

    #[test]
    fn flow_divides_as_the_cube_of_the_radius_and_all_of_it_goes_on() {
        let flow = flow(None);
        let at = |x: f64, y: f64| flow.nodes[nearest(&flow.nodes, &Vec3::new(x, y, 0.0))].share;
        assert!((at(140.0, 30.0) / at(140.0, -30.0) - 8.0).abs() < 1e-12);
        assert!((at(140.0, 30.0) + at(140.0, -30.0) - 1.0).abs() < 1e-12);
        assert_eq!(at(50.0, 0.0), 1.0);
    }

    #[test]
    fn the_bolus_arrives_after_the_volume_on_its_way_has_passed() {
        let flow = flow(None);
        let end = nearest(&flow.nodes, &Vec3::new(100.0, 0.0, 0.0));
        // 100 mm of 25π mm² at 25 ml/s.
        let transit = std::f64::consts::PI * 2500.0 / 25_000.0;
        assert!((flow.boluses[0].transit_s[end].unwrap() - transit).abs() < 1e-9);
        let at = |t: f64| f64::from(flow.fractions(t)[end]);
        assert!(at(0.5) < 1e-3 && (at(1.0 + transit) - 0.1).abs() < 1e-3, "half of the front has passed");
        assert!((at(2.0 + transit) - 0.2).abs() < 1e-3 && at(5.0) < 1e-3);
        // What passes is what was injected: ∫ f (Q + q) dt = q T.
        let passed: f64 = (0..1000).map(|k| at(f64::from(k) * 0.01) * 0.01 * 25.0).sum();
        assert!((passed - 10.0).abs() < 0.05, "{passed}");
        assert!((f64::from(flow.largest()[end]) - 0.2).abs() < 1e-3);
    }

    #[test]
    fn a_side_branch_fills_from_where_it_leaves_the_trunk() {
        let flow = flow(None);
        let transit =
            |x: f64, y: f64| flow.boluses[0].transit_s[nearest(&flow.nodes, &Vec3::new(x, y, 0.0))].unwrap();
        // 45 of the small branch's 50 mm lie outside the trunk of radius 5; a ninth of 25 ml/s flows there.
        let outside = std::f64::consts::PI * 4.0 * 46.0 / (25_000.0 / 9.0);
        let branch = transit(140.0, -30.0) - transit(100.0, 0.0);
        assert!((branch / outside - 1.0).abs() < 0.05, "{branch} {outside}");
    }

    #[test]
    fn nothing_flows_upstream_or_into_the_other_branch() {
        let flow = flow(Some([120.0, 15.0, 0.0]));
        let late = flow.fractions(2.0);
        let at = |x: f64, y: f64| late[nearest(&flow.nodes, &Vec3::new(x, y, 0.0))];
        assert!(at(140.0, 30.0) > 0.1);
        assert_eq!((at(50.0, 0.0), at(140.0, -30.0)), (0.0, 0.0));
    }

    #[test]
    fn a_tree_of_too_many_points_is_refused_before_it_is_made() {
        let node = |x: f64, parent| CentrelineNode { position_mm: Vec3::x() * x, radius_mm: 5.0, parent };
        let long = CentrelineTree::new(vec![node(0.0, None), node(9e5, Some(0))]).unwrap();
        let error = Flow::new(&long, &FlowSpec::default(), &[injection(None)]).unwrap_err().to_string();
        assert!(error.contains("view.flow.tree") && error.contains("450000"), "{error}");
    }

    #[test]
    fn left_alone_blood_comes_in_at_the_widest_end_nearest_to_the_head() {
        let node = |z: f64, radius_mm: f64, parent| CentrelineNode {
            position_mm: Vec3::new(if radius_mm < 5.0 { 30.0 } else { 0.0 }, 0.0, z),
            radius_mm,
            parent,
        };
        // An aorta from its lower end, with a branch to the liver.
        let tree = |lower: f64, upper: f64| {
            let nodes = vec![
                node(0.0, lower, None),
                node(60.0, 9.0, Some(0)),
                node(120.0, upper, Some(1)),
                node(140.0, 3.0, Some(1)),
            ];
            CentrelineTree::new(nodes).unwrap()
        };
        let first = |tree: &CentrelineTree| {
            Flow::new(tree, &FlowSpec::default(), &[injection(None)]).unwrap().nodes[0].position_mm.z
        };
        assert_eq!(first(&tree(9.0, 9.0)), 120.0);
        assert_eq!(first(&tree(9.1, 9.0)), 120.0);
        assert_eq!(first(&tree(12.0, 9.0)), 0.0, "the twin: a wider lower end supplies");
    }

    #[test]
    fn the_inlet_may_be_any_end() {
        let spec =
            FlowSpec { inlet_mm: Some([150.0, 30.0, 0.0]), split_exponent: 3.0, ..FlowSpec::default() };
        let flow = Flow::new(&tree(), &spec, &[injection(None)]).unwrap();
        assert_eq!(flow.nodes[0].position_mm, Vec3::new(140.0, 30.0, 0.0));
        // At the bifurcation the trunk and the small branch are downstream now.
        let share = |x: f64, y: f64| flow.nodes[nearest(&flow.nodes, &Vec3::new(x, y, 0.0))].share;
        assert!((share(0.0, 0.0) / share(140.0, -30.0) - 125.0 / 8.0).abs() < 1e-9);
    }
}

//! The vessel tree that transports contrast medium, directed from its inlet.
//!
//! Blood enters the centre-line tree at its inlet, divides at bifurcations, and where branches meet again takes both arms
//! ([`FlowGraph`]). The inflow is pulsatile: a fraction of it, the pulsatility, in systole, the rest steadily.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use endowire_core::flow::{FlowGraph, FlowNode, Rings};
use endowire_core::vessel::{CentrelineTree, SurfaceMesh};
use endowire_core::{Error, Result, Vec3};

use super::mixing::Mixing;
use super::tip_way::TipWay;
use super::transport::Transport;
use super::volumes::volumes_mm3;
use crate::spec::{FlowSpec, InjectionSpec, ViewSpec};

/// Smallest volume of a cell, relative to that of the centre line: one invisible in the image must not make the time
/// step vanish.
const LEAST_PART: f64 = 0.25;
/// Most blood that tissue can take, in its volumes per second. The carotid body, which no other tissue exceeds, takes 20
/// millilitres a minute per millilitre, kidneys take 4.
const MOST_PERFUSED_PER_S: f64 = 20.0 / 60.0;
/// Fraction of a heartbeat in systole.
const SYSTOLE: f64 = 0.35;

/// A point of the vessel; points upstream of it come before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub(super) position_mm: Vec3,
    pub(super) radius_mm: f64,
    /// The point before it, towards the inlet.
    pub(super) upstream: Option<usize>,
    /// Local share of the inflow; negative where blood flows towards the point before.
    pub(super) share: f64,
    /// Volume of lumen of this point, mm³.
    pub(super) volume_mm3: f64,
    /// Distance from the point before, mm.
    length_mm: f64,
    /// Whether it is an end of the tree.
    pub(super) is_end: bool,
}

/// A face between the last cell of an arm and the cell that it joins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Link {
    pub(super) from: usize,
    pub(super) to: usize,
    /// Share of the inflow through it; negative from the joined cell into the arm.
    pub(super) share: f64,
}

/// The points of a vessel, and how arms of rings join them.
#[derive(Debug, Clone)]
pub(super) struct Network {
    pub(super) nodes: Vec<Node>,
    pub(super) links: Vec<Link>,
    /// Faces of cells, then of links.
    rings: Rings,
}

/// The tree directed from its inlet, with its injections.
#[derive(Debug)]
pub(crate) struct Flow {
    pub(super) nodes: Vec<Node>,
    pub(super) links: Vec<Link>,
    rings: Rings,
    /// Mixing of blood in the lumen.
    pub(super) mixing: Arc<Mixing>,
    largest: OnceLock<Vec<f32>>,
    carried: OnceLock<Mutex<Carried>>,
    pub(super) injections: Vec<InjectionSpec>,
    pub(super) mean_inflow_mm3_per_s: f64,
    /// Mean residence time of medium in the tissue behind an end, s.
    pub(super) tissue_s: f64,
    /// Radius of that tissue, if drawn, mm.
    pub(super) tissue_mm: Option<f64>,
    beat_s: f64,
    pulsatility: f64,
    dispersion: f64,
}

/// The transported medium, and the path of the injecting tip.
#[derive(Debug)]
pub(super) struct Carried {
    tip: TipWay,
    transport: Transport,
}

impl Carried {
    /// Records the tip position at a time, in the vessel at rest.
    fn follow(&mut self, flow: &Flow, time_s: f64, place_mm: Vec3) {
        let known_s = self.tip.follow(time_s, place_mm);
        self.transport.forget_after(flow, known_s);
    }

    /// The medium at a time, with the tip position then.
    pub(super) fn at(&mut self, flow: &Flow, time_s: f64, tip_mm: Option<Vec3>) -> &Transport {
        if let Some(place_mm) = tip_mm {
            self.follow(flow, time_s, place_mm);
        }
        self.transport.advance(flow, time_s, &self.tip);
        &self.transport
    }
}

impl Flow {
    /// The flow with the injections of `spec`, in the lumen enclosed by `filled`; `None` without injections.
    ///
    /// # Errors
    /// [`Error::Parameter`] without a centre line or for an unusable one; [`Error::Content`] for its file.
    pub(crate) fn of_view(spec: &ViewSpec, filled: &SurfaceMesh) -> Result<Option<Self>> {
        if spec.injection.is_empty() {
            return Ok(None);
        }
        let given = spec.flow.tree.as_deref().map(read_tree).transpose()?;
        let Some(tree) = given.as_ref().or(spec.flow.centreline.as_deref()) else {
            let remedy = "contrast medium flows along a centre line; give view.flow.tree";
            return Err(Error::parameter(
                "view.injection",
                format!("{} tables", spec.injection.len()),
                remedy,
            ));
        };
        Self::new(tree, filled, &spec.flow, &spec.injection).map(Some)
    }

    pub(super) fn new(
        tree: &CentrelineTree,
        filled: &SurfaceMesh,
        spec: &FlowSpec,
        injections: &[InjectionSpec],
    ) -> Result<Self> {
        let mut network = directed(tree, spec)?;
        let mut mixing = Mixing::new(&network.nodes, &network.links);
        let volumes = volumes_mm3(&mut mixing, network.nodes.len(), filled);
        for (node, volume) in network.nodes.iter_mut().zip(volumes) {
            node.volume_mm3 = volume.max(LEAST_PART * node.volume_mm3);
        }
        Ok(Self::of_network(network, mixing, spec, injections))
    }

    fn of_network(network: Network, mixing: Mixing, spec: &FlowSpec, injections: &[InjectionSpec]) -> Self {
        let Network { nodes, links, rings } = network;
        Self {
            nodes,
            links,
            rings,
            mixing: Arc::new(mixing),
            largest: OnceLock::new(),
            carried: OnceLock::new(),
            injections: injections.to_vec(),
            mean_inflow_mm3_per_s: spec.inflow_ml_per_s * 1000.0,
            tissue_s: spec.tissue_s,
            tissue_mm: spec.tissue_mm,
            beat_s: 60.0 / spec.heart_rate_per_min,
            pulsatility: spec.pulsatility,
            dispersion: spec.dispersion,
        }
    }

    /// In a lumen exactly that of the centre line.
    #[cfg(test)]
    pub(super) fn in_cones(
        tree: &CentrelineTree,
        spec: &FlowSpec,
        injections: &[InjectionSpec],
    ) -> Result<Self> {
        let network = directed(tree, spec)?;
        let mixing = Mixing::new(&network.nodes, &network.links);
        Ok(Self::of_network(network, mixing, spec, injections))
    }

    /// The point nearest to a position.
    #[cfg(test)]
    pub(super) fn nearest(&self, place: &Vec3) -> usize {
        let distance = |i: &usize| (self.nodes[*i].position_mm - place).norm_squared();
        (0..self.nodes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
    }

    /// The same vessel and blood with other injections.
    pub(crate) fn injected(&self, injections: &[InjectionSpec]) -> Self {
        Self {
            nodes: self.nodes.clone(),
            links: self.links.clone(),
            rings: self.rings.clone(),
            mixing: Arc::clone(&self.mixing),
            largest: OnceLock::new(),
            carried: OnceLock::new(),
            injections: injections.to_vec(),
            ..*self
        }
    }

    /// The same before anything has been injected.
    pub(crate) fn anew(&self) -> Self {
        self.injected(&self.injections)
    }

    /// Whether an injection comes out of a tip: then its medium belongs to one run.
    pub(crate) fn follows_tip(&self) -> bool {
        self.injections.iter().any(|one| one.at_tip)
    }

    /// The ends of the tree behind which tissue is drawn, with its radius, mm. An end that carries more blood than this
    /// tissue can take is a large vessel that was cut: it leads on, and its medium leaves the picture.
    pub(super) fn supplying_ends(&self) -> impl Iterator<Item = (usize, &Node, f64)> {
        let radius_mm = self.tissue_mm.unwrap_or(0.0);
        let most = MOST_PERFUSED_PER_S * std::f64::consts::PI * 4.0 / 3.0 * radius_mm.powi(3);
        let ends = self.nodes.iter().enumerate().filter(|(_, node)| node.is_end);
        let supplies = move |node: &Node| node.share * self.mean_inflow_mm3_per_s <= most;
        ends.filter(move |(_, node)| supplies(node)).map(move |(end, node)| (end, node, radius_mm))
    }

    /// Records the tip position at a time, in the vessel at rest. Frames do so themselves.
    pub(crate) fn follow_tip(&self, time_s: f64, place_mm: Vec3) {
        if self.follows_tip() {
            self.carried().follow(self, time_s, place_mm);
        }
    }

    /// The transported medium, shared by all views: a moment does not depend on which were requested before.
    pub(super) fn carried(&self) -> MutexGuard<'_, Carried> {
        let anew =
            || Mutex::new(Carried { tip: TipWay::new(&self.injections), transport: Transport::new(self) });
        self.carried.get_or_init(anew).lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The largest fraction that each cell ever reaches.
    pub(super) fn largest(&self) -> &[f32] {
        self.largest.get_or_init(|| Transport::largest(self))
    }

    /// Inflow at a time relative to its mean: a raised cosine in systole over a steady part.
    pub(super) fn pulse(&self, time_s: f64) -> f64 {
        let part = (time_s / self.beat_s).rem_euclid(1.0) / SYSTOLE;
        let systole =
            if part < 1.0 { (1.0 - libm::cos(std::f64::consts::TAU * part)) / SYSTOLE } else { 0.0 };
        1.0 - self.pulsatility + self.pulsatility * systole
    }

    /// The maximum of [`Self::pulse`].
    pub(super) fn highest_pulse(&self) -> f64 {
        1.0 - self.pulsatility + self.pulsatility * 2.0 / SYSTOLE
    }

    /// Divides flows through the faces of cells and links among the arms of rings, mm³/s.
    pub(super) fn settle(&self, faces_mm3_per_s: &mut [f64]) {
        self.rings.settle(faces_mm3_per_s);
    }

    /// Volume exchanged by diffusion across the face upstream of a cell at a flow through it, mm³/s: the wanted
    /// spreading of a bolus, minus the numerical one of cells of this length.
    pub(super) fn exchange_mm3_per_s(&self, cell: usize, flow_mm3_per_s: f64) -> f64 {
        let node = &self.nodes[cell];
        if node.length_mm <= 0.0 {
            return 0.0;
        }
        let area = node.volume_mm3 / node.length_mm;
        let velocity = flow_mm3_per_s.abs() / area;
        // After a transit time τ the standard deviation of the front in time is k √τ: a diffusivity of k² v²/2.
        let wanted = (self.dispersion * velocity).powi(2) / 2.0;
        // With more than the flow itself there would be no front.
        let more = (wanted - velocity * node.length_mm / 2.0).clamp(0.0, velocity * node.length_mm);
        more * area / node.length_mm
    }
}

/// Reads the table of a centre line that `view.flow.tree` names.
pub(crate) fn read_tree(path: &Path) -> Result<CentrelineTree> {
    CentrelineTree::read(path).map_err(|error| match error {
        Error::File { path, source } => {
            Error::parameter("view.flow.tree", path.display(), source.to_string())
        }
        other => other,
    })
}

/// The tree's points with intermediate ones, and the volumes of cones from the point before. A branch starts where it
/// leaves its trunk: before that its blood is the trunk's.
fn directed(tree: &CentrelineTree, spec: &FlowSpec) -> Result<Network> {
    let graph = FlowGraph::new(
        tree,
        spec.inlet_mm.map(Vec3::from),
        spec.split_exponent,
        ["view.flow.tree", "view.flow.inlet_mm"],
    )?;
    let found = &graph.nodes;
    let mut goes_on = vec![false; found.len()];
    graph.links.iter().for_each(|link| goes_on[link.from] = true);
    found.iter().filter_map(|node| node.upstream).for_each(|up| goes_on[up] = true);
    let mut nodes: Vec<Node> = Vec::with_capacity(found.len());
    // New index of each.
    let mut becomes: Vec<usize> = Vec::with_capacity(found.len());
    let mut resistances: Vec<f64> = Vec::with_capacity(found.len());
    for (node, goes_on) in found.iter().zip(goes_on) {
        let upstream = node.upstream.map(|up| becomes[up]);
        match upstream {
            Some(trunk) if node.within_trunk && goes_on => becomes.push(trunk),
            _ => {
                becomes.push(nodes.len());
                resistances.push(node.resistance_per_mm3());
                nodes.push(Node { upstream, is_end: !goes_on, ..Node::from(node) });
            }
        }
    }
    // The inlet itself gets the volume of the first stretch.
    if let Some(first) = nodes.get(1).map(|node| node.volume_mm3) {
        nodes[0].volume_mm3 = first;
    }
    let links: Vec<Link> = (graph.links.iter())
        .map(|link| Link { from: becomes[link.from], to: becomes[link.to], share: link.share })
        .collect();
    resistances.extend(graph.links.iter().map(|link| link.resistance_per_mm3));
    let upstream: Vec<Option<usize>> = nodes.iter().map(|node| node.upstream).collect();
    let pairs: Vec<[usize; 2]> = links.iter().map(|link| [link.from, link.to]).collect();
    let rings = Rings::new(&upstream, &pairs, resistances);
    Ok(Network { nodes, links, rings })
}

impl From<&FlowNode> for Node {
    fn from(node: &FlowNode) -> Self {
        let &FlowNode { position_mm, radius_mm, upstream, share, length_mm, from_radius_mm, .. } = node;
        let [ra, rb] = [from_radius_mm, radius_mm];
        let volume_mm3 = std::f64::consts::PI * length_mm * (ra * ra + ra * rb + rb * rb) / 3.0;
        Self { position_mm, radius_mm, upstream, share, volume_mm3, length_mm, is_end: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contrast::transport::Transport;
    use endowire_core::vessel::CentrelineNode;

    /// A trunk of 100 mm and radius 5 with branches of radii 4 and 2.
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
        InjectionSpec { start_s: 1.0, duration_s: 2.0, rate_ml_per_s: 5.0, at_mm, at_tip: false }
    }

    fn flow() -> Flow {
        let spec =
            FlowSpec { inflow_ml_per_s: 20.0, split_exponent: 3.0, pulsatility: 0.0, ..FlowSpec::default() };
        Flow::in_cones(&tree(), &spec, &[injection(None)]).unwrap()
    }

    #[test]
    fn flow_divides_as_the_cube_of_the_radius_and_all_of_it_goes_on() {
        let flow = flow();
        let at = |x: f64, y: f64| flow.nodes[flow.nearest(&Vec3::new(x, y, 0.0))].share;
        assert!((at(140.0, 30.0) / at(140.0, -30.0) - 8.0).abs() < 1e-12);
        assert!((at(140.0, 30.0) + at(140.0, -30.0) - 1.0).abs() < 1e-12);
        assert_eq!(at(50.0, 0.0), 1.0);
    }

    #[test]
    fn the_bolus_arrives_after_the_volume_on_its_way_has_passed() {
        let flow = flow();
        let end = flow.nearest(&Vec3::new(100.0, 0.0, 0.0));
        // 100 mm of 25π mm² at 25 ml/s.
        let transit = std::f64::consts::PI * 2500.0 / 25_000.0;
        let mut transport = Transport::new(&flow);
        let nowhere = TipWay::new(&[]);
        let mut at = |t: f64| {
            transport.advance(&flow, t, &nowhere);
            f64::from(transport.at(t)[end])
        };
        assert!(at(0.5) < 1e-3 && (at(1.0 + transit) - 0.1).abs() < 0.02, "half of the front has passed");
        assert!((at(2.0 + transit) - 0.2).abs() < 1e-3 && at(8.0) < 1e-3);
        // What passes is what was injected: ∫ f F dt = q T, at 25 ml/s until the injection ends and at 20 ml/s after
        // that.
        let passed: f64 = (0..3000)
            .map(|k| f64::from(k) * 0.002)
            .map(|t| at(t) * 0.002 * if t < 3.0 { 25.0 } else { 20.0 })
            .sum();
        assert!((passed - 10.0).abs() < 0.02, "{passed}");
        assert!((f64::from(Transport::largest(&flow)[end]) - 0.2).abs() < 1e-3);
    }

    #[test]
    fn a_tree_of_too_many_points_is_refused_before_it_is_made() {
        let node = |k: usize| CentrelineNode {
            position_mm: Vec3::x() * (1800.0 * k as f64),
            radius_mm: 8.0,
            parent: k.checked_sub(1),
        };
        let long = CentrelineTree::new((0..=500).map(node).collect()).unwrap();
        let error = Flow::in_cones(&long, &FlowSpec::default(), &[injection(None)]).unwrap_err().to_string();
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
            Flow::in_cones(tree, &FlowSpec::default(), &[injection(None)]).unwrap().nodes[0].position_mm.z
        };
        assert_eq!(first(&tree(9.0, 9.0)), 120.0);
        assert_eq!(first(&tree(9.1, 9.0)), 120.0);
        assert_eq!(first(&tree(12.0, 9.0)), 0.0, "the twin: a wider lower end supplies");
    }

    #[test]
    fn an_end_that_carries_more_than_tissue_can_take_is_cut_and_supplies_none() {
        let ends = |inflow_ml_per_s: f64, tissue_mm: Option<f64>| {
            let spec = FlowSpec { inflow_ml_per_s, tissue_mm, split_exponent: 3.0, ..FlowSpec::default() };
            let flow = Flow::in_cones(&tree(), &spec, &[injection(None)]).unwrap();
            flow.supplying_ends().map(|(_, node, _)| node.radius_mm).collect::<Vec<_>>()
        };
        // A ball of 25 mm takes 21.8 ml/s; the branches of radii 4 and 2 get 8/9 and 1/9 of the inflow.
        assert_eq!(ends(80.0, Some(25.0)), [2.0]);
        let mut both = ends(20.0, Some(25.0));
        both.sort_by(f64::total_cmp);
        assert_eq!(both, [2.0, 4.0], "the twin: both can be taken");
        assert!(ends(400.0, Some(25.0)).is_empty() && ends(20.0, None).is_empty());
    }

    #[test]
    fn the_inlet_may_be_any_end() {
        let spec =
            FlowSpec { inlet_mm: Some([150.0, 30.0, 0.0]), split_exponent: 3.0, ..FlowSpec::default() };
        let flow = Flow::in_cones(&tree(), &spec, &[injection(None)]).unwrap();
        assert_eq!(flow.nodes[0].position_mm, Vec3::new(140.0, 30.0, 0.0));
        let astray = FlowSpec { inlet_mm: Some([150.0, 300.0, 0.0]), ..spec };
        let refused = Flow::in_cones(&tree(), &astray, &[injection(None)]).unwrap_err().to_string();
        assert!(refused.starts_with("view.flow.inlet_mm = [150, 300, 0]: the nearest end"), "{refused}");
        // At the bifurcation the trunk and the small branch are now downstream.
        let share = |x: f64, y: f64| flow.nodes[flow.nearest(&Vec3::new(x, y, 0.0))].share;
        assert!((share(0.0, 0.0) / share(140.0, -30.0) - 125.0 / 8.0).abs() < 1e-9);
    }
}

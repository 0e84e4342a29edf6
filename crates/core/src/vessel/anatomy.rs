//! Built-in vessels, as centre-line trees made from published dimensions.
//!
//! Anatomies use patient axes: +x to the patient's left, +y to the back (posterior), +z to the head (cranial);
//! millimetres. Published diameters are averages of living adults; courses are drawn to resemble textbooks, not
//! measured on a patient.

mod aorto_iliac;

use std::f64::consts::PI;

use super::{CentrelineNode, CentrelineTree, Resolution, Target};
use crate::Vec3;

/// Names of the built-in vessels, for messages.
pub const NAMES: [&str; 10] = [
    "straight_tube",
    "curved_tube",
    "aortic_arch",
    "aortic_arch_ii",
    "aortic_arch_iii",
    "hepatic",
    "sidewall_aneurysm",
    "basilar_aneurysm",
    "aorto_iliac",
    "aorto_iliac_aneurysm",
];

/// The built-in vessel of this name.
pub fn tree(name: &str) -> Option<CentrelineTree> {
    let nodes = match name {
        "straight_tube" => straight_tube(),
        "curved_tube" => curved_tube(),
        "aortic_arch" => aortic_arch(&TYPE_I),
        "aortic_arch_ii" => aortic_arch(&TYPE_II),
        "aortic_arch_iii" => aortic_arch(&TYPE_III),
        "hepatic" => hepatic(),
        "sidewall_aneurysm" => sidewall_aneurysm(),
        "basilar_aneurysm" => basilar_aneurysm(),
        "aorto_iliac" => aorto_iliac::nodes(false),
        "aorto_iliac_aneurysm" => aorto_iliac::nodes(true),
        _ => return None,
    };
    let closed = targets(name).iter().filter(|(_, name)| *name == DOME).map(|(row, _)| *row);
    let tree = CentrelineTree::new(nodes).ok()?.with_closed_ends(closed.collect()).ok()?;
    let named = targets(name).iter().map(|(row, name)| Target { name: (*name).to_owned(), row: *row });
    tree.with_targets(named.collect()).ok()
}

/// Name of the end of a sac.
const DOME: &str = "dome";

/// Named rows: ends of branches, except for the coeliac trunk, which is on the way.
fn targets(name: &str) -> &'static [(usize, &'static str)] {
    match name {
        "aortic_arch" | "aortic_arch_ii" | "aortic_arch_iii" => {
            &[(17, "ascending aorta"), (21, "innominate"), (25, "left carotid"), (29, "left subclavian")]
        }
        "hepatic" => &[
            (5, "aorta"),
            (8, "coeliac trunk"),
            (13, "splenic"),
            (19, "gastroduodenal"),
            (25, "right hepatic"),
            (28, "left hepatic"),
        ],
        "sidewall_aneurysm" => &[(5, "distal carotid"), (10, DOME)],
        "basilar_aneurysm" => &[(8, DOME), (11, "left posterior cerebral"), (14, "right posterior cerebral")],
        "aorto_iliac" | "aorto_iliac_aneurysm" => &aorto_iliac::TARGETS,
        _ => &[],
    }
}

/// A description of a built-in vessel with the sources of its dimensions, for the head of its table.
pub fn description(name: &str) -> Option<&'static str> {
    match name {
        "straight_tube" => Some(STRAIGHT_TUBE),
        "curved_tube" => Some(CURVED_TUBE),
        "aortic_arch" => Some(AORTIC_ARCH),
        "aortic_arch_ii" => Some(AORTIC_ARCH_II),
        "aortic_arch_iii" => Some(AORTIC_ARCH_III),
        "hepatic" => Some(HEPATIC),
        "sidewall_aneurysm" => Some(SIDEWALL_ANEURYSM),
        "basilar_aneurysm" => Some(BASILAR_ANEURYSM),
        "aorto_iliac" => Some(aorto_iliac::AORTO_ILIAC),
        "aorto_iliac_aneurysm" => Some(aorto_iliac::AORTO_ILIAC_ANEURYSM),
        _ => None,
    }
}

/// Resolution of the wall of a built-in vessel in `assets/vessels`: coarse enough for a repository, fine enough to
/// use.
pub fn asset_resolution(name: &str) -> Resolution {
    match name {
        "straight_tube" => Resolution::EdgeMm(1.25),
        "curved_tube" => Resolution::EdgeMm(1.2),
        "aortic_arch" | "aortic_arch_ii" => Resolution::EdgeMm(2.25),
        "aortic_arch_iii" => Resolution::EdgeMm(2.4),
        "sidewall_aneurysm" | "basilar_aneurysm" => Resolution::EdgeMm(0.5),
        "aorto_iliac" | "aorto_iliac_aneurysm" => Resolution::EdgeMm(2.2),
        _ => Resolution::EdgeMm(1.1),
    }
}

const STRAIGHT_TUBE: &str =
    "straight_tube: 100 mm along +z from the origin, inner radius 4 mm. A test piece.";

fn straight_tube() -> Vec<CentrelineNode> {
    Course::new()
        .root(Vec3::zeros(), 4.0)
        .to(Vec3::new(0.0, 0.0, 50.0), 4.0)
        .to(Vec3::new(0.0, 0.0, 100.0), 4.0)
        .nodes
}

const CURVED_TUBE: &str = "curved_tube: the plastic tube of Li et al. 2011, figure 5, of which the paper gives the extent, \
14 cm x 9 cm, and no radius.
Axis in the plane y = 0: 95 mm along +z from the origin, a semicircle of radius 45 mm towards +x, 20 mm along -z: it spans
140 mm in z and 90 mm in x. Inner radius 4 mm: an assumption.";

fn curved_tube() -> Vec<CentrelineNode> {
    const LEG: f64 = 95.0;
    const BEND: f64 = 45.0;
    const END: f64 = 20.0;
    const RADIUS: f64 = 4.0;
    // With points 2.5 mm apart the spline follows lines and arc to within a few micrometres.
    const SPACING: f64 = 2.5;
    let mut course = Course::new().root(Vec3::zeros(), RADIUS);
    let steps = |length: f64| (length / SPACING).round() as usize;
    let leg = steps(LEG);
    for k in 1..=leg {
        course = course.to(Vec3::new(0.0, 0.0, LEG * k as f64 / leg as f64), RADIUS);
    }
    let arc = steps(PI * BEND);
    for k in 1..=arc {
        let angle = PI * k as f64 / arc as f64;
        course =
            course.to(Vec3::new(BEND - BEND * libm::cos(angle), 0.0, LEG + BEND * libm::sin(angle)), RADIUS);
    }
    let end = steps(END);
    for k in 1..=end {
        course = course.to(Vec3::new(2.0 * BEND, 0.0, LEG - END * k as f64 / end as f64), RADIUS);
    }
    course.nodes
}

const AORTIC_ARCH: &str = "aortic_arch: thoracic aorta with a type I arch; the inlet is the lower end of the descending aorta.
Diameters: ascending aorta 34.6, innominate 12.5, left common carotid 8.3, left subclavian 10.4 mm (means of n = 217 adults);
arch to descending aorta 31.8 to 23.9 mm over 200 mm. Type I: all three branches leave within one carotid diameter of the top
of the arch. Course of the axis drawn. Axes: +x left, +y posterior, +z cranial; origin at the lower end.";

const AORTIC_ARCH_II: &str = "aortic_arch_ii: as aortic_arch, with a type II arch: the innominate artery leaves 1.5 diameters of the left carotid below the
top of the arch. Types by that height, less than 1, 1 to 2 and more than 2 diameters for I, II and III: Tayal et al., J. Cardiol. Curr.
Res. 6, 00191, 2016. Course of the axis drawn.";

const AORTIC_ARCH_III: &str = "aortic_arch_iii: as aortic_arch, with a type III arch: the innominate artery leaves 2.5 diameters of the left carotid below
the top of the arch. Types by that height, less than 1, 1 to 2 and more than 2 diameters for I, II and III: Tayal et al., J. Cardiol.
Curr. Res. 6, 00191, 2016. Course of the axis drawn.";

/// Diameter of the left common carotid artery, which defines the types of the arch, mm.
const LEFT_CAROTID_MM: f64 = 8.3;

/// Starts and courses of the branches of an arch that rises in the right front and descends in the left back.
struct Arch {
    /// Height above its feet, mm.
    height_mm: f64,
    /// For each point the angle about the middle of the arch, from behind left, degrees; diameter there, mm; index of
    /// the branch that starts there.
    points: [(f64, f64, Option<usize>); 8],
    /// Innominate, left carotid, left subclavian: points from the start of each, mm.
    branches: [[[f64; 3]; 4]; 3],
}

const TYPE_I: Arch = Arch {
    height_mm: 40.0,
    points: [
        (20.0, 31.2, None),
        (40.0, 31.8, None),
        (66.0, 32.2, Some(2)),
        (90.0, 32.8, Some(1)),
        (116.0, 33.4, Some(0)),
        (140.0, 34.0, None),
        (160.0, 34.4, None),
        (180.0, 34.6, None),
    ],
    branches: [
        [[-4., -2., 20.], [-9., -3., 34.], [-15., -3., 48.], [-21., -1., 62.]],
        [[1., -1., 20.], [3., -2., 38.], [5., -2., 56.], [6., 0., 76.]],
        [[4., 2., 20.], [9., 3., 36.], [17., 3., 50.], [28., 1., 60.]],
    ],
};

/// Branches start on the ascending part, closer to each other, in the direction of its slope.
const TYPE_II: Arch = Arch {
    height_mm: 46.0,
    points: [
        (20.0, 31.2, None),
        (40.0, 31.5, None),
        (62.0, 31.9, None),
        (84.0, 32.4, Some(2)),
        (109.0, 33.0, Some(1)),
        (133.2, 33.8, Some(0)),
        (157.0, 34.4, None),
        (180.0, 34.6, None),
    ],
    branches: [
        [[-8., -6., 18.], [-14., -8., 34.], [-20., -8., 48.], [-26., -6., 62.]],
        [[-2., -3., 20.], [-2., -4., 38.], [0., -4., 56.], [2., -2., 76.]],
        [[3., 2., 20.], [8., 3., 36.], [16., 3., 50.], [27., 1., 60.]],
    ],
};

const TYPE_III: Arch = Arch {
    height_mm: 52.0,
    points: [
        (20.0, 31.2, None),
        (40.0, 31.5, None),
        (60.0, 31.8, None),
        (77.0, 32.2, None),
        (96.0, 32.8, Some(2)),
        (120.0, 33.4, Some(1)),
        (143.0, 34.2, Some(0)),
        (180.0, 34.6, None),
    ],
    branches: [
        [[-12., -9., 16.], [-20., -12., 32.], [-26., -12., 48.], [-31., -10., 64.]],
        [[-4., -5., 20.], [-5., -6., 38.], [-3., -6., 56.], [-1., -4., 76.]],
        [[2., 1., 20.], [6., 2., 36.], [13., 2., 50.], [24., 0., 62.]],
    ],
};

fn aortic_arch(arch: &Arch) -> Vec<CentrelineNode> {
    // The arch rises from the heart in front and to the right, and comes down behind and to the left.
    let mut course = Course::new().root(Vec3::new(0.0, 0.0, 0.0), 23.9 / 2.0);
    for (z, diameter) in
        [(25.0, 24.8), (50.0, 25.8), (75.0, 26.8), (100.0, 27.8), (125.0, 28.8), (150.0, 29.8), (172.0, 30.7)]
    {
        course = course.to(Vec3::new(0.0, 0.0, z), diameter / 2.0);
    }
    let descending = course.nodes.len() - 1;
    // Half an ellipse from behind left to front right, of half width 33 mm.
    let half_width = 33.0;
    let across = Vec3::new(-0.62, -0.785, 0.0).normalize();
    let base = course.nodes[descending].position_mm;
    let on_arch = |degrees: f64| {
        let angle = degrees.to_radians();
        base + across * (half_width * (1.0 - libm::cos(angle)))
            + Vec3::z() * (arch.height_mm * libm::sin(angle))
    };
    let mut branch_rows = [0; 3];
    for (degrees, diameter, branch) in arch.points {
        course = course.to(on_arch(degrees), diameter / 2.0);
        if let Some(which) = branch {
            branch_rows[which] = course.nodes.len() - 1;
        }
    }
    let root = on_arch(180.0);
    course = course
        .to(root + Vec3::new(0.5, -1.0, -18.0), 34.6 / 2.0)
        .to(root + Vec3::new(2.5, -3.0, -36.0), 34.6 / 2.0);
    for (branch, diameter) in [12.5, LEFT_CAROTID_MM, 10.4].into_iter().enumerate() {
        let from = course.nodes[branch_rows[branch]].position_mm;
        course = course.at(branch_rows[branch]);
        for step in arch.branches[branch] {
            course = course.to(from + Vec3::from(step), diameter / 2.0);
        }
    }
    course.nodes
}

const HEPATIC: &str = "hepatic: abdominal aorta with coeliac trunk and the arteries to the liver; the inlet is the lower end of the aorta.
Mean diameters in mm: aorta 22.0, right hepatic 2.9, left hepatic 2.5 (Bilir et al., Int. J. Morphol., 2021, CT, n = 500);
coeliac trunk 7.8, splenic 6.1 (Malnar et al., Coll. Antropol. 34, 2010, dissection, n = 90); common hepatic 5.2, proper hepatic
4.8, gastroduodenal 4.1 (cast specimens from Bucaramanga, Rev. Col. Bras. Cir., n = 26).
Course of the axis drawn. Axes: +x left, +y posterior, +z cranial; origin on the aorta's axis 60 mm below the coeliac trunk.";

fn hepatic() -> Vec<CentrelineNode> {
    let mut course = Course::new().root(Vec3::zeros(), 11.0);
    for z in [20.0, 40.0, 60.0, 80.0, 100.0] {
        course = course.to(Vec3::new(0.0, 0.0, z), 11.0);
    }
    // Forward and a little down from the front of the aorta.
    let course = course.at(3).to(Vec3::new(-0.5, -14.0, 58.0), 3.9).to(Vec3::new(-1.0, -22.0, 57.0), 3.9);
    let course = course.to(Vec3::new(-1.0, -30.0, 57.5), 3.9);
    let fork = course.nodes.len() - 1;
    let course = course
        .at(fork)
        .to(Vec3::new(9.0, -35.0, 59.0), 3.05)
        .to(Vec3::new(22.0, -32.0, 62.0), 3.05)
        .to(Vec3::new(36.0, -24.0, 61.0), 3.05)
        .to(Vec3::new(50.0, -14.0, 64.0), 3.05)
        .to(Vec3::new(64.0, -6.0, 68.0), 3.05);
    let course = course
        .at(fork)
        .to(Vec3::new(-10.0, -36.0, 57.0), 2.6)
        .to(Vec3::new(-22.0, -39.0, 55.5), 2.6)
        .to(Vec3::new(-34.0, -40.0, 57.0), 2.6);
    let division = course.nodes.len() - 1;
    let course = course
        .at(division)
        .to(Vec3::new(-39.0, -42.0, 48.0), 2.05)
        .to(Vec3::new(-40.0, -43.0, 36.0), 2.05)
        .to(Vec3::new(-37.0, -44.0, 22.0), 2.05);
    let course = course
        .at(division)
        .to(Vec3::new(-43.0, -40.0, 62.0), 2.4)
        .to(Vec3::new(-50.0, -39.0, 70.0), 2.4)
        .to(Vec3::new(-55.0, -38.0, 80.0), 2.4);
    let liver = course.nodes.len() - 1;
    let course = course
        .at(liver)
        .to(Vec3::new(-62.0, -35.0, 89.0), 1.46)
        .to(Vec3::new(-72.0, -31.0, 96.0), 1.46)
        .to(Vec3::new(-84.0, -27.0, 101.0), 1.46);
    course
        .at(liver)
        .to(Vec3::new(-52.0, -41.0, 91.0), 1.25)
        .to(Vec3::new(-46.0, -44.0, 102.0), 1.25)
        .to(Vec3::new(-38.0, -46.0, 112.0), 1.25)
        .nodes
}

const SIDEWALL_ANEURYSM: &str = "sidewall_aneurysm: an aneurysm on the side of the internal carotid artery; the inlet is the artery's lower end.
Diameter of the artery 5.0 mm, that of the cavernous segment (Rai et al., J. NeuroIntervent. Surg. 5, 2013). Sac: dome 7 mm, neck 3.9 mm, 6.6 mm
high (endowire vessel sac): aspect ratio 1.7, of 1.91 +- 0.8 in 179 aneurysms of the anterior circulation (PMC4137168, 2014). Course drawn.
Axes: +x left, +y posterior, +z cranial; origin at the lower end.";

fn sidewall_aneurysm() -> Vec<CentrelineNode> {
    let artery = [[0.0, 0.0], [0.3, 12.0], [1.0, 24.0], [2.0, 36.0], [3.2, 48.0], [4.6, 60.0]];
    let mut course = Course::new().root(Vec3::zeros(), 2.5);
    for [x, z] in &artery[1..] {
        course = course.to(Vec3::new(*x, 0.0, *z), 2.5);
    }
    // Backwards from the artery's axis: the neck, and the sphere that begins there.
    course = course.at(3);
    for (y, radius) in [(1.5, 1.6), (2.7, 1.6), (3.48, 2.607), (4.57, 3.271), (5.81, 3.5)] {
        course = course.to(Vec3::new(2.0, y, 36.0), radius);
    }
    course.nodes
}

const BASILAR_ANEURYSM: &str = "basilar_aneurysm: an aneurysm at the tip of the basilar artery; the inlet is the artery's lower end.
Diameters: basilar artery 3.6 to 3.1 mm over 27.3 mm, posterior cerebral arteries 2.2 mm (means of 100 adults, J. NeuroIntervent. Surg. 5, 597, 2013).
Sac: dome 8 mm, neck 3.7 mm, 8.2 mm high (endowire vessel sac): aspect ratio 2.2, of 2.75 +- 1.8 in 75 aneurysms of the posterior circulation
(PMC4137168, 2014).
Course drawn. Axes: +x left, +y posterior, +z cranial; origin at the lower end.";

fn basilar_aneurysm() -> Vec<CentrelineNode> {
    let mut course = Course::new().root(Vec3::zeros(), 1.8);
    for (z, radius) in [(9.0, 1.72), (18.0, 1.63), (27.3, 1.55)] {
        course = course.to(Vec3::new(0.0, 0.0, z), radius);
    }
    for (z, radius) in [(28.6, 1.775), (29.6, 2.0), (30.47, 3.041), (31.68, 3.752), (33.06, 4.0)] {
        course = course.to(Vec3::new(0.0, 0.0, z), radius);
    }
    for side in [1.0, -1.0] {
        course = course.at(3);
        for [x, y, z] in [[6.0, 0.0, 27.5], [13.0, -1.0, 29.0], [20.0, -3.0, 29.0]] {
            course = course.to(Vec3::new(side * x, y, z), 1.1);
        }
    }
    course.nodes
}

/// A pen for drawing a tree point by point.
struct Course {
    nodes: Vec<CentrelineNode>,
    at: usize,
}

impl Course {
    fn new() -> Self {
        Self { nodes: Vec::new(), at: 0 }
    }

    fn root(mut self, position_mm: Vec3, radius_mm: f64) -> Self {
        self.nodes.push(CentrelineNode { position_mm, radius_mm, parent: None });
        self
    }

    /// Continues from `row`.
    fn at(mut self, row: usize) -> Self {
        self.at = row;
        self
    }

    fn to(mut self, position_mm: Vec3, radius_mm: f64) -> Self {
        self.nodes.push(CentrelineNode { position_mm, radius_mm, parent: Some(self.at) });
        self.at = self.nodes.len() - 1;
        self
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::vessel::{GeneratedWall, SurfaceMesh, check};

    fn asset(name: &str) -> PathBuf {
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels").join(name)
    }

    #[test]
    fn every_built_in_vessel_has_a_tree_a_description_and_a_sound_wall_of_moderate_size() {
        for name in NAMES {
            let tree = tree(name).unwrap_or_else(|| panic!("{name}"));
            assert!(description(name).unwrap().starts_with(name));
            let made = GeneratedWall::new(&tree, asset_resolution(name)).unwrap();
            let report = check(made.wall.mesh()).unwrap();
            assert!(report.is_sound() && report.components == 1, "{name}: {report:?}");
            let most = if name == "straight_tube" { 4_000 } else { 20_000 };
            assert!(report.triangles <= most, "{name}: {}", report.triangles);
            let inlet = &made.wall.openings()[made.inlet];
            assert!(inlet.centre_mm.norm() < 0.01, "{name}: the root is the origin");
            // The inlet for devices, not that for blood: the widest opening of an arch is its other end.
            // Of a groin that cannot be seen: the aorta's end is wider.
            if !name.starts_with("aorto_iliac") {
                assert_eq!(made.wall.inlet().map(|opening| opening.index), Some(made.inlet), "{name}");
            }
            assert!(made.inlet != 0 || !name.starts_with("aortic_arch"), "{name}");
            assert_stored(name, &tree, made.wall.mesh());
        }
        assert!(super::tree("aorta").is_none());
    }

    /// The files in `assets/` are the output of this code; the example `make_assets` updates them.
    fn assert_stored(name: &str, tree: &CentrelineTree, mesh: &SurfaceMesh) {
        if !asset("straight_tube.csv").exists() {
            // A packaged crate does not contain the repository's assets.
            return;
        }
        assert_eq!(&CentrelineTree::read(&asset(&format!("{name}.csv"))).unwrap(), tree);
        let stored = SurfaceMesh::read(&asset(&format!("{name}.stl")), 1.0).unwrap();
        let largest_difference = |shift: f64| {
            let same = |i: usize| {
                stored
                    .corners(i)
                    .into_iter()
                    .zip(mesh.corners(i))
                    .map(|(a, b)| (a.add_scalar(shift) - b).amax())
            };
            (0..mesh.triangles.len()).flat_map(same).fold(0.0, f64::max)
        };
        assert_eq!(stored.triangles.len(), mesh.triangles.len(), "{name}");
        assert!(largest_difference(0.0) < 1e-4, "{name}: {}", largest_difference(0.0));
        assert!(largest_difference(2e-4) > 1e-4, "the comparison can fail");
    }

    #[test]
    fn arches_are_of_the_types_that_they_are_called() {
        for (name, type_range) in
            [("aortic_arch", 0.0..1.0), ("aortic_arch_ii", 1.0..2.0), ("aortic_arch_iii", 2.0..4.0)]
        {
            let tree = tree(name).unwrap();
            let top_mm = tree.nodes()[..16].iter().map(|node| node.position_mm.z).fold(0.0, f64::max);
            let first = |name: &str| tree.target(name).unwrap().row - 3;
            let origin = tree.nodes()[tree.nodes()[first("innominate")].parent.unwrap()].position_mm;
            let drop = (top_mm - origin.z) / LEFT_CAROTID_MM;
            assert!(type_range.contains(&drop), "{name}: {drop}");
        }
    }

    #[test]
    fn the_curved_tube_spans_the_extent_of_the_figure() {
        let tree = tree("curved_tube").unwrap();
        let (mut low, mut high) = (Vec3::zeros(), Vec3::zeros());
        for node in tree.nodes() {
            (low, high) = (low.inf(&node.position_mm), high.sup(&node.position_mm));
        }
        assert!((high - low - Vec3::new(90.0, 0.0, 140.0)).norm() < 0.02, "{}", high - low);
    }
}

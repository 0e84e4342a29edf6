//! Forces of coils that are pushed into a sac: in which order coils and places of the catheter's tip stand.

use endowire_core::Result;

use super::{Compared, Kind, Line, Study};
use crate::Row;
use crate::bench::coil::{CoilKind, CoilTest, Loops};

/// The study in words.
pub const STUDY: Study = Study {
    name: "coil-forces",
    title: "Forces of coils that are pushed into a sac",
    question: "Which coils, and which places of the catheter's tip, need most force of the hand and press most on the wall of a sac?",
    data: "Orders, not numbers. Lamano, Bushnell, Chen et al., Neurosurgery 2014;75:707–716 (PMC4237704), measured the force of the hand and that on the \
           dome of a 3 mm sac: framing > filling > finishing coils, and a catheter's tip in the top > middle > bottom third. Matsubara, Miyachi, Nagano et \
           al., Neuroradiology 2010 (doi 10.1007/s00234-010-0722-5), measured the largest force of the hand in a silicone sac: soft coils need less than \
           standard helical and 3D ones, and the diameter of the loops barely matters.",
    computed: "A sac of 60 mm³, nearly a ball of 5 mm, on the side-wall aneurysm of the catalogue; coils of 25 mm pushed out of a catheter whose tip lies \
               0.17, 0.5 or 0.8 of the sac's height above its neck, in steps of 0.5 mm, with friction 0.3 on the wall and 0.2 between loops: the largest \
               force of the hand and the largest force on the sac's wall, and of these the means over heights or over coils, since the paper's orders are \
               those of its factors. Soft, standard and 3D coils of one size differ in the wire and in the shape of the loops alone, and are pushed from the \
               middle height.",
    not_shown: "Numbers: the coils, the sac and the wall are not those of the papers, and no force is compared with a measured one. That the middle needs more \
                than the bottom is not robust: with friction 0.1 the hand needs as much at the bottom, and in a sac of 3 mm the two change places with the \
                step. Friction in the catheter, which is part of every measured force of the hand, is left out. So is speed: Lamano et al. found the \
                largest force on the wall at the slowest push, and every step here is an equilibrium. Whether a sac ruptures.",
};

/// Heights of the catheter's tip over that of the sac: the middles of its thirds, the highest one as high as it may be.
const HEIGHTS: [(&str, f64); 3] = [("bottom", 0.17), ("middle", 0.5), ("top", 0.8)];
/// Coils of Lamano et al., by what they are for, largest force first.
const PURPOSES: [(&str, CoilKind); 3] =
    [("framing", CoilKind::FRAMING), ("filling", CoilKind::FILLING), ("finishing", CoilKind::FINISHING)];
/// Coils of Matsubara et al.: of one size, with the softest and the standard wire of the catalogue.
const STANDARD: CoilKind =
    CoilKind { outer_diameter_mm: 0.254, wire_diameter_mm: 0.0508, loops_to_sac: 0.9, loops: Loops::Helix };
const SOFT: CoilKind = CoilKind { wire_diameter_mm: 0.03175, ..STANDARD };
const THREE_D: CoilKind = CoilKind { loops: Loops::Complex, ..STANDARD };
/// The standard coil with loops smaller by a quarter.
const SMALL_LOOPS: CoilKind = CoilKind { loops_to_sac: 0.675, ..STANDARD };

/// The sac, and what is pushed into it.
const TEST: CoilTest = CoilTest {
    volume_mm3: 60.0,
    length_mm: 25.0,
    step_mm: 0.5,
    element_mm: 0.75,
    // Platinum on silicone or latex, which are what the papers' sacs are made of, grips more than on a vessel.
    friction: 0.3,
    self_friction: 0.2,
    tip_height: None,
};

/// Largest forces while a coil is pushed out, N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forces {
    /// Force of the hand.
    pub hand_n: f64,
    /// Force on the wall of the sac.
    pub wall_n: f64,
}

/// Deploys a coil until its end is at the catheter's tip: its stiffer pusher stays inside.
fn deploy(kind: CoilKind, tip_height: f64) -> Result<Forces> {
    let test = CoilTest { tip_height: Some(tip_height), ..TEST };
    let mut forces = Forces { hand_n: f64::MIN, wall_n: 0.0 };
    test.begin(&[("coil".to_owned(), kind)])?.push(0, test.length_mm, &mut |reading| {
        forces.hand_n = forces.hand_n.max(reading.push_force_n);
        forces.wall_n = forces.wall_n.max(reading.packing.dome_force_n);
    })?;
    Ok(forces)
}

/// Computes the forces of several deployments, each by its index.
pub type Parallel<'a> = dyn Fn(usize, &(dyn Fn(usize) -> Result<Forces> + Sync)) -> Vec<Result<Forces>> + 'a;

/// A row that passes if forces fall from one to the next.
fn ordered(of: &str, named: &[(&str, f64)]) -> Row {
    let holds = named.windows(2).all(|pair| pair[0].1 > pair[1].1);
    let words: Vec<String> = named.iter().map(|(name, n)| format!("{name} {:.3}", 1e3 * n)).collect();
    let computed = f64::from(u8::from(holds));
    let name = format!("{of}: {} mN", words.join(" > "));
    Row::with_error(&name, "in this order (1) or not (0)", computed, 1.0, 1.0 - computed, 0.0)
}

fn mean(of: impl Iterator<Item = f64> + Clone) -> f64 {
    of.clone().sum::<f64>() / of.count() as f64
}

/// Forces of the coils of [`PURPOSES`] at the [`HEIGHTS`]: orders of their means, and curves.
fn factors(part: &str, forces_n: [[f64; 3]; 3]) -> ([Row; 3], [Line; 3]) {
    let by_coil = [0, 1, 2].map(|coil| (PURPOSES[coil].0, mean(forces_n[coil].iter().copied())));
    let by_height =
        [2, 1, 0].map(|height| (HEIGHTS[height].0, mean(forces_n.iter().map(|coil| coil[height]))));
    let lines = [0, 1, 2].map(|coil| Line {
        name: format!("{}, {part}", PURPOSES[coil].0),
        kind: Kind::Computed,
        // Where the hand holds the coil back throughout, no force is there to be drawn.
        points: (0..3)
            .map(|height| [HEIGHTS[height].1, 1e3 * forces_n[coil][height]])
            .filter(|[_, mn]| *mn > 0.0)
            .collect(),
    });
    // One by one: that the top needs most is robust, and the rest is less so.
    ([ordered(part, &by_coil), ordered(part, &by_height[..2]), ordered(part, &by_height[1..])], lines)
}

/// Deploys all coils, and compares their orders with the measured ones.
///
/// # Errors
/// A step that could not be carried out.
pub fn study(parallel: &Parallel<'_>) -> Result<Compared> {
    let (_, middle) = HEIGHTS[1];
    let lamano = PURPOSES.iter().flat_map(|(_, kind)| HEIGHTS.map(|(_, height)| (*kind, height)));
    let matsubara = [THREE_D, STANDARD, SOFT, SMALL_LOOPS].map(|kind| (kind, middle));
    let runs: Vec<(CoilKind, f64)> = lamano.chain(matsubara).collect();
    let found = parallel(runs.len(), &|index| deploy(runs[index].0, runs[index].1));
    let forces = found.into_iter().collect::<Result<Vec<_>>>()?;
    let grid = |of: fn(&Forces) -> f64| [0, 1, 2].map(|coil| [0, 1, 2].map(|k| of(&forces[3 * coil + k])));
    let (hand, hand_lines) = factors("force of the hand", grid(|f| f.hand_n));
    let (wall, wall_lines) = factors("force on the wall", grid(|f| f.wall_n));
    let [three_d, standard, soft, small] = [9, 10, 11, 12].map(|k| forces[k].hand_n);
    let of = "force of the hand";
    let changes = [
        ("a soft wire changes it by", (standard - soft).abs()),
        ("smaller loops by", (standard - small).abs()),
    ];
    let compared = [
        ordered(of, &[("standard", standard), ("soft", soft)]),
        ordered(of, &[("3D", three_d), ("soft", soft)]),
        ordered(of, &changes),
    ];
    Ok(Compared {
        rows: hand.into_iter().chain(wall).chain(compared).collect(),
        lines: hand_lines.into_iter().chain(wall_lines).collect(),
        axes: ["height of the catheter's tip over that of the sac", "largest force, mN"],
        is_logarithmic: true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_that_is_turned_round_is_seen() {
        assert!(ordered("", &[("a", 3.0), ("b", 2.0), ("c", 1.0)]).pass);
        assert!(!ordered("", &[("a", 3.0), ("b", 1.0), ("c", 2.0)]).pass);
        assert!(!ordered("", &[("a", 1.0), ("b", 1.0)]).pass);
    }

    #[test]
    fn a_framing_coil_needs_more_than_a_finishing_one_and_more_near_the_dome() {
        let [low, high] =
            [HEIGHTS[1].1, HEIGHTS[2].1].map(|height| deploy(CoilKind::FRAMING, height).unwrap());
        let soft = deploy(CoilKind::FINISHING, HEIGHTS[2].1).unwrap();
        assert!(high.hand_n > low.hand_n && high.wall_n > low.wall_n, "{low:?} {high:?}");
        assert!(high.hand_n > soft.hand_n && high.wall_n > soft.wall_n, "{soft:?} {high:?}");
    }
}

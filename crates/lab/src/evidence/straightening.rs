//! Stiff wires in a winding iliac artery: how straight it becomes.

use endowire_core::insertion::Step;
use endowire_core::vessel::{NoStore, Straightening};
use endowire_core::{Error, Result};
use endowire_methods::Scene;

use super::{Compared, Kind, Line, Study};
use crate::Row;

/// The study in words.
pub const STUDY: Study = Study {
    name: "straightening",
    title: "Stiff wires straighten an iliac artery",
    question: "How straight does a winding iliac artery become with wires of different stiffness in it?",
    data: "Means of populations: tortuosity (length over distance) 1.16 ± 0.14 in healthy iliac arteries and 1.36 ± 0.21 with an aneurysm, 1.15 with \
           a stiff wire; in 17 patients under stiff wires the length that is to be treated became 179 → 170 mm, 5 % shorter, and the angle 86° → 114° \
           (J. Vasc. Surg. 2017). Single patients with their vessels, wires and positions are not public.",
    computed: "The drawn anatomy `aorto_iliac`, tortuosity 1.35, with the presets `iliac` and `aorta` as they are; wires of the catalogue are pushed up \
               by 330 mm without friction. Tortuosity and length of the centre line from the groin to where the aorta divides; \
               compared is the stiffest wire, which carries stent grafts.",
    not_shown: "Any patient. The vessel is drawn, its stiffness and that of the tissue around it are choices within published values that differ by \
                factors of two, and none was fitted. Where in the artery it bends, muscle, calcification and the vessel's tension are not compared.",
};

/// The scene, in `assets/scenes`.
pub const SCENE: &str = "aorto_iliac_stiff";
/// What is set in it beside the wire.
pub const SET: [&str; 2] = ["vessel.wall.friction=0.0", "script[0].step_mm=10.0"];
/// Wires of the catalogue, the softest first.
pub const WIRES: [&str; 4] =
    ["wire_035_standard", "wire_035_stiff", "wire_035_amplatz_super_stiff", "wire_035_lunderquist"];
/// The one that carries stent grafts, which alone is compared.
const STIFFEST: &str = WIRES[3];
/// Mean tortuosity of patients without a wire and with a stiff one.
const WITHOUT: f64 = 1.36;
const WITH: f64 = 1.15;
/// Half of the difference, relative: what is off by more is nearer to an artery without a wire.
const BOUND: f64 = 0.5 * (WITHOUT - WITH) / WITH;
/// Where the stretch ends that is measured.
const END: &str = "aortic bifurcation";

/// Carries out the scenes, given with the names of their wires.
///
/// # Errors
/// A scene whose vessel does not yield or has no place named `aortic bifurcation`, and a step that could not be carried out.
pub fn study(wires: &[(String, Scene)]) -> Result<Compared> {
    let (mut rows, mut points) = (Vec::new(), Vec::new());
    for (name, scene) in wires {
        let stack = scene.stack()?;
        let mut simulation = scene.simulation(&NoStore)?;
        let script = scene.steps(&stack, &NoStore)?;
        let mut run = script.begin();
        while let Some(step) = run.next(&simulation)?.map(Step::into_owned) {
            step.carry_out(&mut simulation)?;
            run.carried_out();
        }
        let displacement = simulation.displacement();
        let measured = Straightening::of(scene.centreline(&NoStore)?, displacement.as_ref());
        let stretch = measured.stretches.into_iter().find(|stretch| stretch.to == END);
        let stretch = stretch
            .ok_or_else(|| Error::parameter("targets", END, "the centre line has no place of this name"))?;
        let shorter = 100.0 * (stretch.length_mm.after / stretch.length_mm.before - 1.0);
        let tortuosity = stretch.tortuosity;
        let body_nmm2 = simulation.device().sections().last().map_or(0.0, |body| body.bending_stiffness_nmm2);
        points.push([body_nmm2, tortuosity.after]);
        if name == STIFFEST {
            let named = format!("{name}: {:.3} before, length {shorter:+.1} %", tortuosity.before);
            rows.push(Row::relative(&named, "tortuosity", tortuosity.after, WITH, BOUND));
        }
    }
    let at = |tortuosity: f64| points.iter().map(|[body_nmm2, _]| [*body_nmm2, tortuosity]).collect();
    let lines = vec![
        Line {
            name: "patients with an aneurysm, without a wire".to_owned(),
            kind: Kind::Law,
            points: at(WITHOUT),
        },
        Line { name: "patients with a stiff wire".to_owned(), kind: Kind::Law, points: at(WITH) },
        Line { name: "computed".to_owned(), kind: Kind::Computed, points },
    ];
    let axes = ["bending stiffness of the wire's body, N·mm²", "tortuosity from the groin to the aorta"];
    Ok(Compared { rows, lines, axes, is_logarithmic: false })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use endowire_methods::{Setting, scene_with};

    use super::*;

    #[test]
    fn an_artery_is_straightened_and_one_in_firm_tissue_is_not() {
        let file = format!("../../assets/scenes/{SCENE}.toml");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let studied = |other: &[&str]| {
            let set: Vec<Setting> =
                SET.iter().chain(other).map(|set| set.parse()).collect::<Result<_>>().unwrap();
            let scene = scene_with(&path, &set, |_| Ok(())).unwrap();
            study(&[(STIFFEST.to_owned(), scene)]).unwrap()
        };
        let as_it_is = studied(&[]);
        assert!(as_it_is.rows[0].pass && as_it_is.rows.len() == 1, "{:?}", as_it_is.rows);
        assert!(!studied(&["vessel.yielding.tissue_n_per_mm3=1.0"]).rows[0].pass);
    }
}

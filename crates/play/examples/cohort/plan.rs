//! What hands do to solve a subject: the motions of its reference script, without its times.

use std::path::Path;

use endowire_assess::{Exam, Site, Subject, thinnest_mm};
use endowire_core::insertion::Script;
use endowire_core::vessel::NoStore;
use endowire_methods::{Scene, Setting, scene_with};
use endowire_play::{Input, Limits, Session, TICK_SOLVES, lumens};
use endowire_viewer::{Mode, ViewSpec};

/// Motions below these are none, mm and rad.
const REST: f64 = 1e-9;

/// Something that hands do.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Act {
    /// Instruments move together: index, advance, mm, and rotation, degrees.
    Move(Vec<(usize, f64, f64)>),
    /// Medium is injected, ml and ml/s, and flows.
    Inject(f64, f64),
    /// Hands rest, s.
    Rest(f64),
}

/// A subject at its start.
pub(crate) struct Place {
    subject: Subject,
    scene: Scene,
    script: Script,
}

impl Place {
    /// The subject of a file.
    pub(crate) fn of(path: &Path) -> Self {
        let subject = Subject::read(path).unwrap();
        let settings = subject.set.iter().map(|text| text.parse::<Setting>().unwrap());
        let settings: Vec<Setting> = settings.collect();
        let scene_path = subject.resolve(&subject.scene);
        let mut scene = scene_with(&scene_path, &settings, |_| Ok(())).unwrap();
        if let Some(reference) = &subject.reference {
            scene.take_script(&subject.resolve(reference)).unwrap();
        }
        let simulation = scene.simulation(&NoStore).unwrap();
        let script = scene.steps(simulation.stack(), &NoStore).unwrap();
        Self { subject, scene, script }
    }

    /// The instruments' names.
    pub(crate) fn instruments(&self) -> Vec<String> {
        self.scene.stack().unwrap().instruments().iter().map(|one| one.name.clone()).collect()
    }

    /// A session of it, as a window has it.
    pub(crate) fn begun(&self) -> Session {
        let path = self.subject.resolve(&self.subject.scene);
        let mut view = ViewSpec::of_scene(&self.scene, &path).unwrap();
        let simulation = self.scene.simulation(&NoStore).unwrap();
        let stack = simulation.stack().clone();
        if let Some(tree) = view.flow.tree.take() {
            let tree = endowire_core::vessel::CentrelineTree::read(&tree).unwrap();
            view.flow.centreline = Some(std::sync::Arc::new(tree));
        }
        let names = self.instruments();
        let tree = self.subject.goal.target().map(|_| self.scene.centreline(&NoStore).unwrap());
        let site = Site {
            tree,
            instruments: &names,
            radius_mm: Some(thinnest_mm(&stack)),
            has_sac: self.scene.vessel.sac.is_some(),
            all_solid: !lumens(&stack, &view).contains(&true),
        };
        let exam = Exam::new(self.subject.clone(), &site).unwrap();
        let sac = self.scene.sac(simulation.lumen(), &NoStore).unwrap();
        let session = Session::new(simulation, view, 64, Limits::default()).unwrap();
        session.with_ticks(TICK_SOLVES).unwrap().with_sac(sac).with_exam(exam)
    }

    /// The motions of the reference script, each as long as it goes on alike.
    pub(crate) fn plan(&self) -> Vec<Act> {
        let mut session = self.begun().with_script(self.script.clone());
        session.apply(&Input::Pedal { down: true, mode: Some(Mode::Fluoro) }).unwrap();
        session.apply(&Input::Script {}).unwrap();
        while session.demonstrates() {
            session.tick();
        }
        let record = session.record();
        let mut plan: Vec<Act> = vec![];
        let mut injections = record.injections.iter().peekable();
        let mut before_s = 0.0;
        for sample in &record.samples {
            while let Some(one) = injections.next_if(|one| one.time_s <= before_s + REST) {
                plan.push(Act::Inject(one.volume_ml, one.rate_ml_per_s));
            }
            before_s = sample.time_s;
            let hands = sample.hands.iter().enumerate();
            let moved = hands.map(|(index, hand)| (index, hand.advance_mm, hand.rotate_rad.to_degrees()));
            let moved: Vec<_> = moved.filter(|(_, mm, deg)| mm.abs() > REST || deg.abs() > REST).collect();
            if moved.is_empty() {
                continue;
            }
            match plan.last_mut() {
                Some(Act::Move(last)) if alike(last, &moved) => {
                    for (sum, one) in last.iter_mut().zip(&moved) {
                        (sum.1, sum.2) = (sum.1 + one.1, sum.2 + one.2);
                    }
                }
                _ => plan.push(Act::Move(moved)),
            }
        }
        plan.extend(injections.map(|one| Act::Inject(one.volume_ml, one.rate_ml_per_s)));
        plan
    }
}

/// Whether the same hands move in the same directions.
fn alike(a: &[(usize, f64, f64)], b: &[(usize, f64, f64)]) -> bool {
    let sign = |x: f64| if x.abs() <= REST { 0.0 } else { x.signum() };
    let of = |one: &(usize, f64, f64)| (one.0, sign(one.1), sign(one.2));
    a.iter().map(of).eq(b.iter().map(of))
}

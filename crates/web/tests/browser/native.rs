//! The same sessions as the program has them.

use std::path::{Path, PathBuf};

use endowire_assess::{Exam, Record, Site, Subject};
use endowire_core::insertion::Simulation;
use endowire_core::vessel::NoStore;
use endowire_methods::{Scene, Setting, scene_with};
use endowire_play::{Input, Limits, Pictures, Session, TICK_SOLVES};
use endowire_viewer::{Backend, Image, ViewSpec};
use serde_json::{Value, json};

/// A scene of `assets`.
pub(crate) fn scene(name: &str) -> (PathBuf, Scene) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/scenes").join(name);
    let scene = Scene::read(&path).unwrap();
    (path, scene)
}

/// A session of it with pictures of so many pixels a side.
pub(crate) fn session(name: &str, side_px: u32) -> (Session, Pictures) {
    let (path, scene) = scene(name);
    let mut view = ViewSpec::of_scene(&scene, &path).unwrap();
    view.backend = Backend::Cpu;
    let simulation = scene.simulation(&NoStore).unwrap();
    let wall = simulation.lumen().wall(&NoStore).unwrap().clone();
    let session = Session::new(simulation, view, side_px, Limits::default()).unwrap();
    let session = session.with_ticks(TICK_SOLVES).unwrap();
    let pictures = Pictures::new(&scene, &session.snapshot(), wall).unwrap();
    (session, pictures)
}

/// A training subject of `assets` in its scene, with the session of it that its reference is shown in.
pub(crate) fn subject(name: &str, side_px: u32) -> (Exam, Session) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/subjects").join(name);
    let subject = Subject::read(&path).unwrap();
    let settings: Vec<Setting> = subject.set.iter().map(|text| text.parse().unwrap()).collect();
    let scene_path = subject.resolve(&subject.scene);
    let mut scene = scene_with(&scene_path, &settings, |_| Ok(())).unwrap();
    if let Some(reference) = &subject.reference {
        scene.take_script(&subject.resolve(reference)).unwrap();
    }
    let view = ViewSpec::of_scene(&scene, &scene_path).unwrap();
    let simulation = scene.simulation(&NoStore).unwrap();
    let script = scene.steps(simulation.stack(), &NoStore).unwrap();
    let tree = Some(scene.centreline(&NoStore).unwrap());
    let exam = Exam::new(subject, &Site { tree, ..Site::default() }).unwrap();
    let session = Session::new(simulation, view, side_px, Limits::default()).unwrap();
    let session = session.with_ticks(TICK_SOLVES).unwrap();
    (exam.clone(), session.with_script(script).with_exam(exam))
}

/// What `endowire assess FILE --subject` makes of the text of a session's file.
pub(crate) fn assessed(exam: Exam, text: &str) -> Value {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    serde_json::to_value(&*exam.score(&Record::read(file.path()).unwrap())).unwrap()
}

/// Bits of the nodes' coordinates.
pub(crate) fn bits(simulation: &Simulation) -> Vec<u64> {
    let nodes = &simulation.shape().positions_mm;
    nodes.iter().flat_map(|at| [at.x, at.y, at.z]).map(f64::to_bits).collect()
}

/// What `endowire run` makes of a scene with another script.
pub(crate) fn run(name: &str, script: &str) -> Simulation {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), script).unwrap();
    let (_, mut scene) = scene(name);
    scene.take_script(file.path()).unwrap();
    let mut simulation = scene.simulation(&NoStore).unwrap();
    let script = scene.steps(simulation.stack(), &NoStore).unwrap();
    let mut run = script.into_run();
    while let Some(step) = run.next(&simulation).unwrap() {
        step.into_owned().carry_out(&mut simulation).unwrap();
        run.carried_out();
    }
    simulation
}

/// Red, green and blue of each pixel.
pub(crate) fn rgb(image: &Image) -> Vec<u8> {
    let bytes = image.format().bytes();
    image.data().chunks_exact(bytes).flat_map(|pixel| (0..3).map(move |k| pixel[k.min(bytes - 1)])).collect()
}

/// Numbers that look random, the same every time.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len() as u64) as usize]
    }

    /// An input of a hand on the only instrument, or one of the room.
    pub(crate) fn input(&mut self) -> Input {
        let speed = self.one(&[-40.0, 5.0, 10.0, 20.0, 40.0]);
        let turn = self.one(&[-90.0, 0.0, 0.0, 36.0, 360.0]);
        match self.below(12) {
            0..=5 => Input::Move { instrument: None, mm_per_s: speed, deg_per_s: turn },
            6 => Input::Nudge { instrument: None, mm: speed / 20.0, deg: turn },
            7 => Input::Stop {},
            8 => Input::Undo {},
            9 => Input::Redo {},
            10 => Input::TurnCArm { lao_deg: speed, cra_deg: turn / 36.0 },
            _ => Input::Inject { ml: 5.0, ml_per_s: 5.0 },
        }
    }

    /// A key of sessions, pressed or let go.
    pub(crate) fn key(&mut self) -> (&'static str, bool) {
        const KEYS: [&str; 30] = [
            "ArrowUp",
            "ArrowUp",
            "ArrowUp",
            "ArrowDown",
            "ArrowLeft",
            "ArrowRight",
            "Space",
            "KeyC",
            "KeyV",
            "KeyB",
            "Enter",
            "KeyJ",
            "KeyL",
            "KeyO",
            "KeyK",
            "Equal",
            "Minus",
            "KeyQ",
            "KeyE",
            "KeyI",
            "KeyP",
            "KeyD",
            "Backspace",
            "Digit1",
            "Digit2",
            "Tab",
            "KeyW",
            "KeyA",
            "KeyS",
            "KeyX",
        ];
        (self.one(&KEYS), self.below(2) == 0)
    }

    /// Anything, valid or not, as a page could send it.
    pub(crate) fn wild(&mut self) -> Value {
        let number = self.one(&[0.0, -1.0, 0.2, 7.5, 400.0, -1e308, 1e-308]);
        let second = self.one(&[0.5, -30.0, 1e9, 0.0]);
        match self.below(16) {
            0 => json!({ "do": "select", "instrument": "nobody" }),
            1 => json!({ "do": "zoom", "factor": number }),
            2 => json!({ "do": "collimate", "width": second, "height": number }),
            3 => json!({ "do": "table", "right_mm": number, "down_mm": second }),
            4 => json!({ "do": "turn_camera", "azimuth_deg": number, "elevation_deg": second }),
            5 => json!({ "do": "go_to", "step": self.below(400) }),
            6 => {
                json!({ "do": "pedal", "down": number > 0.0, "mode": self.one(&["fluoro", "cine", "dsa", "roadmap"]) })
            }
            7 => json!({ "do": "move", "mm_per_s": number, "deg_per_s": second }),
            8 => json!({ "do": "script" }),
            9 => json!({ "do": "c_arm", "pose": self.one(&["LAO 40 CRA 10", "AP", "sideways"]) }),
            10 => json!({ "do": "something", "else": [number] }),
            11 => json!(null),
            _ => serde_json::to_value(self.input()).unwrap(),
        }
    }
}

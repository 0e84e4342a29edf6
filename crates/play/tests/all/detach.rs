//! Coils that a hand leaves behind: recorded, taken back, done again and shown as a script with the same bits.

use endowire_core::insertion::Simulation;
use endowire_core::vessel::NoStore;
use endowire_methods::Scene;
use endowire_play::{EventKind, Input, Limits, Pictures, Session};
use endowire_viewer::ViewSpec;

/// Two coils of 10 mm in a catheter that stands in a tube.
const SCENE: &str = r#"
name = "coils"

[vessel]
tree = "tube.csv"

[[instrument]]
name = "first"
file = "coil.toml"

[[instrument]]
name = "second"
file = "coil.toml"

[[instrument]]
name = "catheter"
file = "catheter.toml"
inserted_mm = 5.0

[sheath]
opening = 0
depth_mm = 2.0

[method]
name = "kirchhoff"
element_mm = 1.5
self_contact = true
"#;
const TUBE: &str = "x_mm,y_mm,z_mm,radius_mm,parent\n0,0,0,4,-1\n0,0,60,4,0\n";
const COIL: &str = r#"
name = "coil"
kind = "coil"

[[part]]
name = "coil"
length_mm = 10.0
outer_diameter_mm = 0.3
winding = { wire_diameter_mm = 0.05, modulus_gpa = 170.0, poisson_ratio = 0.38 }
material = "platinum"

[[part]]
name = "pusher"
length_mm = 300.0
outer_diameter_mm = 0.3
bending_stiffness_nmm2 = 0.5
material = "steel_316l"
"#;
const CATHETER: &str = r#"
name = "catheter"
kind = "microcatheter"

[[part]]
name = "shaft"
length_mm = 100.0
outer_diameter_mm = 0.8
inner_diameter_mm = 0.5
bending_stiffness_nmm2 = 2.0
material = "pebax_baso4_40"
"#;

struct Room {
    folder: tempfile::TempDir,
}

impl Room {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in
            [("scene.toml", SCENE), ("tube.csv", TUBE), ("coil.toml", COIL), ("catheter.toml", CATHETER)]
        {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        Self { folder }
    }

    fn scene(&self) -> Scene {
        Scene::read(&self.folder.path().join("scene.toml")).unwrap()
    }

    /// The scene with that script, and a session of it.
    fn session(&self, script: &str) -> (Scene, Session) {
        let mut scene = self.scene();
        if !script.is_empty() {
            let file = self.folder.path().join("script.toml");
            std::fs::write(&file, script).unwrap();
            scene.take_script(&file).unwrap();
        }
        let view = ViewSpec::of_scene(&scene, &self.folder.path().join("scene.toml")).unwrap();
        let simulation = scene.simulation(&NoStore).unwrap();
        let script = scene.steps(simulation.stack(), &NoStore).unwrap();
        let session = Session::new(simulation, view, 64, Limits::default()).unwrap().with_script(script);
        (scene, session)
    }

    /// What a script comes to that is carried out by itself.
    fn run(&self, script: &str) -> Simulation {
        let (scene, session) = self.session(script);
        let mut simulation = session.simulation().clone();
        let script = scene.steps(simulation.stack(), &NoStore).unwrap();
        let mut run = script.begin();
        while let Some(step) = run.next(&simulation).unwrap() {
            step.into_owned().carry_out(&mut simulation).unwrap();
            run.carried_out();
        }
        simulation
    }
}

fn push(session: &mut Session, instrument: &str, mm: f64) {
    session.apply(&Input::Nudge { instrument: Some(instrument.to_owned()), mm, deg: 0.0 }).unwrap();
    (0..60).for_each(|_| session.tick());
}

#[test]
fn a_script_that_detaches_is_refused_where_loops_do_not_touch() {
    let room = Room::new();
    let script =
        "[[script]]\ninstrument = \"first\"\nadvance_mm = 16.0\n\n[[script]]\ninstrument = \"first\"\n";
    let checked = |method: &str, script: &str| {
        let file = room.folder.path().join("scene.toml");
        std::fs::write(&file, format!("{}\n{script}", SCENE.replace("self_contact = true", method))).unwrap();
        let scene = Scene::read(&file).unwrap();
        scene.steps(&scene.stack().unwrap(), &NoStore).map(drop).map_err(|error| error.to_string())
    };
    let detaches = format!("{script}detach = true\n");
    assert_eq!(checked("self_contact = true", &detaches), Ok(()));
    assert_eq!(checked("", &format!("{script}withdraw = true\n")), Ok(()));
    let error = checked("", &detaches).unwrap_err();
    assert!(
        error.starts_with("method.self_contact = false: ") && error.ends_with("script[1].detach"),
        "{error}"
    );
}

fn detach(session: &mut Session, instrument: &str) -> endowire_core::Result<()> {
    session.apply(&Input::Detach { instrument: Some(instrument.to_owned()) })
}

fn last(session: &Session) -> (EventKind, String) {
    let event = session.events().last().unwrap();
    (event.kind, event.text.clone())
}

#[test]
fn a_coil_that_a_hand_detaches_stays_and_all_of_it_has_the_same_bits_again() {
    let room = Room::new();
    let (_, mut session) = room.session("");
    // It is not out yet: nothing has happened but the word.
    push(&mut session, "first", 12.0);
    let before = session.steps();
    assert!(detach(&mut session, "first").unwrap_err().to_string().contains("first"));
    assert_eq!((last(&session).0, session.steps()), (EventKind::Refused, before));
    push(&mut session, "first", 5.0);
    let out = session.simulation().shape().clone();
    detach(&mut session, "first").unwrap();
    assert_eq!(last(&session).0, EventKind::Detached);
    assert_eq!(session.simulation().coils().len(), 1);
    assert_eq!(session.readout().instruments[0].inserted_mm, 0.0);
    let snapshot = session.snapshot();
    assert_eq!(snapshot.coils, session.simulation().coils());
    // It is no instrument any more.
    push(&mut session, "first", 1.0);
    let (kind, text) = last(&session);
    assert!(kind == EventKind::Refused && text.contains("its coil is detached"), "{text}");
    push(&mut session, "second", 17.0);
    detach(&mut session, "second").unwrap();
    // Twice is once too often.
    detach(&mut session, "second").unwrap_err();
    let (coils, script) = (session.simulation().coils().to_vec(), session.script());
    assert_eq!(coils.len(), 2);
    assert_eq!(script.matches("detach = true").count(), 2);
    assert_eq!(room.run(&script).coils(), coils);
    // Undone motion by motion, and done again.
    session.apply(&Input::Undo {}).unwrap();
    assert_eq!(session.simulation().coils().len(), 1);
    session.apply(&Input::Undo {}).unwrap();
    session.apply(&Input::Undo {}).unwrap();
    assert!(session.simulation().coils().is_empty() && *session.simulation().shape() == out);
    for _ in 0..3 {
        session.apply(&Input::Redo {}).unwrap();
    }
    assert_eq!(session.simulation().coils(), coils);
    // Shown as a script, it is the same too.
    let (_, mut shown) = room.session(&script);
    shown.apply(&Input::Script {}).unwrap();
    for _ in 0..4000 {
        shown.tick();
    }
    assert!(!shown.readout().demonstrates);
    assert_eq!(shown.simulation().coils(), coils);
    assert_eq!(shown.script(), script);
}

#[test]
fn pictures_show_coils_that_were_left_behind() {
    let room = Room::new();
    let (scene, mut session) = room.session("");
    push(&mut session, "first", 17.0);
    detach(&mut session, "first").unwrap();
    let snapshot = session.snapshot();
    let without = endowire_play::Snapshot { coils: vec![], ..snapshot.clone() };
    let wall = session.simulation().lumen().wall(&NoStore).unwrap().clone();
    let mut pictures = Pictures::new(&scene, &snapshot, wall).unwrap();
    let [with, none] = [&snapshot, &without].map(|seen| pictures.three_d(seen).unwrap());
    let differing = with.data().iter().zip(none.data()).filter(|(a, b)| a != b).count();
    assert!(differing > 20, "{differing}");
}

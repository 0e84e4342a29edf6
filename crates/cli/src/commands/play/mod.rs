//! `endowire play`: interactive sessions.

mod lines;
mod live;
mod lockstep;
mod record;
mod socket;
mod solves;
#[cfg(feature = "window")]
mod window;

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc;

use endowire_assess::{Score, Subject};
use endowire_core::insertion::Script;
use endowire_methods::Scene;
use endowire_play::{Input, Limits, Pictures, Session, Went};
use endowire_viewer::ViewSpec;
use serde::Serialize;

use crate::args::PlayArgs;
use crate::cache::Cache;
use crate::commands::run::interrupts;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{print_json, tell};
use crate::{scenes, subjects};
use live::Message;
pub(crate) use record::Record;
pub(crate) use socket::Address;
pub(crate) use solves::Solves;

/// Document printed with `--json`.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    pace: live::Pace,
    #[serde(flatten)]
    went: Went,
    /// Score of a subject.
    #[serde(skip_serializing_if = "Option::is_none")]
    score: Option<&'a Score>,
}

/// Opens a session in the requested mode, and records it.
pub(crate) fn play(args: &PlayArgs) -> Result<(), Failure> {
    if let Some(record) = args.record.as_ref().filter(|file| file.extension().is_none_or(|end| end != "toml"))
    {
        return Err(Failure::Input(format!(
            "--record {}: must end in .toml: it is a script, and the session is written beside it as .session.json",
            record.display()
        )));
    }
    if args.scene.extension().is_some() && !args.scene.exists() {
        return Err(Failure::Input(format!(
            "{}: there is no such file: give a scene, as of assets/scenes, or a subject, as endowire subject list has them",
            args.scene.display()
        )));
    }
    match subjects::if_meant(&args.scene)? {
        Some(subject) => play_in(&in_subject(args, &subject)?, Some(subject)),
        None => {
            scenes::refuse_settings(&args.set.set, &NOT_SHOWN)?;
            play_in(args, None)
        }
    }
}

/// Keys of `[view]` that change nothing in a session, and what to do instead.
const NOT_SHOWN: [(&str, &str); 6] = [
    ("size_px", "pictures have the size of the window, or that of --size"),
    ("views", "a session has both views"),
    ("every", "is for endowire run, which repeats the recorded script"),
    ("film", "is for endowire run, which repeats the recorded script"),
    ("frames_per_s", "live pictures come at the rate of the screen"),
    ("bits", "a screen has eight"),
];

/// The same arguments with the scene and settings of a subject.
fn in_subject(args: &PlayArgs, subject: &Subject) -> Result<PlayArgs, Failure> {
    if let Some(setting) = args.set.set.first() {
        return Err(Failure::Input(format!(
            "--set {setting}: a subject is the same for all: change `set` in {}",
            subject.path().display()
        )));
    }
    let mut args = args.clone();
    args.scene = subject.resolve(&subject.scene);
    args.set.set = subjects::settings(subject)?;
    args.record.get_or_insert_with(|| Path::new("out").join(subject.stem()).join("played.toml"));
    let reference = subject.reference.as_ref().map(|file| subject.resolve(file));
    args.script = args.script.or(reference.filter(|_| args.watch || args.after_script));
    Ok(args)
}

fn play_in(args: &PlayArgs, subject: Option<Subject>) -> Result<(), Failure> {
    let scene = scenes::with_script(&args.scene, &args.set.set, args.script.as_deref())?;
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(args.scene.display());
    let cache = Cache::new(&args.cache);
    let limits = Limits { push_n: args.warn_n, torque_nmm: args.warn_nmm };
    let (mut session, script) = open(&scene, &args.scene, &cache, args.size, limits)?;
    if let Solves(Some(solves)) = args.solves {
        session = session.with_ticks(solves).map_err(in_scene)?;
    }
    // A trainee who does a subject is not shown its script, unless requested.
    if subject.is_none() || args.watch || args.after_script || args.script.is_some() {
        session = session.with_script(script);
    }
    let record =
        args.record.clone().unwrap_or_else(|| Path::new("out").join(&scene.name).join("played.toml"));
    let mut record = Record::new(record, &args.scene, &args.set.set)?;
    if let Some(subject) = subject {
        let exam = subjects::exam(subject, (&scene, &args.scene), session.simulation(), &cache)?;
        session = session.with_exam(exam);
        record = record.scored(Provenance::of_scene(&scene, &args.set.set)?);
    }
    let session = begun(session, args).map_err(in_scene)?;
    let wall = session.simulation().lumen().wall(&cache).map_err(in_scene)?.clone();
    let pictures = Pictures::new(&scene, &session.snapshot(), wall).map_err(in_scene)?;
    let (sender, messages) = mpsc::channel();
    if let Some(address) = args.listen {
        socket::listen(address.allowed(args.allow_remote)?, record.folder(), &sender)?;
    }
    tell_task(&session);
    if args.headless {
        read_inputs(args.inputs.as_deref(), sender.clone())?;
    }
    if args.headless && !args.realtime {
        let session = lockstep::run(session, pictures, &messages, &mut record)?;
        record.finish(&session)?;
        tell_score(&session);
        return Ok(());
    }
    record = record.by_the_clock();
    let (session, pace) = if args.headless {
        live::without_window(session, pictures, (sender, messages), &mut record)?
    } else {
        in_window(args, session, pictures, (sender, messages), &mut record)?
    };
    record.finish(&session)?;
    tell_score(&session);
    if args.json && !args.headless {
        let score = session.score();
        return print_json(&Document { pace, went: session.went(), score: score.as_deref() });
    }
    tell(pace);
    Ok(())
}

/// A session at the start of a scene, with the scene's script.
pub(crate) fn open(
    scene: &Scene,
    path: &Path,
    cache: &Cache,
    side_px: u32,
    limits: Limits,
) -> Result<(Session, Script), Failure> {
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
    let mut view = ViewSpec::of_scene(scene, path)?;
    let simulation = scene.simulation(cache).map_err(in_scene)?;
    // Computed here, so that the cache stores it before the session needs it.
    simulation.lumen().wall(cache).map_err(in_scene)?;
    let script = scene.steps(simulation.stack(), cache).map_err(in_scene)?;
    scenes::let_medium_flow(&mut view, scene, cache).map_err(in_scene)?;
    scenes::tell_found(path, scene);
    let sac = scene.sac(simulation.lumen(), cache).map_err(in_scene)?;
    let session = Session::new(simulation, view, side_px, limits).map_err(in_scene)?;
    Ok((session.with_sac(sac), script))
}

/// Prints the task, if the session is a subject.
fn tell_task(session: &Session) {
    if let Some(standing) = session.standing() {
        let task = &standing.task;
        tell(format_args!("{}, level {}\n{}", task.name, task.level, task.text.trim()));
    }
}

/// Prints the score, if the session is a subject. One in which nothing was done has none.
fn tell_score(session: &Session) {
    match (session.score(), session.standing()) {
        (Some(score), _) => tell(subjects::text(&score)),
        (None, Some(standing)) => {
            tell(format_args!("{}: nothing was done: there is no score", standing.subject));
        }
        (None, None) => {}
    }
}

/// Starts or carries out the session's script, if requested.
fn begun(mut session: Session, args: &PlayArgs) -> endowire_core::Result<Session> {
    if args.watch || args.after_script {
        session.apply(&Input::Script {})?;
    }
    let interrupted = interrupts();
    while args.after_script && session.demonstrates() && !interrupted.load(Ordering::Relaxed) {
        session.tick();
    }
    Ok(session)
}

/// Reads lines on another thread, from a file or from stdin.
fn read_inputs(file: Option<&Path>, to: mpsc::Sender<Message>) -> Result<(), Failure> {
    let lines: Box<dyn Read + Send> = match file {
        Some(path) => Box::new(
            File::open(path).map_err(|e| Failure::Input(format!("--inputs {}: {e}", path.display())))?,
        ),
        None => Box::new(std::io::stdin()),
    };
    std::thread::spawn(move || {
        lines::read(BufReader::new(lines), &to, Ok, lines::to_stdout);
        // Fails if the receiver is gone, which does not matter.
        let _ = to.send(Message::Ended);
    });
    Ok(())
}

type Channel = (mpsc::Sender<Message>, mpsc::Receiver<Message>);

#[cfg(feature = "window")]
fn in_window(
    args: &PlayArgs,
    session: Session,
    pictures: Pictures,
    channel: Channel,
    record: &mut Record,
) -> Result<(Session, live::Pace), Failure> {
    window::run(args, session, pictures, channel, record)
}

#[cfg(not(feature = "window"))]
fn in_window(
    _: &PlayArgs,
    _: Session,
    _: Pictures,
    _: Channel,
    _: &mut Record,
) -> Result<(Session, live::Pace), Failure> {
    let text = "play: this program was built without the feature window: give --headless, or cargo build --release --features window; \
                endowire run SCENE carries out a script";
    Err(Failure::Input(text.to_owned()))
}

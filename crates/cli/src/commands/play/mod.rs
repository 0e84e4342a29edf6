//! `endowire play`: instruments moved by hand.

mod lines;
mod live;
mod lockstep;
mod record;
mod socket;
#[cfg(feature = "window")]
mod window;

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc;

use endowire_play::{Input, Limits, Pictures, Session, Went};
use endowire_viewer::ViewSpec;
use serde::Serialize;

use crate::args::PlayArgs;
use crate::cache::Cache;
use crate::commands::run::interrupts;
use crate::failure::Failure;
use crate::output::{print_json, tell};
use crate::scenes;
use live::Message;
use record::Record;
pub(crate) use socket::Address;

/// What `--json` prints.
#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    pace: live::Pace,
    #[serde(flatten)]
    went: Went,
}

/// Opens a session in the way that was asked for, and records what was done.
pub(crate) fn play(args: &PlayArgs) -> Result<(), Failure> {
    let scene = scenes::with_script(&args.scene, &args.set.set, args.script.as_deref())?;
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(args.scene.display());
    let cache = Cache::new(&args.cache);
    let mut view = ViewSpec::of_scene(&scene, &args.scene)?;
    let simulation = scene.simulation(&cache).map_err(in_scene)?;
    // Kept by the cache before the session asks for it.
    simulation.lumen().wall(&cache).map_err(in_scene)?;
    let limits = Limits { push_n: args.warn_n, torque_nmm: args.warn_nmm };
    let script = scene.steps(simulation.stack(), &cache).map_err(in_scene)?;
    scenes::let_medium_flow(&mut view, &scene, &cache).map_err(in_scene)?;
    scenes::tell_found_centreline(&args.scene, &scene);
    let session = Session::new(simulation, view, args.size, limits).map_err(in_scene)?;
    let session = begun(session.with_script(script), args).map_err(in_scene)?;
    let wall = session.simulation().lumen().wall(&cache).map_err(in_scene)?.clone();
    let pictures = Pictures::new(&scene, &session.snapshot(), wall).map_err(in_scene)?;
    let mut record = Record::new(args, &scene);
    let (sender, messages) = mpsc::channel();
    if let Some(address) = args.listen {
        socket::listen(address.allowed(args.allow_remote)?, record.folder(), &sender)?;
    }
    if args.headless {
        read_inputs(args.inputs.as_deref(), sender.clone())?;
    }
    if args.headless && !args.realtime {
        let session = lockstep::run(session, pictures, &messages, &mut record)?;
        return record.finish(&session);
    }
    let (session, pace) = if args.headless {
        live::without_window(session, pictures, (sender, messages), &mut record)?
    } else {
        in_window(args, session, pictures, (sender, messages), &mut record)?
    };
    record.finish(&session)?;
    if args.json && !args.headless {
        return print_json(&Document { pace, went: session.went() });
    }
    tell(pace);
    Ok(())
}

/// The session with its script on its way, or carried out, if that was asked for.
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

/// Has lines read on a thread of their own: from a file, or from stdin.
fn read_inputs(file: Option<&Path>, to: mpsc::Sender<Message>) -> Result<(), Failure> {
    let lines: Box<dyn Read + Send> = match file {
        Some(path) => Box::new(
            File::open(path).map_err(|e| Failure::Input(format!("--inputs {}: {e}", path.display())))?,
        ),
        None => Box::new(std::io::stdin()),
    };
    std::thread::spawn(move || {
        lines::read(BufReader::new(lines), &to, Ok, lines::to_stdout);
        // Nobody may listen any more.
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

//! A session in real time: one thread for the physics, sixty ticks per second, another for pictures. The physics
//! never waits for pictures; whenever the drawing thread is ready, it takes the newest state.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use endowire_play::{Input, Pictures, Session, Sharpened, Sharpening, Snapshot, TICKS_PER_S};
use endowire_viewer::Image;
use serde::Serialize;

use super::Channel;
use super::lines::{self, Line, Order, Reply};
use super::record::Record;
use crate::commands::run::interrupts;
use crate::failure::Failure;

/// Interval between frames of fluoroscopy: 30 per second.
const FRAME: Duration = Duration::from_nanos(33_333_333);
/// Interval, in frames, between 3D views: the live picture has priority.
const THREE_D_EVERY: u64 = 4;
/// Delay after which the clock counts as stopped; missed ticks are then dropped.
const LATE: Duration = Duration::from_millis(100);

/// Messages to the thread of the session.
#[derive(Debug)]
#[cfg_attr(not(feature = "window"), expect(dead_code, reason = "the window reads or sends it"))]
pub(crate) enum Message {
    /// From the window.
    Input(Input),
    /// Side of the pictures, pixels.
    Side(u32),
    /// A line of the protocol, or why it is invalid, with the receiver of its answer.
    Line(std::result::Result<Line, String>, Reply),
    /// Standard input has ended.
    Ended,
    /// The window was closed.
    Quit,
}

/// The state to draw, with the time of the oldest input that no earlier picture shows.
#[cfg_attr(not(feature = "window"), expect(dead_code, reason = "the window reads or sends it"))]
pub(crate) struct FrameTime {
    pub(crate) snapshot: Snapshot,
    pub(crate) input_at: Option<Instant>,
    pub(crate) step_ms: f64,
}

/// The newest state, until it is taken.
#[derive(Default)]
pub(crate) struct Newest {
    moment: Mutex<Option<FrameTime>>,
    /// Dose chosen by exposure control.
    there: Condvar,
    ended: AtomicBool,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Newest {
    fn put(&self, mut moment: FrameTime) {
        let mut place = locked(&self.moment);
        let unseen = place.take().and_then(|before| before.input_at);
        moment.input_at = unseen.or(moment.input_at);
        *place = Some(moment);
        self.there.notify_one();
    }

    /// Waits for the newest state; `None` at the end.
    fn take(&self) -> Option<FrameTime> {
        let mut place = locked(&self.moment);
        loop {
            if self.ended.load(Ordering::Relaxed) {
                return None;
            }
            if let Some(moment) = place.take() {
                return Some(moment);
            }
            let waited = self.there.wait_timeout(place, FRAME);
            place = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn end(&self) {
        self.ended.store(true, Ordering::Relaxed);
        self.there.notify_all();
    }
}

/// Data of one frame on the screen.
#[cfg_attr(not(feature = "window"), expect(dead_code, reason = "the window reads or sends it"))]
pub(crate) struct Shown<'a> {
    pub(crate) moment: &'a FrameTime,
    /// One for each plane.
    pub(crate) fluoro: &'a [Image],
    pub(crate) three_d: Option<&'a Image>,
    /// Why a picture could not be drawn.
    pub(crate) failure: Option<&'a str>,
    /// `None` without a clock.
    pub(crate) frame_ms: Option<f64>,
}

/// Timing of a session.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub(crate) struct Pace {
    /// Duration of the session, s.
    pub(crate) wall_time_s: f64,
    /// Ticks per second.
    pub(crate) ticks_per_s: f64,
    /// Number of ticks dropped because they were too late.
    pub(crate) ticks_missed: u64,
    /// Time of a tick with motion, ms: median, 95 % and longest.
    pub(crate) step_ms: [f64; 3],
    /// Number of live fluoroscopic frames.
    pub(crate) frames: usize,
    /// Live fluoroscopic frames per second of beam-on time.
    pub(crate) frames_per_s: f64,
    /// Time of such a frame, ms: median, 95 % and longest.
    pub(crate) frame_ms: [f64; 3],
    /// Latency from an input to the picture that shows it, ms: median, 95 % and longest.
    pub(crate) input_to_picture_ms: [f64; 3],
}

impl fmt::Display for Pace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            wall_time_s,
            ticks_per_s,
            ticks_missed,
            step_ms,
            frames,
            frames_per_s,
            frame_ms,
            input_to_picture_ms,
        } = self;
        write!(
            f,
            "{wall_time_s:.1} s, {ticks_per_s:.1} ticks a second ({ticks_missed} missed), steps {:.1} ms (95 % below {:.1}), {frames} live \
             frames, {frames_per_s:.1} a second, {:.1} ms each, {:.0} ms from an input to its picture (95 % below {:.0})",
            step_ms[0], step_ms[1], frame_ms[0], input_to_picture_ms[0], input_to_picture_ms[1]
        )
    }
}

#[cfg(feature = "window")]
impl Pace {
    /// Sets the latencies from inputs to the window.
    pub(crate) fn presented(self, inputs_ms: Vec<f64>) -> Self {
        Self { input_to_picture_ms: spread(inputs_ms), ..self }
    }
}

/// Median, 95 % and largest of times, ms.
fn spread(mut times: Vec<f64>) -> [f64; 3] {
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times.get((times.len().saturating_sub(1) as f64 * share) as usize).copied();
    [0.5, 0.95, 1.0].map(|share| at(share).unwrap_or(0.0))
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// Runs the session on this thread until it is asked to end.
pub(crate) fn physics(
    mut session: Session,
    messages: &Receiver<Message>,
    newest: &Newest,
    record: &mut Record,
    ends_with_stdin: bool,
) -> std::result::Result<(Session, Pace), Failure> {
    let interrupted = interrupts();
    let tick = Duration::from_secs_f64(1.0 / TICKS_PER_S);
    let begun = Instant::now();
    let (mut due, mut ticks, mut missed, mut steps_ms) = (begun, 0_u64, 0, Vec::new());
    let mut input_at = None;
    let mut goes_on = true;
    while goes_on && !interrupted.load(Ordering::Relaxed) {
        due += tick;
        if due.elapsed() > LATE {
            missed += (due.elapsed().as_secs_f64() * TICKS_PER_S) as u64;
            due = Instant::now();
        }
        loop {
            match messages.recv_timeout(due.saturating_duration_since(Instant::now())) {
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) | Ok(Message::Quit) => goes_on = false,
                Ok(Message::Ended) => goes_on &= !ends_with_stdin,
                Ok(Message::Input(input)) => {
                    input_at.get_or_insert_with(Instant::now);
                    // A refused input becomes an event of the session.
                    let _ = session.apply(&input);
                }
                // A side that a window has is valid.
                Ok(Message::Side(side_px)) => drop(session.show_at(side_px)),
                Ok(Message::Line(line, reply)) => {
                    input_at.get_or_insert_with(Instant::now);
                    let quits = matches!(line, Ok(Line::Order(Order::Quit {})));
                    let answer = lines::answer(said(line, &mut session), &session.readout());
                    if quits {
                        reply.send_last(answer);
                        goes_on = false;
                    } else {
                        reply.send(answer);
                    }
                }
            }
            if !goes_on {
                break;
            }
        }
        let (before, clock) = (session.steps(), Instant::now());
        if !session.waits_for_hands() {
            session.tick();
        }
        let step_ms = ms(clock.elapsed());
        if session.steps() != before {
            steps_ms.push(step_ms);
        }
        ticks += 1;
        newest.put(FrameTime { snapshot: session.snapshot(), input_at: input_at.take(), step_ms });
        record.keep(&session)?;
    }
    let wall_time_s = begun.elapsed().as_secs_f64();
    let ticks_per_s = ticks as f64 / wall_time_s;
    let pace =
        Pace { wall_time_s, ticks_per_s, ticks_missed: missed, step_ms: spread(steps_ms), ..Pace::default() };
    Ok((session, pace))
}

fn said(line: std::result::Result<Line, String>, session: &mut Session) -> std::result::Result<(), String> {
    match line? {
        Line::Input(input) => session.apply(&input).map_err(|e| e.to_string()),
        Line::Order(Order::Read {} | Order::Quit {}) => Ok(()),
        Line::Order(Order::Wait { .. } | Order::Picture { .. }) => {
            Err("time goes by as on a clock here: wait and picture belong to --headless without --realtime"
                .to_owned())
        }
    }
}

/// Times of the frames.
#[derive(Default)]
pub(crate) struct Frames {
    frames_ms: Vec<f64>,
    inputs_ms: Vec<f64>,
    live_s: f64,
}

impl Frames {
    pub(crate) fn into_pace(self, pace: Pace) -> Pace {
        let frames = self.frames_ms.len();
        Pace {
            frames,
            frames_per_s: if frames > 0 { frames as f64 / self.live_s } else { 0.0 },
            frame_ms: spread(self.frames_ms),
            input_to_picture_ms: spread(self.inputs_ms),
            ..pace
        }
    }
}

/// Draws states on this thread until the session ends, and passes each frame to `show`; sharp pictures after a change
/// of the room are computed on another thread.
pub(crate) fn draw(pictures: Pictures, newest: &Newest, show: impl FnMut(&Shown<'_>)) -> Frames {
    let (to, jobs) = mpsc::channel::<Sharpening>();
    let (done, back) = mpsc::channel();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            for job in jobs {
                if done.send(job.carry_out()).is_err() {
                    break;
                }
            }
        });
        // The other thread ends when its channel is closed.
        draw_with(pictures, newest, (to, back), show)
    })
}

fn draw_with(
    mut pictures: Pictures,
    newest: &Newest,
    (to, back): (Sender<Sharpening>, Receiver<Sharpened>),
    mut show: impl FnMut(&Shown<'_>),
) -> Frames {
    let mut times = Frames::default();
    let (mut number, mut due, mut was_live) = (0_u64, Instant::now(), None::<Instant>);
    let (mut three_d, mut drawn_3d) = (None::<Image>, None);
    let mut fluoro = Vec::new();
    while let Some(moment) = newest.take() {
        let clock = Instant::now();
        let snapshot = &moment.snapshot;
        let mut failure = None;
        for sharpened in back.try_iter() {
            failure = pictures.sharpened(sharpened).err().map(|error| error.to_string());
        }
        match pictures.soon(snapshot) {
            Ok(images) => fluoro = images.to_vec(),
            Err(error) => failure = Some(error.to_string()),
        }
        let live = snapshot.lab.is_live();
        let frame_ms = ms(clock.elapsed());
        match pictures.sharpenings(snapshot) {
            // Sending fails only at the end, when the other thread is gone.
            Ok(all) => all.into_iter().for_each(|one| drop(to.send(one))),
            Err(error) => failure = Some(error.to_string()),
        }
        let seen = (
            snapshot.readout.step,
            snapshot.readout.tip_mm,
            snapshot.lab.revisions()[1],
            snapshot.hides_three_d(),
        );
        if number.is_multiple_of(THREE_D_EVERY) && drawn_3d != Some(seen) {
            drawn_3d = Some(seen);
            match pictures.three_d(snapshot) {
                Ok(image) => three_d = Some(image),
                Err(error) => failure = Some(error.to_string()),
            }
        }
        let shown = Shown {
            moment: &moment,
            fluoro: &fluoro,
            three_d: three_d.as_ref(),
            failure: failure.as_deref(),
            frame_ms: Some(frame_ms),
        };
        show(&shown);
        times.inputs_ms.extend(moment.input_at.map(|at| ms(at.elapsed())));
        if live {
            times.frames_ms.push(frame_ms);
            times.live_s += was_live.map_or(FRAME, |before| before.elapsed()).as_secs_f64();
        }
        was_live = live.then(Instant::now);
        number += 1;
        due = (due + FRAME).max(Instant::now() - FRAME);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
    times
}

/// The same without a window: frames are discarded.
pub(crate) fn without_window(
    session: Session,
    pictures: Pictures,
    (_sender, messages): Channel,
    record: &mut Record,
) -> std::result::Result<(Session, Pace), Failure> {
    let newest = Arc::new(Newest::default());
    let seen = Arc::clone(&newest);
    let drawing = std::thread::spawn(move || draw(pictures, &seen, |_| {}));
    let done = physics(session, &messages, &newest, record, true);
    newest.end();
    let frames = drawing.join().unwrap_or_default();
    done.map(|(session, pace)| (session, frames.into_pace(pace)))
}

/// Stops the drawing thread after the session has ended.
#[cfg(feature = "window")]
pub(crate) fn end(newest: &Newest) {
    newest.end();
}

//! The window: it translates keys and mouse into inputs and shows the frames.

#[cfg(feature = "gamepad")]
mod gamepad;
mod screen;
mod task;
mod text;

use std::num::NonZeroU32;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use endowire_play::{Input, KEYS, Keys, Modifiers, Pictures, Session, Snapshot};
use endowire_viewer::Image;
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop, EventLoopProxy, OwnedDisplayHandle};
use winit::keyboard::{KeyCode, ModifiersState, PhysicalKey};
use winit::window::{Window, WindowId};

use super::Channel;
use super::live::{self, Message, Newest, Pace};
use super::record::Record;
use crate::args::PlayArgs;
use crate::failure::Failure;
use crate::output::chart::write_png;
use crate::output::tell;
use screen::Layout;
use text::{Canvas, Scale, Writer};

/// Initial width, with one plane and with two, and height of the window: those at which text has its usual size.
const WIDTHS: [u32; 2] = [1280, 1720];
const HEIGHT: u32 = 860;
/// Time after which the size of the pictures is chosen anew.
const FIT_EVERY: Duration = Duration::from_secs(2);
/// Rotation of the 3D view by a drag, degrees per pixel.
const DEG_PER_PX: f64 = 0.4;

/// Messages from other threads.
#[derive(Debug)]
enum Event {
    /// A new picture.
    Picture,
    /// State of the connected gamepad, with its name; `None` after it was disconnected.
    #[cfg(feature = "gamepad")]
    Gamepad(Option<(String, endowire_play::Pad)>),
    /// The session has ended.
    Ended,
}

/// Data shared with the thread that draws.
#[derive(Default)]
struct Shared {
    size: [AtomicUsize; 2],
    /// Pixels of the screen for each of a usual one, in thousandths.
    density: AtomicUsize,
    help: AtomicBool,
    /// Name of the connected gamepad.
    gamepad: Mutex<Option<String>>,
    picture: Mutex<Option<Picture>>,
}

impl Shared {
    fn set_density(&self, density: f64) {
        self.density.store((1e3 * density) as usize, Ordering::Relaxed);
    }

    /// The scale of text in a window of this size.
    fn scale(&self, size: [usize; 2], planes: usize) -> Scale {
        Scale::of(size, usual_size(planes), self.density.load(Ordering::Relaxed) as f64 / 1e3)
    }
}

/// The initial size of the window.
fn usual_size(planes: usize) -> [usize; 2] {
    [WIDTHS[planes.min(2) - 1], HEIGHT].map(|side| side as usize)
}

/// The newest picture of the whole window.
struct Picture {
    canvas: Canvas,
    /// Time of the oldest input that it is the first to show.
    input_at: Option<Instant>,
    /// Width of the fluoroscopic field at the isocentre, mm.
    field_mm: f64,
}

struct Shell {
    title: String,
    shared: Arc<Shared>,
    to: Sender<Message>,
    keys: Keys,
    /// State of the gamepad.
    #[cfg(feature = "gamepad")]
    pad: endowire_play::Pad,
    surface: Option<softbuffer::Surface<OwnedDisplayHandle, Arc<Window>>>,
    /// Number of planes of fluoroscopy.
    planes: usize,
    cursor: [f64; 2],
    dragging: bool,
    /// Whether a drag moves the 3D view, and does not turn it.
    moves: bool,
    /// Width of the fluoroscopic field at the isocentre, mm.
    field_mm: f64,
    /// Latencies from inputs to the pictures that show them, ms.
    inputs_ms: Vec<f64>,
    failure: Option<String>,
}

/// Opens the window and runs the session until it is closed.
pub(super) fn run(
    args: &PlayArgs,
    session: Session,
    pictures: Pictures,
    (sender, messages): Channel,
    record: &mut Record,
) -> Result<(Session, Pace), Failure> {
    let no_display = |reason: String| {
        Failure::Input(format!(
            "play: no display to open a window on ({reason}): give --headless for the protocol alone, or carry out a script with \
             endowire run {}",
            args.scene.display()
        ))
    };
    let events = EventLoop::<Event>::with_user_event().build().map_err(|e| no_display(e.to_string()))?;
    let writer = Writer::new().ok_or_else(|| no_display("the font cannot be read".to_owned()))?;
    let shared = Arc::new(Shared::default());
    let mut shell = Shell {
        title: format!("endowire: {}", args.scene.display()),
        shared: Arc::clone(&shared),
        to: sender,
        keys: Keys::of(session.simulation().stack()),
        #[cfg(feature = "gamepad")]
        pad: endowire_play::Pad::default(),
        surface: None,
        planes: screen::planes(&session.readout()),
        cursor: [0.0; 2],
        dragging: false,
        moves: false,
        field_mm: 0.0,
        inputs_ms: Vec::new(),
        failure: None,
    };
    #[cfg(feature = "gamepad")]
    gamepad::listen(events.create_proxy());
    let newest = Newest::default();
    let (drawn_for, proxy) = (events.create_proxy(), events.create_proxy());
    std::thread::scope(|scope| {
        let newest = &newest;
        let to = shell.to.clone();
        let drawing = scope.spawn(move || draw(pictures, newest, &shared, writer, (&drawn_for, &to)));
        let simulating = scope.spawn(move || {
            let done = live::physics(session, &messages, newest, record, false);
            live::end(newest);
            // Fails if the window is gone, which does not matter.
            let _ = proxy.send_event(Event::Ended);
            done
        });
        let shown = events.run_app(&mut shell);
        let _ = shell.to.send(Message::Quit);
        let failed = |what: &str| Failure::Computation(format!("play: {what}"));
        let (session, pace) = simulating.join().map_err(|_| failed("the simulation stopped"))??;
        let frames = drawing.join().map_err(|_| failed("the pictures stopped"))?;
        if let Some(reason) = shell.failure {
            // The session is recorded nevertheless.
            tell(format_args!("endowire: the window was closed: {reason}"));
        }
        shown.map_err(|e| no_display(e.to_string()))?;
        Ok((session, frames.into_pace(pace).presented(shell.inputs_ms)))
    })
}

/// Draws whole windows on this thread, and shows each.
fn draw(
    pictures: Pictures,
    newest: &Newest,
    shared: &Shared,
    mut writer: Writer,
    (proxy, to): (&EventLoopProxy<Event>, &Sender<Message>),
) -> live::Frames {
    let (mut fitted, mut quickest_ms) = (Instant::now(), f64::INFINITY);
    live::draw(pictures, newest, |shown| {
        let size = [0, 1].map(|side| shared.size[side].load(Ordering::Relaxed));
        if size.contains(&0) {
            return;
        }
        let gamepad = shared.gamepad.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let help = shared.help.load(Ordering::Relaxed).then(|| help(gamepad.is_some()));
        let scale = shared.scale(size, screen::planes(&shown.moment.snapshot.readout));
        let canvas = screen::compose(&mut writer, shown, (size, scale), help.as_deref(), gamepad.as_deref());
        if let Some(frame_ms) = sharp_ms(shown) {
            quickest_ms = quickest_ms.min(frame_ms);
            if fitted.elapsed() > FIT_EVERY {
                fit(shown, (size, scale), quickest_ms, to);
                (fitted, quickest_ms) = (Instant::now(), f64::INFINITY);
            }
        }
        let mut picture = shared.picture.lock().unwrap_or_else(PoisonError::into_inner);
        let unseen = picture.take().and_then(|before| before.input_at);
        let field_mm = shown.moment.snapshot.readout.lab.field_mm;
        *picture = Some(Picture { canvas, input_at: unseen.or(shown.moment.input_at), field_mm });
        let _ = proxy.send_event(Event::Picture);
    })
}

/// Time that a sharp live picture has taken, ms.
fn sharp_ms(shown: &live::Shown<'_>) -> Option<f64> {
    let lab = &shown.moment.snapshot.lab;
    let sharp = shown.fluoro.first().is_some_and(|image| image.width() == lab.fluoro().size_px[0]);
    shown.frame_ms.filter(|_| sharp && lab.is_live())
}

/// Has live pictures drawn as large as they are shown, if there is time: other programs make some of them slow.
fn fit(shown: &live::Shown<'_>, (size, scale): ([usize; 2], Scale), quickest_ms: f64, to: &Sender<Message>) {
    let side_px = shown.moment.snapshot.lab.fluoro().size_px[0];
    let layout = Layout::of(size, screen::planes(&shown.moment.snapshot.readout), scale);
    let fitting = endowire_play::fitting_side(layout.side as u32, side_px, quickest_ms);
    if fitting != side_px {
        let _ = to.send(Message::Side(fitting));
    }
}

/// Writes the window for a state as a PNG file, at its initial size. It is drawn in memory, so no display is needed.
pub(super) fn write(
    file: &Path,
    snapshot: Snapshot,
    fluoro: &[Image],
    three_d: &Image,
) -> Result<(), String> {
    let failed = |reason: String| format!("{}: {reason}", file.display());
    let mut writer = Writer::new().ok_or_else(|| failed("the font cannot be read".to_owned()))?;
    let usual = usual_size(screen::planes(&snapshot.readout));
    let scale = Scale::of(usual, usual, 1.0);
    let moment = live::FrameTime { snapshot, input_at: None, step_ms: 0.0 };
    let shown =
        live::Shown { moment: &moment, fluoro, three_d: Some(three_d), failure: None, frame_ms: None };
    let canvas = screen::compose(&mut writer, &shown, (usual, scale), None, None);
    let rgb: Vec<u8> =
        canvas.pixels.iter().flat_map(|pixel| pixel.to_be_bytes().into_iter().skip(1)).collect();
    write_png(file, (canvas.size[0] as u32, canvas.size[1] as u32), &rgb).map_err(|e| failed(e.to_string()))
}

/// Lines of the help on F1: keys, and those of a gamepad if one is connected.
fn help(gamepad: bool) -> Vec<screen::Help> {
    #[cfg(feature = "gamepad")]
    let of_pad = endowire_play::PAD;
    #[cfg(not(feature = "gamepad"))]
    let of_pad: &[screen::Help] = &[];
    let of_window = [("F1, Esc", "this help, end")];
    KEYS.iter().copied().chain(of_window).chain(of_pad.iter().copied().filter(|_| gamepad)).collect()
}

/// The name of a key in UI Events: winit uses the same names.
fn name(code: KeyCode) -> String {
    format!("{code:?}")
}

impl Shell {
    fn send(&self, inputs: impl IntoIterator<Item = Input>) {
        for input in inputs {
            let _ = self.to.send(Message::Input(input));
        }
    }

    /// Opens window and surface.
    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), String> {
        let attributes = Window::default_attributes()
            .with_title(&self.title)
            .with_inner_size(LogicalSize::new(WIDTHS[self.planes.min(2) - 1], HEIGHT));
        let window = Arc::new(events.create_window(attributes).map_err(|e| e.to_string())?);
        let size = window.inner_size();
        self.shared.set_density(window.scale_factor());
        self.resized(size.width, size.height);
        let context = softbuffer::Context::new(events.owned_display_handle()).map_err(|e| e.to_string())?;
        self.surface = Some(softbuffer::Surface::new(&context, window).map_err(|e| e.to_string())?);
        Ok(())
    }

    fn resized(&self, width: u32, height: u32) {
        for (side, length) in self.shared.size.iter().zip([width, height]) {
            side.store(length as usize, Ordering::Relaxed);
        }
    }

    fn layout(&self) -> Layout {
        let size = [0, 1].map(|side| self.shared.size[side].load(Ordering::Relaxed));
        Layout::of(size, self.planes, self.shared.scale(size, self.planes))
    }

    /// Shows the newest picture in the window.
    fn present(&mut self) -> Result<(), String> {
        let Some(surface) = &mut self.surface else { return Ok(()) };
        let mut picture = self.shared.picture.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(Picture { canvas, input_at, field_mm }) = picture.as_mut() else { return Ok(()) };
        self.field_mm = *field_mm;
        let [width, height] = canvas.size.map(|side| NonZeroU32::new(side as u32));
        let (Some(width), Some(height)) = (width, height) else { return Ok(()) };
        surface.resize(width, height).map_err(|e| e.to_string())?;
        let mut buffer = surface.buffer_mut().map_err(|e| e.to_string())?;
        buffer.copy_from_slice(&canvas.pixels);
        buffer.present().map_err(|e| e.to_string())?;
        self.inputs_ms.extend(input_at.take().map(|at| at.elapsed().as_secs_f64() * 1e3));
        Ok(())
    }

    fn key(&mut self, events: &ActiveEventLoop, event: &KeyEvent) {
        let PhysicalKey::Code(code) = event.physical_key else { return };
        let pressed = event.state == ElementState::Pressed;
        let inputs = self.keys.key(&name(code), pressed, event.repeat);
        self.send(inputs);
        match code {
            KeyCode::F1 if pressed && !event.repeat => {
                self.shared.help.fetch_xor(true, Ordering::Relaxed);
            }
            KeyCode::Escape if pressed && !event.repeat => events.exit(),
            _ => {}
        }
    }

    /// Handles a change of the gamepad; a disconnected one is untouched.
    #[cfg(feature = "gamepad")]
    fn held(&mut self, now: Option<(String, endowire_play::Pad)>) {
        let (name, now) = now.unzip();
        *self.shared.gamepad.lock().unwrap_or_else(PoisonError::into_inner) = name;
        let now = now.unwrap_or_default();
        let before = std::mem::replace(&mut self.pad, now);
        let inputs = self.keys.pad(&before, &self.pad);
        self.send(inputs);
    }

    /// Handles a drag: it moves the table on the live picture, or the camera on the 3D view, depending on where it
    /// began.
    fn dragged(&mut self, x: f64, y: f64) {
        let by = [x - self.cursor[0], y - self.cursor[1]];
        let layout = self.layout();
        let plane = layout.plane_at(self.cursor[0], self.cursor[1]);
        self.cursor = [x, y];
        if !self.dragging || by == [0.0; 2] {
            return;
        }
        self.send([match plane {
            Some(plane) => {
                // The picture follows the mouse.
                let mm_per_px = self.field_mm / layout.side.max(1) as f64;
                let second = plane == 1;
                Input::Table { right_mm: -by[0] * mm_per_px, down_mm: -by[1] * mm_per_px, second }
            }
            None if self.moves => {
                let width = layout.three_d.1.into_iter().min().unwrap_or(1).max(1) as f64;
                Input::MoveCamera { right: -by[0] / width, up: by[1] / width }
            }
            None => Input::TurnCamera { azimuth_deg: -by[0] * DEG_PER_PX, elevation_deg: by[1] * DEG_PER_PX },
        }]);
    }
}

impl ApplicationHandler<Event> for Shell {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.surface.is_none()
            && let Err(reason) = self.open(events)
        {
            self.failure = Some(reason);
            events.exit();
        }
    }

    fn user_event(&mut self, events: &ActiveEventLoop, reported: Event) {
        match (reported, &self.surface) {
            (Event::Ended, _) => events.exit(),
            (Event::Picture, Some(surface)) => surface.window().request_redraw(),
            (Event::Picture, None) => {}
            #[cfg(feature = "gamepad")]
            (Event::Gamepad(now), _) => self.held(now),
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(size) => self.resized(size.width, size.height),
            WindowEvent::ScaleFactorChanged { scale_factor, .. } => self.shared.set_density(scale_factor),
            WindowEvent::RedrawRequested => {
                if let Err(reason) = self.present() {
                    self.failure = Some(reason);
                    events.exit();
                }
            }
            WindowEvent::KeyboardInput { event, .. } => self.key(events, &event),
            WindowEvent::ModifiersChanged(modifiers) => {
                let held = |key| modifiers.state().contains(key);
                self.moves = held(ModifiersState::SHIFT);
                let inputs = self.keys.modify(Modifiers {
                    shift: held(ModifiersState::SHIFT),
                    control: held(ModifiersState::CONTROL),
                });
                self.send(inputs);
            }
            WindowEvent::Focused(false) => {
                let inputs = self.keys.let_go();
                self.send(inputs);
            }
            WindowEvent::CursorMoved { position, .. } => self.dragged(position.x, position.y),
            WindowEvent::MouseInput { state, button, .. }
                if matches!(button, MouseButton::Left | MouseButton::Right) =>
            {
                self.dragging = state == ElementState::Pressed;
                if button == MouseButton::Right {
                    self.moves = self.dragging;
                }
            }
            WindowEvent::MouseWheel { delta, .. } => {
                let lines = match delta {
                    MouseScrollDelta::LineDelta(_, y) => f64::from(y),
                    MouseScrollDelta::PixelDelta(by) => by.y / 40.0,
                };
                let factor = 1.1_f64.powf(lines.clamp(-5.0, 5.0));
                let on_picture = self.layout().plane_at(self.cursor[0], self.cursor[1]).is_some();
                self.send([if on_picture { Input::Zoom { factor } } else { Input::ZoomCamera { factor } }]);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_have_the_names_that_the_table_knows() {
        let mut keys = Keys::new(vec!["wire".to_owned()]);
        for code in [
            KeyCode::ArrowUp,
            KeyCode::Space,
            KeyCode::KeyC,
            KeyCode::Enter,
            KeyCode::Backspace,
            KeyCode::Tab,
            KeyCode::Digit1,
            KeyCode::NumpadAdd,
            KeyCode::Equal,
        ] {
            assert!(!keys.key(&name(code), true, false).is_empty(), "{code:?}");
        }
        assert!(keys.key(&name(KeyCode::F1), true, false).is_empty());
    }
}

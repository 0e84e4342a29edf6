//! Pictures: fluoroscopy and the 3D view, drawn by the processor.

use std::sync::{Arc, Mutex};

use endowire_core::Error;
use endowire_core::insertion::Simulation;
use endowire_core::shape::Shape;
use endowire_core::vessel::NoStore;
use endowire_viewer::{
    Backend, CArmSpec, FrameTime, Image, InjectionSpec, Moment, Pushed, Renderer, Seen, View, ViewSpec,
};

use crate::border::{Room, free, handle, lock, make};
use crate::scene::Read;
use crate::simulation::EndowireSimulation;
use crate::status::{EndowireStatus, Failure, call};

/// Draws simulations of one scene. Its pictures follow each other, as those of a C-arm. One thread at a time may use it.
pub struct EndowireRenderer {
    inner: Mutex<Drawn>,
}

struct Drawn {
    read: Arc<Read>,
    view: View,
    renderer: Renderer,
    pushed: Pushed,
    /// What the last picture has shown.
    before: Option<Before>,
}

/// What a picture has shown: an exposure shows motion since then.
struct Before {
    /// Number of its simulation: another one has not moved.
    of: u64,
    shape: Shape,
    inserted_mm: Vec<f64>,
    time_s: f64,
}

impl Drawn {
    fn new(simulation: &EndowireSimulation, view: View, size_px: [u32; 2]) -> Result<Self, Failure> {
        let read = Arc::clone(&simulation.read);
        let simulation = simulation.lock()?;
        // The same bits on all machines, and no driver in a program that has its own.
        let backend = Backend::Cpu;
        let spec = ViewSpec::of_scene(&read.scene, &read.path)?;
        let mut spec = ViewSpec { views: vec![view], size_px, backend, bits: 8, biplane_deg: None, ..spec };
        spec.validate()?;
        if spec.wants(View::Fluoro) && !spec.injection.is_empty() {
            spec.take_centreline(&read.scene, &NoStore)?;
            spec.check_places()?;
        }
        let pushed = Pushed::new(&read.scene, &spec)?;
        let renderer = Renderer::of_wall(&spec, simulation.lumen().wall(&NoStore)?)?;
        Ok(Self { read, view, renderer, pushed, before: None })
    }

    /// Bytes of a picture.
    fn bytes(&self) -> usize {
        let [width, height] = self.renderer.spec().size_px;
        let a_pixel = if self.view == View::Fluoro { 1 } else { 4 };
        width as usize * height as usize * a_pixel
    }

    /// Refuses simulations of other scenes, whose vessel and instruments it does not know.
    fn check_scene(&self, simulation: &EndowireSimulation) -> Result<(), Failure> {
        if Arc::ptr_eq(&self.read, &simulation.read) {
            return Ok(());
        }
        Err(Failure::input("renderer was made for another scene than this simulation's: make one for it"))
    }

    /// Draws the next picture.
    fn draw(&mut self, number: u64, simulation: &Simulation) -> Result<Image, Failure> {
        let frame: FrameTime = self.renderer.next_frame();
        let (shape, inserted_mm) = (simulation.shape(), simulation.report().lengths_mm());
        let displacement = simulation.displacement();
        if self.renderer.spec().injects_at_tip() {
            let tip_mm = self.pushed.tip_at_rest_mm(shape, &inserted_mm, displacement.as_ref());
            if let Some(tip_mm) = tip_mm {
                self.renderer.follow_tip(frame.time_s, tip_mm)?;
            }
        }
        let before = self.before.take().filter(|before| before.of == number);
        let moment = Moment {
            frame,
            shape,
            inserted_mm: &inserted_mm,
            coils: simulation.coils(),
            contacts: &[],
            displacement: displacement.as_ref(),
            before: before.as_ref().map(|before| Seen {
                shape: &before.shape,
                inserted_mm: &before.inserted_mm,
                time_s: before.time_s,
            }),
        };
        let frames = self.renderer.draw(&mut self.pushed, &moment)?;
        self.before = Some(Before { of: number, shape: shape.clone(), inserted_mm, time_s: frame.time_s });
        let image = if self.view == View::Fluoro { frames.fluoro } else { frames.three_d };
        image.ok_or_else(|| Failure::internal("the view was not drawn"))
    }

    /// Injects medium at the tip, from the next picture on.
    fn inject(&mut self, simulation: &Simulation, ml: f64, ml_per_s: f64) -> Result<(), Failure> {
        if self.view != View::Fluoro {
            return Err(Failure::input(
                "renderer draws the 3D view, which shows no medium: inject into fluoroscopy",
            ));
        }
        for (name, value) in [("ml", ml), ("ml_per_s", ml_per_s)] {
            if !(0.1..=100.0).contains(&value) {
                return Err(Error::parameter(name, value, "must be a number from 0.1 to 100").into());
            }
        }
        let (shape, inserted_mm) = (simulation.shape(), simulation.report().lengths_mm());
        let displacement = simulation.displacement();
        let Some(at_mm) = self.pushed.tip_at_rest_mm(shape, &inserted_mm, displacement.as_ref()) else {
            return Err(Failure::input("nothing with a lumen is in: medium comes through a catheter"));
        };
        let mut spec = self.renderer.spec().clone();
        spec.take_centreline(&self.read.scene, &NoStore)?;
        spec.injection.push(InjectionSpec {
            start_s: self.renderer.next_frame().time_s,
            duration_s: ml / ml_per_s,
            rate_ml_per_s: ml_per_s,
            at_mm: Some(at_mm.into()),
            at_tip: false,
        });
        Ok(self.renderer.change(&spec)?)
    }
}

/// Makes a renderer of one view.
///
/// # Safety
/// A handle or NULL, and NULL or a place for another.
unsafe fn made(
    simulation: *const EndowireSimulation,
    view: View,
    size_px: [u32; 2],
    out: *mut *mut EndowireRenderer,
) -> EndowireStatus {
    // SAFETY: what this function asks for.
    call(|| unsafe {
        make(out, || {
            let drawn = Drawn::new(handle("simulation", simulation)?, view, size_px)?;
            Ok(EndowireRenderer { inner: Mutex::new(drawn) })
        })
    })
}

/// Makes a renderer of the fluoroscopic view of a simulation's scene, with the keys of its `[view]` but for the size: each
/// side 1 to 4096 pixels. Pixels are one byte each, 0 is black. The first picture takes longer than the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_fluoroscopy_new(
    simulation: *const EndowireSimulation,
    width_px: u32,
    height_px: u32,
    out: *mut *mut EndowireRenderer,
) -> EndowireStatus {
    // SAFETY: the caller's promise, the same.
    unsafe { made(simulation, View::Fluoro, [width_px, height_px], out) }
}

/// As `endowire_fluoroscopy_new`, of the 3D view. Pixels are four bytes each: red, green, blue, alpha.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_view_3d_new(
    simulation: *const EndowireSimulation,
    width_px: u32,
    height_px: u32,
    out: *mut *mut EndowireRenderer,
) -> EndowireStatus {
    // SAFETY: the caller's promise, the same.
    unsafe { made(simulation, View::ThreeD, [width_px, height_px], out) }
}

/// Frees a renderer. NULL is nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_renderer_free(renderer: *mut EndowireRenderer) {
    // SAFETY: the caller's promise of a handle that is not used any more.
    unsafe { free(renderer) };
}

/// Draws the next picture of a simulation: of the one that the renderer was made for, or another of the same scene. Pixels
/// are row by row from the top left; a list (see the top) with a capacity in bytes, and nothing is drawn where only the
/// length is asked for. Pictures are 1 / `view.frames_per_s` apart in time, whatever the simulation's is.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_picture(
    renderer: *mut EndowireRenderer,
    simulation: *const EndowireSimulation,
    pixels: *mut u8,
    capacity: usize,
    count: *mut usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of two handles.
        let (renderer, simulation) =
            unsafe { (handle("renderer", renderer)?, handle("simulation", simulation)?) };
        let mut drawn = lock("renderer", &renderer.inner)?;
        drawn.check_scene(simulation)?;
        let room = Room { name: "pixels", out: pixels, capacity, count };
        // SAFETY: the caller's promise of a place for a count.
        if unsafe { room.wants(drawn.bytes()) }? {
            let image = drawn.draw(simulation.number, &*simulation.lock()?)?;
            // SAFETY: the same, and room for as many bytes as the capacity says.
            unsafe { room.take(image.data()) }?;
        }
        Ok(())
    })
}

/// Turns the C-arm of a fluoroscopic renderer: primary angle (LAO positive, -360 to 360 degrees) and secondary angle
/// (cranial positive, -90 to 90 degrees). The next picture is from there. After an error it stands where it stood.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_turn_c_arm(
    renderer: *mut EndowireRenderer,
    primary_deg: f64,
    secondary_deg: f64,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let renderer = unsafe { handle("renderer", renderer) }?;
        let mut drawn = lock("renderer", &renderer.inner)?;
        let now = drawn.renderer.spec().c_arm.clone();
        Ok(drawn.renderer.turn_c_arm(&CArmSpec { pose: None, primary_deg, secondary_deg, ..now })?)
    })
}

/// Injects contrast medium (370 mg iodine per ml), from the next fluoroscopic picture on, where the tip of the innermost
/// instrument with a lumen is now. `ml` and `ml_per_s` are 0.1 to 100.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_inject(
    renderer: *mut EndowireRenderer,
    simulation: *const EndowireSimulation,
    ml: f64,
    ml_per_s: f64,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of two handles.
        let (renderer, simulation) =
            unsafe { (handle("renderer", renderer)?, handle("simulation", simulation)?) };
        let mut drawn = lock("renderer", &renderer.inner)?;
        drawn.check_scene(simulation)?;
        drawn.inject(&*simulation.lock()?, ml, ml_per_s)
    })
}

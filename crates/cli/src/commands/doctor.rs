//! `endowire doctor`: what this machine provides, and what of it is used.

use std::path::PathBuf;

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;
use endowire_viewer::{Renderer, View, ViewSpec};
use serde::Serialize;

use crate::args::CacheArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::answer;
use crate::output::provenance::Provenance;

/// The findings.
#[derive(Serialize)]
struct Findings {
    #[serde(flatten)]
    provenance: Provenance,
    /// Backend that draws frames; if a graphics processor is not used, the reason.
    renderer: String,
    /// Display for windows; `None` without a display, or if the program was built without a window.
    display: Option<String>,
    /// Whether the program was built with a window.
    window: bool,
    /// Number of cores used by batches of simulations. One simulation uses one.
    threads: usize,
    /// Folder of the cache.
    cache: Option<PathBuf>,
}

/// Examines the machine.
pub(crate) fn doctor(json: bool) -> Result<(), Failure> {
    let findings = Findings {
        provenance: Provenance::of_program("doctor"),
        renderer: renderer()?,
        display: display().filter(|_| cfg!(feature = "window")),
        window: cfg!(feature = "window"),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        cache: Cache::new(&CacheArgs { no_cache: false }).folder().map(PathBuf::from),
    };
    answer(&findings, json, || text(&findings))
}

fn text(findings: &Findings) -> String {
    let display = match (&findings.display, findings.window) {
        (Some(display), _) => format!("{display}: endowire play opens a window"),
        (None, true) => {
            "none: endowire play needs --headless here; all other commands need no display".to_owned()
        }
        (None, false) => {
            "not used: built without the feature window: cargo build --release --features window".to_owned()
        }
    };
    let cache = findings.cache.as_ref().map_or_else(
        || "none: set ENDOWIRE_CACHE to a folder for walls that take long to make".to_owned(),
        |folder| folder.display().to_string(),
    );
    format!(
        "endowire {}\n  frames    {}\n  display   {display}\n  threads   {} for batches; a simulation takes one\n  walls     {cache}",
        env!("CARGO_PKG_VERSION"),
        findings.renderer,
        findings.threads
    )
}

/// Draws a small picture of both views; returns the name of the backend.
fn renderer() -> Result<String, Failure> {
    let wall = SurfaceMesh {
        vertices_mm: vec![Vec3::zeros(), Vec3::x() * 40.0, Vec3::y() * 40.0, Vec3::z() * 40.0],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    let views = vec![View::ThreeD, View::Fluoro];
    let spec = ViewSpec { views, size_px: [16, 16], ..ViewSpec::default() };
    Ok(Renderer::new(&spec, &wall)?.backend().to_owned())
}

#[cfg(all(unix, not(target_os = "macos")))]
fn display() -> Option<String> {
    let named = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let reported = |name: &str| named(name).map(|value| format!("{name}={}", value.to_string_lossy()));
    reported("WAYLAND_DISPLAY").or_else(|| reported("DISPLAY"))
}

#[cfg(not(all(unix, not(target_os = "macos"))))]
fn display() -> Option<String> {
    Some("the desktop".to_owned())
}

//! Scenes.

use std::ffi::c_char;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use endowire_methods::Scene;

use crate::border::{free, make, text};
use crate::status::{EndowireStatus, Failure, call};

/// A scene file: vessel, instruments, method, views. It never changes: all threads may use it at the same time.
pub struct EndowireScene(pub(crate) Arc<Read>);

/// A scene with the path that it was read from, to whose folder its paths are relative.
pub(crate) struct Read {
    pub(crate) scene: Scene,
    pub(crate) path: PathBuf,
}

impl Read {
    fn handed_out(scene: endowire_core::Result<Scene>, path: PathBuf) -> Result<EndowireScene, Failure> {
        Ok(EndowireScene(Arc::new(Self { scene: scene?, path })))
    }
}

/// Reads a scene file (TOML). `path` is UTF-8, as all texts here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_scene_read(
    path: *const c_char,
    out: *mut *mut EndowireScene,
) -> EndowireStatus {
    // SAFETY: the caller's promise of a text, and of a place for a handle.
    call(|| unsafe {
        make(out, || {
            let path = Path::new(text("path", path)?);
            Read::handed_out(Scene::read(path), path.to_owned())
        })
    })
}

/// Reads a scene from its text. Paths in it are relative to `folder`; NULL is the current folder.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_scene_from_text(
    toml: *const c_char,
    folder: *const c_char,
    out: *mut *mut EndowireScene,
) -> EndowireStatus {
    // SAFETY: the caller's promise of two texts, of which the second may be NULL, and of a place for a handle.
    call(|| unsafe {
        make(out, || {
            let toml = text("toml", toml)?;
            let folder = if folder.is_null() { "" } else { text("folder", folder)? };
            // Errors name it, and its folder is where files are looked for.
            let path = Path::new(folder).join("scene.toml");
            Read::handed_out(Scene::from_toml(toml, &path), path)
        })
    })
}

/// Frees a scene; its simulations stay. NULL is nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_scene_free(scene: *mut EndowireScene) {
    // SAFETY: the caller's promise of a handle that is not used any more.
    unsafe { free(scene) };
}

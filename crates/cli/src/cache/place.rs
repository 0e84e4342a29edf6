//! Location of the cache.

use std::env::var_os;
use std::ffi::OsString;
use std::path::PathBuf;

/// Variable that names the folder of the cache.
const VARIABLE: &str = "ENDOWIRE_CACHE";

/// `ENDOWIRE_CACHE`, or a folder with the program's name among the user's caches; `None` if neither is known.
pub(super) fn folder() -> Option<PathBuf> {
    chosen(|name| var_os(name)).map(|folder| folder.join("walls"))
}

fn chosen(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let path = |name: &str| variable(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    // A relative path is allowed only in this variable: a system-wide setting must not depend on where the program
    // was started.
    let absolute = |name: &str| path(name).filter(|path| path.is_absolute());
    path(VARIABLE).or_else(|| {
        let caches = if cfg!(windows) {
            absolute("LOCALAPPDATA")
        } else if cfg!(target_os = "macos") {
            absolute("HOME").map(|home| home.join("Library/Caches"))
        } else {
            absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache")))
        };
        caches.map(|caches| caches.join("endowire"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn among(variables: &[(&str, &str)]) -> Option<PathBuf> {
        chosen(|name| variables.iter().find(|(known, _)| *known == name).map(|(_, value)| value.into()))
    }

    #[test]
    fn what_the_user_names_goes_before_what_the_system_has() {
        assert_eq!(among(&[(VARIABLE, "mine"), ("HOME", "/home/me")]), Some("mine".into()));
        assert_eq!(among(&[]), None);
        assert_eq!(among(&[(VARIABLE, "")]), None);
    }

    #[cfg(all(unix, not(target_os = "macos")))]
    #[test]
    fn the_place_is_that_of_the_base_directories() {
        let home = ("HOME", "/home/me");
        assert_eq!(among(&[home]), Some("/home/me/.cache/endowire".into()));
        assert_eq!(among(&[home, ("XDG_CACHE_HOME", "/fast")]), Some("/fast/endowire".into()));
        assert_eq!(
            among(&[home, ("XDG_CACHE_HOME", "not/absolute")]),
            Some("/home/me/.cache/endowire".into())
        );
    }
}

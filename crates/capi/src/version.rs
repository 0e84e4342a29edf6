//! Versions.

use std::ffi::{CStr, c_char};

/// Version of this header. It grows when a function or a layout changes in a way that a compiled program would notice;
/// new functions, and new fields at the end of structures with a size, do not change it.
pub const ENDOWIRE_ABI_VERSION: u32 = 1;

/// The version, as C has it.
const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
    Ok(version) => version,
    Err(_) => c"",
};

/// `ENDOWIRE_ABI_VERSION` of the library that runs: compare it with that of the header before anything else.
#[unsafe(no_mangle)]
pub extern "C" fn endowire_abi_version() -> u32 {
    ENDOWIRE_ABI_VERSION
}

/// The version of endowire, such as "0.1.0". It lives as long as the program.
#[unsafe(no_mangle)]
pub extern "C" fn endowire_version() -> *const c_char {
    VERSION.as_ptr()
}

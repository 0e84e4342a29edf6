//! How calls end, and the text of what went wrong.

use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use endowire_core::Error;

/// How a call ended. Unless it is `OK`, nothing has changed but what a function says of itself, and `endowire_last_error`
/// has the reason.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndowireStatus {
    /// It is done.
    Ok = 0,
    /// The input is at fault: a file, a key, a value out of range, a handle that another thread uses. The text names it and
    /// the remedy.
    Input = 1,
    /// The input is valid, and no result was found.
    Computation = 2,
    /// The device can go no farther: the vessel is too narrow, or the tip has left it. Not a failure.
    End = 3,
    /// An argument is NULL that may not be.
    NullArgument = 4,
    /// A buffer has too little room for the result, or the `size` of a structure is too small.
    BufferTooSmall = 5,
    /// A fault of the library (a caught panic). What it happened in refuses all further calls: free it.
    Internal = 6,
}

/// Why a call did not do what it was asked for.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: EndowireStatus,
    pub(crate) text: String,
}

impl Failure {
    /// Input at fault.
    pub(crate) fn input(text: impl Into<String>) -> Self {
        Self { status: EndowireStatus::Input, text: text.into() }
    }

    /// An argument that may not be NULL.
    pub(crate) fn null(name: &str) -> Self {
        Self { status: EndowireStatus::NullArgument, text: format!("{name} is NULL") }
    }

    /// A buffer with room for less than is needed.
    pub(crate) fn too_small(name: &str, room: impl Into<u128>, needed: usize) -> Self {
        let text = format!("{name} = {}: {needed} are needed", room.into());
        Self { status: EndowireStatus::BufferTooSmall, text }
    }

    /// A fault of the library.
    pub(crate) fn internal(text: impl Into<String>) -> Self {
        Self { status: EndowireStatus::Internal, text: text.into() }
    }

    /// A panic that was caught.
    fn panicked(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("without a message");
        Self::internal(format!("a fault of endowire, please report it: {text}"))
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let status = match &error {
            Error::End(_) => EndowireStatus::End,
            error if error.is_input() => EndowireStatus::Input,
            _ => EndowireStatus::Computation,
        };
        Self { status, text: error.to_string() }
    }
}

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

/// Does `work`, and keeps the text of its failure for this thread. No panic leaves it.
pub(crate) fn call(work: impl FnOnce() -> Result<(), Failure>) -> EndowireStatus {
    // What a panic may leave half done is behind a lock, which is poisoned by it.
    let done = catch_unwind(AssertUnwindSafe(work));
    let Err(failure) = done.unwrap_or_else(|panic| Err(Failure::panicked(&*panic))) else {
        return EndowireStatus::Ok;
    };
    // C ends a text at its first zero.
    let text = CString::new(failure.text.replace('\0', "\u{fffd}")).unwrap_or_default();
    // A thread that is just ending has no place for it any more.
    let _ = LAST.try_with(|last| last.replace(text));
    failure.status
}

/// What went wrong in the last call of this thread that did not return `ENDOWIRE_STATUS_OK`, in one line of UTF-8; empty
/// before the first. It lives until the next such call of the same thread: copy it if you keep it.
#[unsafe(no_mangle)]
pub extern "C" fn endowire_last_error() -> *const c_char {
    LAST.try_with(|last| last.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

#[cfg(test)]
mod tests {
    use std::ffi::CStr;

    use super::*;

    /// The text of the last failure.
    fn last() -> String {
        // SAFETY: the text lives until the next failure of this thread, and is copied before.
        unsafe { CStr::from_ptr(endowire_last_error()) }.to_str().unwrap().to_owned()
    }

    #[test]
    fn a_panic_becomes_a_status_and_a_text() {
        assert_eq!(last(), "");
        let number = 3;
        assert_eq!(call(|| panic!("index {number}")), EndowireStatus::Internal);
        assert!(last().contains("please report it: index 3"), "{}", last());
        assert_eq!(call(|| panic!("plainly")), EndowireStatus::Internal);
        assert!(last().ends_with("plainly"), "{}", last());
        // What works leaves the text alone, as other threads do.
        assert_eq!(call(|| Ok(())), EndowireStatus::Ok);
        std::thread::spawn(|| assert_eq!(last(), "")).join().unwrap();
        assert!(last().ends_with("plainly"));
    }

    #[test]
    fn errors_have_their_status() {
        let status = |error: Error| call(|| Err(error.into()));
        assert_eq!(status(Error::parameter("a\0b", 1, "less")), EndowireStatus::Input);
        assert_eq!(last(), "a\u{fffd}b = 1: less");
        assert_eq!(status(Error::Mesh("open".into())), EndowireStatus::Input);
        assert_eq!(status(Error::Computation("none".into())), EndowireStatus::Computation);
        let end = endowire_core::PhysicalEnd::Left { opening: 1, beyond_mm: 30.0, limit_mm: 20.0 };
        assert_eq!(status(Error::End(end)), EndowireStatus::End);
    }
}

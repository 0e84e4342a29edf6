//! What callers give as addresses: texts, arrays, buffers, structures with a size, and handles.
//!
//! All functions here are unsafe for one reason: whether an address that is not NULL points to as much as it should cannot be
//! seen from here. Callers of the library promise it (the top of the header); everything else is checked.

use std::ffi::{CStr, c_char};
use std::mem::size_of;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, TryLockError};

use crate::status::Failure;

/// A structure that callers make room for, and which begins with its size in bytes (`u64`): fields may be added at its end.
pub(crate) trait Sized64: Copy {
    /// Its size in the first version of the interface: no program has less room.
    const FIRST_BYTES: usize;
}

/// A text that ends with a zero.
///
/// # Safety
/// `pointer` is NULL or points to a text that ends with a zero and does not change during `'a`.
pub(crate) unsafe fn text<'a>(name: &str, pointer: *const c_char) -> Result<&'a str, Failure> {
    if pointer.is_null() {
        return Err(Failure::null(name));
    }
    // SAFETY: it is not NULL, and the caller promises the rest.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| Failure::input(format!("{name} is not UTF-8: convert it")))
}

/// An array that is read; NULL only if it is empty.
///
/// # Safety
/// `pointer` is NULL or points to `count` elements that do not change during `'a`.
pub(crate) unsafe fn slice<'a, T: Copy>(
    name: &str,
    pointer: *const T,
    count: usize,
) -> Result<&'a [T], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() {
        return Err(Failure::null(name));
    }
    if !pointer.is_aligned() {
        return Err(Failure::input(format!("{name} is not aligned to {} bytes", align_of::<T>())));
    }
    if count > isize::MAX as usize / size_of::<T>() {
        return Err(Failure::input(format!("{name} = {count} elements: more than any memory holds")));
    }
    // SAFETY: not NULL, aligned, and no larger than memory; that so many elements are there, the caller promises.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// A caller's buffer for a list whose length it may not know: room for so many elements, and where to write how many there are.
pub(crate) struct Room<'a, T> {
    pub(crate) name: &'a str,
    pub(crate) out: *mut T,
    pub(crate) capacity: usize,
    pub(crate) count: *mut usize,
}

impl<T: Copy> Room<'_, T> {
    /// Tells the length, and whether the list is wanted too: not if the buffer is NULL with no room, the question for the
    /// length.
    ///
    /// # Safety
    /// `count` is NULL or may be written.
    pub(crate) unsafe fn wants(&self, length: usize) -> Result<bool, Failure> {
        if self.count.is_null() {
            return Err(Failure::null("count"));
        }
        // SAFETY: it is not NULL, and the caller promises that it may be written. Not all languages align it.
        unsafe { self.count.write_unaligned(length) };
        if self.out.is_null() {
            return if self.capacity == 0 { Ok(false) } else { Err(Failure::null(self.name)) };
        }
        if self.capacity < length {
            return Err(Failure::too_small("capacity", self.capacity as u64, length));
        }
        Ok(true)
    }

    /// Tells the length of `list`, and writes it if it is wanted.
    ///
    /// # Safety
    /// `count` is NULL or may be written, and `out` is NULL or has room for `capacity` elements.
    pub(crate) unsafe fn take(&self, list: &[T]) -> Result<(), Failure> {
        // SAFETY: of `count`, the caller's promise.
        if unsafe { self.wants(list.len()) }? {
            // SAFETY: there is room for as many as are in the list, which is ours and lies elsewhere; bytes need no alignment.
            unsafe {
                std::ptr::copy_nonoverlapping(
                    list.as_ptr().cast::<u8>(),
                    self.out.cast::<u8>(),
                    size_of_val(list),
                );
            }
        }
        Ok(())
    }
}

/// Fills a caller's structure as far as it has room, and writes into its size how much was filled.
///
/// # Safety
/// `out` is NULL or points to a size in bytes, and that many bytes from there may be written.
pub(crate) unsafe fn fill<T: Sized64>(name: &str, out: *mut T, value: &T) -> Result<(), Failure> {
    /// The size itself, which the structure begins with.
    const BEGIN: usize = size_of::<u64>();
    if out.is_null() {
        return Err(Failure::null(name));
    }
    // SAFETY: it points to a size, the caller promises.
    let size = unsafe { out.cast::<u64>().read_unaligned() };
    if size < T::FIRST_BYTES as u64 {
        return Err(Failure::too_small(&format!("{name}->size"), size, T::FIRST_BYTES));
    }
    let filled = size.min(size_of::<T>() as u64);
    let from = std::ptr::from_ref(value).cast::<u8>();
    // SAFETY: `filled` is no more than either structure has, and at least `FIRST_BYTES`, which is more than `BEGIN`; the value
    // is ours and lies elsewhere. Bytes need no alignment.
    unsafe {
        let out = out.cast::<u8>();
        std::ptr::copy_nonoverlapping(from.add(BEGIN), out.add(BEGIN), filled as usize - BEGIN);
        out.cast::<u64>().write_unaligned(filled);
    }
    Ok(())
}

/// What a handle stands for.
///
/// # Safety
/// `pointer` is NULL or was made by [`make`] and not freed, and is not freed during `'a`.
pub(crate) unsafe fn handle<'a, T>(name: &str, pointer: *const T) -> Result<&'a T, Failure> {
    // SAFETY: what `make` made is aligned and whole until it is freed; it is only ever read, changes are behind locks.
    unsafe { pointer.as_ref() }.ok_or_else(|| Failure::null(name))
}

/// Makes what a handle stands for, and hands it out; NULL after an error.
///
/// # Safety
/// `out` is NULL or may be written.
pub(crate) unsafe fn make<T>(
    out: *mut *mut T,
    value: impl FnOnce() -> Result<T, Failure>,
) -> Result<(), Failure> {
    if out.is_null() {
        return Err(Failure::null("out"));
    }
    // SAFETY: it is not NULL, and the caller promises that it may be written.
    unsafe { out.write_unaligned(std::ptr::null_mut()) };
    let made = Box::into_raw(Box::new(value()?));
    // SAFETY: as above.
    unsafe { out.write_unaligned(made) };
    Ok(())
}

/// Frees what a handle stands for; NULL is nothing.
///
/// # Safety
/// `pointer` is NULL or was made by [`make`] and not freed.
pub(crate) unsafe fn free<T>(pointer: *mut T) {
    if !pointer.is_null() {
        // SAFETY: it is the address of a box that nobody has freed, the caller promises.
        let owned = unsafe { Box::from_raw(pointer) };
        // A panic here cannot be reported to anybody, and nothing is left to be used.
        let _ = catch_unwind(AssertUnwindSafe(|| drop(owned)));
    }
}

/// Locks what one thread at a time may use, without waiting.
pub(crate) fn lock<'a, T>(name: &str, mutex: &'a Mutex<T>) -> Result<MutexGuard<'a, T>, Failure> {
    mutex.try_lock().map_err(|error| match error {
        TryLockError::WouldBlock => Failure::input(format!(
            "{name} is in use by another thread: use it in one at a time, or a clone in each"
        )),
        TryLockError::Poisoned(_) => {
            Failure::internal(format!("{name} was left half done by a fault of endowire: free it"))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::{EndowireStatus, call};

    #[repr(C)]
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Told {
        size: u64,
        first: f64,
        added: f64,
    }

    impl Sized64 for Told {
        const FIRST_BYTES: usize = 16;
    }

    #[test]
    fn structures_are_filled_as_far_as_they_have_room() {
        let value = Told { size: 0, first: 1.0, added: 2.0 };
        let filled = |size: u64| {
            let mut out = Told { size, first: -1.0, added: -1.0 };
            // SAFETY: `out` has more room than any size here that is accepted.
            let done = unsafe { fill("out", &raw mut out, &value) };
            (done.map_err(|failure| failure.status), out)
        };
        // A program of the first version, one of this, and one of the next.
        assert_eq!(filled(16), (Ok(()), Told { size: 16, first: 1.0, added: -1.0 }));
        assert_eq!(filled(24), (Ok(()), Told { size: 24, first: 1.0, added: 2.0 }));
        assert_eq!(filled(32), (Ok(()), Told { size: 24, first: 1.0, added: 2.0 }));
        for small in [0, 8, 15] {
            let untouched = Told { size: small, first: -1.0, added: -1.0 };
            assert_eq!(filled(small), (Err(EndowireStatus::BufferTooSmall), untouched));
        }
        // SAFETY: NULL is refused.
        let null = unsafe { fill("out", std::ptr::null_mut(), &value) };
        assert_eq!(null.unwrap_err().status, EndowireStatus::NullArgument);
    }

    #[test]
    fn arrays_that_cannot_be_are_refused() {
        let numbers = [1.0, 2.0, 3.0];
        let at = numbers.as_ptr();
        let taken = |at: *const f64, count: usize| {
            // SAFETY: all that is accepted here lies in `numbers`.
            unsafe { slice("numbers", at, count) }.map_err(|failure| failure.status)
        };
        assert_eq!(taken(at, 3), Ok(&numbers[..]));
        assert_eq!(taken(std::ptr::null(), 0), Ok(&[][..]));
        assert_eq!(taken(std::ptr::null(), 1), Err(EndowireStatus::NullArgument));
        assert_eq!(taken(at.cast::<u8>().wrapping_add(1).cast(), 1), Err(EndowireStatus::Input));
        assert_eq!(taken(at, usize::MAX / 4), Err(EndowireStatus::Input));
    }

    #[test]
    fn what_a_panic_has_left_half_done_is_refused_and_what_is_in_use_too() {
        let mutex = Mutex::new(1);
        let held = lock("it", &mutex).unwrap();
        assert_eq!(lock("it", &mutex).unwrap_err().status, EndowireStatus::Input);
        drop(held);
        assert!(lock("it", &mutex).is_ok());
        let panicked = call(|| {
            let _held = lock("it", &mutex)?;
            panic!("half done");
        });
        assert_eq!(panicked, EndowireStatus::Internal);
        assert_eq!(lock("it", &mutex).unwrap_err().status, EndowireStatus::Internal);
    }
}

//! The way from a function with a name of the C library to the test bed, or on to the C library.

use std::any::Any;
use std::io;
use std::os::fd::BorrowedFd;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicPtr, Ordering};

use cohaptic_descriptors::{Numbered, calls};
use libc::{c_int, c_void, ssize_t};

/// Result of a function that reports a failure by −1 and `errno`.
pub(crate) trait Failing {
    /// Value that stands for a failure.
    const FAILED: Self;
}

impl Failing for c_int {
    const FAILED: Self = -1;
}

impl Failing for ssize_t {
    const FAILED: Self = -1;
}

/// Serves a call of the system in the test bed of this thread. Returns `None` if the call is one for the system: outside of test beds, and if `serve` says so.
pub(crate) fn caught<T: Failing>(name: &str, serve: impl FnOnce() -> Option<io::Result<T>>) -> Option<T> {
    if !cohaptic_sockets::catches_calls() {
        return None;
    }
    guarded(name, serve)
}

/// Serves a call without asking for a test bed. Calls of the system within the call reach the system, and a panic becomes a fault of the run.
pub(crate) fn guarded<T: Failing>(name: &str, serve: impl FnOnce() -> Option<io::Result<T>>) -> Option<T> {
    let _outside = cohaptic_sockets::outside();
    // The state of the test bed is consistent after a panic: the run ends with the fault, and looks at nothing that the panic has left half done.
    let outcome = catch_unwind(AssertUnwindSafe(serve)).unwrap_or_else(|panic| Some(calls::refuse(name, &format!("which fails: {}", text(&*panic)))));
    Some(match outcome? {
        Ok(value) => value,
        Err(error) => {
            set_errno(number(&error));
            T::FAILED
        }
    })
}

/// Serves a call on a descriptor that stands for a socket of the test bed of this thread.
pub(crate) fn on<T: Failing>(name: &str, fd: c_int, serve: impl FnOnce(Numbered<'_>) -> Option<io::Result<T>>) -> Option<T> {
    caught(name, || with(fd, |of| if calls::is_virtual(of) { serve(of) } else { None }).flatten())
}

/// Calls `act` with a descriptor of a socket and its inode. Returns `None` for another descriptor, and on a thread without placeholders.
pub(crate) fn with<T>(fd: c_int, act: impl FnOnce(Numbered<'_>) -> T) -> Option<T> {
    if calls::is_any() { numbered(fd, act) } else { None }
}

/// Like [`with`], also on a thread without placeholders.
pub(crate) fn numbered<T>(fd: c_int, act: impl FnOnce(Numbered<'_>) -> T) -> Option<T> {
    if fd < 0 {
        return None;
    }
    let mut seen = std::mem::MaybeUninit::<libc::stat>::uninit();
    // SAFETY: `seen` is memory for one `stat`, and `fstat` writes there.
    if unsafe { libc::fstat(fd, seen.as_mut_ptr()) } != 0 {
        return None;
    }
    // SAFETY: `fstat` has succeeded, and has then filled the whole value.
    let seen = unsafe { seen.assume_init() };
    // Files of other kinds may have the number of a socket as well.
    if seen.st_mode & libc::S_IFMT != libc::S_IFSOCK {
        return None;
    }
    // SAFETY: `fstat` has found the descriptor open and −1 was excluded. The program must not close the descriptor during its own call on the descriptor, and
    // the borrow ends with `act`.
    let fd = unsafe { BorrowedFd::borrow_raw(fd) };
    Some(act(Numbered::new(fd, seen.st_ino)))
}

/// Returns the text of a panic.
fn text(panic: &(dyn Any + Send)) -> &str {
    panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without a text")
}

/// Returns the number of an error. Errors of the test bed itself have a kind and a text, and no number.
fn number(error: &io::Error) -> c_int {
    error.raw_os_error().unwrap_or(match error.kind() {
        io::ErrorKind::WouldBlock => libc::EAGAIN,
        io::ErrorKind::ConnectionAborted => libc::ECONNABORTED,
        io::ErrorKind::Unsupported => libc::EOPNOTSUPP,
        io::ErrorKind::InvalidInput => libc::EINVAL,
        io::ErrorKind::NotConnected => libc::ENOTCONN,
        io::ErrorKind::NetworkDown => libc::ENETDOWN,
        _ => libc::EIO,
    })
}

fn set_errno(number: c_int) {
    // SAFETY: `__errno_location` returns a valid pointer to the number of this thread.
    let place = unsafe { libc::__errno_location() };
    // SAFETY: the pointer is valid for writing as long as the thread lives, and nobody else uses it meanwhile.
    unsafe { place.write(number) };
}

/// Finds the function of the C library with the name of a function of this crate. `$kind` is the type of the function.
macro_rules! real {
    ($name:ident: $kind:ty) => {{
        static NEXT: std::sync::atomic::AtomicPtr<libc::c_void> = std::sync::atomic::AtomicPtr::new(std::ptr::null_mut());
        let found = $crate::caught::next(&NEXT, concat!(stringify!($name), "\0"));
        // SAFETY: the pointer is not null and is that of the C library's function of this name, whose type is `$kind` (its manual page).
        unsafe { std::mem::transmute::<*mut libc::c_void, $kind>(found) }
    }};
}
pub(crate) use real;

/// Returns the next definition of the function `name` after the definition of this program, and keeps the pointer in `place`. `name` ends with a zero.
pub(crate) fn next(place: &AtomicPtr<c_void>, name: &'static str) -> *mut c_void {
    let mut found = place.load(Ordering::Relaxed);
    if found.is_null() {
        // SAFETY: the text lives as long as the program and ends with a zero, which `real` appends, and `RTLD_NEXT` is a handle that `dlsym` takes.
        found = unsafe { libc::dlsym(libc::RTLD_NEXT, name.as_ptr().cast()) };
        if found.is_null() {
            // Without the function nothing can be done, and a panic must not leave a function of the C library.
            std::process::abort();
        }
        // Several threads may search at once, and all find the same function.
        place.store(found, Ordering::Relaxed);
    }
    found
}

//! Calls on descriptors: closing, duplicating, controlling, and waiting.

use std::io;

use cohaptic_descriptors::calls;
use libc::{c_int, c_ulong, nfds_t, pollfd};

use crate::caught::{caught, on, real, with};
use crate::messages::unread;

/// See `close(2)`. The last descriptor of a placeholder closes the socket of the test bed.
#[unsafe(no_mangle)]
extern "C" fn close(fd: c_int) -> c_int {
    // The entry goes before the descriptor, whose inode is not known afterwards. The system closes the descriptor in any case.
    let _: Option<c_int> = on("close", fd, |of| {
        calls::closed(of);
        None
    });
    real!(close: extern "C" fn(c_int) -> c_int)(fd)
}

/// Lets the system duplicate a descriptor, and counts the duplicate.
fn duplicate(fd: c_int, real: impl FnOnce() -> c_int) -> io::Result<c_int> {
    let made = real();
    if made < 0 {
        return Err(io::Error::last_os_error());
    }
    with(fd, calls::duplicated);
    Ok(made)
}

/// See `dup(2)`.
#[unsafe(no_mangle)]
extern "C" fn dup(fd: c_int) -> c_int {
    let real = || real!(dup: extern "C" fn(c_int) -> c_int)(fd);
    on("dup", fd, |_| Some(duplicate(fd, real))).unwrap_or_else(real)
}

/// Counts a duplicate that takes the place of another descriptor, and the descriptor that is gone.
fn duplicate_to(fd: c_int, to: c_int, real: impl Fn() -> c_int) -> c_int {
    let served = caught("dup2", || {
        // `dup2` of a descriptor to itself changes nothing.
        if fd == to || !calls::is_any() {
            return None;
        }
        // After the call the inode of `to` is another one. If the call fails, `to` stays open.
        let replaced = with(to, |to| duplicate(fd, &real).inspect(|_| calls::closed(to)));
        Some(replaced.unwrap_or_else(|| duplicate(fd, &real)))
    });
    served.unwrap_or_else(real)
}

/// See `dup2(2)`.
#[unsafe(no_mangle)]
extern "C" fn dup2(fd: c_int, to: c_int) -> c_int {
    duplicate_to(fd, to, || real!(dup2: extern "C" fn(c_int, c_int) -> c_int)(fd, to))
}

/// See `dup3(2)`.
#[unsafe(no_mangle)]
extern "C" fn dup3(fd: c_int, to: c_int, flags: c_int) -> c_int {
    duplicate_to(fd, to, || real!(dup3: extern "C" fn(c_int, c_int, c_int) -> c_int)(fd, to, flags))
}

/// See `fcntl(2)`. The third argument is one register on every architecture of Linux, whether or not the caller passes one: an `int`, or a pointer.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn fcntl(fd: c_int, command: c_int, argument: usize) -> c_int {
    // The function of the C library is variadic, and is called so.
    let real = || {
        let real = real!(fcntl: unsafe extern "C" fn(c_int, c_int, ...) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function, and the register has the caller's argument.
        unsafe { real(fd, command, argument) }
    };
    match command {
        libc::F_DUPFD | libc::F_DUPFD_CLOEXEC => on("fcntl", fd, |_| Some(duplicate(fd, real))).unwrap_or_else(real),
        // The placeholder has the flags.
        _ => real(),
    }
}

/// See `ioctl(2)`. For the third argument see [`fcntl`].
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn ioctl(fd: c_int, request: c_ulong, argument: usize) -> c_int {
    let served = on("ioctl", fd, |of| {
        if request != libc::FIONREAD {
            // The placeholder has the flag `FIONBIO`.
            return None;
        }
        let unread = unread(of)?.map(|count| c_int::try_from(count).unwrap_or(c_int::MAX));
        Some(unread.map(|count| {
            // SAFETY: the argument of `FIONREAD` is a pointer to an `int`, which the caller promises.
            unsafe { (argument as *mut c_int).write_unaligned(count) };
            0
        }))
    });
    served.unwrap_or_else(|| {
        let real = real!(ioctl: unsafe extern "C" fn(c_int, c_ulong, ...) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, request, argument) }
    })
}

/// Returns the events of a socket of a test bed for which the caller asks, as `poll` reports them, or `None` for another descriptor.
fn events(asked: &pollfd) -> Option<i16> {
    let ready = with(asked.fd, calls::ready)??.unwrap_or_default();
    let mut events = 0;
    if ready.readable || ready.read_closed {
        events |= libc::POLLIN | libc::POLLRDNORM;
    }
    if ready.writable {
        events |= libc::POLLOUT | libc::POLLWRNORM;
    }
    if ready.read_closed {
        events |= libc::POLLRDHUP;
    }
    events &= asked.events;
    // The end of both directions is reported without being asked for.
    Some(if ready.write_closed { events | libc::POLLHUP } else { events })
}

/// See `poll(2)`. With a socket of a test bed, a call that would wait is refused.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn poll(list: *mut pollfd, length: nfds_t, timeout: c_int) -> c_int {
    let real = real!(poll: unsafe extern "C" fn(*mut pollfd, nfds_t, c_int) -> c_int);
    let served = caught("poll", || {
        if list.is_null() || !calls::is_any() {
            return None;
        }
        let length = usize::try_from(length).ok()?;
        // SAFETY: the caller promises `length` values, which nobody else uses during the call.
        let list = unsafe { std::slice::from_raw_parts_mut(list, length) };
        let virtual_events: Vec<Option<i16>> = list.iter().map(events).collect();
        if virtual_events.iter().all(Option::is_none) {
            return None;
        }
        // The system is asked about all other descriptors, without waiting, and leaves out negative descriptors.
        let mut others: Vec<pollfd> = list.to_vec();
        for (other, events) in others.iter_mut().zip(&virtual_events) {
            if events.is_some() {
                other.fd = -1;
            }
        }
        // SAFETY: the list has as many values as are named.
        if unsafe { real(others.as_mut_ptr(), others.len() as nfds_t, 0) } < 0 {
            return Some(Err(io::Error::last_os_error()));
        }
        let mut count = 0;
        for ((asked, other), events) in list.iter_mut().zip(&others).zip(&virtual_events) {
            asked.revents = events.unwrap_or(other.revents);
            count += c_int::from(asked.revents != 0);
        }
        let what = "which would wait for a socket of the test bed, and virtual time cannot pass meanwhile: wait for the socket with tokio";
        Some(if count == 0 && timeout != 0 { calls::refuse("poll", what) } else { Ok(count) })
    });
    // SAFETY: the caller keeps the contract of the C library's function.
    served.unwrap_or_else(|| unsafe { real(list, length, timeout) })
}

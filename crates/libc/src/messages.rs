//! Calls that carry data with flags, addresses or control messages.

use std::io::{self, IoSlice, IoSliceMut};

use cohaptic_descriptors::Numbered;
use cohaptic_descriptors::calls::{self, Arrived};
use cohaptic_sockets::Sending;
use libc::{c_int, c_uint, c_void, mmsghdr, msghdr, size_t, sockaddr, socklen_t, ssize_t};

use crate::caught::{on, real};
use crate::control;
use crate::memory::{address, buffers, bytes, fail, return_address, room, rooms, write_address};

/// Converts a number of bytes. A buffer of Rust or C has at most `ssize_t::MAX` bytes.
pub(crate) fn count(outcome: io::Result<usize>) -> io::Result<ssize_t> {
    outcome.map(|count| ssize_t::try_from(count).unwrap_or(ssize_t::MAX))
}

/// Returns the number of bytes that a receiving call reports.
const fn reported(arrived: &Arrived, flags: c_int) -> usize {
    // With `MSG_TRUNC` a program asks for the length of the datagram.
    if flags & libc::MSG_TRUNC != 0 { arrived.length } else { arrived.count }
}

fn received(outcome: io::Result<Arrived>, flags: c_int) -> io::Result<ssize_t> {
    count(outcome.map(|arrived| reported(&arrived, flags)))
}

const fn dont_wait(flags: c_int) -> bool {
    flags & libc::MSG_DONTWAIT != 0
}

/// Receives, without messages about errors of the socket (`MSG_ERRQUEUE`), of which a test bed has none.
fn receive(of: Numbered<'_>, name: &str, into: &mut [IoSliceMut<'_>], flags: c_int) -> Option<io::Result<Arrived>> {
    if flags & libc::MSG_ERRQUEUE != 0 {
        return Some(fail(libc::EAGAIN));
    }
    calls::receive(of, name, into, flags & libc::MSG_PEEK != 0, dont_wait(flags))
}

/// See `send(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn send(fd: c_int, start: *const c_void, length: size_t, flags: c_int) -> ssize_t {
    let served = on("send", fd, |of| {
        // SAFETY: the caller promises the memory.
        let bytes = unsafe { bytes(start, length) };
        calls::send(of, "send", &[IoSlice::new(bytes)], Sending::default(), dont_wait(flags)).map(count)
    });
    served.unwrap_or_else(|| {
        let real = real!(send: unsafe extern "C" fn(c_int, *const c_void, size_t, c_int) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, start, length, flags) }
    })
}

/// See `sendto(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn sendto(fd: c_int, start: *const c_void, length: size_t, flags: c_int, to: *const sockaddr, to_length: socklen_t) -> ssize_t {
    let served = on("sendto", fd, |of| {
        let mut sending = Sending::default();
        if !to.is_null() {
            // SAFETY: the caller promises the address.
            match unsafe { address(to, to_length) } {
                Ok(to) => sending.to = Some(to),
                Err(error) => return Some(Err(error)),
            }
        }
        // SAFETY: the caller promises the memory.
        let bytes = unsafe { bytes(start, length) };
        calls::send(of, "sendto", &[IoSlice::new(bytes)], sending, dont_wait(flags)).map(count)
    });
    served.unwrap_or_else(|| {
        let real = real!(sendto: unsafe extern "C" fn(c_int, *const c_void, size_t, c_int, *const sockaddr, socklen_t) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, start, length, flags, to, to_length) }
    })
}

/// Sends one message.
///
/// # Safety
///
/// The pointers of `message` are valid as `sendmsg` asks for.
unsafe fn send_message(of: Numbered<'_>, name: &'static str, message: &msghdr, flags: c_int) -> Option<io::Result<usize>> {
    let prepare = || -> io::Result<_> {
        // SAFETY: the caller promises the control buffer.
        let mut sending = unsafe { control::read(message)? };
        if !message.msg_name.is_null() {
            // SAFETY: the caller promises the address.
            sending.to = Some(unsafe { address(message.msg_name.cast(), message.msg_namelen)? });
        }
        // SAFETY: the caller promises the buffers.
        Ok((sending, unsafe { buffers(message.msg_iov, message.msg_iovlen)? }))
    };
    match prepare() {
        Ok((sending, buffers)) => calls::send(of, name, &buffers, sending, dont_wait(flags)),
        Err(error) => Some(Err(error)),
    }
}

/// See `sendmsg(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn sendmsg(fd: c_int, message: *const msghdr, flags: c_int) -> ssize_t {
    // SAFETY: the caller promises a message, and its pointers.
    let served = on("sendmsg", fd, |of| unsafe { send_message(of, "sendmsg", message.as_ref()?, flags) }.map(count));
    served.unwrap_or_else(|| {
        let real = real!(sendmsg: unsafe extern "C" fn(c_int, *const msghdr, c_int) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, message, flags) }
    })
}

/// See `sendmmsg(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn sendmmsg(fd: c_int, messages: *mut mmsghdr, length: c_uint, flags: c_int) -> c_int {
    let served = on("sendmmsg", fd, |of| {
        let mut sent = 0;
        for index in 0..length.min(1024) as usize {
            // SAFETY: the caller promises `length` messages, and nobody else uses them.
            let message = unsafe { &mut *messages.add(index) };
            // SAFETY: the caller promises the pointers of the message.
            match unsafe { send_message(of, "sendmmsg", &message.msg_hdr, flags)? } {
                Ok(bytes) => message.msg_len = c_uint::try_from(bytes).unwrap_or(c_uint::MAX),
                Err(error) if sent == 0 => return Some(Err(error)),
                // The next call returns the error.
                Err(_) => break,
            }
            sent += 1;
        }
        Some(Ok(sent))
    });
    served.unwrap_or_else(|| {
        let real = real!(sendmmsg: unsafe extern "C" fn(c_int, *mut mmsghdr, c_uint, c_int) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, messages, length, flags) }
    })
}

/// See `recv(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn recv(fd: c_int, start: *mut c_void, length: size_t, flags: c_int) -> ssize_t {
    let served = on("recv", fd, |of| {
        // SAFETY: the caller promises the memory.
        let room = unsafe { room(start, length) };
        receive(of, "recv", &mut [IoSliceMut::new(room)], flags).map(|outcome| received(outcome, flags))
    });
    served.unwrap_or_else(|| {
        let real = real!(recv: unsafe extern "C" fn(c_int, *mut c_void, size_t, c_int) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, start, length, flags) }
    })
}

/// See `recvfrom(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn recvfrom(
    fd: c_int,
    start: *mut c_void,
    length: size_t,
    flags: c_int,
    from: *mut sockaddr,
    from_length: *mut socklen_t,
) -> ssize_t {
    let served = on("recvfrom", fd, |of| {
        // SAFETY: the caller promises the memory.
        let room = unsafe { room(start, length) };
        let outcome = receive(of, "recvfrom", &mut [IoSliceMut::new(room)], flags)?.and_then(|arrived| {
            // SAFETY: the caller promises the memory for the address.
            unsafe { return_address(arrived.from, from, from_length)? };
            Ok(arrived)
        });
        Some(received(outcome, flags))
    });
    served.unwrap_or_else(|| {
        let real = real!(recvfrom: unsafe extern "C" fn(c_int, *mut c_void, size_t, c_int, *mut sockaddr, *mut socklen_t) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, start, length, flags, from, from_length) }
    })
}

/// Receives one message.
///
/// # Safety
///
/// The pointers of `message` are valid as `recvmsg` asks for.
unsafe fn receive_message(of: Numbered<'_>, name: &str, message: &mut msghdr, flags: c_int) -> Option<io::Result<Arrived>> {
    // SAFETY: the caller promises the buffers.
    let outcome = match unsafe { rooms(message.msg_iov, message.msg_iovlen) } {
        Ok(mut rooms) => receive(of, name, &mut rooms, flags)?,
        Err(error) => Err(error),
    };
    Some(outcome.inspect(|arrived| {
        message.msg_flags = if arrived.length > arrived.count { libc::MSG_TRUNC } else { 0 };
        message.msg_namelen = match arrived.from {
            // SAFETY: the caller promises memory for the address.
            Some(from) if !message.msg_name.is_null() => unsafe { write_address(from, message.msg_name, message.msg_namelen) },
            _ => 0,
        };
        // SAFETY: the caller promises the control buffer.
        unsafe { control::write(of, arrived, message) };
    }))
}

/// See `recvmsg(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn recvmsg(fd: c_int, message: *mut msghdr, flags: c_int) -> ssize_t {
    let served = on("recvmsg", fd, |of| {
        // SAFETY: the caller promises a message, and its pointers.
        unsafe { receive_message(of, "recvmsg", message.as_mut()?, flags) }.map(|outcome| received(outcome, flags))
    });
    served.unwrap_or_else(|| {
        let real = real!(recvmsg: unsafe extern "C" fn(c_int, *mut msghdr, c_int) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, message, flags) }
    })
}

/// See `recvmmsg(2)`. The call never waits for more than the first message, so that the timeout has no effect.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn recvmmsg(fd: c_int, messages: *mut mmsghdr, length: c_uint, flags: c_int, timeout: *mut libc::timespec) -> c_int {
    let served = on("recvmmsg", fd, |of| {
        let mut arrived = 0;
        for index in 0..length.min(1024) as usize {
            // The error of an empty socket, or of a refused datagram, stays for the next call.
            if arrived > 0 && !calls::ready(of).is_some_and(|ready| ready.is_ok_and(|ready| ready.readable)) {
                break;
            }
            // SAFETY: the caller promises `length` messages, and nobody else uses them.
            let message = unsafe { &mut *messages.add(index) };
            // SAFETY: the caller promises the pointers of the message.
            match unsafe { receive_message(of, "recvmmsg", &mut message.msg_hdr, flags)? } {
                Ok(one) => message.msg_len = c_uint::try_from(reported(&one, flags)).unwrap_or(c_uint::MAX),
                Err(error) if arrived == 0 => return Some(Err(error)),
                Err(_) => break,
            }
            arrived += 1;
        }
        Some(Ok(arrived))
    });
    served.unwrap_or_else(|| {
        let real = real!(recvmmsg: unsafe extern "C" fn(c_int, *mut mmsghdr, c_uint, c_int, *mut libc::timespec) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, messages, length, flags, timeout) }
    })
}

/// See `sendfile(2)`. Refused for a socket of a test bed by the error after which programs read and write by themselves, as `std::io::copy` does.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn sendfile64(to: c_int, from: c_int, offset: *mut libc::off64_t, length: size_t) -> ssize_t {
    let served = on("sendfile64", to, |_| Some(fail(libc::EINVAL)));
    served.unwrap_or_else(|| {
        let real = real!(sendfile64: unsafe extern "C" fn(c_int, c_int, *mut libc::off64_t, size_t) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(to, from, offset, length) }
    })
}

/// See `splice(2)`. Refused for a socket of a test bed as [`sendfile64`] is.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn splice(
    from: c_int,
    from_offset: *mut libc::loff_t,
    to: c_int,
    to_offset: *mut libc::loff_t,
    length: size_t,
    flags: c_uint,
) -> ssize_t {
    let refused = |fd| on("splice", fd, |_| Some(fail(libc::EINVAL)));
    refused(from).or_else(|| refused(to)).unwrap_or_else(|| {
        let real = real!(splice: unsafe extern "C" fn(c_int, *mut libc::loff_t, c_int, *mut libc::loff_t, size_t, c_uint) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(from, from_offset, to, to_offset, length, flags) }
    })
}

/// See `read(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn read(fd: c_int, start: *mut c_void, length: size_t) -> ssize_t {
    let served = on("read", fd, |of| {
        // SAFETY: the caller promises the memory.
        let room = unsafe { room(start, length) };
        receive(of, "read", &mut [IoSliceMut::new(room)], 0).map(|outcome| received(outcome, 0))
    });
    served.unwrap_or_else(|| {
        let real = real!(read: unsafe extern "C" fn(c_int, *mut c_void, size_t) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, start, length) }
    })
}

/// See `readv(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn readv(fd: c_int, list: *const libc::iovec, length: c_int) -> ssize_t {
    let served = on("readv", fd, |of| {
        let Ok(length) = usize::try_from(length) else { return Some(fail(libc::EINVAL)) };
        // SAFETY: the caller promises the buffers.
        match unsafe { rooms(list, length) } {
            Ok(mut rooms) => receive(of, "readv", &mut rooms, 0).map(|outcome| received(outcome, 0)),
            Err(error) => Some(Err(error)),
        }
    });
    served.unwrap_or_else(|| {
        let real = real!(readv: unsafe extern "C" fn(c_int, *const libc::iovec, c_int) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, list, length) }
    })
}

/// See `write(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn write(fd: c_int, start: *const c_void, length: size_t) -> ssize_t {
    let served = on("write", fd, |of| {
        // SAFETY: the caller promises the memory.
        let bytes = unsafe { bytes(start, length) };
        calls::send(of, "write", &[IoSlice::new(bytes)], Sending::default(), false).map(count)
    });
    served.unwrap_or_else(|| {
        let real = real!(write: unsafe extern "C" fn(c_int, *const c_void, size_t) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, start, length) }
    })
}

/// See `writev(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn writev(fd: c_int, list: *const libc::iovec, length: c_int) -> ssize_t {
    let served = on("writev", fd, |of| {
        let Ok(length) = usize::try_from(length) else { return Some(fail(libc::EINVAL)) };
        // SAFETY: the caller promises the buffers.
        match unsafe { buffers(list, length) } {
            Ok(buffers) => calls::send(of, "writev", &buffers, Sending::default(), false).map(count),
            Err(error) => Some(Err(error)),
        }
    });
    served.unwrap_or_else(|| {
        let real = real!(writev: unsafe extern "C" fn(c_int, *const libc::iovec, c_int) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, list, length) }
    })
}

/// Returns the number of bytes that can be read now: of the next datagram, or of the stream up to 64 KiB.
pub(crate) fn unread(of: Numbered<'_>) -> Option<io::Result<usize>> {
    let mut room = vec![0; 1 << 16];
    let peeked = calls::receive(of, "ioctl", &mut [IoSliceMut::new(&mut room)], true, true)?;
    Some(match peeked {
        Ok(arrived) => Ok(arrived.length),
        Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(0),
        Err(error) => Err(error),
    })
}

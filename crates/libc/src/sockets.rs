//! `socket` and the calls on sockets that carry no data.

use std::io;
use std::net::Shutdown;
use std::os::fd::IntoRawFd;

use cohaptic_descriptors::calls;
use cohaptic_sockets::Version;
use libc::{c_int, sockaddr, socklen_t};
use socket2::Type;

use crate::caught::{caught, guarded, numbered, on, real, with};
use crate::memory::{address, fail, return_address};

/// Returns the kind of a socket for TCP or UDP, or `None` for other protocols, such as ICMP.
const fn kind(type_: c_int, protocol: c_int) -> Option<Type> {
    match (type_ & !(libc::SOCK_NONBLOCK | libc::SOCK_CLOEXEC), protocol) {
        (libc::SOCK_STREAM, 0 | libc::IPPROTO_TCP | libc::IPPROTO_MPTCP) => Some(Type::STREAM),
        (libc::SOCK_DGRAM, 0 | libc::IPPROTO_UDP) => Some(Type::DGRAM),
        _ => None,
    }
}

/// See `socket(2)`. A socket for TCP or UDP is a placeholder. A socket of IP for another protocol is refused, and on a thread for the blocking work of a host
/// every socket of IP: the socket would reach the network of the system.
#[unsafe(no_mangle)]
extern "C" fn socket(domain: c_int, type_: c_int, protocol: c_int) -> c_int {
    let real = || real!(socket: extern "C" fn(c_int, c_int, c_int) -> c_int)(domain, type_, protocol);
    let version = match domain {
        libc::AF_INET => Version::Four,
        libc::AF_INET6 => Version::Six,
        _ => return real(),
    };
    let made = caught("socket", || {
        let Some(kind) = kind(type_, protocol) else { return Some(fail(libc::EPROTONOSUPPORT)) };
        let fd = real();
        if fd < 0 {
            return Some(Err(io::Error::last_os_error()));
        }
        // The table may be empty, so that `with` cannot be asked.
        numbered(fd, |new| calls::made(new, kind, version));
        Some(Ok(fd))
    });
    made.unwrap_or_else(|| {
        if cohaptic_sockets::is_in_bed() || cohaptic_sockets::host().is_none() {
            return real();
        }
        let what = "on a thread for blocking work: the sockets of a test bed belong to the thread that runs it. Make the socket in a task";
        guarded("socket", || Some(calls::refuse("socket", what))).unwrap_or(-1)
    })
}

/// See `bind(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn bind(fd: c_int, at: *const sockaddr, length: socklen_t) -> c_int {
    let served = on("bind", fd, |of| {
        // SAFETY: the caller promises the address.
        let at = match unsafe { address(at, length) } {
            Ok(at) => at,
            Err(error) => return Some(Err(error)),
        };
        calls::bind(of, at).map(|bound| bound.map(|()| 0))
    });
    served.unwrap_or_else(|| {
        let real = real!(bind: unsafe extern "C" fn(c_int, *const sockaddr, socklen_t) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, at, length) }
    })
}

/// See `listen(2)`.
#[unsafe(no_mangle)]
extern "C" fn listen(fd: c_int, backlog: c_int) -> c_int {
    let served = on("listen", fd, |of| calls::listen(of, backlog).map(|listening| listening.map(|()| 0)));
    served.unwrap_or_else(|| real!(listen: extern "C" fn(c_int, c_int) -> c_int)(fd, backlog))
}

/// See `connect(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn connect(fd: c_int, to: *const sockaddr, length: socklen_t) -> c_int {
    let served = on("connect", fd, |of| {
        // SAFETY: the caller promises the address.
        let to = match unsafe { address(to, length) } {
            Ok(to) => to,
            Err(error) => return Some(Err(error)),
        };
        calls::connect(of, to).map(|connected| connected.map(|()| 0))
    });
    served.unwrap_or_else(|| {
        let real = real!(connect: unsafe extern "C" fn(c_int, *const sockaddr, socklen_t) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, to, length) }
    })
}

/// Accepts a connection of a listener of the test bed.
///
/// # Safety
///
/// As [`return_address`].
unsafe fn accept_here(fd: c_int, from: *mut sockaddr, length: *mut socklen_t, flags: c_int) -> Option<c_int> {
    on("accept", fd, |of| {
        let accepted = calls::accept(of)?.and_then(|(stream, peer)| {
            // SAFETY: the caller promises the memory.
            unsafe { return_address(Some(peer), from, length)? };
            let stream = socket2::Socket::from(stream);
            stream.set_nonblocking(flags & libc::SOCK_NONBLOCK != 0)?;
            stream.set_cloexec(flags & libc::SOCK_CLOEXEC != 0)?;
            Ok(stream.into_raw_fd())
        });
        Some(accepted)
    })
}

/// See `accept(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn accept(fd: c_int, from: *mut sockaddr, length: *mut socklen_t) -> c_int {
    // SAFETY: the caller promises the memory.
    let served = unsafe { accept_here(fd, from, length, 0) };
    served.unwrap_or_else(|| {
        let real = real!(accept: unsafe extern "C" fn(c_int, *mut sockaddr, *mut socklen_t) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, from, length) }
    })
}

/// See `accept4(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn accept4(fd: c_int, from: *mut sockaddr, length: *mut socklen_t, flags: c_int) -> c_int {
    // SAFETY: the caller promises the memory.
    let served = unsafe { accept_here(fd, from, length, flags) };
    served.unwrap_or_else(|| {
        let real = real!(accept4: unsafe extern "C" fn(c_int, *mut sockaddr, *mut socklen_t, c_int) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, from, length, flags) }
    })
}

/// See `getsockname(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn getsockname(fd: c_int, to: *mut sockaddr, length: *mut socklen_t) -> c_int {
    let served = on("getsockname", fd, |of| {
        // SAFETY: the caller promises the memory.
        Some(calls::local(of)?.and_then(|local| unsafe { return_address(Some(local), to, length) }).map(|()| 0))
    });
    served.unwrap_or_else(|| {
        let real = real!(getsockname: unsafe extern "C" fn(c_int, *mut sockaddr, *mut socklen_t) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, to, length) }
    })
}

/// See `getpeername(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn getpeername(fd: c_int, to: *mut sockaddr, length: *mut socklen_t) -> c_int {
    let served = on("getpeername", fd, |of| {
        // SAFETY: the caller promises the memory.
        Some(calls::peer(of)?.and_then(|peer| unsafe { return_address(Some(peer), to, length) }).map(|()| 0))
    });
    served.unwrap_or_else(|| {
        let real = real!(getpeername: unsafe extern "C" fn(c_int, *mut sockaddr, *mut socklen_t) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, to, length) }
    })
}

/// See `shutdown(2)`.
#[unsafe(no_mangle)]
extern "C" fn shutdown(fd: c_int, how: c_int) -> c_int {
    let served = on("shutdown", fd, |of| {
        let how = match how {
            libc::SHUT_RD => Shutdown::Read,
            libc::SHUT_WR => Shutdown::Write,
            libc::SHUT_RDWR => Shutdown::Both,
            _ => return Some(fail(libc::EINVAL)),
        };
        calls::shut_down(of, how).map(|shut| shut.map(|()| 0))
    });
    served.unwrap_or_else(|| real!(shutdown: extern "C" fn(c_int, c_int) -> c_int)(fd, how))
}

/// See `epoll_ctl(2)`. A socket of a test bed is refused, because the system learns of none of its events.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn epoll_ctl(poll: c_int, operation: c_int, fd: c_int, event: *mut libc::epoll_event) -> c_int {
    let refused = caught("epoll_ctl", || {
        let is_virtual = with(fd, calls::is_virtual) == Some(true);
        let what = "for a socket of the test bed, of whose events the system knows nothing: wait for the socket with tokio";
        (operation == libc::EPOLL_CTL_ADD && is_virtual).then(|| calls::refuse("epoll_ctl", what))
    });
    refused.unwrap_or_else(|| {
        let real = real!(epoll_ctl: unsafe extern "C" fn(c_int, c_int, c_int, *mut libc::epoll_event) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(poll, operation, fd, event) }
    })
}

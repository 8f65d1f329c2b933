//! Placeholders for sockets of a test bed, and the way from a placeholder back to its socket.

use std::io;
use std::ops::Deref;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use cohaptic_sockets::{Configured, Setting, Socket, Version, outside};
use socket2::{Domain, SockRef, Type};

use crate::options::{read, set_changed, write};
use crate::table::{self, Kept, Kind, Numbered, Virtual};

/// A placeholder.
#[derive(Debug)]
pub struct Placeholder {
    real: socket2::Socket,
    /// Options of `real` at the last takeover.
    before: Mutex<Vec<Setting>>,
    /// `true` if the program has asked for the descriptor since `before` was read.
    is_shown: AtomicBool,
}

impl Placeholder {
    /// Makes a placeholder for `socket`, with its options.
    ///
    /// # Errors
    ///
    /// If the system gives no socket, or `socket` does not work any more.
    pub fn new(kind: Type, socket: &(impl Configured + ?Sized)) -> io::Result<Self> {
        let _outside = outside();
        let real = fresh(kind, socket.version())?;
        for setting in socket.settings()? {
            write(&SockRef::from(&real), setting)?;
        }
        let before = Mutex::new(read(&SockRef::from(&real)));
        Ok(Self { real, before, is_shown: AtomicBool::new(false) })
    }

    /// Returns the descriptor for the program.
    pub fn shown(&self) -> BorrowedFd<'_> {
        self.is_shown.store(true, Ordering::Relaxed);
        self.real.as_fd()
    }

    /// Sets the options on `socket` that were set on the placeholder since the last call.
    pub fn take_over(&self, socket: &(impl Configured + ?Sized)) {
        // Reading all options takes a dozen calls of the system, and without a descriptor the program cannot have set any.
        if self.is_shown.swap(false, Ordering::Relaxed) {
            let now = read(&SockRef::from(&self.real));
            let before = std::mem::replace(&mut *self.before.lock().unwrap_or_else(PoisonError::into_inner), now.clone());
            // A socket of a crashed host takes no options, and the next call returns the error.
            let _ = set_changed(socket, &before, now);
        }
    }

    fn before(&self) -> Vec<Setting> {
        self.before.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Pointer to a socket of a test bed.
pub trait Pointer: Deref + Sized + 'static {
    /// Lets descriptors of `placeholder` find the socket.
    ///
    /// # Errors
    ///
    /// If the system does not know the descriptor.
    fn share(&self, placeholder: &Placeholder) -> io::Result<()>;

    /// Returns the socket for the table.
    fn into_virtual(self) -> Virtual;
}

impl<T: Kind + ?Sized> Pointer for Arc<T> {
    fn share(&self, placeholder: &Placeholder) -> io::Result<()> {
        table::insert(Numbered::of(placeholder.real.as_fd())?, T::shared(self), placeholder.before());
        Ok(())
    }

    fn into_virtual(self) -> Virtual {
        T::owned(self)
    }
}

impl Pointer for Box<dyn Socket> {
    fn share(&self, _: &Placeholder) -> io::Result<()> {
        // A socket before `listen` and `connect` has one owner.
        Ok(())
    }

    fn into_virtual(self) -> Virtual {
        Virtual::Socket(self)
    }
}

/// Keeps `socket` until the returned placeholder comes back, or is closed.
///
/// # Errors
///
/// If the system does not know the descriptor.
pub fn keep(placeholder: Placeholder, socket: impl Pointer) -> io::Result<OwnedFd> {
    table::insert(Numbered::of(placeholder.real.as_fd())?, socket.into_virtual(), placeholder.before());
    Ok(placeholder.real.into())
}

/// Returns the socket of a test bed for which the socket `real` stands, with the options that were set meanwhile, and `real` as its placeholder. Returns `None` if
/// `real` is no placeholder.
///
/// The placeholder stays the same, because a program may have set options that only the placeholder knows, such as those that ask for control messages.
///
/// # Errors
///
/// If the system does not know the descriptor, or the socket cannot take the options.
///
/// # Panics
///
/// If the socket would block, as the real tokio does.
#[track_caller]
pub fn find<T: Kind + ?Sized>(real: OwnedFd) -> io::Result<Option<(Arc<T>, Placeholder)>> {
    let of = Numbered::of(real.as_fd())?;
    let Some((found, before)) = table::with(of, |kept| T::of(&kept.socket).map(|found| (found, kept.before.clone()))).flatten() else {
        return Ok(None);
    };
    refuse_blocking(real.as_fd());
    let now = read(&SockRef::from(&real));
    set_changed(&*found, &before, now.clone())?;
    // From now on the caller owns the socket. Duplicates of the descriptor stand for the same socket. Only `cohaptic-libc` sees duplicates being made, and then
    // counts more than one descriptor.
    let left = table::with(of, |kept| {
        kept.before.clone_from(&now);
        (kept.descriptors <= 1).then(|| std::mem::replace(&mut kept.socket, T::shared(&found)))
    });
    drop(left);
    Ok(Some((found, Placeholder { real: real.into(), before: Mutex::new(now), is_shown: AtomicBool::new(false) })))
}

/// Like [`find`], for sockets with a single owner.
///
/// # Errors
///
/// As [`find`].
pub fn take(real: BorrowedFd<'_>) -> io::Result<Option<Box<dyn Socket>>> {
    let of = Numbered::of(real)?;
    // An entry of another kind of socket stays, for a conversion to that kind.
    let Some(Kept { socket: Virtual::Socket(socket), before, .. }) = table::remove_if(of, |socket| matches!(socket, Virtual::Socket(_))) else {
        return Ok(None);
    };
    set_changed(&*socket, &before, read(&SockRef::from(&real)))?;
    Ok(Some(socket))
}

/// Returns whether a real socket of TCP is neither bound nor connected, and its version of IP.
#[must_use]
pub fn unbound(real: BorrowedFd<'_>) -> Option<Version> {
    let _outside = outside();
    let socket = SockRef::from(&real);
    let local = socket.local_addr().ok()?.as_socket()?;
    let version = if local.is_ipv6() { Version::Six } else { Version::Four };
    (local.port() == 0 && local.ip().is_unspecified() && socket.peer_addr().is_err()).then_some(version)
}

/// Sets the options of `socket` in which the real socket of this kind differs from a new socket.
///
/// # Errors
///
/// If the system gives no new socket, or `socket` cannot take the options.
pub fn set_all(kind: Type, socket: &(impl Configured + ?Sized), real: BorrowedFd<'_>) -> io::Result<()> {
    let _outside = outside();
    let fresh = fresh(kind, socket.version())?;
    set_changed(socket, &read(&SockRef::from(&fresh)), read(&SockRef::from(&real)))
}

fn fresh(kind: Type, version: Version) -> io::Result<socket2::Socket> {
    let domain = match version {
        Version::Four => Domain::IPV4,
        Version::Six => Domain::IPV6,
    };
    let real = socket2::Socket::new(domain, kind, None)?;
    // The sockets of tokio do not block either.
    real.set_nonblocking(true)?;
    Ok(real)
}

/// Refuses a blocking socket, like the real tokio.
#[track_caller]
#[expect(clippy::panic, reason = "as tokio's")]
fn refuse_blocking(real: BorrowedFd<'_>) {
    if cfg!(debug_assertions) && SockRef::from(&real).nonblocking().is_ok_and(|is_nonblocking| !is_nonblocking) {
        panic!("Registering a blocking socket with the tokio runtime is unsupported: call `set_nonblocking(true)` before `from_std`");
    }
}

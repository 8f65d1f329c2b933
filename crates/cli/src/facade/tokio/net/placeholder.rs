//! Placeholders: real sockets, neither bound nor connected, that stand for sockets of a test bed where a program asks for a descriptor.
//!
//! A program sets options on a placeholder, as on any socket, and the socket of the test bed takes the options over. A placeholder that comes back to tokio by
//! `from_std` becomes the socket of the test bed again. The inode identifies a placeholder, because duplicates of a descriptor have the same inode.

use std::any::Any;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::ops::Deref;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::fs::MetadataExt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use cohaptic_sockets::{Bed, Configured, KeepaliveTimes, Setting, Version};
use socket2::{Domain, SockRef, Socket, Type};

thread_local! {
    /// Sockets of test beds that ran on this thread, by the inode of the placeholder.
    static KEPT: RefCell<BTreeMap<u64, Kept>> = const { RefCell::new(BTreeMap::new()) };
}

/// Socket of a test bed for which a placeholder stands.
struct Kept {
    bed: Weak<dyn Bed>,
    /// A pointer to the socket if the placeholder is the only owner, or else a weak pointer.
    socket: Box<dyn Any>,
    /// Options of the placeholder when they were last taken over.
    before: Vec<Setting>,
}

/// A placeholder.
pub(crate) struct Placeholder {
    real: Socket,
    /// Options of `real` when they were last taken over.
    before: Mutex<Vec<Setting>>,
    /// `true` if the program has asked for the descriptor since `before` was read.
    is_shown: AtomicBool,
}

impl Placeholder {
    /// Makes a placeholder for `socket`, with its options.
    pub(super) fn new(kind: Type, socket: &(impl Configured + ?Sized)) -> io::Result<Self> {
        let real = fresh(kind, socket.version())?;
        for setting in socket.settings()? {
            write(&SockRef::from(&real), setting)?;
        }
        let before = Mutex::new(read(&SockRef::from(&real)));
        Ok(Self { real, before, is_shown: AtomicBool::new(false) })
    }

    /// Returns the descriptor for the program.
    pub(super) fn shown(&self) -> BorrowedFd<'_> {
        self.is_shown.store(true, Ordering::Relaxed);
        self.real.as_fd()
    }

    /// Sets the options on `socket` that the program has set on the placeholder since the last call.
    pub(super) fn take_over(&self, socket: &(impl Configured + ?Sized)) {
        // Reading all options takes a dozen calls of the system, and without a descriptor the program cannot have set any.
        if self.is_shown.swap(false, Ordering::Relaxed) {
            let now = read(&SockRef::from(&self.real));
            let before = std::mem::replace(&mut *self.before.lock().unwrap_or_else(PoisonError::into_inner), now.clone());
            // A socket of a crashed host takes no options, and the next call returns the error.
            let _ = set_changed(socket, &before, now);
        }
    }
}

/// Pointer to a socket of a test bed.
pub(crate) trait Pointer: Deref + Sized + 'static {
    /// Lets duplicates of the descriptor of `placeholder` find the socket.
    fn share(&self, placeholder: &Placeholder) -> io::Result<()>;
}

impl<T: ?Sized + 'static> Pointer for Arc<T> {
    fn share(&self, placeholder: &Placeholder) -> io::Result<()> {
        let before = placeholder.before.lock().unwrap_or_else(PoisonError::into_inner).clone();
        insert(placeholder.real.as_fd(), Box::new(Arc::downgrade(self)), before)
    }
}

impl<T: ?Sized + 'static> Pointer for Box<T> {
    fn share(&self, _: &Placeholder) -> io::Result<()> {
        // A socket that neither listens nor is connected has one owner.
        Ok(())
    }
}

/// Keeps `socket` until the returned placeholder comes back.
pub(super) fn keep<P: Pointer>(placeholder: Placeholder, socket: P) -> io::Result<OwnedFd> {
    let before = placeholder.before.into_inner().unwrap_or_else(PoisonError::into_inner);
    insert(placeholder.real.as_fd(), Box::new(socket), before)?;
    Ok(placeholder.real.into())
}

fn insert(fd: BorrowedFd<'_>, socket: Box<dyn Any>, before: Vec<Setting>) -> io::Result<()> {
    let (inode, bed) = (inode(fd)?, super::bed()?);
    // After the end of the test bed no placeholder can come back.
    let Some(bed) = bed else { return Ok(()) };
    let kept = Kept { bed: Arc::downgrade(&bed), socket, before };
    let gone: Vec<Kept> = KEPT.with_borrow_mut(|all| {
        // Sockets of ended test beds are removed whenever the list grows, so that the list does not grow from run to run.
        let old: Vec<u64> = all.iter().filter(|(_, kept)| kept.bed.strong_count() == 0).map(|(inode, _)| *inode).collect();
        let mut gone: Vec<Kept> = old.iter().filter_map(|inode| all.remove(inode)).collect();
        gone.extend(all.insert(inode, kept));
        gone
    });
    // Sockets are dropped after the borrow has ended, because their destructors are foreign.
    drop(gone);
    Ok(())
}

/// Returns the socket of a test bed for which the socket `real` stands, with the options that were set meanwhile, or `None` if `real` is no placeholder.
pub(super) fn find<T: Configured + ?Sized + 'static>(real: BorrowedFd<'_>) -> io::Result<Option<Arc<T>>> {
    let inode = inode(real)?;
    let Some(Kept { bed, socket, before }) = KEPT.with_borrow_mut(|all| all.remove(&inode)) else { return Ok(None) };
    let found: Option<Arc<T>> = match socket.downcast::<Arc<T>>() {
        Ok(socket) => Some(*socket),
        Err(socket) => socket.downcast::<Weak<T>>().ok().and_then(|socket| socket.upgrade()),
    };
    let Some(found) = found else { return Ok(None) };
    refuse_blocking(real);
    let now = read(&SockRef::from(&real));
    set_changed(&*found, &before, now.clone())?;
    // Duplicates of the descriptor stand for the same socket.
    let kept = Kept { bed, socket: Box::new(Arc::downgrade(&found)), before: now };
    KEPT.with_borrow_mut(|all| all.insert(inode, kept));
    Ok(Some(found))
}

/// Like [`find`], for sockets that have one owner.
pub(super) fn take<T: Configured + ?Sized + 'static>(real: BorrowedFd<'_>) -> io::Result<Option<Box<T>>> {
    let inode = inode(real)?;
    let is_one = |kept: &Kept| kept.socket.is::<Box<T>>();
    // An entry of another kind of socket stays, for a conversion to that kind.
    let kept = KEPT.with_borrow_mut(|all| if all.get(&inode).is_some_and(is_one) { all.remove(&inode) } else { None });
    let Some((socket, before)) = kept.and_then(|kept| Some((kept.socket.downcast::<Box<T>>().ok()?, kept.before))) else { return Ok(None) };
    set_changed(&**socket, &before, read(&SockRef::from(&real)))?;
    Ok(Some(*socket))
}

/// Returns whether a real socket of TCP is neither bound nor connected, and its version of IP.
pub(super) fn unbound(real: BorrowedFd<'_>) -> Option<Version> {
    let socket = SockRef::from(&real);
    let local = socket.local_addr().ok()?.as_socket()?;
    let version = if local.is_ipv6() { Version::Six } else { Version::Four };
    (local.port() == 0 && local.ip().is_unspecified() && socket.peer_addr().is_err()).then_some(version)
}

/// Sets the options of `socket` in which the real socket differs from a new one.
pub(super) fn set_all(socket: &(impl Configured + ?Sized), real: BorrowedFd<'_>) -> io::Result<()> {
    let fresh = fresh(Type::STREAM, socket.version())?;
    set_changed(socket, &read(&SockRef::from(&fresh)), read(&SockRef::from(&real)))
}

fn fresh(kind: Type, version: Version) -> io::Result<Socket> {
    let domain = match version {
        Version::Four => Domain::IPV4,
        Version::Six => Domain::IPV6,
    };
    let real = Socket::new(domain, kind, None)?;
    // As with the sockets of tokio.
    real.set_nonblocking(true)?;
    Ok(real)
}

fn inode(fd: BorrowedFd<'_>) -> io::Result<u64> {
    // A duplicate is opened, because a `File` closes its descriptor.
    Ok(File::from(fd.try_clone_to_owned()?).metadata()?.ino())
}

/// Refuses a socket that would block, as the real tokio does.
#[track_caller]
fn refuse_blocking(real: BorrowedFd<'_>) {
    if cfg!(debug_assertions) && SockRef::from(&real).nonblocking().is_ok_and(|is_nonblocking| !is_nonblocking) {
        panic!("Registering a blocking socket with the tokio runtime is unsupported: call `set_nonblocking(true)` before `from_std`");
    }
}

fn set_changed(socket: &(impl Configured + ?Sized), before: &[Setting], now: Vec<Setting>) -> io::Result<()> {
    now.into_iter().filter(|setting| !before.contains(setting)).try_for_each(|setting| socket.set(setting))
}

/// Returns the options of a real socket. Options that this kind of socket does not have are left out.
fn read(socket: &SockRef<'_>) -> Vec<Setting> {
    // The address tells the version of IP, also for an unbound socket.
    let is_six = socket.local_addr().is_ok_and(|address| address.is_ipv6());
    let size = |size: usize| u32::try_from(size).unwrap_or(u32::MAX);
    let type_of_service = if is_six { class(socket) } else { service(socket) };
    let ttl = if is_six { socket.unicast_hops_v6() } else { socket.ttl_v4() };
    let settings = [
        socket.tcp_nodelay().map(Setting::NoDelay),
        keepalive(socket).map(Setting::Keepalive),
        socket.linger().map(Setting::Linger),
        user_timeout(socket).map(Setting::UserTimeout),
        socket.recv_buffer_size().map(|bytes| Setting::ReceiveBuffer(size(bytes))),
        socket.send_buffer_size().map(|bytes| Setting::SendBuffer(size(bytes))),
        type_of_service.map(Setting::TypeOfService),
        ttl.map(Setting::Ttl),
        socket.reuse_address().map(Setting::ReuseAddress),
        reuse_port(socket).map(Setting::ReusePort),
        socket.only_v6().map(Setting::OnlyV6),
        socket.broadcast().map(Setting::Broadcast),
    ];
    settings.into_iter().flatten().collect()
}

/// Sets an option of a real socket.
fn write(socket: &SockRef<'_>, setting: Setting) -> io::Result<()> {
    let is_six = socket.local_addr().is_ok_and(|address| address.is_ipv6());
    match setting {
        Setting::NoDelay(on) => socket.set_tcp_nodelay(on),
        Setting::Keepalive(None) => socket.set_keepalive(false),
        Setting::Keepalive(Some(times)) => set_keepalive(socket, times),
        Setting::Linger(time) => socket.set_linger(time),
        Setting::UserTimeout(time) => set_user_timeout(socket, time),
        // The system doubles the size that is set.
        Setting::ReceiveBuffer(bytes) => socket.set_recv_buffer_size(bytes as usize / 2),
        Setting::SendBuffer(bytes) => socket.set_send_buffer_size(bytes as usize / 2),
        Setting::TypeOfService(value) if is_six => set_class(socket, value),
        Setting::TypeOfService(value) => set_service(socket, value),
        Setting::Ttl(ttl) if is_six => socket.set_unicast_hops_v6(ttl),
        Setting::Ttl(ttl) => socket.set_ttl_v4(ttl),
        Setting::ReuseAddress(on) => socket.set_reuse_address(on),
        Setting::ReusePort(on) => set_reuse_port(socket, on),
        Setting::OnlyV6(on) => socket.set_only_v6(on),
        Setting::Broadcast(on) => socket.set_broadcast(on),
    }
}

/// Options that only some systems have: reading and writing fail elsewhere.
macro_rules! some_have {
    ($(#[$condition:meta] $get:ident, $set:ident: $kind:ty = |$socket:ident| $read:expr, |$to:ident, $value:ident| $write:expr;)*) => {
        $(
            #[$condition]
            fn $get($socket: &SockRef<'_>) -> io::Result<$kind> {
                $read
            }

            #[$condition]
            fn $set($to: &SockRef<'_>, $value: $kind) -> io::Result<()> {
                $write
            }
        )*
    };
}

some_have! {
    #[cfg(any(target_os = "linux", target_os = "android"))]
    user_timeout, set_user_timeout: Option<std::time::Duration> = |socket| socket.tcp_user_timeout(), |socket, time| socket.set_tcp_user_timeout(time);
    #[cfg(not(any(target_os = "linux", target_os = "android")))]
    user_timeout, set_user_timeout: Option<std::time::Duration> = |_socket| Err(io::ErrorKind::Unsupported.into()), |_socket, _time| Ok(());
    #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
    service, set_service: u32 = |socket| socket.tos_v4(), |socket, value| socket.set_tos_v4(value);
    #[cfg(not(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd")))]
    service, set_service: u32 = |_socket| Err(io::ErrorKind::Unsupported.into()), |_socket, _value| Ok(());
    #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
    class, set_class: u32 = |socket| socket.tclass_v6(), |socket, value| socket.set_tclass_v6(value);
    #[cfg(not(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd")))]
    class, set_class: u32 = |_socket| Err(io::ErrorKind::Unsupported.into()), |_socket, _value| Ok(());
    #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
    reuse_port, set_reuse_port: bool = |socket| socket.reuse_port(), |socket, on| socket.set_reuse_port(on);
    #[cfg(not(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd")))]
    reuse_port, set_reuse_port: bool = |_socket| Err(io::ErrorKind::Unsupported.into()), |_socket, _on| Ok(());
}

/// Returns the times of keep-alive probes, or `None` if the option is off.
#[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
fn keepalive(socket: &SockRef<'_>) -> io::Result<Option<KeepaliveTimes>> {
    if !socket.keepalive()? {
        return Ok(None);
    }
    let (idle, interval, probes) = (socket.tcp_keepalive_time()?, socket.tcp_keepalive_interval()?, socket.tcp_keepalive_retries()?);
    Ok(Some(KeepaliveTimes { idle, interval, probes }))
}

#[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
fn set_keepalive(socket: &SockRef<'_>, times: KeepaliveTimes) -> io::Result<()> {
    let KeepaliveTimes { idle, interval, probes } = times;
    socket.set_tcp_keepalive(&socket2::TcpKeepalive::new().with_time(idle).with_interval(interval).with_retries(probes))
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd")))]
fn keepalive(_: &SockRef<'_>) -> io::Result<Option<KeepaliveTimes>> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd")))]
fn set_keepalive(socket: &SockRef<'_>, _: KeepaliveTimes) -> io::Result<()> {
    socket.set_keepalive(true)
}

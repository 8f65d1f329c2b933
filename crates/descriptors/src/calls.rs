//! Calls of the system on descriptors of placeholders.
//!
//! Functions return `None` for a descriptor without a socket of a test bed: the call is then for the system. Errors have the numbers of Linux where
//! Linux has the error. A call that would wait fails with [`io::ErrorKind::WouldBlock`] on a non-blocking descriptor. On a blocking descriptor virtual time
//! could not pass during the wait. Then the run fails with host and call in its text, and the call itself fails with `EDEADLK`, so that the program goes on to
//! a place where the run can end.

use std::io::{self, IoSlice, IoSliceMut};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr};
use std::os::fd::OwnedFd;
use std::sync::Arc;

use cohaptic_sockets::{Bed, Call, DatagramOption, Datagrams, Listener, Ready, Received, Sending, Socket, Stream, Version};
use socket2::{SockRef, Type};

use crate::multicast::MulticastChange;
use crate::options::{read, set_changed};
use crate::placeholder::{Placeholder, keep, set_all};
use crate::table::{self, Kind, Numbered, Virtual};

/// Error numbers of the system.
mod errno {
    macro_rules! numbers {
        ($($name:ident: $linux:literal, $bsd:literal;)*) => {
            $(pub(super) const $name: i32 = if cfg!(any(target_os = "linux", target_os = "android")) { $linux } else { $bsd };)*
        };
    }

    numbers! {
        INVALID: 22, 22;
        PIPE: 32, 32;
        DEADLOCK: 35, 11;
        NOT_SUPPORTED: 95, 102;
        OTHER_VERSION: 97, 47;
        IS_CONNECTED: 106, 56;
        NOT_CONNECTED: 107, 57;
        ALREADY: 114, 37;
        IN_PROGRESS: 115, 36;
    }
}

fn fail<T>(number: i32) -> io::Result<T> {
    Err(io::Error::from_raw_os_error(number))
}

/// Returns whether descriptors of this thread may stand for sockets of a test bed. Takes no call of the system.
#[must_use]
pub fn is_any() -> bool {
    table::is_any()
}

/// Returns whether a descriptor stands for a socket of a test bed.
#[must_use]
pub fn is_virtual(of: Numbered<'_>) -> bool {
    table::with(of, |_| ()).is_some()
}

/// Enters a new socket of the program.
pub fn made(of: Numbered<'_>, kind: Type, version: Version) {
    table::insert(of, Virtual::New(kind, version), Vec::new());
}

/// Counts a further descriptor of the placeholder.
pub fn duplicated(of: Numbered<'_>) {
    table::duplicated(of);
}

/// Notes the close of a descriptor. The close of the last descriptor closes the socket of the test bed.
pub fn closed(of: Numbered<'_>) {
    table::closed(of);
}

/// Fails the run because of a call that would wait, or of a call beyond the abilities of a test bed. `what` completes the sentence about the call.
///
/// # Errors
///
/// `EDEADLK`, always.
pub fn refuse<T>(name: &str, what: &str) -> io::Result<T> {
    if let Some(host) = cohaptic_sockets::host() {
        let text = format!("host `{}` makes the call `{name}` of the system, {what}", host.name());
        host.note_fault(&text);
    }
    fail(errno::DEADLOCK)
}

/// Returns the outcome of a call, and fails the run if the call would wait on a blocking descriptor.
fn without_waiting<T>(of: Numbered<'_>, name: &str, dont_wait: bool, outcome: io::Result<T>) -> io::Result<T> {
    match outcome {
        Err(error) if error.kind() == io::ErrorKind::WouldBlock && !dont_wait && !SockRef::from(&of.fd).nonblocking()? => refuse(
            name,
            "which would wait on a blocking socket, and virtual time cannot pass meanwhile: call `set_nonblocking(true)` and give the socket to tokio by `from_std`, or \
             make the socket with tokio",
        ),
        outcome => outcome,
    }
}

/// Entry of a descriptor for a call.
enum Found {
    New(Type, Version),
    /// Taken out of the table, to be put back.
    Socket(Box<dyn Socket>),
    Stream(Arc<dyn Stream>),
    Listener(Arc<dyn Listener>),
    Datagrams(Arc<dyn Datagrams>),
    /// The owner has dropped the socket, and the descriptor has outlived the owner.
    Gone,
}

fn found(of: Numbered<'_>) -> Option<Found> {
    table::with(of, |kept| {
        let found = match &kept.socket {
            Virtual::New(kind, version) => Some(Found::New(*kind, *version)),
            Virtual::Stream(held) => held.get().map(Found::Stream),
            Virtual::Listener(held) => held.get().map(Found::Listener),
            Virtual::Datagrams(held) => held.get().map(Found::Datagrams),
            Virtual::Socket(socket) => {
                // `connect` and `listen` consume a new socket. So the socket leaves the table for the call, and the successor is put back.
                let version = socket.version();
                match std::mem::replace(&mut kept.socket, Virtual::New(Type::STREAM, version)) {
                    Virtual::Socket(socket) => Some(Found::Socket(socket)),
                    Virtual::New(..) | Virtual::Stream(_) | Virtual::Listener(_) | Virtual::Datagrams(_) => None,
                }
            }
        };
        found.unwrap_or(Found::Gone)
    })
}

/// Puts a socket into the place of the former socket.
fn put(of: Numbered<'_>, socket: Virtual) {
    let former = table::with(of, |kept| std::mem::replace(&mut kept.socket, socket));
    // Dropped after the borrow of the table has ended, because destructors are foreign.
    drop(former);
}

/// Notes the present options of the placeholder as taken over.
fn note_options(of: Numbered<'_>) {
    let now = read(&SockRef::from(&of.fd));
    table::with(of, |kept| kept.before = now);
}

/// Returns the test bed of this thread.
///
/// # Errors
///
/// `EINVAL` if a descriptor is used after the end of its test bed.
fn bed() -> io::Result<Arc<dyn Bed>> {
    cohaptic_sockets::bed().ok_or_else(|| io::Error::from_raw_os_error(errno::INVALID))
}

fn any_address(version: Version) -> SocketAddr {
    match version {
        Version::Four => (Ipv4Addr::UNSPECIFIED, 0).into(),
        Version::Six => (Ipv6Addr::UNSPECIFIED, 0).into(),
    }
}

/// Returns the error of an address of the other version of IP. Linux finds an address of IPv4 too short for a socket of IPv6.
fn check_version(version: Version, at: SocketAddr) -> io::Result<()> {
    match (version, at) {
        (Version::Four, SocketAddr::V6(_)) => fail(errno::OTHER_VERSION),
        (Version::Six, SocketAddr::V4(_)) => fail(errno::INVALID),
        _ => Ok(()),
    }
}

/// Makes the TCP socket of a new descriptor.
fn socket(of: Numbered<'_>, name: &'static str, version: Version) -> io::Result<Box<dyn Socket>> {
    let socket = bed()?.socket(Call::of_system(name), version)?;
    set_all(Type::STREAM, &*socket, of.fd)?;
    note_options(of);
    Ok(socket)
}

/// Binds the UDP socket of a new descriptor.
fn datagrams(of: Numbered<'_>, name: &'static str, version: Version, at: SocketAddr) -> io::Result<Arc<dyn Datagrams>> {
    check_version(version, at)?;
    let socket: Arc<dyn Datagrams> = bed()?.bind(Call::of_system(name), at)?.into();
    set_all(Type::DGRAM, &*socket, of.fd)?;
    note_options(of);
    let early = table::with(of, |kept| std::mem::take(&mut kept.early)).unwrap_or_default();
    early.into_iter().try_for_each(|change| change.apply(&*socket))?;
    put(of, Kind::owned(Arc::clone(&socket)));
    Ok(socket)
}

/// See `bind`.
pub fn bind(of: Numbered<'_>, at: SocketAddr) -> Option<io::Result<()>> {
    let bind_socket = |socket: Box<dyn Socket>| {
        let outcome = socket.bind(at);
        put(of, Virtual::Socket(socket));
        outcome
    };
    Some(match found(of)? {
        Found::New(Type::STREAM, version) => socket(of, "bind", version).and_then(bind_socket),
        Found::New(_, version) => datagrams(of, "bind", version, at).map(drop),
        Found::Socket(socket) => bind_socket(socket),
        Found::Stream(_) | Found::Listener(_) | Found::Datagrams(_) | Found::Gone => fail(errno::INVALID),
    })
}

/// See `listen`. A negative backlog is the longest, as with Linux.
pub fn listen(of: Numbered<'_>, backlog: i32) -> Option<io::Result<()>> {
    let backlog = u32::try_from(backlog).unwrap_or(u32::MAX);
    let listen_at = |socket: Box<dyn Socket>| {
        let listener: Arc<dyn Listener> = socket.listen(backlog)?.into();
        put(of, Kind::owned(listener));
        Ok(())
    };
    Some(match found(of)? {
        Found::New(Type::STREAM, version) => socket(of, "listen", version).and_then(listen_at),
        Found::Socket(socket) => listen_at(socket),
        Found::Listener(_) => Ok(()),
        Found::New(..) | Found::Datagrams(_) => fail(errno::NOT_SUPPORTED),
        Found::Stream(_) | Found::Gone => fail(errno::INVALID),
    })
}

/// See `connect`. TCP takes at least a round trip, so only a non-blocking descriptor can connect.
pub fn connect(of: Numbered<'_>, to: SocketAddr) -> Option<io::Result<()>> {
    let begin = |socket: Box<dyn Socket>| {
        let stream: Arc<dyn Stream> = socket.begin(to)?.into();
        put(of, Kind::owned(Arc::clone(&stream)));
        connected(of, &*stream, errno::IN_PROGRESS)
    };
    Some(match found(of)? {
        Found::New(Type::STREAM, version) => check_version(version, to).and_then(|()| socket(of, "connect", version)).and_then(begin),
        Found::Socket(socket) => begin(socket),
        Found::New(_, version) => datagrams(of, "connect", version, any_address(version)).and_then(|socket| socket.connect(to)),
        Found::Datagrams(socket) => socket.connect(to),
        Found::Stream(stream) if stream.peer_addr().is_ok() => fail(errno::IS_CONNECTED),
        Found::Stream(stream) => connected(of, &*stream, errno::ALREADY),
        Found::Listener(_) => fail(errno::IS_CONNECTED),
        Found::Gone => fail(errno::INVALID),
    })
}

/// Returns whether a connection is established. `meanwhile` is the error of a connection under way on a non-blocking descriptor.
fn connected(of: Numbered<'_>, stream: &dyn Stream, meanwhile: i32) -> io::Result<()> {
    if stream.peer_addr().is_ok() {
        return Ok(());
    }
    match stream.take_error()? {
        Some(error) => Err(error),
        // A connection under way is not established, and the call would wait for it on a blocking descriptor.
        None => match without_waiting::<()>(of, "connect", false, Err(io::ErrorKind::WouldBlock.into())) {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => fail(meanwhile),
            outcome => outcome,
        },
    }
}

/// See `accept`. Returns a non-blocking descriptor that `exec` closes, and the address of the peer.
pub fn accept(of: Numbered<'_>) -> Option<io::Result<(OwnedFd, SocketAddr)>> {
    Some(match found(of)? {
        Found::Listener(listener) => without_waiting(of, "accept", false, listener.try_accept()).and_then(|(stream, peer)| {
            let stream: Arc<dyn Stream> = stream.into();
            Ok((keep(Placeholder::new(Type::STREAM, &*stream)?, stream)?, peer))
        }),
        Found::Socket(socket) => {
            put(of, Virtual::Socket(socket));
            fail(errno::INVALID)
        }
        Found::New(Type::STREAM, _) | Found::Stream(_) | Found::Gone => fail(errno::INVALID),
        Found::New(..) | Found::Datagrams(_) => fail(errno::NOT_SUPPORTED),
    })
}

/// See `getsockname`.
pub fn local(of: Numbered<'_>) -> Option<io::Result<SocketAddr>> {
    Some(match found(of)? {
        Found::New(_, version) => Ok(any_address(version)),
        Found::Socket(socket) => {
            let local = socket.local_addr();
            put(of, Virtual::Socket(socket));
            local
        }
        Found::Stream(stream) => stream.local_addr(),
        Found::Listener(listener) => listener.local_addr(),
        Found::Datagrams(socket) => socket.local_addr(),
        Found::Gone => fail(errno::INVALID),
    })
}

/// See `getpeername`.
pub fn peer(of: Numbered<'_>) -> Option<io::Result<SocketAddr>> {
    Some(match found(of)? {
        Found::Stream(stream) => stream.peer_addr(),
        Found::Datagrams(socket) => socket.peer_addr(),
        Found::Socket(socket) => {
            put(of, Virtual::Socket(socket));
            fail(errno::NOT_CONNECTED)
        }
        Found::New(..) | Found::Listener(_) | Found::Gone => fail(errno::NOT_CONNECTED),
    })
}

/// See `shutdown`.
pub fn shut_down(of: Numbered<'_>, how: Shutdown) -> Option<io::Result<()>> {
    let outcome = match found(of)? {
        Found::Stream(stream) if how == Shutdown::Read => stream.peer_addr().map(drop),
        Found::Stream(stream) => stream.peer_addr().and_then(|_| stream.shut_down()),
        // A UDP socket has no end to announce.
        Found::Datagrams(socket) => socket.peer_addr().map(drop),
        Found::Socket(socket) => {
            put(of, Virtual::Socket(socket));
            fail(errno::NOT_CONNECTED)
        }
        Found::New(..) | Found::Listener(_) | Found::Gone => fail(errno::NOT_CONNECTED),
    };
    if outcome.is_ok() && how != Shutdown::Write {
        table::with(of, |kept| kept.is_read_shut = true);
    }
    Some(outcome)
}

/// See `sendmsg`. `name` is the call of the program, for messages.
pub fn send(of: Numbered<'_>, name: &'static str, buffers: &[IoSlice<'_>], sending: Sending, dont_wait: bool) -> Option<io::Result<usize>> {
    let send_datagram = |socket: Arc<dyn Datagrams>| match buffers {
        [bytes] => socket.send_as(bytes, sending),
        // A datagram leaves in one piece.
        _ => socket.send_as(&buffers.iter().flat_map(|buffer| buffer.iter().copied()).collect::<Vec<u8>>(), sending),
    };
    Some(match found(of)? {
        Found::Stream(stream) => without_waiting(of, name, dont_wait, stream.try_write(buffers)),
        Found::Datagrams(socket) => send_datagram(socket),
        Found::New(Type::DGRAM, version) => datagrams(of, name, version, any_address(version)).and_then(send_datagram),
        Found::Socket(socket) => {
            put(of, Virtual::Socket(socket));
            fail(errno::PIPE)
        }
        Found::New(..) | Found::Listener(_) | Found::Gone => fail(errno::PIPE),
    })
}

/// Bytes received by a call.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Arrived {
    /// Number of bytes in the buffers.
    pub count: usize,
    /// Length of the datagram, which may be longer than the buffers. For a stream, `count`.
    pub length: usize,
    /// Sender of the datagram; `None` for a stream.
    pub from: Option<SocketAddr>,
    /// Address to which the datagram was sent; `None` for a stream.
    pub to: Option<IpAddr>,
    /// ECN codepoint of the datagram, from 0 to 3.
    pub ecn: u8,
}

impl Arrived {
    const fn of_stream(count: usize) -> Self {
        Self { count, length: count, from: None, to: None, ecn: 0 }
    }
}

/// See `recvmsg`. `name` is the call of the program, for messages. With `peek` the bytes stay.
pub fn receive(of: Numbered<'_>, name: &str, buffers: &mut [IoSliceMut<'_>], peek: bool, dont_wait: bool) -> Option<io::Result<Arrived>> {
    let outcome = match found(of)? {
        Found::Stream(stream) if peek => match buffers.first_mut() {
            Some(buffer) => stream.try_peek(buffer).map(Arrived::of_stream),
            None => Ok(Arrived::of_stream(0)),
        },
        Found::Stream(stream) => stream.try_read(buffers).map(Arrived::of_stream),
        Found::Datagrams(socket) => receive_datagram(&*socket, buffers, peek),
        Found::New(Type::DGRAM, _) => Err(io::ErrorKind::WouldBlock.into()),
        Found::Socket(socket) => {
            put(of, Virtual::Socket(socket));
            fail(errno::NOT_CONNECTED)
        }
        Found::New(..) | Found::Listener(_) | Found::Gone => fail(errno::NOT_CONNECTED),
    };
    let is_empty = outcome.as_ref().is_err_and(|error| error.kind() == io::ErrorKind::WouldBlock);
    if is_empty && table::with(of, |kept| kept.is_read_shut) == Some(true) {
        return Some(Ok(Arrived::of_stream(0)));
    }
    Some(without_waiting(of, name, dont_wait, outcome))
}

fn receive_datagram(socket: &dyn Datagrams, buffers: &mut [IoSliceMut<'_>], peek: bool) -> io::Result<Arrived> {
    let mut arrived = Arrived::of_stream(0);
    socket.try_receive(peek, &mut |Received { bytes, from, to, ecn }| {
        let mut rest = bytes;
        for buffer in &mut *buffers {
            let (now, later) = rest.split_at(rest.len().min(buffer.len()));
            buffer[..now.len()].copy_from_slice(now);
            rest = later;
        }
        arrived = Arrived { count: bytes.len() - rest.len(), length: bytes.len(), from: Some(from), to: Some(to), ecn };
    })?;
    Ok(arrived)
}

/// Takes over the options set by the program on the placeholder. Must be called after the system has accepted an option.
///
/// # Errors
///
/// If the socket of the test bed cannot take the option, as after a crash of its host.
pub fn option_set(of: Numbered<'_>) -> io::Result<()> {
    let Some(found) = found(of) else { return Ok(()) };
    let now = read(&SockRef::from(&of.fd));
    let before = table::with(of, |kept| std::mem::replace(&mut kept.before, now.clone())).unwrap_or_default();
    match found {
        // The options are read when the socket of the test bed is made.
        Found::New(..) | Found::Gone => Ok(()),
        Found::Socket(socket) => {
            let outcome = set_changed(&*socket, &before, now);
            put(of, Virtual::Socket(socket));
            outcome
        }
        Found::Stream(stream) => set_changed(&*stream, &before, now),
        Found::Listener(listener) => set_changed(&*listener, &before, now),
        Found::Datagrams(socket) => set_changed(&*socket, &before, now),
    }
}

/// Returns a socket at any port with the changes that wait for the bind of a new descriptor. The socket of the descriptor itself is not bound before the program
/// says where.
fn trial(of: Numbered<'_>, version: Version) -> io::Result<Box<dyn Datagrams>> {
    let socket = bed()?.bind(Call::of_system("setsockopt"), any_address(version))?;
    let early = table::with(of, |kept| kept.early.clone()).unwrap_or_default();
    early.into_iter().try_for_each(|change| change.apply(&*socket))?;
    Ok(socket)
}

/// Joins or leaves a multicast group, or selects the interface for multicast. Before the bind of a descriptor the change is checked, and waits for the bind.
pub fn change_multicast(of: Numbered<'_>, change: MulticastChange) -> Option<io::Result<()>> {
    Some(match found(of)? {
        Found::Datagrams(socket) => change.apply(&*socket),
        Found::New(Type::DGRAM, version) => {
            let outcome = trial(of, version).and_then(|socket| change.apply(&*socket));
            if outcome.is_ok() {
                table::with(of, |kept| kept.early.push(change));
            }
            outcome
        }
        Found::Socket(socket) => {
            put(of, Virtual::Socket(socket));
            fail(errno::INVALID)
        }
        Found::New(..) | Found::Stream(_) | Found::Listener(_) | Found::Gone => fail(errno::INVALID),
    })
}

/// Returns the interface for multicast over a version of IP: the 32 bits of an address of IPv4, or a number with IPv6. 0 if the host chooses.
pub fn multicast_interface(of: Numbered<'_>, version: Version) -> Option<io::Result<u32>> {
    let option = match version {
        Version::Four => DatagramOption::MulticastInterface4,
        Version::Six => DatagramOption::MulticastInterface6,
    };
    Some(match found(of)? {
        Found::Datagrams(socket) => socket.option(option),
        Found::New(Type::DGRAM, own) => trial(of, own).and_then(|socket| socket.option(option)),
        Found::Socket(socket) => {
            put(of, Virtual::Socket(socket));
            fail(errno::INVALID)
        }
        Found::New(..) | Found::Stream(_) | Found::Listener(_) | Found::Gone => fail(errno::INVALID),
    })
}

/// Takes the error of a socket (`SO_ERROR`); `Ok(None)` if there is none.
pub fn error(of: Numbered<'_>) -> Option<io::Result<Option<io::Error>>> {
    Some(match found(of)? {
        Found::Stream(stream) => stream.take_error(),
        Found::Datagrams(socket) => socket.take_error(),
        Found::Socket(socket) => {
            put(of, Virtual::Socket(socket));
            Ok(None)
        }
        Found::New(..) | Found::Listener(_) | Found::Gone => Ok(None),
    })
}

/// Returns whether a socket listens (`SO_ACCEPTCONN`).
#[must_use]
pub fn is_listening(of: Numbered<'_>) -> Option<bool> {
    table::with(of, |kept| matches!(kept.socket, Virtual::Listener(_)))
}

/// Returns the operations without a wait, in the sense of `poll`.
pub fn ready(of: Numbered<'_>) -> Option<io::Result<Ready>> {
    let only_readable = |readable| Ready { readable, ..Ready::default() };
    Some(match found(of)? {
        Found::Stream(stream) => stream.ready(),
        Found::Listener(listener) => listener.is_ready().map(only_readable),
        Found::Datagrams(socket) => socket.is_readable().map(|readable| Ready { writable: true, ..only_readable(readable) }),
        Found::New(Type::DGRAM, _) => Ok(Ready { writable: true, ..Ready::default() }),
        Found::Socket(socket) => {
            put(of, Virtual::Socket(socket));
            // Linux reports an unconnected socket of TCP as hung up.
            Ok(Ready { writable: true, write_closed: true, ..Ready::default() })
        }
        Found::New(..) | Found::Gone => Ok(Ready { writable: true, write_closed: true, ..Ready::default() }),
    })
}

/// Returns the addresses of a name on this thread, in a run or in work for a host; `None` outside of test beds, or if no host runs the program.
pub fn look_up(name: &str, port: u16) -> Option<io::Result<Vec<SocketAddr>>> {
    match cohaptic_sockets::bed() {
        Some(bed) => Some(bed.look_up(name, port)),
        None => cohaptic_sockets::host().map(|host| host.look_up(name, port)),
    }
}

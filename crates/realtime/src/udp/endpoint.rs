//! The socket, and where datagrams are put when they are read, many at a time.

use core::fmt;
use std::io::{self, ErrorKind, IoSliceMut};
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::{AsFd, BorrowedFd};

use cohaptic_units::Instant;
use nix::sys::socket::setsockopt;
use nix::sys::socket::sockopt::{Ipv4PacketInfo, Ipv6RecvPacketInfo, UdpGroSegment};
use quinn_udp::{BATCH_SIZE, RecvMeta, Transmit, UdpSockRef, UdpSocketState};
use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketFlags, SocketType, bind, ipproto, socket_with, sockopt};

use super::counts::kernel_drops;
use super::outbox::{Outbox, Run};
use super::{Ecn, EndpointCounts};
use crate::MonotonicClock;
use crate::clock::ArrivalOrder;

/// What to ask for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct EndpointConfig {
    /// How many bytes should wait in the kernel until they are read. The kernel counts headers and what it keeps itself: a small datagram takes about
    /// 800 bytes. It may grant less: see [`UdpEndpoint::granted_receive_buffer`].
    pub receive_buffer: usize,
    /// Longer datagrams are dropped when they come in, and counted.
    pub largest: usize,
    /// The number of datagrams that may wait to be sent when the kernel's buffer is full; beyond, new ones are dropped and counted.
    pub waiting: usize,
    /// Whether the kernel may put datagrams of one sender together before it hands them over, up to 64 of them: less work for each, but one call of
    /// [`UdpEndpoint::receive`] may then hand on 64 times [`UdpEndpoint::BATCH`] datagrams.
    pub joined: bool,
}

impl Default for EndpointConfig {
    /// 8 MiB, datagrams of any length, 4096 that wait, and datagrams that the kernel puts together.
    fn default() -> Self {
        Self { receive_buffer: 8 << 20, largest: 65_535, waiting: 4096, joined: true }
    }
}

/// Why a socket could not be had.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen on {address}: {source}: expected a free UDP port of an address that this machine has")]
pub struct BindError {
    /// The address asked for.
    pub address: SocketAddr,
    /// What the system says.
    pub source: io::Error,
}

/// A datagram that came in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Datagram<'a> {
    /// The sender.
    pub from: SocketAddr,
    /// What it carries.
    pub bytes: &'a [u8],
    /// Its congestion bits; `None`: its ends do not understand them.
    pub ecn: Option<Ecn>,
    /// When the kernel saw it come in; where the kernel does not say, no later than it was read or than the kernel saw the next one. Never before the
    /// datagram that the same socket gave before it.
    pub at: Instant,
}

/// A UDP socket that never blocks. An IPv6 one takes IPv6 alone, so that every sender has one address.
#[derive(Debug)]
pub struct UdpEndpoint {
    socket: UdpSocket,
    state: UdpSocketState,
    address: SocketAddr,
    granted: usize,
    config: EndpointConfig,
    outbox: Outbox,
    counts: EndpointCounts,
    order: ArrivalOrder,
}

impl UdpEndpoint {
    /// Opens a socket; port 0 is a free one.
    ///
    /// # Errors
    ///
    /// [`BindError`] if the address is taken, or is none of this machine's.
    pub fn bind(address: SocketAddr, config: EndpointConfig) -> Result<Self, BindError> {
        Self::open(address, config).map_err(|source| BindError { address, source })
    }

    fn open(address: SocketAddr, config: EndpointConfig) -> io::Result<Self> {
        let family = if address.is_ipv6() { AddressFamily::INET6 } else { AddressFamily::INET };
        let socket = socket_with(family, SocketType::DGRAM, SocketFlags::CLOEXEC | SocketFlags::NONBLOCK, Some(ipproto::UDP))?;
        if address.is_ipv6() {
            sockopt::set_ipv6_v6only(&socket, true)?;
        }
        // Beyond the system's limit with CAP_NET_ADMIN, up to it without.
        if sockopt::set_socket_recv_buffer_size_force(&socket, config.receive_buffer).is_err() {
            sockopt::set_socket_recv_buffer_size(&socket, config.receive_buffer)?;
        }
        bind(&socket, &address)?;
        let socket = UdpSocket::from(socket);
        let state = UdpSocketState::new(UdpSockRef::from(&socket))?;
        // Nobody asks to which of several addresses a datagram came. Told all the same, it would take the room in which the kernel tells the congestion bits
        // of segments that it has put together.
        if address.is_ipv6() {
            setsockopt(&socket, Ipv6RecvPacketInfo, &false)?;
        } else {
            setsockopt(&socket, Ipv4PacketInfo, &false)?;
        }
        // The state has asked for it where the kernel can. An older kernel does not know the option, and puts nothing together.
        if !config.joined && state.gro_segments() > 1 {
            setsockopt(&socket, UdpGroSegment, &false)?;
        }
        let (address, granted) = (socket.local_addr()?, sockopt::socket_recv_buffer_size(&socket)?);
        Ok(Self { socket, state, address, granted, config, outbox: Outbox::default(), counts: EndpointCounts::default(), order: ArrivalOrder::NEW })
    }

    /// Where it listens.
    #[must_use]
    pub const fn local_address(&self) -> SocketAddr {
        self.address
    }

    /// How many bytes may wait in the kernel, as the kernel counts them. It grants twice the size asked for, and on a system that allows no more (`sysctl
    /// net.core.rmem_max`) less.
    #[must_use]
    pub const fn granted_receive_buffer(&self) -> usize {
        self.granted
    }

    /// What it did so far.
    #[must_use]
    pub const fn counts(&self) -> &EndpointCounts {
        &self.counts
    }

    /// How many datagrams the kernel has dropped because its buffer was full; `None` if the system does not tell. Reads a file: not for a hot loop.
    ///
    /// # Errors
    ///
    /// What the system says.
    pub fn kernel_drops(&self) -> io::Result<Option<u64>> {
        kernel_drops(&self.socket, self.address.is_ipv6())
    }

    /// Hands on what has come in, one batch at most, in the order in which it came, and says how many datagrams the kernel gave: after fewer than
    /// [`UdpEndpoint::BATCH`] none is left to read. Datagrams that the kernel has put together count as one here ([`EndpointConfig::joined`]). Never blocks. One clock is given to all calls of an endpoint.
    ///
    /// # Errors
    ///
    /// What the system says, but for what passes: that there is nothing to read, that an earlier datagram did not arrive, or that memory is short.
    pub fn receive(&mut self, buffers: &mut ReceiveBuffers, clock: &MonotonicClock, mut take: impl FnMut(Datagram<'_>)) -> io::Result<usize> {
        let (mut rooms, told) = buffers.rooms();
        let count = match self.state.recv(UdpSockRef::from(&self.socket), &mut rooms, told) {
            Ok(count) => count,
            Err(error) => return self.cannot_receive(error),
        };
        // After reading: no stamp lies in the future.
        let stamps = clock.stamps();
        let mut arrivals = [stamps.now(); BATCH_SIZE];
        for (arrival, told) in arrivals.iter_mut().zip(&buffers.told[..count]) {
            *arrival = stamps.instant(told.timestamp);
        }
        // The kernel begins to stamp a moment after a socket was opened. What came before is stamped when it is read, later than what came after it; a stamp
        // that is not believed is the time of reading, too.
        self.order.put_in_order(&mut arrivals[..count]);
        for (place, &at) in arrivals[..count].iter().enumerate() {
            let told = buffers.told[place];
            let bytes = buffers.room(place, told.len);
            // The kernel may have put several of one sender together. An empty datagram is one, too.
            let mut rest = Some(bytes);
            while let Some(bytes) = rest {
                let (segment, after) = if told.stride > 0 && bytes.len() > told.stride { bytes.split_at(told.stride) } else { (bytes, &[][..]) };
                if segment.len() > self.config.largest {
                    self.counts.oversized += 1;
                } else {
                    self.counts.received += 1;
                    take(Datagram { from: told.addr, bytes: segment, ecn: told.ecn, at });
                }
                rest = (!after.is_empty()).then_some(after);
            }
        }
        Ok(count)
    }

    /// The number of datagrams that are read at once.
    pub const BATCH: usize = BATCH_SIZE;

    #[cold]
    fn cannot_receive(&mut self, error: io::Error) -> io::Result<usize> {
        match Errno::from_io_error(&error).unwrap_or(Errno::IO) {
            Errno::AGAIN => Ok(0),
            Errno::CONNREFUSED | Errno::CONNRESET | Errno::HOSTUNREACH | Errno::NETUNREACH => {
                self.counts.receive_errors += 1;
                // There may be more behind it.
                Ok(Self::BATCH)
            }
            // They pass.
            Errno::NETDOWN | Errno::NOBUFS | Errno::NOMEM => {
                self.counts.receive_errors += 1;
                Ok(0)
            }
            _ => Err(error),
        }
    }

    /// Takes a datagram to be sent with the next [`UdpEndpoint::flush`], and says so; beyond [`EndpointConfig::waiting`] it is dropped and counted.
    #[inline]
    pub fn queue(&mut self, to: SocketAddr, bytes: &[u8], ecn: Option<Ecn>) -> bool {
        let has_room = self.outbox.len() < self.config.waiting;
        if has_room {
            self.outbox.push(to, bytes, ecn);
        } else {
            self.counts.failures.full += 1;
        }
        has_room
    }

    /// Sends what was queued, in that order, until the kernel's buffer is full; the rest waits for the next call. A datagram that cannot be sent is
    /// counted, and the others go on.
    ///
    /// Datagrams to one address, of one length, that were queued one after the other go in one call, which the kernel or the far end cuts (segmentation
    /// offload). On loopback a datagram of 64 bytes took 1.9 µs alone, 1.1 µs of two together, 0.5 µs of eight, 0.3 µs of sixteen. With `sendmmsg`, which
    /// takes any datagrams, it took 1.5 µs of sixteen: that is why it is not used.
    pub fn flush(&mut self) {
        self.flush_with(|| (), |(), _| ());
    }

    /// The same. `before` is asked before every call of the kernel, such as for the time; `done` is told its answer and how many datagrams the call has
    /// settled, in the order in which they were queued. Those that wait are told of later.
    pub fn flush_with<T>(&mut self, mut before: impl FnMut() -> T, mut done: impl FnMut(T, usize)) {
        let most = self.state.max_gso_segments();
        while self.outbox.len() > 0 {
            let asked = before();
            let Some(run) = self.outbox.next_run(most) else { return };
            self.counts.send_calls += 1;
            let mut settled = run.count;
            match send(&self.socket, &self.state, &run) {
                Ok(()) => {
                    self.counts.sent += run.count as u64;
                    self.outbox.take(settled);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    self.outbox.close_up();
                    return;
                }
                Err(error) => {
                    settled = 1;
                    self.cannot_send(&error);
                }
            }
            done(asked, settled);
        }
    }

    /// Sends a datagram at once, or drops and counts it if the kernel's buffer is full or earlier datagrams wait: for a datagram that must not delay others,
    /// and whose receiver asks for it again.
    pub fn send_or_drop(&mut self, to: SocketAddr, bytes: &[u8]) {
        if self.has_waiting() {
            self.counts.failures.full += 1;
            return;
        }
        self.counts.send_calls += 1;
        match send(&self.socket, &self.state, &Run { to, ecn: None, bytes, segment: bytes.len(), count: 1 }) {
            Ok(()) => self.counts.sent += 1,
            Err(error) => self.counts.failures.count(&error),
        }
    }

    /// Whether anything waits to be sent because the kernel's buffer was full.
    #[must_use]
    pub fn has_waiting(&self) -> bool {
        self.outbox.len() > 0
    }

    /// The first that waits cannot be sent, alone or with others.
    #[cold]
    fn cannot_send(&mut self, error: &io::Error) {
        let Some(run) = self.outbox.next_run(1) else { return };
        // It may have been the company that was at fault.
        let alone = send(&self.socket, &self.state, &run);
        self.counts.send_calls += 1;
        match alone {
            Ok(()) => self.counts.sent += 1,
            Err(_) => self.counts.failures.count(error),
        }
        self.outbox.take(1);
    }
}

impl AsFd for UdpEndpoint {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

fn send(socket: &UdpSocket, state: &UdpSocketState, run: &Run<'_>) -> io::Result<()> {
    let segment_size = (run.count > 1).then_some(run.segment);
    let transmit = Transmit { destination: run.to, ecn: run.ecn, contents: run.bytes, segment_size, src_ip: None };
    state.try_send(UdpSockRef::from(socket), &transmit)
}

/// Room for one batch, to be shared by all sockets of a thread: 2 MB, of which the kernel gives the touched pages.
pub struct ReceiveBuffers {
    bytes: Vec<u8>,
    pub(super) told: [RecvMeta; BATCH_SIZE],
}

/// No datagram is longer than 65,527 bytes (that is IPv6), nor are segments that the kernel has put together: nothing is ever cut off. Not a power of two,
/// so that the beginnings of all datagrams of a batch do not share one set of the processor's cache.
const ROOM: usize = 65_536 + 256;

impl Default for ReceiveBuffers {
    fn default() -> Self {
        Self::new()
    }
}

impl ReceiveBuffers {
    /// Empty ones.
    #[must_use]
    pub fn new() -> Self {
        Self { bytes: vec![0; ROOM * BATCH_SIZE], told: [RecvMeta::default(); BATCH_SIZE] }
    }

    /// The rooms, one for each datagram, and what will be told of each.
    pub(super) fn rooms(&mut self) -> ([IoSliceMut<'_>; BATCH_SIZE], &mut [RecvMeta; BATCH_SIZE]) {
        let mut rooms = self.bytes.chunks_exact_mut(ROOM);
        (core::array::from_fn(|_| IoSliceMut::new(rooms.next().unwrap_or_default())), &mut self.told)
    }

    /// What was read into that room.
    pub(super) fn room(&self, place: usize, len: usize) -> &[u8] {
        let start = place * ROOM;
        self.bytes.get(start..start + len.min(ROOM)).unwrap_or_default()
    }
}

impl fmt::Debug for ReceiveBuffers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ReceiveBuffers").finish_non_exhaustive()
    }
}

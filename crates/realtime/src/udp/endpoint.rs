//! The socket, and the memory into which many datagrams are read at a time.

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

/// Options of a socket.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct EndpointConfig {
    /// Size of the receive buffer in the kernel to ask for \[bytes\]. The kernel counts headers and bookkeeping, too: a small datagram takes about 800 bytes.
    /// The kernel can grant less: see [`UdpEndpoint::granted_receive_buffer`].
    pub receive_buffer: usize,
    /// Longest datagram to accept \[bytes\]. Longer arriving datagrams are dropped and counted.
    pub largest: usize,
    /// Datagrams waiting to be sent while the kernel's buffer is full, at most. Further datagrams are dropped and counted.
    pub waiting: usize,
    /// `true` if the kernel can join up to 64 datagrams of one sender before handing over the datagrams. Joining costs less time per datagram, but one call of
    /// [`UdpEndpoint::receive`] can then hand on 64 times [`UdpEndpoint::BATCH`] datagrams.
    pub joined: bool,
}

impl Default for EndpointConfig {
    /// Returns 8 MiB of receive buffer, datagrams of any length, 4096 waiting datagrams, and joined datagrams.
    fn default() -> Self {
        Self { receive_buffer: 8 << 20, largest: 65_535, waiting: 4096, joined: true }
    }
}

/// Failure to open a socket.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen on {address}: {source}: expected a free UDP port of an address that this machine has")]
pub struct BindError {
    /// Address asked for.
    pub address: SocketAddr,
    /// Error of the system.
    pub source: io::Error,
}

/// Datagram received by a socket.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Datagram<'a> {
    /// Address of the sender.
    pub from: SocketAddr,
    /// Payload.
    pub bytes: &'a [u8],
    /// Congestion bits; `None` if the ends do not understand such bits.
    pub ecn: Option<Ecn>,
    /// Instant of the arrival, as seen by the kernel. If the kernel gives no time stamp: an instant no later than the reading of the datagram, and no later
    /// than the arrival of the next datagram. Never earlier than the instant of the previous datagram of the same socket.
    pub at: Instant,
}

/// UDP socket that never blocks. An IPv6 socket takes IPv6 alone, so that every sender has one address.
#[derive(Debug)]
pub struct UdpEndpoint {
    socket: UdpSocket,
    /// Abilities of the socket on this system, such as segmentation offload.
    state: UdpSocketState,
    address: SocketAddr,
    /// Granted size of the receive buffer, in the kernel's own count \[bytes\].
    granted: usize,
    config: EndpointConfig,
    outbox: Outbox,
    counts: EndpointCounts,
    order: ArrivalOrder,
}

impl UdpEndpoint {
    /// Opens a socket. Port number 0 lets the system choose a free port.
    ///
    /// # Errors
    ///
    /// [`BindError`] if the address is taken, or is no address of this machine.
    pub fn bind(address: SocketAddr, config: EndpointConfig) -> Result<Self, BindError> {
        Self::open(address, config).map_err(|source| BindError { address, source })
    }

    fn open(address: SocketAddr, config: EndpointConfig) -> io::Result<Self> {
        let family = if address.is_ipv6() { AddressFamily::INET6 } else { AddressFamily::INET };
        let socket = socket_with(family, SocketType::DGRAM, SocketFlags::CLOEXEC | SocketFlags::NONBLOCK, Some(ipproto::UDP))?;
        if address.is_ipv6() {
            sockopt::set_ipv6_v6only(&socket, true)?;
        }
        // The first call can exceed the system's limit, but needs CAP_NET_ADMIN. The second call grants at most the limit.
        if sockopt::set_socket_recv_buffer_size_force(&socket, config.receive_buffer).is_err() {
            sockopt::set_socket_recv_buffer_size(&socket, config.receive_buffer)?;
        }
        bind(&socket, &address)?;
        let socket = UdpSocket::from(socket);
        let state = UdpSocketState::new(UdpSockRef::from(&socket))?;
        // No caller needs the local address of a datagram. A message of the kernel with the address would take the room of the message with the congestion bits
        // of joined segments.
        if address.is_ipv6() {
            setsockopt(&socket, Ipv6RecvPacketInfo, &false)?;
        } else {
            setsockopt(&socket, Ipv4PacketInfo, &false)?;
        }
        // `UdpSocketState` has switched joining on if the kernel can. An older kernel does not know the option, and joins nothing.
        if !config.joined && state.gro_segments() > 1 {
            setsockopt(&socket, UdpGroSegment, &false)?;
        }
        let (address, granted) = (socket.local_addr()?, sockopt::socket_recv_buffer_size(&socket)?);
        Ok(Self { socket, state, address, granted, config, outbox: Outbox::default(), counts: EndpointCounts::default(), order: ArrivalOrder::NEW })
    }

    /// Returns the local address, with the port number chosen by the system.
    #[must_use]
    pub const fn local_address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the size of the receive buffer in the kernel's own count \[bytes\]. The kernel grants twice the size asked for, or less if the limit of the
    /// system (`sysctl net.core.rmem_max`) is lower.
    #[must_use]
    pub const fn granted_receive_buffer(&self) -> usize {
        self.granted
    }

    /// Returns the counters so far.
    #[must_use]
    pub const fn counts(&self) -> &EndpointCounts {
        &self.counts
    }

    /// Returns the number of datagrams dropped by the kernel because the receive buffer was full, or `None` if the system does not tell. Reads a file, which is
    /// too slow for each packet.
    ///
    /// # Errors
    ///
    /// The error of the system.
    pub fn kernel_drops(&self) -> io::Result<Option<u64>> {
        kernel_drops(&self.socket, self.address.is_ipv6())
    }

    /// Reads at most one batch and hands each datagram to `take`, in the order of arrival. Returns the number of datagrams given by the kernel; after fewer
    /// than [`UdpEndpoint::BATCH`] the socket is empty. Datagrams joined by the kernel count as one here ([`EndpointConfig::joined`]). Never blocks. All calls
    /// on one socket must use the same clock.
    ///
    /// # Errors
    ///
    /// The error of the system. Passing conditions are no errors: nothing to read, a report of an undelivered earlier datagram, a shortage of memory.
    pub fn receive(&mut self, buffers: &mut ReceiveBuffers, clock: &MonotonicClock, mut take: impl FnMut(Datagram<'_>)) -> io::Result<usize> {
        let (mut rooms, told) = buffers.rooms();
        let count = match self.state.recv(UdpSockRef::from(&self.socket), &mut rooms, told) {
            Ok(count) => count,
            Err(error) => return self.cannot_receive(error),
        };
        // The clocks are read after the datagrams, so no stamp lies in the future.
        let stamps = clock.stamps();
        let mut arrivals = [stamps.now(); BATCH_SIZE];
        for (arrival, told) in arrivals.iter_mut().zip(&buffers.told[..count]) {
            // All stamps of the batch use the same pair of readings, so that their differences stay exact.
            *arrival = stamps.instant(told.timestamp);
        }
        // The kernel begins to stamp a moment after a socket was opened. An earlier datagram is stamped when it is read, later than the datagrams after it. A
        // stamp that is not believed is the time of the reading, too.
        self.order.put_in_order(&mut arrivals[..count]);
        for (place, &at) in arrivals[..count].iter().enumerate() {
            let told = buffers.told[place];
            let bytes = buffers.room(place, told.len);
            // The kernel may have joined several datagrams of one sender; each but the last is `stride` bytes long. An empty datagram runs the loop once.
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

    /// Datagrams read by one call of the kernel.
    pub const BATCH: usize = BATCH_SIZE;

    /// Decides on an error of reading: passing errors are counted, and the result says whether to read again.
    fn cannot_receive(&mut self, error: io::Error) -> io::Result<usize> {
        match Errno::from_io_error(&error).unwrap_or(Errno::IO) {
            Errno::AGAIN => Ok(0),
            Errno::CONNREFUSED | Errno::CONNRESET | Errno::HOSTUNREACH | Errno::NETUNREACH => {
                self.counts.receive_errors += 1;
                // Another datagram may wait after the report.
                Ok(Self::BATCH)
            }
            // The condition passes, but reading again at once would not help.
            Errno::NETDOWN | Errno::NOBUFS | Errno::NOMEM => {
                self.counts.receive_errors += 1;
                Ok(0)
            }
            _ => Err(error),
        }
    }

    /// Queues a datagram for the next [`UdpEndpoint::flush`] and returns `true`. Beyond [`EndpointConfig::waiting`] the datagram is dropped and counted, and
    /// the result is `false`.
    pub fn queue(&mut self, to: SocketAddr, bytes: &[u8], ecn: Option<Ecn>) -> bool {
        let has_room = self.outbox.len() < self.config.waiting;
        if has_room {
            self.outbox.push(to, bytes, ecn);
        } else {
            self.counts.failures.full += 1;
        }
        has_room
    }

    /// Sends the queued datagrams in order until the kernel's buffer is full. The rest waits for the next call. A datagram that cannot be sent is counted, and
    /// the following datagrams are still sent.
    ///
    /// Consecutive datagrams to one address and of one length go in one call, and the system later cuts the bytes into datagrams (segmentation offload).
    pub fn flush(&mut self) {
        self.flush_with(|| (), |(), _| ());
    }

    /// Sends like [`UdpEndpoint::flush`]. Before each call of the kernel, `before` is asked, for example for the time. After the call, `done` gets the answer
    /// of `before` and the number of datagrams that were sent or given up, in the order of the queue. `done` is not called for datagrams that wait.
    pub fn flush_with<T>(&mut self, mut before: impl FnMut() -> T, mut done: impl FnMut(T, usize)) {
        let most = self.state.max_gso_segments();
        while self.outbox.len() > 0 {
            let asked = before();
            // Always found: the outbox is not empty.
            let Some(run) = self.outbox.next_run(most) else { return };
            self.counts.send_calls += 1;
            let mut settled = run.count;
            match send(&self.socket, &self.state, &run) {
                Ok(()) => {
                    self.counts.sent += run.count as u64;
                    self.outbox.take(settled);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    // The datagrams of this run wait, with all datagrams after them.
                    self.outbox.close_up();
                    return;
                }
                Err(error) => {
                    // The first datagram of the run is settled; the loop goes on with the others.
                    settled = 1;
                    self.cannot_send(&error);
                }
            }
            done(asked, settled);
        }
    }

    /// Sends a datagram at once, or drops and counts it if the kernel's buffer is full or earlier datagrams wait. Meant for a datagram that must not delay
    /// other datagrams, and for which the receiver asks again.
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

    /// Returns whether datagrams wait to be sent. After a flush they wait because the kernel's buffer is full.
    #[must_use]
    pub fn has_waiting(&self) -> bool {
        self.outbox.len() > 0
    }

    /// Settles the first waiting datagram after a call that failed with `error`: sends the datagram alone, or counts its loss.
    fn cannot_send(&mut self, error: &io::Error) {
        let Some(run) = self.outbox.next_run(1) else { return };
        // Another datagram of the same call can have caused the failure.
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

/// Sends the datagrams of a run in one call.
fn send(socket: &UdpSocket, state: &UdpSocketState, run: &Run<'_>) -> io::Result<()> {
    // A single datagram needs no segmentation, and may be longer than the longest segment.
    let segment_size = (run.count > 1).then_some(run.segment);
    let transmit = Transmit { destination: run.to, ecn: run.ecn, contents: run.bytes, segment_size, src_ip: None };
    state.try_send(UdpSockRef::from(socket), &transmit)
}

/// Memory for one batch, to be shared by all sockets of a thread. Takes 2 MB of address space, of which only pages in use need memory.
pub struct ReceiveBuffers {
    /// Rooms of [`ROOM`] bytes, one per datagram of a batch.
    bytes: Vec<u8>,
    /// Length, sender and marks of each datagram, as told by the kernel.
    pub(super) told: [RecvMeta; BATCH_SIZE],
}

/// Size of the room for one datagram \[bytes\]. The longest datagram has 65,527 bytes (IPv6), and joined segments are no longer, so nothing is ever cut off.
/// The size is not a power of two, because otherwise the beginnings of all datagrams of a batch would share one set of the processor's cache.
const ROOM: usize = 65_536 + 256;

impl Default for ReceiveBuffers {
    fn default() -> Self {
        Self::new()
    }
}

impl ReceiveBuffers {
    /// Returns empty buffers.
    #[must_use]
    pub fn new() -> Self {
        Self { bytes: vec![0; ROOM * BATCH_SIZE], told: [RecvMeta::default(); BATCH_SIZE] }
    }

    /// Returns the room and the metadata of each datagram, to be filled by the kernel.
    pub(super) fn rooms(&mut self) -> ([IoSliceMut<'_>; BATCH_SIZE], &mut [RecvMeta; BATCH_SIZE]) {
        let mut rooms = self.bytes.chunks_exact_mut(ROOM);
        (core::array::from_fn(|_| IoSliceMut::new(rooms.next().unwrap_or_default())), &mut self.told)
    }

    /// Returns the first `len` bytes of a room.
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

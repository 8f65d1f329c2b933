//! State of a UDP socket: address and peer, the datagrams in the buffer, and the tasks that wait for datagrams.

use std::collections::VecDeque;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV6};
use std::num::NonZeroU8;

use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use super::bound::Port;
use super::multicast::Multicast;
use super::waking::{Waiters, Woken};
use super::{Ends, Parcel, SocketName, mapped, unmapped};
use crate::address::Addresses;
use crate::errno::Errno;
use crate::groups::Group;
use crate::trace::Lost;
use crate::wire::Held;

/// Access of the readers to a received datagram.
impl Parcel {
    #[inline]
    pub(crate) fn from(&self) -> SocketAddr {
        self.addresses.from()
    }

    /// Returns the address to which the datagram was sent.
    #[cfg(any(feature = "facade", feature = "quinn"))]
    pub(crate) fn to(&self) -> IpAddr {
        self.addresses.to().ip()
    }

    /// Returns the ECN codepoint on arrival.
    #[cfg(any(feature = "facade", feature = "quinn"))]
    pub(crate) const fn codepoint(&self) -> cohaptic_units::Ecn {
        if self.arrival.marked { cohaptic_units::Ecn::Congestion } else { self.ecn }
    }

    /// Copies the datagram into `buffer`, cut to the length of the buffer. Returns the number of bytes copied.
    #[inline]
    pub(crate) fn copy_to(&self, buffer: &mut [u8]) -> usize {
        let bytes: &[u8] = &self.bytes;
        let len = bytes.len().min(buffer.len());
        buffer[..len].copy_from_slice(&bytes[..len]);
        len
    }
}

#[derive(Debug)]
pub(crate) struct SocketState {
    pub(super) host: NodeId,
    /// Address to which the socket is bound, as [`Addresses::short`]; `None` if the socket is bound to all addresses of its host.
    pub(super) at: Option<u32>,
    /// Flags and scope of the group of IPv6 to which the socket is bound: see [`Group`]. `None` for all other addresses.
    pub(super) scope: Option<NonZeroU8>,
    pub(super) port: Port,
    /// Peer of a connected socket, with the address on packets: of IPv4 also if the socket is of IPv6.
    pub(super) peer: Option<SocketAddr>,
    /// Size of the receive buffer \[byte\].
    pub(super) room: usize,
    pub(super) inbox: VecDeque<Box<Parcel>>,
    /// Memory that Linux would count for all datagrams in `inbox` \[bytes\].
    pub(super) memory: usize,
    pub(super) readers: Waiters,
    /// `true` if IP has refused a sent datagram, and the program has not been told.
    pub(super) refused: bool,
    pub(super) may_broadcast: bool,
    /// Settings and groups of a socket that has to do with multicast; `None` for most sockets.
    pub(super) multicast: Option<Box<Multicast>>,
    /// Instant at which the host crashed or the program of the host was killed; `None` while the socket lives.
    pub(super) died: Option<Instant>,
}

impl SocketState {
    /// Puts a datagram into the buffer. `all` counts the bytes of the whole run, of the datagram too. A datagram whose memory does not fit is lost, unless the
    /// buffer is empty.
    #[inline(always)]
    pub(super) fn keep(&mut self, mut parcel: Box<Parcel>, all: &mut Held, woken: &mut Woken) -> Result<(), Lost> {
        let (len, is_six) = (parcel.bytes.len(), parcel.addresses.is_six);
        // The program of a socket of IPv4 sees the addresses as they are.
        if self.port.is_six() {
            parcel.addresses.is_mapped = !is_six;
        }
        parcel.memory = memory_of(len, is_six);
        let memory = self.memory + parcel.memory;
        // An empty buffer takes a datagram of any length: otherwise a program with a small buffer would never receive a long datagram.
        if memory > self.room && self.memory > 0 {
            all.remove(Held::cost(len));
            return Err(Lost::BufferFull);
        }
        self.memory = memory;
        self.inbox.push_back(parcel);
        self.readers.wake(woken);
        Ok(())
    }

    /// Returns the bytes of the datagrams in the buffer, as [`Held`] counts them. Counted here, because only the end of a socket and the message of a failure
    /// need the number.
    pub(super) fn cost(&self) -> u64 {
        self.inbox.iter().map(|datagram| Held::cost(datagram.bytes.len())).sum()
    }

    /// Drops all datagrams in the buffer.
    pub(super) fn clear(&mut self, all: &mut Held) {
        all.remove(self.cost());
        self.inbox.clear();
        self.memory = 0;
    }

    pub(super) fn name(&self) -> SocketName {
        SocketName { kind: "UDP", host: self.host, local: self.local(), peer: None }
    }

    /// Returns whether the next call returns an error.
    #[inline]
    pub(super) const fn has_error(&self) -> bool {
        // `|` evaluates both operands: one branch is cheaper than two.
        self.died.is_some() | self.refused
    }

    /// Returns the local address of the socket.
    pub(super) fn local(&self) -> SocketAddr {
        let (is_six, number) = (self.port.is_six(), self.port.number());
        if let Some(at) = self.at.filter(|_| self.scope.is_some())
            && let IpAddr::V6(group) = (Group { short: at, scope: self.scope }).address()
        {
            let zone = self.multicast.as_deref().map_or(0, |multicast| multicast.zone);
            return SocketAddrV6::new(group, number, 0, zone).into();
        }
        let ip = match self.at {
            Some(at) => Addresses::long(at, is_six),
            None if is_six => Ipv6Addr::UNSPECIFIED.into(),
            None => Ipv4Addr::UNSPECIFIED.into(),
        };
        SocketAddr::new(ip, number)
    }

    /// Returns whether the socket is bound to `ip`, alone or among all addresses.
    pub(super) fn is_at(&self, ip: IpAddr) -> bool {
        self.at.is_none() || self.local().ip() == ip
    }

    /// Returns whether the socket is bound to all addresses of both versions of IP.
    #[inline]
    fn is_dual(&self) -> bool {
        self.at.is_none() && self.port.is_six()
    }

    /// Returns the port in each version of IP over which the socket receives.
    pub(super) fn versions(&self) -> impl Iterator<Item = Port> + use<> {
        std::iter::once(self.port).chain(self.is_dual().then(|| Port::new(false, self.port.number())))
    }

    /// Returns an address of a packet in the form for the program.
    pub(super) fn shown(&self, address: SocketAddr) -> SocketAddr {
        if self.port.is_six() { mapped(address) } else { address }
    }

    /// Returns the address from which the socket sends, as [`Addresses::short`]; `None` if the host chooses. As with Linux, the address of a group is no
    /// source.
    #[inline]
    pub(super) fn source_at(&self) -> Option<u32> {
        if self.scope.is_some() { None } else { self.at }
    }

    /// Returns whether [`SocketState::wire_form`] surely returns the same address.
    #[inline]
    pub(super) const fn is_wire_form(&self, to: &SocketAddr) -> bool {
        to.is_ipv4() && !self.port.is_six()
    }

    /// Returns whether the socket receives a datagram between these ends, which goes to the port and the host of the socket.
    #[inline]
    pub(super) fn hears(&self, ends: &Ends) -> bool {
        self.at.is_none_or(|at| at == ends.to && self.scope == ends.scope) && self.peer.is_none_or(|peer| peer == ends.from())
    }

    /// Returns the address of the other end of a packet of this socket. A mapped address such as `::ffff:10.0.0.1` becomes an address of IPv4, because packets
    /// to such an address travel over IPv4.
    ///
    /// # Errors
    ///
    /// If the socket cannot send packets of the version of IP of `to`.
    #[inline(never)]
    pub(super) fn wire_form(&self, to: SocketAddr) -> io::Result<SocketAddr> {
        let form = if self.port.is_six() { unmapped(to) } else { to };
        if form.is_ipv6() == self.port.is_six() || self.is_dual() {
            return Ok(form);
        }
        // A socket that is bound to an address of IPv6 has no address of IPv4 to send from.
        if self.port.is_six() { Errno::NetworkUnreachable.fail() } else { Errno::OtherVersion.fail() }
    }

    /// Handles the message of IP that no socket is bound to the port `by`. A socket that is not connected to `by` ignores the message.
    #[inline(never)]
    pub(super) fn refuse(&mut self, by: SocketAddr, woken: &mut Woken) {
        if self.peer == Some(by) {
            self.refused = true;
            self.readers.wake(woken);
        }
    }

    pub(super) fn die(&mut self, at: Instant, all: &mut Held, woken: &mut Woken) {
        self.died = Some(at);
        self.clear(all);
        self.readers.wake(woken);
    }
}

/// Returns the memory that Linux counts for a received datagram of `len` bytes (`SKB_TRUESIZE`): a descriptor of 256 bytes, and a piece of memory for headers
/// and data whose size is a power of two, apart from the smallest.
#[inline]
const fn memory_of(len: usize, is_six: bool) -> usize {
    let used = len + if is_six { 72 } else { 59 };
    if used <= 256 { 832 } else { 256 + (used + 320).next_power_of_two() }
}

//! Implementation of the trait of UDP sockets of `cohaptic-sockets`: see [`crate::facade`].

use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::task::{Context, Poll};

use cohaptic_sockets::{DatagramOption, Datagrams, Interface, Membership, Received, Sending, Version};
use cohaptic_units::Ecn;

use super::{KIND, UdpSocket};
use crate::core::{self, Parcel};

impl Datagrams for UdpSocket {
    fn poll_receive(&self, cx: &mut Context<'_>, peek: bool, take: &mut dyn FnMut(Received<'_>)) -> Poll<io::Result<()>> {
        let look = |datagram: &Parcel| take(received(datagram));
        if peek { self.poll_look::<true, _>(cx, look) } else { self.poll_look::<false, _>(cx, look) }
    }

    fn try_receive(&self, peek: bool, take: &mut dyn FnMut(Received<'_>)) -> io::Result<()> {
        let look = |datagram: &Parcel| take(received(datagram));
        if peek { self.try_look::<true, _>(look) } else { self.try_look::<false, _>(look) }
    }

    fn poll_readable(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.poll_recv_ready(cx)
    }

    fn is_readable(&self) -> io::Result<bool> {
        self.shared.open(self.host, KIND, |core| core.is_readable(self.id))
    }

    fn send_as(&self, bytes: &[u8], sending: Sending) -> io::Result<usize> {
        self.send_now(sending.to.as_ref(), sending.from, bytes, Ecn::from_bits(sending.ecn))
    }

    fn connect(&self, to: SocketAddr) -> io::Result<()> {
        self.connect_now(to)
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Self::local_addr(self)
    }

    fn peer_addr(&self) -> io::Result<SocketAddr> {
        Self::peer_addr(self)
    }

    fn take_error(&self) -> io::Result<Option<io::Error>> {
        Self::take_error(self)
    }

    fn option(&self, option: DatagramOption) -> io::Result<u32> {
        match option {
            DatagramOption::Broadcast => self.broadcast().map(u32::from),
            DatagramOption::Ttl => self.ttl(),
            DatagramOption::TypeOfService => self.tos_v4(),
            DatagramOption::TrafficClass => self.tclass_v6(),
            DatagramOption::MulticastTtl => self.multicast_ttl_v4(),
            DatagramOption::MulticastLoop4 => self.multicast_loop_v4().map(u32::from),
            DatagramOption::MulticastLoop6 => self.multicast_loop_v6().map(u32::from),
            DatagramOption::MulticastHops => self.multicast_hops_v6(),
            DatagramOption::MulticastInterface4 => self.multicast_if_v4().map(Ipv4Addr::to_bits),
            DatagramOption::MulticastInterface6 => self.multicast_if_v6(),
        }
    }

    fn set_option(&self, option: DatagramOption, value: u32) -> io::Result<()> {
        match option {
            DatagramOption::Broadcast => self.set_broadcast(value != 0),
            DatagramOption::Ttl => self.set_ttl(value),
            DatagramOption::TypeOfService => self.set_tos_v4(value),
            DatagramOption::TrafficClass => self.set_tclass_v6(value),
            DatagramOption::MulticastTtl => self.set_multicast_ttl_v4(value),
            DatagramOption::MulticastLoop4 => self.set_multicast_loop_v4(value != 0),
            DatagramOption::MulticastLoop6 => self.set_multicast_loop_v6(value != 0),
            DatagramOption::MulticastHops => self.set_multicast_hops_v6(value),
            DatagramOption::MulticastInterface4 => self.set_multicast_if_v4(&Ipv4Addr::from_bits(value)),
            DatagramOption::MulticastInterface6 => self.set_multicast_if_v6(value),
        }
    }

    fn select_interface(&self, version: Version, interface: Interface) -> io::Result<()> {
        self.set_multicast_interface(version == Version::Six, named(interface))
    }

    fn change_membership(&self, membership: Membership) -> io::Result<()> {
        match membership {
            Membership::Join { group, interface } => self.join_group(group, named(interface)),
            Membership::Leave { group, interface } => self.leave_group(group, named(interface)),
        }
    }
}

const fn named(interface: Interface) -> core::Interface {
    match interface {
        Interface::Address(address) => core::Interface::Address(address),
        Interface::Number(number) => core::Interface::Number(number),
    }
}

fn received(datagram: &Parcel) -> Received<'_> {
    Received { bytes: &datagram.bytes, from: datagram.from(), to: datagram.to(), ecn: datagram.codepoint().bits() }
}

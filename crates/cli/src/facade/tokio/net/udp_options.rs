//! Options of UDP sockets.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr};

use cohaptic_sockets::{DatagramOption, Interface, Membership};

use super::super::{Either, either};
use super::UdpSocket;

/// Getters and setters of options.
macro_rules! options {
    ($($(#[$condition:meta])* $get:ident, $set:ident: $kind:ty = $option:ident, |$value:ident| $read:expr;)*) => {
        $(
            $(#[$condition])*
            #[doc = concat!("See `tokio::net::UdpSocket::", stringify!($get), "`.")]
            pub fn $get(&self) -> io::Result<$kind> {
                either!(&self.0, |socket| socket.$get(), socket.option(DatagramOption::$option).map(|$value| $read))
            }

            $(#[$condition])*
            #[doc = concat!("See `tokio::net::UdpSocket::", stringify!($set), "`.")]
            pub fn $set(&self, value: $kind) -> io::Result<()> {
                either!(&self.0, |socket| socket.$set(value), socket.set_option(DatagramOption::$option, value.into()))
            }
        )*
    };
}

impl UdpSocket {
    options! {
        broadcast, set_broadcast: bool = Broadcast, |value| value != 0;
        multicast_loop_v4, set_multicast_loop_v4: bool = MulticastLoop4, |value| value != 0;
        multicast_ttl_v4, set_multicast_ttl_v4: u32 = MulticastTtl, |value| value;
        multicast_loop_v6, set_multicast_loop_v6: bool = MulticastLoop6, |value| value != 0;
        ttl, set_ttl: u32 = Ttl, |value| value;
    }

    //@ has net/udp.rs|pub fn tos_v4
    options! {
        #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "ios", target_os = "freebsd", windows))]
        tos_v4, set_tos_v4: u32 = TypeOfService, |value| value;
        #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
        tclass_v6, set_tclass_v6: u32 = TrafficClass, |value| value;
    }

    /// See `tokio::net::UdpSocket::tos`.
    #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "ios", target_os = "freebsd", windows))]
    #[deprecated(note = "use `tos_v4`")]
    #[allow(deprecated, reason = "the method of tokio is deprecated as well")]
    pub fn tos(&self) -> io::Result<u32> {
        either!(&self.0, |socket| socket.tos(), socket.option(DatagramOption::TypeOfService))
    }

    /// See `tokio::net::UdpSocket::set_tos`.
    #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "ios", target_os = "freebsd", windows))]
    #[deprecated(note = "use `set_tos_v4`")]
    #[allow(deprecated, reason = "the method of tokio is deprecated as well")]
    pub fn set_tos(&self, tos: u32) -> io::Result<()> {
        either!(&self.0, |socket| socket.set_tos(tos), socket.set_option(DatagramOption::TypeOfService, tos))
    }

    /// See `tokio::net::UdpSocket::device`.
    #[cfg(any(target_os = "android", target_os = "fuchsia", target_os = "linux"))]
    pub fn device(&self) -> io::Result<Option<Vec<u8>>> {
        either!(&self.0, |socket| socket.device(), socket.local_addr().map(|_| None))
    }

    /// See `tokio::net::UdpSocket::bind_device`. A test bed has no devices.
    #[cfg(any(target_os = "android", target_os = "fuchsia", target_os = "linux"))]
    pub fn bind_device(&self, interface: Option<&[u8]>) -> io::Result<()> {
        match &self.0 {
            Either::Real(socket) => socket.bind_device(interface),
            Either::Bed(_) => Err(crate::net::no_devices()),
        }
    }

    /// See `tokio::net::UdpSocket::join_multicast_v4`.
    pub fn join_multicast_v4(&self, group: Ipv4Addr, interface: Ipv4Addr) -> io::Result<()> {
        either!(
            &self.0,
            |socket| socket.join_multicast_v4(group, interface),
            socket.change_membership(Membership::Join { group: group.into(), interface: Interface::Address(interface) })
        )
    }

    /// See `tokio::net::UdpSocket::join_multicast_v6`.
    pub fn join_multicast_v6(&self, group: &Ipv6Addr, interface: u32) -> io::Result<()> {
        either!(
            &self.0,
            |socket| socket.join_multicast_v6(group, interface),
            socket.change_membership(Membership::Join { group: (*group).into(), interface: Interface::Number(interface) })
        )
    }

    /// See `tokio::net::UdpSocket::leave_multicast_v4`.
    pub fn leave_multicast_v4(&self, group: Ipv4Addr, interface: Ipv4Addr) -> io::Result<()> {
        either!(
            &self.0,
            |socket| socket.leave_multicast_v4(group, interface),
            socket.change_membership(Membership::Leave { group: group.into(), interface: Interface::Address(interface) })
        )
    }

    /// See `tokio::net::UdpSocket::leave_multicast_v6`.
    pub fn leave_multicast_v6(&self, group: &Ipv6Addr, interface: u32) -> io::Result<()> {
        either!(
            &self.0,
            |socket| socket.leave_multicast_v6(group, interface),
            socket.change_membership(Membership::Leave { group: (*group).into(), interface: Interface::Number(interface) })
        )
    }
}

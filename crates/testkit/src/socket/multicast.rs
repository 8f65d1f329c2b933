//! Multicast of a socket: groups, limits, and the outgoing interface.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use super::UdpSocket;
use crate::core::{Interface, MulticastSettings};
use crate::errno::Errno;

impl UdpSocket {
    /// Returns the time to live of multicast over IPv4. The default is 1, as with Linux.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn multicast_ttl_v4(&self) -> io::Result<u32> {
        self.multicast(false, |settings| settings.ttl)
    }

    /// Sets the time to live of multicast over IPv4, from 0 to 255. With 0 a datagram reaches the own host alone. All other values mean the network of the
    /// host: a test bed has no multicast routers.
    ///
    /// # Errors
    ///
    /// If `ttl` is out of range, or the host of the socket has crashed.
    pub fn set_multicast_ttl_v4(&self, ttl: u32) -> io::Result<()> {
        self.set_multicast_ttl(false, ttl)
    }

    /// Returns the limit of hops of multicast over IPv6. The default is 1, as with Linux.
    ///
    /// # Errors
    ///
    /// `EOPNOTSUPP` for a socket of IPv4, as with Linux, or if the host of the socket has crashed.
    pub fn multicast_hops_v6(&self) -> io::Result<u32> {
        self.multicast(true, |settings| settings.ttl)
    }

    /// Sets the limit of hops of multicast over IPv6, from 0 to 255: see [`UdpSocket::set_multicast_ttl_v4`].
    ///
    /// # Errors
    ///
    /// If `hops` is out of range, the host of the socket has crashed, or `ENOPROTOOPT` for a socket of IPv4, as with Linux.
    pub fn set_multicast_hops_v6(&self, hops: u32) -> io::Result<()> {
        self.set_multicast_ttl(true, hops)
    }

    fn set_multicast_ttl(&self, is_six: bool, ttl: u32) -> io::Result<()> {
        if ttl > 255 {
            return Errno::InvalidInput.fail();
        }
        self.open(|core| core.multicast_settings(self.id, is_six).map(|settings| settings.ttl = ttl))?
    }

    /// Returns a setting for multicast over a version of IP.
    fn multicast<T>(&self, is_six: bool, look: impl FnOnce(&MulticastSettings) -> T) -> io::Result<T> {
        // As with Linux, reading and writing an option of the other version fail with different numbers.
        self.open(|core| core.multicast_settings(self.id, is_six).map_or_else(|_| Errno::NotSupported.fail(), |settings| Ok(look(settings))))?
    }

    /// Returns whether sockets of the own host hear the multicast of this socket over IPv4. The default is `true`, as with Linux.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn multicast_loop_v4(&self) -> io::Result<bool> {
        self.multicast(false, |settings| settings.loops)
    }

    /// Sets whether sockets of the own host hear the multicast of this socket over IPv4.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn set_multicast_loop_v4(&self, on: bool) -> io::Result<()> {
        self.open(|core| core.multicast_settings(self.id, false).map(|settings| settings.loops = on))?
    }

    /// Returns whether sockets of the own host hear the multicast of this socket over IPv6. The default is `true`, as with Linux.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::multicast_hops_v6`].
    pub fn multicast_loop_v6(&self) -> io::Result<bool> {
        self.multicast(true, |settings| settings.loops)
    }

    /// Sets whether sockets of the own host hear the multicast of this socket over IPv6.
    ///
    /// # Errors
    ///
    /// `ENOPROTOOPT` for a socket of IPv4, as with Linux, or if the host of the socket has crashed.
    pub fn set_multicast_loop_v6(&self, on: bool) -> io::Result<()> {
        self.open(|core| core.multicast_settings(self.id, true).map(|settings| settings.loops = on))?
    }

    /// Returns the address by which the interface for multicast over IPv4 was selected; unspecified if the host chooses.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn multicast_if_v4(&self) -> io::Result<Ipv4Addr> {
        self.multicast(false, |settings| settings.named)
    }

    /// Selects the interface for multicast over IPv4: the interface with the address `interface`, or the uplink with the unspecified address. Datagrams of a socket
    /// that is bound to all addresses have the address of the interface as their source.
    ///
    /// # Errors
    ///
    /// `EADDRNOTAVAIL`, as with Linux, if the host does not have the address, or if the host of the socket has crashed.
    pub fn set_multicast_if_v4(&self, interface: &Ipv4Addr) -> io::Result<()> {
        self.set_multicast_interface(false, Interface::Address(*interface))
    }

    /// Returns the number of the interface for multicast over IPv6; 0 if the host chooses.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::multicast_hops_v6`].
    pub fn multicast_if_v6(&self) -> io::Result<u32> {
        self.multicast(true, |settings| settings.interface)
    }

    /// Selects the interface for multicast over IPv6 by its number: 1 is loopback, the interfaces of the host have the numbers from 2 on in the order of
    /// [`Testbed::interfaces`](crate::Testbed::interfaces), and 0 means the uplink. A host without configured interfaces has the one with the number 2.
    ///
    /// # Errors
    ///
    /// `ENODEV`, as with Linux, if the host does not have the interface, and as [`UdpSocket::set_multicast_loop_v6`].
    pub fn set_multicast_if_v6(&self, interface: u32) -> io::Result<()> {
        self.set_multicast_interface(true, Interface::Number(interface))
    }

    /// Selects the interface for multicast over a version of IP.
    pub(super) fn set_multicast_interface(&self, is_six: bool, interface: Interface) -> io::Result<()> {
        self.open(|core| core.select_interface(self.id, is_six, interface))?
    }

    /// Joins a multicast group. Datagrams of hosts in the same network to the group then reach the sockets of this host that are bound to the port, and to all
    /// addresses or to the address of the group. `interface` is an address of the host, or unspecified. The membership ends with the socket.
    ///
    /// # Errors
    ///
    /// As on Linux: `EINVAL` if `group` is no multicast address, `ENODEV` if the host does not have the address `interface`, `EADDRINUSE` if the socket has
    /// joined the group already.
    pub fn join_multicast_v4(&self, group: Ipv4Addr, interface: Ipv4Addr) -> io::Result<()> {
        self.join_group(group.into(), Interface::Address(interface))
    }

    /// Joins a multicast group of IPv6: see [`UdpSocket::join_multicast_v4`]. `interface` is a number as in [`UdpSocket::set_multicast_if_v6`].
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::join_multicast_v4`]; `ENOPROTOOPT` for a socket of IPv4. [`io::ErrorKind::Unsupported`] for a group whose identifier has more than 32
    /// bits, such as `ff3e:20:2001:db8::1`: a test bed does not have such groups.
    pub fn join_multicast_v6(&self, group: &Ipv6Addr, interface: u32) -> io::Result<()> {
        self.join_group((*group).into(), Interface::Number(interface))
    }

    /// Joins a multicast group by an interface.
    pub(super) fn join_group(&self, group: IpAddr, interface: Interface) -> io::Result<()> {
        self.open(|core| core.join_group(self.id, group, interface))?
    }

    /// Leaves a multicast group. `interface` is the address of [`UdpSocket::join_multicast_v4`], or unspecified for the first membership in the group.
    ///
    /// # Errors
    ///
    /// As on Linux: `EINVAL` if `group` is no multicast address, `EADDRNOTAVAIL` if the socket has not joined the group by this interface.
    pub fn leave_multicast_v4(&self, group: Ipv4Addr, interface: Ipv4Addr) -> io::Result<()> {
        self.leave_group(group.into(), Interface::Address(interface))
    }

    /// Leaves a multicast group of IPv6. `interface` is the number of the interface, or 0 for the first membership in the group.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::leave_multicast_v4`] and [`UdpSocket::join_multicast_v6`].
    pub fn leave_multicast_v6(&self, group: &Ipv6Addr, interface: u32) -> io::Result<()> {
        self.leave_group((*group).into(), Interface::Number(interface))
    }

    /// Leaves a multicast group by an interface.
    pub(super) fn leave_group(&self, group: IpAddr, interface: Interface) -> io::Result<()> {
        self.open(|core| core.leave_group(self.id, group, interface))?
    }
}

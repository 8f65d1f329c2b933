//! `getsockopt` and `setsockopt`. The kernel keeps the options of a placeholder, except for the options that this file names.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use cohaptic_descriptors::{MulticastChange, Numbered, calls};
use cohaptic_sockets::{Interface, Membership, Version};
use libc::{c_int, c_void, socklen_t};

use crate::caught::{on, real};
use crate::memory::{bytes, fail, length_of};

/// Returns whether a test bed does not have an option: the offloads of `UDP_SEGMENT` and `UDP_GRO`, figures of a connection in the form of Linux, and groups
/// that are joined by other options than those of [`multicast`]. Programs that ask for these options do without where a system does not have them. The system
/// itself would join the group on a real interface.
fn is_missing(level: c_int, name: c_int) -> bool {
    match level {
        libc::IPPROTO_UDP => matches!(name, libc::UDP_SEGMENT | libc::UDP_GRO),
        libc::IPPROTO_TCP => name == libc::TCP_INFO,
        libc::IPPROTO_IP => matches!(name, libc::IP_ADD_SOURCE_MEMBERSHIP | libc::MCAST_JOIN_GROUP | libc::MCAST_JOIN_SOURCE_GROUP),
        libc::IPPROTO_IPV6 => matches!(name, libc::MCAST_JOIN_GROUP | libc::MCAST_JOIN_SOURCE_GROUP),
        _ => false,
    }
}

/// See `getsockopt(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn getsockopt(fd: c_int, level: c_int, name: c_int, value: *mut c_void, length: *mut socklen_t) -> c_int {
    let served = on("getsockopt", fd, |of| {
        let number = match (level, name) {
            (libc::SOL_SOCKET, libc::SO_ERROR) => match calls::error(of)? {
                Ok(error) => error.map_or(0, |error| error.raw_os_error().unwrap_or(libc::EIO)),
                Err(error) => return Some(Err(error)),
            },
            (libc::SOL_SOCKET, libc::SO_ACCEPTCONN) => c_int::from(calls::is_listening(of)?),
            (libc::IPPROTO_IP, libc::IP_MULTICAST_IF) => match calls::multicast_interface(of, Version::Four)? {
                // The bytes of the address are in the order of the network.
                Ok(address) => c_int::from_ne_bytes(address.to_be_bytes()),
                Err(error) => return Some(Err(error)),
            },
            (libc::IPPROTO_IPV6, libc::IPV6_MULTICAST_IF) => match calls::multicast_interface(of, Version::Six)? {
                Ok(number) => number.cast_signed(),
                Err(error) => return Some(Err(error)),
            },
            _ if is_missing(level, name) => return Some(fail(libc::ENOPROTOOPT)),
            _ => return None,
        };
        if length.is_null() || value.is_null() {
            return Some(fail(libc::EFAULT));
        }
        // SAFETY: the caller promises a length.
        let room = unsafe { length.read() };
        if room < length_of::<c_int>() {
            return Some(fail(libc::EINVAL));
        }
        // SAFETY: the caller promises memory of at least this length, perhaps not aligned for a number.
        unsafe { value.cast::<c_int>().write_unaligned(number) };
        // SAFETY: the caller promises a length that can be written.
        unsafe { length.write(length_of::<c_int>()) };
        Some(Ok(0))
    });
    served.unwrap_or_else(|| {
        let real = real!(getsockopt: unsafe extern "C" fn(c_int, c_int, c_int, *mut c_void, *mut socklen_t) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(fd, level, name, value, length) }
    })
}

/// See `setsockopt(2)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn setsockopt(fd: c_int, level: c_int, name: c_int, value: *const c_void, length: socklen_t) -> c_int {
    let real = real!(setsockopt: unsafe extern "C" fn(c_int, c_int, c_int, *const c_void, socklen_t) -> c_int);
    let served = on("setsockopt", fd, |of| {
        if is_missing(level, name) {
            return Some(fail(libc::ENOPROTOOPT));
        }
        // SAFETY: the caller promises the value.
        if let Some(changed) = unsafe { multicast(of, level, name, value, length) } {
            return Some(changed.map(|()| 0));
        }
        if (level, name) == (libc::SOL_SOCKET, libc::SO_BINDTODEVICE) {
            // A test bed has no devices.
            return Some(fail(libc::ENODEV));
        }
        // SAFETY: the caller keeps the contract of the C library's function.
        if unsafe { real(fd, level, name, value, length) } != 0 {
            return Some(Err(io::Error::last_os_error()));
        }
        Some(calls::option_set(of).map(|()| 0))
    });
    // SAFETY: the caller keeps the contract of the C library's function.
    served.unwrap_or_else(|| unsafe { real(fd, level, name, value, length) })
}

/// Joins or leaves a multicast group in the test bed, or selects the interface for multicast. Returns `None` for another option.
///
/// # Safety
///
/// `value` is valid for reading `length` bytes.
unsafe fn multicast(of: Numbered<'_>, level: c_int, name: c_int, value: *const c_void, length: socklen_t) -> Option<io::Result<()>> {
    let parse: fn(&[u8]) -> Option<MulticastChange> = match (level, name) {
        (libc::IPPROTO_IP, libc::IP_ADD_MEMBERSHIP) => |value| group_v4(value).map(|(group, interface)| join(group, interface)),
        (libc::IPPROTO_IP, libc::IP_DROP_MEMBERSHIP) => |value| group_v4(value).map(|(group, interface)| leave(group, interface)),
        (libc::IPPROTO_IP, libc::IP_MULTICAST_IF) => {
            |value| interface_v4(value).map(|interface| MulticastChange::Interface(Version::Four, interface))
        }
        (libc::IPPROTO_IPV6, libc::IPV6_ADD_MEMBERSHIP) => |value| group_v6(value).map(|(group, interface)| join(group, interface)),
        (libc::IPPROTO_IPV6, libc::IPV6_DROP_MEMBERSHIP) => |value| group_v6(value).map(|(group, interface)| leave(group, interface)),
        (libc::IPPROTO_IPV6, libc::IPV6_MULTICAST_IF) => {
            |value| number(value, 0).map(|number| MulticastChange::Interface(Version::Six, Interface::Number(number)))
        }
        _ => return None,
    };
    if value.is_null() {
        return Some(fail(libc::EFAULT));
    }
    // SAFETY: the caller promises the bytes.
    let value = unsafe { bytes(value, length as usize) };
    match parse(value) {
        Some(change) => calls::change_multicast(of, change),
        None => Some(fail(libc::EINVAL)),
    }
}

const fn join(group: IpAddr, interface: Interface) -> MulticastChange {
    MulticastChange::Membership(Membership::Join { group, interface })
}

const fn leave(group: IpAddr, interface: Interface) -> MulticastChange {
    MulticastChange::Membership(Membership::Leave { group, interface })
}

/// Returns `N` bytes of a value from index `from` on, or `None` if the value is shorter.
fn part<const N: usize>(value: &[u8], from: usize) -> Option<[u8; N]> {
    value.get(from..)?.first_chunk().copied()
}

fn number(value: &[u8], from: usize) -> Option<u32> {
    part(value, from).map(u32::from_ne_bytes)
}

fn address_v4(value: &[u8], from: usize) -> Option<Ipv4Addr> {
    part::<4>(value, from).map(Ipv4Addr::from)
}

/// Reads an `ip_mreq`: group, and address of the interface. A longer value is an `ip_mreqn`, whose number of an interface counts before the address if it is not 0.
fn group_v4(value: &[u8]) -> Option<(IpAddr, Interface)> {
    let (group, address) = (address_v4(value, 0)?, address_v4(value, 4)?);
    let interface = number(value, 8).filter(|number| *number != 0).map_or(Interface::Address(address), Interface::Number);
    Some((group.into(), interface))
}

/// Reads the interface for sent datagrams: an `in_addr`, or an `ip_mreq` or `ip_mreqn`, of which the group is ignored.
fn interface_v4(value: &[u8]) -> Option<Interface> {
    match group_v4(value) {
        Some((_, interface)) => Some(interface),
        None => address_v4(value, 0).map(Interface::Address),
    }
}

/// Reads an `ipv6_mreq`: group, and number of the interface.
fn group_v6(value: &[u8]) -> Option<(IpAddr, Interface)> {
    Some((Ipv6Addr::from(part::<16>(value, 0)?).into(), Interface::Number(number(value, 16)?)))
}

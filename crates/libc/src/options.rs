//! `getsockopt` and `setsockopt`. The kernel keeps the options of a placeholder, except for the options that this file names.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr};

use cohaptic_descriptors::{Numbered, calls};
use cohaptic_sockets::Membership;
use libc::{c_int, c_void, socklen_t};

use crate::caught::{on, real};
use crate::memory::{bytes, fail, length_of};

/// Returns whether a test bed does not have an option: the offloads of `UDP_SEGMENT` and `UDP_GRO`, figures of a connection in the form of Linux, and groups
/// that are joined by other options than those of [`membership`]. Programs that ask for these options do without where a system does not have them. The system
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
        if let Some(changed) = unsafe { membership(of, level, name, value, length) } {
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

/// Joins or leaves a multicast group in the test bed. Returns `None` for another option.
///
/// # Safety
///
/// `value` is valid for reading `length` bytes.
unsafe fn membership(of: Numbered<'_>, level: c_int, name: c_int, value: *const c_void, length: socklen_t) -> Option<io::Result<()>> {
    let is_join = match (level, name) {
        (libc::IPPROTO_IP, libc::IP_ADD_MEMBERSHIP) | (libc::IPPROTO_IPV6, libc::IPV6_ADD_MEMBERSHIP) => true,
        (libc::IPPROTO_IP, libc::IP_DROP_MEMBERSHIP) | (libc::IPPROTO_IPV6, libc::IPV6_DROP_MEMBERSHIP) => false,
        _ => return None,
    };
    if value.is_null() {
        return Some(fail(libc::EFAULT));
    }
    // SAFETY: the caller promises the bytes.
    let value = unsafe { bytes(value, length as usize) };
    let membership = if level == libc::IPPROTO_IP {
        // `ip_mreq`, or `ip_mreqn` with the number of an interface at the end: group and address of the interface.
        let (Some(group), Some(interface)) = (value.first_chunk::<4>(), value.get(4..8).and_then(<[u8]>::first_chunk::<4>)) else {
            return Some(fail(libc::EINVAL));
        };
        let (group, interface) = (Ipv4Addr::from(*group), Ipv4Addr::from(*interface));
        if is_join { Membership::Join4 { group, interface } } else { Membership::Leave4 { group, interface } }
    } else {
        // `ipv6_mreq`: group and number of the interface.
        let (Some(group), Some(interface)) = (value.first_chunk::<16>(), value.get(16..20).and_then(<[u8]>::first_chunk::<4>)) else {
            return Some(fail(libc::EINVAL));
        };
        let (group, interface) = (Ipv6Addr::from(*group), u32::from_ne_bytes(*interface));
        if is_join { Membership::Join6 { group, interface } } else { Membership::Leave6 { group, interface } }
    };
    calls::change_membership(of, membership)
}

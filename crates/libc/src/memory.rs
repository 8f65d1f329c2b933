//! Memory of the caller: addresses and buffers behind pointers.
//!
//! The callers of the functions of the C library promise that each pointer is valid for the length that they name. The functions of this file ask for the same
//! promise, and for no more.

use std::io::{self, IoSlice, IoSliceMut};
use std::net::{SocketAddr, SocketAddrV4, SocketAddrV6};
use std::ptr;

use libc::{c_int, c_void, iovec, sockaddr, sockaddr_in, sockaddr_in6, socklen_t};

/// Most buffers of one call (`IOV_MAX`).
const MOST: usize = 1024;

pub(crate) fn fail<T>(number: c_int) -> io::Result<T> {
    Err(io::Error::from_raw_os_error(number))
}

/// Length of a type for the calls of sockets.
pub(crate) const fn length_of<T>() -> socklen_t {
    #[expect(clippy::cast_possible_truncation, reason = "the types of the calls have at most 128 bytes")]
    {
        size_of::<T>() as socklen_t
    }
}

/// Reads an address of IP.
///
/// # Safety
///
/// `address` is null or valid for reading `length` bytes.
pub(crate) unsafe fn address(address: *const sockaddr, length: socklen_t) -> io::Result<SocketAddr> {
    if address.is_null() {
        return fail(libc::EFAULT);
    }
    if length < length_of::<libc::sa_family_t>() {
        return fail(libc::EINVAL);
    }
    // SAFETY: `address` is valid for the length of the family, which stands first in every address. The caller may have aligned the address for bytes only.
    let family = unsafe { address.cast::<libc::sa_family_t>().read_unaligned() };
    match c_int::from(family) {
        libc::AF_INET if length >= length_of::<sockaddr_in>() => {
            // SAFETY: `address` is valid for the length of the type, every value of whose bytes is valid.
            let v4 = unsafe { address.cast::<sockaddr_in>().read_unaligned() };
            Ok(SocketAddrV4::new(u32::from_be(v4.sin_addr.s_addr).into(), u16::from_be(v4.sin_port)).into())
        }
        libc::AF_INET6 if length >= length_of::<sockaddr_in6>() => {
            // SAFETY: as above.
            let v6 = unsafe { address.cast::<sockaddr_in6>().read_unaligned() };
            Ok(SocketAddrV6::new(v6.sin6_addr.s6_addr.into(), u16::from_be(v6.sin6_port), v6.sin6_flowinfo, v6.sin6_scope_id).into())
        }
        libc::AF_INET | libc::AF_INET6 => fail(libc::EINVAL),
        _ => fail(libc::EAFNOSUPPORT),
    }
}

/// An address in the form of the C library. Both forms begin at the first byte.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) union Address {
    v4: sockaddr_in,
    v6: sockaddr_in6,
}

impl Address {
    /// Converts an address. Returns the length as well.
    pub(crate) fn of(address: SocketAddr) -> (Self, socklen_t) {
        #[expect(clippy::cast_possible_truncation, reason = "the numbers of families fit")]
        match address {
            SocketAddr::V4(v4) => {
                let sin_addr = libc::in_addr { s_addr: u32::from(*v4.ip()).to_be() };
                let v4 = sockaddr_in { sin_family: libc::AF_INET as _, sin_port: v4.port().to_be(), sin_addr, sin_zero: [0; 8] };
                (Self { v4 }, length_of::<sockaddr_in>())
            }
            SocketAddr::V6(v6) => {
                let value = sockaddr_in6 {
                    sin6_family: libc::AF_INET6 as _,
                    sin6_port: v6.port().to_be(),
                    sin6_flowinfo: v6.flowinfo(),
                    sin6_addr: libc::in6_addr { s6_addr: v6.ip().octets() },
                    sin6_scope_id: v6.scope_id(),
                };
                (Self { v6: value }, length_of::<sockaddr_in6>())
            }
        }
    }
}

/// Writes an address into memory of `room` bytes, cut to the room as the kernel does. Returns the whole length.
///
/// # Safety
///
/// `to` is valid for writing `room` bytes.
pub(crate) unsafe fn write_address(from: SocketAddr, to: *mut c_void, room: socklen_t) -> socklen_t {
    let (address, length) = Address::of(from);
    // SAFETY: `to` is valid for `room` bytes, and `address` for its length; the values are no longer than either, and a fresh local value overlaps nothing.
    unsafe { ptr::copy_nonoverlapping(ptr::from_ref(&address).cast::<u8>(), to.cast::<u8>(), room.min(length) as usize) };
    length
}

/// Writes an address into the memory of the caller, or nowhere if `to` is null.
///
/// # Safety
///
/// `to` is null, or `length` is valid for reading and writing and `to` is valid for writing the number of bytes that `length` says.
pub(crate) unsafe fn return_address(from: Option<SocketAddr>, to: *mut sockaddr, length: *mut socklen_t) -> io::Result<()> {
    if to.is_null() {
        return Ok(());
    }
    if length.is_null() {
        return fail(libc::EFAULT);
    }
    // SAFETY: `length` is valid for reading, since `to` is not null.
    let room = unsafe { length.read() };
    let written = match from {
        // SAFETY: `to` is valid for `room` bytes.
        Some(from) => unsafe { write_address(from, to.cast(), room) },
        // A stream has no address for each call.
        None => 0,
    };
    // SAFETY: `length` is valid for writing.
    unsafe { length.write(written) };
    Ok(())
}

/// Returns memory from which a call sends.
///
/// # Safety
///
/// `start` is valid for reading `length` bytes, or `length` is 0; nobody writes there during `'a`.
pub(crate) unsafe fn bytes<'a>(start: *const c_void, length: usize) -> &'a [u8] {
    // A pointer to no bytes may be null, which a slice may not be.
    if length == 0 {
        return &[];
    }
    // SAFETY: the caller promises initialised bytes: they are to be sent.
    unsafe { std::slice::from_raw_parts(start.cast(), length) }
}

/// Returns memory into which a call receives.
///
/// # Safety
///
/// `start` is valid for writing `length` bytes, or `length` is 0; nobody else uses the memory during `'a`.
pub(crate) unsafe fn room<'a>(start: *mut c_void, length: usize) -> &'a mut [u8] {
    if length == 0 {
        return &mut [];
    }
    // The memory may be uninitialised, which bytes of Rust must not be.
    // SAFETY: `start` is valid for writing `length` bytes.
    unsafe { ptr::write_bytes(start.cast::<u8>(), 0, length) };
    // SAFETY: the bytes are initialised now, and the caller promises that they are used by nobody else.
    unsafe { std::slice::from_raw_parts_mut(start.cast(), length) }
}

/// Returns the list of buffers of a call.
///
/// # Safety
///
/// `list` is valid for reading `count` values, or `count` is 0.
unsafe fn list<'a>(list: *const iovec, count: usize) -> io::Result<&'a [iovec]> {
    match count {
        0 => Ok(&[]),
        // SAFETY: the caller promises the values, and the count is small.
        1..=MOST => Ok(unsafe { std::slice::from_raw_parts(list, count) }),
        _ => fail(libc::EMSGSIZE),
    }
}

/// Returns the buffers from which a call sends.
///
/// # Safety
///
/// As [`list`], and as [`bytes`] for each buffer.
pub(crate) unsafe fn buffers<'a>(first: *const iovec, count: usize) -> io::Result<Vec<IoSlice<'a>>> {
    // SAFETY: the caller promises the list.
    let list = unsafe { list(first, count)? };
    // SAFETY: the caller promises each buffer.
    Ok(list.iter().map(|buffer| IoSlice::new(unsafe { bytes(buffer.iov_base, buffer.iov_len) })).collect())
}

/// Returns the buffers into which a call receives.
///
/// # Safety
///
/// As [`list`], and as [`room`] for each buffer.
pub(crate) unsafe fn rooms<'a>(first: *const iovec, count: usize) -> io::Result<Vec<IoSliceMut<'a>>> {
    // SAFETY: the caller promises the list.
    let list = unsafe { list(first, count)? };
    // SAFETY: the caller promises each buffer, and buffers that overlap would be a mistake with the C library as well.
    Ok(list.iter().map(|buffer| IoSliceMut::new(unsafe { room(buffer.iov_base, buffer.iov_len) })).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_come_back() {
        for text in ["10.0.0.2:80", "[fd00::2]:443", "[::ffff:10.0.0.1]:1"] {
            let expected: SocketAddr = text.parse().unwrap();
            let mut memory = [0_u8; 28];
            let mut length = length_of::<[u8; 28]>();
            // SAFETY: the memory has 28 bytes.
            unsafe { return_address(Some(expected), memory.as_mut_ptr().cast(), &raw mut length) }.unwrap();
            assert_eq!(length, if expected.is_ipv4() { 16 } else { 28 });
            // SAFETY: as above.
            assert_eq!(unsafe { address(memory.as_ptr().cast(), length) }.unwrap(), expected);
            // SAFETY: as above.
            assert_eq!(unsafe { address(memory.as_ptr().cast(), length - 1) }.unwrap_err().raw_os_error(), Some(libc::EINVAL));
        }
    }

    /// The kernel cuts an address, and tells its whole length.
    #[test]
    fn an_address_is_cut_to_the_room() {
        let mut memory = [7_u8; 28];
        let mut length: socklen_t = 4;
        // SAFETY: the memory has 28 bytes, of which 4 are named.
        unsafe { return_address(Some("1.2.3.4:258".parse().unwrap()), memory.as_mut_ptr().cast(), &raw mut length) }.unwrap();
        assert_eq!((length, &memory[2..6]), (16, &[1, 2, 7, 7][..]));
    }

    #[test]
    fn buffers_are_initialised_and_may_be_empty() {
        let mut memory = [std::mem::MaybeUninit::<u8>::uninit(); 3];
        let list = [iovec { iov_base: memory.as_mut_ptr().cast(), iov_len: 3 }, iovec { iov_base: ptr::null_mut(), iov_len: 0 }];
        // SAFETY: the list has two values, and each names its own memory.
        let rooms = unsafe { rooms(list.as_ptr(), 2) }.unwrap();
        assert_eq!((&*rooms[0], &*rooms[1]), (&[0; 3][..], &[][..]));
        // SAFETY: the count is refused before the list is read.
        assert!(unsafe { buffers(list.as_ptr(), MOST + 1) }.is_err());
    }
}

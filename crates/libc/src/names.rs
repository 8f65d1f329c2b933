//! Names of hosts.

use std::collections::BTreeSet;
use std::ffi::{CStr, CString};
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::ptr::{null, null_mut};
use std::sync::{Mutex, PoisonError};

use cohaptic_descriptors::calls;
use libc::{addrinfo, c_char, c_int};

use crate::caught::{guarded, real};
use crate::memory::Address;

/// First entries of lists that this file has made, as numbers. The C library must not free such a list.
static OWN: Mutex<BTreeSet<usize>> = Mutex::new(BTreeSet::new());

/// Entry of a list, with the memory to which it points.
#[repr(C)]
struct Entry {
    info: addrinfo,
    address: Address,
}

/// Kinds of sockets with their protocols, in the order of the C library.
const KINDS: [(c_int, c_int); 3] =
    [(libc::SOCK_STREAM, libc::IPPROTO_TCP), (libc::SOCK_DGRAM, libc::IPPROTO_UDP), (libc::SOCK_RAW, libc::IPPROTO_IP)];

type GetAddrInfo = unsafe extern "C" fn(*const c_char, *const c_char, *const addrinfo, *mut *mut addrinfo) -> c_int;

/// See `getaddrinfo(3)`. Names are those of the hosts of the test bed, also on a thread for the blocking work of a host. Literal addresses are left to the C
/// library, and so is a name with `AI_NUMERICHOST`, which the C library refuses.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn getaddrinfo(node: *const c_char, service: *const c_char, hints: *const addrinfo, list: *mut *mut addrinfo) -> c_int {
    let real = real!(getaddrinfo: GetAddrInfo);
    // SAFETY: the caller promises a text with a zero at its end, or null.
    let name = if node.is_null() { None } else { unsafe { CStr::from_ptr(node) }.to_str().ok() };
    let is_in_bed = cohaptic_sockets::catches_calls() || !cohaptic_sockets::is_in_bed() && cohaptic_sockets::host().is_some();
    // SAFETY: the caller promises hints, or null.
    let is_numeric = unsafe { hints.as_ref() }.is_some_and(|hints| hints.ai_flags & libc::AI_NUMERICHOST != 0);
    let served = name.filter(|name| is_in_bed && !is_numeric && !name.is_empty() && name.parse::<IpAddr>().is_err()).and_then(|name| {
        guarded("getaddrinfo", || {
            // SAFETY: the caller promises the service and the hints.
            let port = match unsafe { port(real, service, hints) } {
                Ok(port) => port,
                Err(error) => return Some(Ok(error)),
            };
            // SAFETY: the caller promises hints, or null.
            let hints = unsafe { hints.as_ref() };
            let Ok(addresses) = calls::look_up(name, port)? else { return Some(Ok(libc::EAI_NONAME)) };
            let Some(first) = entries(&addresses, name, hints) else { return Some(Ok(libc::EAI_NONAME)) };
            // SAFETY: the caller promises a place for the list.
            unsafe { list.write(first) };
            Some(io::Result::Ok(0))
        })
    });
    // SAFETY: the caller keeps the contract of the C library's function.
    served.unwrap_or_else(|| unsafe { real(node, service, hints, list) })
}

/// Returns the port of a service: 0 without a service, a number, or a name that the C library knows. The error is one of `getaddrinfo`.
///
/// # Safety
///
/// `service` is null or a text with a zero at its end, and `hints` null or valid.
unsafe fn port(real: GetAddrInfo, service: *const c_char, hints: *const addrinfo) -> Result<u16, c_int> {
    if service.is_null() {
        return Ok(0);
    }
    // SAFETY: the caller promises the text.
    let text = unsafe { CStr::from_ptr(service) };
    if let Some(number) = text.to_str().ok().and_then(|text| text.parse().ok()) {
        return Ok(number);
    }
    let mut list = null_mut();
    // SAFETY: the promises of the caller, and a place for the list.
    let outcome = unsafe { real(null(), service, hints, &raw mut list) };
    if outcome != 0 {
        return Err(outcome);
    }
    // SAFETY: a list of the C library is not empty, and its first entry has an address.
    let info = unsafe { list.read() };
    // SAFETY: the address is valid for its length.
    let address = unsafe { crate::memory::address(info.ai_addr, info.ai_addrlen) };
    let free = real!(freeaddrinfo: unsafe extern "C" fn(*mut addrinfo));
    // SAFETY: the C library has made the list, and nobody else has the list.
    unsafe { free(list) };
    address.map(|address| address.port()).map_err(|_| libc::EAI_SERVICE)
}

/// Makes a list. Returns `None` if no address is of the family that the hints name.
fn entries(addresses: &[SocketAddr], name: &str, hints: Option<&addrinfo>) -> Option<*mut addrinfo> {
    let (family, kind, flags) = hints.map_or((libc::AF_UNSPEC, 0, 0), |hints| (hints.ai_family, hints.ai_socktype, hints.ai_flags));
    let is_wanted = |protocol| hints.is_none_or(|hints| hints.ai_protocol == 0 || hints.ai_protocol == protocol);
    let mut first: *mut addrinfo = null_mut();
    // From the last entry to the first, because each entry names the next one.
    for address in addresses.iter().rev() {
        let of = if address.is_ipv4() { libc::AF_INET } else { libc::AF_INET6 };
        if family != libc::AF_UNSPEC && family != of {
            continue;
        }
        for (socktype, protocol) in KINDS.into_iter().rev().filter(|(socktype, protocol)| (kind == 0 || kind == *socktype) && is_wanted(*protocol)) {
            let (address, length) = Address::of(*address);
            let info = addrinfo {
                ai_flags: flags,
                ai_family: of,
                ai_socktype: socktype,
                ai_protocol: protocol,
                ai_addrlen: length,
                ai_addr: null_mut(),
                ai_canonname: null_mut(),
                ai_next: first,
            };
            let entry = Box::into_raw(Box::new(Entry { info, address }));
            // SAFETY: the entry was just made, and nobody else has it. It points to its own address, which stays in place in its box.
            unsafe { (*entry).info.ai_addr = (&raw mut (*entry).address).cast() };
            first = entry.cast();
        }
    }
    if first.is_null() {
        return None;
    }
    if flags & libc::AI_CANONNAME != 0 {
        // The name came from a text of C, and has no zero.
        let canonical = CString::new(name).unwrap_or_default().into_raw();
        // SAFETY: the first entry was made above, and nobody else has it.
        unsafe { (*first).ai_canonname = canonical };
    }
    OWN.lock().unwrap_or_else(PoisonError::into_inner).insert(first as usize);
    Some(first)
}

/// See `freeaddrinfo(3)`.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn freeaddrinfo(list: *mut addrinfo) {
    // The lock is free again before the C library is called.
    let is_own = OWN.lock().unwrap_or_else(PoisonError::into_inner).remove(&(list as usize));
    if !is_own {
        let real = real!(freeaddrinfo: unsafe extern "C" fn(*mut addrinfo));
        // SAFETY: the caller keeps the contract of the C library's function.
        return unsafe { real(list) };
    }
    let mut next = list;
    while !next.is_null() {
        // SAFETY: each entry of an own list is a box of `Entry`, whose first field is at its beginning, and is freed once.
        let entry = unsafe { Box::from_raw(next.cast::<Entry>()) };
        if !entry.info.ai_canonname.is_null() {
            // SAFETY: the name is a text of `CString::into_raw`, and is freed once.
            drop(unsafe { CString::from_raw(entry.info.ai_canonname) });
        }
        next = entry.info.ai_next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A list is read in the order of the addresses and freed, under the eyes of Miri and valgrind.
    #[test]
    fn a_list_has_all_addresses_and_is_freed() {
        let addresses = ["[fd00::1]:7".parse().unwrap(), "10.0.0.1:7".parse().unwrap()];
        // SAFETY: hints of zeros are valid.
        let mut hints: addrinfo = unsafe { std::mem::zeroed() };
        hints.ai_flags = libc::AI_CANONNAME;
        let list = entries(&addresses, "server", Some(&hints)).unwrap();
        let (mut seen, mut next) = (Vec::new(), list);
        // SAFETY: the list was made above.
        while let Some(info) = unsafe { next.as_ref() } {
            // SAFETY: as above.
            seen.push((unsafe { crate::memory::address(info.ai_addr, info.ai_addrlen) }.unwrap(), info.ai_socktype));
            next = info.ai_next;
        }
        let kinds = |address| KINDS.map(|(kind, _)| (address, kind));
        assert_eq!(seen, addresses.map(kinds).concat());
        // SAFETY: as above.
        assert_eq!(unsafe { CStr::from_ptr((*list).ai_canonname) }, c"server");
        // SAFETY: as above.
        unsafe { freeaddrinfo(list) };
        assert!(!OWN.lock().unwrap().contains(&(list as usize)));
        hints.ai_protocol = libc::IPPROTO_UDP;
        let list = entries(&addresses[1..], "server", Some(&hints)).unwrap();
        // SAFETY: the list was made above.
        let info = unsafe { list.read() };
        assert_eq!((info.ai_socktype, info.ai_next), (libc::SOCK_DGRAM, null_mut()));
        // SAFETY: as above.
        unsafe { freeaddrinfo(list) };
        hints.ai_family = libc::AF_INET6;
        assert!(entries(&addresses[1..], "server", Some(&hints)).is_none());
    }
}

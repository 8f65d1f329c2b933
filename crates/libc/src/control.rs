//! Control messages of `sendmsg` and `recvmsg`: the ECN codepoint and the own address of a datagram.

use std::io;
use std::net::{IpAddr, Ipv6Addr};
use std::os::fd::AsRawFd;
use std::ptr;

use cohaptic_descriptors::Numbered;
use cohaptic_descriptors::calls::Arrived;
use cohaptic_sockets::Sending;
use libc::{c_int, c_void, cmsghdr, msghdr};

use crate::memory::{fail, length_of};

/// Reads the control messages of a datagram to be sent.
///
/// # Safety
///
/// `message` is a message whose control buffer is valid for its length, or null.
pub(crate) unsafe fn read(message: &msghdr) -> io::Result<Sending> {
    let mut sending = Sending::default();
    if message.msg_control.is_null() {
        return Ok(sending);
    }
    // SAFETY: the caller promises the control buffer.
    let mut rest = unsafe { crate::memory::bytes(message.msg_control, message.msg_controllen) };
    // The headers are not read by `CMSG_NXTHDR`, which asks for an aligned buffer. Linux does not.
    while rest.len() >= size_of::<cmsghdr>() {
        // SAFETY: `rest` has the bytes of a header, every value of which is valid. Alignment is not asked for.
        let header = unsafe { rest.as_ptr().cast::<cmsghdr>().read_unaligned() };
        let Some(data) = rest.get(size_of::<cmsghdr>()..header.cmsg_len) else { return fail(libc::EINVAL) };
        match (header.cmsg_level, header.cmsg_type) {
            // Linux takes one byte as well as an `int`, whose first byte has the codepoint on little-endian machines.
            (libc::IPPROTO_IP, libc::IP_TOS) if data.len() == 1 => sending.ecn = data[0] & 3,
            (libc::IPPROTO_IP, libc::IP_TOS) | (libc::IPPROTO_IPV6, libc::IPV6_TCLASS) => {
                let Some(value) = data.first_chunk::<4>() else { return fail(libc::EINVAL) };
                sending.ecn = (c_int::from_ne_bytes(*value) & 3).to_le_bytes()[0];
            }
            (libc::IPPROTO_IP, libc::IP_PKTINFO) => {
                // `in_pktinfo`: number of the interface, address to send from, address of the header.
                let Some(from) = data.get(4..8).and_then(<[u8]>::first_chunk::<4>) else { return fail(libc::EINVAL) };
                sending.from = Some(IpAddr::from(*from));
            }
            (libc::IPPROTO_IPV6, libc::IPV6_PKTINFO) => {
                let Some(from) = data.first_chunk::<16>() else { return fail(libc::EINVAL) };
                sending.from = Some(IpAddr::from(*from));
            }
            // `UDP_SEGMENT` is refused too, as by `setsockopt`.
            _ => return fail(libc::EINVAL),
        }
        rest = rest.get(header.cmsg_len.next_multiple_of(size_of::<usize>())..).unwrap_or_default();
    }
    Ok(sending)
}

/// Writes the control messages for a received datagram that the program has asked for by options of the placeholder.
///
/// # Safety
///
/// `message` is a message whose control buffer is valid for its length, or null.
pub(crate) unsafe fn write(of: Numbered<'_>, arrived: &Arrived, message: &mut msghdr) {
    let mut to = Writer { start: message.msg_control, room: message.msg_controllen, used: 0, is_cut: false };
    if let (false, Some(own)) = (to.start.is_null(), arrived.to) {
        let (is_six, is_v4) = (own.is_ipv6(), own.to_canonical().is_ipv4());
        let asked = |level, name| is_on(of, level, name);
        // SAFETY of the calls of `push`: the writer has the control buffer of the message.
        if is_v4 && asked(libc::IPPROTO_IP, libc::IP_RECVTOS) {
            // SAFETY: see above.
            unsafe { to.push(libc::IPPROTO_IP, libc::IP_TOS, &[arrived.ecn]) };
        }
        if let (IpAddr::V4(v4), true) = (own.to_canonical(), asked(libc::IPPROTO_IP, libc::IP_PKTINFO)) {
            // `in_pktinfo`: number of the interface, local address, address of the header.
            let info = [1_u32.to_ne_bytes(), v4.octets(), v4.octets()].concat();
            // SAFETY: see above.
            unsafe { to.push(libc::IPPROTO_IP, libc::IP_PKTINFO, &info) };
        }
        if is_six && asked(libc::IPPROTO_IPV6, libc::IPV6_RECVPKTINFO) {
            let six = if let IpAddr::V6(six) = own { six } else { Ipv6Addr::UNSPECIFIED };
            let info = [&six.octets()[..], &1_u32.to_ne_bytes()].concat();
            // SAFETY: see above.
            unsafe { to.push(libc::IPPROTO_IPV6, libc::IPV6_PKTINFO, &info) };
        }
        if is_six && !is_v4 && asked(libc::IPPROTO_IPV6, libc::IPV6_RECVTCLASS) {
            // SAFETY: see above.
            unsafe { to.push(libc::IPPROTO_IPV6, libc::IPV6_TCLASS, &c_int::from(arrived.ecn).to_ne_bytes()) };
        }
    }
    message.msg_controllen = to.used;
    if to.is_cut {
        message.msg_flags |= libc::MSG_CTRUNC;
    }
}

/// Returns whether an option of the placeholder is on.
fn is_on(of: Numbered<'_>, level: c_int, name: c_int) -> bool {
    let (mut value, mut length): (c_int, _) = (0, length_of::<c_int>());
    // SAFETY: the value has the length of an `int`, as the length says.
    let outcome = unsafe { libc::getsockopt(of.as_raw_fd(), level, name, (&raw mut value).cast(), &raw mut length) };
    outcome == 0 && value != 0
}

/// Control buffer that is being filled.
struct Writer {
    start: *mut c_void,
    /// Length of the buffer \[byte\].
    room: usize,
    used: usize,
    /// `true` if a message had no room.
    is_cut: bool,
}

impl Writer {
    /// Appends a message.
    ///
    /// # Safety
    ///
    /// `start` is valid for writing `room` bytes.
    unsafe fn push(&mut self, level: c_int, kind: c_int, data: &[u8]) {
        #[expect(clippy::cast_possible_truncation, reason = "a message has at most 20 bytes")]
        let length = data.len() as u32;
        // SAFETY: the function computes with numbers only.
        let (whole, space) = unsafe { (libc::CMSG_LEN(length) as usize, libc::CMSG_SPACE(length) as usize) };
        if self.used + whole > self.room {
            self.is_cut = true;
            return;
        }
        let header = cmsghdr { cmsg_len: whole, cmsg_level: level, cmsg_type: kind };
        // SAFETY: `used + whole` bytes lie within the buffer, and the header is a part of `whole`. Alignment is not asked for.
        unsafe { self.start.byte_add(self.used).cast::<cmsghdr>().write_unaligned(header) };
        let before = whole - data.len();
        // SAFETY: as above, for the data, which no buffer of the caller overlaps.
        unsafe { ptr::copy_nonoverlapping(data.as_ptr(), self.start.byte_add(self.used + before).cast(), data.len()) };
        // The room after the data up to the next header may be cut, as with Linux.
        self.used = (self.used + space).min(self.room);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(memory: &mut [u64], length: usize) -> msghdr {
        // SAFETY: a message of zeros is valid.
        let mut message: msghdr = unsafe { std::mem::zeroed() };
        message.msg_control = memory.as_mut_ptr().cast();
        message.msg_controllen = length;
        message
    }

    /// The macros of the C library read the messages of the writer, and a message without room is left out.
    #[test]
    fn written_messages_are_read() {
        let mut memory = [0_u64; 16];
        let start = memory.as_mut_ptr().cast();
        let mut writer = Writer { start, room: 60, used: 0, is_cut: false };
        // SAFETY: the memory has 128 bytes, of which 60 are named.
        unsafe {
            writer.push(libc::IPPROTO_IP, libc::IP_TOS, &[0xaa | 2]);
            writer.push(libc::IPPROTO_IP, libc::IP_PKTINFO, &[1, 0, 0, 0, 10, 0, 0, 3, 0, 0, 0, 0]);
        }
        assert_eq!((writer.used, writer.is_cut), (56, false));
        // SAFETY: as above.
        unsafe { writer.push(libc::IPPROTO_IP, libc::IP_TOS, &[1]) };
        assert!(writer.is_cut && memory[7..].iter().all(|word| *word == 0));
        // SAFETY: the message names the memory that was written.
        let sending = unsafe { read(&message(&mut memory, 56)) }.unwrap();
        assert_eq!(sending, Sending { to: None, from: Some([10, 0, 0, 3].into()), ecn: 2 });
        // As with Linux, the buffer need not be aligned.
        let mut unaligned = message(&mut memory, 56);
        // SAFETY: the memory has 128 bytes, of which the first 56 move by one byte. The message then names those bytes.
        let unaligned_sending = unsafe {
            let control = unaligned.msg_control;
            control.cast::<u8>().copy_to(control.cast::<u8>().add(1), 56);
            unaligned.msg_control = control.byte_add(1);
            read(&unaligned)
        };
        assert_eq!(unaligned_sending.unwrap(), sending);
    }

    #[test]
    fn a_wrong_length_and_an_unknown_message_are_refused() {
        let mut memory = [0_u64; 4];
        for (length, kind) in [(200, libc::IP_TOS), (20, libc::IP_RETOPTS)] {
            // SAFETY: the memory has room for a header.
            unsafe {
                memory.as_mut_ptr().cast::<cmsghdr>().write(cmsghdr { cmsg_len: length, cmsg_level: libc::IPPROTO_IP, cmsg_type: kind });
            }
            // SAFETY: the message names its own memory.
            let outcome = unsafe { read(&message(&mut memory, 32)) };
            assert_eq!(outcome.unwrap_err().raw_os_error(), Some(libc::EINVAL));
        }
    }
}

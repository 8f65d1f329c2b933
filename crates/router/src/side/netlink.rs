//! Requests of rtnetlink (rtnetlink(7)) for a device: the state, the length of packets and of the queue, the addresses, and promiscuous mode.

use core::net::IpAddr;
use std::io;
use std::os::fd::{AsRawFd as _, OwnedFd};

use cohaptic_linkfile::router::Network;
use nix::sys::socket::{AddressFamily, MsgFlags, NetlinkAddr, SockFlag, SockProtocol, SockType, bind, recv, send, socket};

/// Netlink socket. The requests concern the network namespace in which the socket was opened.
#[derive(Debug)]
pub(super) struct Netlink {
    socket: OwnedFd,
}

/// `RTM_NEWLINK`.
const NEW_LINK: u16 = 16;
/// `RTM_NEWADDR`.
const NEW_ADDRESS: u16 = 20;
/// `RTM_NEWROUTE`.
const NEW_ROUTE: u16 = 24;
/// `NLM_F_REQUEST` and `NLM_F_ACK`: a request that the kernel answers.
const REQUEST: u16 = 0x1 | 0x4;
/// `NLM_F_CREATE` and `NLM_F_REPLACE`: an object that exists already is no error.
const CREATE: u16 = 0x400 | 0x100;
/// `IFLA_MTU`.
const ATTRIBUTE_MTU: u16 = 4;
/// `IFLA_TXQLEN`.
const ATTRIBUTE_QUEUE: u16 = 13;
/// `IFA_ADDRESS`.
const ATTRIBUTE_ADDRESS: u16 = 1;
/// `IFA_LOCAL`.
const ATTRIBUTE_LOCAL: u16 = 2;
/// `RTA_OIF`.
const ATTRIBUTE_DEVICE: u16 = 4;
/// `IFF_UP`.
const FLAG_UP: u32 = 0x1;
/// `IFF_PROMISC`.
const FLAG_PROMISCUOUS: u32 = 0x100;

impl Netlink {
    /// Opens a socket in the network namespace of the calling thread.
    pub(super) fn open() -> io::Result<Self> {
        let socket = socket(AddressFamily::Netlink, SockType::Raw, SockFlag::SOCK_CLOEXEC, SockProtocol::NetlinkRoute)?;
        bind(socket.as_raw_fd(), &NetlinkAddr::new(0, 0))?;
        Ok(Self { socket })
    }

    /// Switches a device on.
    pub(super) fn up(&self, index: u32) -> io::Result<()> {
        self.ask(NEW_LINK, REQUEST, &link(index, FLAG_UP, FLAG_UP))
    }

    /// Switches promiscuous mode of a device on or off: whether it accepts frames for other addresses.
    pub(super) fn promiscuous(&self, index: u32, hears_all: bool) -> io::Result<()> {
        self.ask(NEW_LINK, REQUEST, &link(index, if hears_all { FLAG_PROMISCUOUS } else { 0 }, FLAG_PROMISCUOUS))
    }

    /// Sets the length of the longest packet for a device \[bytes\].
    pub(super) fn mtu(&self, index: u32, mtu: u16) -> io::Result<()> {
        self.number(index, ATTRIBUTE_MTU, mtu.into())
    }

    /// Sets the number of packets that can wait in a device. The older ioctl for this needs root rights on the whole machine.
    pub(super) fn waiting(&self, index: u32, packets: u32) -> io::Result<()> {
        self.number(index, ATTRIBUTE_QUEUE, packets)
    }

    /// Sets a numeric attribute of a device.
    fn number(&self, index: u32, kind: u16, value: u32) -> io::Result<()> {
        let mut body = link(index, 0, 0);
        attribute(&mut body, kind, &value.to_ne_bytes());
        self.ask(NEW_LINK, REQUEST, &body)
    }

    /// Adds an address with its prefix to a device.
    pub(super) fn address(&self, index: u32, network: Network) -> io::Result<()> {
        let family = if network.address().is_ipv4() { AddressFamily::Inet } else { AddressFamily::Inet6 };
        // Fields of `struct ifaddrmsg`: family, prefix, flags, scope, index.
        let mut body = vec![u8::try_from(family as i32).map_err(io::Error::other)?, network.prefix(), 0, 0];
        body.extend(index.to_ne_bytes());
        match network.address() {
            IpAddr::V4(address) => [ATTRIBUTE_LOCAL, ATTRIBUTE_ADDRESS].map(|kind| attribute(&mut body, kind, &address.octets())),
            IpAddr::V6(address) => [ATTRIBUTE_LOCAL, ATTRIBUTE_ADDRESS].map(|kind| attribute(&mut body, kind, &address.octets())),
        };
        self.ask(NEW_ADDRESS, REQUEST | CREATE, &body)
    }

    /// Adds the default route of an address family: packets to all addresses without a narrower route go into the device.
    pub(super) fn lead_all(&self, index: u32, family: AddressFamily) -> io::Result<()> {
        /// `RT_TABLE_MAIN`, `RTPROT_STATIC`, `RT_SCOPE_UNIVERSE` and `RTN_UNICAST`.
        const KIND: [u8; 4] = [254, 4, 0, 1];
        // Fields of `struct rtmsg`: family, lengths of destination and source, type of service, the kind, and flags.
        let mut body = vec![u8::try_from(family as i32).map_err(io::Error::other)?, 0, 0, 0];
        body.extend(KIND);
        body.extend([0; 4]);
        attribute(&mut body, ATTRIBUTE_DEVICE, &index.to_ne_bytes());
        self.ask(NEW_ROUTE, REQUEST | CREATE, &body)
    }

    /// Sends a request and waits for the answer. Returns the error in the answer.
    fn ask(&self, kind: u16, flags: u16, body: &[u8]) -> io::Result<()> {
        send(self.socket.as_raw_fd(), &message(kind, flags, body), MsgFlags::empty())?;
        let mut answer = [0; 4096];
        let length = recv(self.socket.as_raw_fd(), &mut answer, MsgFlags::empty())?;
        verdict(&answer[..length])
    }
}

/// Returns a message with its header (`struct nlmsghdr`): length, kind, flags, the sequence number 1, and the port 0.
fn message(kind: u16, flags: u16, body: &[u8]) -> Vec<u8> {
    const HEADER: u32 = 16;
    let length = HEADER + u32::try_from(body.len()).unwrap_or(u32::MAX - HEADER);
    let mut message = Vec::with_capacity(body.len() + 16);
    message.extend(length.to_ne_bytes());
    message.extend(kind.to_ne_bytes());
    message.extend(flags.to_ne_bytes());
    message.extend([1_u32, 0].map(u32::to_ne_bytes).concat());
    message.extend(body);
    message
}

/// Returns a `struct ifinfomsg`: no family, no type, the index of the device, flags, and the mask of the flags to change.
fn link(index: u32, flags: u32, meant: u32) -> Vec<u8> {
    [0, index, flags, meant].map(u32::to_ne_bytes).concat()
}

/// Appends a `struct rtattr`: length, kind, value. All values here are multiples of four bytes long, so no padding is needed.
fn attribute(body: &mut Vec<u8>, kind: u16, value: &[u8]) {
    let length = 4 + u16::try_from(value.len()).unwrap_or(u16::MAX - 4);
    body.extend([length, kind].map(u16::to_ne_bytes).concat());
    body.extend(value);
}

/// Returns the verdict in an answer: zero is success, and a negative number is the negated error number.
fn verdict(answer: &[u8]) -> io::Result<()> {
    const ERROR: u16 = 2;
    let strange = || io::Error::new(io::ErrorKind::InvalidData, "the kernel's answer is none that is known");
    let kind: [u8; 2] = answer.get(4..).and_then(|rest| rest.first_chunk()).copied().ok_or_else(strange)?;
    let code: [u8; 4] = answer.get(16..).and_then(|rest| rest.first_chunk()).copied().ok_or_else(strange)?;
    match (u16::from_ne_bytes(kind), i32::from_ne_bytes(code)) {
        (ERROR, 0) => Ok(()),
        (ERROR, code @ ..0) => Err(io::Error::from_raw_os_error(code.saturating_neg())),
        _ => Err(strange()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_has_the_layout_of_the_manual() {
        let mut body = link(7, FLAG_UP, FLAG_UP);
        attribute(&mut body, ATTRIBUTE_MTU, &1400_u32.to_ne_bytes());
        let message = message(NEW_LINK, REQUEST, &body);
        assert_eq!(message.len(), 16 + 16 + 8);
        assert_eq!(message[..4], 40_u32.to_ne_bytes());
        assert_eq!(message[4..8], [16_u16, 5].map(u16::to_ne_bytes).concat());
        assert_eq!(message[20..24], 7_u32.to_ne_bytes());
        assert_eq!(message[32..36], [8_u16, 4].map(u16::to_ne_bytes).concat());
    }

    #[test]
    fn an_answer_is_a_yes_or_an_error() {
        let answer = |code: i32| [vec![0; 4], 2_u16.to_ne_bytes().to_vec(), vec![0; 10], code.to_ne_bytes().to_vec()].concat();
        assert!(verdict(&answer(0)).is_ok());
        assert_eq!(verdict(&answer(-1)).unwrap_err().raw_os_error(), Some(1));
        assert_eq!(verdict(&answer(1)).unwrap_err().kind(), io::ErrorKind::InvalidData);
        assert_eq!(verdict(&answer(i32::MIN)).unwrap_err().raw_os_error(), Some(i32::MAX));
        for length in 0..20 {
            assert_eq!(verdict(&answer(0)[..length]).unwrap_err().kind(), io::ErrorKind::InvalidData);
        }
    }
}

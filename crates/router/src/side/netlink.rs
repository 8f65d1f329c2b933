//! Requests of rtnetlink (rtnetlink(7)): the state of a device, the length of its packets and of its queue, its addresses and settings, promiscuous mode,
//! routes, and the rules for the choice of a table of routes.

use core::net::{IpAddr, Ipv4Addr};
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
/// `RTM_DELADDR`.
const DELETE_ADDRESS: u16 = 21;
/// `RTM_NEWROUTE`.
const NEW_ROUTE: u16 = 24;
/// `RTM_NEWRULE`.
const NEW_RULE: u16 = 32;
/// `RTM_DELRULE`.
const DELETE_RULE: u16 = 33;
/// `NLM_F_REQUEST` and `NLM_F_ACK`: a request that the kernel answers.
const REQUEST: u16 = 0x1 | 0x4;
/// `NLM_F_CREATE` and `NLM_F_REPLACE`: an object that exists already is no error.
const CREATE: u16 = 0x400 | 0x100;
/// `IFLA_MTU`.
const ATTRIBUTE_MTU: u16 = 4;
/// `IFLA_TXQLEN`.
const ATTRIBUTE_QUEUE: u16 = 13;
/// `IFLA_AF_SPEC`.
const ATTRIBUTE_FAMILIES: u16 = 26;
/// `IFLA_INET_CONF`.
const ATTRIBUTE_SETTINGS: u16 = 1;
/// `IFA_ADDRESS`.
const ATTRIBUTE_ADDRESS: u16 = 1;
/// `IFA_LOCAL`.
const ATTRIBUTE_LOCAL: u16 = 2;
/// `RTA_DST`.
const ATTRIBUTE_DESTINATION: u16 = 1;
/// `RTA_OIF`.
const ATTRIBUTE_DEVICE: u16 = 4;
/// `RTA_PREFSRC`.
const ATTRIBUTE_OWN_SOURCE: u16 = 7;
/// `FRA_SRC`.
const ATTRIBUTE_SOURCE: u16 = 2;
/// `FRA_IIFNAME`.
const ATTRIBUTE_FROM_DEVICE: u16 = 3;
/// `FRA_PRIORITY`.
const ATTRIBUTE_PRIORITY: u16 = 6;
/// `IFF_UP`.
const FLAG_UP: u32 = 0x1;
/// `IFF_PROMISC`.
const FLAG_PROMISCUOUS: u32 = 0x100;

/// `RT_TABLE_MAIN`: table of the routes to other hosts.
pub(super) const MAIN: u8 = 254;
/// `RT_TABLE_LOCAL`: table of the addresses of the namespace.
pub(super) const LOCAL: u8 = 255;

/// Setting of IPv4 of a device, by its number in `linux/ip.h`. The file of the same name is below `/proc/sys/net/ipv4/conf`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u16)]
pub(super) enum Setting {
    /// `accept_local`: packets with a source address of this namespace are accepted from the device.
    AcceptLocal = 23,
    /// `route_localnet`: packets from and to 127.0.0.0/8 may pass the device.
    RouteLocalnet = 26,
}

/// Rule of IPv4 for the choice of a table of routes (ip-rule(8)).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Rule {
    /// Place among the rules: rules with lower numbers are asked first.
    pub(super) priority: u32,
    /// `true` if the rule is for packets that programs of the namespace send, and `false` if the rule is for arriving packets too.
    pub(super) is_for_sent: bool,
    /// Network of the sources for which the rule is, with its prefix, or `None` for all sources.
    pub(super) source: Option<(Ipv4Addr, u8)>,
    /// Table with the route. `None`: the packet is refused, and its sender gets `EINVAL`.
    pub(super) table: Option<u8>,
}

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
        self.ask(NEW_ADDRESS, REQUEST | CREATE, &addressed(index, network))
    }

    /// Removes an address from a device.
    pub(super) fn remove_address(&self, index: u32, network: Network) -> io::Result<()> {
        self.ask(DELETE_ADDRESS, REQUEST, &addressed(index, network))
    }

    /// Gives a setting of IPv4 of a device the value 1. The kernel lets the owner of the namespace do so also where /proc/sys cannot be written, as in
    /// containers.
    pub(super) fn switch_on(&self, index: u32, setting: Setting) -> io::Result<()> {
        let mut body = link(index, 0, 0);
        attribute(&mut body, ATTRIBUTE_FAMILIES, &nested(INET.into(), &nested(ATTRIBUTE_SETTINGS, &nested(setting as u16, &1_u32.to_ne_bytes()))));
        self.ask(NEW_LINK, REQUEST, &body)
    }

    /// Adds a route to a table: packets to a network go into the device. Without a device the network is unreachable. A socket without an address gets the
    /// address `source`, or, with `None`, an address of the device.
    pub(super) fn route(&self, index: Option<u32>, to: Network, table: u8, source: Option<IpAddr>) -> io::Result<()> {
        /// `RTPROT_STATIC` and `RT_SCOPE_UNIVERSE`.
        const KIND: [u8; 2] = [4, 0];
        /// `RTN_UNICAST` and `RTN_UNREACHABLE`.
        const TYPES: [u8; 2] = [1, 7];
        // Fields of `struct rtmsg`: family, lengths of destination and source, type of service, table, the kind, and flags.
        let mut body = vec![family(to.address()), to.prefix(), 0, 0, table];
        body.extend(KIND);
        body.push(TYPES[usize::from(index.is_none())]);
        body.extend([0; 4]);
        attribute(&mut body, ATTRIBUTE_DESTINATION, &octets(to.address()));
        if let Some(index) = index {
            attribute(&mut body, ATTRIBUTE_DEVICE, &index.to_ne_bytes());
        }
        if let Some(source) = source {
            attribute(&mut body, ATTRIBUTE_OWN_SOURCE, &octets(source));
        }
        self.ask(NEW_ROUTE, REQUEST | CREATE, &body)
    }

    /// Adds a rule.
    pub(super) fn add_rule(&self, rule: Rule) -> io::Result<()> {
        self.ask(NEW_RULE, REQUEST | CREATE, &rule.body())
    }

    /// Removes a rule.
    pub(super) fn remove_rule(&self, rule: Rule) -> io::Result<()> {
        self.ask(DELETE_RULE, REQUEST, &rule.body())
    }

    /// Sends a request and waits for the answer. Returns the error in the answer.
    fn ask(&self, kind: u16, flags: u16, body: &[u8]) -> io::Result<()> {
        send(self.socket.as_raw_fd(), &message(kind, flags, body), MsgFlags::empty())?;
        let mut answer = [0; 4096];
        let length = recv(self.socket.as_raw_fd(), &mut answer, MsgFlags::empty())?;
        verdict(&answer[..length])
    }
}

impl Rule {
    /// Returns a `struct fib_rule_hdr` with its attributes.
    fn body(self) -> Vec<u8> {
        /// `FR_ACT_TO_TBL` and `FR_ACT_BLACKHOLE`.
        const ACTIONS: [u8; 2] = [1, 6];
        let action = ACTIONS[usize::from(self.table.is_none())];
        // Fields: family, lengths of destination and source, type of service, table, two reserved bytes, action, and flags.
        let mut body = vec![INET, 0, self.source.map_or(0, |(_, prefix)| prefix), 0, self.table.unwrap_or(0), 0, 0, action];
        body.extend([0; 4]);
        attribute(&mut body, ATTRIBUTE_PRIORITY, &self.priority.to_ne_bytes());
        if let Some((source, _)) = self.source {
            attribute(&mut body, ATTRIBUTE_SOURCE, &source.octets());
        }
        if self.is_for_sent {
            // The kernel looks for the route of a sent packet as if the packet had come from the loopback interface.
            attribute(&mut body, ATTRIBUTE_FROM_DEVICE, b"lo\0\0");
        }
        body
    }
}

/// `AF_INET`.
const INET: u8 = 2;
/// `AF_INET6`.
const INET6: u8 = 10;

/// Returns the family of an address, as the headers of requests name the family.
const fn family(address: IpAddr) -> u8 {
    if address.is_ipv4() { INET } else { INET6 }
}

/// Returns the bytes of an address.
fn octets(address: IpAddr) -> Vec<u8> {
    match address {
        IpAddr::V4(address) => address.octets().to_vec(),
        IpAddr::V6(address) => address.octets().to_vec(),
    }
}

/// Returns a `struct ifaddrmsg` about an address of a device: family, prefix, flags, scope, index, and the address itself.
fn addressed(index: u32, network: Network) -> Vec<u8> {
    let mut body = vec![family(network.address()), network.prefix(), 0, 0];
    body.extend(index.to_ne_bytes());
    for kind in [ATTRIBUTE_LOCAL, ATTRIBUTE_ADDRESS] {
        attribute(&mut body, kind, &octets(network.address()));
    }
    body
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

/// Returns a `struct rtattr` for the value of another attribute.
fn nested(kind: u16, value: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    attribute(&mut body, kind, value);
    body
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

    /// A rule for sent packets names the loopback interface, and a rule without a table refuses.
    #[test]
    fn a_rule_has_the_layout_of_the_kernel() {
        let all = Rule { priority: 10, is_for_sent: false, source: None, table: Some(LOCAL) };
        assert_eq!(all.body(), [&[2, 0, 0, 0, 255, 0, 0, 1, 0, 0, 0, 0][..], &nested(6, &10_u32.to_ne_bytes())].concat());
        let refused = Rule { priority: 6, is_for_sent: true, source: Some((Ipv4Addr::new(127, 0, 0, 0), 8)), table: None };
        let attributes = [nested(6, &6_u32.to_ne_bytes()), nested(2, &[127, 0, 0, 0]), nested(3, b"lo\0\0")].concat();
        assert_eq!(refused.body(), [&[2, 0, 8, 0, 0, 0, 0, 6, 0, 0, 0, 0][..], &attributes].concat());
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

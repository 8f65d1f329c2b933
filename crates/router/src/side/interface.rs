//! Existing interface, used through a packet socket (packet(7)): the router receives every frame that arrives at the interface, and sends frames out of the
//! interface.
//!
//! Frames keep their addresses, so two interfaces with a router between them behave like one cable. The host itself receives the frames, too. The host should
//! have no addresses on these interfaces, or it answers the frames.

use std::io;
use std::os::fd::{AsFd as _, AsRawFd as _, BorrowedFd, OwnedFd};
use std::sync::Arc;

use cohaptic_linkfile::router::InterfaceSpec;
use nix::errno::Errno;
use nix::ifaddrs::getifaddrs;
use nix::net::if_::InterfaceFlags;
use nix::sys::socket::{
    AddressFamily, LinkAddr, MsgFlags, SockFlag, SockProtocol, SockType, SockaddrLike as _, bind, recvfrom, send, setsockopt, socket, sockopt,
};

use super::netlink::Netlink;
use super::{Device, Failed, LONGEST, Sent};
use crate::packet::{Framing, Packet};

/// `ARPHRD_ETHER`, the type of Ethernet interfaces.
const ETHERNET: u16 = 1;

/// `PACKET_OUTGOING`, the type of frames sent by this host.
const OUTGOING: u8 = 4;

/// Receive buffer of the socket \[bytes\].
const WAITING: usize = 8 << 20;

/// Existing Ethernet interface.
#[derive(Debug)]
pub struct Interface {
    socket: OwnedFd,
    /// Index of the interface.
    index: usize,
    /// Memory for one frame.
    buffer: Vec<u8>,
    /// Socket and index for leaving promiscuous mode on drop; `None` if the interface was in promiscuous mode before.
    restore: Option<(Netlink, u32)>,
}

impl Interface {
    /// Opens a packet socket on the interface and switches promiscuous mode on.
    pub(super) fn open(spec: &InterfaceSpec) -> Result<Self, Failed> {
        let (address, hears_all) = find(spec)?;
        if address.hatype() != ETHERNET {
            return Err(Failed::NotEthernet { kind: address.hatype() });
        }
        let flags = SockFlag::SOCK_NONBLOCK | SockFlag::SOCK_CLOEXEC;
        let opened = socket(AddressFamily::Packet, SockType::Raw, flags, SockProtocol::EthAll).map_err(io::Error::from);
        let socket = opened.map_err(Failed::system("open a packet socket"))?;
        bind(socket.as_raw_fd(), &address).map_err(io::Error::from).map_err(Failed::system("bind a packet socket to it"))?;
        // The first call can exceed the system's limit, but needs CAP_NET_ADMIN on the whole machine. The second call grants at most the limit.
        if setsockopt(&socket, sockopt::RcvBufForce, &WAITING).is_err() {
            setsockopt(&socket, sockopt::RcvBuf, &WAITING).map_err(io::Error::from).map_err(Failed::system("let packets wait in its socket"))?;
        }
        let index = u32::try_from(address.ifindex()).map_err(io::Error::other).map_err(Failed::system("use its number"))?;
        let netlink = Netlink::open().map_err(Failed::system("speak to the kernel through rtnetlink"))?;
        // Promiscuous mode that somebody else has switched on stays on at the end.
        let restore = if hears_all {
            None
        } else {
            netlink.promiscuous(index, true).map_err(Failed::system("let it hear frames that are meant for others"))?;
            Some((netlink, index))
        };
        Ok(Self { socket, index: address.ifindex(), buffer: vec![0; LONGEST], restore })
    }
}

impl Drop for Interface {
    fn drop(&mut self) {
        if let Some((netlink, index)) = &self.restore {
            // The interface may be gone. Then nothing is left to restore.
            drop(netlink.promiscuous(*index, false));
        }
    }
}

/// Returns the address of an interface for a packet socket, and whether the interface is in promiscuous mode already.
fn find(spec: &InterfaceSpec) -> Result<(LinkAddr, bool), Failed> {
    let mut all = getifaddrs().map_err(io::Error::from).map_err(Failed::system("list the network interfaces"))?;
    let found = all.find_map(|entry| {
        let address = entry.address.filter(|address| address.family() == Some(AddressFamily::Packet))?;
        let link = *address.as_link_addr()?;
        (entry.interface_name == spec.name).then_some((link, entry.flags.contains(InterfaceFlags::IFF_PROMISC)))
    });
    found.ok_or_else(|| {
        let namespace =
            spec.namespace.as_ref().map_or_else(|| "the network namespace of the program".to_owned(), |name| format!("network namespace {name}"));
        Failed::NoDevice { namespace }
    })
}

impl Device for Interface {
    fn readable(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }

    fn receive(&mut self, packets: &mut Vec<Packet>) -> io::Result<bool> {
        loop {
            match recvfrom::<LinkAddr>(self.socket.as_raw_fd(), &mut self.buffer) {
                // Skipped are frames sent by this host, and frames of other interfaces that arrived before the socket was bound.
                Ok((length, Some(from))) if from.pkttype() != OUTGOING && from.ifindex() == self.index => {
                    packets.push(Packet::new(self.buffer[..length].to_vec(), Framing::Ethernet));
                    return Ok(true);
                }
                Ok(_) => {}
                // An interface that goes down reports so once, and may come up again.
                Err(Errno::EAGAIN | Errno::EINTR | Errno::ENETDOWN) => return Ok(false),
                Err(error) => return Err(error.into()),
            }
        }
    }

    fn send(&mut self, packets: &[Arc<Packet>]) -> (usize, Sent) {
        (1, Sent::of(send(self.socket.as_raw_fd(), packets[0].bytes(), MsgFlags::MSG_DONTWAIT).map_err(io::Error::from)))
    }
}

//! An interface that is there, through a packet socket (packet(7)): the router hears every frame that comes in at it and sends frames out of it.
//!
//! Frames keep their addresses, so two interfaces with a router between them behave like one cable. The host itself hears the frames too; it should have no
//! addresses on these interfaces, so that it does not answer them.

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

/// `ARPHRD_ETHER`.
const ETHERNET: u16 = 1;

/// `PACKET_OUTGOING`: what this host has sent out of the interface.
const OUTGOING: u8 = 4;

/// How much may wait in the socket until we read it \[bytes\].
const WAITING: usize = 8 << 20;

/// An interface that was there.
#[derive(Debug)]
pub struct Interface {
    socket: OwnedFd,
    index: usize,
    buffer: Vec<u8>,
    /// To be told to hear only its own packets again, when this is dropped.
    restore: Option<(Netlink, u32)>,
}

impl Interface {
    /// Begins to hear everything that comes in at the interface.
    pub(super) fn open(spec: &InterfaceSpec) -> Result<Self, Failed> {
        let (address, hears_all) = find(spec)?;
        if address.hatype() != ETHERNET {
            return Err(Failed::NotEthernet { kind: address.hatype() });
        }
        let flags = SockFlag::SOCK_NONBLOCK | SockFlag::SOCK_CLOEXEC;
        let opened = socket(AddressFamily::Packet, SockType::Raw, flags, SockProtocol::EthAll).map_err(io::Error::from);
        let socket = opened.map_err(Failed::system("open a packet socket"))?;
        bind(socket.as_raw_fd(), &address).map_err(io::Error::from).map_err(Failed::system("bind a packet socket to it"))?;
        // The first takes CAP_NET_ADMIN over the machine; without, the second gives as much as the system allows.
        if setsockopt(&socket, sockopt::RcvBufForce, &WAITING).is_err() {
            setsockopt(&socket, sockopt::RcvBuf, &WAITING).map_err(io::Error::from).map_err(Failed::system("let packets wait in its socket"))?;
        }
        let index = u32::try_from(address.ifindex()).map_err(io::Error::other).map_err(Failed::system("use its number"))?;
        let netlink = Netlink::open().map_err(Failed::system("speak to the kernel through rtnetlink"))?;
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
            // The interface may be gone: then there is nothing to restore.
            drop(netlink.promiscuous(*index, false));
        }
    }
}

/// The address of an interface as a socket names it, and whether it hears everything already.
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
                // Not what this host sends itself, and not what came from elsewhere before the socket was bound.
                Ok((length, Some(from))) if from.pkttype() != OUTGOING && from.ifindex() == self.index => {
                    packets.push(Packet::new(self.buffer[..length].to_vec(), Framing::Ethernet));
                    return Ok(true);
                }
                Ok(_) => {}
                // A device that goes down says so once, and may come up again.
                Err(Errno::EAGAIN | Errno::EINTR | Errno::ENETDOWN) => return Ok(false),
                Err(error) => return Err(error.into()),
            }
        }
    }

    fn send(&mut self, packets: &[Arc<Packet>]) -> (usize, Sent) {
        (1, Sent::of(send(self.socket.as_raw_fd(), packets[0].bytes(), MsgFlags::MSG_DONTWAIT).map_err(io::Error::from)))
    }
}

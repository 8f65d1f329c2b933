//! A TUN device: the host that has it sends packets of IP into it and finds those in it that we write.
//!
//! With offloads (`IFF_VNET_HDR`, `TUNSETOFFLOAD`) the host leaves it to us to cut large segments of TCP and UDP and to compute checksums, and takes such
//! segments from us: one system call for up to 64 packets, which is most of what a packet costs.

use std::io;
use std::os::fd::{AsFd as _, BorrowedFd};
use std::sync::Arc;

use cohaptic_linkfile::router::TunSpec;
use nix::net::if_::if_nametoindex;
use tun_rs::{DeviceBuilder, SyncDevice};

use super::netlink::Netlink;
use super::{Device, Failed, LONGEST, Sent};
use crate::packet::{Framing, Join, Packet, cut, join, slices};

/// How many packets wait in a device that we made until we read them. More than a burst, so that losses are those of a link.
const WAITING: u32 = 2_000;

/// A TUN device. One that we made is gone when this is dropped.
pub struct Tun {
    device: SyncDevice,
    name: String,
    /// Which packets are joined for it; `None` without offloads.
    offloads: Option<Join>,
    buffer: Vec<u8>,
    /// What stands before the data of a segment.
    head: Vec<u8>,
}

impl std::fmt::Debug for Tun {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tun").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Tun {
    /// Makes the device, gives it its addresses and switches it on; or attaches to one that is there.
    pub(super) fn open(spec: &TunSpec) -> Result<Self, Failed> {
        let name = spec.name.as_str();
        if spec.existing && if_nametoindex(name).is_err() {
            let namespace =
                spec.namespace.clone().map_or_else(|| "the network namespace of the program".to_owned(), |name| format!("network namespace {name}"));
            return Err(Failed::NoDevice { namespace });
        }
        let builder = DeviceBuilder::new().name(name).enable(false).offload(spec.offloads);
        let builder = if spec.existing { builder.inherit_enable_state() } else { builder };
        let device = builder.build_sync().map_err(Failed::system("open it through /dev/net/tun"))?;
        device.set_nonblocking(true).map_err(Failed::system("read it without waiting"))?;
        let offloads = device.tcp_gso().then_some(if device.udp_gso() { Join::TcpAndUdp } else { Join::Tcp });
        let tun = Self { device, name: name.to_owned(), offloads, buffer: vec![0; LONGEST], head: Vec::new() };
        if !spec.existing {
            tun.configure(spec)?;
        }
        Ok(tun)
    }

    fn configure(&self, spec: &TunSpec) -> Result<(), Failed> {
        let index = self.device.if_index().map_err(Failed::system("look up its number"))?;
        let netlink = Netlink::open().map_err(Failed::system("speak to the kernel through rtnetlink"))?;
        netlink.waiting(index, WAITING).map_err(Failed::system("let packets wait in it"))?;
        if let Some(mtu) = spec.mtu {
            netlink.mtu(index, mtu).map_err(Failed::system(format!("set its mtu to {mtu}")))?;
        }
        for address in &spec.addresses {
            netlink.address(index, *address).map_err(Failed::system(format!("give it the address {address}")))?;
        }
        netlink.up(index).map_err(Failed::system("switch it on"))
    }
}

impl Device for Tun {
    fn readable(&self) -> BorrowedFd<'_> {
        self.device.as_fd()
    }

    fn receive(&mut self, packets: &mut Vec<Packet>) -> io::Result<bool> {
        let length = match self.device.recv(&mut self.buffer) {
            Ok(length) => length,
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => return Ok(false),
            Err(error) => return Err(error),
        };
        match self.offloads {
            Some(_) => cut(&self.buffer[..length], packets),
            None => packets.push(Packet::new(self.buffer[..length].to_vec(), Framing::Ip)),
        }
        Ok(true)
    }

    fn send(&mut self, packets: &[Arc<Packet>]) -> (usize, Sent) {
        let Some(which) = self.offloads else { return (1, Sent::of(self.device.send(packets[0].bytes()))) };
        let count = join(packets, which, &mut self.head);
        (count, Sent::of(self.device.send_vectored(&slices(&packets[..count], &self.head))))
    }
}

//! TUN device: the host sends IP packets into the device, and receives the packets written to the device by the router.
//!
//! With offloads (`IFF_VNET_HDR`, `TUNSETOFFLOAD`) the host leaves to the router to cut large segments of TCP and UDP and to compute checksums, and takes such
//! segments from the router. One system call then carries up to 64 packets.

use std::fs::File;
use std::io::{self, Read as _, Write as _};
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};
use std::sync::Arc;

use cohaptic_linkfile::router::TunSpec;
use nix::net::if_::if_nametoindex;
use tun_rs::DeviceBuilder;

use super::netlink::Netlink;
use super::{Device, Failed, LONGEST, Sent};
use crate::packet::{Framing, Join, Packet, cut, join, slices};

/// Packets waiting in a device made by the router, at most. More than a burst, so that packets are lost in the links and not in the device.
const WAITING: u32 = 2_000;

/// TUN device. A device made by the router disappears with this value.
///
/// A process without the right to make the device can use the device of another process: [`into_descriptor`](Self::into_descriptor) on one side of a Unix
/// socket, [`of_descriptor`](Self::of_descriptor) on the other side.
pub struct Tun {
    device: File,
    name: String,
    /// Kinds of packets joined for the device; `None` without offloads.
    offloads: Option<Join>,
    /// Memory for one reading.
    buffer: Vec<u8>,
    /// Memory for the bytes before the data of a segment.
    head: Vec<u8>,
}

impl std::fmt::Debug for Tun {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tun").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Tun {
    /// Creates the device in the network namespace of the calling thread, adds its addresses and switches it on, or attaches to an existing device. The
    /// namespace in `spec` is only for messages.
    ///
    /// # Errors
    ///
    /// [`Failed`] with the failed step.
    pub fn open(spec: &TunSpec) -> Result<Self, Failed> {
        let name = spec.name.as_str();
        // Without this check, `/dev/net/tun` would create a missing device.
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
        if !spec.existing {
            let index = device.if_index().map_err(Failed::system("look up its number"))?;
            configure(index, spec)?;
        }
        // The device stays as long as any descriptor of its file is open, so the value of `tun_rs` is not needed any more.
        let descriptor = device.as_fd().try_clone_to_owned().map_err(Failed::system("copy its descriptor"))?;
        Ok(Self::of_descriptor(descriptor, name, offloads))
    }

    /// Returns the device of a descriptor that another process has opened without waiting. `offloads` are those of the device.
    #[must_use]
    pub fn of_descriptor(descriptor: OwnedFd, name: &str, offloads: Option<Join>) -> Self {
        Self { device: File::from(descriptor), name: name.to_owned(), offloads, buffer: vec![0; LONGEST], head: Vec::new() }
    }

    /// Returns the descriptor of the device, and its offloads, for another process.
    #[must_use]
    pub fn into_descriptor(self) -> (OwnedFd, Option<Join>) {
        (self.device.into(), self.offloads)
    }
}

/// Sets queue length, packet length and addresses of a new device, and switches the device on.
fn configure(index: u32, spec: &TunSpec) -> Result<(), Failed> {
    let netlink = Netlink::open().map_err(Failed::system("speak to the kernel through rtnetlink"))?;
    netlink.waiting(index, WAITING).map_err(Failed::system("let packets wait in it"))?;
    if let Some(mtu) = spec.mtu {
        netlink.mtu(index, mtu).map_err(Failed::system(format!("set its mtu to {mtu}")))?;
    }
    for address in &spec.addresses {
        netlink.address(index, *address).map_err(Failed::system(format!("give it the address {address}")))?;
    }
    // Last, so that no packet arrives at a device that is only half configured.
    netlink.up(index).map_err(Failed::system("switch it on"))
}

impl Device for Tun {
    fn readable(&self) -> BorrowedFd<'_> {
        self.device.as_fd()
    }

    fn receive(&mut self, packets: &mut Vec<Packet>) -> io::Result<bool> {
        let length = match self.device.read(&mut self.buffer) {
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
        let Some(which) = self.offloads else { return (1, Sent::of(self.device.write(packets[0].bytes()))) };
        let count = join(packets, which, &mut self.head);
        (count, Sent::of(self.device.write_vectored(&slices(&packets[..count], &self.head))))
    }
}

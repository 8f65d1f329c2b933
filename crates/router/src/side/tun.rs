//! A TUN device: the host that has it sends packets of IP into it and finds those in it that we write.

use std::io;
use std::os::fd::{AsFd as _, BorrowedFd};

use cohaptic_linkfile::router::TunSpec;
use nix::net::if_::if_nametoindex;
use tun_rs::{DeviceBuilder, SyncDevice};

use super::netlink::Netlink;
use super::{Device, Failed, Sent};
use crate::packet::Framing;

/// How many packets wait in a device that we made until we read them. More than a burst, so that losses are those of a link.
const WAITING: u32 = 2_000;

/// A TUN device. One that we made is gone when this is dropped.
pub struct Tun {
    device: SyncDevice,
    name: String,
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
        let builder = DeviceBuilder::new().name(name).enable(false);
        let builder = if spec.existing { builder.inherit_enable_state() } else { builder };
        let device = builder.build_sync().map_err(Failed::system("open it through /dev/net/tun"))?;
        device.set_nonblocking(true).map_err(Failed::system("read it without waiting"))?;
        let tun = Self { device, name: name.to_owned() };
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
    fn framing(&self) -> Framing {
        Framing::Ip
    }

    fn readable(&self) -> BorrowedFd<'_> {
        self.device.as_fd()
    }

    fn receive(&mut self, buffer: &mut [u8]) -> io::Result<Option<usize>> {
        match self.device.recv(buffer) {
            Ok(length) => Ok(Some(length)),
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn send(&mut self, packet: &[u8]) -> Sent {
        Sent::of(self.device.send(packet))
    }
}

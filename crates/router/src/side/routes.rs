//! Routes of a network namespace whose packets all go into one device.

use core::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::io::ErrorKind;

use cohaptic_linkfile::router::{Network, TunSpec};
use nix::net::if_::if_nametoindex;

use super::Failed;
use super::netlink::{LOCAL, MAIN, Netlink, Rule, Setting};

/// Name of the loopback interface.
const LOOPBACK: &str = "lo";
/// Table of the routes for packets of the namespace to itself. The kernel gives the number no meaning.
const OWN: u8 = 100;

/// Prepares the new network namespace of the calling thread: switches the loopback interface on, and leads all packets to other hosts into the device of
/// `spec`, in both versions of IP in which the device has an address.
///
/// # Errors
///
/// [`Failed`] with the failed step.
pub fn lead_all(spec: &TunSpec) -> Result<(), Failed> {
    let netlink = open()?;
    netlink.up(index(LOOPBACK)?).map_err(Failed::system("switch the loopback interface on"))?;
    let device = index(&spec.name)?;
    for all in [IpAddr::V4(Ipv4Addr::UNSPECIFIED), IpAddr::V6(Ipv6Addr::UNSPECIFIED)] {
        if spec.addresses.iter().any(|network| network.address().is_ipv4() == all.is_ipv4())
            && let Some(all) = Network::new(all, 0)
        {
            netlink.route(Some(device), all, MAIN, None).map_err(Failed::system("lead all packets into it"))?;
        }
    }
    Ok(())
}

/// Leads the packets that programs of the calling thread's network namespace send to the namespace itself into the device of `spec`: packets of IPv4 to
/// 127.0.0.0/8 and to the addresses of the device. Such a packet is delivered once the packet is written to the device. Comes after [`lead_all`].
///
/// The address `::1` disappears, and is unreachable. The kernel takes packets to `::1` from the loopback interface alone, so no device can carry them, and some programs choose
/// `::1` for the name `localhost` by themselves.
///
/// # Errors
///
/// [`Failed`] with the failed step. A kernel without several tables of routes (`CONFIG_IP_MULTIPLE_TABLES`) has no rules.
pub fn lead_own(spec: &TunSpec) -> Result<(), Failed> {
    let netlink = open()?;
    let device = index(&spec.name)?;
    for setting in [Setting::RouteLocalnet, Setting::AcceptLocal] {
        netlink.switch_on(device, setting).map_err(Failed::system("let it carry packets of the namespace to itself"))?;
    }
    let v4 = spec.addresses.iter().map(|network| network.address()).filter(IpAddr::is_ipv4);
    let own = v4.filter_map(|address| Some((Network::new(address, 32)?, address)));
    let loopback = Network::new(Ipv4Addr::new(127, 0, 0, 0).into(), 8).map(|network| (network, IpAddr::V4(Ipv4Addr::LOCALHOST)));
    for (network, source) in loopback.into_iter().chain(own) {
        netlink.route(Some(device), network, OWN, Some(source)).map_err(Failed::system(format!("lead packets to {network} into it")))?;
    }
    // The table of the namespace's addresses is asked first otherwise, and leads all packets to the loopback interface. The rule for arriving packets stays, so
    // that a packet from the device is delivered. The third rule refuses packets from 127.0.0.0/8 to other hosts, as the kernel does without the setting
    // `route_localnet`.
    let local = Rule { priority: 0, is_for_sent: false, source: None, table: Some(LOCAL) };
    let rules = [
        Rule { priority: 10, ..local },
        Rule { priority: 5, is_for_sent: true, table: Some(OWN), ..local },
        Rule { priority: 6, is_for_sent: true, source: Some((Ipv4Addr::new(127, 0, 0, 0), 8)), table: None },
    ];
    for rule in rules {
        netlink.add_rule(rule).map_err(Failed::system("add a rule of routes"))?;
    }
    netlink.remove_rule(local).map_err(Failed::system("move the first rule of routes"))?;
    if spec.addresses.iter().any(|network| network.address().is_ipv6())
        && let Some(loopback) = Network::new(Ipv6Addr::LOCALHOST.into(), 128)
    {
        match netlink.remove_address(index(LOOPBACK)?, loopback) {
            // A system may give the loopback interface no address of IPv6.
            Err(error) if error.kind() != ErrorKind::AddrNotAvailable => return Err(Failed::system("remove the address ::1")(error)),
            Ok(()) | Err(_) => {}
        }
        // The default route would lead packets to `::1` into the device, and the kernel would drop the packets without a word to their sender. The address has
        // gone before, because the kernel removes routes to an address together with the address.
        netlink.route(None, loopback, MAIN, None).map_err(Failed::system("make ::1 unreachable"))?;
    }
    Ok(())
}

fn open() -> Result<Netlink, Failed> {
    Netlink::open().map_err(Failed::system("speak to the kernel through rtnetlink"))
}

/// Returns the number of a device.
fn index(name: &str) -> Result<u32, Failed> {
    if_nametoindex(name).map_err(|error| Failed::system(format!("look up the number of {name}"))(error.into()))
}

//! Network and names of a host inside, as the text of one argument.

use core::net::IpAddr;

use cohaptic_linkfile::router::{Network, TunSpec};

/// Name of the device of a host.
pub(crate) const DEVICE: &str = "exec0";

/// Network and names of a host.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Setup {
    /// Name of the host, or `None` to keep the name of the machine.
    pub name: Option<String>,
    /// Addresses of the device, with the length of their network's prefix.
    pub addresses: Vec<Network>,
    /// Further names in `/etc/hosts`.
    pub hosts: Vec<(IpAddr, String)>,
    /// Name server in `/etc/resolv.conf`, or `None` for none.
    pub name_server: Option<IpAddr>,
    /// `true` if packets of the host to its own addresses of IPv4, such as 127.0.0.1, pass links: see [`Plan::loopback`](crate::Plan::loopback). The host then
    /// has no `::1`.
    pub loopback: bool,
}

impl Setup {
    /// Returns the text for [`Setup::of_text`].
    pub(crate) fn to_text(&self) -> String {
        let name = self.name.iter().map(|name| format!("name {name}"));
        let addresses = self.addresses.iter().map(|address| format!("address {address}"));
        let hosts = self.hosts.iter().map(|(address, name)| format!("host {address} {name}"));
        let server = self.name_server.iter().map(|address| format!("server {address}"));
        let loopback = self.loopback.then(|| "loopback".to_owned());
        name.chain(addresses).chain(hosts).chain(server).chain(loopback).collect::<Vec<_>>().join("\n")
    }

    /// Reads the text of a setup. Returns `None` for any other text.
    pub(super) fn of_text(text: &str) -> Option<Self> {
        let mut setup = Self::default();
        for line in text.lines() {
            match line.split(' ').collect::<Vec<_>>().as_slice() {
                ["name", name] => setup.name = Some((*name).to_owned()),
                ["address", address] => setup.addresses.push(address.parse().ok()?),
                ["host", address, name] => setup.hosts.push((address.parse().ok()?, (*name).to_owned())),
                ["server", address] => setup.name_server = Some(address.parse().ok()?),
                ["loopback"] => setup.loopback = true,
                _ => return None,
            }
        }
        Some(setup)
    }

    /// Returns the device of the host. Without `v6` the addresses of IPv6 are left out.
    pub(super) fn device(&self, v6: bool) -> TunSpec {
        TunSpec {
            name: DEVICE.to_owned(),
            existing: false,
            addresses: self.addresses.iter().copied().filter(|network| v6 || network.address().is_ipv4()).collect(),
            mtu: None,
            offloads: true,
            namespace: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_says_all() {
        let address = |text: &str| text.parse().unwrap();
        let setup = Setup {
            name: Some("client".to_owned()),
            addresses: vec!["10.0.2.15/24".parse().unwrap(), "fd00::15/64".parse().unwrap()],
            hosts: vec![(address("10.0.2.2"), "host".to_owned())],
            name_server: Some(address("10.0.2.3")),
            loopback: true,
        };
        assert_eq!(Setup::of_text(&setup.to_text()), Some(setup.clone()));
        assert_eq!(Setup::of_text(""), Some(Setup::default()));
        assert_eq!(Setup::of_text("nonsense"), None);
        assert_eq!((setup.device(true).addresses.len(), setup.device(false).addresses.len()), (2, 1));
    }
}

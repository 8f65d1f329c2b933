//! Reader of `left` and `right`: the network devices of the router.

use cohaptic_wan::parameters::{Form, Table, optional, usual};

use super::{Attachment, InterfaceSpec, Network, TunSpec};
use crate::document::{Node, quote};
use crate::reading::{Context, TableReader, values};

/// Table of a side.
pub(super) static SIDE: Table = Table::of(&[&[
    optional("tun", Form::Text, "Name of a TUN device, which the router makes and removes at its end")
        .expecting("tun = \"NAME\" for a device of the router, or interface = \"NAME\" for one that is there"),
    optional("interface", Form::Text, "Name of an Ethernet interface that exists, in place of tun"),
    optional(
        "namespace",
        Form::Like(&["lab", "/proc/4711/ns/net"]),
        "Network namespace of the device: a name or a path; without it that of the program",
    ),
    usual("existing", Form::Boolean, "false", "Whether the TUN device exists already and is left as it is"),
    usual("addresses", Form::List(&Form::Like(&["10.1.0.1/24", "fd00::1/64"])), "[]", "Addresses of the TUN device with their prefixes"),
    optional("mtu", Form::Integer(68, 65_535), "Largest packet that the TUN device takes, in bytes; the system's own by default")
        .expecting("a number of bytes, {}"),
    usual("offloads", Form::Boolean, "true", "Whether packets cross the TUN device in large segments, which the router cuts and joins"),
]]);

/// Reads a side: a TUN device, or an interface with a namespace.
pub(super) fn read_side(node: &Node, context: Context<'_>) -> Option<Attachment> {
    let mut table = TableReader::new(node, context, &SIDE, "a table with a tun or an interface")?;
    let interface = table.get("interface");
    let namespace = table.maybe("namespace", read_namespace);
    if let Some(interface) = interface {
        if let Some(tun) = table.get("tun") {
            values::refuse(context, &[Some(tun), Some(interface)], node, &"a side is a tun or an interface: expected only one of them");
            return None;
        }
        // `finish` reports the keys of a TUN device here, because no reader has asked for these keys.
        let name = read_device(interface, context);
        table.finish();
        return Some(Attachment::Interface(InterfaceSpec { name: name?, namespace: namespace? }));
    }
    let name = table.read("tun", read_device);
    let existing = table.value("existing");
    let (addresses_node, mtu_node) = (table.get("addresses"), table.get("mtu"));
    let addresses = table.read("addresses", read_addresses);
    let mtu: Option<Option<u64>> = table.maybe_value("mtu");
    let offloads = table.value("offloads");
    table.finish();
    if existing == Some(true)
        && let Some(given) = addresses_node.or(mtu_node)
    {
        context.fault_at(given, "an existing device is left as it is: expected no such key together with existing = true");
        return None;
    }
    // The declaration limits the MTU to 65,535, so that the conversion never fails.
    let mtu = mtu?.and_then(|mtu| u16::try_from(mtu).ok());
    Some(Attachment::Tun(TunSpec { name: name?, existing: existing?, addresses: addresses?, mtu, offloads: offloads?, namespace: namespace? }))
}

/// Checks both sides together: the kinds must be equal, and the devices different.
pub(super) fn check_sides(left: &Attachment, right: &Attachment, right_node: &Node, context: Context<'_>) -> Option<()> {
    let message = match (left, right) {
        (Attachment::Tun(_), Attachment::Interface(_)) | (Attachment::Interface(_), Attachment::Tun(_)) => {
            "one side is a tun, which carries packets, and the other an interface, which carries frames: expected two of a kind"
        }
        _ if left.device() == right.device() && left.namespace() == right.namespace() => "both sides are the same device: expected two",
        (Attachment::Tun(_), Attachment::Tun(_)) | (Attachment::Interface(_), Attachment::Interface(_)) => return Some(()),
    };
    context.fault_at(right_node, message);
    None
}

/// Reads the name of a network device. Linux allows 15 bytes, and neither slash, colon nor space.
fn read_device(node: &Node, context: Context<'_>) -> Option<String> {
    const EXPECTED: &str = "the name of a network device, 1 to 15 letters, digits and other signs, but no /, : and space";
    let name = values::text(node, context, EXPECTED)?;
    // In the name of a new device, the kernel replaces a percent sign and a letter by a number.
    let is_sign = |byte: u8| byte.is_ascii_graphic() && !matches!(byte, b'/' | b':' | b'%');
    if !(1..=15).contains(&name.len()) || !name.bytes().all(is_sign) || matches!(name, "." | "..") {
        context.fault_at(node, format!("{} cannot be this name: expected {EXPECTED}", quote(name)));
        return None;
    }
    Some(name.to_owned())
}

/// Reads the name or the path of a network namespace.
fn read_namespace(node: &Node, context: Context<'_>) -> Option<String> {
    const EXPECTED: &str = "a network namespace: its name, or a path such as \"/proc/4711/ns/net\"";
    let name = values::text(node, context, EXPECTED)?;
    if name.is_empty() || matches!(name, "." | "..") || name.contains(char::is_control) {
        context.fault_at(node, format!("{} is not a namespace: expected {EXPECTED}", quote(name)));
        return None;
    }
    Some(name.to_owned())
}

/// Reads a list of addresses with prefixes. Each element is read, also after a refused element.
fn read_addresses(node: &Node, context: Context<'_>) -> Option<Vec<Network>> {
    let elements = values::list(node, context, "a list of addresses such as [\"10.1.0.1/24\", \"fd00::1/64\"]")?;
    let read =
        elements.into_iter().map(|element| read_network(element, context, "an address with a prefix such as \"10.1.0.1/24\" or \"fd00::1/64\""));
    read.collect::<Vec<_>>().into_iter().collect()
}

/// Reads an address, alone or with the length of a prefix.
pub(super) fn read_network(node: &Node, context: Context<'_>, expected: &str) -> Option<Network> {
    let text = values::text(node, context, expected)?;
    let network = text.parse().ok();
    if network.is_none() {
        context.fault_at(node, format!("{} is not an address: expected {expected}", quote(text)));
    }
    network
}

//! The keys of a router file.

use super::link::{LINK_TABLE, MODULATOR};
use cohaptic_wan::parameters::{Form, Table, optional, required, usual};

/// The top of a router file.
pub static ROOT: Table = Table::of(&[&[
    required("router", Form::Table(&ROUTER), "Seed, memory, and where packets go to which no rule applies"),
    required("left", Form::Table(&SIDE), "One side: a tun or an interface"),
    required("right", Form::Table(&SIDE), "The other side: of the same kind as the first"),
    optional("links", Form::Table(&LINKS), "The links, each under its name"),
    optional("rules", Form::List(&Form::Table(&RULE)), "Which packets go where: the first rule that applies decides"),
    optional("modulators", Form::List(&Form::Table(&MODULATOR)), "Chains of states that links follow"),
]]);
const TARGET: Form = Form::Like(&["pass", "drop", "wan"]);
static ROUTER: Table = Table::of(&[&[
    usual("seed", Form::Integer(0, i64::MAX.unsigned_abs()), "0", "Seed of all random numbers"),
    optional("memory", Form::Table(&MEMORY), "How much may be inside all links together; what comes beyond is dropped"),
    required(
        "default",
        Form::AnyOf(const { &[TARGET, Form::Table(&DEFAULT)] }),
        "Where packets go to which no rule applies: the name of a link, pass or drop",
    ),
]]);
static DEFAULT: Table = Table::of(&[&[
    required("left-to-right", TARGET, "The name of a link, pass or drop"),
    required("right-to-left", TARGET, "The name of a link, pass or drop"),
]]);
static MEMORY: Table = Table::of(&[&[
    usual("packets", Form::Integer(1, 1 << 32), "262144", "The most packets"),
    usual("bytes", Form::Size, "\"256MB\"", "The most bytes"),
]]);
static SIDE: Table = Table::of(&[&[
    optional("tun", Form::Text, "Name of a TUN device, which is made and is gone with the router"),
    optional("interface", Form::Text, "In place of tun: name of an Ethernet interface that is there"),
    optional(
        "namespace",
        Form::Like(&["lab", "/proc/4711/ns/net"]),
        "Network namespace of the device: a name or a path; without it that of the program",
    ),
    usual("existing", Form::Boolean, "false", "The TUN device is there and is left as it is"),
    usual("addresses", Form::List(&Form::Like(&["10.1.0.1/24", "fd00::1/64"])), "[]", "Addresses of the TUN device with their prefixes"),
    optional("mtu", Form::Integer(68, 65_535), "The largest packet that the TUN device takes, in bytes; without it the system's"),
    usual("offloads", Form::Boolean, "true", "Packets cross the TUN device in large segments, which the router cuts and joins"),
]]);
static LINKS: Table = Table::with_others(&[], &Form::Table(&LINK_TABLE));
static RULE: Table = Table::of(&[&[
    optional(
        "from",
        Form::Words(&[("left", "what comes in on the left"), ("right", "what comes in on the right")]),
        "On which side the packet comes in",
    ),
    optional("source", Form::Like(&["10.1.0.0/16"]), "An address or a network that it comes from"),
    optional("destination", Form::Like(&["10.2.0.0/16"]), "An address or a network that it goes to"),
    optional(
        "protocol",
        Form::AnyOf(const { &[Form::Like(&["tcp", "udp", "icmp", "icmpv6"]), Form::Integer(0, 255)] }),
        "Its protocol, by name or number",
    ),
    optional("source-port", PORTS, "A port or a range of ports that it comes from"),
    optional("destination-port", PORTS, "A port or a range of ports that it goes to"),
    optional("port", PORTS, "A port or a range of ports, on either end"),
    required("link", TARGET, "Where it goes: the name of a link, pass or drop"),
]]);
const PORTS: Form = Form::AnyOf(&[Form::Integer(0, 65_535), Form::Like(&["5000-5999"])]);

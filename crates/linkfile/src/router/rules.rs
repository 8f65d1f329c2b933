//! Reader of `[\[rules\]]`: conditions on packets, and the target of matching packets.

use cohaptic_wan::parameters::{Choices, Form, Table, optional, required, words};

use super::sides::read_network;
use super::{NamedLink, Network, Ports, Protocol, RuleSpec, Side, Target};
use crate::document::{Node, Value, quote};
use crate::reading::{Context, TableReader, one_of, values};

/// Expected text of a target, for messages.
pub(super) const TARGET: &str = "the name of a link, \"pass\" or \"drop\"";

/// Form of a target.
pub(super) const TARGET_FORM: Form = Form::Like(&["pass", "drop", "wan"]);
/// Table of an entry `[\[rules\]]`.
pub(super) static RULE: Table = Table::of(&[&[
    optional("from", Form::Words(const { &words(&SIDES) }), "Side on which the packet comes in"),
    optional("source", Form::Like(&["10.1.0.0/16"]), "Source of the packet: an address or a network"),
    optional("destination", Form::Like(&["10.2.0.0/16"]), "Destination of the packet: an address or a network"),
    optional(
        "protocol",
        Form::AnyOf(const { &[Form::Like(&["tcp", "udp", "icmp", "icmpv6"]), Form::Integer(0, 255)] }),
        "Protocol of the packet, by name or number",
    ),
    optional("source-port", PORTS_FORM, "Source port of the packet, or a range of ports"),
    optional("destination-port", PORTS_FORM, "Destination port of the packet, or a range of ports"),
    optional("port", PORTS_FORM, "Source or destination port of the packet, or a range of ports"),
    required("link", TARGET_FORM, "Way of the packet: the name of a link, pass or drop").expecting(TARGET),
]]);
const SIDES: Choices<Side, 2> = [("left", Side::Left, "what comes in on the left"), ("right", Side::Right, "what comes in on the right")];
const PORTS_FORM: Form = Form::AnyOf(&[Form::Integer(0, 65_535), Form::Like(&["5000-5999"])]);

const PORTS: &str = "a port from 0 to 65535, or a range such as \"5000-5999\"";
const PROTOCOL: &str = "tcp, udp, icmp, icmpv6 or a number from 0 to 255";

/// Reads all rules. Returns `None` if a rule was refused. `links` is `None` if the links were refused.
pub(super) fn read_rules(node: &Node, links: Option<&[NamedLink]>, context: Context<'_>) -> Option<Vec<RuleSpec>> {
    let entries = values::list(node, context, "entries [[rules]]")?;
    // Collected twice, so that each rule is read also after a refused rule.
    let rules: Vec<_> = entries.into_iter().map(|entry| read_rule(entry, links, context)).collect();
    rules.into_iter().collect()
}

/// Reads a rule, and refuses a rule that no packet matches.
fn read_rule(node: &Node, links: Option<&[NamedLink]>, context: Context<'_>) -> Option<RuleSpec> {
    let mut table = TableReader::new(node, context, &RULE, "a table such as { protocol = \"tcp\", port = 80, link = \"wan\" }")?;
    let network = |node, context| read_network(node, context, "an address or a network such as \"10.1.0.0/16\" or \"fd00::/64\"");
    let from = table.maybe("from", |node, context| values::word(node, context, &SIDES));
    let source = table.maybe("source", network);
    let destination_node = table.get("destination");
    let destination = table.maybe("destination", network);
    let protocol_node = table.get("protocol");
    let protocol = table.maybe("protocol", read_protocol);
    // The first given key of ports stands for all three in a message about the protocol.
    let port_node = table.get("source-port").or_else(|| table.get("destination-port")).or_else(|| table.get("port"));
    let source_port = table.maybe("source-port", read_ports);
    let destination_port = table.maybe("destination-port", read_ports);
    let port = table.maybe("port", read_ports);
    let target = table.read("link", |node, context| read_target(node, links, context));
    table.finish();
    // A refused condition ends the reading here: the checks below compare conditions with each other.
    let (source, destination, protocol) = (source?, destination?, protocol?);
    if let (Some(source), Some(destination)) = (source, destination)
        && source.address().is_ipv4() != destination.address().is_ipv4()
    {
        context.fault_at(
            destination_node?,
            "source and destination are of different families, so no packet matches: expected two of IPv4 or two of IPv6",
        );
        return None;
    }
    check_protocol(protocol, [source, destination], port_node, protocol_node, context)?;
    Some(RuleSpec {
        from: from?,
        source,
        destination,
        protocol,
        source_port: source_port?,
        destination_port: destination_port?,
        port: port?,
        target: target?,
    })
}

/// Refuses a protocol that contradicts the ports or the networks of the rule, so that no packet matches. `port` is the node of any given key of ports.
fn check_protocol(
    protocol: Option<Protocol>,
    networks: [Option<Network>; 2],
    port: Option<&Node>,
    protocol_node: Option<&Node>,
    context: Context<'_>,
) -> Option<()> {
    let Some(protocol) = protocol else { return Some(()) };
    if port.is_some() && !protocol.has_ports() {
        values::refuse(
            context,
            &[port, protocol_node],
            port?,
            &"only tcp and udp have ports, so no packet matches: expected no port, or another protocol",
        );
        return None;
    }
    let foreign = match protocol {
        Protocol::ICMP => networks.into_iter().flatten().any(|network| network.address().is_ipv6()),
        Protocol::ICMPV6 => networks.into_iter().flatten().any(|network| network.address().is_ipv4()),
        _ => false,
    };
    if foreign {
        context
            .fault_at(protocol_node?, "icmp is of IPv4 and icmpv6 of IPv6, and the addresses are of the other family: expected the other protocol");
        return None;
    }
    Some(())
}

/// Reads a target: the name of a link, `pass` or `drop`.
pub(super) fn read_target(node: &Node, links: Option<&[NamedLink]>, context: Context<'_>) -> Option<Target> {
    let name = values::text(node, context, TARGET)?;
    match name {
        "pass" => return Some(Target::Pass),
        "drop" => return Some(Target::Drop),
        _ => {}
    }
    // Without the list of links the name cannot be checked. The fault of the list has been reported.
    let links = links?;
    let place = links.iter().position(|link| link.name == name);
    if place.is_none() {
        let names = links.iter().map(|link| link.name.as_str()).chain(["pass", "drop"]);
        context.fault_at(node, format!("there is no link {}: expected {}", quote(name), one_of(names, name)));
    }
    place.map(Target::Link)
}

/// Reads a protocol by name or number.
fn read_protocol(node: &Node, context: Context<'_>) -> Option<Protocol> {
    if let Value::Integer(_) = node.value {
        let number = values::integer(node, context, 0..=255, PROTOCOL)?;
        return u8::try_from(number).ok().map(Protocol);
    }
    let text = values::text(node, context, PROTOCOL)?;
    let named = Protocol::NAMED.iter().find(|(name, _)| *name == text).map(|(_, protocol)| *protocol);
    if named.is_none() {
        context.fault_at(
            node,
            format!("unknown name {}: expected {}, or a number from 0 to 255", quote(text), one_of(Protocol::NAMED.map(|named| named.0), text)),
        );
    }
    named
}

/// Reads a port, or a range of ports with both ends included.
fn read_ports(node: &Node, context: Context<'_>) -> Option<Ports> {
    if let Value::Integer(_) = node.value {
        let port = u16::try_from(values::integer(node, context, 0..=65_535, PORTS)?).ok()?;
        return Some(Ports { first: port, last: port });
    }
    let text = values::text(node, context, PORTS)?;
    // `parse` also takes a sign, so the digits are checked here.
    let port = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse::<u16>().ok()).flatten();
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let range = port(first.trim()).zip(port(last.trim())).filter(|(first, last)| first <= last);
    if range.is_none() {
        context.fault_at(node, format!("{} is not a range of ports: expected {PORTS}", quote(text)));
    }
    range.map(|(first, last)| Ports { first, last })
}

//! Reader of `[\[programs\]]`: the programs of a relay, and their addresses.

use std::net::SocketAddr;

use cohaptic_units::print::Counted;
use cohaptic_wan::parameters::{Form, Table, optional, required};

use super::RelayProgram;
use crate::document::{Node, quote};
use crate::reading::{Context, Names, TableReader, values};

/// Maximum number of programs. The relay opens a socket for each program, and has two links for each pair.
const MOST_PROGRAMS: usize = 256;

/// Table of an entry `[\[programs\]]`.
pub(super) static PROGRAM: Table = Table::of(&[&[
    required("name", Form::Text, "Name of the program, which names its links: unique, not all, without space and without . > / , and quotes")
        .expecting("the name of the program"),
    required("port", Form::Like(&["127.0.0.1:7001"]), "Address that stands for the program: other programs send there to reach it")
        .expecting("the address that stands for it, such as \"127.0.0.1:7001\""),
    optional(
        "address",
        Form::Like(&["127.0.0.1:9001"]),
        "Address from which the program sends and at which it listens; learnt from its first datagram by default",
    ),
]]);

/// Entry of a program, with the nodes of the file to which messages about its addresses point.
#[derive(Debug)]
struct Written<'a> {
    program: RelayProgram,
    port: &'a Node,
    address: Option<&'a Node>,
}

/// Reads the programs and the names of the programs, in the order of the file. Returns `None` if an entry was refused.
pub(super) fn read_programs(node: &Node, allow_remote: Option<bool>, context: Context<'_>) -> Option<(Names, Vec<RelayProgram>)> {
    let entries = values::list(node, context, "entries [[programs]]")?;
    if entries.len() > MOST_PROGRAMS {
        context.fault_at(node, format!("{} programs: expected at most {MOST_PROGRAMS}", entries.len()));
        return None;
    }
    let mut names = Names::of("program");
    // Collected as options first, so that each entry is read also after a refused entry.
    let written: Vec<Option<Written<'_>>> = entries.iter().map(|entry| read_program(entry, allow_remote, &mut names, context)).collect();
    let written: Vec<Written<'_>> = written.into_iter().collect::<Option<_>>()?;
    // Both checks run, so that the first fault of the text is found.
    let distinct = check_distinct(&written, context);
    let families = check_families(&written, context);
    (distinct && families).then(|| (names, written.into_iter().map(|written| written.program).collect()))
}

/// Reports a file with fewer than two programs.
pub(super) fn check_enough(names: &Names, node: &Node, context: Context<'_>) {
    if names.len() < 2 {
        context.fault_at(node, format!("a relay with {}: expected at least two entries [[programs]]", Counted(names.len(), "program")));
    }
}

/// Reads an entry, and adds the program's name to `names`. `allow_remote` is `None` if the key `allow-remote` was refused.
fn read_program<'a>(entry: &'a Node, allow_remote: Option<bool>, names: &mut Names, context: Context<'a>) -> Option<Written<'a>> {
    let mut table = TableReader::new(entry, context, &PROGRAM, "a table with name and port")?;
    let (port_node, address_node) = (table.get("port"), table.get("address"));
    let name = table.read("name", |node, context| read_name(node, names, context));
    let port = table.read("port", |node, context| {
        read_address(node, "an address with a port, such as \"127.0.0.1:7001\", \"[::1]:7001\" or \"localhost:7001\"", allow_remote, context)
    });
    let address = table.maybe("address", |node, context| {
        const EXPECTED: &str = "an address with a port above zero, such as \"127.0.0.1:9001\"; without this key it is learnt";
        let address = read_address(node, EXPECTED, allow_remote, context)?;
        // The relay sends to this address. Port 0 and an unspecified address are no destination.
        if address.port() == 0 || address.ip().is_unspecified() {
            context.fault_at(node, format!("no program can be reached at {address}: expected {EXPECTED}"));
            return None;
        }
        Some(address)
    });
    // Refusals count only after `finish`, so that every key is checked.
    table.finish();
    Some(Written { program: RelayProgram { name: name?, port: port?, address: address? }, port: port_node?, address: address_node })
}

/// Reads the name of a program or of a proxy. Programs follow the rule for names of peers, so that links of both are named alike.
pub(super) fn read_name(node: &Node, names: &mut Names, context: Context<'_>) -> Option<String> {
    const EXPECTED: &str = "a name, without space and none of . > / , \" and not \"all\"";
    let text = values::text(node, context, EXPECTED)?;
    // Dot and `>` have a meaning in keys and in the names of links.
    let unfit = |c: char| c.is_whitespace() || c.is_control() || matches!(c, '.' | '>' | '/' | ',' | '"');
    if text.is_empty() || text == "all" || text.contains(unfit) {
        context.fault_at(node, format!("{} cannot be the name of a {}: expected {EXPECTED}", quote(text), names.noun()));
        return None;
    }
    if !names.push(text) {
        context.fault_at(node, format!("there is a {} {} already: expected another name", names.noun(), quote(text)));
        return None;
    }
    Some(text.to_owned())
}

/// Reads a socket address, which must be a loopback address unless remote addresses are allowed.
pub(super) fn read_address(node: &Node, expected: &str, allow_remote: Option<bool>, context: Context<'_>) -> Option<SocketAddr> {
    let text = values::text(node, context, expected)?;
    let address = match crate::address(text) {
        Ok(address) => address,
        Err(error) => {
            context.fault_at(node, format!("{} {error}: expected {expected}", quote(text)));
            return None;
        }
    };
    // Without a value the key `allow-remote` was refused, and the fault is reported already.
    if !allow_remote? && !address.ip().is_loopback() {
        let message =
            format!("{address} is not on this machine: expected a loopback address such as 127.0.0.1 or [::1], or allow-remote = true under [relay]");
        context.fault_at(node, message);
        return None;
    }
    Some(address)
}

/// Checks that all ports differ and all addresses differ. Port 0 differs from every port, because the system chooses a free port for each.
fn check_distinct(written: &[Written<'_>], context: Context<'_>) -> bool {
    // All pairs, because the programs are few. The later entry is at fault, in the order of the text.
    let mut distinct = true;
    for (place, one) in written.iter().enumerate() {
        for other in &written[..place] {
            if one.program.port == other.program.port && one.program.port.port() != 0 {
                let message = format!("{} stands for program {} already: expected another port", one.program.port, quote(&other.program.name));
                context.fault_at(one.port, message);
                distinct = false;
            }
            if let (Some(address), Some(node)) = (one.program.address, one.address)
                && other.program.address == Some(address)
            {
                let message = format!("{address} is the address of program {} already: expected another one", quote(&other.program.name));
                context.fault_at(node, message);
                distinct = false;
            }
        }
    }
    distinct
}

/// Checks that the address of each program has the family of the ports of all other programs: datagrams to a program leave from these ports, and an IPv4
/// socket reaches no IPv6 address.
fn check_families(written: &[Written<'_>], context: Context<'_>) -> bool {
    let mut fit = true;
    for (place, one) in written.iter().enumerate() {
        // A learnt address is not known yet, and cannot be checked.
        let (Some(address), Some(node)) = (one.program.address, one.address) else { continue };
        let others = written.iter().enumerate().filter(|(other, _)| *other != place);
        if let Some((_, other)) = others.into_iter().find(|(_, other)| other.program.port.is_ipv4() != address.is_ipv4()) {
            let (port, name) = (other.program.port, quote(&other.program.name));
            let message = format!("{address} cannot be reached from {port}, the port of program {name}: expected IPv4 for both, or IPv6");
            context.fault_at(node, message);
            fit = false;
        }
    }
    fit
}

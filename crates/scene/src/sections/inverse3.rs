//! Reader of `inverse3`, the keys of a Haply Inverse3.

use core::time::Duration;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use cohaptic_linkfile::document::{Node, quote};
use cohaptic_linkfile::reading::values::ReadNumber as _;
use cohaptic_linkfile::reading::{Context, TableReader, defaults, values};
use cohaptic_linkfile::schema::{Form, Table, number, optional, usual};

use super::device::read_origin;
use crate::model::{Inverse3Device, Inverse3Spec};
use crate::quantities::{POSITION, POSITIVE_FORCE};

/// Largest force that a scene may ask for \[N\]. The largest force of the device is not published; another program clips at this force.
const MOST_FORCE: f64 = 10.0;
/// Greatest length of an id.
const LONGEST_ID: usize = 64;

/// Keys of an Inverse3. The limit of 2 N is the limit per axis of another program for the device.
pub(super) static INVERSE3: Table = Table::of(&[&[
    usual("service", Form::Text, "\"ws://127.0.0.1:10001/\"", "Address of Haply's Inverse Service on this machine"),
    usual(
        "device",
        Form::Like(&["first", "simulated"]),
        "\"first\"",
        "Device: the first that no other peer has, a simulated one, or the one with an id",
    ),
    optional("origin", Form::Triple(POSITION), "Origin of the scene in the coordinates of the device; needed before version 3.5 of the service"),
    usual("force-limit", number(POSITIVE_FORCE), "2", "Largest force that is sent to the service, at most 10 N"),
    optional("reading-age", Form::PositiveDuration, "Age of a reading above which the force is zero; by default 10 ms or three exchanges"),
]]);

impl Default for Inverse3Spec {
    fn default() -> Self {
        defaults(read_inverse3)
    }
}

pub(super) fn read_inverse3(node: &Node, context: Context<'_>) -> Option<Inverse3Spec> {
    let mut table = TableReader::new(node, context, &INVERSE3, "a table such as { device = \"first\", force-limit = 2.0 }")?;
    let service = table.read("service", read_service);
    let device = table.read("device", read_device);
    let origin = table.maybe("origin", read_origin);
    let limit = table.read("force-limit", read_limit);
    let reading_age = table.maybe("reading-age", read_age);
    table.finish();
    Some(Inverse3Spec { service: service?, device: device?, origin: origin?, force_limit: limit?, reading_age: reading_age? })
}

/// Reads the address of a service. Only addresses of this machine are taken: over a network, a lost segment of TCP costs 200 ms and more.
fn read_service(node: &Node, context: Context<'_>) -> Option<SocketAddr> {
    const EXPECTED: &str = "an address of this machine such as \"ws://127.0.0.1:10001/\"";
    let text = values::text(node, context, EXPECTED)?;
    let place = text.strip_prefix("ws://").map(|rest| rest.strip_suffix('/').unwrap_or(rest));
    let address = place.and_then(|place| match place.strip_prefix("localhost:") {
        Some(port) => port.parse().ok().map(|port| SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)),
        None => place.parse().ok(),
    });
    match address {
        Some(address) if address.ip().is_loopback() && address.port() != 0 => Some(address),
        Some(address) if !address.ip().is_loopback() => {
            let message =
                format!("{} is not an address of this machine: expected a service here, or a peer of kind \"udp\" beside the device", address.ip());
            context.fault_at(node, message);
            None
        }
        _ => {
            context.fault_at(node, format!("{} is not the address of a service: expected {EXPECTED}", quote(text)));
            None
        }
    }
}

fn read_device(node: &Node, context: Context<'_>) -> Option<Inverse3Device> {
    const EXPECTED: &str = "\"first\", \"simulated\", or the id of a device";
    match values::text(node, context, EXPECTED)? {
        "first" => Some(Inverse3Device::First),
        "simulated" => Some(Inverse3Device::Simulated),
        // An id is printable ASCII without spaces.
        id if (1..=LONGEST_ID).contains(&id.len()) && id.chars().all(|c| c.is_ascii_graphic()) => Some(Inverse3Device::Id(id.to_owned())),
        other => {
            context.fault_at(node, format!("{} is not an id: expected {EXPECTED}", quote(other)));
            None
        }
    }
}

fn read_limit(node: &Node, context: Context<'_>) -> Option<f64> {
    let limit = POSITIVE_FORCE.read(node, context)?;
    if limit > MOST_FORCE {
        context.fault_at(node, format!("{limit} N is more than the device is known to bear: expected at most {MOST_FORCE} N"));
        return None;
    }
    Some(limit)
}

fn read_age(node: &Node, context: Context<'_>) -> Option<Duration> {
    const MOST: Duration = Duration::from_secs(1);
    let age = values::positive_duration(node, context)?;
    if age > MOST {
        context.fault_at(node, "a force on a reading older than a second is no coupling any more: expected at most \"1s\"");
        return None;
    }
    Some(age)
}

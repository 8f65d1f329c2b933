//! Readers of `device`, `coupling`, `contact` and `clock` of a peer.

use core::time::Duration;

use cohaptic_linkfile::document::{Node, Value, quote};
use cohaptic_linkfile::reading::values::ReadNumber as _;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_linkfile::schema::{Choices, Form, Table, number, optional, required, somewhere, usual, vector, words};
use cohaptic_peer::rotation::Spin;
use cohaptic_peer::{Contact, DeviceConfig, Direction, Drift, Exchange, Gains};
use cohaptic_units::print::{Counted, Span};

use super::MOST;
use super::coordination::{SCALING, SCALINGS};
use super::rotation::{read_coupling_rotation, read_device_rotation};
use crate::context::{SceneContext, check_axis};
use crate::model::Scaling;
use crate::quantities::{DAMPING, INERTIA, MASS, POSITION, ROTATIONAL_DAMPING, ROTATIONAL_STIFFNESS, STIFFNESS};

pub(super) static DEVICE: Table = Table::of(&[&[
    somewhere("mass", number(MASS), "Mass of the device"),
    usual("damping", number(DAMPING), "0", "Viscous damping of the device"),
    optional("inertia", vector(INERTIA), "Moments of inertia of a device with six degrees of freedom"),
    usual("rotational-damping", vector(ROTATIONAL_DAMPING), "0", "Viscous rotational damping of the device"),
    usual(
        "exchange-every",
        Form::Integer(1, MOST),
        "1",
        "Ticks from one exchange with the device to the next: a reading, and the force that the device then keeps",
    )
    .expecting("a number of ticks, an integer from 1, of at most 100 ms together"),
    usual("exchange-age", Form::Integer(0, 1), "0", "Exchanges between a reading of the device and its use")
        .expecting("a number of exchanges, 0 or 1"),
]]);
pub(super) static COUPLING: Table = Table::of(&[&[
    somewhere("stiffness", number(STIFFNESS), "Stiffness between device and copy, K_C"),
    usual("damping", number(DAMPING), "0", "Damping between device and copy, B_C"),
    usual("scaling", SCALING, "\"none\"", "Scaling of stiffness and damping with the number of peers"),
    optional("rotational-stiffness", number(ROTATIONAL_STIFFNESS), "Rotational stiffness between device and copy, K_CR; needed with device.inertia"),
    usual("rotational-damping", number(ROTATIONAL_DAMPING), "0", "Rotational damping between device and copy, B_CR"),
]]);
pub(super) const CONTACT: Form = Form::AnyOf(&[Form::Words(&[("grasp", "held both ways"), ("none", "not touched")]), Form::Table(&PUSH)]);
static PUSH: Table = Table::of(&[&[
    required("push", DIRECTION, "Direction in which a finger pushes; the finger cannot pull").expecting("a direction such as \"+x\"")
]]);
const DIRECTION: Form = Form::Words(const { &words(&DIRECTIONS) });
const DIRECTIONS: Choices<Direction, 6> = [
    ("+x", Direction { axis: 0, positive: true }, "to larger x"),
    ("-x", Direction { axis: 0, positive: false }, "to smaller x"),
    ("+y", Direction { axis: 1, positive: true }, "to larger y"),
    ("-y", Direction { axis: 1, positive: false }, "to smaller y"),
    ("+z", Direction { axis: 2, positive: true }, "to larger z"),
    ("-z", Direction { axis: 2, positive: false }, "to smaller z"),
];
pub(super) static CLOCK: Table = Table::of(&[&[
    usual("offset", Form::Duration, "\"0s\"", "Lateness of the peer's first tick"),
    usual("drift", DRIFT, "0", "Gain of the peer's clock: parts per million as text, or seconds per second from -0.1 to 0.1"),
]]);
const DRIFT: Form = Form::AnyOf(&[Form::Like(&["20ppm", "-20ppm"]), Form::Number(values::Quantity::any(""))]);

pub(super) const A_COUPLING: &str = "a table such as { stiffness = 3500.0, damping = 5.0 }";

/// Reads a contact.
pub(super) fn read_contact(node: &Node, context: SceneContext<'_>) -> Option<Contact> {
    const EXPECTED: &str = "\"grasp\", \"none\" or { push = \"+x\" }";
    if let Some(text) = node.as_text() {
        return match text {
            "grasp" => Some(Contact::Grasp),
            "none" => Some(Contact::None),
            other => {
                context.fault_at(node, format!("unknown contact {}: expected {EXPECTED}", quote(other)));
                None
            }
        };
    }
    let mut table = TableReader::new(node, *context, &PUSH, EXPECTED)?;
    let direction = table.read("push", |node, _| read_direction(node, context));
    table.finish();
    direction.map(Contact::Push)
}

fn read_direction(node: &Node, context: SceneContext<'_>) -> Option<Direction> {
    let direction = values::word(node, *context, &DIRECTIONS)?;
    check_axis(node, context, direction.axis)?;
    Some(direction)
}

/// Reads the origin of a device: three numbers, because a device has three axes, however many the scene has.
pub(super) fn read_origin(node: &Node, context: Context<'_>) -> Option<[f64; 3]> {
    const EXPECTED: &str = "a list of three numbers [m], a place in the coordinates of the device";
    let elements = values::list(node, context, EXPECTED)?;
    let [x, y, z] = elements.as_slice() else {
        context.fault_at(node, format!("found a list of {}: expected {EXPECTED}", Counted(elements.len(), "number")));
        return None;
    };
    let read = |node| POSITION.read(node, context);
    let (x, y, z) = (read(x), read(y), read(z));
    Some([x?, y?, z?])
}

/// Longest time between two exchanges with a device. A force that acts for longer is no coupling any more, and drivers of devices end such a force.
const LONGEST_EXCHANGE: Duration = Duration::from_millis(100);

/// A device as written.
#[derive(Clone, Debug)]
pub(super) struct DeviceRead {
    pub(super) config: DeviceConfig,
    pub(super) exchange: Exchange,
    /// Rotational part; `None` for a device that does not turn.
    pub(super) turned: Option<Spin>,
}

/// Parts of a peer on which the exchanges of its device depend.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExchangeLimits {
    /// Tick of the peer; `None` if the tick is not known yet.
    pub(super) tick: Option<Duration>,
    /// `true` if computed forces act a tick late.
    pub(super) compute_delay: bool,
    /// `true` if the object turns.
    pub(super) turns: bool,
    /// `true` if readings are late unless the scene says otherwise.
    pub(super) late: bool,
}

/// Reads a device.
pub(super) fn read_device(node: &Node, context: Context<'_>, limits: ExchangeLimits, expected: &str) -> Option<DeviceRead> {
    let mut table = TableReader::new(node, context, &DEVICE, expected)?;
    let (mass, damping) = (table.value("mass"), table.value("damping"));
    let turned = read_device_rotation(&mut table);
    let exchange = read_exchange(&mut table, node, context, limits);
    table.finish();
    Some(DeviceRead { config: DeviceConfig { mass: mass?, damping: damping? }, exchange: exchange?, turned: turned? })
}

/// Reads the exchanges with a device, within the limits of its peer.
fn read_exchange(table: &mut TableReader<'_>, node: &Node, context: Context<'_>, limits: ExchangeLimits) -> Option<Exchange> {
    let nodes = ["exchange-every", "exchange-age"].map(|key| table.get(key));
    let (every, age): (Option<u64>, Option<u64>) = (table.value("exchange-every"), table.value("exchange-age"));
    let [of_every, of_age] = nodes;
    let late = if of_age.is_none() { limits.late } else { age? == 1 };
    let exchange = Exchange { every: u32::try_from(every?).unwrap_or(u32::MAX), late };
    // The key that makes the device slow is the place of a fault.
    let place = of_every.filter(|_| exchange.holds()).or_else(|| of_age.filter(|_| exchange.late)).unwrap_or(node);
    check_exchange(exchange, place, context, limits)
}

/// Returns the exchanges if a peer within `limits` can have them; else reports a fault at `node`.
pub(super) fn check_exchange(exchange: Exchange, node: &Node, context: Context<'_>, limits: ExchangeLimits) -> Option<Exchange> {
    if exchange == Exchange::EACH_TICK {
        return Some(exchange);
    }
    if limits.compute_delay {
        context.fault_at(
            node,
            "readings and forces of a slow device have their delays already: expected no compute-delay of 1, or an exchange at each tick",
        );
        return None;
    }
    if limits.turns {
        context.fault_at(
            node,
            "an object that turns needs devices that exchange at each tick: expected no object.inertia, or exchange-every = 1 and exchange-age = 0",
        );
        return None;
    }
    if let Some(span) = limits.tick.and_then(|tick| tick.checked_mul(exchange.every)).filter(|span| *span > LONGEST_EXCHANGE) {
        let message =
            format!("{} ticks are {}: expected at most {} from one exchange to the next", exchange.every, Span(span), Span(LONGEST_EXCHANGE));
        context.fault_at(node, message);
        return None;
    }
    Some(exchange)
}

/// Reads a coupling: gains, the scaling of the gains, and rotational gains, or `None` for a coupling without rotational gains.
pub(super) fn read_coupling(node: &Node, context: Context<'_>) -> Option<(Gains, Scaling, Option<Gains>)> {
    let mut table = TableReader::new(node, context, &COUPLING, A_COUPLING)?;
    let (stiffness, damping) = (table.value("stiffness"), table.value("damping"));
    let scaling = table.choice("scaling", &SCALINGS);
    let turned = read_coupling_rotation(&mut table);
    table.finish();
    Some((Gains { stiffness: stiffness?, damping: damping? }, scaling?, turned?))
}

pub(super) fn read_clock(node: &Node, context: Context<'_>) -> Option<(Duration, Drift)> {
    let mut table = TableReader::new(node, context, &CLOCK, "a table such as { offset = \"300us\", drift = \"20ppm\" }")?;
    let (offset, drift) = (table.value("offset"), table.read("drift", read_drift));
    table.finish();
    Some((offset?, drift?))
}

/// Reads a drift: a number in seconds gained per second, or a text in parts per million.
fn read_drift(node: &Node, context: Context<'_>) -> Option<Drift> {
    const EXPECTED: &str = "a drift such as \"20ppm\" or \"-20ppm\", or a number, seconds gained per second";
    let fraction = match &node.value {
        Value::Text(text) => {
            let fraction = parts_per_million(text);
            if fraction.is_none() {
                context.fault_at(node, format!("{} is not a drift: expected {EXPECTED}", quote(text)));
            }
            fraction?
        }
        Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date | Value::List(_) | Value::Table(_) => {
            values::number(node, context, EXPECTED)?
        }
    };
    Drift::from_fraction(fraction).map_err(|error| context.fault_at(node, error.to_string())).ok()
}

fn parts_per_million(text: &str) -> Option<f64> {
    let number = text.trim().strip_suffix("ppm")?.trim_end();
    // A text of digits, at most with a sign and points. Forms such as 1e3 or inf, which `parse` would accept, are refused.
    let digits = number.strip_prefix(['+', '-']).unwrap_or(number);
    let plain = digits.starts_with(|c: char| c.is_ascii_digit()) && digits.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    // A quotient, because 20 / 1e6 is the double nearest to 0.00002, and 20 * 1e-6 need not be.
    plain.then(|| number.parse::<f64>().ok()).flatten().map(|millionths| millionths / 1e6)
}

//! Reader of `hand` of a peer: the force or the arm of a hand.

use std::time::Duration;

use cohaptic_linkfile::document::{Entry, Node, Table as DocumentTable, quote};
use cohaptic_linkfile::reading::{Context, TableReader, only_one};
use cohaptic_linkfile::schema::{Form, Key, Table, number, optional, required, usual, vector};
use cohaptic_peer::{ArmConfig, Hand, Signal};
use cohaptic_units::Hertz;
use cohaptic_units::print::{SixDigits, Span};

use super::motion_file::{Columns, read_motion_file};
use super::operator::{OPERATOR, read_operator, remembers};
use crate::context::SceneContext;
use crate::quantities::{ADDED_MASS, ANGLE, DAMPING, FORCE, FREQUENCY, POSITION, STIFFNESS, Spread, TORQUE, read_vector, vector_of};

pub(super) const HAND: Form = Form::AnyOf(&[Form::Words(&[("none", "nothing; takes away what [peer] says")]), Form::Table(&HAND_TABLE)]);
static HAND_TABLE: Table = Table::of(&[&[
    optional("force", vector(FORCE), "Constant force of the hand"),
    optional("sine", Form::Table(&FORCE_SINE), "Force of the hand that follows a sine"),
    optional("file", Form::File, "CSV file of a recorded force with the header t,fx (and fy, fz, then tx,ty,tz), in s, N and N·m"),
    optional("arm", Form::Table(&ARM), "Arm that adds its mass to the device and holds the device with a damper and a spring"),
    optional("follows", Form::Table(&FOLLOWS), "Motion that the arm wants, with hand.arm; rest at 0 by default"),
    optional("operator", Form::Table(&OPERATOR), "Model of a person who does the task of the scene, with an arm"),
    optional("torque", vector(TORQUE), "Constant torque on a device that turns, in world axes"),
]]);
static FORCE_SINE: Table = Table::of(&[
    &[required("amplitude", vector(FORCE), "Amplitude")],
    &SINE,
    &[optional("torque", vector(TORQUE), "Amplitude of a torque that follows the same sine")],
]);
pub(super) static MOTION_SINE: Table = Table::of(&[&[required("amplitude", vector(POSITION), "Amplitude")], &SINE]);
const SINE: [Key; 2] = [
    required("frequency", number(FREQUENCY), "Frequency, below half the rate of ticks"),
    usual("phase", number(ANGLE), "0", "Phase at the beginning of the scene"),
];
static ARM: Table = Table::of(&[&[
    required("mass", number(ADDED_MASS), "Mass that the arm adds to the device"),
    required("damping", number(DAMPING), "Damping of the arm"),
    required("stiffness", number(STIFFNESS), "Stiffness of the arm"),
]]);
static FOLLOWS: Table = Table::of(&[&[
    optional("position", vector(POSITION), "Constant position that the arm wants"),
    optional("sine", Form::Table(&MOTION_SINE), "Wanted position that follows a sine"),
    optional("file", Form::File, "CSV file of a recorded motion with the header t,x (and y, z, then tx,ty,tz), in s, m and N·m"),
]]);

const EXPECTED: &str = "\"none\", { force = … }, { sine = … }, { file = … }, { arm = …, follows = … } or { operator = … }";

/// Reads a hand. Returns `Some(None)` for "none", and `None` if the hand was refused.
pub(crate) fn read_hand(node: &Node, context: SceneContext<'_>) -> Option<Option<Hand>> {
    match node.as_text() {
        Some("none") => return Some(None),
        Some(other) => {
            context.fault_at(node, format!("unknown hand {}: expected {EXPECTED}", quote(other)));
            return None;
        }
        None => {}
    }
    let mut table = TableReader::new(node, *context, &HAND_TABLE, EXPECTED)?;
    let force = table.entry("force");
    let sine = table.entry("sine");
    let file = table.entry("file");
    let arm = table.entry("arm");
    let follows = table.entry("follows");
    let operator = table.entry("operator");
    let torque = table.entry("torque");
    table.finish();
    // A torque alone is a hand without a force. `read_hand_torque` reads the torque.
    if torque.is_some() && [force, sine, file, arm, operator].iter().all(Option::is_none) {
        return Some(None);
    }
    let chosen = only_one(node, *context, &[force, sine, file, arm, operator], EXPECTED)?;
    if let (Some(follows), None) = (follows, arm) {
        context.fault(follows.key, &follows.node.path, "only an arm follows a wanted motion: expected arm = { mass, damping, stiffness } too");
        return None;
    }
    let value = &*chosen.node;
    let signal = match chosen.name.as_str() {
        "force" => Signal::Constant(constant(&HAND_TABLE, chosen, context)?),
        "sine" => read_sine(value, context, &FORCE_SINE)?,
        "file" => Signal::Table(read_motion_file(value, context, Columns::Force)?.motion),
        "operator" => return read_operator(value, context).map(Some),
        _ => {
            let arm = read_arm(value, *context);
            let follows = match follows {
                Some(entry) => read_follows(&entry.node, context),
                None => Some(Signal::Constant([0.0; 3])),
            };
            return Some(Some(Hand::Arm { arm: arm?, follows: follows? }));
        }
    };
    Some(Some(Hand::Force(signal)))
}

/// Reads the vector of an entry of the table of `declaration`.
fn constant(declaration: &Table, entry: &Entry, context: SceneContext<'_>) -> Option<[f64; 3]> {
    read_vector(declaration.key(&entry.name)?.quantity(), &entry.node, context, Spread::Refused)
}

/// Reads the torque of a hand; `Some(None)` for a hand without a torque.
pub(super) fn read_hand_torque(hand: &Node, context: SceneContext<'_>) -> Option<Option<Signal>> {
    let Some(table) = hand.as_table() else { return Some(None) };
    let within = |key: &str| table.get(key).filter(|entry| entry.node.as_table().is_some());
    let sine = within("sine").and_then(|sine| Some((&sine.node, sine.node.as_table()?.get("torque")?)));
    let file = |table: Option<&DocumentTable>, columns: Columns| {
        // `read_hand` reads the same file and reports the faults. Here, a file with a fault has no torque.
        let torque = table.and_then(|table| table.get("file")).and_then(|file| read_motion_file(&file.node, context, columns)?.torque);
        torque.map(Signal::Table)
    };
    let follows = within("follows").and_then(|follows| follows.node.as_table());
    let file = file(Some(table), Columns::Force).or_else(|| file(follows, Columns::Position));
    let torque = table.get("torque");
    if let (Some(torque), true) = (torque, sine.is_some() || file.is_some()) {
        let other = if sine.is_some() { "sine.torque" } else { "the torques of a file" };
        context.fault(torque.key, &torque.node.path, format!("a torque and {other} exclude each other: expected one of the two"));
        return None;
    }
    if let Some(torque) = torque {
        return Some(Some(Signal::Constant(constant(&HAND_TABLE, torque, context)?)));
    }
    let Some((sine, torque)) = sine else { return Some(file) };
    let amplitude = constant(&FORCE_SINE, torque, context);
    // `read_hand` reports faults of these two keys, and missing and unknown keys. So this table is not finished.
    let mut table = TableReader::new(sine, *context, &FORCE_SINE, EXPECTED)?;
    let (frequency, phase): (Option<f64>, _) = (table.value("frequency"), table.value("phase"));
    Some(Some(Signal::Sine { amplitude: amplitude?, frequency: Hertz(frequency?), phase: phase? }))
}

/// Returns false after a fault if the peer's ticks cannot sample the sine of the hand, or the peer cannot hold all that an operator has not seen yet, otherwise
/// true. A hand is computed once per tick, so that a sine of half the rate of ticks or faster has the values of a slower sine, or zeros alone (Shannon 1949).
pub(crate) fn hand_is_sampled(hand: Option<&Hand>, tick: Duration, node: &Node, context: Context<'_>) -> bool {
    let (signal, path): (&Signal, &[&str]) = match hand {
        Some(Hand::Force(signal)) => (signal, &["sine", "frequency"]),
        Some(Hand::Arm { follows, .. }) => (follows, &["follows", "sine", "frequency"]),
        Some(Hand::Operator { operator, .. }) => return remembers(operator, tick, node, context),
        None => return true,
    };
    let Signal::Sine { frequency: Hertz(frequency), .. } = signal else { return true };
    // Half the rate of ticks in Hz, the Nyquist frequency.
    let least_refused = 0.5 / tick.as_secs_f64();
    let is_sampled = *frequency < least_refused;
    if !is_sampled {
        let within = path.iter().try_fold(node, |node, key| node.as_table()?.get(key).map(|entry| &*entry.node));
        let message = format!(
            "{} is too fast for a hand that is computed once a tick of {}: expected below {} Hz",
            SixDigits(*frequency),
            Span(tick),
            SixDigits(least_refused)
        );
        context.fault_at(within.unwrap_or(node), message);
    }
    is_sampled
}

fn read_arm(node: &Node, context: Context<'_>) -> Option<ArmConfig> {
    let mut table = TableReader::new(node, context, &ARM, "a table such as { mass = 0.5, damping = 3.0, stiffness = 200.0 }")?;
    let (mass, damping, stiffness) = (table.value("mass"), table.value("damping"), table.value("stiffness"));
    table.finish();
    Some(ArmConfig { mass: mass?, damping: damping?, stiffness: stiffness? })
}

fn read_follows(node: &Node, context: SceneContext<'_>) -> Option<Signal> {
    const EXPECTED: &str = "{ position = … }, { sine = … } or { file = … }";
    let mut table = TableReader::new(node, *context, &FOLLOWS, EXPECTED)?;
    let choices = [table.entry("position"), table.entry("sine"), table.entry("file")];
    table.finish();
    let chosen = only_one(node, *context, &choices, EXPECTED)?;
    let value = &*chosen.node;
    match chosen.name.as_str() {
        "position" => Some(Signal::Constant(constant(&FOLLOWS, chosen, context)?)),
        "sine" => read_sine(value, context, &MOTION_SINE),
        _ => Some(Signal::Table(read_motion_file(value, context, Columns::Position)?.motion)),
    }
}

/// Reads a sine. [`read_hand_torque`] reads the torque of the sine.
pub(super) fn read_sine(node: &Node, context: SceneContext<'_>, declaration: &'static Table) -> Option<Signal> {
    let mut table = TableReader::new(node, *context, declaration, "a table such as { amplitude = 2.0, frequency = 0.7, phase = 0.0 }")?;
    // Marks the key as known, so that `finish` does not refuse the key.
    if declaration.key("torque").is_some() {
        table.get("torque");
    }
    let amplitude = vector_of(&mut table, "amplitude", context, Spread::Refused);
    let (frequency, phase) = (table.value("frequency"), table.value("phase"));
    table.finish();
    Some(Signal::Sine { amplitude: amplitude?, frequency: Hertz(frequency?), phase: phase? })
}

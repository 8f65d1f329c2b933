//! What a hand does: `hand` of a peer.

use std::time::Duration;

use cohaptic_linkfile::document::{Node, quote};
use cohaptic_linkfile::reading::values::{Quantity, ReadNumber as _};
use cohaptic_linkfile::reading::{Context, TableReader, only_one};
use cohaptic_peer::{ArmConfig, Hand, Signal};
use cohaptic_units::Hertz;
use cohaptic_units::print::{SixDigits, Span};

use super::motion_file::{Columns, read_motion_file};
use crate::context::SceneContext;
use crate::quantities::{ADDED_MASS, ANGLE, DAMPING, FORCE, FREQUENCY, POSITION, STIFFNESS, Spread, read_vector};

const EXPECTED: &str = "\"none\", { force = … }, { sine = … }, { file = … } or { arm = …, follows = … }";

/// A hand; `Some(None)` for "none".
pub(crate) fn read_hand(node: &Node, context: SceneContext<'_>) -> Option<Option<Hand>> {
    match node.as_text() {
        Some("none") => return Some(None),
        Some(other) => {
            context.fault_at(node, format!("unknown hand {}: expected {EXPECTED}", quote(other)));
            return None;
        }
        None => {}
    }
    let mut table = TableReader::new(node, *context, EXPECTED)?;
    let force = table.entry("force");
    let sine = table.entry("sine");
    let file = table.entry("file");
    let arm = table.entry("arm");
    let follows = table.entry("follows");
    let torque = table.entry("torque");
    table.finish();
    if torque.is_some() && [force, sine, file, arm].iter().all(Option::is_none) {
        return Some(None);
    }
    let chosen = only_one(node, *context, &[force, sine, file, arm], EXPECTED)?;
    if let (Some(follows), None) = (follows, arm) {
        context.fault(follows.key, &follows.node.path, "only an arm follows a wanted motion: expected arm = { mass, damping, stiffness } beside it");
        return None;
    }
    let value = &*chosen.node;
    let signal = match chosen.name.as_str() {
        "force" => Signal::Constant(read_vector(FORCE, value, context, Spread::Refused)?),
        "sine" => read_sine(value, context, FORCE, &["torque"])?,
        "file" => Signal::Table(read_motion_file(value, context, Columns::Force)?.motion),
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

/// Refuses a sine that the ticks of its peer cannot show, and returns whether the hand has none. A hand is computed once a tick, so that at half the rate of ticks
/// and above its values are those of a slower sine, or all zero (Shannon 1949).
pub(crate) fn hand_is_sampled(hand: Option<&Hand>, tick: Duration, node: &Node, context: Context<'_>) -> bool {
    let (signal, path): (&Signal, &[&str]) = match hand {
        Some(Hand::Force(signal)) => (signal, &["sine", "frequency"]),
        Some(Hand::Arm { follows, .. }) => (follows, &["follows", "sine", "frequency"]),
        None => return true,
    };
    let Signal::Sine { frequency: Hertz(frequency), .. } = signal else { return true };
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
    let mut table = TableReader::new(node, context, "a table such as { mass = 0.5, damping = 3.0, stiffness = 200.0 }")?;
    let mass = table.required("mass", &ADDED_MASS.expected(), |node, context| ADDED_MASS.read(node, context));
    let damping = table.required("damping", &DAMPING.expected(), |node, context| DAMPING.read(node, context));
    let stiffness = table.required("stiffness", &STIFFNESS.expected(), |node, context| STIFFNESS.read(node, context));
    table.finish();
    Some(ArmConfig { mass: mass?, damping: damping?, stiffness: stiffness? })
}

fn read_follows(node: &Node, context: SceneContext<'_>) -> Option<Signal> {
    const EXPECTED: &str = "{ position = … }, { sine = … } or { file = … }";
    let mut table = TableReader::new(node, *context, EXPECTED)?;
    let choices = [table.entry("position"), table.entry("sine"), table.entry("file")];
    table.finish();
    let chosen = only_one(node, *context, &choices, EXPECTED)?;
    let value = &*chosen.node;
    match chosen.name.as_str() {
        "position" => Some(Signal::Constant(read_vector(POSITION, value, context, Spread::Refused)?)),
        "sine" => read_sine(value, context, POSITION, &[]),
        _ => Some(Signal::Table(read_motion_file(value, context, Columns::Position)?.motion)),
    }
}

/// A sine. `beside`: keys of the same table that somebody else reads.
fn read_sine(node: &Node, context: SceneContext<'_>, quantity: Quantity, beside: &[&'static str]) -> Option<Signal> {
    let mut table = TableReader::new(node, *context, "a table such as { amplitude = 2.0, frequency = 0.7, phase = 0.0 }")?;
    table.know(beside);
    let amplitude = table.required("amplitude", &quantity.expected(), |node, _| read_vector(quantity, node, context, Spread::Refused));
    let frequency = table.required("frequency", &FREQUENCY.expected(), |node, context| FREQUENCY.read(node, context));
    let phase = table.optional("phase", 0.0, |node, context| ANGLE.read(node, context));
    table.finish();
    Some(Signal::Sine { amplitude: amplitude?, frequency: Hertz(frequency?), phase: phase? })
}

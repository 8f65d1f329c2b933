//! `[scene]`, `[coordination]` and `[simulation]`.

use core::time::Duration;

use cohaptic_linkfile::document::{Node, quote};
use cohaptic_linkfile::link::is_empty;
use cohaptic_linkfile::mesh::read_peer_name;
use cohaptic_linkfile::reading::values::ReadNumber as _;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_peer::coordination::{LawForm, LawSettings, LawValue, LawValues, Pull};
use cohaptic_peer::rotation::Triple;
use cohaptic_peer::{Coordination, Gains, Integrator, SendWhen};

use super::rotation::{read_rotational_damping, read_rotational_stiffness};
use crate::model::{Axes, CoordinationSpec, Scaling};
use crate::quantities::{DAMPING, DISTANCE, ENERGY, IMPEDANCE, STIFFNESS};

/// The most peers that `count` makes: a slip of the finger must not take all memory. Each takes about two kilobytes.
const MOST_PEERS: u64 = 1_000_000;
/// A tick may not take for ever.
const MOST_ROTATION_STEPS: u64 = 10_000;

/// `[scene]`. A field is `None` where it was refused.
#[derive(Debug, Default)]
pub(crate) struct Header {
    /// `Some(None)`: not given.
    pub(crate) title: Option<Option<String>>,
    pub(crate) duration: Option<Duration>,
    pub(crate) seed: Option<u64>,
    pub(crate) axes: Option<Axes>,
    /// `Some(None)`: not given.
    pub(crate) count: Option<Option<u64>>,
}

/// `[simulation]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Stepping {
    pub(crate) integrator: Integrator,
    /// Steps a tick of what turns.
    pub(crate) rotation_steps: u32,
}

impl Default for Stepping {
    fn default() -> Self {
        Self { integrator: Integrator::default(), rotation_steps: 1 }
    }
}

pub(crate) fn read_header(node: &Node, context: Context<'_>) -> Option<Header> {
    let mut table = TableReader::new(node, context, "a table such as [scene]")?;
    let title = table.maybe("title", |node, context| values::text(node, context, "a text").map(str::to_owned));
    let duration = table.required("duration", "a duration above zero such as \"7s\"", values::positive_duration);
    let seed = table
        .optional("seed", 0, |node, context| values::integer(node, context, 0..=i64::MAX.unsigned_abs(), "an integer from 0 to 9223372036854775807"));
    let axes = table.optional("axes", Axes::One, read_axes);
    let count = table.maybe("count", |node, context| {
        values::integer(node, context, 2..=MOST_PEERS, &format!("a number of peers, an integer from 2 to {MOST_PEERS}"))
    });
    table.finish();
    Some(Header { title, duration, seed, axes, count })
}

fn read_axes(node: &Node, context: Context<'_>) -> Option<Axes> {
    match values::integer(node, context, 1..=3, "a number of axes: 1, 2 or 3")? {
        1 => Some(Axes::One),
        2 => Some(Axes::Two),
        _ => Some(Axes::Three),
    }
}

/// `[coordination]`: the controller, and the gains on turns as written.
pub(crate) fn read_coordination(node: &Node, context: Context<'_>) -> Option<(CoordinationSpec, Gains<Option<Triple>>)> {
    let mut table = TableReader::new(node, context, "a table such as [coordination]")?;
    let strategies: Vec<_> = Coordination::ALL.iter().map(|strategy| (strategy.name(), *strategy)).collect();
    let names = strategies.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let strategy = table.required("strategy", &format!("one of {names}"), |node, context| {
        let short = node.as_text().and_then(Coordination::named).filter(|strategy| strategy.short_name() == node.as_text());
        short.or_else(|| values::choice(node, context, &strategies))
    });
    let scaling = table.optional("scaling", Scaling::None, read_scaling);
    let pulls = [("mean", Pull::Mean), ("sum", Pull::Sum)];
    let pull = table.optional("pull", Pull::Mean, |node, context| values::choice(node, context, &pulls));
    let stiffness = table.required("stiffness", &STIFFNESS.expected(), |node, context| STIFFNESS.read(node, context));
    let damping = table.optional("damping", 0.0, |node, context| DAMPING.read(node, context));
    let update = table.required("update", "a duration above zero such as \"8ms\"", values::positive_duration);
    let send_when = table.maybe("send-when", read_send_when);
    let stiffness_of_turns = table.maybe("rotational-stiffness", read_rotational_stiffness);
    let damping_of_turns = table.maybe("rotational-damping", read_rotational_damping);
    let settings = read_settings(&mut table);
    table.finish();
    let spec = CoordinationSpec {
        strategy: strategy?,
        scaling: scaling?,
        pull: pull?,
        gains: Gains { stiffness: stiffness?, damping: damping? },
        settings: settings?,
        update: update?,
        send_when: send_when?,
    };
    Some((spec, Gains { stiffness: stiffness_of_turns?, damping: damping_of_turns? }))
}

/// `send-when`.
pub(super) fn read_send_when(node: &Node, context: Context<'_>) -> Option<SendWhen> {
    const EXPECTED: &str = "a table such as { velocity = \"10%\", position = 0.0005, heartbeat = \"1s\" }";
    let mut table = TableReader::new(node, context, EXPECTED)?;
    let velocity = table.maybe("velocity", |node, context| {
        let part = values::probability(node, context)?;
        if part.get() >= 1.0 {
            context.fault_at(node, "with a dead band of 100% a peer that stops is not heard of: expected less than 100%");
            return None;
        }
        Some(part.get())
    });
    let position = table.maybe("position", |node, context| DISTANCE.read(node, context));
    let heartbeat = table.maybe("heartbeat", values::positive_duration);
    let is_empty = table.get("velocity").is_none() && table.get("position").is_none();
    table.finish();
    if is_empty {
        context.fault_at(node, format!("nothing says when a sample is worth sending: expected velocity or position, in {EXPECTED}"));
        return None;
    }
    Some(SendWhen { velocity: velocity?, position: position?, heartbeat: heartbeat? })
}

/// The tables `[coordination.NAME]`, each with the parameters that a strategy has of its own. They may stand there whatever the strategy of the scene is.
fn read_settings(coordination: &mut TableReader<'_>) -> Option<LawSettings> {
    let mut settings = LawSettings::default();
    let mut is_read = true;
    for law in Coordination::ALL.iter().copied().filter(|law| !law.parameters().is_empty()) {
        let values = coordination.optional(law.name(), *settings.of(law), |node, context| read_values(node, context, law));
        is_read &= values.is_some();
        *settings.of_mut(law) = values.unwrap_or_default();
    }
    is_read.then_some(settings)
}

fn read_values(node: &Node, context: Context<'_>, law: Coordination) -> Option<LawValues> {
    let mut table = TableReader::new(node, context, &format!("a table such as [coordination.{}]", law.name()))?;
    let mut values = LawValues::defaults(law.parameters());
    let mut is_read = true;
    for (place, parameter) in law.parameters().iter().enumerate() {
        match table.optional(parameter.key, values.get(place), |node, context| read_value(parameter.form, node, context)) {
            Some(value) => values.set(place, value),
            None => is_read = false,
        }
    }
    table.finish();
    is_read.then_some(values)
}

/// A parameter that changes: of which strategy, its place among those of the strategy, and its value.
pub(super) type ParameterChange = (Coordination, usize, LawValue);

/// The tables of strategies in an entry of the timeline, each with the parameters that change.
pub(super) fn read_parameter_changes(coordination: &mut TableReader<'_>) -> Option<Vec<ParameterChange>> {
    let (mut changes, mut is_read) = (Vec::new(), true);
    for law in Coordination::ALL.iter().copied().filter(|law| law.parameters().iter().any(|parameter| parameter.can_change)) {
        is_read &= coordination.maybe(law.name(), |node, context| read_changes(node, law, &mut changes, context)).is_some();
    }
    is_read.then_some(changes)
}

fn read_changes(node: &Node, law: Coordination, changes: &mut Vec<ParameterChange>, context: Context<'_>) -> Option<()> {
    let mut table = TableReader::new(node, context, &format!("a table of the parameters of {} that change", law.name()))?;
    let mut is_read = true;
    for (place, parameter) in law.parameters().iter().enumerate().filter(|(_, parameter)| parameter.can_change) {
        match table.maybe(parameter.key, |node, context| read_change(parameter.form, node, context)) {
            Some(value) => changes.extend(value.map(|value| (law, place, value))),
            None => is_read = false,
        }
    }
    table.finish();
    if is_empty(node) {
        context.fault_at(node, format!("nothing changes: expected parameters of {}", law.name()));
        return None;
    }
    is_read.then_some(())
}

fn read_change(form: LawForm, node: &Node, context: Context<'_>) -> Option<LawValue> {
    if form != form.without_automatic() && node.as_text() == Some("auto") {
        context.fault_at(node, "\"auto\" is computed once, from the links at the beginning: expected a value");
        return None;
    }
    read_value(form.without_automatic(), node, context)
}

fn read_value(form: LawForm, node: &Node, context: Context<'_>) -> Option<LawValue> {
    let is_automatic = node.as_text() == Some("auto");
    match form {
        LawForm::AutomaticDuration | LawForm::AutomaticDamping if is_automatic => Some(LawValue::Automatic),
        LawForm::Duration | LawForm::AutomaticDuration => values::duration(node, context).map(LawValue::Duration),
        LawForm::AutomaticDamping => match node.as_text() {
            Some(word) => {
                context.fault_at(node, format!("unknown name {}: expected auto, or {}", quote(word), DAMPING.expected()));
                None
            }
            None => DAMPING.read(node, context).map(LawValue::Number),
        },
        LawForm::Damping => DAMPING.read(node, context).map(LawValue::Number),
        LawForm::Impedance => IMPEDANCE.read(node, context).map(LawValue::Number),
        LawForm::Energy => ENERGY.read(node, context).map(LawValue::Number),
        LawForm::Words(words) => {
            let choices: Vec<_> = words.iter().enumerate().map(|(place, (word, _))| (*word, place)).collect();
            values::choice(node, context, &choices).map(LawValue::Word)
        }
        LawForm::Peer => read_peer_name(node, context).map(LawValue::Place),
    }
}

/// How gains follow the number of peers.
pub(crate) fn read_scaling(node: &Node, context: Context<'_>) -> Option<Scaling> {
    values::choice(node, context, &[("none", Scaling::None), ("inverse-n", Scaling::InverseN)])
}

/// `[simulation]`.
pub(crate) fn read_stepping(node: &Node, context: Context<'_>) -> Option<Stepping> {
    let mut table = TableReader::new(node, context, "a table such as [simulation]")?;
    let names = [("exact", Method::Exact), ("semi-implicit-euler", Method::SemiImplicitEuler), ("rk4", Method::RungeKutta4)];
    let method = table.optional("integrator", Method::Exact, |node, context| values::choice(node, context, &names));
    let substeps = table.maybe("substeps", |node, context| {
        if method == Some(Method::Exact) {
            context.fault_at(node, "the integrator \"exact\" takes no substeps: expected no such key, or \"semi-implicit-euler\" or \"rk4\"");
            return None;
        }
        values::integer(node, context, 1..=u64::from(u32::MAX), "a number of steps a tick, an integer from 1 to 4294967295")
    });
    let rotation_steps = table.optional("rotation-steps", 1, |node, context| {
        values::integer(node, context, 1..=MOST_ROTATION_STEPS, &format!("a number of steps a tick, an integer from 1 to {MOST_ROTATION_STEPS}"))
    });
    table.finish();
    let steps = u32::try_from(substeps?.unwrap_or(1)).ok()?;
    let integrator = match method? {
        Method::Exact => Integrator::Exact,
        Method::SemiImplicitEuler => Integrator::SemiImplicitEuler { steps },
        Method::RungeKutta4 => Integrator::RungeKutta4 { steps },
    };
    Some(Stepping { integrator, rotation_steps: u32::try_from(rotation_steps?).ok()? })
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Method {
    Exact,
    SemiImplicitEuler,
    RungeKutta4,
}

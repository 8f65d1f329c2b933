//! Reader of `[coordination]`, and of its changes in the timeline.

use std::sync::LazyLock;

use cohaptic_linkfile::document::{Node, quote};
use cohaptic_linkfile::link::is_empty;
use cohaptic_linkfile::mesh::read_peer_name;
use cohaptic_linkfile::reading::values::ReadNumber as _;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_linkfile::schema::{Choices, Form, Key, Table, number, optional, required, usual, vector, words};
use cohaptic_peer::coordination::{LawForm, LawParameter, LawSettings, LawValue, LawValues, Pull};
use cohaptic_peer::rotation::Triple;
use cohaptic_peer::{Coordination, Gains, SendWhen};

use super::rotation::{maybe_triple, read_rotational_stiffness};
use crate::model::{CoordinationSpec, Scaling};
use crate::quantities::{DAMPING, DISTANCE, ENERGY, IMPEDANCE, ROTATIONAL_DAMPING, ROTATIONAL_STIFFNESS, STIFFNESS};

pub(crate) static COORDINATION: Table = Table::of(&[&[
    required("strategy", Form::Words(const { &words(&STRATEGIES) }), "Law of the force on each copy").expecting("one of {}"),
    required("stiffness", number(STIFFNESS), "Gain on the difference of positions, K_T"),
    usual("damping", number(DAMPING), "0", "Gain on the difference of velocities, B_T"),
    required("update", Form::PositiveDuration, "Time between two samples of a peer; a whole multiple of every peer's tick"),
    optional("send-when", Form::Table(&SEND_WHEN), "Conditions on which a sample is sent; all samples are sent by default"),
    usual("scaling", SCALING, "\"none\"", "Scaling of both gains with the number of peers"),
    usual("pull", Form::Words(const { &words(&PULLS) }), "\"mean\"", "Number of times that both gains count"),
    optional(
        "rotational-stiffness",
        vector(ROTATIONAL_STIFFNESS),
        "Gain on angles between copies, K_R, about each axis at most the sum of the other two; K_T times inertia over mass by default",
    ),
    optional(
        "rotational-damping",
        vector(ROTATIONAL_DAMPING),
        "Gain on the difference of angular velocities, B_R; B_T times inertia over mass by default",
    ),
]])
.and(|| &LAWS);
static LAWS: LazyLock<Vec<Key>> = LazyLock::new(|| law_keys(false));
static SEND_WHEN: Table = Table::of(&[&[
    optional("velocity", Form::Probability, "Least relative change of the velocity since the last sample that was sent, below 100%"),
    optional("position", number(DISTANCE), "Least distance of the copy from the position at which receivers hold it"),
    optional("heartbeat", Form::PositiveDuration, "Longest time between two samples that are sent"),
]]);
const STRATEGIES: Choices<Coordination, { Coordination::ALL.len() }> = {
    let mut choices = [("", Coordination::ALL[0], ""); Coordination::ALL.len()];
    let mut place = 0;
    while place < choices.len() {
        let strategy = Coordination::ALL[place];
        choices[place] = (strategy.name(), strategy, strategy.about());
        place += 1;
    }
    choices
};
const PULLS: Choices<Pull, 2> =
    [("mean", Pull::Mean, "once"), ("sum", Pull::Sum, "times N-1 among N peers; average-position is proportional-derivative then")];
pub(super) const SCALING: Form = Form::Words(const { &words(&SCALINGS) });
/// Rules for the dependence of gains on the number of peers.
pub(super) const SCALINGS: Choices<Scaling, 2> =
    [("none", Scaling::None, "as they are written"), ("inverse-n", Scaling::InverseN, "times 4(N-1)/N^2 among N peers; of a coupling times 2/N")];

/// Keys of `coordination` in an entry of the timeline.
pub(super) static CHANGES: Table = Table::of(&[&[
    optional("stiffness", number(STIFFNESS), "Gain on the difference of positions; unchanged by default"),
    optional("damping", number(DAMPING), "Gain on the difference of velocities; unchanged by default"),
    optional("rotational-stiffness", vector(ROTATIONAL_STIFFNESS), "Gain on angles; unchanged by default"),
    optional("rotational-damping", vector(ROTATIONAL_DAMPING), "Gain on the difference of angular velocities; unchanged by default"),
    optional("send-when", Form::Table(&SEND_WHEN), "Conditions on which a sample is sent; unchanged by default"),
]])
.and(|| &CHANGING_LAWS);
static CHANGING_LAWS: LazyLock<Vec<Key>> = LazyLock::new(|| law_keys(true));

/// Returns a key per strategy with own parameters: the table of all parameters or, with `changing`, of the parameters that the timeline may change.
fn law_keys(changing: bool) -> Vec<Key> {
    let key_of = |parameter: &LawParameter| match (changing, parameter.default) {
        // In the timeline an absent parameter does not change, so that no default is shown.
        (true, _) => optional(parameter.key, form_of(parameter.form.without_automatic()), "From then on"),
        // A parameter without a default is optional; for every other parameter the default is shown.
        (false, "") => optional(parameter.key, form_of(parameter.form), parameter.about),
        (false, default) => usual(parameter.key, form_of(parameter.form), default, parameter.about),
    };
    let table_of = |law: &Coordination| {
        let keys: Vec<Key> = law.parameters().iter().filter(|parameter| !changing || parameter.can_change).map(key_of).collect();
        // Declarations are `'static`. The two callers are `LazyLock`s, so that each `LazyLock` leaks its declarations once.
        let groups: &'static [&'static [Key]] = vec![&*keys.leak()].leak();
        (!groups[0].is_empty()).then(|| optional(law.name(), Form::Table(Box::leak(Box::new(Table::of(groups)))), "Parameters of this law"))
    };
    Coordination::ALL.iter().filter_map(table_of).collect()
}

const fn form_of(form: LawForm) -> Form {
    const AUTOMATIC: Form = Form::Words(&[("auto", "as the links of the scene ask for")]);
    match form {
        LawForm::Duration => Form::Duration,
        LawForm::AutomaticDuration => Form::AnyOf(&[AUTOMATIC, Form::Duration]),
        LawForm::AutomaticDamping => Form::AnyOf(const { &[AUTOMATIC, number(DAMPING)] }),
        LawForm::Damping => number(DAMPING),
        LawForm::Impedance => number(IMPEDANCE),
        LawForm::Energy => number(ENERGY),
        LawForm::Words(words) => Form::Words(words),
        LawForm::Peer => Form::Text,
    }
}

/// Reads `[coordination]`: the controller, and the gains of rotations as written.
pub(crate) fn read_coordination(node: &Node, context: Context<'_>) -> Option<(CoordinationSpec, Gains<Option<Triple>>)> {
    let mut table = TableReader::new(node, context, &COORDINATION, "a table such as [coordination]")?;
    // Short names, such as PD, are accepted beside the names in the catalogue.
    let strategy = table.read("strategy", |node, context| {
        let short = node.as_text().and_then(Coordination::named).filter(|strategy| strategy.short_name() == node.as_text());
        short.or_else(|| values::word(node, context, &STRATEGIES))
    });
    let (scaling, pull) = (table.choice("scaling", &SCALINGS), table.choice("pull", &PULLS));
    let (stiffness, damping, update) = (table.value("stiffness"), table.value("damping"), table.value("update"));
    let send_when = table.maybe("send-when", read_send_when);
    let stiffness_of_turns = table.maybe("rotational-stiffness", read_rotational_stiffness);
    let damping_of_turns = maybe_triple(&mut table, "rotational-damping");
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

/// Reads `send-when`.
fn read_send_when(node: &Node, context: Context<'_>) -> Option<SendWhen> {
    const EXPECTED: &str = "a table such as { velocity = \"10%\", position = 0.0005, heartbeat = \"1s\" }";
    let mut table = TableReader::new(node, context, &SEND_WHEN, EXPECTED)?;
    let velocity = table.maybe("velocity", |node, context| {
        let part = values::probability(node, context)?;
        // A peer that stops differs from the velocity sent last by all of this velocity, so that no larger difference can be asked for.
        if part.get() >= 1.0 {
            context.fault_at(node, "with a dead band of 100% a peer that stops is not heard of: expected less than 100%");
            return None;
        }
        Some(part.get())
    });
    let (position, heartbeat) = (table.maybe_value("position"), table.maybe_value("heartbeat"));
    // A heartbeat alone only makes sending slower, as a longer `update` does.
    let is_empty = table.get("velocity").is_none() && table.get("position").is_none();
    table.finish();
    if is_empty {
        context.fault_at(node, format!("nothing says when a sample is worth sending: expected velocity or position, in {EXPECTED}"));
        return None;
    }
    Some(SendWhen { velocity: velocity?, position: position?, heartbeat: heartbeat? })
}

/// Reads the tables `[coordination.NAME]` of own parameters of strategies. A table may be given whatever the strategy of the scene is, so that a scene can be
/// run with several strategies.
fn read_settings(coordination: &mut TableReader<'_>) -> Option<LawSettings> {
    let mut settings = LawSettings::default();
    let mut is_read = true;
    for law in Coordination::ALL.iter().copied().filter(|law| !law.parameters().is_empty()) {
        // `None` is a fault. The loop goes on, so that the faults of all tables are reported.
        let values = coordination.maybe(law.name(), |node, context| read_values(node, context, law));
        is_read &= values.is_some();
        if let Some(Some(values)) = values {
            *settings.of_mut(law) = values;
        }
    }
    is_read.then_some(settings)
}

fn read_values(node: &Node, context: Context<'_>, law: Coordination) -> Option<LawValues> {
    let declaration = COORDINATION.table(law.name());
    let mut table = TableReader::new(node, context, declaration, &format!("a table such as [coordination.{}]", law.name()))?;
    let mut values = LawValues::defaults(law.parameters());
    let mut is_read = true;
    for (place, parameter) in law.parameters().iter().enumerate() {
        match table.maybe(parameter.key, |node, context| read_value(parameter.form, node, context)) {
            Some(Some(value)) => values.set(place, value),
            Some(None) => {}
            None => is_read = false,
        }
    }
    table.finish();
    is_read.then_some(values)
}

/// A changed parameter: the strategy, the index among the parameters of the strategy, and the new value.
pub(super) type ParameterChange = (Coordination, usize, LawValue);

/// Reads the tables of strategies in an entry of the timeline. Returns the changed parameters.
fn read_parameter_changes(coordination: &mut TableReader<'_>) -> Option<Vec<ParameterChange>> {
    let (mut changes, mut is_read) = (Vec::new(), true);
    for law in Coordination::ALL.iter().copied().filter(|law| law.parameters().iter().any(|parameter| parameter.can_change)) {
        is_read &= coordination.maybe(law.name(), |node, context| read_changes(node, law, &mut changes, context)).is_some();
    }
    is_read.then_some(changes)
}

fn read_changes(node: &Node, law: Coordination, changes: &mut Vec<ParameterChange>, context: Context<'_>) -> Option<()> {
    let mut table = TableReader::new(node, context, CHANGES.table(law.name()), &format!("a table of the parameters of {} that change", law.name()))?;
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
    // Without this branch the message would ask for a value, and not say why "auto" is refused.
    if form != form.without_automatic() && node.as_text() == Some("auto") {
        context.fault_at(node, "\"auto\" is computed once, from the links at the beginning: expected a value");
        return None;
    }
    read_value(form.without_automatic(), node, context)
}

fn read_value(form: LawForm, node: &Node, context: Context<'_>) -> Option<LawValue> {
    let is_automatic = node.as_text() == Some("auto");
    match form {
        // Stands before the arms of the same forms for values.
        LawForm::AutomaticDuration | LawForm::AutomaticDamping if is_automatic => Some(LawValue::Automatic),
        LawForm::Duration | LawForm::AutomaticDuration => values::duration(node, context).map(LawValue::Duration),
        // A text is a mistyped "auto". The message for a number alone would not name the word.
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
            let choices: Vec<_> = words.iter().enumerate().map(|(place, (word, about))| (*word, place, *about)).collect();
            values::word(node, context, &choices).map(LawValue::Word)
        }
        LawForm::Peer => read_peer_name(node, context).map(LawValue::Place),
    }
}

/// Changes of the coordination at every peer, from an entry of the timeline. A gain of `None` stays as before.
#[derive(Debug)]
pub(super) struct CoordinationChanges {
    pub(super) gains: Gains<Option<f64>>,
    pub(super) of_turns: Gains<Option<Triple>>,
    pub(super) send_when: Option<SendWhen>,
    pub(super) parameters: Vec<ParameterChange>,
}

pub(super) fn read_coordination_changes(node: &Node, context: Context<'_>) -> Option<CoordinationChanges> {
    let mut table = TableReader::new(node, context, &CHANGES, "a table such as { stiffness = 1000.0, damping = 5.0 }")?;
    let (stiffness, damping) = (table.maybe_value("stiffness"), table.maybe_value("damping"));
    let stiffness_of_turns = table.maybe("rotational-stiffness", read_rotational_stiffness);
    let damping_of_turns = maybe_triple(&mut table, "rotational-damping");
    let send_when = table.maybe("send-when", read_send_when);
    let parameters = read_parameter_changes(&mut table);
    table.finish();
    if is_empty(node) {
        context.fault_at(node, "nothing changes: expected stiffness, damping, send-when, or a table of a strategy with parameters that change");
        return None;
    }
    Some(CoordinationChanges {
        gains: Gains { stiffness: stiffness?, damping: damping? },
        of_turns: Gains { stiffness: stiffness_of_turns?, damping: damping_of_turns? },
        send_when: send_when?,
        parameters: parameters?,
    })
}

//! `loss`: which packets are lost.

use cohaptic_units::Probability;
use cohaptic_wan::{Bursts, FourState, GilbertElliott, GilbertElliottInTime, Loss};

use super::loss_pattern::{read_lost_packets, read_lost_times};
use super::read_chance;
use crate::document::Node;
use crate::reading::values::{self, PACKETS, ReadNumber as _};
use crate::reading::{Context, TableReader, only_one};

const EXPECTED: &str =
    "a probability such as \"1%\", or { gilbert-elliott = … }, { states = … }, { bursts = … }, { correlated = … }, { packets = … } or { times = … }";
const CHAIN: &str = "a table such as { p = 0.01, r = 0.1 } or { mean-good = \"160ms\", mean-bad = \"40ms\" }";

pub(super) fn read_loss(node: &Node, context: Context<'_>) -> Option<Loss> {
    if node.as_table().is_none() {
        let probability = values::probability(node, context)?;
        return Some(if probability == Probability::ZERO { Loss::None } else { Loss::Independent(probability) });
    }
    let mut table = TableReader::new(node, context, EXPECTED)?;
    let models = ["gilbert-elliott", "states", "bursts", "correlated", "packets", "times"].map(|key| table.entry(key));
    let every = table.entry("every");
    table.finish();
    let chosen = only_one(node, context, &models, EXPECTED)?;
    let value = &*chosen.node;
    if let Some(every) = every.filter(|_| !matches!(chosen.name.as_str(), "packets" | "times")) {
        context.fault(every.key, &every.node.path, format!("every means nothing beside {}: expected it beside packets or times", chosen.name));
        return None;
    }
    match chosen.name.as_str() {
        "gilbert-elliott" => read_gilbert_elliott(value, context),
        "states" => read_states(value, context).map(Loss::FourState),
        "bursts" => read_bursts(value, context).map(Loss::FourState),
        "packets" => read_lost_packets(value, every.map(|every| &*every.node), context).map(Loss::Pattern),
        "times" => read_lost_times(value, every.map(|every| &*every.node), context).map(Loss::Pattern),
        _ => read_chance(value, context).map(|chance| if chance.is_never() { Loss::None } else { Loss::Correlated(chance) }),
    }
}

/// The chain of packets, or that in continuous time.
fn read_gilbert_elliott(node: &Node, context: Context<'_>) -> Option<Loss> {
    let mut table = TableReader::new(node, context, CHAIN)?;
    let in_time = table.get("mean-good").is_some() || table.get("mean-bad").is_some();
    let h = table.optional("h", Probability::ZERO, values::probability);
    let k = table.optional("k", Probability::ONE, values::probability);
    if in_time {
        let (p, r) = (table.entry("p"), table.entry("r"));
        let good = table.required("mean-good", "the mean time in the good state, a duration such as \"160ms\"", values::positive_duration);
        let bad = table.required("mean-bad", "the mean time in the bad state, a duration such as \"40ms\"", values::positive_duration);
        table.finish();
        if let Some(entry) = p.or(r) {
            let message = format!("{} beside mean times: expected either p and r, for each packet, or mean-good and mean-bad", entry.name);
            context.fault(entry.key, &entry.node.path, message);
            return None;
        }
        let chain = GilbertElliottInTime::new(good?, bad?, h?, k?);
        return chain.map(Loss::GilbertElliottInTime).map_err(|error| values::refuse(context, &[], node, &error)).ok();
    }
    let p = table.required("p", "a probability, of going from good to bad", values::probability);
    let r = table.maybe("r", values::probability);
    table.finish();
    let p = p?;
    let r = match r? {
        Some(r) => r,
        None => complement(p)?,
    };
    Some(Loss::GilbertElliott(GilbertElliott { p, r, h: h?, k: k? }))
}

/// Salsano's four states, with the defaults of tc.
fn read_states(node: &Node, context: Context<'_>) -> Option<FourState> {
    let mut table = TableReader::new(node, context, "a table such as { p13 = 0.01, p31 = 0.3 }")?;
    let p13 = table.required("p13", "a probability, of going from the gap to a burst", values::probability);
    let p31 = table.maybe("p31", values::probability);
    let p32 = table.optional("p32", Probability::ZERO, values::probability);
    let p23 = table.optional("p23", Probability::ONE, values::probability);
    let p14 = table.optional("p14", Probability::ZERO, values::probability);
    table.finish();
    let p13 = p13?;
    let p31 = match p31? {
        Some(p31) => p31,
        None => complement(p13)?,
    };
    FourState::new(p13, p31, p32?, p23?, p14?).map_err(|error| values::refuse(context, &[], node, &error)).ok()
}

/// The same in the words of a person.
fn read_bursts(node: &Node, context: Context<'_>) -> Option<FourState> {
    let mut table = TableReader::new(node, context, "a table such as { loss = \"2%\", length = 5 }")?;
    let loss = table.required("loss", "a probability, the mean fraction lost", values::probability);
    let length =
        table.required("length", "the mean length of a burst, a number of packets of at least 1", |node, context| PACKETS.read(node, context));
    let density = table.optional("density", Probability::ONE, values::probability);
    let isolated = table.optional("isolated", Probability::ZERO, values::probability);
    let good_run = table.optional("good-run", 1.0, |node, context| PACKETS.read(node, context));
    table.finish();
    let bursts = Bursts { loss: loss?.get(), length: length?, density: density?.get(), isolated: isolated?.get(), good_run: good_run? };
    FourState::from_bursts(bursts).map_err(|error| values::refuse(context, &[], node, &error)).ok()
}

fn complement(p: Probability) -> Option<Probability> {
    Probability::new(1.0 - p.get()).ok()
}

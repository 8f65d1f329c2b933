//! Reader of `loss`: the model of lost packets.

use cohaptic_units::Probability;
use cohaptic_wan::{Bursts, FourState, GilbertElliott, GilbertElliottInTime, Loss};

use super::loss_pattern::{read_lost_packets, read_lost_times};
use super::read_chance;
use crate::document::Node;
use crate::link::keys::LINK_TABLE;
use crate::reading::{Context, TableReader, only_one, values};

const EXPECTED: &str =
    "a probability such as \"1%\", or { gilbert-elliott = … }, { states = … }, { bursts = … }, { correlated = … }, { packets = … } or { times = … }";
const CHAIN: &str = "a table such as { p = 0.01, r = 0.1 } or { mean-good = \"160ms\", mean-bad = \"40ms\" }";

/// Reads a model of loss: a probability, or a table with one of the models.
pub(super) fn read_loss(node: &Node, context: Context<'_>) -> Option<Loss> {
    if node.as_table().is_none() {
        let probability = values::probability(node, context)?;
        return Some(if probability == Probability::ZERO { Loss::None } else { Loss::Independent(probability) });
    }
    let mut table = TableReader::new(node, context, LINK_TABLE.table("loss"), EXPECTED)?;
    let models = ["gilbert-elliott", "states", "bursts", "correlated", "packets", "times"].map(|key| table.entry(key));
    let every = table.entry("every");
    table.finish();
    let chosen = only_one(node, context, &models, EXPECTED)?;
    let value = &*chosen.node;
    // Only a pattern of chosen losses repeats, so that `every` beside another model is a mistake.
    if let Some(every) = every.filter(|_| !matches!(chosen.name.as_str(), "packets" | "times")) {
        context.fault(every.key, &every.node.path, format!("every means nothing with {}: expected it with packets or times", chosen.name));
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

/// Reads a chain of Gilbert and Elliott: per packet with `p` and `r`, or in continuous time with `mean-good` and `mean-bad`.
fn read_gilbert_elliott(node: &Node, context: Context<'_>) -> Option<Loss> {
    let mut table = TableReader::new(node, context, LINK_TABLE.table("loss.gilbert-elliott"), CHAIN)?;
    // A mean time selects the chain in continuous time. `p` and `r` beside a mean time are then refused.
    let in_time = table.get("mean-good").is_some() || table.get("mean-bad").is_some();
    let (h, k) = (table.value("h"), table.value("k"));
    if in_time {
        let (p, r) = (table.entry("p"), table.entry("r"));
        let (good, bad) = (table.value("mean-good"), table.value("mean-bad"));
        table.finish();
        if let Some(entry) = p.or(r) {
            let message =
                format!("{} and mean times exclude each other: expected either p and r, for each packet, or mean-good and mean-bad", entry.name);
            context.fault(entry.key, &entry.node.path, message);
            return None;
        }
        let chain = GilbertElliottInTime::new(good?, bad?, h?, k?);
        return chain.map(Loss::GilbertElliottInTime).map_err(|error| values::refuse(context, &[], node, &error)).ok();
    }
    let (p, r) = (table.value("p"), table.maybe_value("r"));
    table.finish();
    let p = p?;
    // As in tc, a missing r is 1 − p.
    let r = match r? {
        Some(r) => r,
        None => complement(p)?,
    };
    Some(Loss::GilbertElliott(GilbertElliott { p, r, h: h?, k: k? }))
}

/// Reads Salsano's chain of four states, with the defaults of tc.
fn read_states(node: &Node, context: Context<'_>) -> Option<FourState> {
    let mut table = TableReader::new(node, context, LINK_TABLE.table("loss.states"), "a table such as { p13 = 0.01, p31 = 0.3 }")?;
    let (p13, p31) = (table.value("p13"), table.maybe_value("p31"));
    let (p32, p23, p14) = (table.value("p32"), table.value("p23"), table.value("p14"));
    table.finish();
    let p13 = p13?;
    // As in tc, a missing p31 is 1 − p13.
    let p31 = match p31? {
        Some(p31) => p31,
        None => complement(p13)?,
    };
    FourState::new(p13, p31, p32?, p23?, p14?).map_err(|error| values::refuse(context, &[], node, &error)).ok()
}

/// Reads a chain of four states from its observable quantities: mean loss, length of bursts, density in bursts, isolated losses and length of good runs.
fn read_bursts(node: &Node, context: Context<'_>) -> Option<FourState> {
    let mut table = TableReader::new(node, context, LINK_TABLE.table("loss.bursts"), "a table such as { loss = \"2%\", length = 5 }")?;
    let (loss, length) = (table.value::<Probability>("loss"), table.value("length"));
    let [density, isolated] = ["density", "isolated"].map(|key| table.value::<Probability>(key));
    let good_run = table.value("good-run");
    table.finish();
    let bursts = Bursts { loss: loss?.get(), length: length?, density: density?.get(), isolated: isolated?.get(), good_run: good_run? };
    FourState::from_bursts(bursts).map_err(|error| values::refuse(context, &[], node, &error)).ok()
}

/// Returns 1 − p.
fn complement(p: Probability) -> Option<Probability> {
    Probability::new(1.0 - p.get()).ok()
}

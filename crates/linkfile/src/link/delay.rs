//! Readers of `delay` and `jitter`.

use core::time::Duration;

use cohaptic_wan::{Correlation, Delay, Distribution, Jitter};

use super::distribution::read_distribution;
use crate::document::Node;
use crate::link::keys::LINK_TABLE;
use crate::reading::{Context, TableReader, only_one, values};

/// Reads the delay of a link with its jitter.
pub(super) fn read_delay(table: &mut TableReader<'_>, keys: &Node, context: Context<'_>) -> Option<Delay> {
    let (delay_node, jitter_node) = (table.get("delay"), table.get("jitter"));
    let mean = table.maybe_value("delay");
    let jitter = table.maybe("jitter", read_jitter);
    let (mean, jitter) = (mean?, jitter?);
    let Some(Read { jitter, own_mean }) = jitter else { return Some(Delay::constant(mean.unwrap_or_default())) };
    // A part without a delay will be laid over a delay not known here, so jitter and mean cannot be checked together.
    if context.partial && mean.is_none() {
        return Some(Delay::default());
    }
    // The key `delay` goes before the mean of a file of delays.
    let mean = mean.or(own_mean).unwrap_or_default();
    Delay::with_jitter(mean, jitter).map_err(|error| values::refuse(context, &[delay_node, jitter_node], keys, &error)).ok()
}

/// Jitter as read.
struct Read {
    jitter: Jitter,
    /// Mean of a file of delays, used if the key `delay` is not given.
    own_mean: Option<Duration>,
}

/// Reads a jitter: a standard deviation, or a table.
fn read_jitter(node: &Node, context: Context<'_>) -> Option<Read> {
    const EXPECTED: &str = "a duration or a table such as { sd = \"2ms\", distribution = \"gamma\" }";
    if node.as_table().is_none() {
        return Some(Read { jitter: Jitter::new(values::duration(node, context)?, Distribution::Normal), own_mean: None });
    }
    let mut table = TableReader::new(node, context, LINK_TABLE.table("jitter"), EXPECTED)?;
    let sd: Option<Option<Duration>> = table.maybe_value("sd");
    let distribution = table.read("distribution", read_distribution);
    let floor = table.value("floor");
    let correlation = read_correlation(&mut table, node, context);
    let own = match &distribution {
        Some(Distribution::Empirical(delays)) => Some((nanos(delays.mean()), nanos(delays.sd()))),
        Some(_) | None => None,
    };
    // A file of delays has a standard deviation of its own, so `sd` may be missing only beside such a file.
    if distribution.is_some() && own.is_none() && sd == Some(None) {
        table.miss("sd", "the standard deviation, a duration such as \"2ms\"");
    }
    table.finish();
    let sd = sd?.or_else(|| own.map(|(_, sd)| sd));
    let jitter = Jitter { floor: floor?, correlation: correlation?, ..Jitter::new(sd.unwrap_or_default(), distribution?) };
    Some(Read { jitter, own_mean: own.map(|(mean, _)| mean) })
}

/// Reads `correlation` (per packet) or `correlation-time` with `correlation-share`. Both memories together are a fault.
fn read_correlation(table: &mut TableReader<'_>, node: &Node, context: Context<'_>) -> Option<Correlation> {
    let (per_packet, in_time) = (table.entry("correlation"), table.entry("correlation-time"));
    table.only_if(
        in_time.is_some(),
        "correlation-share",
        "correlation-share means nothing without a memory in time: expected a key correlation-time too",
    )?;
    let share: Option<f64> = table.value("correlation-share");
    if per_packet.is_none() && in_time.is_none() {
        return Some(Correlation::None);
    }
    let chosen = only_one(node, context, &[per_packet, in_time], "correlation and correlation-time")?;
    if chosen.name == "correlation" {
        let correlation = values::of_key(table.key("correlation"), &chosen.node, context)?;
        return Some(if correlation == 0.0 { Correlation::None } else { Correlation::PerPacket(correlation) });
    }
    let time = values::of_key(table.key("correlation-time"), &chosen.node, context);
    // One memory of the whole variation has one form, whether the file says so or not.
    let (time, share) = (time?, share?);
    Some(if share < 1.0 { Correlation::PartlyInTime { time, share } } else { Correlation::InTime(time) })
}

/// Rounds nanoseconds to a duration. The delays of a file lie between 0 and 9·10¹⁸ ns, and so do mean and standard deviation.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "moments of numbers from 0 to 9e18")]
fn nanos(value: f64) -> Duration {
    Duration::from_nanos(value.round() as u64)
}

//! `token-bucket`: how much may leave in bursts.

use cohaptic_wan::{Framing, Peak, TokenBucket};

use super::is_none;
use super::queue::read_limit;
use crate::document::Node;
use crate::reading::{Context, TableReader, values};

/// `None` for "none".
pub(super) fn read_token_bucket(node: &Node, context: Context<'_>) -> Option<Option<TokenBucket>> {
    if is_none(node) {
        return Some(None);
    }
    let mut table = TableReader::new(node, context, "\"none\" or a table such as { rate = \"1Mbit\", burst = \"10kB\" }")?;
    let rate = table.required("rate", "how fast the bucket fills, a rate such as \"1Mbit\"", values::rate);
    let burst = table.required("burst", "what the bucket holds, a size such as \"10kB\"", values::size);
    let peak = table.maybe("peak", read_peak);
    let limit = table.optional("limit", None, read_limit);
    let overhead = table.optional("overhead", 0, values::signed_size);
    table.finish();
    let framing = Framing { overhead: overhead?, cells: None };
    Some(Some(TokenBucket { rate: rate?, burst: burst?, peak: peak?, framing, limit: limit? }))
}

fn read_peak(node: &Node, context: Context<'_>) -> Option<Peak> {
    let mut table = TableReader::new(node, context, "a table such as { rate = \"2Mbit\", burst = \"1500B\" }")?;
    let rate = table.required("rate", "how fast a burst leaves, a rate such as \"2Mbit\"", values::rate);
    let burst = table.required("burst", "at least the largest packet, a size such as \"1500B\"", values::size);
    table.finish();
    Some(Peak { rate: rate?, burst: burst? })
}

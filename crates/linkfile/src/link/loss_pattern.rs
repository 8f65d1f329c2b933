//! Readers of chosen losses: packets by number, or packets by the time of sending.

use core::ops::Range;

use cohaptic_wan::{Outage, Pattern, PatternError};

use super::outage::read_span;
use crate::document::{Node, Value, quote};
use crate::reading::{Context, values};

const NUMBERS: &str = "a list of packets counted from 0, such as [3, \"10-19\"]";

/// Reads `packets = [3, "10-19"], every = 100`: lost packets, counted from 0, and the period in packets.
pub(super) fn read_lost_packets(node: &Node, every: Option<&Node>, context: Context<'_>) -> Option<Pattern> {
    let elements = values::list(node, context, NUMBERS)?;
    let spans: Vec<Option<Range<u64>>> = elements.iter().map(|element| read_numbers(element, context)).collect();
    // The period is read before the elements are judged, so that the fault that stands first in the text is found.
    let period = every.map(|every| values::integer(every, context, 1..=i64::MAX.unsigned_abs(), "a number of packets of at least 1"));
    let spans = spans.into_iter().collect::<Option<Vec<_>>>()?;
    let period = match period {
        Some(period) => Some(period?),
        None => None,
    };
    Pattern::of_packets(spans, period).map_err(|error| refuse(&error, node, &elements, every, context)).ok()
}

/// Reads `times = [{ from = "1s", to = "2s" }], every = "5s"`: spans of time with losses, and the period.
pub(super) fn read_lost_times(node: &Node, every: Option<&Node>, context: Context<'_>) -> Option<Pattern> {
    let elements = values::list(node, context, "a list such as [{ from = \"1s\", to = \"2s\" }]")?;
    let spans: Vec<Option<Outage>> = elements.iter().map(|element| read_span(element, context)).collect();
    let period = every.map(|every| values::positive_duration(every, context));
    let spans = spans.into_iter().map(|span| span.map(|span| span.from..span.to)).collect::<Option<Vec<_>>>()?;
    let period = match period {
        Some(period) => Some(period?),
        None => None,
    };
    Pattern::in_time(&spans, period).map_err(|error| refuse(&error, node, &elements, every, context)).ok()
}

/// Reads the number of a packet, or the first and the last of a row of packets.
fn read_numbers(node: &Node, context: Context<'_>) -> Option<Range<u64>> {
    const EXPECTED: &str = "the number of a packet such as 3, or the first and the last of a row such as \"10-19\"";
    if let Value::Text(text) = &node.value {
        let span = read_range(text);
        if span.is_none() {
            context.fault_at(node, format!("{} is not a row of packets: expected {EXPECTED}", quote(text)));
        }
        return span;
    }
    values::integer(node, context, 0..=i64::MAX.unsigned_abs(), EXPECTED).map(|number| number..number + 1)
}

/// Parses `10-19`, both ends included, or `7` as a range of numbers. Returns `None` for any other text, and if the last number is below the first.
pub(super) fn read_range(text: &str) -> Option<Range<u64>> {
    // `parse` also takes a sign, so the digits are checked here.
    let number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse::<u64>().ok()).flatten();
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let (first, last) = (number(first.trim())?, number(last.trim())?);
    // The end of the range is the number after `last`, and must fit into 64 bits too.
    (first <= last).then(|| Some(first..last.checked_add(1)?)).flatten()
}

/// Reports the refusal of a pattern, at the blamed element or period.
fn refuse(error: &PatternError, node: &Node, elements: &[&Node], every: Option<&Node>, context: Context<'_>) {
    let at = match error {
        PatternError::Empty { index } | PatternError::Order { index } => elements.get(*index).copied(),
        PatternError::Period { .. } => every,
    };
    values::refuse(context, &[at], node, error);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_packets_has_both_its_ends() {
        assert_eq!(read_range("10-19"), Some(10..20));
        assert_eq!(read_range("7"), Some(7..8));
        assert_eq!(read_range(" 1 - 2 "), Some(1..3));
        for text in ["", "-", "3-", "-3", "4-3", "1-2-3", "0x1", "1-18446744073709551615", "a"] {
            assert_eq!(read_range(text), None, "{text}");
        }
    }
}

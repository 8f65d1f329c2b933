//! Reader of `netem`: a link in the words of `tc`.

use core::ops::Range;
use std::sync::Arc;

use cohaptic_wan::netem::kernel::Table;
use cohaptic_wan::netem::{Distribution, Netem, SlotGap, TableName};
use cohaptic_wan::{KernelNetem, LinkModel};

use super::distribution::{dist_fault, dist_table};
use super::is_none;
use crate::document::{Node, Place};
use crate::reading::named_file::{Fault, beside_document, read_file};
use crate::reading::{Context, TableReader, values};

/// Reads the link described by `netem` and `netem-profile`. Returns `Some(None)` if the table has no words of tc.
pub(super) fn read_netem(table: &mut TableReader<'_>, context: Context<'_>) -> Option<Option<LinkModel>> {
    let profile_entry = table.entry("netem-profile");
    let profile: Option<&str> = table.value("netem-profile");
    let Some(node) = table.get("netem").filter(|node| !is_none(node)) else {
        // A profile beside `netem = "none"` may be inherited and is ignored. A profile without any key `netem` is a mistake.
        if let Some(entry) = profile_entry.filter(|_| !context.partial && table.get("netem").is_none()) {
            context.fault(entry.key, &entry.node.path, "netem-profile means nothing without words: expected a key netem too");
            return None;
        }
        return profile.map(|_| None);
    };
    let words = values::text(node, context, "the words of tc-netem such as \"delay 20ms 5ms loss 1%\"")?;
    let netem = match Netem::parse(words) {
        Ok(netem) => netem,
        Err(error) => {
            let message = with_expectation(error.to_string());
            context.fault(place_of_word(node, words, &error.span, context), &node.path, message);
            return None;
        }
    };
    if profile? == "exact" { read_exact(node, words, &netem, context) } else { read_kernel(node, netem, context) }.map(Some)
}

/// Returns the place of a word of tc in the source text. `span` counts bytes within `words`. If the value is written with escapes, the place of the whole
/// value is returned.
fn place_of_word(node: &Node, words: &str, span: &Range<usize>, context: Context<'_>) -> Place {
    let source = context.sources.text_of(node.place);
    let written = source.get(node.place.start..node.place.end).unwrap_or_default();
    // Without escapes the words stand literally between the quotes, so an offset in the words is an offset in the source.
    match written.find(words) {
        Some(offset) => {
            let start = node.place.start + offset;
            Place::new(node.place.source, start + span.start..start + span.end)
        }
        None => node.place,
    }
}

/// Reads the words with the profile `exact`: a link with the laws of the words, and without the rounding of the kernel.
fn read_exact(node: &Node, words: &str, netem: &Netem, context: Context<'_>) -> Option<LinkModel> {
    let mut complete = true;
    let config = netem.to_link_config(&mut |name: &TableName| {
        let table = read_table(node, name, "dist", context, dist_table);
        complete &= table.is_some();
        table
    });
    match config {
        Ok(config) => complete.then_some(LinkModel::Fixed(config)),
        Err(error) => {
            let message = with_expectation(error.to_string());
            let place = option_span(words, error.option()).map_or(node.place, |span| place_of_word(node, words, &span, context));
            // The fault of a missing or wrong table has been reported, and the error only follows from the missing table.
            if complete {
                context.fault(place, &node.path, message);
            }
            None
        }
    }
}

/// Returns the bytes of an option in the words of tc, which may abbreviate the option.
fn option_span(words: &str, option: &str) -> Option<Range<usize>> {
    let mut end = 0;
    words.split_whitespace().find_map(|word| {
        // The search begins after the previous word, so that an earlier word that contains the same letters is not found.
        let start = end + words.get(end..)?.find(word)?;
        end = start + word.len();
        option.starts_with(word).then_some(start..end)
    })
}

/// Adds an expected text to a message without one.
fn with_expectation(message: String) -> String {
    if message.contains("expected") { message } else { format!("{message}: expected words of tc-netem that can be meant together") }
}

/// Reads the words with the profile of the kernel: a link that repeats the arithmetic of the kernel.
fn read_kernel(node: &Node, netem: Netem, context: Context<'_>) -> Option<LinkModel> {
    let delay = netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref()).and_then(|jitter| jitter.distribution.as_ref());
    let slot = netem.slot.as_ref().and_then(|slot| match &slot.gap {
        SlotGap::Drawn { distribution, .. } => Some(distribution),
        SlotGap::Range { .. } => None,
    });
    let mut tables = Vec::new();
    for distribution in [delay, slot].into_iter().flatten() {
        if let Distribution::Table(name) = distribution {
            let table = read_table(node, name, "kernel", context, |text| Table::parse(text).map(Arc::new).map_err(|error| dist_fault(text, &error)))?;
            tables.push((name.clone(), (*table).clone()));
        }
    }
    KernelNetem::new(netem, tables).map(LinkModel::Kernel).map_err(|error| values::refuse(context, &[], node, &error)).ok()
}

/// Reads the file `NAME.dist` in the folder of the document.
fn read_table<T: Clone + 'static>(
    node: &Node,
    name: &TableName,
    form: &str,
    context: Context<'_>,
    parse: impl FnOnce(&str) -> Result<T, Fault>,
) -> Option<T> {
    let path = beside_document(context, &format!("{}.dist", name.as_str()));
    read_file(node, context, &path, form, parse)
}

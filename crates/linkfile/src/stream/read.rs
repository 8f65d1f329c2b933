//! Reader of the keys of a stream.

use core::num::NonZeroU64;
use core::time::Duration;
use std::path::Path;

use cohaptic_units::{Bytes, Probability};
use cohaptic_wan::parameters::Key;

use super::keys::{FAULTS, STREAM};
use super::{Faults, Hit, Refused, Slice, Stall, StreamConfig};
use crate::document::{BEGINNING, Entry, FileError, Node, Sources};
use crate::link::keys::LINK_TABLE;
use crate::link::read_link;
use crate::mesh::link_keys::LinkKeys;
use crate::reading::{Context, FileReader, TableReader, parse_with, values};

/// Reads a stream from the keys of its table. `folder` is the folder of files named by the keys, and `reader` reads these files.
///
/// # Errors
///
/// [`FileError`], whose [`override_text`](crate::Diagnostic::override_text) is `link.KEY=VALUE` of the key with the fault.
pub fn stream_of_keys(keys: &LinkKeys, folder: &Path, reader: FileReader<'_>) -> Result<StreamConfig, FileError> {
    let overrides: Vec<String> = keys.iter().map(|(key, value)| format!("link.{key}={value}")).collect();
    let file = folder.join("link.toml");
    let parsed = parse_with(Sources { file: &file, text: "", overrides: &overrides }, reader, |document, context| {
        let nothing = Node::empty_table(BEGINNING, "link".to_owned());
        let link = document.as_table().and_then(|table| table.get("link")).map_or(&nothing, |entry| &*entry.node);
        read_stream(link, context)
    })?;
    Ok(parsed.whole)
}

/// Reads the keys of a stream. Returns `None` after a reported fault.
pub(crate) fn read_stream(node: &Node, context: Context<'_>) -> Option<StreamConfig> {
    // Keys of a link that a stream cannot have do not count as unknown keys: the message says why a stream cannot have the key, and what to do.
    let is_refused = |name: &str| STREAM.key(name).is_none().then(|| LINK_TABLE.key(name)).flatten();
    let refused: Vec<(&Entry, Refused)> =
        node.as_table().map_or(&[][..], |table| &table.0).iter().filter_map(|entry| Some((entry, Refused(is_refused(&entry.name)?.name)))).collect();
    refused.iter().for_each(|(entry, refused)| context.fault(entry.key, &entry.node.path, refused.to_string()));
    let without = node.without(&refused.iter().map(|(_, refused)| refused.0).collect::<Vec<_>>());
    let read = read_keys(&without, context)?;
    refused.is_empty().then_some(read)
}

/// Reads the declared keys of a stream.
fn read_keys(node: &Node, context: Context<'_>) -> Option<StreamConfig> {
    let mut table = TableReader::new(node, context, &STREAM, "a table such as { delay = \"24ms\", stall = \"2s\" }")?;
    table.know_all();
    let buffer = table.maybe("buffer", |node, context| some_size(node, context).map(|size| Bytes::new(size.get())));
    let close_after = read_hit(&mut table, "close-after", "after", values::duration, |_, after| Some(after));
    let reset_after = read_hit(&mut table, "reset-after", "after", values::duration, |_, after| Some(after));
    let stall = read_hit(&mut table, "stall", "after", values::duration, |table, after| {
        let length = table.map_or(Some(None), |table| table.maybe_value("length"))?;
        Some(Stall { after, length })
    });
    let slice = read_hit(&mut table, "slice", "size", some_size, read_slice);
    let cut_after = read_hit(&mut table, "cut-after", "size", values::size, |_, size| Some(size));
    let slow_close = read_hit(&mut table, "slow-close", "time", values::duration, |_, time| Some(time));
    table.finish();
    // The reader of links refuses the keys of faults, which are no keys of a link.
    let faults: Vec<&str> = FAULTS.iter().map(|key| key.name).collect();
    let link = read_link(&node.without(&faults), context);
    let faults =
        Faults { close_after: close_after?, reset_after: reset_after?, stall: stall?, slice: slice?, cut_after: cut_after?, slow_close: slow_close? };
    match StreamConfig::new(&link?) {
        Ok(stream) => Some(StreamConfig { buffer: buffer?, faults, ..stream }),
        Err(refused) => {
            // Words of tc and links of the library say several parts under one key.
            let blamed = [refused.0, "netem", "profile"].into_iter().find_map(|key| node.as_table()?.get(key));
            match blamed {
                Some(entry) => context.fault(entry.key, &entry.node.path, refused.to_string()),
                None => context.fault_at(node, refused.to_string()),
            }
            None
        }
    }
}

/// Reads a size above zero.
fn some_size(node: &Node, context: Context<'_>) -> Option<NonZeroU64> {
    let size = NonZeroU64::new(values::size(node, context)?.get());
    if size.is_none() {
        context.fault_at(node, "out of range: expected at least \"1B\"");
    }
    size
}

/// Reads the further keys of a slice of the mean size `size`.
fn read_slice(table: Option<&mut TableReader<'_>>, size: NonZeroU64) -> Option<Slice> {
    let Some(table) = table else { return Some(Slice { size, variation: 0, gap: Duration::ZERO }) };
    let (variation, gap) = (table.value::<Bytes>("variation"), table.value("gap"));
    let variation = variation?.get();
    table.only_if(variation < size.get(), "variation", "out of range: expected less than the size of a piece")?;
    Some(Slice { size, variation, gap: gap? })
}

/// Reads a fault: `none`, a single value, or a table with the value under the key `first`, with the share, and with the keys that `rest` reads.
fn read_hit<V, T>(
    table: &mut TableReader<'_>,
    name: &'static str,
    first: &'static str,
    value: fn(&Node, Context<'_>) -> Option<V>,
    rest: impl FnOnce(Option<&mut TableReader<'_>>, V) -> Option<T>,
) -> Option<Option<Hit<T>>> {
    let declared: &'static Key = table.key(name);
    let read = table.maybe(name, |node, context| {
        if node.as_text() == Some("none") {
            return Some(None);
        }
        let Some(inner) = declared.form.table().filter(|_| node.as_table().is_some()) else {
            return Some(Some(Hit { fault: rest(None, value(node, context)?)?, share: Probability::ONE }));
        };
        let mut table = TableReader::new(node, context, inner, "a table")?;
        let found = table.read(first, value);
        let share = table.value("for");
        let fault = found.and_then(|found| rest(Some(&mut table), found));
        if fault.is_none() {
            // A missing value must not make the further keys unknown.
            table.know_all();
        }
        table.finish();
        Some(Some(Hit { fault: fault?, share: share? }))
    })?;
    Some(read.flatten())
}

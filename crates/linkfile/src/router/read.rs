//! From texts to router files.

use std::path::Path;

use cohaptic_units::Bytes;

use super::rules::{TARGET, read_rules, read_target};
use super::sides::{check_sides, read_side};
use super::{Memory, NamedLink, RouterFile, Target};
use crate::document::{FileError, Node, Sources, Value, quote};
use crate::link::{read_link, read_modulators};
use crate::mesh::LinkKeys;
use crate::reading::{Context, TableReader, parse, values, with_text};

impl RouterFile {
    /// Reads the file of a router. `overrides` are texts `KEY=VALUE` that replace values of the file, such as `links.wan.delay=8ms`.
    ///
    /// # Errors
    ///
    /// [`FileError::Read`] if the file, or one that it names, cannot be read; [`FileError::Invalid`] for anything else.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, FileError> {
        with_text(path, |text| Self::parse(text, path, overrides))
    }

    /// Reads it from a text. `file` stands in messages, and its folder is where files that it names are looked for.
    ///
    /// # Errors
    ///
    /// As [`RouterFile::read`]. Of several faults, the one that stands first in the text.
    pub fn parse(text: &str, file: &Path, overrides: &[String]) -> Result<Self, FileError> {
        parse(Sources { file, text, overrides }, read_document).map(|parsed| parsed.whole)
    }

    /// The place of a link in [`RouterFile::links`], by its name.
    #[must_use]
    pub fn link_index(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }
}

/// Reads every part, also after one that was refused, so that the first fault in the order of the text is found.
fn read_document(document: &Node, context: Context<'_>) -> Option<RouterFile> {
    let mut root = TableReader::new(document, context, "a table")?;
    root.know(&["router", "left", "right", "links", "rules", "modulators"]);
    let modulators = read_modulators(root.get("modulators"), context);
    let context = context.with_modulators(modulators.as_ref());
    let links = root.optional("links", Some(Vec::new()), |node, _| Some(read_links(node, context))).flatten();
    let router = root.required("router", "a table such as [router] with a default", |node, _| read_router(node, links.as_deref(), context));
    let side = "a table such as { tun = \"wan0\", addresses = [\"10.1.0.1/24\"] } or { interface = \"eth1\" }";
    let left = root.required("left", side, read_side);
    let right = root.required("right", side, |node, context| read_side(node, context).map(|side| (side, node)));
    let rules = root.optional("rules", Some(Vec::new()), |node, _| Some(read_rules(node, links.as_deref(), context))).flatten();
    root.finish();
    let (left, (right, right_node)) = (left?, right?);
    check_sides(&left, &right, right_node, context)?;
    let (seed, memory, default) = router?;
    Some(RouterFile { file: context.sources.file.to_path_buf(), seed, memory, left, right, links: links?, rules: rules?, default })
}

/// `[links]`: a table for each link. `None` where something was refused.
fn read_links(node: &Node, context: Context<'_>) -> Option<Vec<NamedLink>> {
    let Some(table) = node.as_table() else {
        context.fault_at(node, format!("found {}: expected a table for each link, such as [links.wan]", node.describe()));
        return None;
    };
    let read = table.0.iter().map(|entry| {
        let is_name = is_link_name(&entry.name);
        if !is_name {
            let message =
                format!("{} cannot be the name of a link: expected letters, digits, - and _, and neither pass nor drop", quote(&entry.name));
            context.fault(entry.key, &entry.node.path, message);
        }
        let model = read_link(&entry.node, context, &[]);
        let keys = LinkKeys::of_table(entry.node.as_table()?, context.modulators?);
        Some(NamedLink { name: is_name.then(|| entry.name.clone())?, keys, model: model? })
    });
    // Each is read, also after one that was refused.
    read.collect::<Vec<_>>().into_iter().collect()
}

fn is_link_name(name: &str) -> bool {
    const LONGEST: usize = 64;
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    (1..=LONGEST).contains(&name.len()) && name.chars().all(is_plain) && !matches!(name, "pass" | "drop")
}

/// `[router]`: the seed, the memory and the defaults.
fn read_router(node: &Node, links: Option<&[NamedLink]>, context: Context<'_>) -> Option<(u64, Memory, [Target; 2])> {
    let mut table = TableReader::new(node, context, "a table such as [router]")?;
    let seed = table
        .optional("seed", 0, |node, context| values::integer(node, context, 0..=i64::MAX.unsigned_abs(), "an integer from 0 to 9223372036854775807"));
    let memory = table.optional("memory", Memory::default(), read_memory);
    let expected = format!("{TARGET}, or {{ left-to-right = \"wan\", right-to-left = \"pass\" }}");
    let default = table.required("default", &expected, |node, context| read_default(node, links, context));
    table.finish();
    Some((seed?, memory?, default?))
}

fn read_default(node: &Node, links: Option<&[NamedLink]>, context: Context<'_>) -> Option<[Target; 2]> {
    if !matches!(node.value, Value::Table(_)) {
        return read_target(node, links, context).map(|target| [target; 2]);
    }
    let mut table = TableReader::new(node, context, TARGET)?;
    let left = table.required("left-to-right", TARGET, |node, context| read_target(node, links, context));
    let right = table.required("right-to-left", TARGET, |node, context| read_target(node, links, context));
    table.finish();
    Some([left?, right?])
}

/// `memory = { packets = 10000, bytes = "64MB" }`.
fn read_memory(node: &Node, context: Context<'_>) -> Option<Memory> {
    const MOST: u64 = 1 << 32;
    let mut table = TableReader::new(node, context, "a table such as { packets = 10000, bytes = \"64MB\" }")?;
    let default = Memory::default();
    let packets = table.optional("packets", default.packets, |node, context| {
        values::integer(node, context, 1..=MOST, "a number of packets, an integer from 1 to 4294967296")
    });
    let bytes = table.optional("bytes", default.bytes, |node, context| {
        let bytes = values::size(node, context)?;
        if bytes == Bytes::new(0) {
            context.fault_at(node, "zero is out of range: expected a size above zero such as \"64MB\"");
            return None;
        }
        Some(bytes)
    });
    table.finish();
    Some(Memory { packets: packets?, bytes: bytes? })
}

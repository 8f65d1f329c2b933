//! Reader of router files.

use std::path::Path;

use cohaptic_units::Bytes;
use cohaptic_wan::parameters::{Form, Table, optional, required, usual};

use super::rules::{RULE, TARGET, TARGET_FORM, read_rules, read_target};
use super::sides::{SIDE, check_sides, read_side};
use super::{Memory, NamedLink, RouterFile, Target};
use crate::document::{FileError, Node, Sources, Value, quote};
use crate::link::keys::{LINK_TABLE, MODULATOR};
use crate::link::{read_link, read_modulators};
use crate::mesh::LinkKeys;
use crate::reading::{Context, TableReader, defaults, parse, values, with_text};

/// Table at the top of a router file.
pub static ROOT: Table = Table::of(&[&[
    required("router", Form::Table(&ROUTER), "Seed, memory, and the way of packets to which no rule applies")
        .expecting("a table such as [router] with a default"),
    required("left", Form::Table(&SIDE), "One side: a tun or an interface").expecting(A_SIDE),
    required("right", Form::Table(&SIDE), "The other side: of the same kind as the first").expecting(A_SIDE),
    optional("links", Form::Table(&LINKS), "Links, each under its name"),
    optional("rules", Form::List(&Form::Table(&RULE)), "Ways of packets: the first rule that applies decides"),
    optional("modulators", Form::List(&Form::Table(&MODULATOR)), "Chains of states that links follow"),
]]);
const A_SIDE: &str = "a table such as { tun = \"wan0\", addresses = [\"10.1.0.1/24\"] } or { interface = \"eth1\" }";
static ROUTER: Table = Table::of(&[&[
    usual("seed", Form::Integer(0, i64::MAX.unsigned_abs()), "0", "Seed of all random numbers"),
    optional("memory", Form::Table(&MEMORY), "Limits of all links together; packets beyond them are dropped"),
    required(
        "default",
        Form::AnyOf(const { &[TARGET_FORM, Form::Table(&DEFAULT)] }),
        "Way of packets to which no rule applies: the name of a link, pass or drop",
    ),
]]);
static DEFAULT: Table = Table::of(&[&[
    required("left-to-right", TARGET_FORM, "Way of packets in this direction: the name of a link, pass or drop").expecting(TARGET),
    required("right-to-left", TARGET_FORM, "Way of packets in this direction: the name of a link, pass or drop").expecting(TARGET),
]]);
static MEMORY: Table = Table::of(&[&[
    usual("packets", Form::Integer(1, 1 << 32), "262144", "Largest number of packets").expecting("a number of packets, {}"),
    usual("bytes", Form::Size, "\"256MB\"", "Largest number of bytes"),
]]);
static LINKS: Table = Table::with_others(&[], &Form::Table(&LINK_TABLE));

impl Default for Memory {
    /// Returns the bound of a file without `memory`: 262,144 packets, about one second at 250,000 packets/s, and 256 MB.
    fn default() -> Self {
        defaults(read_memory)
    }
}

impl RouterFile {
    /// Reads a router file. `overrides` are texts `KEY=VALUE` that replace values of the file, such as `links.wan.delay=8ms`.
    ///
    /// # Errors
    ///
    /// [`FileError::Read`] if the file, or a named file, cannot be read; [`FileError::Invalid`] for any other fault.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, FileError> {
        with_text(path, |text| Self::parse(text, path, overrides))
    }

    /// Reads the text of a router file. `file` is the path for messages, and the folder of `file` is the base of files named in the text.
    ///
    /// # Errors
    ///
    /// As [`RouterFile::read`]. Of several faults, the first in the text.
    pub fn parse(text: &str, file: &Path, overrides: &[String]) -> Result<Self, FileError> {
        parse(Sources { file, text, overrides }, read_document).map(|parsed| parsed.whole)
    }

    /// Returns the index in [`RouterFile::links`] of the link with a name, or `None` if no link has the name.
    #[must_use]
    pub fn link_index(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }
}

/// Reads a router file. Every part is read, also after a refused part, so that the first fault of the text is found.
fn read_document(document: &Node, context: Context<'_>) -> Option<RouterFile> {
    let mut root = TableReader::new(document, context, &ROOT, "a table")?;
    root.know_all();
    let modulators = read_modulators(root.get("modulators"), context);
    let context = context.with_modulators(modulators.as_ref());
    // Default and rules refer to links by name, so the links are read first, whatever the order in the file.
    let links = root.maybe("links", |node, _| read_links(node, context)).map(Option::unwrap_or_default);
    let router = root.read("router", |node, _| read_router(node, links.as_deref(), context));
    let left = root.read("left", read_side);
    // The node is kept for faults about both sides together.
    let right_node = root.get("right");
    let right = root.read("right", read_side);
    let rules = root.maybe("rules", |node, _| read_rules(node, links.as_deref(), context)).map(Option::unwrap_or_default);
    root.finish();
    // Refusals count only now, after every part was read.
    let (left, right) = (left?, right?);
    check_sides(&left, &right, right_node?, context)?;
    let (seed, memory, default) = router?;
    Some(RouterFile { file: context.sources.file.to_path_buf(), seed, memory, left, right, links: links?, rules: rules?, default })
}

/// Reads `[links]`, a table for each link. Returns `None` if a link was refused.
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
        // A link with a wrong name is read too, so that the first fault of the text is found.
        let model = read_link(&entry.node, context);
        // Without modulators the list was refused, so the fault is reported already.
        let keys = LinkKeys::of_table(entry.node.as_table()?, context.modulators?);
        Some(NamedLink { name: is_name.then(|| entry.name.clone())?, keys, model: model? })
    });
    // The answers are collected twice, so that each link is read also after a refused link.
    read.collect::<Vec<_>>().into_iter().collect()
}

/// Returns whether a text can be the name of a link: 1 to 64 letters, digits, `-` and `_`, and neither `pass` nor `drop`, which are targets.
fn is_link_name(name: &str) -> bool {
    const LONGEST: usize = 64;
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    (1..=LONGEST).contains(&name.len()) && name.chars().all(is_plain) && !matches!(name, "pass" | "drop")
}

/// Reads `[router]`: the seed, the memory and the default targets, indexed by side. `links` is `None` if the links were refused.
fn read_router(node: &Node, links: Option<&[NamedLink]>, context: Context<'_>) -> Option<(u64, Memory, [Target; 2])> {
    let mut table = TableReader::new(node, context, &ROUTER, "a table such as [router]")?;
    let seed = table.value("seed");
    let memory = table.table("memory", read_memory);
    let expected = format!("{TARGET}, or {{ left-to-right = \"wan\", right-to-left = \"pass\" }}");
    let default = table.read_expecting("default", &expected, |node, context| read_default(node, links, context));
    table.finish();
    Some((seed?, memory?, default?))
}

/// Reads `default`: a target for both directions, or a table with a target per direction. The answer is indexed by the side of arrival.
fn read_default(node: &Node, links: Option<&[NamedLink]>, context: Context<'_>) -> Option<[Target; 2]> {
    // A target for both directions is the short form.
    if !matches!(node.value, Value::Table(_)) {
        return read_target(node, links, context).map(|target| [target; 2]);
    }
    let mut table = TableReader::new(node, context, &DEFAULT, TARGET)?;
    let [left, right] = ["left-to-right", "right-to-left"].map(|way| table.read(way, |node, context| read_target(node, links, context)));
    table.finish();
    Some([left?, right?])
}

/// Reads `memory = { packets = 10000, bytes = "64MB" }`.
fn read_memory(node: &Node, context: Context<'_>) -> Option<Memory> {
    let mut table = TableReader::new(node, context, &MEMORY, "a table such as { packets = 10000, bytes = \"64MB\" }")?;
    let packets = table.value("packets");
    let bytes = table.read("bytes", |node, context| {
        let bytes = values::size(node, context)?;
        // The form of a size allows zero, and a router without memory would drop every packet.
        if bytes == Bytes::new(0) {
            context.fault_at(node, "zero is out of range: expected a size above zero such as \"64MB\"");
            return None;
        }
        Some(bytes)
    });
    table.finish();
    Some(Memory { packets: packets?, bytes: bytes? })
}

//! Relay files: which programs talk to each other in real time, through which links and ports.

mod programs;

use core::time::Duration;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::parameters::{Form, Table, optional, required, usual};

use crate::document::{FileError, Node, Sources};
use crate::link::read_modulators;
use crate::mesh::{KeysOfLinks, LinkChange, LinkClasses, LinkSelector, LinkTable, pairs, read_key_changes, read_links, read_links_between};
use crate::reading::{Context, TableReader, default_title, defaults, parse, values, with_text};
use crate::schema::link::{LINK_CHANGE, LINK_ENTRY, LINK_TABLE, LINKS_BETWEEN, MODULATOR};

/// What `cohaptic relay FILE` does. Every number in it has been checked.
///
/// ```
/// use std::path::Path;
/// use cohaptic_linkfile::RelayFile;
///
/// let text = r#"
///     programs = [
///         { name = "left",  port = "127.0.0.1:7001", address = "127.0.0.1:9001" },
///         { name = "right", port = "127.0.0.1:7002" },
///     ]
///     link  = { delay = "24ms", loss = "1%" }
///     links = [{ from = "right", to = "left", delay = "40ms" }]
/// "#;
/// let file = RelayFile::parse(text, Path::new("pair.toml"), &[])?;
/// assert_eq!(file.programs[1].port, "127.0.0.1:7002".parse().unwrap());
/// assert_eq!(file.links.between(1, 0).mean_delay().as_millis(), 40);
///
/// let error = RelayFile::parse(&text.replace("127.0.0.1:7002", "192.0.2.1:7002"), Path::new("pair.toml"), &[]).unwrap_err();
/// assert!(error.to_string().contains("allow-remote"));
/// # Ok::<(), cohaptic_linkfile::FileError>(())
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct RelayFile {
    /// The file it was read from, for messages.
    pub file: PathBuf,
    /// A line for people.
    pub title: String,
    /// The seed of every random stream.
    pub seed: u64,
    /// The programs, at least two, in the order of the file. Their names and ports differ.
    pub programs: Vec<RelayProgram>,
    /// The directed links between the programs.
    pub links: LinkTable,
    /// Changes of links, in order of time; equal instants in the order of the file.
    pub timeline: Vec<RelayChange>,
    /// What it may take, and how late it may be.
    pub limits: RelayLimits,
}

/// A program that takes part.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RelayProgram {
    /// Its name, which names its links too.
    pub name: String,
    /// The port that stands for it: a program that sends there speaks to it. Port 0 is a free one.
    pub port: SocketAddr,
    /// Where it sends from and listens; `None`: learnt from the first datagram that it sends.
    pub address: Option<SocketAddr>,
}

/// A link that becomes another one while the relay runs.
#[derive(Clone, PartialEq, Debug)]
pub struct RelayChange {
    /// When, counted from the beginning.
    pub at: Instant,
    /// Which, by the places of programs in [`RelayFile::programs`], and into what.
    pub link: LinkChange,
}

/// What a relay may take, and how late it may be.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RelayLimits {
    /// The most datagrams in flight at once; those beyond are dropped.
    pub packets: u64,
    /// The most bytes of them.
    pub bytes: Bytes,
    /// An address that was learnt, or a client, is forgotten when it has been silent for so long.
    pub forget_after: Duration,
    /// Later than this is late: more than one late in a thousand, and the run was not valid.
    pub tolerance: Duration,
}

impl Default for RelayLimits {
    /// Those of a file that does not say them: 262,144 datagrams, 64 MB, 30 s, 1 ms.
    fn default() -> Self {
        defaults(|node, context| read_header(node, context)?.limits)
    }
}

/// The top of a relay file.
pub static ROOT: Table = Table::of(&[&[
    optional("relay", Form::Table(&RELAY), "Seed and limits"),
    required("programs", Form::List(&Form::Table(&programs::PROGRAM)), "The programs, at least two")
        .expecting("at least two entries [[programs]], each with a name and a port"),
    optional("modulators", Form::List(&Form::Table(&MODULATOR)), "Chains of states that links follow"),
    optional("link", Form::Table(&LINK_TABLE), "Holds for every link that does not say otherwise; without it links are ideal"),
    optional("links", Form::List(&Form::Table(&LINK_ENTRY)), "One direction of one pair each: its own keys are laid over those of [link]"),
    optional("timeline", Form::List(&Form::Table(&TIMELINE)), "Changes while the relay runs"),
]]);
static RELAY: Table = Table::of(&[&[
    optional("title", Form::Text, "A line for people; without it the name of the file"),
    usual("seed", Form::Integer(0, i64::MAX.unsigned_abs()), "0", "Seed of all random numbers"),
    usual("allow-remote", Form::Boolean, "false", "Whether ports and addresses may be on other machines"),
    // Each takes at least a hundred bytes.
    usual("most-packets", Form::Integer(1, 1 << 24), "262144", "The most datagrams in flight at once").expecting("a number of datagrams, {}"),
    usual("most-bytes", Form::Size, "\"64MB\"", "The most bytes of datagrams in flight at once"),
    usual("forget-after", Form::PositiveDuration, "\"30s\"", "A learnt address that is silent for so long may be replaced"),
    usual("tolerance", Form::PositiveDuration, "\"1ms\"", "Later than this is late"),
]]);
static TIMELINE: Table = Table::of(&[&[
    required("at", Form::Duration, "When, from the beginning").expecting("a time such as \"3s\""),
    required("link", LINKS_BETWEEN, "Which links change: all, or one by its ends")
        .expecting("\"all\" or a table such as { from = \"left\", to = \"right\" }"),
    required("set", Form::Table(&LINK_CHANGE), "The keys that change"),
]]);

impl RelayFile {
    /// Reads a relay file. `overrides` are texts `KEY=VALUE` that replace values of the file, in this order.
    ///
    /// # Errors
    ///
    /// [`FileError::Read`] if the file, or one that it names, cannot be read; [`FileError::Invalid`] for anything else.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, FileError> {
        with_text(path, |text| Self::parse(text, path, overrides))
    }

    /// Reads a text. `file` stands in messages, and its folder is where files that it names are looked for.
    ///
    /// # Errors
    ///
    /// As [`RelayFile::read`]. Of several faults, the one that stands first in the text; faults in overrides come after those in the text.
    pub fn parse(text: &str, file: &Path, overrides: &[String]) -> Result<Self, FileError> {
        parse(Sources { file, text, overrides }, read_document).map(|parsed| parsed.whole.0)
    }
}

/// The keys of every directed link of a relay file as it begins, by the places of its programs: an entry `[[links]]` is laid over `[link]`.
///
/// # Errors
///
/// As [`RelayFile::read`].
pub fn relay_link_keys(path: &Path, overrides: &[String]) -> Result<KeysOfLinks, FileError> {
    with_text(path, |text| relay_link_keys_of_text(text, path, overrides))
}

/// [`relay_link_keys`] of a relay file that is a text.
///
/// # Errors
///
/// As [`RelayFile::parse`].
pub fn relay_link_keys_of_text(text: &str, file: &Path, overrides: &[String]) -> Result<KeysOfLinks, FileError> {
    parse(Sources { file, text, overrides }, read_document).map(|parsed| parsed.whole.1.keys(LinkSelector::All))
}

/// `[relay]`. A field is `None` where it was refused.
#[derive(Debug, Default)]
struct Header {
    /// `Some(None)`: not given.
    title: Option<Option<String>>,
    seed: Option<u64>,
    allow_remote: Option<bool>,
    limits: Option<RelayLimits>,
}

fn read_document(document: &Node, context: Context<'_>) -> Option<(RelayFile, LinkClasses)> {
    let mut root = TableReader::new(document, context, &ROOT, "a table")?;
    root.know_all();
    let header = root.table("relay", read_header).unwrap_or_default();
    let programs_node = root.get("programs");
    let programs = root.read("programs", |node, context| programs::read_programs(node, header.allow_remote, context));
    let (names, programs) = programs.unzip();
    let context = context.with_names(names.as_ref());
    let modulators = read_modulators(root.get("modulators"), context);
    let context = context.with_modulators(modulators.as_ref());
    let links = read_links(root.get("link"), root.get("links"), context);
    let timeline = read_timeline(root.get("timeline"), links.as_ref(), context);
    root.finish();
    if let (Some(names), Some(node)) = (&names, programs_node) {
        programs::check_enough(names, node, context);
    }
    let links = links?;
    let relay = RelayFile {
        file: context.sources.file.to_path_buf(),
        title: header.title?.unwrap_or_else(|| default_title(context.sources.file)),
        seed: header.seed?,
        programs: programs?,
        links: links.table()?,
        timeline: timeline?,
        limits: header.limits?,
    };
    Some((relay, links))
}

fn read_header(node: &Node, context: Context<'_>) -> Option<Header> {
    let mut table = TableReader::new(node, context, &RELAY, "a table such as [relay]")?;
    let title = table.maybe("title", |node, context| values::text(node, context, "a text").map(str::to_owned));
    let (seed, allow_remote, packets) = (table.value("seed"), table.value("allow-remote"), table.value("most-packets"));
    let bytes = table.read("most-bytes", |node, context| {
        let size = values::size(node, context)?;
        if size.get() < LEAST_BYTES {
            context.fault_at(node, "out of range: expected at least \"65535B\", one datagram");
            return None;
        }
        Some(size)
    });
    let (forget_after, tolerance) = (table.value("forget-after"), table.value("tolerance"));
    table.finish();
    let limits = packets.zip(bytes).zip(forget_after).zip(tolerance);
    let limits = limits.map(|(((packets, bytes), forget_after), tolerance)| RelayLimits { packets, bytes, forget_after, tolerance });
    Some(Header { title, seed, allow_remote, limits })
}

const LEAST_BYTES: u64 = 65_535;

/// Reads `[\[timeline\]]`, the links that become other ones while the relay runs, and puts the changes in order of time. `links`: how things stand at the beginning; `None` if they were refused.
fn read_timeline(node: Option<&Node>, links: Option<&LinkClasses>, context: Context<'_>) -> Option<Vec<RelayChange>> {
    let Some(node) = node else { return Some(Vec::new()) };
    let entries = values::list(node, context, "entries [[timeline]]")?;
    let planned: Vec<_> = entries.iter().map(|entry| read_entry(entry, context)).collect();
    let mut planned: Vec<(Instant, LinkSelector, &Node)> = planned.into_iter().collect::<Option<_>>()?;
    // Stable: equal instants stay in the order of the file.
    planned.sort_by_key(|(at, ..)| *at);
    let mut links = links?.clone();
    let mut changes = Vec::new();
    for (at, selector, set) in planned {
        if let LinkSelector::Between { from, to } = selector {
            changes.push(RelayChange { at, link: links.change((from, to), set, context)? });
            continue;
        }
        let table = links.change_all(set, context)?;
        let all = pairs(table.peers()).map(|(from, to)| LinkChange { from, to, config: table.configs()[table.config_between(from, to)].clone() });
        changes.extend(all.map(|link| RelayChange { at, link }));
    }
    Some(changes)
}

fn read_entry<'a>(entry: &'a Node, context: Context<'a>) -> Option<(Instant, LinkSelector, &'a Node)> {
    let mut table = TableReader::new(entry, context, &TIMELINE, "a table with at, link and set")?;
    let at = table.read("at", values::instant);
    let selector = table.read("link", read_links_between);
    let set = table.get("set");
    table.require("set", "a table of the keys that change");
    table.finish();
    let set = set?;
    read_key_changes(set, context)?;
    Some((at?, selector?, set))
}

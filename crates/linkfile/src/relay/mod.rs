//! Relay files: programs talking to each other in real time, with links and ports.

mod programs;
mod tcp;

use core::time::Duration;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::parameters::{Form, Key, Table, optional, required, usual};

use crate::document::{FileError, Node, Sources};
use crate::link::keys::{LINK_CHANGE, LINK_ENTRY, LINK_TABLE, LINKS_BETWEEN, MODULATOR};
use crate::link::read_modulators;
use crate::mesh::{KeysOfLinks, LinkChange, LinkClasses, LinkSelector, LinkTable, pairs, read_key_changes, read_links, read_links_between};
use crate::reading::{Context, TableReader, default_title, defaults, parse, values, with_text};

pub use tcp::{TCP_ROOT, TcpProxy, TcpRelayFile, TcpStream};

/// Checked content of a relay file, for `cohaptic relay FILE`.
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
    /// Path of the relay file, for messages.
    pub file: PathBuf,
    /// Title for people.
    pub title: String,
    /// Seed of every random stream.
    pub seed: u64,
    /// Programs, at least two, in the order of the file. Names and ports are distinct, except that port 0 may occur more than once.
    pub programs: Vec<RelayProgram>,
    /// Directed links between the programs.
    pub links: LinkTable,
    /// Changes of links, in order of time. Changes at the same instant are in the order of the file.
    pub timeline: Vec<RelayChange>,
    /// Limits on memory, silence and lateness.
    pub limits: RelayLimits,
}

/// Program that takes part in a relay.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RelayProgram {
    /// Name of the program, a part of the names of links.
    pub name: String,
    /// Address that stands for the program: datagrams sent to this address reach the program. Port 0 lets the system choose a free port.
    pub port: SocketAddr,
    /// Address for sending and listening of the program. `None`: learnt from the first datagram of the program.
    pub address: Option<SocketAddr>,
}

/// Change of a link while the relay runs.
#[derive(Clone, PartialEq, Debug)]
pub struct RelayChange {
    /// Instant of the change, since the start of the relay.
    pub at: Instant,
    /// Changed link with the new configuration. Sender and receiver are indices in [`RelayFile::programs`].
    pub link: LinkChange,
}

/// Limits of a relay on memory, silence and lateness.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RelayLimits {
    /// Maximum number of datagrams in flight. Further datagrams are dropped.
    pub packets: u64,
    /// Maximum number of bytes in flight. Further datagrams are dropped.
    pub bytes: Bytes,
    /// Silence after which a learnt address or a client is forgotten.
    pub forget_after: Duration,
    /// Lateness above which a datagram is late. A run with more than one late datagram in a thousand is not valid.
    pub tolerance: Duration,
}

impl Default for RelayLimits {
    /// Returns the limits of a file without limits: 262,144 datagrams, 64 MB, 30 s and 1 ms.
    fn default() -> Self {
        defaults(|node, context| read_header(node, context)?.limits)
    }
}

/// Table at the top of a relay file.
pub static ROOT: Table = Table::of(&[&[
    optional("relay", Form::Table(&RELAY), "Seed and limits"),
    required("programs", Form::List(&Form::Table(&programs::PROGRAM)), "Programs, at least two")
        .expecting("at least two entries [[programs]], each with a name and a port"),
    optional("modulators", Form::List(&Form::Table(&MODULATOR)), "Chains of states that links follow"),
    optional("link", Form::Table(&LINK_TABLE), "Keys of every link that does not have them in its own table; links are ideal by default"),
    optional("links", Form::List(&Form::Table(&LINK_ENTRY)), "One direction between two peers per entry: its own keys are laid over those of [link]"),
    optional("timeline", Form::List(&Form::Table(&TIMELINE)), "Changes while the relay runs"),
]]);
static RELAY: Table = Table::of(&[&IDENTITY, &PACKETS, &BYTES, &FORGET, &TOLERANCE]);
/// Keys of the table `relay` that relays of UDP and of TCP have.
const IDENTITY: [Key; 3] = [
    optional("title", Form::Text, "Title for people; the name of the file by default"),
    usual("seed", Form::Integer(0, i64::MAX.unsigned_abs()), "0", "Seed of all random numbers"),
    usual("allow-remote", Form::Boolean, "false", "Whether ports and addresses may be on other machines"),
];
// Each datagram in flight takes at least a hundred bytes of memory, so the largest value stands for 1.7 GB.
const PACKETS: [Key; 1] = [usual("most-packets", Form::Integer(1, 1 << 24), "262144", "Largest number of datagrams in flight at once")
    .expecting("a number of datagrams, {}")];
const BYTES: [Key; 1] = [usual("most-bytes", Form::Size, "\"64MB\"", "Largest number of bytes in flight at once")];
const FORGET: [Key; 1] = [usual("forget-after", Form::PositiveDuration, "\"30s\"", "Time of silence after which a learnt address may be replaced")];
const TOLERANCE: [Key; 1] = [usual("tolerance", Form::PositiveDuration, "\"1ms\"", "Lateness up to which a datagram is on time")];
static TIMELINE: Table = Table::of(&[&[
    required("at", Form::Duration, "Time since the beginning").expecting("a time such as \"3s\""),
    required("link", LINKS_BETWEEN, "Links that change: all, or one by its ends")
        .expecting("\"all\" or a table such as { from = \"left\", to = \"right\" }"),
    required("set", Form::Table(&LINK_CHANGE), "Keys that change"),
]]);

impl RelayFile {
    /// Reads a relay file. `overrides` are texts `KEY=VALUE` that replace values of the file, in the order of application.
    ///
    /// # Errors
    ///
    /// [`FileError::Read`] if the file, or a named file, cannot be read; [`FileError::Invalid`] for any other fault.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, FileError> {
        with_text(path, |text| Self::parse(text, path, overrides))
    }

    /// Reads the text of a relay file. `file` is the path for messages, and the folder of `file` is the base of files named in the text.
    ///
    /// # Errors
    ///
    /// As [`RelayFile::read`]. Of several faults, the first in the text; faults in overrides come after faults in the text.
    pub fn parse(text: &str, file: &Path, overrides: &[String]) -> Result<Self, FileError> {
        parse(Sources { file, text, overrides }, read_document).map(|parsed| parsed.whole.0)
    }
}

/// Returns the keys of every directed link at the start of a relay, by the indices of programs. An entry `[[links]]` is laid over `[link]`.
///
/// # Errors
///
/// As [`RelayFile::parse`].
pub fn relay_link_keys_of_text(text: &str, file: &Path, overrides: &[String]) -> Result<KeysOfLinks, FileError> {
    parse(Sources { file, text, overrides }, read_document).map(|parsed| parsed.whole.1.keys(LinkSelector::All))
}

/// Content of `[relay]`. A field is `None` after a refused key.
#[derive(Debug, Default)]
struct Header {
    /// Title, or `Some(None)` if the key is not given.
    title: Option<Option<String>>,
    seed: Option<u64>,
    allow_remote: Option<bool>,
    limits: Option<RelayLimits>,
}

/// Reads a relay file. Every part is read, also after a refused part, so that the first fault of the text is found.
fn read_document(document: &Node, context: Context<'_>) -> Option<(RelayFile, LinkClasses)> {
    let mut root = TableReader::new(document, context, &ROOT, "a table")?;
    root.know_all();
    let header = root.table("relay", read_header).unwrap_or_default();
    let programs_node = root.get("programs");
    let programs = root.read("programs", |node, context| programs::read_programs(node, header.allow_remote, context));
    let (names, programs) = programs.unzip();
    // Links and timeline refer to programs and modulators, so both are read first, whatever the order in the file.
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

/// Reads `[relay]`.
fn read_header(node: &Node, context: Context<'_>) -> Option<Header> {
    let mut table = TableReader::new(node, context, &RELAY, "a table such as [relay]")?;
    let title = table.maybe("title", |node, context| values::text(node, context, "a text").map(str::to_owned));
    let (seed, allow_remote, packets) = (table.value("seed"), table.value("allow-remote"), table.value("most-packets"));
    let bytes = table.read("most-bytes", read_most_bytes);
    let (forget_after, tolerance) = (table.value("forget-after"), table.value("tolerance"));
    table.finish();
    let limits = packets.zip(bytes).zip(forget_after).zip(tolerance);
    let limits = limits.map(|(((packets, bytes), forget_after), tolerance)| RelayLimits { packets, bytes, forget_after, tolerance });
    Some(Header { title, seed, allow_remote, limits })
}

/// Reads `most-bytes`.
fn read_most_bytes(node: &Node, context: Context<'_>) -> Option<Bytes> {
    let size = values::size(node, context)?;
    if size.get() < LEAST_BYTES {
        context.fault_at(node, "out of range: expected at least \"65535B\", one datagram");
        return None;
    }
    Some(size)
}

/// Minimum of `most-bytes` \[bytes\]: the largest UDP datagram must fit.
const LEAST_BYTES: u64 = 65_535;

/// Reads `[\[timeline\]]`, the changes of links while the relay runs, and sorts the changes by time. `links` are the links at the start, or `None` if refused.
fn read_timeline(node: Option<&Node>, links: Option<&LinkClasses>, context: Context<'_>) -> Option<Vec<RelayChange>> {
    let Some(node) = node else { return Some(Vec::new()) };
    let entries = values::list(node, context, "entries [[timeline]]")?;
    // All entries are read before the first entry is used, so that the first fault of the text is found.
    let planned: Vec<_> = entries.iter().map(|entry| read_entry(entry, context)).collect();
    let mut planned: Vec<(Instant, LinkSelector, &Node)> = planned.into_iter().collect::<Option<_>>()?;
    // A stable sort keeps changes at the same instant in the order of the file.
    planned.sort_by_key(|(at, ..)| *at);
    // Each change is laid over the links after the change before. The links at the start stay as they are.
    let mut links = links?.clone();
    let mut changes = Vec::new();
    for (at, selector, set) in planned {
        if let LinkSelector::Between { from, to } = selector {
            changes.push(RelayChange { at, link: links.change((from, to), set, context)? });
            continue;
        }
        // A relay changes single links, so that a change of all links becomes a change per link.
        let table = links.change_all(set, context)?;
        let all = pairs(table.peers()).map(|(from, to)| LinkChange { from, to, config: table.configs()[table.config_between(from, to)].clone() });
        changes.extend(all.map(|link| RelayChange { at, link }));
    }
    Some(changes)
}

/// Reads an entry of the timeline: instant, selected links, and the node with the changed keys.
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

//! Files of `cohaptic exec`: hosts with their commands, and the links between the hosts.

mod hosts;

use core::time::Duration;
use std::path::{Path, PathBuf};

use cohaptic_wan::parameters::{Form, Table, optional, required, usual};

use crate::document::{FileError, Node, Sources, quote};
use crate::link::keys::{LINK_ENTRY, LINK_TABLE, MODULATOR};
use crate::link::read_modulators;
use crate::mesh::{LinkTable, read_links};
use crate::reading::{Context, TableReader, parse, with_text};

/// Checked content of a file, for `cohaptic exec FILE`.
///
/// ```
/// use std::path::Path;
/// use cohaptic_linkfile::ExecFile;
///
/// let text = r#"
///     hosts = [
///         { name = "server", command = ["python3", "-m", "http.server"], ready = "Serving" },
///         { name = "client", command = "curl http://server:8000/", main = true },
///     ]
///     link  = { delay = "24ms", loss = "1%" }
///     links = [{ from = "server", to = "client", rate = "10Mbit" }]
/// "#;
/// let file = ExecFile::parse(text, Path::new("net.toml"), &[])?;
/// assert_eq!(file.hosts[1].command, ["sh", "-c", "curl http://server:8000/"]);
/// assert_eq!(file.links.between(0, 1).mean_delay().as_millis(), 24);
///
/// let error = ExecFile::parse(&text.replace("\"server\", to", "\"sever\", to"), Path::new("net.toml"), &[]).unwrap_err();
/// assert!(error.to_string().contains("did you mean \"server\"?"));
/// # Ok::<(), cohaptic_linkfile::FileError>(())
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct ExecFile {
    /// Path of the file, for messages.
    pub file: PathBuf,
    /// Seed of every random stream.
    pub seed: u64,
    /// Lateness above which a packet is late.
    pub tolerance: Duration,
    /// Hosts, in the order of their start. At least one host with [`ExecFile::world`], otherwise at least two.
    pub hosts: Vec<ExecHost>,
    /// Name of the real world in links, or `None` if the hosts reach only each other.
    pub world: Option<String>,
    /// Directed links between the hosts, and the world after the hosts if there is one.
    pub links: LinkTable,
}

/// Host of a file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ExecHost {
    /// Name of the host, by which the other hosts find it.
    pub name: String,
    /// Command with its arguments, at least one word.
    pub command: Vec<String>,
    /// `true` if the run ends with this command, and has its status.
    pub is_main: bool,
    /// Text in a line of the command's output after which the next host may start. `None`: the next host starts at once.
    pub ready: Option<String>,
}

/// Table at the top of a file.
pub static ROOT: Table = Table::of(&[&[
    optional("exec", Form::Table(&EXEC), "Seed and the real world"),
    required("hosts", Form::List(&Form::Table(&hosts::HOST)), "Hosts, at least two, or one beside the real world")
        .expecting("entries [[hosts]], each with a name and a command"),
    optional("modulators", Form::List(&Form::Table(&MODULATOR)), "Chains of states that links follow"),
    optional("link", Form::Table(&LINK_TABLE), "Keys of every link that does not have them in its own table; links are ideal by default"),
    optional("links", Form::List(&Form::Table(&LINK_ENTRY)), "One direction between two hosts per entry: its own keys are laid over those of [link]"),
]]);
static EXEC: Table = Table::of(&[&[
    usual("seed", Form::Integer(0, i64::MAX.unsigned_abs()), "0", "Seed of all random numbers"),
    usual("tolerance", Form::PositiveDuration, "\"1ms\"", "Lateness up to which a packet is on time"),
    optional("world", Form::Text, "Name that stands for the real world in links; without it the hosts reach only each other"),
]]);

impl ExecFile {
    /// Reads a file. `overrides` are texts `KEY=VALUE` that replace values of the file, in the order of application.
    ///
    /// # Errors
    ///
    /// [`FileError::Read`] if the file, or a named file, cannot be read; [`FileError::Invalid`] for any other fault.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, FileError> {
        with_text(path, |text| Self::parse(text, path, overrides))
    }

    /// Reads the text of a file. `file` is the path for messages, and the folder of `file` is the base of files named in the text.
    ///
    /// # Errors
    ///
    /// As [`ExecFile::read`]. Of several faults, the first in the text; faults in overrides come after faults in the text.
    pub fn parse(text: &str, file: &Path, overrides: &[String]) -> Result<Self, FileError> {
        parse(Sources { file, text, overrides }, read_document).map(|parsed| parsed.whole)
    }
}

/// Content of `[exec]`. A field is `None` after a refused key.
#[derive(Default)]
struct Header<'a> {
    seed: Option<u64>,
    tolerance: Option<Duration>,
    /// Name of the world with its node, or `Some(None)` if the key is not given.
    world: Option<Option<(&'a Node, String)>>,
}

/// Reads a file. Every part is read, also after a refused part, so that the first fault of the text is found.
fn read_document(document: &Node, context: Context<'_>) -> Option<ExecFile> {
    let mut root = TableReader::new(document, context, &ROOT, "a table")?;
    root.know_all();
    let header = match root.get("exec") {
        Some(node) => read_header(node, context).unwrap_or_default(),
        None => Header { seed: Some(0), tolerance: Some(Duration::from_millis(1)), world: Some(None) },
    };
    let hosts_node = root.get("hosts");
    let (mut names, hosts) = root.read("hosts", hosts::read_hosts).unzip();
    let world = header.world.flatten();
    // The world comes after the hosts, so that a host and its links have one index.
    if let (Some(names), Some((node, name))) = (&mut names, &world)
        && !names.push(name)
    {
        context.fault_at(node, format!("there is a host {} already: expected another name", quote(name)));
        return None;
    }
    if let (Some(names), Some(node)) = (&names, hosts_node)
        && names.len() < 2
    {
        context.fault_at(node, "one host alone has no link: expected at least two entries [[hosts]], or world = \"world\" under [exec]".to_owned());
    }
    // Links refer to hosts and modulators, so both are read first, whatever the order in the file.
    let context = context.with_names(names.as_ref());
    let modulators = read_modulators(root.get("modulators"), context);
    let context = context.with_modulators(modulators.as_ref());
    let links = read_links(root.get("link"), root.get("links"), context);
    root.finish();
    Some(ExecFile {
        file: context.sources.file.to_path_buf(),
        seed: header.seed?,
        tolerance: header.tolerance?,
        hosts: hosts?,
        world: world.map(|(_, name)| name),
        links: links?.table()?,
    })
}

/// Reads `[exec]`.
fn read_header<'a>(node: &'a Node, context: Context<'a>) -> Option<Header<'a>> {
    let mut table = TableReader::new(node, context, &EXEC, "a table such as [exec]")?;
    let (seed, tolerance) = (table.value("seed"), table.value("tolerance"));
    let world = table.maybe("world", |node, context| Some((node, hosts::read_name(node, context)?)));
    table.finish();
    Some(Header { seed, tolerance, world })
}

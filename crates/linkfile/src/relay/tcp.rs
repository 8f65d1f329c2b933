//! Relay files for TCP: proxies, each with a listening address, the address of a program, and the streams in both directions.

use core::time::Duration;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use cohaptic_units::Bytes;
use cohaptic_wan::parameters::{Form, Table, optional, required};

use super::programs::{read_address, read_name};
use super::{BYTES, IDENTITY, TOLERANCE, read_most_bytes};
use crate::document::{FileError, Node, Sources};
use crate::mesh::LinkKeys;
use crate::reading::{Context, Names, TableReader, default_title, parse, values, with_text};
use crate::stream::keys::STREAM;
use crate::stream::{StreamConfig, read_stream};

/// Checked content of a relay file for TCP, for `cohaptic relay --tcp FILE`.
///
/// ```
/// use std::path::Path;
/// use cohaptic_linkfile::TcpRelayFile;
///
/// let text = r#"
///     [[proxies]]
///     name   = "store"
///     listen = "127.0.0.1:7379"
///     to     = "127.0.0.1:6379"
///     forth  = { delay = "20ms", stall = { after = "2s", for = "10%" } }
///     back   = { delay = "20ms", rate = "10Mbit" }
/// "#;
/// let file = TcpRelayFile::parse(text, Path::new("store.toml"), &[])?;
/// assert_eq!(file.proxies[0].back.config.line().delay.mean().as_millis(), 20);
///
/// let error = TcpRelayFile::parse(&text.replace("rate = \"10Mbit\"", "loss = \"1%\""), Path::new("store.toml"), &[]).unwrap_err();
/// assert!(error.to_string().contains("cohaptic exec"));
/// # Ok::<(), cohaptic_linkfile::FileError>(())
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct TcpRelayFile {
    /// Title for people.
    pub title: String,
    /// Folder of the file, in which files named by keys are looked for.
    pub folder: PathBuf,
    /// Seed of every random stream.
    pub seed: u64,
    /// Proxies, at least one, in the order of the file. Names and listening addresses are distinct, except that port 0 may occur more than once.
    pub proxies: Vec<TcpProxy>,
    /// Bytes that the relay holds at most.
    pub most_bytes: Bytes,
    /// Lateness above which a write is late. A run with more than one late write in a thousand is not valid.
    pub tolerance: Duration,
}

/// Proxy of a relay for TCP.
#[derive(Clone, PartialEq, Debug)]
pub struct TcpProxy {
    /// Name of the proxy, a part of the names of links.
    pub name: String,
    /// Address for clients. Port 0 lets the system choose a free port.
    pub listen: SocketAddr,
    /// Address of the program that clients speak to.
    pub to: SocketAddr,
    /// Stream from the clients to the program.
    pub forth: TcpStream,
    /// Stream from the program to the clients.
    pub back: TcpStream,
}

/// Stream with its keys.
#[derive(Clone, PartialEq, Debug)]
pub struct TcpStream {
    /// Checked configuration.
    pub config: StreamConfig,
    /// Keys as written, for live control.
    pub keys: LinkKeys,
}

/// Table at the top of a relay file for TCP.
pub static TCP_ROOT: Table = Table::of(&[&[
    optional("relay", Form::Table(&RELAY), "Seed and limits"),
    required("proxies", Form::List(&Form::Table(&PROXY)), "Proxies, at least one")
        .expecting("at least one entry [[proxies]], with name, listen and to"),
]]);
static RELAY: Table = Table::of(&[&IDENTITY, &BYTES, &TOLERANCE]);
static PROXY: Table = Table::of(&[&[
    required("name", Form::Text, "Name of the proxy: unique, not all, without space and without . > / , and quotes")
        .expecting("the name of the proxy"),
    required("listen", Form::Like(&["127.0.0.1:7000"]), "Address to which clients connect").expecting("an address such as \"127.0.0.1:7000\""),
    required("to", Form::Like(&["127.0.0.1:9000"]), "Address of the program that clients speak to")
        .expecting("an address such as \"127.0.0.1:9000\""),
    optional("forth", Form::Table(&STREAM), "Stream from the clients to the program; ideal by default"),
    optional("back", Form::Table(&STREAM), "Stream from the program to the clients; as forth by default"),
]]);

/// Largest number of proxies.
const MOST_PROXIES: usize = 256;

impl TcpRelayFile {
    /// Reads a relay file for TCP. `overrides` are texts `KEY=VALUE` that replace values of the file, in the order of application.
    ///
    /// # Errors
    ///
    /// [`FileError::Read`] if the file, or a named file, cannot be read; [`FileError::Invalid`] for any other fault.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, FileError> {
        with_text(path, |text| Self::parse(text, path, overrides))
    }

    /// Reads the text of a relay file for TCP. `file` is the path for messages, and the folder of `file` is the base of files named in the text.
    ///
    /// # Errors
    ///
    /// As [`TcpRelayFile::read`]. Of several faults, the first in the text; faults in overrides come after faults in the text.
    pub fn parse(text: &str, file: &Path, overrides: &[String]) -> Result<Self, FileError> {
        parse(Sources { file, text, overrides }, read_document).map(|parsed| parsed.whole)
    }
}

/// Content of `[relay]`.
struct Header {
    title: Option<String>,
    seed: u64,
    most_bytes: Bytes,
    tolerance: Duration,
}

fn read_document(document: &Node, context: Context<'_>) -> Option<TcpRelayFile> {
    let mut root = TableReader::new(document, context, &TCP_ROOT, "a table")?;
    root.know_all();
    let (allow_remote, header) = root.table("relay", |node, context| Some(read_header(node, context))).unwrap_or_default();
    let proxies = root.read("proxies", |node, context| read_proxies(node, allow_remote, context));
    root.finish();
    let Header { title, seed, most_bytes, tolerance } = header?;
    let file = context.sources.file;
    let folder = file.parent().map(Path::to_path_buf).unwrap_or_default();
    Some(TcpRelayFile { title: title.unwrap_or_else(|| default_title(file)), folder, seed, proxies: proxies?, most_bytes, tolerance })
}

/// Reads `[relay]`: whether remote addresses are allowed, and the rest. Each is `None` after a reported fault.
fn read_header(node: &Node, context: Context<'_>) -> (Option<bool>, Option<Header>) {
    let Some(mut table) = TableReader::new(node, context, &RELAY, "a table such as [relay]") else { return (None, None) };
    let title = table.maybe("title", |node, context| values::text(node, context, "a text").map(str::to_owned));
    let (seed, allow_remote) = (table.value("seed"), table.value("allow-remote"));
    let (most_bytes, tolerance) = (table.read("most-bytes", read_most_bytes), table.value("tolerance"));
    table.finish();
    let header = title.zip(seed).zip(most_bytes).zip(tolerance);
    (allow_remote, header.map(|(((title, seed), most_bytes), tolerance)| Header { title, seed, most_bytes, tolerance }))
}

fn read_proxies(node: &Node, allow_remote: Option<bool>, context: Context<'_>) -> Option<Vec<TcpProxy>> {
    let entries = values::list(node, context, "entries [[proxies]]")?;
    if entries.is_empty() || entries.len() > MOST_PROXIES {
        context.fault_at(node, format!("{} proxies: expected 1 to {MOST_PROXIES} entries [[proxies]]", entries.len()));
        return None;
    }
    let mut names = Names::of("proxy");
    // Collected as options first, so that each entry is read also after a refused entry.
    let read: Vec<Option<TcpProxy>> = entries.iter().map(|entry| read_proxy(entry, allow_remote, &mut names, context)).collect();
    let proxies: Vec<TcpProxy> = read.into_iter().collect::<Option<_>>()?;
    for (place, proxy) in proxies.iter().enumerate() {
        let taken = proxies[..place].iter().find(|other| other.listen == proxy.listen && proxy.listen.port() != 0);
        if let Some(other) = taken {
            context.fault_at(entries[place], format!("{} is the address of proxy {} already: expected another one", proxy.listen, other.name));
            return None;
        }
    }
    Some(proxies)
}

fn read_proxy(entry: &Node, allow_remote: Option<bool>, names: &mut Names, context: Context<'_>) -> Option<TcpProxy> {
    const EXPECTED: &str = "an address with a port, such as \"127.0.0.1:9000\", \"[::1]:9000\" or \"localhost:9000\"";
    let mut table = TableReader::new(entry, context, &PROXY, "a table with name, listen and to")?;
    let name = table.read("name", |node, context| read_name(node, names, context));
    let listen = table.read("listen", |node, context| read_address(node, EXPECTED, allow_remote, context));
    let to = table.read("to", |node, context| {
        let address = read_address(node, EXPECTED, allow_remote, context)?;
        if address.port() == 0 {
            context.fault_at(node, format!("no program can be reached at {address}: expected {EXPECTED}, with a port above zero"));
            return None;
        }
        Some(address)
    });
    let stream = |node: &Node, context: Context<'_>| {
        let config = read_stream(node, context)?;
        let keys = LinkKeys::of_table(node.as_table()?, &Default::default());
        Some(TcpStream { config, keys })
    };
    let forth = table.maybe("forth", stream);
    let back = table.maybe("back", stream);
    table.finish();
    let forth = forth?.unwrap_or_else(|| TcpStream { config: StreamConfig::default(), keys: LinkKeys::default() });
    let back = back?.unwrap_or_else(|| forth.clone());
    Some(TcpProxy { name: name?, listen: listen?, to: to?, forth, back })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = r#"
        relay = { seed = 7, most-bytes = "1MB" }
        [[proxies]]
        name = "store"
        listen = "127.0.0.1:7379"
        to = "127.0.0.1:6379"
        forth = { delay = "20ms", close-after = "3s" }
        [[proxies]]
        name = "web"
        listen = "127.0.0.1:7080"
        to = "127.0.0.1:8080"
        back = { rate = "1Mbit", buffer = "10kB" }
    "#;

    fn parse(text: &str, overrides: &[String]) -> Result<TcpRelayFile, FileError> {
        TcpRelayFile::parse(text, Path::new("lab/two.toml"), overrides)
    }

    #[test]
    fn answers_pass_the_stream_of_requests_unless_the_file_says_otherwise() {
        let file = parse(TWO, &["proxies.web.forth.delay=5ms".to_owned()]).unwrap();
        assert_eq!((file.title.as_str(), file.seed, file.most_bytes.get()), ("two", 7, 1_000_000));
        let [store, web] = &file.proxies[..] else { panic!("{:?}", file.proxies) };
        assert_eq!(store.forth, store.back);
        assert_eq!(store.forth.keys.to_string(), "{ delay = \"20ms\", close-after = \"3s\" }");
        assert_eq!(web.forth.config.line().delay.mean(), Duration::from_millis(5));
        assert_eq!((web.back.config.window(), web.back.config.line().delay.mean()), (10_000, Duration::ZERO));
    }

    #[test]
    fn faults_are_told_at_their_place() {
        for (from, to, part) in [
            ("\"web\"", "\"store\"", "there is a proxy \"store\" already"),
            ("127.0.0.1:7080", "127.0.0.1:7379", "is the address of proxy store already"),
            ("127.0.0.1:8080", "127.0.0.1:0", "with a port above zero"),
            ("127.0.0.1:8080", "192.0.2.1:80", "allow-remote"),
            ("rate = \"1Mbit\"", "los = \"1%\"", "unknown key"),
            ("most-bytes = \"1MB\"", "most-packets = 3", "unknown key"),
            ("listen = \"127.0.0.1:7080\"", "", "missing key"),
        ] {
            assert!(TWO.contains(from));
            let error = parse(&TWO.replace(from, to), &[]).unwrap_err();
            assert!(error.to_string().contains(part), "{from} -> {to}: {error}");
        }
        assert!(parse("proxies = []", &[]).unwrap_err().to_string().contains("1 to 256 entries"));
        assert!(parse("", &[]).unwrap_err().to_string().contains("at least one entry [[proxies]]"));
    }
}

//! Configuration of a relay, from a relay file or from the options `--listen` and `--to`.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

use cohaptic_linkfile::{RelayFile, relay_link_keys_of_text};
use cohaptic_realtime::Tolerance;
use cohaptic_relay::{Form, Limits, Proxy, RelayConfig};
use cohaptic_scene::LinkKeys;
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use crate::arguments::RelayArguments;
use crate::failure::Failure;
use crate::input;
use crate::link::link_and_keys;
use crate::realtime::{ConfiguredDelay, local, own_address, unicode_words};

/// Configuration of a relay, with the names and keys for messages and live control.
pub(super) struct Setup {
    pub(super) title: String,
    pub(super) config: RelayConfig,
    pub(super) tolerance: Tolerance,
    /// Names of the programs at the ends of links, indexed by node.
    pub(super) nodes: Vec<String>,
    /// Sender and receiver of each link, in the order of reports.
    pub(super) pairs: Vec<(NodeId, NodeId)>,
    pub(super) keys: Vec<LinkKeys>,
    /// Base folder of file names in keys.
    pub(super) folder: PathBuf,
}

impl Setup {
    pub(super) fn new(arguments: &RelayArguments) -> Result<Self, Failure> {
        match (arguments.listen, arguments.to, arguments.words.as_slice()) {
            (Some(listen), Some(to), _) => Self::of_proxy(arguments, listen, to),
            (_, _, [file]) => Self::of_file(arguments, Path::new(file)),
            (_, _, more) => {
                let more: Vec<_> = more.iter().map(|word| word.to_string_lossy()).collect();
                Err(Failure::Input(format!(
                    "{:?} is not a file: expected one relay file; a link in words goes with --listen and --to",
                    more.join(" ")
                )))
            }
        }
    }

    fn of_file(arguments: &RelayArguments, path: &Path) -> Result<Self, Failure> {
        let mut overrides = arguments.set.clone();
        // Options of their own come after all `--set`, so that they win over `--set` and over the file.
        let mut lay = |key: &str, value: Option<String>| overrides.extend(value.map(|value| format!("relay.{key}={value}")));
        lay("seed", arguments.seed.map(|seed| seed.to_string()));
        lay("most-packets", arguments.packets.map(|packets| packets.to_string()));
        lay("most-bytes", arguments.bytes.map(|bytes| format!("\"{}B\"", bytes.get())));
        lay("allow-remote", arguments.real_time.allow_remote.then(|| "true".to_owned()));
        let file = input::with(path, |text, file| RelayFile::parse(text, file, &overrides))?;
        // The configuration has models of links without the keys. Live control shows and changes keys, so that these are read from the text once more.
        let keys = input::with(path, |text, file| relay_link_keys_of_text(text, file, &overrides))?;
        let tolerance = arguments.real_time.pace.tolerance.unwrap_or(file.limits.tolerance);
        Ok(Self {
            title: file.title.clone(),
            tolerance: Tolerance { limit: tolerance },
            nodes: file.programs.iter().map(|program| program.name.clone()).collect(),
            pairs: keys.keys().map(|(from, to)| (NodeId::new(*from), NodeId::new(*to))).collect(),
            keys: keys.into_values().collect(),
            folder: path.parent().map(Path::to_path_buf).unwrap_or_default(),
            config: file.into(),
        })
    }

    fn of_proxy(arguments: &RelayArguments, listen: SocketAddr, to: SocketAddr) -> Result<Self, Failure> {
        if !arguments.real_time.allow_remote {
            local("--listen", listen)?;
            local("--to", to)?;
        }
        if to.port() == 0 {
            return Err(Failure::Input(format!("--to {to}: expected the port of a program, which is not 0")));
        }
        let (forth, forth_keys) = link_and_keys(&unicode_words(&arguments.words)?)?;
        let (back, back_keys) = match &arguments.back {
            None => (forth.clone(), forth_keys.clone()),
            Some(spec) => link_and_keys(&unicode_words(spec)?)?,
        };
        let usual = Limits::default();
        let limits = Limits { packets: arguments.packets.unwrap_or(usual.packets), bytes: arguments.bytes.unwrap_or(usual.bytes), ..usual };
        let proxy = Proxy { listen, to, forth, back, most_clients: Proxy::MOST_CLIENTS };
        Ok(Self {
            title: format!("{listen} -> {to}"),
            config: RelayConfig { seed: arguments.seed.unwrap_or(0), form: Form::Proxy(proxy), limits, changes: Vec::new() },
            tolerance: arguments.real_time.pace.tolerance(),
            // Node 0 stands for all clients, node 1 for the server.
            nodes: vec!["client".to_owned(), "server".to_owned()],
            pairs: vec![(NodeId(0), NodeId(1)), (NodeId(1), NodeId(0))],
            keys: vec![forth_keys, back_keys],
            // Keys on the command line name files relative to the working directory.
            folder: PathBuf::new(),
        })
    }

    /// Returns the lines with the addresses for programs. Called after the ports are bound, because the system replaces the port 0 only then.
    pub(super) fn opened<'a>(&mut self, ports: impl Iterator<Item = (&'a str, SocketAddr)>) -> Vec<String> {
        let (title, form) = (&mut self.title, &self.config.form);
        let mut line = |(place, (_, port)): (usize, (&str, SocketAddr))| match form {
            Form::Proxy(proxy) => {
                // The title names the port that the system chose.
                *title = format!("{port} -> {}", proxy.to);
                format!("listening on {port} for datagrams to {}", proxy.to)
            }
            Form::Mesh(mesh) => {
                let Some(program) = mesh.programs.get(place) else { return String::new() };
                let address = program.address.map_or_else(|| "wherever it first sends from".to_owned(), |address| address.to_string());
                format!("listening on {port} for datagrams to {}, which is at {address}", program.name)
            }
        };
        let lines = |(place, port): (usize, (&str, SocketAddr))| {
            let own = own_address(port.1).map(|own| format!("programs on other machines send to {own}"));
            std::iter::once(line((place, port))).chain(own)
        };
        ports.enumerate().flat_map(lines).collect()
    }

    pub(super) fn name(&self, node: NodeId) -> &str {
        self.nodes.get(node.index()).map_or("", String::as_str)
    }

    /// Returns the configured delay of each link after a run of the length `lasted`. `edits` holds the number of changes from outside, indexed by link; changes
    /// of the timeline are added.
    pub(super) fn asked(&self, edits: &[u64], lasted: Duration) -> Vec<ConfiguredDelay> {
        let end = Instant::ZERO.saturating_add(lasted);
        let asked = |((from, to), edits): (&(NodeId, NodeId), &u64)| {
            let begun = match &self.config.form {
                Form::Mesh(mesh) => ConfiguredDelay::of(mesh.links.between(from.index(), to.index())),
                Form::Proxy(proxy) => ConfiguredDelay::of(if from.0 == 0 { &proxy.forth } else { &proxy.back }),
            };
            // A run that ended early did not reach the later changes of the timeline.
            let planned = self.config.changes.iter().filter(|change| change.at <= end && (change.from, change.to) == (*from, *to)).count();
            ConfiguredDelay { changes: edits + planned as u64, ..begun }
        };
        self.pairs.iter().zip(edits).map(asked).collect()
    }
}

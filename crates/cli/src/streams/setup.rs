//! Configuration of a relay of TCP, from a relay file or from the options `--listen` and `--to`.

use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::Path;

use cohaptic_linkfile::reading::FileReader;
use cohaptic_linkfile::stream::{StreamConfig, split_faults, stream_of_keys};
use cohaptic_linkfile::{LinkKeys, TcpRelayFile};
use cohaptic_realtime::Tolerance;
use cohaptic_streams::{Proxy, StreamsConfig};

use crate::arguments::RelayArguments;
use crate::failure::Failure;
use crate::input;
use crate::link::link_and_keys;
use crate::realtime::{ConfiguredDelay, local, unicode_words};

/// Configuration of a relay of TCP, with the names and keys for messages and live control.
pub(super) struct Setup {
    pub(super) title: String,
    pub(super) config: StreamsConfig,
    pub(super) tolerance: Tolerance,
    /// `true` for a relay of `--listen` and `--to`, whose only proxy needs no name in messages.
    pub(super) is_pair: bool,
    /// Keys of each line, in the order of reports: of each proxy forth, then back.
    pub(super) keys: Vec<LinkKeys>,
}

impl Setup {
    pub(super) fn new(arguments: &RelayArguments) -> Result<Self, Failure> {
        match (arguments.listen, arguments.to, arguments.words.as_slice()) {
            (Some(listen), Some(to), _) => Self::of_pair(arguments, listen, to),
            (_, _, [file]) => Self::of_file(arguments, Path::new(file)),
            (_, _, more) => {
                let more: Vec<_> = more.iter().map(|word| word.to_string_lossy()).collect();
                Err(Failure::Input(format!("{:?} is not a file: expected one relay file; words go with --listen and --to", more.join(" "))))
            }
        }
    }

    fn of_file(arguments: &RelayArguments, path: &Path) -> Result<Self, Failure> {
        let mut overrides = arguments.set.clone();
        // Single options such as `--seed` come after all `--set`, and so override `--set` and the file.
        let mut lay = |key: &str, value: Option<String>| overrides.extend(value.map(|value| format!("relay.{key}={value}")));
        lay("seed", arguments.seed.map(|seed| seed.to_string()));
        lay("most-bytes", arguments.bytes.map(|bytes| format!("\"{}B\"", bytes.get())));
        lay("allow-remote", arguments.real_time.allow_remote.then(|| "true".to_owned()));
        let file = input::with(path, |text, file| TcpRelayFile::parse(text, file, &overrides))?;
        let keys = file.proxies.iter().flat_map(|proxy| [proxy.forth.keys.clone(), proxy.back.keys.clone()]).collect();
        let tolerance = Tolerance { limit: arguments.real_time.pace.tolerance.unwrap_or(file.tolerance) };
        Ok(Self { title: file.title.clone(), tolerance, is_pair: false, keys, config: file.into() })
    }

    fn of_pair(arguments: &RelayArguments, listen: SocketAddr, to: SocketAddr) -> Result<Self, Failure> {
        if !arguments.real_time.allow_remote {
            local("--listen", listen)?;
            local("--to", to)?;
        }
        if to.port() == 0 {
            return Err(Failure::Input(format!("--to {to}: expected the port of a program, which is not 0")));
        }
        let (forth, forth_keys) = stream(&arguments.words)?;
        let (back, back_keys) = match &arguments.back {
            None => (forth.clone(), forth_keys.clone()),
            Some(spec) => stream(spec)?,
        };
        let proxy = Proxy { name: "proxy".to_owned(), listen, to, forth, back };
        let most_bytes = arguments.bytes.unwrap_or(StreamsConfig::MOST_BYTES);
        Ok(Self {
            title: format!("{listen} -> {to}"),
            config: StreamsConfig { seed: arguments.seed.unwrap_or(0), proxies: vec![proxy], most_bytes },
            tolerance: arguments.real_time.pace.tolerance(),
            is_pair: true,
            keys: vec![forth_keys, back_keys],
        })
    }

    /// Takes the addresses that the system chose.
    pub(super) fn opened(&mut self, addresses: &[SocketAddr]) {
        for (proxy, address) in self.config.proxies.iter_mut().zip(addresses) {
            proxy.listen = *address;
        }
        if let ([proxy], true) = (&self.config.proxies[..], self.is_pair) {
            self.title = format!("{} -> {}", proxy.listen, proxy.to);
        }
    }

    /// Returns the names of the two ends of a proxy, client and server.
    pub(super) fn ends(&self, proxy: &str) -> [String; 2] {
        ["client", "server"].map(|end| if self.is_pair { end.to_owned() } else { format!("{proxy}/{end}") })
    }

    /// Returns the configured delay of each line. `edits` holds the number of changes from outside, indexed by line.
    pub(super) fn asked(&self, edits: &[u64]) -> Vec<ConfiguredDelay> {
        let streams = self.config.proxies.iter().flat_map(|proxy| [&proxy.forth, &proxy.back]);
        let asked =
            |(stream, changes): (&StreamConfig, &u64)| ConfiguredDelay { changes: *changes, ..ConfiguredDelay::of(&stream.line().clone().into()) };
        streams.zip(edits).map(asked).collect()
    }
}

/// Returns the stream of a spec, with its keys. Words of tc are stored under the key `netem`.
fn stream(spec: &[OsString]) -> Result<(StreamConfig, LinkKeys), Failure> {
    let said = split_faults(&unicode_words(spec)?).map_err(Failure::Input)?;
    let (_, link) = link_and_keys(&said.link)?;
    let keys = said.faults.iter().fold(link, |keys, (key, value)| keys.with(key, value));
    // Keys on the command line name files relative to the working directory.
    let stream = stream_of_keys(&keys, Path::new(""), FileReader(&cohaptic_files::read_bytes)).map_err(Failure::LinkKeys)?;
    Ok((stream, keys))
}

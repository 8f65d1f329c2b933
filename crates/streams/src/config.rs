//! Configuration of a relay of TCP: proxies, each with its streams, and the bound on memory.

use std::net::SocketAddr;

use cohaptic_linkfile::TcpRelayFile;
use cohaptic_linkfile::stream::StreamConfig;
use cohaptic_units::Bytes;

/// Configuration of a relay of TCP.
#[derive(Clone, PartialEq, Debug)]
pub struct StreamsConfig {
    /// Seed of jitter, of the connections with faults, and of the sizes of slices.
    pub seed: u64,
    /// Proxies. Proxy n has the lines 2n, from its clients to its program, and 2n + 1, back.
    pub proxies: Vec<Proxy>,
    /// Largest number of held bytes of all connections. A connection beyond the bound waits.
    pub most_bytes: Bytes,
}

/// Listening address, and the program for the clients of this address.
#[derive(Clone, PartialEq, Debug)]
pub struct Proxy {
    /// Name of the proxy. Seed and name select the random streams.
    pub name: String,
    /// Address for clients. Port 0 lets the system choose.
    pub listen: SocketAddr,
    /// Address of the program.
    pub to: SocketAddr,
    /// Stream from the clients to the program.
    pub forth: StreamConfig,
    /// Stream from the program to the clients.
    pub back: StreamConfig,
}

impl StreamsConfig {
    /// Default of [`most_bytes`](Self::most_bytes), as of relay files: 64 MB.
    pub const MOST_BYTES: Bytes = Bytes::new(64_000_000);
}

impl From<TcpRelayFile> for StreamsConfig {
    fn from(file: TcpRelayFile) -> Self {
        let proxies = file.proxies.into_iter().map(|proxy| Proxy {
            name: proxy.name,
            listen: proxy.listen,
            to: proxy.to,
            forth: proxy.forth.config,
            back: proxy.back.config,
        });
        Self { seed: file.seed, proxies: proxies.collect(), most_bytes: file.most_bytes }
    }
}

//! The constants of TCP.

use cohaptic_wan::NodeId;

use super::Testbed;
use crate::tcp::TcpConfig;

impl Testbed {
    /// The constants of TCP on all hosts. If it is not said they are those of Linux: [`TcpConfig::default`].
    ///
    /// # Panics
    ///
    /// If they cannot be.
    pub fn tcp(mut self, config: TcpConfig) -> Self {
        check_tcp(&config);
        self.tcp = (0..self.setup.names.len()).map(|host| (NodeId::new(host), config.clone())).collect();
        self
    }

    /// The constants of TCP on one host, after [`Testbed::tcp`].
    ///
    /// # Panics
    ///
    /// If they cannot be, or there is no such host.
    pub fn tcp_of(mut self, host: &str, config: TcpConfig) -> Self {
        check_tcp(&config);
        self.tcp.insert(self.setup.names.node(host), config);
        self
    }
}

/// # Panics
///
/// If a connection cannot have these constants.
#[expect(clippy::panic, reason = "a misuse, and the way out")]
fn check_tcp(config: &TcpConfig) {
    if let Err(error) = config.check() {
        panic!("these constants of TCP cannot be: {error}");
    }
}

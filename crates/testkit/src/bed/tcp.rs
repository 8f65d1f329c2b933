//! Constants of TCP of a test bed.

use cohaptic_wan::NodeId;

use super::Testbed;
use crate::tcp::TcpConfig;

impl Testbed {
    /// Sets the constants of TCP on all hosts. The defaults are the constants of Linux: [`TcpConfig::default`].
    ///
    /// # Panics
    ///
    /// If a connection cannot have these constants.
    pub fn tcp(mut self, config: TcpConfig) -> Self {
        check_tcp(&config);
        self.tcp = (0..self.setup.names.len()).map(|host| (NodeId::new(host), config.clone())).collect();
        self
    }

    /// Sets the constants of TCP on one host. Call this after [`Testbed::tcp`], because [`Testbed::tcp`] sets all hosts.
    ///
    /// # Panics
    ///
    /// If a connection cannot have these constants, or there is no such host.
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
        panic!("these constants of TCP are not valid: {error}");
    }
}

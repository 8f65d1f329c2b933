//! The name server of the real machine.

use std::fs;
use std::net::{IpAddr, SocketAddr};

use crate::gateway::DNS;

/// Returns the first name server in /etc/resolv.conf (resolv.conf(5)), or `None` if there is none.
#[must_use]
pub fn name_server() -> Option<SocketAddr> {
    first_of(&fs::read_to_string("/etc/resolv.conf").ok()?)
}

fn first_of(text: &str) -> Option<SocketAddr> {
    let server = |line: &str| {
        let mut words = line.split_whitespace();
        if words.next() != Some("nameserver") {
            return None;
        }
        // A link-local address names its interface too (fe80::1%eth0), is no `IpAddr`, and is skipped: a socket would need the number of the interface.
        let address: IpAddr = words.next()?.parse().ok()?;
        Some(SocketAddr::new(address, DNS))
    };
    text.lines().find_map(server)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_name_server_counts() {
        let text = "# nameserver 192.0.2.1\nsearch example.org\nnameserver fe80::1%eth0\nnameserver 127.0.0.53\nnameserver 192.0.2.2\n";
        assert_eq!(first_of(text), Some("127.0.0.53:53".parse().unwrap()));
        assert_eq!(first_of("options edns0\n"), None);
    }
}

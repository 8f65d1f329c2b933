//! Counters of a socket, and the reasons why datagrams were lost at the socket.

use std::io;
use std::os::fd::AsFd;

use rustix::io::Errno;

/// Counters of a socket since it was opened.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct EndpointCounts {
    /// Arrived datagrams handed on to the program.
    pub received: u64,
    /// Arrived datagrams dropped for a length of more than [`EndpointConfig::largest`](super::EndpointConfig::largest).
    pub oversized: u64,
    /// Passing errors of receiving: a report of an undelivered earlier datagram, a network that was down for a while, a shortage of memory.
    pub receive_errors: u64,
    /// Datagrams taken by the kernel for sending.
    pub sent: u64,
    /// Outgoing datagrams that were lost.
    pub failures: SendFailures,
    /// Calls of the kernel to send. Fewer than datagrams if several went in one call.
    pub send_calls: u64,
}

/// Lost outgoing datagrams, by reason.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct SendFailures {
    /// The kernel's buffer was full. Either the datagram may not wait, or as many datagrams as allowed were waiting.
    pub full: u64,
    /// The receiver's port is closed. On loopback the kernel may report this for an earlier datagram.
    pub refused: u64,
    /// No route leads to the receiver, or the network is down.
    pub unreachable: u64,
    /// The datagram is longer than the path takes in one piece.
    pub too_large: u64,
    /// A rule of this system, such as a firewall, forbids the datagram.
    pub forbidden: u64,
    /// Any other reason.
    pub other: u64,
}

impl SendFailures {
    /// Returns the number of lost outgoing datagrams.
    #[must_use]
    pub const fn in_all(&self) -> u64 {
        self.full + self.refused + self.unreachable + self.too_large + self.forbidden + self.other
    }

    /// Returns each reason, by its name in JSON, with its count.
    #[must_use]
    pub const fn by_reason(&self) -> [(&'static str, u64); 6] {
        [
            ("full", self.full),
            ("refused", self.refused),
            ("unreachable", self.unreachable),
            ("too-large", self.too_large),
            ("forbidden", self.forbidden),
            ("other", self.other),
        ]
    }

    /// Counts one outgoing datagram lost because of `error`.
    pub(super) fn count(&mut self, error: &io::Error) {
        let counter = match Errno::from_io_error(error).unwrap_or(Errno::IO) {
            Errno::AGAIN | Errno::NOBUFS | Errno::NOMEM => &mut self.full,
            Errno::CONNREFUSED | Errno::CONNRESET => &mut self.refused,
            Errno::NETUNREACH | Errno::HOSTUNREACH | Errno::NETDOWN | Errno::HOSTDOWN | Errno::ADDRNOTAVAIL => &mut self.unreachable,
            Errno::MSGSIZE => &mut self.too_large,
            Errno::PERM | Errno::ACCESS => &mut self.forbidden,
            _ => &mut self.other,
        };
        *counter += 1;
    }
}

/// Returns the number of datagrams dropped by the kernel at a socket because the receive buffer was full, from `/proc/net/udp` or `udp6`, or `None` if the
/// table does not list the socket.
pub(super) fn kernel_drops(socket: impl AsFd, is_ipv6: bool) -> io::Result<Option<u64>> {
    let inode = rustix::fs::fstat(socket)?.st_ino;
    // `thread-self`: a thread can be in another network namespace than the rest of its process.
    let table = std::fs::read_to_string(if is_ipv6 { "/proc/thread-self/net/udp6" } else { "/proc/thread-self/net/udp" })?;
    Ok(drops_of(&table, inode))
}

/// Returns the last column of the line whose tenth column is the inode (`udp4_format_sock` of Linux).
fn drops_of(table: &str, inode: u64) -> Option<u64> {
    let inode = inode.to_string();
    // The first line names the columns.
    let line = table.lines().skip(1).find(|line| line.split_whitespace().nth(9) == Some(&inode))?;
    line.split_whitespace().next_back()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_error_of_the_kernel_is_counted_under_one_reason() {
        let reasons = [
            (Errno::AGAIN, "full"),
            (Errno::NOBUFS, "full"),
            (Errno::CONNREFUSED, "refused"),
            (Errno::NETUNREACH, "unreachable"),
            (Errno::HOSTUNREACH, "unreachable"),
            (Errno::MSGSIZE, "too-large"),
            (Errno::PERM, "forbidden"),
            (Errno::ACCESS, "forbidden"),
            (Errno::INVAL, "other"),
        ];
        for (errno, expected) in reasons {
            let mut failures = SendFailures::default();
            failures.count(&errno.into());
            let counted: Vec<_> = failures.by_reason().into_iter().filter(|(_, count)| *count > 0).collect();
            assert_eq!(counted, [(expected, 1)], "{errno}");
            assert_eq!(failures.in_all(), 1);
        }
    }

    #[test]
    fn the_line_of_the_socket_is_found_by_its_inode() {
        let table = "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode ref pointer drops            \n\
              14: 0100007F:1F90 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 41234 2 0000000000000000 0          \n\
              15: 0100007F:1F91 00000000:0000 07 00000000:00034200 00:00000000 00000000  1000        0 41235 2 0000000000000000 977        \n";
        assert_eq!(drops_of(table, 41_235), Some(977));
        assert_eq!(drops_of(table, 41_234), Some(0));
        assert_eq!(drops_of(table, 1000), None);
        assert_eq!(drops_of("", 1), None);
    }
}

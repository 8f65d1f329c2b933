//! Datagrams that the kernel dropped before anybody could read them, because the socket's buffer was full.

use std::io;
use std::os::fd::AsFd;

/// How many datagrams the kernel has dropped at this socket, from `/proc/net/udp` or `udp6`; `None` if the system does not tell.
///
/// # Errors
///
/// What the system says.
pub(super) fn kernel_drops(socket: impl AsFd, is_ipv6: bool) -> io::Result<Option<u64>> {
    let inode = rustix::fs::fstat(socket)?.st_ino;
    let table = std::fs::read_to_string(if is_ipv6 { "/proc/thread-self/net/udp6" } else { "/proc/thread-self/net/udp" })?;
    Ok(drops_of(&table, inode))
}

/// The last column of the line whose tenth is the inode (`udp4_format_sock` of Linux).
fn drops_of(table: &str, inode: u64) -> Option<u64> {
    let inode = inode.to_string();
    let line = table.lines().skip(1).find(|line| line.split_whitespace().nth(9) == Some(&inode))?;
    line.split_whitespace().next_back()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

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

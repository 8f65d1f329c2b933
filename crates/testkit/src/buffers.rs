//! Sizes of the buffers of sockets, as Linux sets them (`SO_RCVBUF`, `SO_SNDBUF`).

/// Least size of a receive buffer in Linux (`SOCK_MIN_RCVBUF`) \[byte\].
pub(crate) const LEAST_RECEIVE_BUFFER: u32 = 2304;
/// Least size of a send buffer in Linux (`SOCK_MIN_SNDBUF`) \[byte\].
pub(crate) const LEAST_SEND_BUFFER: u32 = 4608;
/// Default of `net.core.rmem_max` and of `wmem_max` \[byte\].
const GREATEST: u32 = 212_992;

/// Returns the size of a buffer after a program has asked for `size`, at least `least` \[byte\]. Linux reserves as much again for overhead, and reports the
/// sum.
pub(crate) fn doubled(size: u32, least: u32) -> usize {
    (2 * size.min(GREATEST)).max(least) as usize
}

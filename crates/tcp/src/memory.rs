//! Memory that segments take in Linux, which counts whole buffers and not octets of data.

/// Octets that Linux counts for the structures of a buffer: one part for the descriptor, one part at the end of the data.
const DESCRIPTOR: usize = 256;
const SHARED: usize = 320;

/// Headers and margin in the memory of a received segment \[byte\].
const HEADERS: usize = 59;

/// Most data that takes a single piece of memory \[byte\]. Longer segments, as on loopback interfaces, keep the pages of their sender.
const LONGEST_PIECE: usize = 4096;

/// Returns the octets of memory that a received segment with `octets` of data takes (`SKB_TRUESIZE`), and the octets of later data that fit into the same
/// memory.
pub(crate) const fn of_received(octets: usize) -> (usize, usize) {
    let used = octets + HEADERS;
    if octets > LONGEST_PIECE {
        return (832 + octets, 0);
    }
    // Memory comes in powers of two. The smallest piece is an exception.
    let piece = if used <= 256 { 832 - DESCRIPTOR } else { (used + SHARED).next_power_of_two() };
    (DESCRIPTOR + piece, piece - SHARED - used)
}

/// Returns the octets of memory that Linux plans for a segment of `mss` octets in the send buffer (`tcp_sndbuf_expand`).
pub(crate) const fn of_sent(mss: usize) -> usize {
    DESCRIPTOR + (mss + DESCRIPTOR + SHARED).next_power_of_two()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Measured on Linux 6.18 with datagrams, and with segments of 1448 octets.
    #[test]
    fn segments_take_the_memory_of_linux() {
        let seen = [1, 197, 198, 645, 646, 1448, 1669, 1670].map(|octets| of_received(octets).0);
        assert_eq!(seen, [832, 832, 1280, 1280, 2304, 2304, 2304, 4352]);
        // Over the loopback interface.
        assert_eq!([5000, 20_000].map(|octets| of_received(octets).0), [5832, 20_832]);
        assert_eq!((of_sent(1448), of_sent(1428)), (2304, 2304));
    }
}

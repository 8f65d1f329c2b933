//! Random bytes for programs. The bytes depend on the seed of the run: equal seeds give equal bytes.

use std::collections::BTreeMap;

use cohaptic_wan::NodeId;
use cohaptic_wan::random::{Purpose, Stream};

/// Label of the random streams of programs. The labels of links differ: see [`cohaptic_wan::LinkName`].
#[cfg(any(test, feature = "facade", feature = "quinn"))]
const LABEL: &[u8] = b"entropy of the programs of a test bed";

/// Source of the random bytes of one host.
#[derive(Debug)]
pub(crate) struct Entropy {
    stream: Stream,
    /// Number of requests so far. Each request draws from the stream at its own position.
    asked: u64,
}

impl Entropy {
    /// Creates a source on the stream of `seed` and `label`. Draws of this stream do not move the draws of other streams.
    fn labelled(seed: u64, label: &[u8]) -> Self {
        Self { stream: Stream::new(seed, label), asked: 0 }
    }

    /// Fills `buffer` with the bytes of the next request.
    pub(crate) fn fill(&mut self, buffer: &mut [u8]) {
        let mut draws = self.stream.packet(self.asked).draws(Purpose::InitialState);
        self.asked += 1;
        // Little-endian on every machine, so that equal seeds give equal bytes.
        for chunk in buffer.chunks_mut(8) {
            chunk.copy_from_slice(&draws.next_word().to_le_bytes()[..chunk.len()]);
        }
    }

    /// Returns `N` bytes of the next request.
    pub(crate) fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        self.fill(&mut bytes);
        bytes
    }
}

/// Random bytes for the programs of each host, and for programs of no host. Each host has a stream labelled with its name, so neither requests of other hosts
/// nor the list of hosts change its bytes.
#[derive(Debug)]
pub(crate) struct ByHost {
    seed: u64,
    label: &'static [u8],
    streams: BTreeMap<Option<NodeId>, Entropy>,
}

impl ByHost {
    #[cfg(any(feature = "facade", feature = "quinn"))]
    pub(super) const fn of_programs(seed: u64) -> Self {
        Self::labelled(seed, LABEL)
    }

    pub(super) const fn labelled(seed: u64, label: &'static [u8]) -> Self {
        Self { seed, label, streams: BTreeMap::new() }
    }

    /// Returns the source of a host. `names` are the names of all hosts, indexed by host.
    pub(crate) fn of(&mut self, host: Option<NodeId>, names: &[String]) -> &mut Entropy {
        let Self { seed, label, streams } = self;
        // A source is made at its first request, so `was_asked` knows whether any program has drawn.
        streams.entry(host).or_insert_with(|| {
            let name = host.map_or_else(String::new, |host| format!(" of {}", names[host.index()]));
            Entropy::labelled(*seed, &[*label, name.as_bytes()].concat())
        })
    }

    /// Returns whether any source was asked for.
    pub(super) fn was_asked(&self) -> bool {
        !self.streams.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Entropy {
        fn new(seed: u64) -> Self {
            Self::labelled(seed, LABEL)
        }
    }

    #[test]
    fn the_bytes_of_a_host_depend_on_its_name_and_not_on_what_other_hosts_ask_for() {
        let names = |list: &[&str]| list.iter().map(ToString::to_string).collect::<Vec<_>>();
        let (few, many) = (names(&["a", "b"]), names(&["b", "x", "a"]));
        let (mut one, mut other) = (ByHost::labelled(1, LABEL), ByHost::labelled(1, LABEL));
        assert!(!one.was_asked());
        let _: [u8; 8] = other.of(Some(NodeId(1)), &many).bytes();
        let first: [u8; 8] = one.of(Some(NodeId(0)), &few).bytes();
        assert_eq!(other.of(Some(NodeId(2)), &many).bytes(), first);
        assert_ne!(one.of(Some(NodeId(1)), &few).bytes(), first);
        assert_ne!(one.of(None, &few).bytes(), first);
        assert!(one.was_asked());
    }

    #[test]
    fn the_bytes_depend_on_the_seed_and_on_what_was_asked_before_and_on_nothing_else() {
        let (mut one, mut same, mut other) = (Entropy::new(1), Entropy::new(1), Entropy::new(2));
        let first: [u8; 13] = one.bytes();
        assert_eq!(first, same.bytes());
        assert_ne!(first, other.bytes());
        assert_ne!(first, one.bytes());
        // The bytes for a shorter buffer are the beginning of the bytes for a longer one.
        let mut longer = [0; 21];
        Entropy::new(1).fill(&mut longer);
        assert_eq!(longer[..13], first);
    }
}

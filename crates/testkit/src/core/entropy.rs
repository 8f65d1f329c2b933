//! Random bytes for programs that want them: others in every run of another seed, the same in every run of the same one.

use std::collections::BTreeMap;

use cohaptic_wan::NodeId;
use cohaptic_wan::random::{Purpose, Stream};

/// The label of the stream of programs. Links have labels of their own: see [`cohaptic_wan::LinkName`].
#[cfg(any(test, feature = "quinn"))]
const LABEL: &[u8] = b"entropy of the programs of a test bed";

/// Where the random bytes of programs come from.
#[derive(Debug)]
pub(crate) struct Entropy {
    stream: Stream,
    /// How often some were asked for.
    asked: u64,
}

impl Entropy {
    /// A stream of its own: its draws move no draw of another one.
    fn labelled(seed: u64, label: &[u8]) -> Self {
        Self { stream: Stream::new(seed, label), asked: 0 }
    }

    /// Fills a buffer.
    pub(crate) fn fill(&mut self, buffer: &mut [u8]) {
        let mut draws = self.stream.packet(self.asked).draws(Purpose::InitialState);
        self.asked += 1;
        for chunk in buffer.chunks_mut(8) {
            chunk.copy_from_slice(&draws.next_word().to_le_bytes()[..chunk.len()]);
        }
    }

    /// An array of them.
    pub(crate) fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        self.fill(&mut bytes);
        bytes
    }
}

/// Random bytes for the programs of each host, and for those of no host. Each host has a stream of its own, by its name: what other hosts ask for, and which
/// hosts there are besides, changes none of the bytes.
#[derive(Debug)]
pub(crate) struct ByHost {
    seed: u64,
    label: &'static [u8],
    streams: BTreeMap<Option<NodeId>, Entropy>,
}

impl ByHost {
    #[cfg(feature = "quinn")]
    pub(super) const fn of_programs(seed: u64) -> Self {
        Self::labelled(seed, LABEL)
    }

    pub(super) const fn labelled(seed: u64, label: &'static [u8]) -> Self {
        Self { seed, label, streams: BTreeMap::new() }
    }

    /// The bytes of a host; `names` are those of all hosts.
    pub(crate) fn of(&mut self, host: Option<NodeId>, names: &[String]) -> &mut Entropy {
        let Self { seed, label, streams } = self;
        streams.entry(host).or_insert_with(|| {
            let name = host.map_or_else(String::new, |host| format!(" of {}", names[host.index()]));
            Entropy::labelled(*seed, &[*label, name.as_bytes()].concat())
        })
    }

    /// Returns whether any were asked for.
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
        // A shorter buffer has the beginning of a longer one.
        let mut longer = [0; 21];
        Entropy::new(1).fill(&mut longer);
        assert_eq!(longer[..13], first);
    }
}

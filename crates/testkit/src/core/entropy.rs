//! Random bytes for programs that want them: others in every run of another seed, the same in every run of the same one.

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
    #[cfg(any(test, feature = "quinn"))]
    pub(super) fn new(seed: u64) -> Self {
        Self::labelled(seed, LABEL)
    }

    /// A stream of its own: its draws move no draw of another one.
    pub(super) fn labelled(seed: u64, label: &[u8]) -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;

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

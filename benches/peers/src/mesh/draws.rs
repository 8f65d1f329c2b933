//! What happens to each packet: whether it is lost, and how long it takes. By its address, so that all programs have the same whatever their order is.

use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{LinkName, standard_normal};

use super::{DELAY_NANOS, LOSS, Mesh, SD_NANOS, SEED};

/// The draws of one link.
#[derive(Clone, Copy, Debug)]
pub struct Draws {
    /// `None`: a constant delay, and nothing is lost.
    stream: Option<Stream>,
}

impl Draws {
    /// Those of the link from one peer to another.
    #[must_use]
    pub fn new(mesh: Mesh, from: usize, to: usize) -> Self {
        let name = |peer: usize| format!("peer{}", peer + 1);
        let stream = || Stream::new(SEED, LinkName::between(&name(from), &name(to)).as_str().as_bytes());
        Self { stream: mesh.impaired.then(stream) }
    }

    /// Those of the links from one peer to each, itself included.
    #[must_use]
    pub fn from(mesh: Mesh, from: usize) -> Vec<Self> {
        (0..mesh.peers).map(|to| Self::new(mesh, from, to)).collect()
    }

    /// Those of the links to one peer from each, itself included.
    #[must_use]
    pub fn to(mesh: Mesh, to: usize) -> Vec<Self> {
        (0..mesh.peers).map(|from| Self::new(mesh, from, to)).collect()
    }

    /// How long the packet of that number takes; `None` if it is lost.
    #[must_use]
    #[inline]
    pub fn delay(&self, sequence: u64) -> Option<u64> {
        let Some(stream) = self.stream else { return Some(DELAY_NANOS) };
        let words = stream.packet(sequence);
        let [loss, jitter] = words.loss_and_jitter();
        if ((loss >> 11) as f64) < LOSS * 9_007_199_254_740_992.0 {
            return None;
        }
        let mut more = words.more(Purpose::Jitter);
        let z = standard_normal(jitter, || more.next_word());
        Some(DELAY_NANOS.saturating_add_signed((z * SD_NANOS).round_ties_even() as i64))
    }
}

//! What packets carry, in memory that is used again.

use std::ops::Deref;

use bytes::Bytes;

/// What a packet carries.
#[derive(Clone, Debug)]
pub(crate) enum Octets {
    /// Of a datagram that a socket sent: the memory goes back to [`Spare`] when it was read. It saves an allocation a datagram.
    Own(Vec<u8>),
    /// Of anything else.
    Shared(Bytes),
}

impl Default for Octets {
    fn default() -> Self {
        Self::Own(Vec::new())
    }
}

impl Deref for Octets {
    type Target = [u8];

    #[inline]
    fn deref(&self) -> &[u8] {
        match self {
            Self::Own(octets) => octets,
            Self::Shared(octets) => octets,
        }
    }
}

impl From<Bytes> for Octets {
    fn from(octets: Bytes) -> Self {
        Self::Shared(octets)
    }
}

impl From<Octets> for Bytes {
    fn from(octets: Octets) -> Self {
        match octets {
            Octets::Own(octets) => octets.into(),
            Octets::Shared(octets) => octets,
        }
    }
}

impl From<Octets> for Vec<u8> {
    fn from(octets: Octets) -> Self {
        match octets {
            Octets::Own(octets) => octets,
            Octets::Shared(octets) => octets.into(),
        }
    }
}

/// Memory of datagrams that were read.
#[derive(Debug, Default)]
pub(super) struct Spare(Vec<Vec<u8>>);

impl Spare {
    /// The largest number that is kept, and the longest \[bytes\]: a megabyte at most.
    const MOST: usize = 512;
    const LONGEST: usize = 2048;

    /// A copy of what a program sends.
    #[inline]
    pub(super) fn copy(&mut self, bytes: &[u8]) -> Octets {
        let mut octets = self.0.pop().unwrap_or_default();
        octets.clear();
        octets.extend_from_slice(bytes);
        Octets::Own(octets)
    }

    /// What was read.
    #[inline]
    pub(super) fn put(&mut self, octets: Octets) {
        if let Octets::Own(octets) = octets
            && octets.capacity() <= Self::LONGEST
            && self.0.len() < Self::MOST
        {
            self.0.push(octets);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_was_read_is_used_again() {
        let mut spare = Spare::default();
        let octets = spare.copy(b"longer than the next one");
        let place = octets.as_ptr();
        spare.put(octets);
        let next = spare.copy(b"next");
        assert_eq!((&*next, next.as_ptr()), (&b"next"[..], place));
        spare.put(Octets::Shared(Bytes::from_static(b"not ours")));
        spare.put(spare_of(Spare::LONGEST + 1));
        assert!(spare.0.is_empty());
        for _ in 0..2 * Spare::MOST {
            spare.put(spare_of(1));
        }
        assert_eq!(spare.0.len(), Spare::MOST);
    }

    fn spare_of(capacity: usize) -> Octets {
        Octets::Own(Vec::with_capacity(capacity))
    }
}

//! Data of a segment.

use alloc::vec::Vec;
use core::fmt;
use core::ops::Deref;

use bytes::{Buf, Bytes};

/// Data of a segment: borrowed from the octets of a packet, or shared with the send buffer of the connection that sends the segment. A clone copies no octets.
#[derive(Clone)]
pub struct Payload<'a>(Source<'a>);

#[derive(Clone)]
enum Source<'a> {
    Borrowed(&'a [u8]),
    /// Memory that begins with the data, and the number of octets of the data. Data of later segments may follow in the memory.
    Shared(Bytes, usize),
}

impl Payload<'_> {
    /// Returns the first `length` octets of `memory`.
    pub(crate) const fn first_of(memory: Bytes, length: usize) -> Self {
        Self(Source::Shared(memory, length))
    }

    /// Returns the data. Borrowed data is copied.
    #[must_use]
    pub fn into_owned(mut self) -> Payload<'static> {
        self.take_first(usize::MAX).into()
    }

    /// Takes the first `count` octets of the data out, or all if there are fewer. Borrowed octets are copied. Data of a later segment stays.
    pub(crate) fn take_first(&mut self, count: usize) -> Bytes {
        let count = count.min(self.len());
        let mut octets = self.take_memory();
        octets.truncate(count);
        octets
    }

    /// Takes the data out, with the octets that follow in the memory. Borrowed octets are copied. Data of a later segment stays.
    pub(crate) fn take_memory(&mut self) -> Bytes {
        match &mut self.0 {
            Source::Borrowed(octets) => Bytes::copy_from_slice(octets),
            Source::Shared(memory, length) if memory.len() > *length => memory.clone(),
            // No later data is in the memory, so that no further reference to the memory is needed.
            Source::Shared(memory, length) => {
                *length = 0;
                core::mem::take(memory)
            }
        }
    }

    /// Returns the number of octets, without a look at the octets.
    #[must_use]
    pub const fn len(&self) -> usize {
        match &self.0 {
            Source::Borrowed(octets) => octets.len(),
            Source::Shared(_, length) => *length,
        }
    }

    /// Returns whether the segment has no data.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the number of octets of the data, and of the octets that follow in the memory.
    pub(crate) fn memory_length(&self) -> usize {
        match &self.0 {
            Source::Borrowed(octets) => octets.len(),
            Source::Shared(memory, _) => memory.len(),
        }
    }

    /// Goes on to the next `length` octets in the memory.
    pub(crate) fn advance(&mut self, length: usize) {
        if let Source::Shared(memory, shown) = &mut self.0 {
            memory.advance(*shown);
            *shown = length;
        }
    }
}

impl Default for Payload<'_> {
    fn default() -> Self {
        Self(Source::Borrowed(&[]))
    }
}

impl Deref for Payload<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match &self.0 {
            Source::Borrowed(octets) => octets,
            Source::Shared(memory, length) => &memory[..*length],
        }
    }
}

impl PartialEq for Payload<'_> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl Eq for Payload<'_> {}

impl fmt::Debug for Payload<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl<'a> From<&'a [u8]> for Payload<'a> {
    fn from(octets: &'a [u8]) -> Self {
        Self(Source::Borrowed(octets))
    }
}

impl From<Vec<u8>> for Payload<'_> {
    fn from(octets: Vec<u8>) -> Self {
        Self::from(Bytes::from(octets))
    }
}

impl From<Bytes> for Payload<'_> {
    fn from(octets: Bytes) -> Self {
        let length = octets.len();
        Self::first_of(octets, length)
    }
}

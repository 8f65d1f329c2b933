//! Data of a segment.

use alloc::vec::Vec;
use core::fmt;
use core::ops::Deref;

use bytes::Bytes;

/// Data of a segment: borrowed from the octets of a packet, or shared with the send buffer of the connection that sends the segment. A clone copies no octets.
#[derive(Clone)]
pub struct Payload<'a>(Source<'a>);

#[derive(Clone)]
enum Source<'a> {
    Borrowed(&'a [u8]),
    Shared(Bytes),
}

impl Payload<'_> {
    /// Returns the data. Borrowed data is copied.
    #[must_use]
    pub fn into_owned(self) -> Payload<'static> {
        Payload(Source::Shared(self.into_first(usize::MAX)))
    }

    /// Returns the first `count` octets, or all if there are fewer. Borrowed octets are copied.
    pub(crate) fn into_first(self, count: usize) -> Bytes {
        match self.0 {
            Source::Borrowed(octets) => Bytes::copy_from_slice(&octets[..count.min(octets.len())]),
            Source::Shared(mut octets) => {
                octets.truncate(count);
                octets
            }
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
            Source::Shared(octets) => octets,
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
        Self(Source::Shared(octets.into()))
    }
}

impl From<Bytes> for Payload<'_> {
    fn from(octets: Bytes) -> Self {
        Self(Source::Shared(octets))
    }
}

//! Kinds of samples: the data that a sample carries beside position and velocity, and its length in a datagram of [`crate::wire`].

/// Length of a datagram before the numbers of the axes \[byte\].
pub(crate) const HEADER_LEN: usize = 48;
const ATTITUDE_LEN: usize = 56;

/// Data of a sample beyond position and velocity.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum SampleKind {
    /// No more data: version 1.
    #[default]
    State,
    /// Attitude of the body, equal for all receivers: version 1.
    Attitude,
    /// An energy per axis \[J\], equal for all receivers, that never falls. A lower energy marks a restart of the sender.
    Energy,
    /// A wave per axis [√W] for one receiver.
    Wave,
    /// A force per axis \[N\] for one receiver.
    Force,
    /// For a server, the displacement per axis since the sample before \[m\], to be added once; for a client, a force per axis \[N\].
    Increment,
}

impl SampleKind {
    /// Returns the version of the wire format for samples of this kind.
    #[must_use]
    pub(crate) const fn version(self) -> u16 {
        match self {
            Self::State | Self::Attitude => 1,
            Self::Energy | Self::Wave | Self::Force | Self::Increment => 2,
        }
    }

    /// Returns whether each receiver gets a sample of its own.
    #[must_use]
    pub const fn is_personal(self) -> bool {
        matches!(self, Self::Wave | Self::Force | Self::Increment)
    }

    /// Returns the length of a datagram with `axes` axes \[byte\].
    #[must_use]
    pub const fn datagram_len(self, axes: usize) -> usize {
        self.attitude_start(axes) + if matches!(self, Self::Attitude) { ATTITUDE_LEN } else { 0 }
    }

    /// Returns the offset of the attitude in a datagram \[byte\].
    pub(crate) const fn attitude_start(self, axes: usize) -> usize {
        HEADER_LEN + self.axis_len() * axes
    }

    /// Returns the length of the numbers of one axis \[byte\].
    pub(crate) const fn axis_len(self) -> usize {
        if self.version() == 1 { 16 } else { 24 }
    }

    /// Returns byte 7 of the header.
    pub(crate) const fn code(self) -> u8 {
        match self {
            Self::State => 0,
            Self::Attitude | Self::Energy => 1,
            Self::Wave => 2,
            Self::Force => 3,
            Self::Increment => 4,
        }
    }
}

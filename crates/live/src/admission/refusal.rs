//! Why a datagram was not let in, and how often what happened.

use core::fmt;

use cohaptic_peer::wire::DecodeError;

use crate::handshake::HandshakeError;

/// Why the session did not let a datagram in. Nothing but a counter has changed.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Refusal {
    /// Shorter than the header of a sample.
    TooShort,
    /// Longer than [`MAX_DATAGRAM`](crate::MAX_DATAGRAM).
    Oversized,
    /// Neither a sample nor a hello.
    Magic,
    /// Of another version.
    Version,
    /// With another number of axes.
    Axes,
    /// With an attitude where the object does not turn, or without one where it does.
    Motion,
    /// Of a length that does not fit what it is.
    Length,
    /// A byte that must be zero is not.
    Reserved,
    /// A position or a velocity is infinite or not a number.
    NotFinite,
    /// The quaternion of its attitude does not have the norm 1.
    NotUnit,
    /// A position or a velocity is beyond the [`Limits`](super::Limits) of the session.
    OutOfRange,
    /// The number of the sample is 2⁴⁰ or more.
    SequenceRange,
    /// Of another session.
    ForeignSession,
    /// From a place that is no seat of the session.
    UnknownSeat,
    /// For a seat whose holder is another program that was heard lately.
    SeatTaken,
    /// A hello, or a sealed sample, in a session without a key.
    Keyless,
    /// A sample without a seal, in a session with a key.
    Unsealed,
    /// Its tag is wrong: made with another key, for another joining or another address, the other way round, or changed.
    Forged,
    /// As [`Refusal::Forged`], for a seat that nobody has taken yet.
    NotJoined,
    /// Its number was let in before, or is too old to tell.
    Replayed,
    /// The seat was taken 2²⁴ times: its numbers are used up.
    JoiningsUsedUp,
}

impl Refusal {
    /// Every cause, in the order of its counters.
    pub const ALL: [Self; 21] = [
        Self::TooShort,
        Self::Oversized,
        Self::Magic,
        Self::Version,
        Self::Axes,
        Self::Motion,
        Self::Length,
        Self::Reserved,
        Self::NotFinite,
        Self::NotUnit,
        Self::OutOfRange,
        Self::SequenceRange,
        Self::ForeignSession,
        Self::UnknownSeat,
        Self::SeatTaken,
        Self::Keyless,
        Self::Unsealed,
        Self::Forged,
        Self::NotJoined,
        Self::Replayed,
        Self::JoiningsUsedUp,
    ];

    /// Its name in documents and tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::TooShort => "too-short",
            Self::Oversized => "oversized",
            Self::Magic => "magic",
            Self::Version => "version",
            Self::Axes => "axes",
            Self::Motion => "motion",
            Self::Length => "length",
            Self::Reserved => "reserved",
            Self::NotFinite => "not-finite",
            Self::NotUnit => "not-unit",
            Self::OutOfRange => "out-of-range",
            Self::SequenceRange => "sequence-range",
            Self::ForeignSession => "foreign-session",
            Self::UnknownSeat => "unknown-seat",
            Self::SeatTaken => "seat-taken",
            Self::Keyless => "keyless",
            Self::Unsealed => "unsealed",
            Self::Forged => "forged",
            Self::NotJoined => "not-joined",
            Self::Replayed => "replayed",
            Self::JoiningsUsedUp => "joinings-used-up",
        }
    }

    pub(super) const fn of_sample(error: DecodeError) -> Self {
        match error {
            DecodeError::TooShort { .. } => Self::TooShort,
            DecodeError::Magic => Self::Magic,
            DecodeError::Version { .. } | DecodeError::Kind { .. } => Self::Version,
            DecodeError::Axes { .. } => Self::Axes,
            DecodeError::Motion { .. } => Self::Motion,
            DecodeError::Length { .. } => Self::Length,
            DecodeError::NotFinite { .. } => Self::NotFinite,
            DecodeError::NotUnit => Self::NotUnit,
            // What a later version of the decoder may find wrong is a byte that this one does not know.
            DecodeError::Reserved => Self::Reserved,
        }
    }

    pub(super) const fn of_hello(error: HandshakeError) -> Self {
        match error {
            HandshakeError::Magic => Self::Magic,
            HandshakeError::Version { .. } => Self::Version,
            HandshakeError::Length { .. } => Self::Length,
            HandshakeError::Reserved => Self::Reserved,
            HandshakeError::Forged => Self::Forged,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The counts of the admission. Every datagram that was handed in is admitted, welcomed or refused: the three add up to [`AdmissionStats::handled`].
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct AdmissionStats {
    /// Datagrams that were handed in.
    pub handled: u64,
    /// Samples that were let in.
    pub admitted: u64,
    /// Hellos that were answered.
    pub welcomed: u64,
    /// How many of the admitted samples took a seat.
    pub joinings: u64,
    /// Samples that were made ready for a peer.
    pub sent: u64,
    /// Samples for seats that nobody has, or that have not been heard lately.
    pub nobody_there: u64,
    refused: [u64; Refusal::ALL.len()],
}

impl AdmissionStats {
    /// How many datagrams were refused for that cause.
    #[must_use]
    pub const fn refused(&self, cause: Refusal) -> u64 {
        self.refused[cause as usize]
    }

    /// How many datagrams were refused.
    #[must_use]
    pub fn refused_in_all(&self) -> u64 {
        self.refused.iter().sum()
    }

    /// Every cause with its count, zeros among them.
    pub fn refusals(&self) -> impl Iterator<Item = (Refusal, u64)> + '_ {
        Refusal::ALL.into_iter().map(|cause| (cause, self.refused(cause)))
    }

    pub(super) const fn count_refused(&mut self, cause: Refusal) {
        self.refused[cause as usize] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_of_causes_is_in_the_order_of_the_counters_and_names_are_unique() {
        for (place, cause) in Refusal::ALL.into_iter().enumerate() {
            assert_eq!(cause as usize, place);
        }
        let mut names = Refusal::ALL.map(Refusal::name);
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
    }
}

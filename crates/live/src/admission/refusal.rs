//! Causes of refusal, and the counts of the admission.

use core::fmt;

use cohaptic_peer::wire::DecodeError;

use crate::handshake::HandshakeError;

/// Cause for which the session refused a datagram. A refused datagram changes nothing but a counter.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[non_exhaustive]
pub enum Refusal {
    /// The datagram is no hello, and shorter than the header of a sample.
    TooShort,
    /// The datagram is longer than [`MAX_DATAGRAM`](crate::MAX_DATAGRAM).
    Oversized,
    /// The datagram is neither a sample nor a hello.
    Magic,
    /// The datagram has another version of the protocol, or the sample is of another kind.
    Version,
    /// The sample has another number of axes than the scene.
    Axes,
    /// The sample has an attitude although the object does not turn, or has no attitude although the object turns.
    Motion,
    /// The length of the datagram does not fit its type.
    Length,
    /// A byte that must be zero is not zero.
    Reserved,
    /// A position or a velocity is infinite or not a number.
    NotFinite,
    /// The quaternion of the attitude does not have the norm 1.
    NotUnit,
    /// A position or a velocity is beyond the [`Limits`](super::Limits) of the session.
    OutOfRange,
    /// The sequence number of the sample is 2⁴⁰ or more.
    SequenceRange,
    /// The datagram belongs to another session.
    ForeignSession,
    /// The place in the datagram is no seat of the session.
    UnknownSeat,
    /// The seat belongs to another program, of which a sample was admitted less than `stale_after` ago.
    SeatTaken,
    /// A hello, or a sealed sample, was sent to a session without a key.
    Keyless,
    /// A sample without a seal was sent to a session with a key.
    Unsealed,
    /// The tag is wrong: made with another key, for another joining, for another address or for the other direction, or the datagram was changed.
    Forged,
    /// The tag is wrong as in [`Refusal::Forged`], and the seat has not been taken yet.
    NotJoined,
    /// The sequence number was admitted before, or is too old to tell.
    Replayed,
    /// The seat was taken 2²⁴ times, so that the numbers of joinings are used up.
    JoiningsUsedUp,
    /// The hello has the right tag and tells another scene than that of the session.
    OtherScene,
}

impl Refusal {
    /// All causes, in the order of their counters.
    pub(crate) const ALL: [Self; 22] = [
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
        Self::OtherScene,
    ];

    /// Returns the name of the cause in documents and tables.
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
            Self::OtherScene => "other-scene",
        }
    }

    /// Returns the cause for an undecodable sample.
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
            // The decoder may check more reserved bytes in a later version. Such a byte is counted here, too.
            DecodeError::Reserved => Self::Reserved,
        }
    }

    /// Returns the cause for an undecodable hello, or for a wrong tag.
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

/// Counts of the admission. Every datagram handed in is admitted, welcomed or refused: these three counts add up to [`AdmissionStats::handled`].
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct AdmissionStats {
    /// Datagrams handed in.
    pub handled: u64,
    /// Samples admitted.
    pub admitted: u64,
    /// Hellos answered.
    pub welcomed: u64,
    /// Admitted samples that took a seat.
    pub joinings: u64,
    /// Samples made ready for a peer outside.
    pub sent: u64,
    /// Samples not sent: the receiver's seat was never taken, the holder of the seat is gone, the receiver has no seat, or the sample is too long.
    pub nobody_there: u64,
    /// Refused datagrams, indexed by cause: `Refusal as usize`.
    refused: [u64; Refusal::ALL.len()],
}

impl AdmissionStats {
    /// Returns the number of datagrams refused for `cause`.
    #[must_use]
    pub const fn refused(&self, cause: Refusal) -> u64 {
        self.refused[cause as usize]
    }

    /// Returns the number of datagrams refused for any cause.
    #[must_use]
    pub fn refused_in_all(&self) -> u64 {
        self.refused.iter().sum()
    }

    /// Returns every cause with its count, causes that never occurred included.
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

//! Wire format of a sample: one datagram, little-endian. Version 1 has 48 bytes, 16 more for each axis, and 56 more for an attitude. Version 2 has 48 bytes
//! and 24 more for each axis.
//!
//! ```text
//! offset  size  field
//!      0     4  "CHPT"
//!      4     2  version, 1 or 2
//!      6     1  axes, 1 to 3
//!      7     1  version 1: 1 with an attitude, 0 without; version 2: the kind of the extra number, 1 energy, 2 wave, 3 force, 4 increment
//!      8     8  session: only peers of one session understand each other
//!     16     4  sender: the place of the peer in the session
//!     20     4  kinds 2 to 4: place of the receiver in the session; otherwise zero
//!     24     8  sequence number of the sample, from 0
//!     32     8  send time \[ns\] on the sender's clock
//!     40     8  zero
//!     48 16/24  position \[m\], velocity [m/s] and, in version 2, the extra number on the first axis, then on the others
//!     96    56  with an attitude: the unit quaternion w, x, y, z and the angular velocity about the three body axes [rad/s]
//! ```
//!
//! The sequence number alone decides which sample is the newest. The send time is for laws that need the age of a sample, and for records and measurements.
//! The coordination strategy of a session decides version and kind; samples of other versions and kinds are refused.
//!
//! Decoding accepts only datagrams in which every byte has a meaning: a decoded datagram encodes to the same bytes again.

use cohaptic_units::Instant;

use crate::State;
use crate::rotation::Attitude;
use crate::sample_kind::HEADER_LEN;

pub use crate::sample_kind::SampleKind;

/// First four bytes of a datagram.
pub const MAGIC: [u8; 4] = *b"CHPT";
/// Length of the largest datagram, with three axes and an attitude \[byte\].
pub const MAX_LEN: usize = SampleKind::Attitude.datagram_len(3);

/// Data of a sample beyond position and velocity.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Extra<const A: usize> {
    /// Place of the receiver, for a personal kind; 0 for other kinds.
    pub receiver: u32,
    /// Extra number on each axis; zeros in version 1.
    pub numbers: [f64; A],
    /// Attitude of the copy, for [`SampleKind::Attitude`].
    pub attitude: Attitude,
}

impl<const A: usize> Extra<A> {
    /// Extra data of a sample of kind [`SampleKind::State`].
    pub const NONE: Self = Self { receiver: 0, numbers: [0.0; A], attitude: Attitude::REST };

    /// Returns the extra data of a sample with that attitude.
    #[must_use]
    pub const fn turned(attitude: Attitude) -> Self {
        Self { attitude, ..Self::NONE }
    }
}

/// State of a peer's copy of the object, as sent to other peers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sample<const A: usize> {
    /// Number of the session.
    pub session: u64,
    /// Place of the sender in the session.
    pub sender: u32,
    /// Number of the sample, counted by the sender from 0.
    pub sequence: u64,
    /// Send time on the sender's clock.
    pub sent: Instant,
    /// State of the sender's copy of the object; of its device, if the sender is a client.
    pub state: State<A>,
}

/// Reason why a datagram is no sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum DecodeError {
    /// The datagram is shorter than a header.
    #[error("{len} bytes are too short for a sample")]
    TooShort {
        /// Length of the datagram \[byte\].
        len: usize,
    },
    /// The datagram does not begin with [`MAGIC`].
    #[error("not a sample")]
    Magic,
    /// The sample has another version.
    #[error("version {found} of the wire format; expected {expected}")]
    Version {
        /// Version of the sample.
        found: u16,
        /// Version of this session.
        expected: u16,
    },
    /// The extra numbers have another kind.
    #[error("extra numbers of kind {found}; expected {expected}")]
    Kind {
        /// Kind of the sample.
        found: u8,
        /// Kind of this session.
        expected: u8,
    },
    /// The sample has another number of axes.
    #[error("a sample with {found} axes; expected {expected}")]
    Axes {
        /// Number of axes in the sample.
        found: u8,
        /// Number of axes in this session.
        expected: usize,
    },
    /// An attitude is missing or unexpected.
    #[error("motion {found} in byte 7; expected {expected} (0 moves, 1 moves and turns)")]
    Motion {
        /// Byte 7 of the sample.
        found: u8,
        /// Byte 7 in this session.
        expected: u8,
    },
    /// The length of the datagram does not fit its number of axes.
    #[error("{found} bytes; expected {expected}")]
    Length {
        /// Length of the datagram \[byte\].
        found: usize,
        /// Length that fits \[byte\].
        expected: usize,
    },
    /// A reserved byte is not zero.
    #[error("a reserved byte is not zero")]
    Reserved,
    /// A number is infinite or NaN.
    #[error("the {quantity} on axis {axis} is not finite")]
    NotFinite {
        /// Axis from 0; for a quaternion the component, w first.
        axis: usize,
        /// Name of the quantity: position, velocity, extra number, quaternion or angular velocity.
        quantity: &'static str,
    },
    /// The quaternion of the attitude does not have the norm 1.
    #[error("the quaternion of the attitude does not have the norm 1")]
    NotUnit,
}

impl<const A: usize> Sample<A> {
    /// Like [`Sample::encode_as`], for [`SampleKind::State`].
    ///
    /// # Panics
    ///
    /// If `axes` is more than A or than 3.
    #[inline]
    pub fn encode(&self, axes: usize, datagram: &mut [u8; MAX_LEN]) -> usize {
        self.encode_as(SampleKind::State, &Extra::NONE, axes, datagram)
    }

    /// Writes the first `axes` axes and returns the length of the datagram \[byte\]. A peer that simulates more axes than its scene has leaves out the axes
    /// that are always zero.
    ///
    /// # Panics
    ///
    /// If `axes` is more than A or than 3.
    #[inline]
    pub fn encode_as(&self, kind: SampleKind, extra: &Extra<A>, axes: usize, datagram: &mut [u8; MAX_LEN]) -> usize {
        // Zeros first: reserved bytes must be zero.
        let mut header = [0; HEADER_LEN];
        header[0..4].copy_from_slice(&MAGIC);
        header[4..6].copy_from_slice(&kind.version().to_le_bytes());
        header[6] = u8::try_from(axes).expect("there are at most three axes");
        header[7] = kind.code();
        header[8..16].copy_from_slice(&self.session.to_le_bytes());
        header[16..20].copy_from_slice(&self.sender.to_le_bytes());
        header[20..24].copy_from_slice(&extra.receiver.to_le_bytes());
        header[24..32].copy_from_slice(&self.sequence.to_le_bytes());
        header[32..40].copy_from_slice(&self.sent.as_nanos().to_le_bytes());
        datagram[..HEADER_LEN].copy_from_slice(&header);
        let (state, axis_len) = (&self.state, kind.axis_len());
        for axis in 0..axes {
            // Version 1 has 16 bytes per axis, so `zip` drops the third number.
            // NaN and infinities are not checked here: a receiver refuses them.
            let numbers = [state.position[axis], state.velocity[axis], extra.numbers[axis]];
            let start = HEADER_LEN + axis_len * axis;
            for (bytes, number) in datagram[start..start + axis_len].chunks_exact_mut(8).zip(numbers) {
                bytes.copy_from_slice(&number.to_le_bytes());
            }
        }
        if kind == SampleKind::Attitude {
            let numbers = extra.attitude.orientation.iter().chain(&extra.attitude.rate);
            for (bytes, number) in datagram[kind.attitude_start(axes)..].chunks_exact_mut(8).zip(numbers) {
                bytes.copy_from_slice(&number.to_le_bytes());
            }
        }
        kind.datagram_len(axes)
    }

    /// Like [`Sample::decode_as`], for [`SampleKind::State`].
    ///
    /// # Errors
    ///
    /// [`DecodeError`] for any datagram except a sample of [`SampleKind::State`] with `axes` axes and finite numbers. Never panics.
    #[inline]
    pub fn decode(datagram: &[u8], axes: usize) -> Result<Self, DecodeError> {
        Self::decode_as(datagram, SampleKind::State, axes).map(|(sample, _)| sample)
    }

    /// Reads a sample of kind `kind` with `axes` axes, at most A. Further axes of the result are zero.
    ///
    /// # Errors
    ///
    /// [`DecodeError`] for any datagram except a sample of this kind with this number of axes, finite numbers and, in an attitude, a quaternion of norm 1.
    /// Never panics.
    #[inline]
    pub fn decode_as(datagram: &[u8], kind: SampleKind, axes: usize) -> Result<(Self, Extra<A>), DecodeError> {
        let Some((header, body)) = datagram.split_first_chunk::<HEADER_LEN>() else {
            return Err(DecodeError::TooShort { len: datagram.len() });
        };
        check_header(header, datagram.len(), kind, axes)?;
        let (mut state, mut extra) = (State::REST, [0.0; A]);
        let finite = |numbers: &[u8], start: usize, axis: usize, quantity: &'static str| {
            let number = f64::from_bits(word(numbers, start));
            if number.is_finite() { Ok(number) } else { Err(DecodeError::NotFinite { axis, quantity }) }
        };
        // The length is checked, so the body has whole axes; `take` keeps the attitude behind the last axis out.
        for (axis, numbers) in body.chunks_exact(kind.axis_len()).enumerate().take(A.min(axes)) {
            state.position[axis] = finite(numbers, 0, axis, "position")?;
            state.velocity[axis] = finite(numbers, 8, axis, "velocity")?;
            if kind.version() > 1 {
                extra[axis] = finite(numbers, 16, axis, "extra number")?;
            }
        }
        let sample = Self {
            session: word(header, 8),
            sender: half_word(header, 16),
            sequence: word(header, 24),
            sent: Instant::from_nanos(word(header, 32)),
            state,
        };
        let attitude = if kind == SampleKind::Attitude { decode_attitude(&datagram[kind.attitude_start(axes)..])? } else { Attitude::REST };
        Ok((sample, Extra { receiver: half_word(header, 20), numbers: extra, attitude }))
    }
}

/// Reads an attitude from its 56 bytes.
fn decode_attitude(bytes: &[u8]) -> Result<Attitude, DecodeError> {
    let numbers: [f64; 7] = core::array::from_fn(|number| f64::from_bits(word(bytes, 8 * number)));
    // Finite numbers before the norm: the norm of a NaN would hide which number is wrong.
    if let Some(place) = numbers.iter().position(|number| !number.is_finite()) {
        let (axis, quantity) = if place < 4 { (place, "quaternion") } else { (place - 4, "angular velocity") };
        return Err(DecodeError::NotFinite { axis, quantity });
    }
    let [w, x, y, z, rate @ ..] = numbers;
    let attitude = Attitude { orientation: [w, x, y, z], rate };
    if attitude.is_unit() { Ok(attitude) } else { Err(DecodeError::NotUnit) }
}

/// Checks the header against kind, number of axes and length. The order of the checks decides which error a datagram with several faults has.
#[inline]
fn check_header(header: &[u8; HEADER_LEN], len: usize, kind: SampleKind, axes: usize) -> Result<(), DecodeError> {
    // Magic and version first: the meaning of all further bytes depends on both.
    if header[0..4] != MAGIC {
        return Err(DecodeError::Magic);
    }
    let version = u16::from_le_bytes([header[4], header[5]]);
    if version != kind.version() {
        return Err(DecodeError::Version { found: version, expected: kind.version() });
    }
    if usize::from(header[6]) != axes {
        return Err(DecodeError::Axes { found: header[6], expected: axes });
    }
    if header[7] != kind.code() {
        let (found, expected) = (header[7], kind.code());
        return Err(if kind.version() == 1 { DecodeError::Motion { found, expected } } else { DecodeError::Kind { found, expected } });
    }
    if len != kind.datagram_len(axes) {
        return Err(DecodeError::Length { found: len, expected: kind.datagram_len(axes) });
    }
    if (!kind.is_personal() && header[20..24] != [0; 4]) || word(header, 40) != 0 {
        return Err(DecodeError::Reserved);
    }
    Ok(())
}

/// Returns the little-endian number of 8 bytes at `start`.
#[inline]
fn word(bytes: &[u8], start: usize) -> u64 {
    let mut word = [0; 8];
    word.copy_from_slice(&bytes[start..start + 8]);
    u64::from_le_bytes(word)
}

/// Returns the little-endian number of 4 bytes at `start`.
#[inline]
fn half_word(bytes: &[u8], start: usize) -> u32 {
    let mut word = [0; 4];
    word.copy_from_slice(&bytes[start..start + 4]);
    u32::from_le_bytes(word)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Sample<1> {
        let state = State { position: [0.025], velocity: [-1.5] };
        Sample { session: 7, sender: 2, sequence: 875, sent: Instant::from_nanos(7_000_000_000), state }
    }

    fn datagram() -> [u8; MAX_LEN] {
        let mut datagram = [0; MAX_LEN];
        assert_eq!(sample().encode(1, &mut datagram), 64);
        datagram
    }

    #[test]
    fn a_sample_of_one_axis_is_64_bytes_and_reads_back() {
        assert_eq!(SampleKind::State.datagram_len(1), 64);
        assert_eq!(Sample::decode(&datagram()[..64], 1), Ok(sample()));
    }

    #[test]
    fn the_bytes_are_where_the_table_says() {
        let bytes = datagram();
        assert_eq!(bytes[..8], *b"CHPT\x01\x00\x01\x00");
        assert_eq!(bytes[24..32], 875_u64.to_le_bytes());
        assert_eq!(bytes[48..56], 0.025_f64.to_le_bytes());
        assert_eq!(bytes[56..64], (-1.5_f64).to_le_bytes());
    }

    #[test]
    fn each_fault_has_its_own_error() {
        let decode = |edit: &dyn Fn(&mut [u8; MAX_LEN]), len: usize| {
            let mut bytes = datagram();
            edit(&mut bytes);
            Sample::<1>::decode(&bytes[..len], 1).unwrap_err()
        };
        // Each edit makes one fault in a valid datagram of 64 bytes.
        assert_eq!(decode(&|_| (), 47), DecodeError::TooShort { len: 47 });
        assert_eq!(decode(&|_| (), 63), DecodeError::Length { found: 63, expected: 64 });
        assert_eq!(decode(&|_| (), 65), DecodeError::Length { found: 65, expected: 64 });
        assert_eq!(decode(&|b| b[0] = b'X', 64), DecodeError::Magic);
        assert_eq!(decode(&|b| b[4] = 2, 64), DecodeError::Version { found: 2, expected: 1 });
        assert_eq!(decode(&|b| b[6] = 3, 64), DecodeError::Axes { found: 3, expected: 1 });
        assert_eq!(decode(&|b| b[45] = 1, 64), DecodeError::Reserved);
        // Bytes 48 to 55 are the position, bytes 56 to 63 the velocity.
        let put = |at: usize, value: f64| move |b: &mut [u8; MAX_LEN]| b[at..at + 8].copy_from_slice(&value.to_le_bytes());
        assert_eq!(decode(&put(48, f64::NAN), 64), DecodeError::NotFinite { axis: 0, quantity: "position" });
        assert_eq!(decode(&put(56, f64::INFINITY), 64), DecodeError::NotFinite { axis: 0, quantity: "velocity" });
        assert_eq!(decode(&put(56, f64::NEG_INFINITY), 64), DecodeError::NotFinite { axis: 0, quantity: "velocity" });
    }

    #[test]
    fn a_peer_that_simulates_three_axes_speaks_of_one() {
        let state = State { position: [0.025, 0.0, 0.0], velocity: [-1.5, 0.0, 0.0] };
        let Sample { session, sender, sequence, sent, .. } = sample();
        // The wide sample has zeros on the axes that the wire format leaves out.
        let wide = Sample::<3> { session, sender, sequence, sent, state };
        let mut bytes = [0; MAX_LEN];
        assert_eq!(wide.encode(1, &mut bytes), 64);
        assert_eq!(bytes, datagram());
        assert_eq!(Sample::<3>::decode(&bytes[..64], 1), Ok(wide));
    }

    #[test]
    fn version_2_has_an_extra_number_on_each_axis_and_a_receiver() {
        let extra = Extra { receiver: 3, numbers: [0.125], ..Extra::NONE };
        let mut bytes = [0; MAX_LEN];
        assert_eq!(sample().encode_as(SampleKind::Wave, &extra, 1, &mut bytes), 72);
        assert_eq!(bytes[..8], *b"CHPT\x02\x00\x01\x02");
        assert_eq!((bytes[20], &bytes[64..72]), (3, &0.125_f64.to_le_bytes()[..]));
        let decode = |kind, bytes: &[u8]| Sample::<1>::decode_as(bytes, kind, 1);
        assert_eq!(decode(SampleKind::Wave, &bytes[..72]), Ok((sample(), extra)));
        assert_eq!(decode(SampleKind::Force, &bytes[..72]), Err(DecodeError::Kind { found: 2, expected: 3 }));
        assert_eq!(decode(SampleKind::State, &bytes[..72]), Err(DecodeError::Version { found: 2, expected: 1 }));
        assert_eq!(decode(SampleKind::Energy, &datagram()[..64]), Err(DecodeError::Version { found: 1, expected: 2 }));
        sample().encode_as(SampleKind::Energy, &Extra { receiver: 1, ..extra }, 1, &mut bytes);
        assert_eq!(decode(SampleKind::Energy, &bytes[..72]), Err(DecodeError::Reserved), "an energy is for all");
        sample().encode_as(SampleKind::Force, &Extra { receiver: 1, numbers: [f64::NAN], ..Extra::NONE }, 1, &mut bytes);
        assert_eq!(decode(SampleKind::Force, &bytes[..72]), Err(DecodeError::NotFinite { axis: 0, quantity: "extra number" }));
    }
}

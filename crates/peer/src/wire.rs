//! The wire format of a sample: one datagram, little-endian, 48 bytes and 16 for each axis.
//!
//! ```text
//! offset  size  field
//!      0     4  "CHPT"
//!      4     2  version, 1
//!      6     1  axes, 1 to 3
//!      7     1  zero
//!      8     8  session: only peers of one session understand each other
//!     16     4  sender: the place of the peer in the session
//!     20     4  zero
//!     24     8  sequence number of the sample, from 0
//!     32     8  send time \[ns\] on the sender's clock
//!     40     8  zero
//!     48    16  position \[m\] and velocity [m/s] on the first axis, then on the others
//! ```
//!
//! Which sample is the newest follows from the sequence number alone. The send time is for laws that need the age of a sample, and for those who record or measure.
//!
//! A datagram is taken only if every byte of it has a meaning: whatever decodes encodes to the same bytes again. The zeros are room for what a
//! later version may send (the energy of a passivity controller, for instance).

use cohaptic_units::Instant;

use crate::State;

/// The first four bytes.
pub const MAGIC: [u8; 4] = *b"CHPT";
/// The version that this module reads and writes.
pub const VERSION: u16 = 1;
/// The length of the largest datagram, with three axes \[byte\].
pub const MAX_LEN: usize = datagram_len(3);

const HEADER_LEN: usize = 48;
const AXIS_LEN: usize = 16;

/// The length of a datagram \[byte\].
#[must_use]
pub const fn datagram_len(axes: usize) -> usize {
    HEADER_LEN + AXIS_LEN * axes
}

/// What a peer tells the others about its copy of the object.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sample<const A: usize> {
    /// The session.
    pub session: u64,
    /// The place of the sender in the session.
    pub sender: u32,
    /// Counts the sender's samples from 0.
    pub sequence: u64,
    /// When it was sent, on the sender's clock.
    pub sent: Instant,
    /// The sender's copy of the object.
    pub state: State<A>,
}

/// Why a datagram is no sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum DecodeError {
    /// It is shorter than a header.
    #[error("{len} bytes are too short for a sample")]
    TooShort {
        /// Its length.
        len: usize,
    },
    /// It does not begin with [`MAGIC`].
    #[error("not a sample")]
    Magic,
    /// It is a sample of another version.
    #[error("version {found} of the wire format; expected {VERSION}")]
    Version {
        /// The version it has.
        found: u16,
    },
    /// It has another number of axes.
    #[error("a sample with {found} axes; expected {expected}")]
    Axes {
        /// The number it has.
        found: u8,
        /// The number of this session.
        expected: usize,
    },
    /// Its length does not fit its number of axes.
    #[error("{found} bytes; expected {expected}")]
    Length {
        /// The length it has.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// A byte that must be zero is not.
    #[error("a reserved byte is not zero")]
    Reserved,
    /// A position or a velocity is infinite or not a number.
    #[error("the {quantity} on axis {axis} is not finite")]
    NotFinite {
        /// Which axis, from 0.
        axis: usize,
        /// Position or velocity.
        quantity: &'static str,
    },
}

impl<const A: usize> Sample<A> {
    /// Writes the first `axes` axes and gives the length. A peer that simulates more axes than its scene has leaves out those that are always zero.
    ///
    /// # Panics
    ///
    /// If `axes` is more than A or than 3.
    #[inline]
    pub fn encode(&self, axes: usize, datagram: &mut [u8; MAX_LEN]) -> usize {
        let mut header = [0; HEADER_LEN];
        header[0..4].copy_from_slice(&MAGIC);
        header[4..6].copy_from_slice(&VERSION.to_le_bytes());
        header[6] = u8::try_from(axes).expect("there are at most three axes");
        header[8..16].copy_from_slice(&self.session.to_le_bytes());
        header[16..20].copy_from_slice(&self.sender.to_le_bytes());
        header[24..32].copy_from_slice(&self.sequence.to_le_bytes());
        header[32..40].copy_from_slice(&self.sent.as_nanos().to_le_bytes());
        datagram[..HEADER_LEN].copy_from_slice(&header);
        for axis in 0..axes {
            let start = HEADER_LEN + AXIS_LEN * axis;
            datagram[start..start + 8].copy_from_slice(&self.state.position[axis].to_le_bytes());
            datagram[start + 8..start + 16].copy_from_slice(&self.state.velocity[axis].to_le_bytes());
        }
        datagram_len(axes)
    }

    /// Reads a sample of `axes` axes, at most A; the other axes are zero.
    ///
    /// # Errors
    ///
    /// [`DecodeError`] for anything but a sample of this version with this number of axes and finite numbers. Never panics.
    #[inline]
    pub fn decode(datagram: &[u8], axes: usize) -> Result<Self, DecodeError> {
        let Some((header, body)) = datagram.split_first_chunk::<HEADER_LEN>() else {
            return Err(DecodeError::TooShort { len: datagram.len() });
        };
        check_header(header, datagram.len(), axes)?;
        let mut state = State::REST;
        for (axis, numbers) in body.chunks_exact(AXIS_LEN).enumerate().take(A) {
            let position = f64::from_bits(word(numbers, 0));
            let velocity = f64::from_bits(word(numbers, 8));
            if !position.is_finite() {
                return Err(DecodeError::NotFinite { axis, quantity: "position" });
            }
            if !velocity.is_finite() {
                return Err(DecodeError::NotFinite { axis, quantity: "velocity" });
            }
            state.position[axis] = position;
            state.velocity[axis] = velocity;
        }
        Ok(Self {
            session: word(header, 8),
            sender: u32::from_le_bytes([header[16], header[17], header[18], header[19]]),
            sequence: word(header, 24),
            sent: Instant::from_nanos(word(header, 32)),
            state,
        })
    }
}

#[inline]
fn check_header(header: &[u8; HEADER_LEN], len: usize, axes: usize) -> Result<(), DecodeError> {
    if header[0..4] != MAGIC {
        return Err(DecodeError::Magic);
    }
    let version = u16::from_le_bytes([header[4], header[5]]);
    if version != VERSION {
        return Err(DecodeError::Version { found: version });
    }
    if usize::from(header[6]) != axes {
        return Err(DecodeError::Axes { found: header[6], expected: axes });
    }
    if len != datagram_len(axes) {
        return Err(DecodeError::Length { found: len, expected: datagram_len(axes) });
    }
    if header[7] != 0 || header[20..24] != [0; 4] || word(header, 40) != 0 {
        return Err(DecodeError::Reserved);
    }
    Ok(())
}

#[inline]
fn word(bytes: &[u8], start: usize) -> u64 {
    let mut word = [0; 8];
    word.copy_from_slice(&bytes[start..start + 8]);
    u64::from_le_bytes(word)
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
        assert_eq!(datagram_len(1), 64);
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
        assert_eq!(decode(&|_| (), 47), DecodeError::TooShort { len: 47 });
        assert_eq!(decode(&|_| (), 63), DecodeError::Length { found: 63, expected: 64 });
        assert_eq!(decode(&|_| (), 65), DecodeError::Length { found: 65, expected: 64 });
        assert_eq!(decode(&|b| b[0] = b'X', 64), DecodeError::Magic);
        assert_eq!(decode(&|b| b[4] = 2, 64), DecodeError::Version { found: 2 });
        assert_eq!(decode(&|b| b[6] = 3, 64), DecodeError::Axes { found: 3, expected: 1 });
        assert_eq!(decode(&|b| b[45] = 1, 64), DecodeError::Reserved);
        let put = |at: usize, value: f64| move |b: &mut [u8; MAX_LEN]| b[at..at + 8].copy_from_slice(&value.to_le_bytes());
        assert_eq!(decode(&put(48, f64::NAN), 64), DecodeError::NotFinite { axis: 0, quantity: "position" });
        assert_eq!(decode(&put(56, f64::INFINITY), 64), DecodeError::NotFinite { axis: 0, quantity: "velocity" });
        assert_eq!(decode(&put(56, f64::NEG_INFINITY), 64), DecodeError::NotFinite { axis: 0, quantity: "velocity" });
    }

    #[test]
    fn a_peer_that_simulates_three_axes_speaks_of_one() {
        let state = State { position: [0.025, 0.0, 0.0], velocity: [-1.5, 0.0, 0.0] };
        let Sample { session, sender, sequence, sent, .. } = sample();
        let wide = Sample::<3> { session, sender, sequence, sent, state };
        let mut bytes = [0; MAX_LEN];
        assert_eq!(wide.encode(1, &mut bytes), 64);
        assert_eq!(bytes, datagram());
        assert_eq!(Sample::<3>::decode(&bytes[..64], 1), Ok(wide));
    }
}

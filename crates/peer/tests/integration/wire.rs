//! The wire format against random bytes, random edits, and a second reading of the table in its module doc.

use cohaptic_peer::State;
use cohaptic_peer::wire::{DecodeError, MAX_LEN, Sample, datagram_len};
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::num::f64::{INFINITE, NEGATIVE, NORMAL, POSITIVE, QUIET_NAN, SUBNORMAL, ZERO};
use proptest::prelude::*;
use proptest::sample::{Index, select};

proptest! {
    #![proptest_config(crate::cases(4000))]

    #[test]
    fn whatever_decodes_encodes_to_the_same_bytes_again(bytes in datagram_like(), axes in 1..=3_usize) {
        judge(&bytes, axes)?;
    }

    #[test]
    fn random_bytes_are_never_a_panic(bytes in vec(any::<u8>(), 0..200), axes in 1..=3_usize) {
        judge(&bytes, axes)?;
    }

    /// Denormals and −0 included.
    #[test]
    fn every_finite_sample_reads_back_to_the_bit(sample in sample(), axes in 1..=3_usize) {
        let mut bytes = [0xAA; MAX_LEN];
        let len = sample.encode(axes, &mut bytes);
        prop_assert_eq!(len, 48 + 16 * axes);
        prop_assert!(bytes[len..].iter().all(|byte| *byte == 0xAA), "encode writes no further than it says");
        let read = Sample::<3>::decode(&bytes[..len], axes).unwrap();
        let header = |sample: &Sample<3>| (sample.session, sample.sender, sample.sequence, sample.sent);
        prop_assert_eq!(header(&read), header(&sample));
        for axis in 0..3 {
            let expected = if axis < axes { (sample.state.position[axis], sample.state.velocity[axis]) } else { (0.0, 0.0) };
            let actual = (read.state.position[axis], read.state.velocity[axis]);
            prop_assert_eq!((actual.0.to_bits(), actual.1.to_bits()), (expected.0.to_bits(), expected.1.to_bits()));
        }
    }
}

/// Decodes and compares with what the table says of these bytes.
fn judge(bytes: &[u8], axes: usize) -> Result<(), TestCaseError> {
    let decoded = Sample::<3>::decode(bytes, axes);
    match expected_error(bytes, axes) {
        Some(error) => prop_assert_eq!(decoded, Err(error)),
        None => {
            let mut again = [0; MAX_LEN];
            let len = decoded.expect("the table allows it").encode(axes, &mut again);
            prop_assert_eq!(&again[..len], bytes);
        }
    }
    Ok(())
}

/// The first fault, in the order in which a reader can know of it: too short to say, not ours, of another version, of other axes, of another length,
/// with a byte that has no meaning, with a number that is none.
fn expected_error(bytes: &[u8], axes: usize) -> Option<DecodeError> {
    let number = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    if bytes.len() < 48 {
        return Some(DecodeError::TooShort { len: bytes.len() });
    }
    let version = u16::from_le_bytes([bytes[4], bytes[5]]);
    if !bytes.starts_with(b"CHPT") {
        Some(DecodeError::Magic)
    } else if version != 1 {
        Some(DecodeError::Version { found: version })
    } else if usize::from(bytes[6]) != axes {
        Some(DecodeError::Axes { found: bytes[6], expected: axes })
    } else if bytes.len() != datagram_len(axes) {
        Some(DecodeError::Length { found: bytes.len(), expected: datagram_len(axes) })
    } else if [7, 20, 21, 22, 23].into_iter().chain(40..48).any(|at| bytes[at] != 0) {
        Some(DecodeError::Reserved)
    } else {
        let numbers = (0..axes).flat_map(|axis| [(axis, "position", 48 + 16 * axis), (axis, "velocity", 56 + 16 * axis)]);
        numbers.into_iter().find(|(_, _, at)| !number(*at).is_finite()).map(|(axis, quantity, _)| DecodeError::NotFinite { axis, quantity })
    }
}

/// A valid datagram with up to three edits: a byte changed, a number put in, a byte cut off or added.
fn datagram_like() -> impl Strategy<Value = Vec<u8>> {
    #[derive(Clone, Debug)]
    enum Edit {
        Byte(Index, u8),
        Number(usize, f64),
        Shorten(usize),
        Append(u8),
    }
    let any_number = POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO | INFINITE | QUIET_NAN;
    let edit = prop_oneof![
        (any::<Index>(), any::<u8>()).prop_map(|(at, byte)| Edit::Byte(at, byte)),
        (select(&[48_usize, 56, 64, 72, 80, 88][..]), any_number).prop_map(|(at, number)| Edit::Number(at, number)),
        (1..60_usize).prop_map(Edit::Shorten),
        any::<u8>().prop_map(Edit::Append),
    ];
    (sample(), 1..=3_usize, vec(edit, 0..=3)).prop_map(|(sample, axes, edits)| {
        let mut buffer = [0; MAX_LEN];
        let len = sample.encode(axes, &mut buffer);
        let mut bytes = buffer[..len].to_vec();
        for edit in edits {
            match edit {
                Edit::Byte(at, byte) if !bytes.is_empty() => {
                    let at = at.index(bytes.len());
                    bytes[at] = byte;
                }
                Edit::Number(at, number) if bytes.len() >= at + 8 => bytes[at..at + 8].copy_from_slice(&number.to_le_bytes()),
                Edit::Shorten(by) => bytes.truncate(bytes.len().saturating_sub(by)),
                Edit::Append(byte) => bytes.push(byte),
                Edit::Byte(..) | Edit::Number(..) => {}
            }
        }
        bytes
    })
}

fn sample() -> impl Strategy<Value = Sample<3>> {
    let finite = || POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO;
    let place = move || [finite(), finite(), finite()];
    (any::<u64>(), any::<u32>(), any::<u64>(), any::<u64>(), place(), place()).prop_map(|(session, sender, sequence, sent, position, velocity)| {
        Sample { session, sender, sequence, sent: Instant::from_nanos(sent), state: State { position, velocity } }
    })
}

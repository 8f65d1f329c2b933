//! Wire format against random bytes, random edits, and a second implementation of the table in its module documentation.

use cohaptic_peer::State;
use cohaptic_peer::rotation::Attitude;
use cohaptic_peer::wire::{DecodeError, Extra, MAX_LEN, Sample, SampleKind};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::num::f64::{INFINITE, NEGATIVE, NORMAL, POSITIVE, QUIET_NAN, SUBNORMAL, ZERO};
use proptest::prelude::*;
use proptest::sample::{Index, select};

properties! {
    #![proptest_config(crate::cases(4000))]

    #[test]
    fn whatever_decodes_encodes_to_the_same_bytes_again(bytes in datagram_like(), kind in kind(), axes in 1..=3_usize) {
        judge(&bytes, kind, axes)?;
    }

    #[test]
    fn random_bytes_are_never_a_panic(bytes in vec(any::<u8>(), 0..200), kind in kind(), axes in 1..=3_usize) {
        judge(&bytes, kind, axes)?;
    }

    /// Denormal numbers and −0 are included.
    #[test]
    fn every_finite_sample_reads_back_to_the_bit(sample in sample(), kind in kind(), extra in extra(), axes in 1..=3_usize) {
        let mut bytes = [0xAA; MAX_LEN];
        let written = of_kind(kind, extra);
        let len = sample.encode_as(kind, &written, axes, &mut bytes);
        prop_assert_eq!(len, 48 + 8 * row_of(kind).2.len() * axes);
        prop_assert!(bytes[len..].iter().all(|byte| *byte == 0xAA), "encode writes no further than it says");
        let (read, found) = Sample::<3>::decode_as(&bytes[..len], kind, axes).unwrap();
        prop_assert_eq!(found.receiver, written.receiver);
        for axis in 0..3 {
            let expected = if axis < axes { written.numbers[axis] } else { 0.0 };
            prop_assert_eq!(found.numbers[axis].to_bits(), expected.to_bits());
        }
        let header = |sample: &Sample<3>| (sample.session, sample.sender, sample.sequence, sample.sent);
        prop_assert_eq!(header(&read), header(&sample));
        for axis in 0..3 {
            let expected = if axis < axes { (sample.state.position[axis], sample.state.velocity[axis]) } else { (0.0, 0.0) };
            let actual = (read.state.position[axis], read.state.velocity[axis]);
            prop_assert_eq!((actual.0.to_bits(), actual.1.to_bits()), (expected.0.to_bits(), expected.1.to_bits()));
        }
    }

    /// The 56 bytes after the axes are a unit quaternion and the angular velocity, to the bit. Any other content is refused with its own error.
    #[test]
    fn an_attitude_reads_back_to_the_bit(sample in sample(), turn in proptest::array::uniform3(-3.0..3.0_f64), rate in [finite(), finite(), finite()], edits in edits(), cut in 0..3_usize) {
        let mut attitude = Attitude { rate, ..Attitude::REST };
        attitude.turn(turn);
        let mut bytes = [0xAA; MAX_LEN];
        prop_assert_eq!(sample.encode_as(SampleKind::Attitude, &Extra::turned(attitude), 3, &mut bytes), 152);
        prop_assert_eq!(Sample::<3>::decode_as(&bytes[..152], SampleKind::Attitude, 3), Ok((sample, Extra::turned(attitude))));
        prop_assert_eq!(Sample::<3>::decode(&bytes[..152], 3), Err(DecodeError::Motion { found: 1, expected: 0 }));
        let expected = match cut {
            0 => None,
            cut => Some(DecodeError::Length { found: 152 - cut, expected: 152 }),
        };
        for (place, number) in edits {
            bytes[96 + 8 * place..104 + 8 * place].copy_from_slice(&number.to_le_bytes());
        }
        let numbers: Vec<f64> = bytes[96..152].chunks(8).map(|word| f64::from_le_bytes(word.try_into().unwrap())).collect();
        let not_finite = numbers.iter().position(|number| !number.is_finite()).map(|place| match place {
            0..4 => DecodeError::NotFinite { axis: place, quantity: "quaternion" },
            _ => DecodeError::NotFinite { axis: place - 4, quantity: "angular velocity" },
        });
        let norm = numbers[..4].iter().map(|q| q * q).sum::<f64>();
        let not_unit = ((norm - 1.0).abs() > 2.0_f64.powi(-20)).then_some(DecodeError::NotUnit);
        let expected = expected.or(not_finite).or(not_unit);
        prop_assert_eq!(Sample::<3>::decode_as(&bytes[..152 - cut], SampleKind::Attitude, 3).err(), expected);
    }

    #[test]
    fn random_bytes_are_no_attitude_and_never_a_panic(bytes in vec(any::<u8>(), 0..200), axes in 1..=3_usize) {
        if let Ok((sample, extra)) = Sample::<3>::decode_as(&bytes, SampleKind::Attitude, axes) {
            let mut again = [0; MAX_LEN];
            let len = sample.encode_as(SampleKind::Attitude, &extra, axes, &mut again);
            prop_assert_eq!(&again[..len], &bytes[..]);
        }
    }
}

fn finite() -> proptest::num::f64::Any {
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO
}

/// Returns replacements for some of the seven numbers of an attitude.
fn edits() -> impl Strategy<Value = Vec<(usize, f64)>> {
    vec((0..7_usize, finite() | INFINITE | QUIET_NAN), 0..3)
}

/// Decodes, and compares with the result that the table demands for these bytes.
fn judge(bytes: &[u8], kind: SampleKind, axes: usize) -> Result<(), TestCaseError> {
    let decoded = Sample::<3>::decode_as(bytes, kind, axes);
    match expected_error(bytes, kind, axes) {
        Some(error) => prop_assert_eq!(decoded, Err(error)),
        None => {
            let mut again = [0; MAX_LEN];
            let (sample, extra) = decoded.expect("the table allows it");
            let len = sample.encode_as(kind, &extra, axes, &mut again);
            prop_assert_eq!(&again[..len], bytes);
        }
    }
    Ok(())
}

/// Returns the version, byte 7 and the quantities on an axis for a kind, by the table.
fn row_of(kind: SampleKind) -> (u16, u8, &'static [&'static str]) {
    const EXTENDED: &[&str] = &["position", "velocity", "extra number"];
    match kind {
        SampleKind::State => (1, 0, &["position", "velocity"]),
        SampleKind::Attitude => unreachable!("attitudes have tests of their own"),
        SampleKind::Energy => (2, 1, EXTENDED),
        SampleKind::Wave => (2, 2, EXTENDED),
        SampleKind::Force => (2, 3, EXTENDED),
        SampleKind::Increment => (2, 4, EXTENDED),
    }
}

/// Returns the first fault, in the order of the checks: too short, magic, version, axes, kind, length, reserved bytes, numbers that are not finite.
fn expected_error(bytes: &[u8], kind: SampleKind, axes: usize) -> Option<DecodeError> {
    let (expected_version, code, quantities) = row_of(kind);
    let expected_len = 48 + 8 * quantities.len() * axes;
    let number = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    if bytes.len() < 48 {
        return Some(DecodeError::TooShort { len: bytes.len() });
    }
    let version = u16::from_le_bytes([bytes[4], bytes[5]]);
    if !bytes.starts_with(b"CHPT") {
        Some(DecodeError::Magic)
    } else if version != expected_version {
        Some(DecodeError::Version { found: version, expected: expected_version })
    } else if usize::from(bytes[6]) != axes {
        Some(DecodeError::Axes { found: bytes[6], expected: axes })
    } else if bytes[7] != code {
        let (found, expected) = (bytes[7], code);
        Some(if expected_version == 1 { DecodeError::Motion { found, expected } } else { DecodeError::Kind { found, expected } })
    } else if bytes.len() != expected_len {
        Some(DecodeError::Length { found: bytes.len(), expected: expected_len })
    } else if (40..48).chain(20..if code >= 2 { 20 } else { 24 }).any(|at| bytes[at] != 0) {
        Some(DecodeError::Reserved)
    } else {
        let on_axis =
            |axis: usize| quantities.iter().enumerate().map(move |(place, quantity)| (axis, *quantity, 48 + 8 * (quantities.len() * axis + place)));
        (0..axes).flat_map(on_axis).find(|(_, _, at)| !number(*at).is_finite()).map(|(axis, quantity, _)| DecodeError::NotFinite { axis, quantity })
    }
}

/// Returns a valid datagram with up to three edits: a byte changed, a number replaced, bytes cut off, or a byte added.
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
    (sample(), kind(), extra(), 1..=3_usize, vec(edit, 0..=3)).prop_map(|(sample, kind, extra, axes, edits)| {
        let mut buffer = [0; MAX_LEN];
        let len = sample.encode_as(kind, &of_kind(kind, extra), axes, &mut buffer);
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

fn kind() -> impl Strategy<Value = SampleKind> {
    select(&[SampleKind::State, SampleKind::Energy, SampleKind::Wave, SampleKind::Force, SampleKind::Increment][..])
}

fn extra() -> impl Strategy<Value = Extra<3>> {
    (any::<u32>(), [finite(), finite(), finite()]).prop_map(|(receiver, numbers)| Extra { receiver, numbers, ..Extra::NONE })
}

/// Returns `extra` without the data that samples of the kind do not have.
fn of_kind(kind: SampleKind, extra: Extra<3>) -> Extra<3> {
    let numbers = if kind == SampleKind::State { [0.0; 3] } else { extra.numbers };
    Extra { receiver: if kind.is_personal() { extra.receiver } else { 0 }, numbers, ..Extra::NONE }
}

fn sample() -> impl Strategy<Value = Sample<3>> {
    let place = move || [finite(), finite(), finite()];
    (any::<u64>(), any::<u32>(), any::<u64>(), any::<u64>(), place(), place()).prop_map(|(session, sender, sequence, sent, position, velocity)| {
        Sample { session, sender, sequence, sent: Instant::from_nanos(sent), state: State { position, velocity } }
    })
}

//! Files of records, and the error of writing one.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use cohaptic_files::WholeFile;
use cohaptic_units::Instant;

use crate::number_text::parts;

/// Error of writing a record.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}", path.display())]
pub struct RecordError {
    /// File or folder.
    pub path: PathBuf,
    /// Error of the system.
    pub source: io::Error,
}

/// Conversion for code that joins an observer without errors and a recorder.
impl From<std::convert::Infallible> for RecordError {
    fn from(never: std::convert::Infallible) -> Self {
        match never {}
    }
}

/// File of a record during writing: a [`WholeFile`] with the errors of records. If writing fails, the beginning of the file stays under a name with the ending
/// `.partial`.
#[derive(Debug)]
pub struct RecordFile(WholeFile);

impl RecordFile {
    /// Creates a file that will have the name `path`.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the file cannot be created.
    pub fn create(path: PathBuf) -> Result<Self, RecordError> {
        WholeFile::create(&path).map(Self).map_err(|source| RecordError { path, source })
    }

    /// Appends bytes.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the bytes cannot be written.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), RecordError> {
        self.0.write_all(bytes).map_err(|source| RecordError { path: self.0.written_to().to_path_buf(), source })
    }

    /// Writes the rest, gives the file its name, and returns the name.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the rest cannot be written or the file cannot be renamed.
    pub fn finish(self) -> Result<PathBuf, RecordError> {
        // `finish` consumes the file, so both names are copied before.
        let [path, written_to] = [self.0.path(), self.0.written_to()].map(Path::to_path_buf);
        self.0.finish().map_err(|source| RecordError { path: written_to, source })?;
        Ok(path)
    }
}

/// Creates the folder for records, with its parents.
pub(crate) fn create_folder(path: &Path) -> Result<(), RecordError> {
    fs::create_dir_all(path).map_err(|source| RecordError { path: path.to_path_buf(), source })
}

/// Appends a number with the fewest digits from which the same `f64` is read back; `inf`, `-inf` and `NaN` for values that are not finite.
pub(crate) fn push_f64(line: &mut Vec<u8>, value: f64) {
    let mut buffer = zmij::Buffer::new();
    // The sign of a positive exponent is left out, so the number is written in two parts.
    let (mantissa, exponent) = parts(&mut buffer, value);
    line.extend_from_slice(mantissa.as_bytes());
    line.extend_from_slice(exponent.as_bytes());
}

/// Appends a whole number.
pub(crate) fn push_whole(line: &mut Vec<u8>, number: u64) {
    line.extend_from_slice(itoa::Buffer::new().format(number).as_bytes());
}

/// Appends an instant \[s\] in the form of [`cohaptic_units::print::Seconds`], without the slow formatting machinery.
pub(crate) fn push_seconds(line: &mut Vec<u8>, at: Instant) {
    const NANOS: u64 = 1_000_000_000;
    let nanos = at.as_nanos();
    push_whole(line, nanos / NANOS);
    let rest = nanos % NANOS;
    if rest != 0 {
        let point = line.len();
        // 10⁹ + rest has ten digits: its first digit is overwritten by the point, and the leading zeros of the rest stay.
        push_whole(line, NANOS + rest);
        line[point] = b'.';
        // Trailing zeros of the fraction say nothing.
        while line.last() == Some(&b'0') {
            line.pop();
        }
    }
}

/// Appends the printed form of a value.
pub(crate) fn push_display(line: &mut Vec<u8>, value: impl std::fmt::Display) {
    write!(line, "{value}").expect("writing to memory does not fail");
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
    use cohaptic_units::print::Seconds;
    use proptest::prelude::*;

    use super::*;

    fn written(push: impl FnOnce(&mut Vec<u8>)) -> String {
        let mut line = b"x".to_vec();
        push(&mut line);
        String::from_utf8(line).unwrap()
    }

    properties! {
        #[test]
        fn instants_are_written_as_they_print(nanos in prop_oneof![any::<u64>(), 0..2_000_000_001_u64], power in 0..10_u32) {
            for at in [nanos, nanos / 10_u64.pow(power) * 10_u64.pow(power)].map(Instant::from_nanos) {
                prop_assert_eq!(written(|line| push_seconds(line, at)), format!("x{}", Seconds(at)));
            }
        }

        /// The number of digits is that of the standard library, which takes the other one of two equally near numbers, such as 1547520063066896.3 for
        /// 1547520063066896.25. Exponents have no plus sign.
        #[test]
        fn numbers_are_written_with_the_fewest_digits(bits in any::<u64>(), small in -1e3..1e3_f64, large in 1e15..1e25_f64) {
            for value in [f64::from_bits(bits), small, large, -large] {
                let text = written(|line| push_f64(line, value))[1..].to_owned();
                if value.is_finite() {
                    prop_assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits());
                    let digits = |text: &str| text.split('e').next().unwrap_or_default().replace(['-', '.'], "").trim_matches('0').to_owned();
                    prop_assert_eq!(digits(&text).len(), digits(&format!("{value:e}")).len());
                }
                prop_assert!(!text.contains('+'));
            }
        }
    }

    #[test]
    fn numbers_are_written_in_one_way() {
        let values = [0.0, -0.0, 1.0, -0.024, 1e15, 1e16, -2.5e300, 1e-5, 1.5e-7, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        let texts = ["0.0", "-0.0", "1.0", "-0.024", "1000000000000000.0", "1e16", "-2.5e300", "0.00001", "1.5e-7", "NaN", "inf", "-inf"];
        assert_eq!(values.map(|value| written(|line| push_f64(line, value))), texts.map(|text| format!("x{text}")));
    }
}

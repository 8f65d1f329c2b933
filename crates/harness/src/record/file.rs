//! The files of records, and the failure to write one.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use cohaptic_files::WholeFile;
use cohaptic_units::Instant;

/// Why a record could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}", path.display())]
pub struct RecordError {
    /// The file or folder.
    pub path: PathBuf,
    /// What the system says.
    pub source: io::Error,
}

/// Beside an observer that never fails.
impl From<std::convert::Infallible> for RecordError {
    fn from(never: std::convert::Infallible) -> Self {
        match never {}
    }
}

/// A record on its way: a [`WholeFile`] whose errors are those of a record. If it cannot be written to its end, its beginning stays under a name that ends in
/// `.partial`.
#[derive(Debug)]
pub struct RecordFile(WholeFile);

impl RecordFile {
    /// Begins a file of that name.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if it cannot be made.
    pub fn create(path: PathBuf) -> Result<Self, RecordError> {
        WholeFile::create(&path).map(Self).map_err(|source| RecordError { path, source })
    }

    /// Adds to it.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if that cannot be written.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), RecordError> {
        self.0.write_all(bytes).map_err(|source| RecordError { path: self.0.written_to().to_path_buf(), source })
    }

    /// Writes the rest and gives the file its name.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if that cannot be done.
    pub fn finish(self) -> Result<PathBuf, RecordError> {
        let [path, written_to] = [self.0.path(), self.0.written_to()].map(Path::to_path_buf);
        self.0.finish().map_err(|source| RecordError { path: written_to, source })?;
        Ok(path)
    }
}

/// Makes the folder for records.
pub(crate) fn create_folder(path: &Path) -> Result<(), RecordError> {
    fs::create_dir_all(path).map_err(|source| RecordError { path: path.to_path_buf(), source })
}

/// Adds a number with the fewest digits that read back as the same `f64`; `inf`, `-inf` and `NaN` for values that are not finite.
pub(crate) fn push_f64(line: &mut Vec<u8>, value: f64) {
    let mut buffer = zmij::Buffer::new();
    let (mantissa, exponent) = parts(&mut buffer, value);
    line.extend_from_slice(mantissa.as_bytes());
    line.extend_from_slice(exponent.as_bytes());
}

/// The text of [`push_f64`], in two parts: the exponents of large numbers have no sign.
pub(crate) fn parts(buffer: &mut zmij::Buffer, value: f64) -> (&str, &str) {
    let text = buffer.format(value);
    // Looking for it takes as long as the digits.
    match if value.abs() >= 1e16 { text.find("e+") } else { None } {
        Some(at) => (&text[..=at], &text[at + 2..]),
        None => (text, ""),
    }
}

/// Adds a whole number.
pub(crate) fn push_whole(line: &mut Vec<u8>, number: u64) {
    line.extend_from_slice(itoa::Buffer::new().format(number).as_bytes());
}

/// Adds an instant as [`cohaptic_units::print::Seconds`] prints it: that takes most of the time of a row.
pub(crate) fn push_seconds(line: &mut Vec<u8>, at: Instant) {
    const NANOS: u64 = 1_000_000_000;
    let nanos = at.as_nanos();
    push_whole(line, nanos / NANOS);
    let rest = nanos % NANOS;
    if rest != 0 {
        let point = line.len();
        // A digit before the nine, which becomes the point.
        push_whole(line, NANOS + rest);
        line[point] = b'.';
        while line.last() == Some(&b'0') {
            line.pop();
        }
    }
}

/// Adds something that prints itself.
pub(crate) fn push_display(line: &mut Vec<u8>, value: impl std::fmt::Display) {
    write!(line, "{value}").expect("writing to memory does not fail");
}

#[cfg(test)]
mod tests {
    use cohaptic_units::print::Seconds;
    use proptest::prelude::*;

    use super::*;

    fn written(push: impl FnOnce(&mut Vec<u8>)) -> String {
        let mut line = b"x".to_vec();
        push(&mut line);
        String::from_utf8(line).unwrap()
    }

    proptest! {
        #[test]
        fn instants_are_written_as_they_print(nanos in prop_oneof![any::<u64>(), 0..2_000_000_001_u64], power in 0..10_u32) {
            for at in [nanos, nanos / 10_u64.pow(power) * 10_u64.pow(power)].map(Instant::from_nanos) {
                prop_assert_eq!(written(|line| push_seconds(line, at)), format!("x{}", Seconds(at)));
            }
        }

        /// The fewest digits, as the standard library has them; and an exponent without a sign.
        #[test]
        fn numbers_are_written_with_the_fewest_digits(bits in any::<u64>(), small in -1e3..1e3_f64, large in 1e15..1e25_f64) {
            for value in [f64::from_bits(bits), small, large, -large] {
                let text = written(|line| push_f64(line, value))[1..].to_owned();
                if value.is_finite() {
                    prop_assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits());
                    let digits = |text: &str| text.split('e').next().unwrap_or_default().replace(['-', '.'], "").trim_matches('0').to_owned();
                    prop_assert_eq!(digits(&text), digits(&format!("{value:e}")));
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

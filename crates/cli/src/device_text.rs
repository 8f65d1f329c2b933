//! Texts and files that the commands of all devices share: places, rulers, rows and blocks of lines.

use std::io::Write as _;
use std::path::Path;

use cohaptic_files::WholeFile;

use crate::failure::Failure;
use crate::file::unwritten;
use crate::output;

/// Position \[m\], velocity \[m/s\] or force \[N\] along x, y and z.
pub(crate) type Triple = [f64; 3];

/// Formats a position \[m\] in millimetres, such as `x 1.2 mm, y -3.0 mm, z 45.6 mm`.
pub(crate) fn place(position: Triple) -> String {
    // Rounded here, because -0.04 would be shown as -0.0.
    let [x, y, z] = position.map(|part| (1e4 * part).round() / 10.0 + 0.0);
    format!("x {x:.1} mm, y {y:.1} mm, z {z:.1} mm")
}

/// Returns a text of `title` and, indented below the title, `lines`.
pub(crate) fn block(title: &str, lines: &[String]) -> String {
    let mut text = format!("{title}\n");
    for line in lines {
        text.push_str("  ");
        text.push_str(line);
        text.push('\n');
    }
    text
}

/// Returns the Euclidean length of a vector, in the unit of the vector.
pub(crate) fn length(vector: Triple) -> f64 {
    let [x, y, z] = vector;
    x.hypot(y).hypot(z)
}

/// Half of the length of a ruler \[mm\]. The grip of a device moves by about this length to either side of the origin.
const REACH_MM: f64 = 60.0;
/// Number of places of a ruler. Odd, so that the origin has a place.
const PLACES: u8 = 31;

/// Returns a ruler with the grip at `place` \[mm\] and the origin in the middle. A place beyond the ends is shown at the end.
pub(crate) fn ruler(place: f64) -> String {
    let last = f64::from(PLACES - 1);
    // Place 0 is `-REACH_MM`, the middle place is the origin, and the last place is `REACH_MM`.
    let grip = ((place / REACH_MM + 1.0) * 0.5 * last).round().clamp(0.0, last);
    (0..PLACES)
        .map(|at| {
            if (f64::from(at) - grip).abs() < 0.5 {
                'o'
            } else if at == PLACES / 2 {
                '|'
            } else {
                '-'
            }
        })
        .collect()
}

/// A CSV file of rows, which appears under its name only when [`finish`](Self::finish) is called.
pub(crate) struct SamplesFile {
    file: WholeFile,
}

impl SamplesFile {
    pub(crate) fn create(path: &Path, header: &str) -> Result<Self, Failure> {
        let create = || {
            let mut file = WholeFile::create(path)?;
            writeln!(file, "{header}")?;
            Ok(Self { file })
        };
        create().map_err(unwritten(path))
    }

    pub(crate) fn write(&mut self, row: &str) -> Result<(), Failure> {
        let written = writeln!(self.file, "{row}");
        written.map_err(unwritten(self.file.path()))
    }

    /// Completes the file under its name, and returns the path for messages.
    pub(crate) fn finish(self) -> Result<String, Failure> {
        let path = self.file.path().to_path_buf();
        self.file.finish().map_err(unwritten(&path))?;
        Ok(output::path(&path))
    }
}

/// Prints a row to standard output at once, without waiting for more rows.
pub(crate) fn print_row(row: &str) -> Result<(), Failure> {
    output::raw(format!("{row}\n").as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_see_where_the_grip_is() {
        assert_eq!(ruler(0.0), "---------------o---------------");
        assert_eq!(ruler(-20.0), "----------o----|---------------");
        // The last place to the right is that of all places beyond.
        assert_eq!((ruler(60.0), ruler(400.0)), (ruler(400.0), "---------------|--------------o".to_owned()));
        assert_eq!(ruler(-60.0), "o--------------|---------------");
    }
}

//! The files of `cohaptic stability boundary --out`: a table of the crossings, a table of all checked values, and a picture of the radius along the key with
//! the crossings marked.

use std::path::Path;

use cohaptic_answers::boundary::{Searched, crossings_csv, samples_csv};
use cohaptic_answers::boundary_picture;
use cohaptic_picture::Size;

use crate::failure::Failure;
use crate::file::write_into;

/// Writes `boundary.csv`, `samples.csv` and `boundary.svg` into `folder`, and returns their paths.
pub(super) fn write(folder: &Path, searched: &Searched<'_>, size: Size) -> Result<Vec<String>, Failure> {
    let Searched { title, range, family, found, .. } = searched;
    let picture = boundary_picture(title, range, family.criterion(), family.left_out(), found);
    let files = [("boundary.csv", crossings_csv(searched)), ("samples.csv", samples_csv(searched)), ("boundary.svg", picture.size(size).svg())];
    files.into_iter().map(|(name, content)| write_into(folder, name, content)).collect()
}

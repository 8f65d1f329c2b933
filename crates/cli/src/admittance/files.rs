//! The files that `cohaptic admittance --out` writes: one table of all curves, and one Bode plot of all curves.

use std::path::Path;

use cohaptic_answers::admittance::{Curve, csv};
use cohaptic_answers::{AdmittanceCurve, admittance_picture};
use cohaptic_picture::Size;

use crate::failure::Failure;
use crate::file::write_into;

/// Writes `admittance.csv` and, if `is_whole`, `admittance.svg` into `folder`, and returns the paths of the written files.
///
/// An interrupted analysis gets only the table: drawing the picture takes longer than users wait after Ctrl-C.
pub(super) fn write(folder: &Path, peer: &str, curves: &[Curve], is_whole: bool, size: Size) -> Result<Vec<String>, Failure> {
    let mut written = vec![write_into(folder, "admittance.csv", csv(curves))?];
    if is_whole {
        let title = curves.first().map_or("", |curve| curve.title.as_str());
        let named: Vec<AdmittanceCurve<'_>> =
            curves.iter().map(|Curve { name, admittance, response, .. }| AdmittanceCurve { name, admittance, response }).collect();
        let picture = admittance_picture(title, peer, &named);
        let picture = picture.map_err(|error| Failure::Input(error.to_string()))?;
        written.push(write_into(folder, "admittance.svg", picture.size(size).svg())?);
    }
    Ok(written)
}

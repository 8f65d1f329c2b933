//! The files of `--out`: one table of all curves, and one picture, a Bode plot.

use std::path::Path;

use cohaptic_answers::{AdmittanceCurve, admittance_picture};
use cohaptic_picture::Size;
use cohaptic_units::print::csv_field;

use super::curve::Curve;
use crate::failure::Failure;
use crate::file::write_into;

/// Writes `admittance.csv` and `admittance.svg` into a folder, and gives their paths.
///
/// An incomplete list of points has only the table: a picture takes longer than users wait after Ctrl-C.
pub(super) fn write(folder: &Path, peer: &str, curves: &[Curve], is_whole: bool, size: Size) -> Result<Vec<String>, Failure> {
    let mut written = vec![write_into(folder, "admittance.csv", table(curves))?];
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

/// One row a curve and frequency. Numbers have the fewest digits that read back the same.
fn table(curves: &[Curve]) -> String {
    let mut text = "curve,hz,magnitude_db,phase_deg,ideal_db\n".to_owned();
    for curve in curves {
        let name = csv_field(&curve.name);
        for point in &curve.response.points {
            let (magnitude, phase, ideal) = (point.magnitude_db(), point.phase_deg(), curve.ideal_db(point.hz));
            text.push_str(&format!("{name},{:?},{magnitude:?},{phase:?},{ideal:?}\n", point.hz));
        }
    }
    text
}

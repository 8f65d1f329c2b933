//! The files of `--out`: one table of all curves, and one picture, a Bode plot.

use std::path::Path;

use cohaptic_picture::{Axis, Line, Look, Marker, Panel, Picture, Size};
use cohaptic_stability::Verdict;
use cohaptic_units::print::csv_field;

use super::curve::{Curve, Words};
use crate::failure::Failure;
use crate::file::write_into;

/// Writes `admittance.csv` and `admittance.svg` into a folder, which is made if it is not there, and gives their paths.
///
/// An incomplete list of points has only the table: a picture takes longer than users wait after Ctrl-C.
pub(super) fn write(folder: &Path, peer: &str, curves: &[Curve], is_whole: bool, size: Size) -> Result<Vec<String>, Failure> {
    std::fs::create_dir_all(folder).map_err(|error| Failure::File { verb: "write", path: folder.to_path_buf(), error })?;
    let mut written = vec![write_into(folder, "admittance.csv", table(curves))?];
    if is_whole {
        written.push(write_into(folder, "admittance.svg", picture(peer, curves)?.size(size).svg())?);
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

/// A response with its name.
struct Response {
    name: String,
    look: Look,
    /// Frequency \[Hz\] and magnitude \[dB\].
    magnitudes: Vec<(f64, f64)>,
    /// Frequency \[Hz\] and phase \[degrees\].
    phases: Vec<(f64, f64)>,
}

/// The plot.
pub(super) fn picture(peer: &str, curves: &[Curve]) -> Result<Picture, Failure> {
    let mut responses = masses(curves);
    for (number, curve) in curves.iter().enumerate() {
        responses.push(responded(number, curve)?);
    }
    let title = curves.first().map_or("", |curve| curve.title.as_str());
    let frequency = || Axis::new("Frequency").symbol("f").unit("Hz").logarithmic().tight();
    let (what, over) = curves.first().map_or_else(Default::default, |curve| (curve.words().what, curve.words().over));
    let magnitude = Axis::new("Magnitude").unit(format!("dB re 1 {over}")).multiples_of(20).tight().ends_at_ticks();
    let phase = Axis::new("Phase").unit("degrees").multiples_of(45).tight().ends_at_ticks();
    let above = Panel::new(frequency(), magnitude).with_all(responses.iter().map(|response| response.line(&response.magnitudes)));
    let below = Panel::new(frequency(), phase).with_all(responses.iter().map(|response| response.line(&response.phases)));
    let title = format!("{title}: {what} of {peer}");
    Ok(Picture::new(title).shared_x().aspect(0.4).panel(above).panel(below))
}

impl Response {
    fn line(&self, points: &[(f64, f64)]) -> Line {
        let line = Line::new(points.iter().copied(), self.look).named(self.name.as_str());
        // One frequency alone is a point.
        if points.len() == 1 { line.marked(Marker::Disc) } else { line }
    }
}

/// Between two points of a line a frequency is this much higher at most: a resonance is round then, and a phase can be followed through its jumps.
const FINEST: f64 = 1.02;

/// The frequencies that were asked for, rising, with enough between them that no two are far apart.
fn filled(curve: &Curve) -> Vec<f64> {
    let mut asked: Vec<f64> = curve.response.points.iter().map(|point| point.hz).collect();
    asked.sort_by(f64::total_cmp);
    let between = |pair: &[f64]| {
        let (low, high) = (pair[0], pair[1]);
        std::iter::successors(Some(low), |hz| Some(hz * FINEST)).take_while(move |hz| *hz < high).collect::<Vec<f64>>()
    };
    asked.windows(2).flat_map(between).chain(asked.last().copied()).collect()
}

fn responded(number: usize, curve: &Curve) -> Result<Response, Failure> {
    let response = curve.admittance.response(&filled(curve)).map_err(|error| Failure::Input(error.to_string()))?;
    let hz = || response.points.iter().map(|point| point.hz);
    Ok(Response {
        name: named(curve),
        look: Look::of(number),
        magnitudes: hz().zip(response.magnitudes_db()).collect(),
        phases: hz().zip(response.phases_deg()).collect(),
    })
}

/// The name, and the verdict where it is no good one: such a curve is nothing that could be measured.
fn named(curve: &Curve) -> String {
    match curve.admittance.verdict() {
        Verdict::Stable => curve.name.clone(),
        verdict @ (Verdict::Marginal | Verdict::Overflow | Verdict::Unstable) => format!("{} ({})", curve.name, verdict.word().to_uppercase()),
    }
}

/// The objects of all curves, as free masses: each mass once.
fn masses(curves: &[Curve]) -> Vec<Response> {
    let mut masses: Vec<Response> = Vec::new();
    // No number of decibels stands for nothing.
    for curve in curves.iter().filter(|curve| curve.mass.is_finite()) {
        let Words { free, inertia, .. } = curve.words();
        let name = format!("{free} of {} {inertia}", curve.mass);
        if masses.iter().any(|mass| mass.name == name) {
            continue;
        }
        // Straight over a logarithmic frequency.
        let ends = extent(curve.response.points.iter().map(|point| point.hz))
            .map_or(Vec::new(), |(low, high)| if low < high { vec![low, high] } else { vec![low] });
        let magnitudes = ends.iter().map(|hz| (*hz, curve.ideal_db(*hz))).collect();
        // One is grey, as all that curves are compared with; more have the looks after those of the curves.
        let look = if masses.is_empty() { Look::reference() } else { Look::of(curves.len() + masses.len() - 1).thin() };
        masses.push(Response { name, look, magnitudes, phases: ends.into_iter().map(|hz| (hz, -90.0 * curve.mass.signum())).collect() });
    }
    masses
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |found, value| Some(found.map_or((value, value), |(low, high): (f64, f64)| (low.min(value), high.max(value)))))
}

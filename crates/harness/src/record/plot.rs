//! Plots over time.

use std::path::PathBuf;

use cohaptic_picture::{Axis, Line, Look, Picture};

use super::band::Bands;
use super::file::RecordFile;
use super::targets::Targets;
use crate::record::RecordError;

/// Distance from its initial position beyond which no person at a desktop device moves a copy \[m\].
pub const SANE_POSITION: f64 = 1.0;

/// A plot: panels below one another with a common axis of time.
pub(crate) struct Plot<'a> {
    pub(crate) title: String,
    pub(crate) panels: Vec<Panel<'a>>,
}

/// Panel of a plot: curves over time, with or without names.
pub(crate) struct Panel<'a> {
    pub(crate) title: String,
    /// Vertical axis, in the unit of the values times `scale`.
    pub(crate) axis: Axis,
    pub(crate) names: &'a [String],
    pub(crate) bands: &'a Bands,
    /// Factor of the values before drawing: 100 to show metres in centimetres.
    pub(crate) scale: f64,
    /// Bound of the curves in a scene that does not diverge: see [`Bands::range`].
    pub(crate) sane: f64,
    /// Targets of the task and the axis of the scene; `None` for a plot without targets.
    pub(crate) targets: Option<(&'a Targets, usize)>,
}

/// Greatest number of curves with names and different looks. More curves have one look and no names.
pub(super) const MOST_NAMED: usize = 10;

/// Writes a picture to a file and returns its path.
pub(crate) fn write(path: PathBuf, svg: &str) -> Result<PathBuf, RecordError> {
    let mut file = RecordFile::create(path)?;
    file.write(svg.as_bytes())?;
    file.finish()
}

impl Plot<'_> {
    /// Draws the picture.
    pub(crate) fn picture(&self) -> Picture {
        let mut picture = Picture::new(self.title.as_str()).shared_x().aspect(0.38);
        for panel in &self.panels {
            let (panel, cut) = drawn(panel);
            picture = picture.panel(panel);
            if cut && !picture.has_note(CUT) {
                picture = picture.note(CUT);
            }
        }
        picture
    }
}

pub(super) const CUT: &str = "What goes far beyond is cut off.";

/// Returns the panel, and whether values are cut off.
fn drawn(panel: &Panel<'_>) -> (cohaptic_picture::Panel, bool) {
    // A scene that diverges would press all sane values into a line, so the range is cut.
    let (range, cut) = panel.bands.range(panel.sane);
    // A target that no copy came near is shown too. In a cut plot it would press all sane values into a line.
    let range = match panel.targets.filter(|_| !cut).and_then(|(targets, axis)| targets.range(axis)) {
        Some(targets) => range.start.min(targets.start)..range.end.max(targets.end),
        None => range,
    };
    let range = range.start * panel.scale..range.end * panel.scale;
    let time = Axis::new("Time").symbol("t").unit("s").range(0.0, panel.bands.seconds());
    let mut drawn = cohaptic_picture::Panel::new(time, panel.axis.clone().range(range.start, range.end)).titled(panel.title.as_str());
    // Targets come first, so that curves are drawn over them.
    if let Some((targets, axis)) = panel.targets {
        drawn = targets.onto(drawn, axis, panel.scale);
    }
    let few = panel.bands.curves() <= MOST_NAMED;
    for curve in 0..panel.bands.curves() {
        // With more curves than looks, names and colours would repeat.
        let look = if few { Look::of(curve) } else { Look::of(0).thin() };
        let name = panel.names.get(curve).filter(|_| few).map_or("", String::as_str);
        drawn = drawn.with(Line::runs(visible_runs(panel, curve, &range), look).named(name));
    }
    (drawn, cut)
}

/// Returns the parts of a curve within the shown range: lowest and highest value of each span.
fn visible_runs(panel: &Panel<'_>, curve: usize, range: &std::ops::Range<f64>) -> Vec<Vec<(f64, f64)>> {
    let mut runs = vec![Vec::new()];
    let mut last = f64::NAN;
    for (t, low, high) in panel.bands.curve(curve) {
        let (low, high) = (low * panel.scale, high * panel.scale);
        if !range.contains(&low) || !range.contains(&high) {
            // A value out of range ends the run, so the line has a gap.
            runs.push(Vec::new());
            continue;
        }
        let run = runs.last_mut().expect("there is always a run");
        // Begin with the value nearer to the end of the line so far, so that the line has no needless strokes.
        let rising = (last - low).abs() <= (last - high).abs() || last.is_nan();
        let (first, second) = if rising { (low, high) } else { (high, low) };
        run.push((t, first));
        if first.to_bits() != second.to_bits() {
            run.push((t, second));
        }
        last = second;
    }
    // Two values out of range in sequence leave an empty run.
    runs.retain(|run| !run.is_empty());
    runs
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_picture::testing::faults;
    use cohaptic_units::Instant;

    use super::*;

    /// A long title must not be cut off at either end, and two coincident curves must be told apart.
    #[test]
    fn no_title_is_cut_off_and_curves_that_coincide_are_told_apart() {
        let mut bands = Bands::new(Duration::from_secs(10), 1000, 2);
        for millis in (0..10_000_u32).step_by(5) {
            let (at, t) = (Instant::from_nanos(u64::from(millis) * 1_000_000), f64::from(millis) / 1000.0);
            (0..2).for_each(|curve| bands.add(curve, at, 1e-3 * (2.0 * t).exp()));
        }
        let names = ["left".to_owned(), "right".to_owned()];
        let title =
            "Section 5.1: two of three users, AP at 2100 N/m, with arms, with coordination.strategy=proportional-derivative: position of each copy";
        let axis = Axis::new("Position").symbol("x_O").unit("cm");
        let panel = Panel { title: String::new(), axis, names: &names, bands: &bands, scale: 100.0, sane: 1.0, targets: None };
        let svg = Plot { title: title.to_owned(), panels: vec![panel] }.picture().svg();
        assert_eq!(faults(&svg), [""; 0]);
        let drawn = svg.split_once("</desc>").expect("there is a description").1;
        assert!(title.split(' ').all(|word| drawn.contains(word)) && drawn.contains(CUT), "the title and the warning are whole");
        let curves: Vec<&str> = drawn.lines().filter(|line| line.starts_with("<path class=\"line s")).collect();
        let data = |path: &str| path.split_once(" d=").map(|(_, data)| data.to_owned());
        assert_eq!(data(curves[0]), data(curves[1]), "they coincide");
        assert!(!curves[0].contains("dasharray") && curves[1].contains("dasharray"), "{:?}", &curves[..2]);
        let fractions = data(curves[0]).is_some_and(|data| data.split(['M', 'L', ',']).any(|number| number.contains('.')));
        assert!(fractions, "coordinates are finer than a pixel");
    }
}

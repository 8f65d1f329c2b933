//! Copies in motion: an animation of some runs beside each other, which a browser repeats.
//!
//! The animation needs styles alone, so that the animation also moves within an `<img>`, where no script runs. Each cycle ends with a still of [`STILL`]
//! seconds: the final positions, with the path of each copy behind the copy.

mod draw;
mod style;
#[cfg(test)]
mod tests;

use std::ops::RangeInclusive;

/// An animation of some runs beside each other. All runs have the scale of the first run, so that copies of another run can leave the frame.
///
/// ```
/// use cohaptic_picture::{Motion, MotionRun};
///
/// let frames = (0..20).map(f64::from).map(|t| vec![[0.002 * t, 0.0], [0.001 * t, 0.0]]).collect();
/// let names = vec!["left".to_owned(), "right".to_owned()];
/// let run = MotionRun { title: "AP".to_owned(), names, frames, hands: Vec::new() };
/// let svg = Motion::new("Two copies", "100 ms apart", 0.05, vec![run]).svg();
/// assert!(svg.starts_with("<svg ") && svg.contains("@keyframes"));
/// ```
#[derive(Clone, Debug)]
pub struct Motion {
    title: String,
    note: String,
    /// Time between two frames \[s\].
    step: f64,
    runs: Vec<MotionRun>,
}

/// Positions of the copies in a run, and of the hands at some of the copies.
#[derive(Clone, Debug)]
pub struct MotionRun {
    /// Text above the frame of this run.
    pub title: String,
    /// Names of the copies.
    pub names: Vec<String>,
    /// Positions of the copies along the first two axes \[m\], y upwards, indexed by frame and then by copy. A copy at a position that is not finite is drawn
    /// outside the frame; a copy without a position is drawn in the middle.
    pub frames: Vec<Vec<[f64; 2]>>,
    /// Hands, drawn as rings in the colour of the copy.
    pub hands: Vec<MotionHand>,
}

/// Positions of one hand.
#[derive(Clone, Debug)]
pub struct MotionHand {
    /// Index of the hand's copy.
    pub copy: usize,
    /// Positions of the hand along the first two axes \[m\], y upwards, indexed by frame.
    pub frames: Vec<[f64; 2]>,
}

const WIDTH: f64 = 960.0;
const MARGIN: f64 = 12.0;
const TITLE: f64 = 15.0;
const FONT: f64 = 13.0;
const HEIGHT: f64 = 220.0;
/// Edge of the largest copy \[px\].
const EDGE: f64 = 46.0;
/// Edge of the smallest copy \[px\]. Copies differ in size, so that each copy is seen where all copies are at one position.
const LEAST_EDGE: f64 = 20.0;
/// Radius of a hand \[px\].
const RING: f64 = 30.0;
/// Greatest distance of a drawn copy from the middle of the frame \[px\]: far outside the frame.
const GONE: f64 = 2.0 * WIDTH;
/// Time with the last frame before the animation begins again \[s\].
const STILL: f64 = 2.5;
/// Number of steps between frames joined by a piece of a path. A piece appears when the copy has passed the end of the piece.
const PIECE: usize = 5;

impl Motion {
    /// Creates an animation. `step` is the time between two frames \[s\], above zero. The animation lasts as long as the run with the most frames, at least one
    /// step, and then shows the last frame for 2.5 s. `note` stands below the title.
    #[must_use]
    pub fn new(title: impl Into<String>, note: impl Into<String>, step: f64, runs: Vec<MotionRun>) -> Self {
        Self { title: title.into(), note: note.into(), step, runs }
    }

    /// Returns the duration of the longest run \[s\], without the time for which the last frame then stays.
    fn seconds(&self) -> f64 {
        let frames = self.runs.iter().map(|run| run.frames.len()).max().unwrap_or(1).max(2);
        self.time_of(frames - 1)
    }

    /// Returns the instant of a frame \[s\].
    fn time_of(&self, frame: usize) -> f64 {
        u32::try_from(frame).map_or(1.0, f64::from) * self.step
    }

    /// Returns the point of the cycle at which a frame is shown \[%\]. The cycle includes the time for which the last frame stays.
    fn share_of(&self, frame: usize) -> f64 {
        100.0 * self.time_of(frame) / self.cycle()
    }

    /// Returns the duration of one cycle of the animation \[s\]: the longest run, and the time for which the last frame stays.
    fn cycle(&self) -> f64 {
        self.seconds() + STILL
    }

    fn frame_width(&self) -> f64 {
        let columns = u32::try_from(self.runs.len().max(1)).map_or(1.0, f64::from);
        (WIDTH - MARGIN * (columns + 1.0)) / columns
    }

    /// Returns the map from positions to the frame. The first run fills the frame.
    fn view(&self) -> View {
        let first = self.runs.iter().take(1);
        let copies = first.clone().flat_map(|run| run.frames.iter().flatten());
        let hands = first.flat_map(|run| &run.hands).flat_map(|hand| &hand.frames);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        // A position that is not finite would leave the range without a middle.
        for place in copies.chain(hands).filter(|place| place.iter().all(|x| x.is_finite())) {
            for axis in [0, 1] {
                (low[axis], high[axis]) = (low[axis].min(place[axis]), high[axis].max(place[axis]));
            }
        }
        let half = [self.frame_width() / 2.0, HEIGHT / 2.0];
        // No position of the first run is finite: any scale will do.
        if low[0] > high[0] {
            return View { middle: [0.0; 2], scale: 1.0, half };
        }
        // The largest shape stays within the frame.
        let room = half.map(|half| 2.0 * half - 2.2 * RING);
        // Copies at rest span no length. A tenth of a millimetre keeps the scale finite.
        let scales = [0, 1].map(|axis| room[axis] / (high[axis] - low[axis]).max(1e-4));
        View { middle: [0, 1].map(|axis| (low[axis] + high[axis]) / 2.0), scale: scales[0].min(scales[1]), half }
    }
}

impl MotionRun {
    /// Returns the frame from which on every copy stays outside the frame of the picture until the end of the run; `None` if a copy is seen at the end.
    fn left_at(&self, view: &View) -> Option<usize> {
        let is_out = |places: &Vec<[f64; 2]>| !places.is_empty() && places.iter().all(|place| view.is_outside(*place));
        // The last frame with a copy inside decides, because copies may leave and come back before.
        let seen = self.frames.iter().rposition(|places| !is_out(places)).map_or(0, |last| last + 1);
        (seen < self.frames.len()).then_some(seen)
    }

    /// Returns the first and the last place of each piece of a copy's path. A piece ends where the next piece begins, so that the path has no gap.
    fn pieces(&self, copy: usize) -> impl Iterator<Item = RangeInclusive<usize>> {
        let last = self.frames.iter().filter(|places| copy < places.len()).count().saturating_sub(1);
        (0..last).step_by(PIECE).map(move |begin| begin..=(begin + PIECE).min(last))
    }
}

/// Returns the edge of the copy with index `copy` among `copies` \[px\]. The first copy is the largest.
fn edge_of(copy: usize, copies: usize) -> f64 {
    let count = |number: usize| u32::try_from(number).map_or(f64::INFINITY, f64::from);
    EDGE - (EDGE - LEAST_EDGE) * count(copy) / count(copies.max(2) - 1)
}

struct View {
    /// Position in the middle of the frame \[m\].
    middle: [f64; 2],
    /// Scale \[px/m\].
    scale: f64,
    /// Half of the width and of the height of the frame \[px\].
    half: [f64; 2],
}

impl View {
    /// Returns the shift of a position from the middle of the frame \[px\], with y downwards as in a picture.
    fn shift(&self, place: [f64; 2]) -> [f64; 2] {
        let along = |axis: usize| (self.scale * (place[axis] - self.middle[axis])).clamp(-GONE, GONE);
        // `clamp` keeps NaN, so NaN is moved out of the frame here.
        [along(0), -along(1)].map(|x| if x.is_nan() { GONE } else { x })
    }

    fn is_outside(&self, place: [f64; 2]) -> bool {
        let shift = self.shift(place);
        // A copy is outside only if no part of the largest shape is seen.
        (0..2).any(|axis| shift[axis].abs() > self.half[axis] + EDGE / 2.0)
    }
}

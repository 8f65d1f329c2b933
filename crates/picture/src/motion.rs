//! Copies in motion: an animation of some runs beside each other, which a browser plays again and again.

use std::fmt::Write as _;

use crate::xml::{coordinate, escape};

/// An animation of some runs beside each other. All have the scale of the first, so that one that comes apart leaves its frame.
///
/// ```
/// use cohaptic_picture::{Motion, MotionRun};
///
/// let frames = (0..20).map(f64::from).map(|t| vec![[0.002 * t, 0.0], [0.001 * t, 0.0]]).collect();
/// let names = vec!["left".to_owned(), "right".to_owned()];
/// let svg = Motion::new("Two copies", 0.05, vec![MotionRun { title: "AP".to_owned(), names, frames }]).svg();
/// assert!(svg.starts_with("<svg ") && svg.contains("@keyframes"));
/// ```
#[derive(Clone, Debug)]
pub struct Motion {
    title: String,
    /// Between two frames \[s\].
    step: f64,
    runs: Vec<MotionRun>,
}

/// One run: where each copy is in each frame.
#[derive(Clone, Debug)]
pub struct MotionRun {
    /// What stands above it.
    pub title: String,
    /// The names of the copies.
    pub names: Vec<String>,
    /// By frame, then copy: where it is along the first two axes \[m\], y upwards. A place that is not finite is out of the frame, one that is missing is in the
    /// middle.
    pub frames: Vec<Vec<[f64; 2]>>,
}

/// Colours that are told apart with any kind of colour vision (Okabe & Ito 2008), on light and on dark ground.
const STYLE: &str = "text{font-family:system-ui,sans-serif}.ink{fill:#1b1f24}.paper{fill:#fff}.frame{fill:none;stroke:#6e7781}
.f0{fill:#0072b2}.f1{fill:#d55e00}.f2{fill:#009e73}.f3{fill:#c0609a}.f4{fill:#b88700}.f5{fill:#3a9bd0}.f6{fill:#6b7280}
@media (prefers-color-scheme:dark){.ink{fill:#e6e9ec}.paper{fill:#14181d}.frame{stroke:#8b949e}}
";
const COLOURS: usize = 7;

const WIDTH: f64 = 960.0;
const MARGIN: f64 = 12.0;
const TITLE: f64 = 15.0;
const FONT: f64 = 13.0;
const HEIGHT: f64 = 190.0;
/// The edge of a copy \[px\].
const EDGE: f64 = 46.0;
/// No copy goes farther beyond the middle of its frame \[px\]: it has left it.
const GONE: f64 = 2.0 * WIDTH;

impl Motion {
    /// An animation with `step` seconds between two frames, above zero. It lasts as long as the run with the most frames, and one step at least.
    #[must_use]
    pub fn new(title: impl Into<String>, step: f64, runs: Vec<MotionRun>) -> Self {
        Self { title: title.into(), step, runs }
    }

    /// The document, a file of its own. With reduced motion it shows the last frame.
    #[must_use]
    pub fn svg(&self) -> String {
        let columns = u32::try_from(self.runs.len().max(1)).map_or(1.0, f64::from);
        let frame_width = (WIDTH - MARGIN * (columns + 1.0)) / columns;
        let (top, lasts) = (MARGIN + 2.0 * TITLE, self.seconds());
        let height = top + 2.2 * FONT + HEIGHT + 2.4 * FONT;
        let view = self.view(frame_width);
        let mut xml = String::new();
        let (width, shown_height) = (coordinate(WIDTH), coordinate(height));
        let _ = write!(
            xml,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"cohaptic-picture\" role=\"img\" width=\"{width}\" height=\"{shown_height}\" \
             viewBox=\"0 0 {width} {shown_height}\">\n<title>{}</title>\n<desc>{}</desc>\n",
            escape(&self.title),
            escape(&self.spoken())
        );
        let _ = writeln!(xml, "<style>\n{STYLE}{}</style>", self.keyframes(&view, lasts));
        let _ = writeln!(xml, "<rect class=\"paper\" width=\"{width}\" height=\"{shown_height}\"/>");
        write_text(&mut xml, &self.title, [MARGIN, MARGIN + TITLE], TITLE);
        let mut left = MARGIN;
        for (number, run) in self.runs.iter().enumerate() {
            let above = top + 1.4 * FONT;
            write_text(&mut xml, &run.title, [left, above], FONT);
            let below = top + 2.2 * FONT;
            let [x, y, w, h] = [left, below, frame_width, HEIGHT].map(coordinate);
            let _ = writeln!(xml, "<clipPath id=\"room{number}\"><rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"/></clipPath>");
            let _ = writeln!(xml, "<rect class=\"frame\" x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"/>");
            let _ = writeln!(xml, "<g clip-path=\"url(#room{number})\">");
            let (middle_x, middle_y) = (left + frame_width / 2.0, below + HEIGHT / 2.0);
            for copy in 0..run.names.len() {
                let [dx, dy] = run.frames.last().and_then(|frame| frame.get(copy)).map_or([0.0; 2], |place| view.shift(*place));
                let [x, y] = [middle_x - EDGE / 2.0, middle_y - EDGE / 2.0].map(coordinate);
                let edge = coordinate(EDGE);
                let (colour, dx, dy) = (copy % COLOURS, coordinate(dx), coordinate(dy));
                let _ = writeln!(
                    xml,
                    "<rect class=\"f{colour} copy c{number}-{copy}\" x=\"{x}\" y=\"{y}\" width=\"{edge}\" height=\"{edge}\" rx=\"7\" \
                     transform=\"translate({dx} {dy})\"/>"
                );
            }
            xml.push_str("</g>\n");
            name_copies(&mut xml, run, (left, below + HEIGHT + 1.6 * FONT));
            left += frame_width + MARGIN;
        }
        xml.push_str("</svg>\n");
        xml
    }

    fn spoken(&self) -> String {
        let runs = self.runs.iter().map(|run| format!("{}: {} in motion for {:.1} s.", run.title, run.names.join(", "), self.seconds()));
        runs.collect::<Vec<_>>().join(" ")
    }

    fn seconds(&self) -> f64 {
        let frames = self.runs.iter().map(|run| run.frames.len()).max().unwrap_or(1).max(2);
        u32::try_from(frames - 1).map_or(1.0, f64::from) * self.step
    }

    /// The middle and the scale of the first run.
    fn view(&self, frame_width: f64) -> View {
        let places = self.runs.iter().take(1).flat_map(|run| &run.frames).flatten().filter(|place| place.iter().all(|x| x.is_finite()));
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for place in places {
            for axis in [0, 1] {
                (low[axis], high[axis]) = (low[axis].min(place[axis]), high[axis].max(place[axis]));
            }
        }
        if low[0] > high[0] {
            return View { middle: [0.0; 2], scale: 1.0 };
        }
        let room = [frame_width - 2.2 * EDGE, HEIGHT - 1.6 * EDGE];
        let scales = [0, 1].map(|axis| room[axis] / (high[axis] - low[axis]).max(1e-4));
        View { middle: [0, 1].map(|axis| (low[axis] + high[axis]) / 2.0), scale: scales[0].min(scales[1]) }
    }

    /// The ways of all copies, in the language of styles.
    fn keyframes(&self, view: &View, lasts: f64) -> String {
        let mut text = String::from(".copy{opacity:.75}\n");
        for (number, run) in self.runs.iter().enumerate() {
            for copy in 0..run.names.len() {
                let _ = write!(text, "@keyframes k{number}-{copy}{{");
                for (frame, places) in run.frames.iter().enumerate() {
                    let share = 100.0 * u32::try_from(frame).map_or(0.0, f64::from) * self.step / lasts;
                    let [x, y] = places.get(copy).map_or([0.0; 2], |place| view.shift(*place));
                    let _ = write!(text, "{}%{{transform:translate({}px,{}px)}}", coordinate(share), coordinate(x), coordinate(y));
                }
                let _ = writeln!(text, "}}\n.c{number}-{copy}{{animation:k{number}-{copy} {}s linear infinite}}", coordinate(lasts));
            }
        }
        text.push_str("@media (prefers-reduced-motion:reduce){.copy{animation:none}}\n");
        text
    }
}

fn name_copies(xml: &mut String, run: &MotionRun, (mut x, y): (f64, f64)) {
    for (copy, name) in run.names.iter().enumerate() {
        let [at, top, size] = [x, y - 0.8 * FONT, 0.8 * FONT].map(coordinate);
        let colour = copy % COLOURS;
        let _ = writeln!(xml, "<rect class=\"f{colour}\" x=\"{at}\" y=\"{top}\" width=\"{size}\" height=\"{size}\" rx=\"2\"/>");
        write_text(xml, name, [x + 1.2 * FONT, y], FONT);
        // No letter is wider.
        x += 2.6 * FONT + u32::try_from(name.chars().count()).map_or(0.0, f64::from) * 0.7 * FONT;
    }
}

fn write_text(xml: &mut String, text: &str, [x, y]: [f64; 2], size: f64) {
    let [x, y, size] = [x, y, size].map(coordinate);
    let _ = writeln!(xml, "<text class=\"ink\" x=\"{x}\" y=\"{y}\" font-size=\"{size}\">{}</text>", escape(text));
}

struct View {
    middle: [f64; 2],
    /// \[px/m\]
    scale: f64,
}

impl View {
    fn shift(&self, place: [f64; 2]) -> [f64; 2] {
        let along = |axis: usize| (self.scale * (place[axis] - self.middle[axis])).clamp(-GONE, GONE);
        // y of a picture points downwards.
        [along(0), -along(1)].map(|x| if x.is_nan() { GONE } else { x })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(title: &str, frames: &[[f64; 2]]) -> MotionRun {
        MotionRun {
            title: title.to_owned(),
            names: vec!["left".to_owned(), "a <b>".to_owned()],
            frames: frames.iter().map(|place| vec![*place, [0.0; 2]]).collect(),
        }
    }

    #[test]
    fn every_copy_has_a_way_and_both_runs_have_the_scale_of_the_first() {
        let motion = Motion::new(
            "t",
            0.5,
            vec![run("AP", &[[0.0, 0.0], [0.02, 0.01], [0.04, 0.0]]), run("PD", &[[0.0, 0.0], [0.04, 0.0], [f64::INFINITY, 0.0]])],
        );
        let svg = motion.svg();
        assert_eq!(svg, motion.svg());
        assert_eq!(crate::testing::faults(&svg), [""; 0]);
        assert!(svg.contains(">a &lt;b&gt;<") && svg.matches("@keyframes").count() == 4, "{svg}");
        assert!(svg.contains("prefers-reduced-motion") && svg.contains("animation:k1-1 1s linear infinite"));
        let way = |name: &str| svg.lines().find(|line| line.starts_with(&format!("@keyframes {name}{{"))).unwrap().to_owned();
        let shift = |line: &str, share: &str| {
            line.split(&format!("{{{share}%{{transform:translate("))
                .nth(1)
                .or_else(|| line.split(&format!("}}{share}%{{transform:translate(")).nth(1))
                .unwrap()
                .split("px")
                .next()
                .unwrap()
                .parse::<f64>()
                .unwrap()
        };
        // Where the first run is at its end, the second is in the middle of its time; then it leaves.
        assert!((shift(&way("k0-0"), "100") - shift(&way("k1-0"), "50")).abs() < 1e-9);
        assert!((shift(&way("k0-0"), "100") + shift(&way("k0-0"), "0")).abs() < 0.02, "the first run fills its frame");
        assert!(shift(&way("k1-0"), "100") > WIDTH);
    }
}

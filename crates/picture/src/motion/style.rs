//! The style sheet of an animation: colours, and the way of each shape to move or appear.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::{Motion, View};
use crate::xml::coordinate;

/// Colours distinguishable with any kind of colour vision (Okabe & Ito 2008), on light and on dark ground.
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#c0609a", "#b88700", "#3a9bd0", "#6b7280"];

/// Number of colours: copy `n` has colour `n % COUNT`.
pub(super) const COUNT: usize = COLOURS.len();

const STYLE: &str = "text{font-family:system-ui,sans-serif}.ink{fill:#1b1f24}.paper{fill:#fff}.frame{fill:none;stroke:#6e7781}
.copy{opacity:.8}.path{fill:none;opacity:.6}.hand{fill:none;stroke-width:2.5;stroke-dasharray:5 3}.told{stroke:#fff;stroke-width:4;paint-order:stroke}.elapsed{fill:#6e7781;transform-box:fill-box;transform-origin:left}
@media (prefers-color-scheme:dark){.ink{fill:#e6e9ec}.paper{fill:#14181d}.told{stroke:#14181d}.frame{stroke:#8b949e}.elapsed{fill:#8b949e}}
";

impl Motion {
    /// Returns the style sheet. For a reader who has turned animations off, the style sheet shows the last frame.
    pub(super) fn style(&self, view: &View) -> String {
        let mut text = STYLE.to_owned();
        for (number, colour) in COLOURS.iter().enumerate() {
            let _ = writeln!(text, ".f{number}{{fill:{colour}}}.s{number}{{stroke:{colour}}}");
        }
        let cycle = coordinate(self.cycle());
        for (number, run) in self.runs.iter().enumerate() {
            for copy in 0..run.names.len() {
                let places = run.frames.iter().map(|places| places.get(copy).copied());
                self.write_way(&mut text, &format!("c{number}-{copy}"), places, view);
            }
            for (index, hand) in run.hands.iter().enumerate() {
                self.write_way(&mut text, &format!("h{number}-{index}"), hand.frames.iter().copied().map(Some), view);
            }
            if let Some(frame) = run.left_at(view) {
                self.write_appearance(&mut text, &format!("g{number}"), frame);
            }
        }
        // Pieces of several copies and runs share their ends, and runs of different lengths have different last ends.
        let pieces = self.runs.iter().flat_map(|run| (0..run.names.len()).flat_map(|copy| run.pieces(copy)));
        let ends: BTreeSet<usize> = pieces.map(|piece| *piece.end()).collect();
        for end in ends {
            self.write_appearance(&mut text, &format!("p{end}"), end);
        }
        let frames = self.runs.iter().map(|run| run.frames.len()).max().unwrap_or(0);
        let shown = coordinate(self.share_of(frames.max(2) - 1));
        let _ = writeln!(text, "@keyframes elapsed{{0%{{transform:scaleX(0)}}{shown}%,100%{{transform:scaleX(1)}}}}");
        let _ = writeln!(text, ".elapsed{{animation:elapsed {cycle}s linear infinite}}");
        text.push_str("@media (prefers-reduced-motion:reduce){*{animation:none!important}}\n");
        text
    }

    /// Writes the class `name`, which moves a shape from place to place and leaves the shape at the last place while the last frame stays.
    fn write_way(&self, text: &mut String, name: &str, places: impl Iterator<Item = Option<[f64; 2]>>, view: &View) {
        let _ = write!(text, "@keyframes {name}{{");
        let mut last = String::new();
        for (frame, place) in places.enumerate() {
            let [x, y] = place.map_or([0.0; 2], |place| view.shift(place)).map(coordinate);
            last = format!("{{transform:translate({x}px,{y}px)}}");
            let _ = write!(text, "{}%{last}", coordinate(self.share_of(frame)));
        }
        let _ = writeln!(text, "100%{last}}}\n.{name}{{animation:{name} {}s linear infinite}}", coordinate(self.cycle()));
    }

    /// Writes the class `name`, which shows a shape from a frame on.
    fn write_appearance(&self, text: &mut String, name: &str, frame: usize) {
        let (share, cycle) = (coordinate(self.share_of(frame)), coordinate(self.cycle()));
        // The keyframes end without an opacity, so that the shape then has the opacity of the shape's other class, at once (`step-start`).
        let hidden = format!("0%,{share}%{{opacity:0;animation-timing-function:step-start}}");
        let _ = writeln!(text, "@keyframes {name}{{{hidden}}}\n.{name}{{animation:{name} {cycle}s infinite}}");
    }
}

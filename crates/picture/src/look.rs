//! How lines and areas look: colours that are told apart with any kind of colour vision, and dashes that are told apart without colour and on each other.

/// The look of a line: a colour and dashes, by its number.
///
/// The colours are those of Okabe & Ito (2008) without black and yellow, which vanish on one of the two grounds, and grey. They repeat after seven, dashes
/// after six, so 42 lines differ. Later lines are thinner and have gaps, so that the lines beneath are seen where they lie on each other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Look {
    pub(crate) colour: Option<usize>,
    pub(crate) dash: usize,
    pub(crate) thin: bool,
}

/// The colours by number.
pub(crate) const COLOURS: usize = 7;
/// Lengths of dashes and gaps \[px\].
pub(crate) const DASHES: [&str; 6] = ["", "9 6", "1.8 3.6", "10 3 2 3", "4 2.5", "12 3 2 3 2 3"];
/// Widths of lines of these dashes \[px\].
const WIDTHS: [&str; 6] = ["2.4", "1.5", "1.6", "1.5", "1.3", "1.3"];

impl Look {
    /// The look of the line of that number, counted from 0.
    #[must_use]
    pub const fn of(number: usize) -> Self {
        Self { colour: Some(number % COLOURS), dash: number % DASHES.len(), thin: false }
    }

    /// A thin grey dashed line that others are compared with.
    #[must_use]
    pub const fn reference() -> Self {
        Self { colour: None, dash: 4, thin: true }
    }

    /// A thin line, for one of many that have no name.
    #[must_use]
    pub const fn thin(self) -> Self {
        Self { thin: true, ..self }
    }

    /// This look without dashes.
    #[must_use]
    pub const fn solid(self) -> Self {
        Self { dash: 0, ..self }
    }

    pub(crate) fn stroke_class(self) -> String {
        self.colour.map_or_else(|| "line sr".to_owned(), |colour| format!("line s{colour}"))
    }

    pub(crate) fn fill_class(self) -> String {
        self.colour.map_or_else(|| "fr".to_owned(), |colour| format!("f{colour}"))
    }

    pub(crate) const fn width(self) -> &'static str {
        if self.thin { "0.9" } else { WIDTHS[self.dash % WIDTHS.len()] }
    }

    pub(crate) const fn dashes(self) -> &'static str {
        DASHES[self.dash % DASHES.len()]
    }
}

/// How an area is filled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fill {
    /// A light tint of the colour of the line of that number.
    Tint(usize),
    /// A deeper tint of that colour, for what lies within a light one.
    Deep(usize),
    /// A light grey.
    Grey,
    /// Grey lines from bottom left to top right, for content of another kind.
    Hatch,
    /// Grey lines from top left to bottom right.
    BackHatch,
}

impl Fill {
    pub(crate) fn class(self) -> String {
        match self {
            Self::Tint(number) => format!("tint f{}", number % COLOURS),
            Self::Deep(number) => format!("deep f{}", number % COLOURS),
            Self::Grey => "tint fr".to_owned(),
            Self::Hatch => "hatch".to_owned(),
            Self::BackHatch => "back-hatch".to_owned(),
        }
    }
}

/// What marks single points.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Marker {
    /// A filled disc.
    Disc,
    /// A filled square.
    Square,
    /// A triangle that points up.
    Triangle,
    /// A triangle that points down, for what lies below the axis.
    TriangleDown,
    /// A diamond.
    Diamond,
    /// An upright cross.
    Plus,
    /// A slanted cross.
    Cross,
}

impl Marker {
    /// The marker of the line of that number.
    #[must_use]
    pub const fn of(number: usize) -> Self {
        [Self::Disc, Self::Square, Self::Triangle, Self::Diamond, Self::Cross, Self::Plus, Self::TriangleDown][number % 7]
    }

    /// Corners around (0, 0), and whether they are filled; a disc has none.
    pub(crate) const fn strokes(self) -> (&'static [&'static [(f64, f64)]], bool) {
        match self {
            Self::Disc => (&[], true),
            Self::Square => (&[&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]], true),
            Self::Triangle => (&[&[(-1.1, 0.85), (1.1, 0.85), (0.0, -1.1)]], true),
            Self::TriangleDown => (&[&[(-1.1, -0.85), (1.1, -0.85), (0.0, 1.1)]], true),
            Self::Diamond => (&[&[(-1.25, 0.0), (0.0, -1.25), (1.25, 0.0), (0.0, 1.25)]], true),
            Self::Plus => (&[&[(-1.2, 0.0), (1.2, 0.0)], &[(0.0, -1.2), (0.0, 1.2)]], false),
            Self::Cross => (&[&[(-1.0, -1.0), (1.0, 1.0)], &[(-1.0, 1.0), (1.0, -1.0)]], false),
        }
    }
}

/// The colours of lines by number, then that of reference lines: on a light and on a dark ground. On white, Okabe & Ito's orange and sky blue would be too
/// faint; they are darker here until their contrast is 3.
const SERIES: [(&str, &str, &str); COLOURS + 1] = [
    ("0", "#0072b2", "#4aa8e8"),
    ("1", "#d55e00", "#ff8237"),
    ("2", "#009e73", "#20c493"),
    ("3", "#cc79a7", "#e59bc6"),
    ("4", "#c58800", "#f2b53a"),
    ("5", "#3a9ad9", "#8fd2f7"),
    ("6", "#777", "#b0b0b0"),
    ("r", "#6e7781", "#8b949e"),
];

/// What has neither a number nor a series.
const LIGHT: &str = r#".cohaptic-picture{font-family:Helvetica,Arial,"Liberation Sans","DejaVu Sans",sans-serif}
.cohaptic-picture text{white-space:pre}
.cohaptic-picture .paper{fill:#fff}
.cohaptic-picture .ink{fill:#1b1f24}
.cohaptic-picture .quiet{fill:#59636e}
.cohaptic-picture .frame{fill:none;stroke:#6e7781}
.cohaptic-picture .grid{fill:none;stroke:#e3e6ea}
.cohaptic-picture .line{fill:none;stroke-linejoin:round}
.cohaptic-picture .tint{fill-opacity:.22;stroke:none}
.cohaptic-picture .deep{fill-opacity:.5;stroke:none}
.cohaptic-picture .cells{stroke:none;shape-rendering:crispEdges}
.cohaptic-picture .hatching{fill:none;stroke:#57606a}
.cohaptic-picture .hatch{fill:url(#cohaptic-hatch)}
.cohaptic-picture .back-hatch{fill:url(#cohaptic-back-hatch)}
"#;
const DARK: &str = "\
.cohaptic-picture .paper{fill:#14181d}
.cohaptic-picture .ink{fill:#e6e9ec}
.cohaptic-picture .quiet{fill:#a3abb4}
.cohaptic-picture .frame{stroke:#8b949e}
.cohaptic-picture .grid{stroke:#2a3038}
.cohaptic-picture .tint{fill-opacity:.3}
.cohaptic-picture .hatching{stroke:#a3abb4}
";

/// The style sheet: one for all pictures, so that several can stand in one page of HTML.
pub(crate) fn style() -> String {
    let series = |dark: bool| -> String {
        let rule = |(name, on_white, on_black): &(&str, &str, &str)| {
            let colour = if dark { on_black } else { on_white };
            format!(".cohaptic-picture .s{name}{{stroke:{colour}}}.cohaptic-picture .f{name}{{fill:{colour}}}\n")
        };
        SERIES.iter().map(rule).collect()
    };
    format!("{LIGHT}{}@media (prefers-color-scheme: dark){{\n{DARK}{}}}\n", series(false), series(true))
}

/// What areas are hatched with: one set for all pictures, as the style sheet.
pub(crate) const PATTERNS: &str = r#"<defs>
<pattern id="cohaptic-hatch" width="6" height="6" patternUnits="userSpaceOnUse"><path class="hatching" stroke-width="0.9" d="M-1,1L1,-1M0,6L6,0M5,7L7,5"/></pattern>
<pattern id="cohaptic-back-hatch" width="6" height="6" patternUnits="userSpaceOnUse"><path class="hatching" stroke-width="0.9" d="M-1,5L1,7M0,0L6,6M5,-1L7,1"/></pattern>
</defs>
"#;

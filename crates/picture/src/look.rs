//! Looks of lines and areas: colours distinguishable with any colour vision, and dashes distinguishable without colour and on top of each other.

/// Look of a line: colour and dashes, chosen by a number.
///
/// The colours are those of Okabe & Ito (2008), without black and yellow, which are invisible on a dark or light background, and with grey. Colours repeat
/// after seven numbers and dashes after six, so 42 lines differ. Higher numbers have thinner lines with gaps, so that a line below stays visible.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Look {
    /// Index of the colour; `None` for the grey of reference lines.
    pub(crate) colour: Option<usize>,
    /// Index into [`DASHES`].
    pub(crate) dash: usize,
    pub(crate) thin: bool,
}

/// Number of colours.
pub(crate) const COLOURS: usize = 7;
/// Lengths of dashes and gaps \[px\].
pub(crate) const DASHES: [&str; 6] = ["", "9 6", "1.8 3.6", "10 3 2 3", "4 2.5", "12 3 2 3 2 3"];
/// Widths of lines \[px\], indexed like [`DASHES`].
const WIDTHS: [&str; 6] = ["2.4", "1.5", "1.6", "1.5", "1.3", "1.3"];

impl Look {
    /// Returns the look of line number `number`, from 0.
    #[must_use]
    pub const fn of(number: usize) -> Self {
        Self { colour: Some(number % COLOURS), dash: number % DASHES.len(), thin: false }
    }

    /// Returns the look of a reference line: thin, grey and dashed.
    #[must_use]
    pub const fn reference() -> Self {
        Self { colour: None, dash: 4, thin: true }
    }

    /// Makes the line thin, for one of many lines without a name.
    #[must_use]
    pub const fn thin(self) -> Self {
        Self { thin: true, ..self }
    }

    /// Removes the dashes.
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

/// Filling of an area.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fill {
    /// Light tint of the colour of the line with this number.
    Tint(usize),
    /// Deeper tint of the colour, for an area inside a light one.
    Deep(usize),
    /// Light grey.
    Grey,
    /// Grey lines from bottom left to top right, for content of another kind.
    Hatch,
    /// Grey lines from top left to bottom right.
    BackHatch,
    /// Grey lines from top left to bottom right over a light tint of the colour of the line with this number. The area is told from a heat map by its colour,
    /// and by the lines where a print has no colours.
    HatchedTint(usize),
}

impl Fill {
    /// Returns the classes of the shapes that draw an area, the lowest first.
    pub(crate) fn classes(self) -> Vec<String> {
        match self {
            Self::Tint(number) => vec![format!("tint f{}", number % COLOURS)],
            Self::Deep(number) => vec![format!("deep f{}", number % COLOURS)],
            Self::Grey => vec!["tint fr".to_owned()],
            Self::Hatch => vec!["hatch".to_owned()],
            Self::BackHatch => vec!["back-hatch".to_owned()],
            Self::HatchedTint(number) => [Self::Tint(number), Self::BackHatch].into_iter().flat_map(Self::classes).collect(),
        }
    }
}

/// Mark of single points.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Marker {
    /// Filled disc.
    Disc,
    /// Filled square.
    Square,
    /// Filled triangle pointing up.
    Triangle,
    /// Filled triangle pointing down, for a value below the axis.
    TriangleDown,
    /// Filled diamond.
    Diamond,
    /// Upright cross.
    Plus,
    /// Diagonal cross.
    Cross,
}

impl Marker {
    /// Returns the marker for the line of this number.
    #[must_use]
    pub const fn of(number: usize) -> Self {
        [Self::Disc, Self::Square, Self::Triangle, Self::Diamond, Self::Cross, Self::Plus, Self::TriangleDown][number % 7]
    }

    /// Returns the outlines around (0, 0) in units of half the marker's width, and whether they are filled. A disc has no outlines.
    pub(crate) const fn strokes(self) -> (&'static [&'static [(f64, f64)]], bool) {
        match self {
            Self::Disc => (&[], true),
            // Square and diamond have about the area of the disc, so that no line looks heavier by its markers.
            Self::Square => (&[&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]], true),
            // y grows downwards on a page: the corner with negative y is the upper tip.
            Self::Triangle => (&[&[(-1.1, 0.85), (1.1, 0.85), (0.0, -1.1)]], true),
            Self::TriangleDown => (&[&[(-1.1, -0.85), (1.1, -0.85), (0.0, 1.1)]], true),
            Self::Diamond => (&[&[(-1.25, 0.0), (0.0, -1.25), (1.25, 0.0), (0.0, 1.25)]], true),
            Self::Plus => (&[&[(-1.2, 0.0), (1.2, 0.0)], &[(0.0, -1.2), (0.0, 1.2)]], false),
            Self::Cross => (&[&[(-1.0, -1.0), (1.0, 1.0)], &[(-1.0, 1.0), (1.0, -1.0)]], false),
        }
    }
}

/// Name, colour on a light background and colour on a dark background of each line look, reference lines last. Okabe & Ito's orange and sky blue are
/// darkened for the light background to a contrast of 3.
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

/// Style rules that do not depend on the number of a line. The dark rules below replace colours only.
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

/// Returns the style sheet, equal for all pictures, so that several pictures can share a page.
pub(crate) fn style() -> String {
    let series = |dark: bool| -> String {
        let rule = |(name, on_white, on_black): &(&str, &str, &str)| {
            let colour = if dark { on_black } else { on_white };
            format!(".cohaptic-picture .s{name}{{stroke:{colour}}}.cohaptic-picture .f{name}{{fill:{colour}}}\n")
        };
        SERIES.iter().map(rule).collect()
    };
    // The dark rules come last, because the later of two rules with equal weight wins.
    format!("{LIGHT}{}@media (prefers-color-scheme: dark){{\n{DARK}{}}}\n", series(false), series(true))
}

/// Hatch patterns, equal for all pictures like the style sheet.
pub(crate) const PATTERNS: &str = r#"<defs>
<pattern id="cohaptic-hatch" width="6" height="6" patternUnits="userSpaceOnUse"><path class="hatching" stroke-width="0.9" d="M-1,1L1,-1M0,6L6,0M5,7L7,5"/></pattern>
<pattern id="cohaptic-back-hatch" width="6" height="6" patternUnits="userSpaceOnUse"><path class="hatching" stroke-width="0.9" d="M-1,5L1,7M0,0L6,6M5,-1L7,1"/></pattern>
</defs>
"#;

//! Draws curves, regions and maps as SVG documents fit for print, HTML pages with them, and moving pictures.
//!
//! Use this crate if your program draws curves, maps or bars for print and for pages.
//!
//! A [`Picture`] has a title, notes and a grid of [`Panel`]s. A panel has two [`Axis`] and contents: [`Line`], [`Band`], [`Region`], [`HeatMap`], [`Rug`].
//! Texts are wrapped and never leave the picture or overlap, computed with widths that no common font exceeds. The legend is outside the plots. Lines
//! differ in colour and in dashes. A picture is light or dark by the reader's preference, in a file, in an `<img>` and in a page. Text stays text. The
//! [`Size`] is a column or two columns of a paper, a page on a screen, or given in numbers. A [`Motion`] shows moving copies.
//!
//! This crate reads no file and no clock, and prints nothing: equal pictures give equal bytes. Callers choose the content.
//!
//! ```
//! use cohaptic_picture::{Axis, Line, Look, Panel, Picture, Size};
//!
//! let panel = Panel::new(Axis::new("Time").symbol("t").unit("s"), Axis::new("Position").symbol("x_O").unit("cm"))
//!     .with(Line::new((0..100).map(f64::from).map(|t| (t, t.sin())), Look::of(0)).named("left"))
//!     .with(Line::level(0.5).named("goal"));
//! let svg = Picture::new("Three copies").note("what goes far beyond is cut off").size(Size::ONE_COLUMN).panel(panel).svg();
//! assert!(svg.starts_with("<svg ") && svg.contains(">goal</text>"));
//! ```
//!
//! # Why no plotting crate
//!
//! Earlier pictures were drawn with `plotters`. The judgement rests on those pictures and on the documentation; no second implementation was made with it.
//! Its SVG backend works in whole pixels, cuts titles that are too long, places the legend over the data, and lacks subscripts, a style sheet for dark
//! pages, hatching and colour bars; its logarithmic axis had to be replaced in two places. Most of this crate is about room for text, which `plotters` does
//! not handle, and the mapping of numbers to pixels is a line here. The colours of heat maps come from `colorous`.
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact values"))]

mod advance;
mod axis;
mod content;
mod draw;
mod ends;
mod extent;
mod gauge;
mod layout;
mod legend;
mod look;
mod motion;
pub mod page;
mod panel;
mod path;
mod picture;
mod size;
#[cfg(feature = "testing")]
pub mod testing;
mod text;
mod ticks;
mod xml;

pub use axis::Axis;
pub use content::{Band, Content, HeatMap, Line, Region, Rug, cell_edges};
pub use gauge::Gauge;
pub use legend::LegendPlace;
pub use look::{Fill, Look, Marker};
pub use motion::{Motion, MotionHand, MotionRun};
pub use panel::Panel;
pub use picture::Picture;
pub use size::{Size, SizeError};
pub use text::Text;
pub use xml::escape;

//! Pictures of curves, regions and maps as SVG documents that are fit to print, pages of HTML that show them, and pictures that move.
//!
//! You need it if your program draws curves, maps or bars for print and for pages.
//!
//! A [`Picture`] has a title, notes and [`Panel`]s in a grid; a panel has two [`Axis`] and contents: [`Line`], [`Band`], [`Region`], [`HeatMap`], [`Rug`].
//! Texts wrap and never leave the picture or lie on each other, by widths that no common font exceeds; the legend is outside of the plots; lines differ by
//! colour and by dashes. A picture is light or dark as its reader prefers, in a file, in an `<img>` and within a page. Text stays text. The [`Size`] is one or
//! two columns of a paper, a page on a screen, or given. A [`Motion`] shows copies that move.
//!
//! This crate reads no file and no clock, and prints nothing: equal pictures are equal bytes. The choice of content is the callers'.
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
//! `plotters` drew the pictures before. It was judged by those pictures and by its documentation; no second implementation was made with it. Its SVG backend works in
//! whole pixels, a title that is too long is cut off, the legend lies over the data, and there are no subscripts, no style sheet for a dark page, no hatching and no
//! colour bar; its logarithmic axis had been replaced in two places. The rest, mapping a number to a pixel, is a line here. Nearly all of this crate is
//! about room for text, which it does not know. The colours of heat maps come from `colorous`.
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

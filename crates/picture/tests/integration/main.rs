//! Pictures as seen by a reader: in any picture no text is outside the picture or overlaps another.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "these are tests, which say what they skip")]

mod any_picture;
mod browser;
mod gallery;

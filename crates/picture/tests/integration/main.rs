//! Pictures as a reader sees them: no text outside, none on another, whatever is asked for.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "these are tests, which say what they skip")]

mod any_picture;
mod browser;
mod gallery;

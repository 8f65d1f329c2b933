//! Pictures as a reader sees them: no text outside, none on another, whatever is asked for.

mod any_picture;
mod browser;
mod gallery;

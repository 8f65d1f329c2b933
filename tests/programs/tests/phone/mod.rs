//! The blocks of docs/testing.md that use axum, as they stand there, and what the first of them comes to.

mod each_part;
mod whole_photo;

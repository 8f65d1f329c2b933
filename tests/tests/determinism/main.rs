//! The same scene and seed give the same bytes, whatever the machinery, the number of threads, and who else takes part.

mod bystander;
mod models;
mod threads;

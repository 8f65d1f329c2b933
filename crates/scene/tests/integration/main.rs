//! Scenes as other crates read them: whole files, and files that something happened to.

mod every_key;
mod files;
mod mutations;

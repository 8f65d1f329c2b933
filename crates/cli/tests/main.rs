//! Command line as its users meet it ([`integration`]), and every command on the pages of this project ([`pages`]). Both are one program, so that shared code
//! is compiled once.

mod integration;
#[cfg(target_os = "linux")]
mod pages;
mod process;

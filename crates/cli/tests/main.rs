//! The command line as its users meet it ([`integration`]), and every command on the pages of this project ([`pages`]). They are one program, so that what they
//! share is compiled once.

mod integration;
#[cfg(target_os = "linux")]
mod pages;

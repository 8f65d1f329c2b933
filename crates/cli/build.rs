//! Links the program of debug builds at a fixed address.
//!
//! Tests start the program three thousand times. At any other address the loader writes 160,000 pointers, so that half of the page faults of a start, and a
//! quarter of its processor time, are relocation. Programs that people use keep their random addresses.

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let is = |name: &str, value: &str| env::var(name).is_ok_and(|found| found == value);
    if is("PROFILE", "debug") && is("CARGO_CFG_TARGET_OS", "linux") && is("CARGO_CFG_TARGET_ENV", "gnu") {
        println!("cargo:rustc-link-arg-bins=-no-pie");
    }
}

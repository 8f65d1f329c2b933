//! The test kit with scene files and relay files.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod chapter;
mod files;
mod measured_line;
mod scenes;

/// The message with which something fails.
fn message(act: impl FnOnce()) -> String {
    let panic = std::panic::catch_unwind(std::panic::AssertUnwindSafe(act)).unwrap_err();
    panic.downcast_ref::<String>().cloned().or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap()
}

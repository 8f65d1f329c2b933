//! The browser of the desktop, if there is one.

use std::env;
use std::io::{IsTerminal as _, stderr, stdout};
use std::os::unix::process::CommandExt as _;
use std::process::{Command, Stdio};
use std::thread;

/// Opens an address in the browser that the user prefers, by the rules of the desktop: <https://www.freedesktop.org/wiki/Software/xdg-utils/>.
const OPENER: &str = "xdg-open";

/// Whether a person sits at a desktop: at a terminal, with a display, and not a machine that runs tests.
pub(super) fn is_there() -> bool {
    let is_set = |name: &str| env::var_os(name).is_some_and(|value| !value.is_empty());
    stdout().is_terminal() && stderr().is_terminal() && ["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(is_set) && !is_set("CI")
}

/// Opens the address. The page can be opened by hand as well, so that nothing is said where that fails.
pub(super) fn open(url: &str) {
    let mut command = Command::new(OPENER);
    command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // In a process group of its own: the Ctrl-C that ends the session leaves the browser alone.
    command.process_group(0);
    if let Ok(mut child) = command.spawn() {
        // Some openers stay until the browser ends. If there is no thread to wait for it, the system does when the session ends.
        let _ = thread::Builder::new().name("browser".to_owned()).spawn(move || child.wait());
    }
}

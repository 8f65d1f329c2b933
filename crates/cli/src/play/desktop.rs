//! Opens the session's page in the browser of the desktop, if the program runs on a desktop.

use std::env;
use std::io::{IsTerminal as _, stderr, stdout};
use std::os::unix::process::CommandExt as _;
use std::process::{Command, Stdio};
use std::thread;

/// Program that opens an address in the user's preferred browser, by the rules of the desktop: <https://www.freedesktop.org/wiki/Software/xdg-utils/>.
const OPENER: &str = "xdg-open";

/// Returns whether the program runs on a desktop: both outputs are terminals, a display is set, and `CI` is not set.
pub(super) fn is_there() -> bool {
    let is_set = |name: &str| env::var_os(name).is_some_and(|value| !value.is_empty());
    stdout().is_terminal() && stderr().is_terminal() && ["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(is_set) && !is_set("CI")
}

/// Opens the address in the browser. A failure is not reported, because the user can open the printed address by hand.
pub(super) fn open(url: &str) {
    let mut command = Command::new(OPENER);
    command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // The browser gets a process group of its own, so that a Ctrl-C to the session does not end the browser.
    command.process_group(0);
    if let Ok(mut child) = command.spawn() {
        // Some openers run until the browser ends, so that the wait needs a thread of its own. If the thread cannot be started, the system collects the
        // opener's exit status when the session ends.
        let _ = thread::Builder::new().name("browser".to_owned()).spawn(move || child.wait());
    }
}

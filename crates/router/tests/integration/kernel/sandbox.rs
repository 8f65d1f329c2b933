//! Process in namespaces of its own.

use std::env;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Variable that is set in the inner process.
const INSIDE: &str = "COHAPTIC_ROUTER_TEST_INSIDE";

/// Bound of a test. Every wait of a test ends far earlier, so a longer test hangs.
const LONGEST: Duration = Duration::from_secs(300);

/// Child process that is killed when this value is dropped, even if the test panics.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

/// Runs the test `name` again in a process with a network and a user of its own, and `body` there.
pub(super) fn inside(name: &str, body: impl FnOnce()) {
    inside_one_of(["-Urn", "-n"], name, body);
}

/// Like [`inside`], but keeps the present user if that user is root, because the root of a user namespace gets no `SCHED_FIFO`.
pub(super) fn inside_as_root(name: &str, body: impl FnOnce()) {
    inside_one_of(["-n", "-Urn"], name, body);
}

fn inside_one_of(namespaces: [&str; 2], name: &str, body: impl FnOnce()) {
    if env::var_os(INSIDE).is_some() {
        if let Err(error) = std::fs::OpenOptions::new().read(true).write(true).open("/dev/net/tun") {
            println!("skipped: /dev/net/tun cannot be opened: {error}");
            return;
        }
        body();
        return;
    }
    let Some(namespaces) = namespaces.into_iter().find(|namespaces| allows(namespaces)) else {
        println!("skipped: this system allows no network namespaces (`unshare -Urn true` fails)");
        return;
    };
    let mut command = Command::new("unshare");
    command.args([namespaces, "--"]).arg(env::current_exe().unwrap()).args([name, "--exact", "--nocapture", "--include-ignored"]).env(INSIDE, "1");
    let mut child = Killed(command.spawn().unwrap());
    let begin = Instant::now();
    loop {
        if let Some(status) = child.0.try_wait().unwrap() {
            assert!(status.success(), "{name} failed inside: {status}");
            return;
        }
        assert!(begin.elapsed() < LONGEST, "{name} has hung");
        thread::sleep(Duration::from_millis(5));
    }
}

fn allows(namespaces: &str) -> bool {
    let status = Command::new("unshare").args([namespaces, "true"]).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

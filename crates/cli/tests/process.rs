//! Processes of tests.
#![expect(clippy::unwrap_used, reason = "a test may fail")]

use std::io::{Read, Write};
use std::process::{Command, Output, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// Runs a command with these bytes on standard input. A command that takes longer than `patience` is ended, and then has no status.
pub(crate) fn output(command: &mut Command, input: &[u8], patience: Duration) -> Output {
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let (mut stdin, stdout, stderr) = (child.stdin.take().unwrap(), child.stdout.take().unwrap(), child.stderr.take().unwrap());
    thread::scope(|threads| {
        // A command may end before it has read everything, so that an error is no failure.
        threads.spawn(move || drop(stdin.write_all(input)));
        let (at_work, end) = mpsc::channel::<()>();
        let [stdout, stderr]: [Box<dyn Read + Send>; 2] = [Box::new(stdout), Box::new(stderr)];
        let [stdout, stderr] = [stdout, stderr].map(|mut pipe| {
            let at_work = at_work.clone();
            threads.spawn(move || {
                let mut bytes = Vec::new();
                pipe.read_to_end(&mut bytes).unwrap();
                drop(at_work);
                bytes
            })
        });
        drop(at_work);
        // The last reader closes the channel when both outputs have ended.
        if end.recv_timeout(patience) == Err(RecvTimeoutError::Timeout) {
            child.kill().unwrap();
        }
        Output { status: child.wait().unwrap(), stdout: stdout.join().unwrap(), stderr: stderr.join().unwrap() }
    })
}

#[cfg(unix)]
#[test]
fn a_process_reads_and_prints_at_once_and_is_ended_after_the_patience() {
    // More than pipes hold.
    let text = [b'a'; 1 << 20];
    let copied = output(&mut Command::new("cat"), &text, Duration::from_secs(900));
    assert!(copied.status.success() && copied.stdout == text && copied.stderr.is_empty(), "{:?}", copied.status);
    let ended = output(Command::new("sleep").arg("900"), &text, Duration::from_millis(20));
    assert_eq!((ended.status.code(), ended.stdout.len()), (None, 0));
}

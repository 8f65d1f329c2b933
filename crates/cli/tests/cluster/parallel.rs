//! GNU parallel.

use std::process::{Command, Stdio};

use crate::work::{SHARDS, Work, has, kill, words};

/// The command that does all shards, two at a time.
pub(crate) fn command(work: &Work, folder: &str) -> Command {
    let mut command = work.command("parallel");
    command.env("HOME", work.path("")).args(["--will-cite", "-N0", "--jobs", "2", "--retries", "3", "cohaptic"]).args(words());
    command.args(["--out", folder, "--shard", &format!("auto/{SHARDS}"), ":::"]).args((1..=SHARDS).map(|number| number.to_string()));
    command
}

#[test]
fn gnu_parallel_does_a_shard_again_whose_worker_was_killed() {
    if !has("parallel") {
        eprintln!("skipped: GNU parallel is not installed");
        return;
    }
    let work = Work::new();
    let child = command(&work, "losses").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let killed = work.kill_a_worker(kill);
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(said.matches("shard ").count(), SHARDS, "{said}");
    work.assert_killed(killed);
    let merged = work.cohaptic("--merge losses").output().unwrap();
    assert!(merged.status.success(), "{}", String::from_utf8_lossy(&merged.stderr));
    work.assert_whole();
}

//! Two processes that write the same files at the same time.

use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use cohaptic_files::OwnFolder;

use crate::integration::desk::Desk;
use crate::integration::scenes::TWO;

/// A run that has taken a folder and waits for the reader of a pipe in it.
fn waiting_in(desk: &Desk, folder: &str) -> Child {
    std::fs::create_dir_all(desk.path(folder)).unwrap();
    assert!(Command::new("mkfifo").arg(desk.path(folder).join("trajectory.csv")).status().unwrap().success());
    let mut child = desk.command(&format!("run two.toml --no-plot --out {folder}")).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !OwnFolder::is_taken(&desk.path(folder)) {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        sleep(Duration::from_millis(5));
    }
    child
}

/// Every command with `--out` that writes files which belong together.
#[test]
fn a_folder_takes_one_process_at_a_time() {
    let desk = Desk::with("two.toml", TWO);
    let mut first = waiting_in(&desk, "out");
    let ranges = "--x coordination.stiffness=100..6000 --y coordination.damping=0..60";
    for line in [
        "run two.toml --out out",
        "explain two.toml --cost --out out",
        "admittance two.toml --peer left --points 5 --out out",
        &format!("stability map two.toml {ranges} --grid 2x2 --out out"),
        &format!("stability map two.toml {ranges} --prove 1 --out out"),
        "stability boundary two.toml --along coordination.stiffness=0..5000 --samples 20 --out out",
        "stability boundary two.toml --along coordination.stiffness=0..5000 --prove --out out",
        "paper --quick --out out",
        "man --out out",
        #[cfg(target_os = "linux")]
        "live two.toml --out out",
        #[cfg(target_os = "linux")]
        "play --no-open --for 1s --out out",
    ] {
        desk.cohaptic(line).assert_refused(3, &["out: another process writes into this folder", "wait until it has ended, or choose another folder"]);
    }
    let shard = format!("stability map two.toml {ranges} --grid 2x2 --out out --shard 1/2");
    desk.cohaptic(&shard).assert_refused(3, &["another process works on all shards in out"]);
    assert_eq!(desk.files("out"), ["cohaptic.lock", "trajectory.csv"]);
    // The file of the lock stays, and the lock goes with its process.
    first.kill().unwrap();
    first.wait().unwrap();
    std::fs::remove_file(desk.path("out/trajectory.csv")).unwrap();
    assert_eq!(desk.files("out"), ["cohaptic.lock"]);
    desk.text("run two.toml --out out");
    assert!(desk.files("out").iter().all(|name| !name.contains("partial") && !name.contains("lock")), "{:?}", desk.files("out"));
}

/// The folder of a variant is written by the same run.
#[test]
fn a_run_with_a_variant_takes_both_folders() {
    let desk = Desk::with("two.toml", TWO);
    let mut first = waiting_in(&desk, "out/against");
    desk.cohaptic("run two.toml --out out --against link.delay=8ms").assert_refused(3, &["cannot write out/against: another process"]);
    first.kill().unwrap();
    first.wait().unwrap();
}

/// The bytes of two runs were mixed in one file, and both ended with status 0.
#[test]
fn of_two_that_write_one_file_the_last_is_there_whole() {
    let desk = Desk::new();
    let line = |delay: u32| format!("link delay {delay}ms --packets 50000 --fates fates.csv");
    let alone = [10, 20].map(|delay| {
        desk.text(&line(delay));
        desk.read("fates.csv")
    });
    std::fs::remove_file(desk.path("fates.csv")).unwrap();
    for _ in 0..3 {
        let begin = |delay| desk.command(&line(delay)).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let mut children = [10, 20].map(begin);
        while children.iter_mut().any(|child| child.try_wait().unwrap().is_none()) {
            sleep(Duration::from_millis(5));
        }
        assert!(children.iter_mut().all(|child| child.wait().unwrap().success()));
        let found = desk.read("fates.csv");
        assert!(alone.contains(&found), "{} bytes of {:?}", found.len(), alone.each_ref().map(String::len));
        assert_eq!(desk.files(""), ["fates.csv"]);
    }
}

/// The partial file of a killed process is known by the end of its name, and the next process that writes the file removes it.
#[test]
fn a_partial_file_of_a_killed_process_does_not_stay() {
    let desk = Desk::new();
    let mut child = desk.command("link delay 20ms --packets 100000000 --fates f.csv").stdout(Stdio::null()).spawn().unwrap();
    while !desk.path("f.csv.partial").metadata().is_ok_and(|file| file.len() > 0) {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        sleep(Duration::from_millis(5));
    }
    // Beside one that lives, another name is taken.
    desk.text("link delay 20ms --packets 10 --fates f.csv");
    assert_eq!(desk.files(""), ["f.csv", "f.csv.partial"]);
    child.kill().unwrap();
    child.wait().unwrap();
    desk.text("link delay 20ms --packets 10 --fates f.csv");
    assert_eq!(desk.files(""), ["f.csv"]);
}

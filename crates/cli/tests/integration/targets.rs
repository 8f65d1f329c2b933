//! Files that are written to pipes, devices and links: the bytes go where they were sent, and nothing is replaced by a regular file.

use std::fs::{self, File};
use std::os::unix::fs::{FileTypeExt as _, symlink};
use std::process::{Command, Stdio};
use std::thread;

use crate::integration::desk::{Desk, Outcome};
use crate::integration::scenes::TWO;

/// Each option that names one file, with `FILE` in its place, and what the file begins with.
const OPTIONS: [(&str, &str); 10] = [
    ("link delay 20ms --packets 50 --fates FILE", "sequence,copy,"),
    ("link delay 20ms --packets 50 --pcapng FILE", "\n\r\r\n"),
    ("run two.toml --no-plot --motion FILE", "<svg"),
    ("run two.toml --no-plot --links FILE", "link,"),
    ("check two.toml --page FILE", "<!DOCTYPE html>"),
    ("stability point two.toml --every-number 2..3 --certificate FILE", "{"),
    ("falcon watch --simulated --virtual-time --for 20ms --csv FILE", "t,phase,"),
    ("fit fates.csv --out FILE", "[link]"),
    ("init FILE --force", "#"),
    ("live --new-key FILE", "never written"),
];

fn desk() -> Desk {
    let desk = Desk::with("two.toml", TWO);
    desk.text("link delay 20ms 2ms --packets 1000 --fates fates.csv");
    desk
}

fn succeeds(desk: &Desk, line: &str) {
    let outcome = desk.cohaptic(line);
    assert_eq!(outcome.status, Some(0), "{line}: {}", outcome.stderr);
}

/// Returns the bytes that come out of a pipe in the place of a file.
fn through_pipe(desk: &Desk, name: &str, line: &str) -> (Outcome, Vec<u8>) {
    let pipe = desk.path(name);
    let _ = fs::remove_file(&pipe);
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    // Open at both ends, so that nobody waits for a program that does not open the pipe.
    let open = File::options().read(true).write(true).open(&pipe).unwrap();
    let mut reader = File::open(&pipe).unwrap();
    let read = thread::spawn(move || {
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut reader, &mut bytes).map(|_| bytes).unwrap()
    });
    let outcome = desk.cohaptic(&line.replace("FILE", name));
    drop(open);
    (outcome, read.join().unwrap())
}

#[test]
fn a_pipe_takes_what_a_file_would_hold_and_stays_a_pipe() {
    let desk = desk();
    for (line, beginning) in OPTIONS {
        let (outcome, bytes) = through_pipe(&desk, "pipe", line);
        assert!(fs::symlink_metadata(desk.path("pipe")).unwrap().file_type().is_fifo(), "{line}");
        if line.starts_with("live") {
            // A key is never written over anything.
            outcome.assert_refused(3, &["the key file pipe exists already and is never replaced"]);
            assert_eq!(bytes, b"");
            continue;
        }
        assert_eq!(outcome.status, Some(0), "{line}: {}", outcome.stderr);
        assert!(bytes.starts_with(beginning.as_bytes()), "{line}: {}", String::from_utf8_lossy(&bytes));
        succeeds(&desk, &line.replace("FILE", "file"));
        assert!(fs::read(desk.path("file")).unwrap() == bytes, "{line}");
    }
    assert!(fs::read_dir(desk.path("")).unwrap().all(|entry| !entry.unwrap().file_name().to_string_lossy().contains("partial")));
}

#[test]
fn a_link_is_followed_also_to_a_free_name() {
    let desk = desk();
    fs::create_dir(desk.path("elsewhere")).unwrap();
    for (line, beginning) in OPTIONS.into_iter().filter(|(line, _)| !line.starts_with("live")) {
        for old in [None, Some("old")] {
            let _ = (fs::remove_file(desk.path("link")), fs::remove_file(desk.path("elsewhere/file")));
            symlink("elsewhere/file", desk.path("link")).unwrap();
            old.into_iter().for_each(|old| desk.write("elsewhere/file", old));
            succeeds(&desk, &line.replace("FILE", "link"));
            assert!(desk.path("link").symlink_metadata().unwrap().is_symlink(), "{line}");
            assert!(fs::read(desk.path("elsewhere/file")).unwrap().starts_with(beginning.as_bytes()), "{line}");
        }
    }
}

/// The name under which a file was written until it is whole could be foreseen, and a link in its place was followed.
#[test]
fn a_link_in_the_place_of_the_partial_file_is_left_alone() {
    let desk = desk();
    desk.write("victim", "precious");
    symlink("victim", desk.path("file.partial")).unwrap();
    for (line, _) in OPTIONS.into_iter().filter(|(line, _)| !line.starts_with("live")) {
        succeeds(&desk, &line.replace("FILE", "file"));
        assert_eq!(desk.read("victim"), "precious", "{line}");
        assert!(desk.path("file.partial").symlink_metadata().unwrap().is_symlink(), "{line}");
    }
    // Rows that are kept for the next time are written without following a link too.
    fs::create_dir(desk.path("out")).unwrap();
    symlink("../victim", desk.path("out/map.rows.partial")).unwrap();
    let map = "stability map two.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..60 --grid 2x2 --out out";
    desk.cohaptic(map).assert_refused(3, &["cannot write out/map.rows.partial: it is not a regular file"]);
    assert_eq!(desk.read("victim"), "precious");
}

/// A folder of `--out` may hold links and pipes under the names of its files.
#[test]
fn links_in_the_folder_are_followed() {
    let desk = desk();
    desk.write("elsewhere/packets.csv", "old");
    fs::create_dir(desk.path("out")).unwrap();
    symlink("../elsewhere/trajectory.csv", desk.path("out/trajectory.csv")).unwrap();
    symlink("../elsewhere/packets.csv", desk.path("out/packets.csv")).unwrap();
    desk.text("run two.toml --out out");
    desk.text("run two.toml --out plain");
    for file in ["trajectory.csv", "packets.csv"] {
        assert!(desk.path("out").join(file).symlink_metadata().unwrap().is_symlink(), "{file}");
        assert!(desk.read(&format!("elsewhere/{file}")) == desk.read(&format!("plain/{file}")), "{file}");
    }
    assert_eq!(desk.files("elsewhere"), ["packets.csv", "trajectory.csv"]);
    let (outcome, bytes) = through_pipe(&desk, "out/links.csv", "run two.toml --out out");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(desk.read("plain/links.csv").as_bytes() == bytes && desk.path("out/links.csv").metadata().unwrap().file_type().is_fifo());
}

/// Both go to one place, one after the other.
#[test]
fn standard_output_takes_a_file_too() {
    let desk = desk();
    for (name, options) in [("new", File::options().write(true).create(true).clone()), ("added", File::options().append(true).create(true).clone())] {
        let file = options.open(desk.path(name)).unwrap();
        let mut command = desk.command("link delay 20ms --packets 50 --fates /dev/stdout");
        let status = command.stdout(file).stderr(Stdio::null()).status().unwrap();
        let text = desk.read(name);
        assert!(status.success() && text.starts_with("sequence,copy,") && text.matches(",delivered,").count() == 50, "{text}");
        assert_eq!(text.matches("packets").count(), desk.text("link delay 20ms --packets 50").matches("packets").count(), "{text}");
    }
}

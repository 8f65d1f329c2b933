//! Outputs and files that cannot be written: exit status 3 and a message, never a panic.

use std::process::Stdio;

use crate::integration::desk::{Desk, Outcome, parse};
use crate::integration::scenes::TWO;

const COMMANDS: [&str; 10] = [
    "run two.toml",
    "run two.toml --json",
    "explain two.toml",
    "check two.toml",
    "check two.toml --json",
    "init --list",
    "man run",
    "--help",
    "help run",
    "--version",
];

/// With `-q`, standard error has only errors.
#[test]
fn a_quiet_command_says_nothing_but_its_answer() {
    let desk = Desk::with("two.toml", TWO);
    for line in ["run two.toml --out out", "run two.toml -o out -q", "-q run two.toml --out out"] {
        let outcome = desk.cohaptic(line);
        assert_eq!((outcome.status, outcome.stderr.is_empty()), (Some(0), line.contains("-q")), "{line}: {}", outcome.stderr);
        assert!(outcome.stdout.contains("200ms simulated") && desk.path("out/trajectory.csv").exists(), "{}", outcome.stdout);
    }
    desk.cohaptic("run gone.toml -q").assert_refused(3, &["gone.toml: cannot be read"]);
}

#[test]
fn a_file_in_the_way_of_the_folder_is_named() {
    let desk = Desk::with("two.toml", TWO);
    desk.write("out", "a file");
    desk.cohaptic("run two.toml --out out").assert_refused(3, &["error: cannot write out: "]);
    desk.cohaptic("run two.toml --out out/within").assert_refused(3, &["error: cannot write out"]);
    assert_eq!(desk.read("out"), "a file");
}

#[test]
fn a_folder_in_the_way_of_a_file_is_named() {
    let desk = Desk::with("two.toml", TWO);
    desk.write("out/trajectory.csv/notes.txt", "mine");
    desk.cohaptic("run two.toml --out out").assert_refused(3, &["error: cannot write ", "trajectory.csv"]);
    assert_eq!(desk.read("out/trajectory.csv/notes.txt"), "mine");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_output_error() {
    let desk = Desk::with("two.toml", TWO);
    for line in COMMANDS {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = desk.command(line).stdout(full).stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
        Outcome::of(output).assert_refused(3, &["error: cannot write to standard output: "]);
    }
}

/// The standard library ignores errors of a standard output that is not open for writing. The program must report them.
#[cfg(target_os = "linux")]
#[test]
fn a_standard_output_that_cannot_be_written_to_is_an_error() {
    let desk = Desk::with("two.toml", TWO);
    for line in COMMANDS.into_iter().chain(["falcon watch --simulated --virtual-time --for 20ms"]) {
        let unwritable = std::fs::File::open("/dev/null").unwrap();
        let output = desk.command(line).stdout(unwritable).stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
        Outcome::of(output).assert_refused(3, &["error: cannot write to standard output: "]);
    }
}

/// A reader that closes the pipe early, such as `head`, causes no message.
#[cfg(unix)]
#[test]
fn a_reader_that_has_gone_is_no_error() {
    let desk = Desk::with("two.toml", TWO);
    for line in COMMANDS {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = desk.command(line).stdout(writer).stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
        assert_eq!((output.status.code(), String::from_utf8(output.stderr).unwrap().as_str()), (Some(141), ""), "{line}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_record_on_a_full_device_is_named() {
    for file in ["trajectory.csv", "packets.csv", "links.csv", "positions.svg"] {
        // Long enough for more than one buffer of a trajectory, and not for the first of the packets.
        for duration in ["100ms", "2s"] {
            let desk = Desk::with("two.toml", TWO);
            std::fs::create_dir(desk.path("out")).unwrap();
            std::os::unix::fs::symlink("/dev/full", desk.path("out").join(file)).unwrap();
            let refused = desk.cohaptic(&format!("run two.toml --out out --set scene.duration={duration}"));
            refused.assert_refused(3, &[&format!("error: cannot write out/{file}: No space left")]);
            assert!(desk.path("out").join(file).symlink_metadata().unwrap().is_symlink(), "{file}");
        }
    }
}

/// The limit of the shell for the length of files stands for a disk without room.
#[cfg(target_os = "linux")]
#[test]
fn a_record_that_finds_no_room_never_takes_its_name() {
    for duration in ["100ms", "2s"] {
        let desk = Desk::with("two.toml", TWO);
        let mut command = std::process::Command::new("sh");
        command.args(["-c", "trap '' XFSZ; ulimit -f 4; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_cohaptic")]).current_dir(desk.path(""));
        command.args(["run", "two.toml", "--out", "out", "--set", &format!("scene.duration={duration}")]);
        let refused = Outcome::of(command.output().unwrap());
        refused.assert_refused(3, &["error: cannot write out/trajectory.csv.partial: File too large"]);
        assert!(!desk.path("out/trajectory.csv").exists() && desk.path("out/trajectory.csv.partial").exists());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn without_anywhere_to_complain_the_exit_status_still_tells() {
    let desk = Desk::with("two.toml", TWO);
    for (line, status) in [("run two.toml", 3), ("run nowhere.toml", 3), ("run two.toml --set object.mass=-1", 2), ("fly", 2)] {
        let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
        let code = desk.command(line).stdout(full()).stderr(full()).status().unwrap().code();
        assert_eq!(code, Some(status), "{line}");
    }
}

#[test]
fn what_could_disturb_a_terminal_is_escaped() {
    let desk = Desk::with("two.toml", &TWO.replace("Two users", "Two \\u001b[31musers\\u0007"));
    for line in ["run two.toml", "explain two.toml"] {
        let text = desk.text(line);
        assert!(text.starts_with("Two \\u{1b}[31musers\\u{7}\n"), "{text:?}");
    }
    // JSON has escapes of its own.
    assert_eq!(desk.json("run two.toml --json")["title"], "Two \u{1b}[31musers\u{7}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_path_that_is_no_unicode_does_not_spoil_the_document() {
    use std::os::unix::ffi::OsStrExt as _;
    let desk = Desk::with("two.toml", TWO);
    let name = std::ffi::OsStr::from_bytes(b"\xff");
    let document = |command: &mut std::process::Command| {
        let outcome = Outcome::of(command.output().unwrap());
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        parse(&outcome.stdout)
    };
    let run = document(desk.command("run two.toml --json --out").arg(name));
    assert_eq!(run["files"][0], "\u{fffd}/trajectory.csv");
    assert!(desk.path("").join(name).join("trajectory.csv").exists());
    let other = std::ffi::OsStr::from_bytes(b"\xfe.toml");
    std::fs::copy(desk.path("two.toml"), desk.path("").join(other)).unwrap();
    assert_eq!(document(desk.command("check --json").arg(other))["scenes"][0]["file"], "\u{fffd}.toml");
}

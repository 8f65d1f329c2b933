//! `cohaptic tokio` and `cohaptic test`, with a stand-in for cargo that does not compile.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::integration::desk::{Desk, Outcome};
use crate::integration::running::PATIENCE;

/// Returns the version of tokio in the project's lock file, whose sources cargo has.
fn version() -> String {
    let lock = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../Cargo.lock")).unwrap();
    lock.split_once("name = \"tokio\"\nversion = \"").unwrap().1.split('"').next().unwrap().to_owned()
}

fn lock() -> String {
    format!(
        "version = 4\n\n[[package]]\nname = \"tokio\"\nversion = \"{}\"\nsource = \"registry+https://github.com/rust-lang/crates.io-index\"\n",
        version()
    )
}

/// A program with a test over the test kit. The test kit has the features `features`.
fn program(features: &str) -> Desk {
    let kit = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testkit");
    let desk = Desk::new();
    let manifest = format!(
        "[package]\nname = \"program\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[dependencies]\ntokio = \"1\"\n\n[dev-dependencies]\n\
         cohaptic-testkit = {{ path = {kit:?}, features = [{features}] }}\n\n[workspace]\n"
    );
    desk.write("Cargo.toml", manifest);
    desk.write("src/lib.rs", "");
    desk.write("Cargo.lock", lock());
    desk
}

/// Puts a cargo in the place of the real one, which notes and passes on questions, and for tests changes `Cargo.lock` and then does `then`.
fn stand_in(desk: &Desk, then: &str) {
    let real = env!("CARGO");
    desk.write(
        "cargo",
        format!(
            "#!/bin/sh\necho \"$@\" >>asked\n[ \"$1\" = metadata ] && exec '{real}' \"$@\"\nprintf '%s\\n' \"$CARGO_TARGET_DIR\" \"$@\" >said\n\
             echo $$ >number\necho 'name = \"cohaptic-real-tokio\"' >>Cargo.lock\n{then}\n"
        ),
    );
    desk.set_mode("cargo", 0o755);
}

fn command(desk: &Desk, line: &str) -> Command {
    let mut command = desk.command(line);
    command.env("CARGO", desk.path("cargo"));
    command
}

fn run(desk: &Desk, line: &str) -> Outcome {
    Outcome::of(command(desk, line).output().unwrap())
}

#[test]
fn the_package_has_the_version_and_the_features_of_tokio() {
    let desk = program("\"facade\"");
    let said = desk.text("tokio");
    assert!(said.contains("\n[patch.crates-io]\ntokio = { path = \"target/cohaptic/tokio\" }\n"), "{said}");
    assert!(said.starts_with(&format!("tokio {} for tests: ", version())), "{said}");
    let manifest = |name: &str| -> toml::Table { desk.read(&format!("target/cohaptic/{name}/Cargo.toml")).parse().unwrap() };
    let (own, real) = (manifest("tokio"), manifest("real-tokio"));
    assert_eq!(own["package"]["version"], real["package"]["version"]);
    assert_eq!((own["package"]["name"].as_str(), real["package"]["name"].as_str()), (Some("tokio"), Some("cohaptic-real-tokio")));
    for (feature, parts) in real["features"].as_table().unwrap() {
        let own = own["features"][feature].as_array().unwrap();
        assert_eq!(own[0].as_str(), Some(&*format!("real/{feature}")));
        for part in parts.as_array().unwrap().iter().filter(|part| real["features"].get(part.as_str().unwrap()).is_some()) {
            assert!(own.contains(part), "{feature} lacks {part}");
        }
    }
    // The copy of the real tokio names nothing that is not copied: tests, what tests need, and the page about the package.
    let text = real.to_string();
    for part in ["dev-dependencies", "[[test]]", "readme"] {
        assert!(!text.contains(part), "{part}");
    }
    // The package builds runtimes by a copy of the test kit that stands on the real tokio, and shares the sockets.
    let loopback = manifest("loopback");
    assert_eq!(loopback["dependencies"]["tokio"]["package"].as_str(), Some("cohaptic-real-tokio"));
    assert_eq!(loopback["dependencies"]["cohaptic-sockets"]["path"], own["dependencies"]["cohaptic-sockets"]["path"]);
    assert!(Path::new(loopback["lib"]["path"].as_str().unwrap()).ends_with("crates/testkit/src/lib.rs"));
    assert!(own["features"]["rt"].as_array().unwrap().contains(&"dep:loopback".into()));
    // Optional dependencies are features as well, as those of the real tokio are.
    assert!(own["features"].get("parking_lot").is_some() && own["features"].get("slab").is_none());
    assert!(own["dependencies"]["cohaptic-sockets"]["path"].as_str().unwrap().ends_with("crates/sockets"));
    // Descriptors and calls of the system come with sockets, on Unix.
    let unix = &own["target"]["cfg(unix)"]["dependencies"];
    assert!(unix["cohaptic-descriptors"]["path"].as_str().unwrap().ends_with("crates/descriptors"));
    assert_eq!(unix["cohaptic-libc"]["default-features"].as_bool(), Some(true));
    for package in ["dep:cohaptic-descriptors", "dep:cohaptic-libc"] {
        assert!(own["features"]["net"].as_array().unwrap().contains(&package.into()), "{package}");
    }

    // An unchanged file is not written again, so that cargo does not compile it again.
    let written = || fs::metadata(desk.path("target/cohaptic/tokio/src/lib.rs")).unwrap().modified().unwrap();
    let first = written();
    // A file of another version goes.
    desk.write("target/cohaptic/tokio/src/old.rs", "");
    // A file of somebody who builds the package by itself stays.
    desk.write("target/cohaptic/tokio/Cargo.lock", "");
    desk.text("tokio");
    assert_eq!(written(), first);
    assert!(!desk.path("target/cohaptic/tokio/src/old.rs").exists());
    assert!(desk.path("target/cohaptic/tokio/Cargo.lock").exists());
}

/// Without the feature `libc` of the test kit, calls of the system reach the system.
#[test]
fn calls_of_the_system_are_caught_unless_the_test_kit_is_asked_not_to() {
    for (features, expected) in [("\"facade\"", false), ("\"facade\", \"libc\"", true)] {
        let desk = program("");
        let manifest = desk.read("Cargo.toml").replace("features = []", &format!("default-features = false, features = [{features}]"));
        desk.write("Cargo.toml", manifest);
        desk.text("tokio");
        let own: toml::Table = desk.read("target/cohaptic/tokio/Cargo.toml").parse().unwrap();
        assert_eq!(own["target"]["cfg(unix)"]["dependencies"]["cohaptic-libc"]["default-features"].as_bool(), Some(expected), "{features}");
    }
}

/// A suite that knows of no test bed does not depend on the test kit.
#[test]
fn the_test_kit_may_be_named_by_a_variable() {
    let desk = program("\"facade\"");
    let (without, _) = desk.read("Cargo.toml").split_once("[dev-dependencies]").map(|(before, after)| (before.to_owned(), after.to_owned())).unwrap();
    desk.write("Cargo.toml", format!("{without}[workspace]\n"));
    desk.cohaptic("tokio").assert_refused(2, &["no package of", "the variable COHAPTIC_TESTKIT the folder of the test kit"]);
    let kit = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testkit");
    let outcome = Outcome::of(desk.command("tokio").env("COHAPTIC_TESTKIT", kit).output().unwrap());
    assert!(outcome.stdout.starts_with(&format!("tokio {} for tests: ", version())), "{outcome:?}");
}

#[test]
fn tests_in_a_workspace_of_their_own_name_the_test_kit() {
    let desk = program("\"facade\"");
    let manifest = desk.read("Cargo.toml");
    let (own, kit) = manifest.split_once("[dev-dependencies]").unwrap();
    desk.write(
        "sim/Cargo.toml",
        format!(
            "[package]\nname = \"program-sim\"\n\n[dev-dependencies]{kit}\n[patch.crates-io]\ntokio = {{ path = \"../target/cohaptic/tokio\" }}\n"
        ),
    );
    desk.write("sim/src/lib.rs", "");
    desk.write("Cargo.toml", format!("{own}[workspace]\nexclude = [\"sim\"]\n"));
    let said = desk.text("tokio");
    assert!(said.contains("\ntokio = { path = \"../target/cohaptic/tokio\" }\n"), "{said}");
    assert!(desk.path("target/cohaptic/tokio/src/net/stream.rs").exists());
    assert_eq!(desk.text("tokio --sim sim"), said);
}

/// Cargo is asked without a network for a version that it has, and the version is that of tokio 1, wherever the registry is.
#[test]
fn the_version_is_that_of_cargo_lock() {
    let desk = program("\"facade\"");
    stand_in(&desk, "");
    let old = "[[package]]\nname = \"tokio\"\nversion = \"0.2.25\"\nsource = \"registry+https://github.com/rust-lang/crates.io-index\"\n\n";
    desk.write("Cargo.lock", lock().replace("registry+", "sparse+").replace("[[package]]", &format!("{old}[[package]]")));
    let outcome = run(&desk, "tokio");
    assert!(outcome.stdout.starts_with(&format!("tokio {} for tests: ", version())), "{outcome:?}");
    let asked = desk.read("asked");
    let asked: Vec<&str> = asked.lines().filter(|line| line.contains("cohaptic/sources")).collect();
    assert!(asked.len() == 1 && asked[0].contains("--offline"), "{asked:?}");
}

#[test]
fn what_is_missing_is_named() {
    let none = program("");
    none.cohaptic("tokio").assert_refused(2, &["lacks its feature `facade`"]);
    none.write("Cargo.toml", none.read("Cargo.toml").replace("cohaptic-testkit", "another"));
    none.cohaptic("tokio").assert_refused(2, &["depends on cohaptic-testkit", "--sim FOLDER"]);

    let desk = program("\"facade\"");
    desk.write("Cargo.lock", "version = 4\n");
    desk.cohaptic("tokio").assert_refused(2, &["names no tokio 1"]);
    desk.write("Cargo.lock", lock().replace("registry+", "git+"));
    desk.cohaptic("tokio").assert_refused(2, &["tokio comes from git+"]);
    desk.write("Cargo.lock", lock().replace(&version(), "1.46.1"));
    desk.cohaptic("tokio").assert_refused(2, &["tokio 1.46.1 cannot be replaced: expected 1.47 or later"]);
    desk.write("Cargo.lock", lock().replace(&version(), "1.999.0"));
    Outcome::of(desk.command("tokio").env("CARGO_NET_OFFLINE", "true").output().unwrap())
        .assert_refused(2, &["cargo has no sources of tokio 1.999.0"]);
    Outcome::of(desk.command("tokio").env("CARGO", desk.path("nothing")).output().unwrap()).assert_refused(3, &["cargo cannot be called"]);
    Desk::new().cohaptic("tokio").assert_refused(2, &["the workspace cannot be read", "Cargo.toml"]);
}

#[test]
fn cargo_gets_the_arguments_and_cargo_lock_is_put_back() {
    let desk = program("\"facade\"");
    stand_in(&desk, "exit 7");
    let outcome = run(&desk, "test -p program --test network -- --nocapture --locked");
    assert_eq!(outcome.status, Some(7), "{outcome:?}");
    assert_eq!(desk.read("Cargo.lock"), lock());
    let folder = desk.path("target/cohaptic").canonicalize().unwrap();
    let said = desk.read("said");
    let said: Vec<&str> = said.lines().collect();
    assert_eq!(said[0], folder.join("build").display().to_string());
    assert_eq!(said[1..3], ["--config", &format!("patch.crates-io.tokio.path=\"{}\"", folder.join("tokio").display())]);
    assert_eq!(said[3..], ["test", "-p", "program", "--test", "network", "--", "--nocapture", "--locked"]);
    assert!(!desk.path("target/cohaptic/Cargo.lock.saved").exists());

    // Two dashes before all other arguments are cargo's as well.
    run(&desk, "test -- --nocapture");
    assert!(desk.read("said").ends_with("\ntest\n--\n--nocapture\n"), "{}", desk.read("said"));

    for option in ["--locked", "--frozen"] {
        run(&desk, &format!("test {option}")).assert_refused(2, &[&format!("{option} cannot be")]);
    }

    // The tests are those of the folder, also if another workspace has tests of its own.
    desk.write("sim/Cargo.toml", "[package]\nname = \"without\"\n");
    desk.write("sim/src/lib.rs", "");
    desk.write("Cargo.toml", desk.read("Cargo.toml").replace("[workspace]", "[workspace]\nexclude = [\"sim\"]"));
    assert_eq!(run(&desk, "test").status, Some(7));
}

#[test]
fn a_cargo_lock_that_was_not_there_is_removed() {
    let desk = program("\"facade\"");
    fs::remove_file(desk.path("Cargo.lock")).unwrap();
    stand_in(&desk, "");
    let outcome = Outcome::of(command(&desk, "test").env("CARGO_NET_OFFLINE", "true").output().unwrap());
    assert_eq!(outcome.status, Some(0), "{outcome:?}");
    assert!(desk.path("said").exists() && !desk.path("Cargo.lock").exists());
}

/// Waits until cargo has changed the file.
fn wait_for_change(desk: &Desk, child: &mut Child) {
    let begin = Instant::now();
    while desk.read("Cargo.lock") == lock() {
        assert!(begin.elapsed() < PATIENCE && child.try_wait().unwrap().is_none(), "cargo does not begin");
        sleep(Duration::from_millis(5));
    }
}

#[test]
fn after_ctrl_c_cargo_lock_is_put_back() {
    let desk = program("\"facade\"");
    // The stand-in for cargo ignores the signal, which comes to the program alone.
    stand_in(&desk, "exec sleep 600");
    for signal in ["-INT", "-TERM"] {
        let mut child = command(&desk, "test").stderr(Stdio::null()).spawn().unwrap();
        wait_for_change(&desk, &mut child);
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130));
        assert_eq!(desk.read("Cargo.lock"), lock());
        // Cargo has ended as well.
        assert!(!kill(&desk, "-0"));
    }
    // A second signal ends the program at once.
    let begin = Instant::now();
    let mut child = command(&desk, "test").stderr(Stdio::null()).spawn().unwrap();
    wait_for_change(&desk, &mut child);
    for signal in ["-INT", "-TERM"] {
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    }
    assert!(!child.wait().unwrap().success() && begin.elapsed() < PATIENCE);
    assert_eq!(desk.read("Cargo.lock"), lock());
    kill(&desk, "-KILL");
}

/// Sends a signal to the stand-in for cargo. Returns whether there is such a process.
fn kill(desk: &Desk, signal: &str) -> bool {
    Command::new("kill").args([signal, desk.read("number").trim()]).stderr(Stdio::null()).status().unwrap().success()
}

#[test]
fn after_a_kill_the_next_call_puts_cargo_lock_back() {
    let desk = program("\"facade\"");
    stand_in(&desk, "exec sleep 600");
    let mut child = command(&desk, "test").stderr(Stdio::null()).spawn().unwrap();
    wait_for_change(&desk, &mut child);
    // Killed, the program cannot end its cargo, which has written its number before it changed the file.
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(Command::new("kill").arg(desk.read("number").trim()).status().unwrap().success());
    assert_ne!(desk.read("Cargo.lock"), lock());
    stand_in(&desk, "exit 0");
    let outcome = run(&desk, "test");
    assert_eq!((outcome.status, desk.read("Cargo.lock")), (Some(0), lock()));
}

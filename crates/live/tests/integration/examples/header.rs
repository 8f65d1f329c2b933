//! `cohaptic_peer.h`: compiled as C99 and as C++, and run against published vectors, the worked examples of the protocol, and hostile datagrams. The files
//! for CHAI3D, compiled with a stand-in for the library.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use cohaptic_tests_common::quarter_by_day;

use super::programs::{Compiler, Language, Running, example};

fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/c").join(name)
}

/// Runs a program to its end and returns its output. Fails if the program reports a fault.
pub(super) fn passes(program: &Path, arguments: &[&str]) -> String {
    let child = Command::new(program).args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let (success, out, error) = Running::new(child).output();
    assert!(success, "{error}");
    out
}

/// The tests of `header.c` hold in both languages: vectors of FIPS 180-4 and RFC 4231, the bytes of the protocol, the gate, the peer and the loop.
#[test]
fn the_header_passes_its_tests_in_c99_and_in_cpp() {
    for compiler in [Compiler::C99, Compiler::Cpp11] {
        let Some((_folder, program)) = compiler.compile(&source("header.c"), &[]) else { return };
        passes(&program, &[example("live-protocol.txt").to_str().unwrap()]);
    }
}

#[test]
fn no_datagram_breaks_the_parser_of_the_header() {
    let sanitizers = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    let options = if Compiler::C99.can(&sanitizers) {
        &sanitizers[..]
    } else {
        eprintln!("without sanitizers: the compiler has none");
        &[]
    };
    let Some((_folder, program)) = Compiler::C99.compile(&source("fuzz.c"), options) else { return };
    let out = passes(&program, &[&quarter_by_day(50_000).to_string(), "1"]);
    assert!(out.ends_with("refused\n"), "{out}");
}

#[test]
fn the_files_for_chai3d_pass_their_tests_on_the_stand_in() {
    let (folder, stub) = (example("chai3d"), example("chai3d/stub"));
    let include = ["-I", folder.to_str().unwrap(), "-I", stub.to_str().unwrap()];
    let Some((_folder, program)) = Compiler::Cpp11.compile(&source("chai3d.cpp"), &include) else { return };
    passes(&program, &[]);
}

/// A coupling above the stiffness that the device is said to bear is reported and does not end the bridge.
#[test]
fn the_bridge_warns_of_a_coupling_that_is_too_stiff() {
    let Some(program) = Language::Chai3d.program() else { return };
    for (stiffness, warns) in [("6000,5", true), ("5000,5", false)] {
        let mut command = program.command();
        command.args(["127.0.0.1:9", "--session", "1", "--place", "1", "--duration", "0.01", "--coupling", stiffness]);
        let (success, out, error) = Running::new(command.spawn().unwrap()).output();
        assert!(success && out.contains("\"ticks\": 10"), "{error}");
        assert_eq!(error.contains("stiffer than the 5000 N/m that CHAI3D gives for stand-in"), warns, "{error}");
    }
}

#[test]
fn the_programs_compile_for_windows() {
    let stub = example("chai3d/stub");
    for name in ["udp_peer.cpp", "chai3d/bridge.cpp"] {
        if Compiler::Windows.compile(&example(name), &["-I", stub.to_str().unwrap()]).is_none() {
            return;
        }
    }
}

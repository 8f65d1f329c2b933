//! A program that checks certificates and shares no code with this one: `crates/stability/tests/reference/check_certificate.py`.

use std::process::{Command, Output};

use serde_json::Value;

use crate::integration::desk::Desk;

/// Returns whether a Python that can run the checker is installed. Prints a note if not.
pub(crate) fn can_check() -> bool {
    let can = Command::new("python3").args(["-c", "import tomllib"]).output().is_ok_and(|output| output.status.success());
    if !can {
        eprintln!("skipped: no python3 of version 3.11 or later was found");
    }
    can
}

fn check(desk: &Desk, file: &str) -> Output {
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/../stability/tests/reference/check_certificate.py");
    Command::new("python3").arg(program).arg(desk.path(file)).env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap()
}

/// Returns the output of the checker for a certificate that it accepts. Panics with the name `about` if the checker refuses the certificate.
#[track_caller]
pub(crate) fn accepts(desk: &Desk, file: &str, about: &str) -> String {
    let output = check(desk, file);
    assert!(output.status.success(), "{about}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Checks that the shares of a region in the program's document are those that the checker prints.
#[track_caller]
pub(crate) fn assert_shares(text: &str, region: &Value) {
    let share = |key: &str| format!("{key} {:.3} %", 100.0 * region[key].as_f64().unwrap());
    assert!(["stable", "unstable", "undecided"].iter().all(|key| text.contains(&share(key))), "{text} {region}");
}

/// Checks that the checker refuses a certificate with the value `value` at `place`, by name and with one of the given words.
#[track_caller]
pub(crate) fn refuses(desk: &Desk, whole: &Value, place: &str, value: Value, words: &str) {
    let mut changed = whole.clone();
    *changed.pointer_mut(place).unwrap() = value;
    desk.write("changed.json", changed.to_string());
    let output = check(desk, "changed.json");
    let refusal = String::from_utf8(output.stderr).unwrap();
    let is_refused = refusal.starts_with("refused: ") && words.split('|').any(|words| refusal.contains(words));
    assert!(!output.status.success() && is_refused, "{place}: {words}: {refusal}");
}

/// The text of the scene of a certificate with other words in place of some.
#[track_caller]
pub(crate) fn other_scene(whole: &Value, from: &str, to: &str) -> Value {
    let text = whole["scene"].as_str().unwrap();
    assert!(text.contains(from), "{from}");
    text.replace(from, to).into()
}

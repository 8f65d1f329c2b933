//! Scene files as tests of their `[expect]` tables.

use std::fmt::Write as _;
use std::path::Path;

use cohaptic_harness::{Model, check};
use cohaptic_scene::{Expect, Scene, scene_files};

/// Runs a scene file, and fails unless every result agrees with its `[expect]`, as in `cohaptic check`. The stability of the scene is always determined by a
/// simulation, where the program may use analysis.
///
/// ```no_run
/// # fn test() {
/// cohaptic_testkit::check_scene("scenes/mine.toml");
/// # }
/// ```
///
/// A relative path begins in the folder in which the test runs; under `cargo test` this is the folder of the package.
///
/// # Panics
///
/// If the file cannot be read or makes no sense, with the path, the place and the line; if the table `[expect]` is missing or empty; if a result differs, with
/// the expected and the actual value of every such line.
#[track_caller]
#[expect(clippy::panic, reason = "a test that fails")]
pub fn check_scene(path: impl AsRef<Path>) {
    if let Some(failure) = failure(path.as_ref()) {
        panic!("{failure}");
    }
}

/// Runs [`check_scene`] for all scene files (`.toml`) in a folder and in its subfolders, in the order of their paths. Every file is run, even after failures.
///
/// # Panics
///
/// As [`check_scene`], with all differing results; if there is no scene file.
#[track_caller]
#[expect(clippy::panic, reason = "a test that fails")]
pub fn check_scenes(folder: impl AsRef<Path>) {
    let files = match scene_files(folder.as_ref()) {
        Ok(files) => files,
        Err(error) => panic!("{error}"),
    };
    let failures: Vec<String> = files.iter().filter_map(|file| failure(file)).collect();
    if !failures.is_empty() {
        panic!("{} of {} scenes failed:\n{}", failures.len(), files.len(), failures.join("\n"));
    }
}

/// Returns why a scene fails, or `None` if all results agree.
fn failure(path: &Path) -> Option<String> {
    let scene = match Scene::read(path, &[]) {
        Ok(scene) => scene,
        Err(error) => return Some(error.to_string()),
    };
    let shown = path.display();
    if scene.expect.as_ref().is_none_or(|expect| *expect == Expect::default()) {
        return Some(format!("{shown}: the scene has no expectations to check: expected a table [expect] with the results that must come out"));
    }
    let failures = check::check(&scene, Model::Least, || true);
    if failures.is_empty() {
        return None;
    }
    let mut text = format!("{shown}: the results differ from the expectations of the scene:");
    for line in failures.iter().flat_map(|failure| failure.lines()) {
        // Writing to a `String` cannot fail.
        let _ = write!(text, "\n  {line}");
    }
    Some(text)
}

//! Scene files as tests: what their `[expect]` says must come out.

use std::fmt::Write as _;
use std::path::Path;

use cohaptic_harness::{Model, check};
use cohaptic_scene::{Expect, Scene, scene_files};

/// Runs a scene file, and fails unless all comes out that its `[expect]` says, as `cohaptic check` does. Whether the scene is stable is told by a simulation, where
/// the program may tell it by analysis.
///
/// ```no_run
/// # fn test() {
/// cohaptic_testkit::check_scene("scenes/mine.toml");
/// # }
/// ```
///
/// A relative path begins in the folder in which the test runs, which `cargo test` makes that of the package.
///
/// # Panics
///
/// If the file cannot be read or makes no sense, with the path, the place and the line; if it has no `[expect]`, or one that says nothing; if something else comes
/// out, with every line of what was expected and what came.
#[track_caller]
#[expect(clippy::panic, reason = "a test that fails")]
pub fn check_scene(path: impl AsRef<Path>) {
    if let Some(failure) = failure(path.as_ref()) {
        panic!("{failure}");
    }
}

/// [`check_scene`] for all scene files (`.toml`) in a folder and below it, in the order of their paths. All of them are run, whatever came out of those before.
///
/// # Panics
///
/// As [`check_scene`], with all that came out otherwise; if there is no scene file.
#[track_caller]
#[expect(clippy::panic, reason = "a test that fails")]
pub fn check_scenes(folder: impl AsRef<Path>) {
    let files = scene_files(folder.as_ref()).unwrap_or_else(|error| panic!("{error}"));
    let failures: Vec<String> = files.iter().filter_map(|file| failure(file)).collect();
    if !failures.is_empty() {
        panic!("of {} scenes {} failed:\n{}", files.len(), failures.len(), failures.join("\n"));
    }
}

/// Why a scene fails; `None` if it does not.
fn failure(path: &Path) -> Option<String> {
    let scene = match Scene::read(path, &[]) {
        Ok(scene) => scene,
        Err(error) => return Some(error.to_string()),
    };
    let shown = path.display();
    if scene.expect.as_ref().is_none_or(|expect| *expect == Expect::default()) {
        return Some(format!("{shown}: nothing was compared: expected a table [expect] that says what must come out"));
    }
    let failures = check::check(&scene, Model::Least, || true);
    if failures.is_empty() {
        return None;
    }
    let mut text = format!("{shown}: what came out is not what it expects:");
    for line in failures.iter().flat_map(|failure| failure.lines()) {
        // Writing to a `String` cannot fail.
        let _ = write!(text, "\n  {line}");
    }
    Some(text)
}

//! What came from outside in a live session.

use std::path::Path;

use cohaptic_harness::live::Inputs;
use cohaptic_scene::{Scene, link_keys_of_text};

use crate::failure::Failure;
use crate::input;

/// Reads `inputs.csv` of a session of that scene. `path`: the scene, as the user named it.
pub(super) fn read(file: &Path, path: &Path, scene: &Scene, overrides: &[String]) -> Result<Inputs, Failure> {
    let text = std::fs::read_to_string(file).map_err(|error| Failure::File { verb: "read", path: file.to_path_buf(), error })?;
    // Any link will do: all have the modulators of the scene.
    let keys = input::with(path, |text, file| link_keys_of_text(text, file, overrides))?.into_values().next().unwrap_or_default();
    Inputs::read(&text, scene, &keys).map_err(|error| Failure::Input(format!("{}: {error}", file.display())))
}

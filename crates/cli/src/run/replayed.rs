//! What came from outside in a live session.

use std::path::Path;

use cohaptic_harness::live::Inputs;
use cohaptic_scene::{Scene, link_keys};

use crate::failure::Failure;

/// Reads `inputs.csv` of a session of that scene.
pub(super) fn read(file: &Path, scene: &Scene, overrides: &[String]) -> Result<Inputs, Failure> {
    let text = cohaptic_scene::read_text(file).map_err(|error| Failure::File { verb: "read", path: file.to_path_buf(), error })?;
    // Any link will do: all have the modulators of the scene.
    let keys = link_keys(&scene.file, overrides)?.into_values().next().unwrap_or_default();
    Inputs::read(&text, scene, &keys).map_err(|error| Failure::Input(format!("{}: {error}", file.display())))
}

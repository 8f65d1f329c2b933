//! A scene, and what can be asked of it.

use std::path::{Path, PathBuf};

use cohaptic_harness::{Model, TooLarge, explain, too_large};
use cohaptic_linkfile::reading::file_text;
use cohaptic_scene::{Scene as Checked, SceneError, at_peer};
use pyo3::prelude::*;

use crate::errors::of_scene;
use crate::interrupt::interruptible;

/// Checked scene.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct Scene {
    pub(crate) text: String,
    pub(crate) file: PathBuf,
    pub(crate) overrides: Vec<String>,
    pub(crate) scene: Checked,
}

#[pymethods]
impl Scene {
    /// Reads a scene from a text. `file` is the name for messages, and its folder is the base of files that the scene names. Overrides are `KEY=VALUE`.
    #[new]
    fn parse(py: Python<'_>, text: String, file: PathBuf, overrides: Vec<String>) -> PyResult<Self> {
        let scene = py.detach(|| Checked::parse(&text, &file, &overrides)).map_err(|error| of_scene(py, &error))?;
        Ok(Self { text, file, overrides, scene })
    }

    /// Reads a scene from a file.
    #[staticmethod]
    fn read(py: Python<'_>, file: PathBuf, overrides: Vec<String>) -> PyResult<Self> {
        let text = file_text(&file).map_err(|error| of_scene(py, &error))?;
        Self::parse(py, text, file, overrides)
    }

    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    #[getter]
    fn file(&self) -> String {
        self.file.display().to_string()
    }

    #[getter]
    fn overrides(&self) -> Vec<String> {
        self.overrides.clone()
    }

    #[getter]
    fn title(&self) -> &str {
        &self.scene.title
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.scene.seed
    }

    /// Duration \[s\].
    #[getter]
    fn duration(&self) -> f64 {
        self.scene.duration.as_secs_f64()
    }

    #[getter]
    fn axes(&self) -> usize {
        self.scene.axes.count()
    }

    #[getter]
    fn peers(&self) -> Vec<String> {
        self.scene.peers.iter().map(|peer| peer.name.clone()).collect()
    }

    /// Returns the modelled parts of the scene and the parts left out, as JSON.
    fn explain(&self) -> String {
        let explanation = explain::explain(&self.scene);
        json(&cohaptic_answers::explanation(&self.scene, &explanation))
    }

    /// Checks the scene. Returns the failures, the expectations as JSON, and the notes.
    #[pyo3(signature = (general))]
    fn check(&self, py: Python<'_>, general: bool) -> PyResult<(Vec<String>, String, Vec<String>)> {
        self.refuse_too_large(model(general), true).map_err(|error| of_scene(py, &error))?;
        let checked = interruptible(py, |stop| cohaptic_answers::check(&self.scene, model(general), stop))?;
        Ok((checked.failures, json(&checked.expectations), checked.notes))
    }
}

impl Scene {
    /// Refuses a scene that does not fit into memory. The error names the place that asks for too many peers.
    pub(crate) fn refuse_too_large(&self, model: Model, watched: bool) -> Result<(), SceneError> {
        match too_large(&self.scene, model, watched) {
            Some(TooLarge { peer, reason }) => Err(at_peer(&self.text, &self.file, &self.overrides, peer, &reason)),
            None => Ok(()),
        }
    }

    /// File with its folder, for other scenes of the same text.
    pub(crate) fn source(&self) -> (&str, &Path, &[String]) {
        (&self.text, &self.file, &self.overrides)
    }
}

pub(crate) const fn model(general: bool) -> Model {
    if general { Model::General } else { Model::Least }
}

/// Returns a document as text. Serialisation cannot fail, because documents hold only values that JSON has.
pub(crate) fn json(document: &impl serde::Serialize) -> String {
    serde_json::to_string(document).unwrap_or_default()
}

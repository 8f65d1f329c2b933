//! `inputs.csv`.

use std::path::{Path, PathBuf};

use cohaptic_scene::{Scene, SceneContent};

use super::file::{RecordFile, create_folder, push_display};
use crate::Observer;
use crate::live::{InputLine, InputRow, RecordedScene};
use crate::record::RecordError;

/// Writes `inputs.csv`: what comes into a [live session](crate::live) from outside, one line each, from which it can be [replayed](crate::live::replay).
#[derive(Debug)]
pub struct InputRecorder {
    file: RecordFile,
    names: Vec<String>,
    line: Vec<u8>,
}

impl InputRecorder {
    /// Begins to record into a folder, which is made if there is none. `content`: the keys and files of the scene, from [`cohaptic_scene::scene_content`], with
    /// which a replay with another scene can say what differs.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the folder or the file cannot be made.
    pub fn create(folder: &Path, scene: &Scene, content: SceneContent) -> Result<Self, RecordError> {
        create_folder(folder)?;
        let mut file = RecordFile::create(folder.join("inputs.csv"))?;
        file.write(RecordedScene::of(scene, content).to_string().as_bytes())?;
        Ok(Self { file, names: scene.peers.iter().map(|peer| peer.name.clone()).collect(), line: Vec::new() })
    }

    /// Writes the rest and gives the file its name.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if that cannot be done.
    pub fn finish(self) -> Result<PathBuf, RecordError> {
        self.file.finish()
    }
}

impl Observer for InputRecorder {
    type Error = RecordError;

    fn on_input(&mut self, row: &InputRow<'_>) -> Result<(), RecordError> {
        self.line.clear();
        push_display(&mut self.line, InputLine { row, names: &self.names });
        self.line.push(b'\n');
        self.file.write(&self.line)
    }
}

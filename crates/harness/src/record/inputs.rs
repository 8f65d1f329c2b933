//! `inputs.csv`: inputs of a live session.

use std::path::{Path, PathBuf};

use cohaptic_scene::{Scene, SceneContent};
use cohaptic_units::Instant;

use super::file::{RecordFile, create_folder, push_display};
use crate::Observer;
use crate::live::{ClosingLine, InputLine, InputRow, RecordedScene};
use crate::record::RecordError;

/// Writes `inputs.csv`: one line for each input of a [live session](crate::live), for a [replay](crate::live::replay).
#[derive(Debug)]
pub struct InputRecorder {
    file: RecordFile,
    names: Vec<String>,
    line: Vec<u8>,
    /// Number of rows written so far.
    rows: u64,
    /// Instant of the last row.
    last: Instant,
}

impl InputRecorder {
    /// Creates the folder if needed and begins the record. `content`: keys and files of the scene, from [`cohaptic_scene::scene_content`], with which a replay
    /// with a different scene can name the differences.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the folder or the file cannot be created.
    pub fn create(folder: &Path, scene: &Scene, content: SceneContent) -> Result<Self, RecordError> {
        create_folder(folder)?;
        let mut file = RecordFile::create(folder.join("inputs.csv"))?;
        let head = RecordedScene::of(scene, content).to_string();
        file.write(head.as_bytes())?;
        let names = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        // Rows about the scene count too: a reader must notice if one is missing.
        Ok(Self { file, names, line: Vec::new(), rows: (head.lines().count() - 1) as u64, last: Instant::ZERO })
    }

    /// Writes the closing row and gives the file its name. Without the closing row a reader takes the record for cut short.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the row cannot be written or the file cannot be renamed.
    pub fn finish(mut self) -> Result<PathBuf, RecordError> {
        self.file.write(format!("{}\n", ClosingLine { at: self.last, rows: self.rows }).as_bytes())?;
        self.file.finish()
    }
}

impl Observer for InputRecorder {
    type Error = RecordError;

    fn on_input(&mut self, row: &InputRow<'_>) -> Result<(), RecordError> {
        self.line.clear();
        push_display(&mut self.line, InputLine { row, names: &self.names });
        self.line.push(b'\n');
        self.file.write(&self.line)?;
        (self.rows, self.last) = (self.rows + 1, row.at);
        Ok(())
    }
}

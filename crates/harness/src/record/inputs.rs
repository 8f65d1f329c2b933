//! `inputs.csv`.

use std::path::{Path, PathBuf};

use cohaptic_scene::{Scene, SceneContent};
use cohaptic_units::Instant;

use super::file::{RecordFile, create_folder, push_display};
use crate::Observer;
use crate::live::{ClosingLine, InputLine, InputRow, RecordedScene};
use crate::record::RecordError;

/// Writes `inputs.csv`: what comes into a [live session](crate::live) from outside, one line each, from which it can be [replayed](crate::live::replay).
#[derive(Debug)]
pub struct InputRecorder {
    file: RecordFile,
    names: Vec<String>,
    line: Vec<u8>,
    /// Rows written so far, and the instant of the last one.
    rows: u64,
    last: Instant,
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
        let head = RecordedScene::of(scene, content).to_string();
        file.write(head.as_bytes())?;
        let names = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        // All lines but the header are rows, also those about the scene: none of them may be missing.
        Ok(Self { file, names, line: Vec::new(), rows: (head.lines().count() - 1) as u64, last: Instant::ZERO })
    }

    /// Writes the row that closes the record, without which a reader takes it for one that is cut short, and gives the file its name.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if that cannot be done.
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

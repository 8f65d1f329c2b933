//! `packets.csv`.

use std::path::{Path, PathBuf};

use cohaptic_units::print::Seconds;
use cohaptic_wan::{Fate, LinkName};

use super::file::{RecordFile, push_display};
use crate::PacketRow;
use crate::record::RecordError;

/// Columns `link,sequence,sent,arrived,fate`. `arrived` is empty for a packet that was dropped; a packet on the way at the end has no row. A copy has a row of its own, with the number of its packet.
#[derive(Debug)]
pub(crate) struct Packets {
    file: RecordFile,
    names: Vec<String>,
    line: Vec<u8>,
}

impl Packets {
    pub(crate) fn create(folder: &Path, names: Vec<String>) -> Result<Self, RecordError> {
        let mut file = RecordFile::create(folder.join("packets.csv"))?;
        file.write(b"link,sequence,sent,arrived,fate\n")?;
        Ok(Self { file, names, line: Vec::new() })
    }

    pub(crate) fn on_packet(&mut self, row: &PacketRow) -> Result<(), RecordError> {
        let line = &mut self.line;
        line.clear();
        line.extend_from_slice(LinkName::between(&self.names[row.path.from.index()], &self.names[row.path.to.index()]).as_str().as_bytes());
        line.push(b',');
        push_display(line, row.sequence);
        line.push(b',');
        push_display(line, Seconds(row.offered));
        line.push(b',');
        if let Fate::Delivered(at) = row.fate {
            push_display(line, Seconds(at));
        }
        line.push(b',');
        line.extend_from_slice(row.fate.name().as_bytes());
        line.push(b'\n');
        self.file.write(line)
    }

    pub(crate) fn finish(self) -> Result<PathBuf, RecordError> {
        self.file.finish()
    }
}

//! `packets.csv`: fates of packets.

use std::path::{Path, PathBuf};

use cohaptic_wan::{Fate, LinkName};

use super::file::{RecordFile, push_seconds, push_whole};
use crate::PacketRow;
use crate::record::RecordError;

/// Writes the columns `link,sequence,sent,arrived,fate`. `arrived` is empty for a dropped packet. A packet in flight at the end has no row. A copy has a row of
/// its own, with the sequence number of its packet.
#[derive(Debug)]
pub(crate) struct Packets {
    file: RecordFile,
    /// Text of a link's name up to the receiver, indexed by sender.
    senders: Vec<LinkName>,
    /// Names of the peers, indexed by peer.
    names: Vec<String>,
    line: Vec<u8>,
}

impl Packets {
    pub(crate) fn create(folder: &Path, names: Vec<String>) -> Result<Self, RecordError> {
        let mut file = RecordFile::create(folder.join("packets.csv"))?;
        file.write(b"link,sequence,sent,arrived,fate\n")?;
        let senders = names.iter().map(|name| LinkName::between(name, "")).collect();
        Ok(Self { file, senders, names, line: Vec::new() })
    }

    pub(crate) fn on_packet(&mut self, row: &PacketRow) -> Result<(), RecordError> {
        let line = &mut self.line;
        line.clear();
        line.extend_from_slice(self.senders[row.path.from.index()].as_str().as_bytes());
        line.extend_from_slice(self.names[row.path.to.index()].as_bytes());
        line.push(b',');
        push_whole(line, row.sequence);
        line.push(b',');
        push_seconds(line, row.offered);
        line.push(b',');
        if let Fate::Delivered(at) = row.fate {
            push_seconds(line, at);
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

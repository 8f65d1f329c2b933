//! `links.csv`.

use std::path::{Path, PathBuf};

use cohaptic_wan::{DropCause, LinkName, LinkStats};

use super::file::RecordFile;
use crate::Summary;
use crate::record::RecordError;

/// Writes one row a link and access line: what became of its packets, and the mean delay of those delivered (empty if there is none).
pub(crate) fn write(folder: &Path, summary: &Summary) -> Result<PathBuf, RecordError> {
    let mut file = RecordFile::create(folder.join("links.csv"))?;
    let causes = DropCause::ALL.map(DropCause::name).join(",");
    file.write(format!("link,offered,duplicated,delivered,{causes},in-flight,mean-delay-s\n").as_bytes())?;
    let name = |peer: usize| &summary.peers[peer].name;
    for line in &summary.access_lines {
        let link = if line.uplink { LinkName::uplink(name(line.peer)) } else { LinkName::downlink(name(line.peer)) };
        file.write(row(&link, &line.stats).as_bytes())?;
    }
    for link in &summary.links {
        file.write(row(&LinkName::between(name(link.from), name(link.to)), &link.stats).as_bytes())?;
    }
    file.finish()
}

fn row(link: &LinkName, stats: &LinkStats) -> String {
    let dropped = DropCause::ALL.map(|cause| stats.dropped(cause).to_string()).join(",");
    let delay = stats.mean_delay().map_or_else(String::new, |delay| delay.as_secs_f64().to_string());
    let (link, offered, duplicated, delivered) = (link.as_str(), stats.offered(), stats.duplicated(), stats.delivered());
    format!("{link},{offered},{duplicated},{delivered},{dropped},{},{delay}\n", stats.in_flight())
}

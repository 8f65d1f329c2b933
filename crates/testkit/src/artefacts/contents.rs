//! Contents of the files of a record.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use cohaptic_units::print::Seconds;
use cohaptic_wan::{Fate, FateLog, Path};

use super::folder::{MARK, MARKED};
use crate::record::Record;
use crate::trace::Lost;
#[cfg(feature = "pcapng")]
use crate::wire::Form;

/// Returns the names and contents of the files of a record.
pub(super) fn files(record: &Record) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    let mut links = String::new();
    let mut table = String::new();
    let hosts = record.trace().hosts();
    let names = file_names(hosts);
    for path in record.paths() {
        let (from, to) = (&names[path.from.index()], &names[path.to.index()]);
        let log = record.fates_of(path);
        let fates = format!("fates-{from}-to-{to}.csv");
        let (one, other) = (&hosts[path.from.index()], &hosts[path.to.index()]);
        // Writing to a `String` cannot fail.
        let _ = writeln!(links, "{one} -> {other}: replay {fates}");
        let _ = writeln!(table, "  {one} -> {other}: {}", counts(record, path, &log));
        files.push((fates, log.to_text().into_bytes()));
        #[cfg(feature = "pcapng")]
        files.push((format!("packets-{from}-to-{to}.pcapng"), capture(record, path, one, other)));
    }
    let mut trace = String::new();
    for event in record.trace().events() {
        let _ = writeln!(trace, "{}", record.trace().words(event));
    }
    let mut hits = String::new();
    for count in record.hits() {
        let _ = writeln!(hits, "  {}", count.words());
    }
    if !hits.is_empty() {
        hits = format!("Packets that were hit, also in the fates:\n\n{hits}\n");
    }
    let seed = record.seed();
    let summary = format!(
        "{MARK}: the run of `{}`, which ended at {} s.\n\nThe seed was {}: {}={} repeats the run.\n\nPackets of each link, and their fates:\n\n{table}\n{hits}\
         trace.txt has all events in their order. links.txt replays the fates:\nTestbed::from_file(\"links.txt\") makes a test bed with these hosts and \
         links.\n",
        seed.test,
        Seconds(record.ended()),
        seed.value,
        crate::SEED_VARIABLE,
        seed.value,
    );
    let asked: String = record.network().iter().map(|line| format!("# {line}\n")).collect();
    let asked = if asked.is_empty() { asked } else { format!("# The links of the test:\n{asked}") };
    let devices: String = record.devices().map(|line| format!("{line}\n")).collect();
    let hosts = record.hosts().join(" ");
    let links = format!("# The fate of each packet, link by link.\n{asked}seed: {}\nhosts: {hosts}\n{devices}{links}", seed.value);
    files.push((MARKED.to_owned(), summary.into_bytes()));
    files.push(("trace.txt".to_owned(), trace.into_bytes()));
    files.push(("links.txt".to_owned(), links.into_bytes()));
    files
}

/// Returns the counts of a path in words: `12 packets, 10 arrived, 1 copied, 2 lost (loss), 1 lost (queue-full (uplink))`.
fn counts(record: &Record, path: Path, log: &FateLog) -> String {
    let count = |is: &dyn Fn(Fate) -> bool| log.records().iter().filter(|record| is(record.fate)).count();
    let mut text = format!("{} packets, {} arrived", log.packets(), count(&|fate| matches!(fate, Fate::Delivered(_))));
    let copied = count(&|fate| fate == Fate::Duplicated);
    if copied > 0 {
        let _ = write!(text, ", {copied} copied");
    }
    let mut lost: BTreeMap<Lost, usize> = BTreeMap::new();
    // The log may end before the last packets. Only packets of the log are counted.
    for seen in record.packets_of(path).filter(|seen| seen.sequence < log.packets() as u64) {
        if let Fate::Dropped(cause) = seen.fate {
            *lost.entry(Lost::on(seen.part, cause)).or_default() += 1;
        }
    }
    for (why, count) in lost {
        let _ = write!(text, ", {count} lost ({why})");
    }
    text
}

#[cfg(feature = "pcapng")]
fn capture(record: &Record, path: Path, from: &str, to: &str) -> Vec<u8> {
    let write = || -> std::io::Result<Vec<u8>> {
        let mut capture = cohaptic_capture::CaptureWriter::new(Vec::new(), &format!("{from} -> {to}"))?;
        for seen in record.packets_of(path) {
            let (packet, (bytes, form)) = (seen.record.with_path(seen.part), &seen.payload);
            match form {
                #[cfg(feature = "tcp")]
                Form::Packet => capture.write_packet(&packet, bytes)?,
                Form::Datagram(ends) => capture.write_datagram(&packet, *ends, bytes)?,
                Form::Content => capture.write(&packet, bytes)?,
            }
        }
        capture.finish()
    };
    // Writing to memory cannot fail.
    write().unwrap_or_default()
}

/// Maximum length of the part of a file's name for a host's name \[characters\].
const LONGEST: usize = 60;

/// Converts a name to a part of a file's name with characters permitted by every system.
pub(super) fn file_name(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '_' };
    name.chars().map(plain).take(2 * LONGEST).collect()
}

/// Converts names of hosts to parts of files' names. No two results are equal, also on a system that ignores the case of letters.
fn file_names(hosts: &[String]) -> Vec<String> {
    let mut taken = std::collections::BTreeSet::new();
    let name = |(place, host): (usize, &String)| {
        let plain: String = file_name(host).chars().take(LONGEST).collect();
        // Different names can become equal by the conversion. The index of the host tells such names apart.
        let alone = if taken.contains(&plain.to_ascii_lowercase()) { format!("{plain}-{place}") } else { plain };
        taken.insert(alone.to_ascii_lowercase());
        alone
    };
    hosts.iter().enumerate().map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_of_any_name_have_files_of_their_own() {
        let hosts = ["a", "A", "a/b", "a.b", "ü", "a_b", &"x".repeat(200)].map(String::from);
        assert_eq!(file_names(&hosts), ["a", "A-1", "a_b", "a_b-3", "_", "a_b-5", &"x".repeat(60)]);
    }
}

//! The files of judgements: the journal, with a line per judged combination in any order, and the table of all judgements.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use cohaptic_files::{open_continued, write_whole};

use super::{Judgement, Verdict, Words};
use crate::error::CampaignError;
use crate::folder::hash;
use crate::plan::CampaignPlan;
use crate::table::TableError;
use crate::value::{number_text, value_text};

/// Advice to the user about a damaged table of judgements.
const WAY_OUT: &str = "remove it and repeat the command, which judges again";

/// Columns of a judgement, in order.
const COLUMNS: [&str; 5] = ["verdict", "judged", "radius", "error_bound", "reason"];

/// Number of hexadecimal digits of the hash at the end of a journal's line: 128 bits.
const DIGITS: usize = 32;

/// A journal of judgements, in the order of their making. Each line ends with a hash of the line and of the campaign. A last line without an end, left by a
/// loss of power, is dropped. Any other damaged line is skipped, and its combination is judged again.
#[derive(Debug)]
pub(crate) struct Journal {
    path: PathBuf,
    /// Hash of the campaign's manifest.
    campaign: String,
    file: File,
}

/// Content of a journal.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    /// Intact judgements, each with its combination.
    pub(crate) known: Vec<(u64, Judgement)>,
    /// Number of damaged lines.
    pub(crate) damaged: u64,
    /// Length of all lines with a line feed \[bytes\].
    whole: u64,
}

impl Journal {
    /// Reads a journal; an absent journal is empty. `campaign`: hash of the campaign's manifest. `combinations`: number of combinations of the plan.
    pub(crate) fn read(path: &Path, campaign: &str, combinations: u64) -> Result<Lines, CampaignError> {
        let bytes = match fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(CampaignError::File { verb: "read", path: path.to_path_buf(), error }),
        };
        let (mut lines, mut words) = (Lines::default(), Words::default());
        for line in bytes.split_inclusive(|byte| *byte == b'\n') {
            // Only the last line can lack a line feed. `open` cuts it off before it appends.
            let Some(line) = line.strip_suffix(b"\n") else { break };
            match record(line, campaign).filter(|(combination, _)| *combination < combinations) {
                Some((combination, judgement)) => lines.known.push((combination, words.all(judgement))),
                None => lines.damaged += 1,
            }
            // Damaged lines are kept in the file, and only skipped when read.
            lines.whole += line.len() as u64 + 1;
        }
        Ok(lines)
    }

    /// Opens a journal for appending, or begins one. Also returns its content.
    pub(crate) fn open(path: PathBuf, campaign: &str, combinations: u64) -> Result<(Self, Lines), CampaignError> {
        let lines = Self::read(&path, campaign, combinations)?;
        let file = open_continued(&path, lines.whole).map_err(|error| CampaignError::File { verb: "write", path: path.clone(), error })?;
        Ok((Self { path, campaign: campaign.to_owned(), file }, lines))
    }

    /// Appends a judgement. The operating system has the line when the function returns.
    pub(crate) fn add(&mut self, combination: u64, judgement: &Judgement) -> Result<(), CampaignError> {
        let cells = std::iter::once(combination.to_string()).chain(cells(judgement));
        let written = line(cells).and_then(|mut line| {
            // The hash comes before the line feed.
            line.pop();
            let digest = digest(&line, &self.campaign);
            line.push(b',');
            line.extend(digest.bytes());
            line.push(b'\n');
            self.file.write_all(&line)
        });
        written.map_err(|error| CampaignError::File { verb: "write", path: self.path.clone(), error })
    }
}

/// Returns the hash of a line, without its line feed, for this campaign.
fn digest(line: &[u8], campaign: &str) -> String {
    let mut digest = hash(&[campaign.as_bytes(), b"\n", line].concat());
    digest.truncate(DIGITS);
    digest
}

/// Reads a line of the journal, without its line feed; `None` if the line is damaged.
fn record(line: &[u8], campaign: &str) -> Option<(u64, Judgement)> {
    let (line, found) = line.split_at_checked(line.len().checked_sub(DIGITS)?)?;
    let line = line.strip_suffix(b",")?;
    // The hash also covers the campaign, so a line of another campaign does not count.
    if found != digest(line, campaign).as_bytes() {
        return None;
    }
    let mut record = csv::StringRecord::new();
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line);
    let cells = reader.read_record(&mut record).ok().filter(|read| *read).map(|_| &record)?;
    if cells.len() != 1 + COLUMNS.len() {
        return None;
    }
    Some((cells.get(0)?.parse().ok()?, judgement(cells, 1)?))
}

/// Reads the judgement whose columns begin at index `from`.
fn judgement(cells: &csv::StringRecord, from: usize) -> Option<Judgement> {
    let [word, judged, radius, error, reason] = std::array::from_fn(|place| cells.get(from + place).unwrap_or_default());
    // A refusal has a reason and no verdict.
    if word.is_empty() {
        return (!reason.is_empty()).then(|| Judgement::Refused(reason.into()));
    }
    Some(Judgement::Known(Verdict { word: word.into(), judged: judged.into(), radius: radius.parse().ok()?, error: error.parse().ok()? }))
}

fn cells(judgement: &Judgement) -> [String; 5] {
    match judgement {
        Judgement::Known(Verdict { word, judged, radius, error }) => {
            [word.to_string(), judged.to_string(), number_text(*radius), number_text(*error), String::new()]
        }
        Judgement::Refused(reason) => [String::new(), String::new(), String::new(), String::new(), reason.to_string()],
    }
}

fn line(cells: impl Iterator<Item = String>) -> io::Result<Vec<u8>> {
    let mut line = csv::Writer::from_writer(Vec::new());
    line.write_record(cells).map_err(io::Error::other)?;
    line.into_inner().map_err(|error| io::Error::other(error.to_string()))
}

/// Writes the table of all judgements: one row per combination, with the values of its keys.
pub(crate) fn write_all(path: &Path, plan: &CampaignPlan, judgements: &[Judgement]) -> Result<(), CampaignError> {
    let written = write_whole(path, |to| -> io::Result<()> {
        let keys = plan.variations().iter().map(|vary| vary.column());
        to.write_all(&line(std::iter::once("combination".to_owned()).chain(keys).chain(COLUMNS.map(str::to_owned)))?)?;
        for (combination, judgement) in (0..).zip(judgements) {
            let values = plan.values(combination).map(|varied| value_text(&varied.value));
            to.write_all(&line(std::iter::once(combination.to_string()).chain(values).chain(cells(judgement)))?)?;
        }
        Ok(())
    });
    written.map_err(|error| CampaignError::File { verb: "write", path: path.to_path_buf(), error })
}

/// Reads a table of judgements; `None` if there is no table.
pub(crate) fn read_whole(path: &Path, plan: &CampaignPlan) -> Result<Option<Vec<Judgement>>, CampaignError> {
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(CampaignError::File { verb: "read", path: path.to_path_buf(), error }),
    };
    let read = read(file, plan).map_err(|error| match error {
        TableError::Io(error) => CampaignError::File { verb: "read", path: path.to_path_buf(), error },
        error @ (TableError::Content(_) | TableError::Part { .. }) => {
            CampaignError::Damaged { path: path.to_path_buf(), message: error.to_string(), way_out: WAY_OUT }
        }
    });
    read.map(Some)
}

fn read(file: File, plan: &CampaignPlan) -> Result<Vec<Judgement>, TableError> {
    let mut reader = csv::Reader::from_reader(io::BufReader::new(file));
    let (mut judgements, mut words, mut cells) = (Vec::new(), Words::default(), csv::StringRecord::new());
    let content =
        |error: csv::Error| if error.is_io_error() { TableError::Io(io::Error::other(error)) } else { TableError::Content(error.to_string()) };
    while reader.read_record(&mut cells).map_err(content)? {
        let number = judgements.len();
        // Row n must state combination n: a lost row would shift all later judgements.
        let in_place = cells.get(0) == Some(number.to_string().as_str());
        let found = judgement(&cells, 1 + plan.variations().len()).filter(|_| in_place);
        judgements.push(words.all(found.ok_or_else(|| TableError::Content(format!("row {number} is not a judgement")))?));
    }
    let (found, expected) = (judgements.len() as u64, plan.combinations());
    if found == expected { Ok(judgements) } else { Err(TableError::Content(format!("{found} rows: expected {expected}"))) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(word: &str, radius: f64, error: f64) -> Judgement {
        Judgement::Known(Verdict { word: word.into(), judged: "mean-square".into(), radius, error })
    }

    fn judgements() -> [(u64, Judgement); 3] {
        [
            (7, known("stable", 0.1 + 0.2, 5e-324)),
            (0, Judgement::Refused("no, \"really\" none".into())),
            (3, known("overflow", f64::INFINITY, f64::INFINITY)),
        ]
    }

    fn written(path: &Path) -> Vec<u8> {
        let (mut journal, _) = Journal::open(path.to_path_buf(), "c0ffee", 9).unwrap();
        judgements().iter().for_each(|(combination, judgement)| journal.add(*combination, judgement).unwrap());
        fs::read(path).unwrap()
    }

    #[test]
    fn a_journal_torn_anywhere_gives_back_its_whole_lines() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let (whole, judgements) = (written(&path), judgements());
        for end in 0..=whole.len() {
            fs::write(&path, &whole[..end]).unwrap();
            let (mut journal, found) = Journal::open(path.clone(), "c0ffee", 9).unwrap();
            let lines = whole[..end].iter().filter(|byte| **byte == b'\n').count();
            assert_eq!((found.known.as_slice(), found.damaged), (&judgements[..lines], 0), "{end}");
            journal.add(8, &judgements[0].1).unwrap();
            assert_eq!(Journal::read(&path, "c0ffee", 9).unwrap().known.len(), lines + 1, "{end}");
        }
        // A journal of another campaign has no intact line.
        fs::write(&path, &whole).unwrap();
        let other = Journal::read(&path, "decaf", 9).unwrap();
        assert_eq!((other.known, other.damaged), (Vec::new(), 3));
    }

    /// A lost line feed joins two lines, and neither is intact then.
    #[test]
    fn no_flipped_bit_of_a_journal_changes_a_judgement() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let (whole, judgements) = (written(&path), judgements());
        for bit in 0..8 * whole.len() {
            let mut flipped = whole.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            fs::write(&path, flipped).unwrap();
            let found = Journal::read(&path, "c0ffee", 9).unwrap().known;
            assert!((1..3).contains(&found.len()) && found.iter().all(|found| judgements.contains(found)), "bit {bit}: {found:?}");
        }
    }
}

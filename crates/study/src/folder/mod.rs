//! The folder of a study: sessions and trials, kept in the order of their events.
//!
//! ```text
//! cohaptic.lock                   held while a process works on the folder
//! study.json                      texts of the study file and of the files named there, as of the beginning
//! groups/G01.jsonl                session of a group: the row of its order, and an event per line
//! trials/G01-012/scene.toml       the scene of a trial
//! trials/G01-012/inputs.csv       inputs of the hands
//! trials/G01-012/trial.json       outcome, measures, and faults
//! staging/                        the trial under way
//! trials.csv, trials.parquet      the table of trials
//! answers.csv, answers.parquet    the table of answers
//! report.html                     the report
//! pictures/task_time_s.svg        picture of a measure, or of a question
//! ```
//!
//! A person is kept as code, motion and answers: no name, no address, and no time of day.
//!
//! A trial gets its final name, and an event its line, when all bytes are on the disk. After a crash a session continues at the first trial, answer or break
//! that is not kept. A trial with its final name counts, even if the process was killed before the event of the trial was written.

mod group;
mod kept_study;
mod record;

use std::fs::{self, File};
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use cohaptic_files::{FOLDER_LOCK, OwnFolder, PARTIAL, write_whole};

use crate::codes::{GroupCode, TrialCode};
use crate::error::StudyError;
use crate::model::Study;
use crate::sequence::{Event, Sequence, SequenceError, Step};

pub(crate) use group::{Group, GroupState};
pub(crate) use record::needs_movements;
pub use record::{KeptMovement, RoundTrip, TrialFacts, TrialRecord};

use kept_study::KeptStudy;

/// Names of the files and folders of a study.
pub(crate) const STUDY: &str = "study.json";
const GROUPS: &str = "groups";
const TRIALS: &str = "trials";
const STAGING: &str = "staging";

/// The folder of a study, locked against other processes as long as the value lives.
#[derive(Debug)]
pub struct StudyFolder {
    path: PathBuf,
    study: Study,
    /// Name and version of the program, for the tables.
    program: String,
    /// `true` if modelled persons play.
    is_dry: bool,
    /// Sessions, indexed by [`GroupCode::index`].
    groups: Vec<Group>,
    /// Ownership of the folder.
    _own: OwnFolder,
}

impl StudyFolder {
    /// Begins a study in a folder, or continues the study found there if both are the same. `program`: name and version of the program, for the tables.
    ///
    /// # Errors
    ///
    /// [`StudyError`] if the folder holds foreign files or another study, if another process works on the folder, or if a file cannot be read or written.
    pub fn open(study: Study, path: &Path, program: &str) -> Result<Self, StudyError> {
        Self::begin(study, path, program, false)
    }

    /// Like [`StudyFolder::open`], for a dry run with modelled persons.
    pub(crate) fn begin(study: Study, path: &Path, program: &str, is_dry: bool) -> Result<Self, StudyError> {
        // A foreign folder is refused before the lock is written into it.
        Self::is_begun(path)?;
        let own = Self::taken(path)?;
        // Asked again, because another process may have begun a study before this one had the lock.
        let is_begun = Self::is_begun(path)?;
        let kept = KeptStudy::of(&study, is_dry);
        let file = path.join(STUDY);
        // A continued study must be the same: a changed file would mix trials of two designs under the same codes.
        if is_begun {
            let differences = KeptStudy::read(&file)?.differences(&kept);
            if !differences.is_empty() {
                return Err(StudyError::Other { path: path.to_path_buf(), differences });
            }
        } else {
            write_whole(&file, |to| to.write_all(kept.text().as_bytes())).map_err(StudyError::file("write", &file))?;
        }
        Self { path: path.to_path_buf(), study, program: program.to_owned(), is_dry, groups: Vec::new(), _own: own }.with_groups()
    }

    /// Opens the study in a folder, without its files elsewhere.
    ///
    /// # Errors
    ///
    /// [`StudyError::NoStudy`] for a folder without a study; otherwise as [`StudyFolder::open`].
    pub fn of_folder(path: &Path, program: &str) -> Result<Self, StudyError> {
        let file = path.join(STUDY);
        // The file is looked for before the lock is taken, because taking the lock makes missing folders.
        if !file.exists() {
            return Err(StudyError::NoStudy { path: path.to_path_buf() });
        }
        let own = Self::taken(path)?;
        let kept = KeptStudy::read(&file)?;
        let study = kept.study()?;
        Self { path: path.to_path_buf(), study, program: program.to_owned(), is_dry: kept.is_dry(), groups: Vec::new(), _own: own }.with_groups()
    }

    /// Returns whether the folder holds a study, and changes nothing.
    fn is_begun(path: &Path) -> Result<bool, StudyError> {
        let entries = match fs::read_dir(path) {
            Ok(entries) => entries,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(false),
            Err(error) => return Err(StudyError::file("read the folder", path)(error)),
        };
        let mut others = Vec::new();
        for entry in entries {
            let name = entry.map_err(StudyError::file("read", path))?.file_name();
            if name == STUDY {
                return Ok(true);
            }
            let name = name.to_string_lossy().into_owned();
            // A process killed while it began the study leaves a lock and a partial file.
            if name != FOLDER_LOCK && !name.ends_with(PARTIAL) {
                others.push(name);
            }
        }
        // Names are sorted, because a file system lists files in any order and the message shall always name the same file.
        others.sort();
        match others.into_iter().next() {
            Some(found) => Err(StudyError::Foreign { path: path.to_path_buf(), found }),
            None => Ok(false),
        }
    }

    fn taken(path: &Path) -> Result<OwnFolder, StudyError> {
        OwnFolder::take(path).map_err(|error| {
            let is_busy = error.kind() == ErrorKind::ResourceBusy;
            if is_busy { StudyError::Busy { path: path.to_path_buf() } } else { StudyError::file("make the folder", path)(error) }
        })
    }

    /// Reads the sessions. A trial with its final name counts without its event too, and trials of forgotten groups are removed.
    fn with_groups(mut self) -> Result<Self, StudyError> {
        let folder = self.path.join(GROUPS);
        for path in [&folder, &self.path.join(TRIALS)] {
            fs::create_dir_all(path).map_err(StudyError::file("make the folder", path))?;
        }
        let mut codes: Vec<GroupCode> = names(&folder)?.iter().filter_map(|name| name.strip_suffix(".jsonl")?.parse().ok()).collect();
        // Codes are sorted as numbers: by name, G100 would come before G11.
        codes.sort_unstable();
        for (index, code) in codes.into_iter().enumerate() {
            // A gap is refused, because sessions are indexed by their codes and every later session would take a wrong place.
            if code.index() != index {
                return Err(StudyError::damaged(&folder, format!("{} is missing", GroupCode::of_index(index))));
            }
            let mut group = Group::read(&self.group_file(code), code, &self.study)?;
            if let GroupState::Session(session) = &mut group.state
                && let Step::Trial(plan) = session.step()
                && self.trial(plan.code).exists()
            {
                // At most one trial lacks its event, because a session is written before its next trial begins. The record has the same faults.
                let faults = TrialRecord::read(&self.trial(plan.code))?.faults;
                session.handle(Event::TrialEnded { faults })?;
                group.write(&self.group_file(code))?;
            }
            self.groups.push(group);
        }
        // The first trial of a group may be there without the group's file.
        if let Some(group) = self.begun_by_its_trial()? {
            self.groups.push(group);
        }
        // Events are restored before the sweep, which would take a trial without its event for a sign of a damaged session.
        self.sweep()?;
        Ok(self)
    }

    /// Returns the session of the next group if the first trial is kept and the file of the session is not written yet.
    fn begun_by_its_trial(&self) -> Result<Option<Group>, StudyError> {
        let Some(mut session) = self.new_group() else { return Ok(None) };
        let Step::Trial(plan) = session.step() else { return Ok(None) };
        if !self.trial(plan.code).exists() {
            return Ok(None);
        }
        // The slot is the same as before the crash: no other session was kept in between, and the lowest free slot is taken.
        session.handle(Event::TrialEnded { faults: TrialRecord::read(&self.trial(plan.code))?.faults })?;
        let group = Group::of(session);
        group.write(&self.group_file(group.code))?;
        Ok(Some(group))
    }

    /// Removes the trials of forgotten persons, which a crash may have left. A trial that no session knows has lost the file of its session, or a part of it:
    /// the motion of people is never removed for this.
    fn sweep(&self) -> Result<(), StudyError> {
        let folder = self.path.join(TRIALS);
        for name in names(&folder)? {
            let Ok(code) = name.parse::<TrialCode>() else { continue };
            let path = folder.join(name);
            match self.groups.get(code.group.index()) {
                // Trials are numbered from 1 without gaps, so a session with n ended trials knows exactly the numbers up to n.
                Some(group) if group.ended().len() >= code.number => {}
                Some(group) if group.is_forgotten() => fs::remove_dir_all(&path).map_err(StudyError::file("remove", &path))?,
                Some(_) | None => {
                    let session = self.group_file(code.group);
                    return Err(StudyError::damaged(&session, format!("it does not say that the trial {code} has ended, and the trial is there")));
                }
            }
        }
        Ok(())
    }

    /// Returns the study.
    #[must_use]
    pub const fn study(&self) -> &Study {
        &self.study
    }

    /// Returns the path of the folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns whether modelled persons played.
    #[must_use]
    pub const fn is_dry(&self) -> bool {
        self.is_dry
    }

    /// Returns whether every slot of the study has a complete session.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.free_slot().is_none()
    }

    /// Returns the number of complete sessions.
    #[must_use]
    pub fn complete(&self) -> usize {
        self.groups.iter().filter(|group| group.is_done()).count()
    }

    /// Returns the session to run next: the session under way, at the first event that is not kept, or else a new session; `None` if the study is full.
    /// Nothing of a new session is on the disk before the first trial is kept.
    #[must_use]
    pub fn next_group(&self) -> Option<Sequence> {
        self.groups.iter().find_map(Group::running).cloned().or_else(|| self.new_group())
    }

    fn new_group(&self) -> Option<Sequence> {
        self.free_slot().map(|slot| Sequence::new(&self.study, GroupCode::of_index(self.groups.len()), slot))
    }

    /// Returns the lowest slot without a session that is complete or under way.
    fn free_slot(&self) -> Option<usize> {
        // Abandoned and forgotten sessions leave their slot free: another group must play the row, or the order loses its balance.
        (0..self.study.groups).find(|slot| !self.groups.iter().any(|group| group.slot == *slot && (group.is_done() || group.running().is_some())))
    }

    /// Returns the number of kept trials, those of abandoned sessions included.
    #[must_use]
    pub fn trials(&self) -> usize {
        self.groups.iter().map(|group| group.ended().len()).sum()
    }

    pub(crate) fn groups(&self) -> &[Group] {
        &self.groups
    }

    pub(crate) fn program(&self) -> &str {
        &self.program
    }

    /// Empties the folder of the trial under way, and returns the path. The caller records the trial as `scene.toml`, the text of
    /// [`TrialScene`](crate::TrialScene), and `inputs.csv`.
    ///
    /// # Errors
    ///
    /// [`StudyError::File`] if the folder cannot be made.
    pub fn staging(&self) -> Result<PathBuf, StudyError> {
        let path = self.path.join(STAGING);
        // Files of an interrupted trial must not be kept together with those of the next trial.
        match fs::remove_dir_all(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(StudyError::file("remove", &path)(error)),
            _ => {}
        }
        fs::create_dir(&path).map_err(StudyError::file("make the folder", &path))?;
        Ok(path)
    }

    /// Keeps the trial in the folder of [`StudyFolder::staging`] as the next trial of the session. The measures of a replay are kept with the trial.
    ///
    /// # Errors
    ///
    /// [`StudyError::Refused`] if the session waits for something else; [`StudyError::Damaged`] if the record cannot be replayed; [`StudyError::File`].
    pub fn keep_trial(&mut self, session: &mut Sequence, facts: TrialFacts) -> Result<TrialRecord, StudyError> {
        let mut next = session.clone();
        let Step::Trial(plan) = session.step() else {
            // The session refuses the event, with the reason.
            next.handle(Event::TrialEnded { faults: Vec::new() })?;
            return Err(StudyError::Refused(SequenceError::Ended));
        };
        // The event is tried on a copy before any file is touched: a refused trial leaves session and folder unchanged.
        next.handle(Event::TrialEnded { faults: facts.faults.clone() })?;
        let staging = self.path.join(STAGING);
        let record = TrialRecord::of(plan.code, &staging, facts)?;
        record.write(&staging)?;
        // The caller wrote these two files, perhaps without a sync. All bytes must be stored before the rename, after which the trial counts.
        for name in ["scene.toml", "inputs.csv"] {
            let file = staging.join(name);
            File::open(&file).and_then(|file| file.sync_all()).map_err(StudyError::file("write", &file))?;
        }
        let path = self.trial(plan.code);
        // The trial gets its name before the session its event: after a crash between the two, `with_groups` adds the event.
        fs::rename(&staging, &path).map_err(StudyError::file("write", &path))?;
        sync_folder(&self.path.join(TRIALS));
        self.put(session, next)?;
        Ok(record)
    }

    /// Keeps an event other than a trial: an answer, the end of a break, a repetition, or the end.
    ///
    /// # Errors
    ///
    /// [`StudyError::Refused`] if the session does not take the event, or for a trial; [`StudyError::File`].
    pub fn keep(&mut self, session: &mut Sequence, event: Event) -> Result<(), StudyError> {
        let mut next = session.clone();
        next.handle(event)?;
        self.put(session, next)
    }

    /// Writes a session, and only then lets the caller see it.
    fn put(&mut self, session: &mut Sequence, next: Sequence) -> Result<(), StudyError> {
        self.put_group(Group::of(next.clone()))?;
        *session = next;
        Ok(())
    }

    fn put_group(&mut self, group: Group) -> Result<(), StudyError> {
        group.write(&self.group_file(group.code))?;
        // Codes are given in order, so a session that is not in the list is the next one and belongs at the end.
        let index = group.code.index();
        if index < self.groups.len() {
            self.groups[index] = group;
        } else {
            self.groups.push(group);
        }
        Ok(())
    }

    /// Replaces a session, and removes all trials missing from the new session.
    pub(crate) fn replace(&mut self, group: Group) -> Result<(), StudyError> {
        // The file of the session comes first: the trials then belong to no session, and are removed also after a crash.
        self.put_group(group)?;
        self.sweep()?;
        // A trial under way may be of this group.
        self.staging().map(drop)
    }

    fn group_file(&self, code: GroupCode) -> PathBuf {
        self.path.join(GROUPS).join(format!("{code}.jsonl"))
    }

    /// Returns the folder of a trial.
    #[must_use]
    pub(crate) fn trial(&self, code: TrialCode) -> PathBuf {
        self.path.join(TRIALS).join(code.to_string())
    }
}

/// Returns the names in a folder, in order. Names without a Unicode form are left out.
fn names(folder: &Path) -> Result<Vec<String>, StudyError> {
    let read = || -> std::io::Result<Vec<String>> {
        let mut names = Vec::new();
        for entry in fs::read_dir(folder)? {
            names.extend(entry?.file_name().into_string());
        }
        names.sort();
        Ok(names)
    };
    read().map_err(StudyError::file("read the folder", folder))
}

/// Makes a new name in a folder survive a loss of power. Some file systems cannot do so, and the name then survives a crash of the program alone.
fn sync_folder(folder: &Path) {
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

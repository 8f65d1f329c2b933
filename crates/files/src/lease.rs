//! A lock for processes of several machines with a common folder. The lock is a lease: a file renewed by its owner, and stale if the owner stops renewing.
//!
//! Leases need only properties of every file system, NFS included: exactly one process succeeds in creating a file (`O_EXCL`), a process opening a file
//! reads all bytes written before an earlier close, and all modification times come from the server's clock. Locks of the system are not needed.
//!
//! | term | rule |
//! | --- | --- |
//! | owner | first line of the file: host, process, and the time when the process began |
//! | heartbeat | second line of the file, a number; the owner writes the next number every [`BEAT`] |
//! | stale lease | the file was not written for [`STALE`], by the clock of the file system, or the owner was a process of this host that has ended |
//! | takeover | a stale lease is renamed (only the first process succeeds), and the name is then taken like a free name |
//! | lost lease | the owner notices the loss at its next heartbeat, because the file names another owner |
//!
//! A process standing still for longer than [`STALE`] can lose its lease and notices the loss at the next heartbeat only. Until then two owners can work at
//! the same time. A lease therefore only saves double work: files written by owners must be right without the lease.

use std::fmt;
use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::partial::{self, PARTIAL};

/// Time between two heartbeats of an owner.
pub const BEAT: Duration = Duration::from_secs(5);

/// Time since the last renewal from which a lease is stale. Longer than any file system hides a write of another machine: NFS clients check a file again
/// after `acregmax`, at most 60 s.
pub const STALE: Duration = Duration::from_secs(90);

/// A process that owns leases and writes files. The four fields together identify the process among the processes of all machines and all times.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Owner {
    /// Name of the process's machine, reduced to characters allowed in file names.
    pub host: String,
    /// Process number, unique within `space` at any one time.
    pub pid: u32,
    /// Name of the namespace of process numbers. A container has a namespace of its own.
    space: String,
    /// Distinguishes the process from earlier processes with the same number: nanoseconds of the wall clock when the process began.
    begun: u64,
}

impl Owner {
    /// Returns this process as an owner. `begun` must differ from the values of earlier processes with the same number: nanoseconds of the wall clock when
    /// the process began.
    #[must_use]
    pub fn here(begun: u64) -> Self {
        let host = fs::read_to_string("/proc/sys/kernel/hostname").ok().or_else(|| std::env::var("COMPUTERNAME").ok());
        let space = fs::read_link("/proc/self/ns/pid").map(|link| link.to_string_lossy().into_owned());
        Self { host: plain(&host.unwrap_or_default()), pid: std::process::id(), space: plain(&space.unwrap_or_default()), begun }
    }

    /// Returns the unique name of the process, made of characters allowed in file names.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}-{}-{:x}", self.host, self.pid, self.begun)
    }

    /// Reads the first line of a lease; `None` if the line has another form.
    fn read(line: &str) -> Option<Self> {
        let mut words = line.split(' ');
        let mut word = || words.next();
        Some(Self { host: word()?.to_owned(), pid: word()?.parse().ok()?, space: word()?.to_owned(), begun: word()?.parse().ok()? })
    }

    /// Returns whether the process has certainly ended: it ran on this machine, in this namespace, and runs no more. `false` also means "not known".
    fn has_ended(&self) -> bool {
        let here = Self::here(0);
        // Numbers of another machine or of another namespace say nothing here. Systems other than Linux have no `/proc`.
        if (&here.host, &here.space) != (&self.host, &self.space) || !Path::new("/proc/self/stat").exists() {
            return false;
        }
        // The state follows the last ") ", because the name of the process may contain parentheses. Z is a process that has ended and was not yet waited
        // for by its parent.
        match fs::read_to_string(format!("/proc/{}/stat", self.pid)) {
            Ok(stat) => stat.rsplit_once(") ").is_some_and(|(_, rest)| rest.starts_with(['Z', 'X'])),
            Err(error) => error.kind() == io::ErrorKind::NotFound,
        }
    }
}

impl fmt::Display for Owner {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "process {} of {}", self.pid, self.host)
    }
}

/// Replaces characters that may not stand in a file name. Returns "unknown" for an empty text.
fn plain(text: &str) -> String {
    let plain: String =
        text.trim().chars().map(|letter| if letter.is_ascii_alphanumeric() || ".:[]_-".contains(letter) { letter } else { '_' }).collect();
    // Namespaces read `pid:[4026531836]`. The punctuation is dropped, because Windows forbids `:` in names of files.
    if plain.is_empty() { "unknown".to_owned() } else { plain.replace([':', '[', ']'], "") }
}

/// Ownership of a lease. The ownership lasts while the value lives, the owner renews the lease in time, and no other process takes the lease over. Dropping
/// the value gives the lease back.
#[derive(Debug)]
pub struct Lease {
    /// File of the lease.
    path: PathBuf,
    owner: Owner,
    /// Heartbeats written since the lease was taken.
    beats: u64,
}

/// Result of [`Lease::take`].
#[derive(Debug)]
pub enum Taking {
    /// This process owns the lease now.
    Taken(Lease),
    /// Another process holds the lease, and the lease is not stale.
    Held(Holder),
}

/// State of a held lease, as read at one moment.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Holder {
    /// Process that holds the lease; `None` if the file names no process, as between its creation and the first write.
    pub owner: Option<Owner>,
    /// Time since the holder last renewed the lease, by the clock of the file system.
    pub age: Duration,
    /// Content of the file, compared to see a heartbeat.
    text: String,
}

impl Holder {
    /// Returns whether another process may take the lease over.
    #[must_use]
    pub fn is_stale(&self) -> bool {
        self.age >= STALE || self.owner.as_ref().is_some_and(Owner::has_ended)
    }

    /// Returns whether the lease was renewed or taken after `before` was read, and so has a living holder.
    #[must_use]
    pub fn has_lived_since(&self, before: &Self) -> bool {
        // Without the final newline the file is being written at this moment and proves nothing. The caller looks again later.
        self.text.ends_with('\n') && self.text != before.text
    }

    /// Reads the holder of a lease; `None` if the file does not exist. `now` is the present time by the clock of the file system.
    fn read(path: &Path, now: SystemTime) -> io::Result<Option<Self>> {
        let read = || -> io::Result<(SystemTime, String)> { Ok((fs::metadata(path)?.modified()?, fs::read_to_string(path)?)) };
        match read() {
            Ok((renewed, text)) => {
                let owner = text.lines().next().and_then(Owner::read);
                Ok(Some(Self { owner, age: now.duration_since(renewed).unwrap_or_default(), text }))
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }
}

impl Lease {
    /// Takes a lease that is free or stale. Does not wait.
    ///
    /// # Errors
    ///
    /// The system's error.
    pub fn take(path: &Path, owner: &Owner) -> io::Result<Taking> {
        // The lease can change hands between any two calls, so each round begins with an attempt to create the file. The file system decides the race.
        loop {
            if let Some(lease) = Self::make(path, owner)? {
                return Ok(Taking::Taken(lease));
            }
            match Holder::read(path, now_beside(path, owner)?)? {
                Some(holder) if holder.is_stale() => take_away(path, owner, &holder)?,
                Some(holder) => return Ok(Taking::Held(holder)),
                // The holder gave the lease back between the two calls; the next round creates the file.
                None => {}
            }
        }
    }

    /// Creates the file of a lease; `None` if the file exists.
    fn make(path: &Path, owner: &Owner) -> io::Result<Option<Self>> {
        let mut file = match OpenOptions::new().write(true).create_new(true).open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => return Ok(None),
            Err(error) => return Err(error),
        };
        let lease = Self { path: path.to_path_buf(), owner: owner.clone(), beats: 0 };
        if let Err(error) = file.write_all(lease.text().as_bytes()) {
            // On a full disk an empty file would stay, naming no owner, and would block all processes until stale.
            let _ = fs::remove_file(path);
            return Err(error);
        }
        Ok(Some(lease))
    }

    /// Returns the content of the file: owner and heartbeat.
    fn text(&self) -> String {
        let Owner { host, pid, space, begun } = &self.owner;
        format!("{host} {pid} {space} {begun}\n{}\n", self.beats)
    }

    /// Writes the next heartbeat. Returns `false` if another process has taken the lease over.
    ///
    /// # Errors
    ///
    /// The system's error.
    pub fn renew(&mut self) -> io::Result<bool> {
        if !self.is_mine()? {
            return Ok(false);
        }
        self.beats += 1;
        // Overwrites in place and does not truncate, so that no reader finds an empty file. The number never gets shorter, so no byte of the old text stays
        // after the new text.
        OpenOptions::new().write(true).open(&self.path)?.write_all(self.text().as_bytes())?;
        Ok(true)
    }

    /// Returns whether the file still names this owner.
    fn is_mine(&self) -> io::Result<bool> {
        match fs::read_to_string(&self.path) {
            Ok(text) => Ok(text.lines().next().and_then(Owner::read).as_ref() == Some(&self.owner)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(error),
        }
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        if self.is_mine().unwrap_or(false) {
            // A file that cannot be removed becomes stale by itself.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Returns the present time by the clock of the file system: the modification time of a file created for this purpose. The clock of this machine may differ
/// from the server's.
fn now_beside(path: &Path, owner: &Owner) -> io::Result<SystemTime> {
    let (file, probe) = partial::create(&beside(path, owner))?;
    let made = file.metadata().and_then(|about| about.modified());
    let _ = fs::remove_file(probe);
    made
}

/// Returns a path in the folder of `path`, unique to the process of `owner`.
fn beside(path: &Path, owner: &Owner) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}", owner.name()));
    name.into()
}

/// Renames a stale lease and removes it. If the renamed file turns out to be a newer lease, taken by another process after `stale` was read, the lease is
/// put back.
fn take_away(path: &Path, owner: &Owner, stale: &Holder) -> io::Result<()> {
    let mut away = beside(path, owner).into_os_string();
    away.push(PARTIAL);
    let away = PathBuf::from(away);
    match fs::rename(path, &away) {
        Ok(()) => {}
        // Another process renamed the lease first, or the rename succeeded and its answer was lost.
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error),
    }
    // Compares texts and not times: a heartbeat or a new owner changes the text. If the name is taken again, the newest lease wins.
    if fs::read_to_string(&away).is_ok_and(|text| text != stale.text) && !path.exists() {
        return fs::rename(&away, path);
    }
    match fs::remove_file(&away) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// Returns the leases of a folder with the names of their files, sorted by name, stale leases included. `is_lease` tells whether a name belongs to a lease.
/// `reader` names the temporary file that is created and removed to read the clock of the file system; nothing else is written.
///
/// # Errors
///
/// The system's error.
pub fn leases(folder: &Path, reader: &Owner, is_lease: impl Fn(&str) -> bool) -> io::Result<Vec<(String, Holder)>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        names.extend(entry?.file_name().into_string().ok().filter(|name| is_lease(name)));
    }
    // No lease needs the time, and a folder without leases stays unwritten.
    if names.is_empty() {
        return Ok(Vec::new());
    }
    names.sort_unstable();
    let now = now_beside(&folder.join("leases"), reader)?;
    let held = names.into_iter().map(|name| Ok(Holder::read(&folder.join(&name), now)?.map(|holder| (name, holder))));
    held.filter_map(io::Result::transpose).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owner(host: &str, begun: u64) -> Owner {
        Owner { host: host.to_owned(), pid: 7, space: "pid1".to_owned(), begun }
    }

    fn taken(path: &Path, owner: &Owner) -> Lease {
        match Lease::take(path, owner).unwrap() {
            Taking::Taken(lease) => lease,
            Taking::Held(holder) => panic!("{holder:?} has it"),
        }
    }

    fn held(path: &Path, owner: &Owner) -> Holder {
        match Lease::take(path, owner).unwrap() {
            Taking::Taken(_) => panic!("nobody has it"),
            Taking::Held(holder) => holder,
        }
    }

    /// Moves the modification time of a file into the past.
    fn grow_old(path: &Path, by: Duration) {
        let file = OpenOptions::new().write(true).open(path).unwrap();
        let before = file.metadata().unwrap().modified().unwrap();
        file.set_modified(before - by).unwrap();
    }

    #[test]
    fn a_lease_is_one_owners_until_it_gives_it_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shard.lock");
        let mut first = taken(&path, &owner("a", 1));
        let holder = held(&path, &owner("b", 1));
        assert_eq!((holder.owner, holder.age < STALE), (Some(owner("a", 1)), true));
        assert!(first.renew().unwrap());
        drop(first);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        drop(taken(&path, &owner("b", 1)));
    }

    #[test]
    fn a_lease_that_is_not_renewed_is_taken_over_and_its_owner_sees_that() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shard.lock");
        let mut first = taken(&path, &owner("a", 1));
        grow_old(&path, STALE - BEAT);
        held(&path, &owner("b", 1));
        assert!(first.renew().unwrap());
        grow_old(&path, STALE - BEAT);
        held(&path, &owner("b", 1));
        grow_old(&path, BEAT);
        let mut second = taken(&path, &owner("b", 1));
        assert!(!first.renew().unwrap());
        // The first owner has lost the lease and must not remove the file.
        drop(first);
        assert!(second.renew().unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn the_process_of_a_stale_lease_need_not_be_known() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shard.lock");
        fs::write(&path, "").unwrap();
        assert_eq!(held(&path, &owner("b", 1)).owner, None);
        grow_old(&path, STALE);
        drop(taken(&path, &owner("b", 1)));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_process_of_this_machine_that_has_ended_holds_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shard.lock");
        let mut child = std::process::Command::new("sleep").arg("60").spawn().unwrap();
        let other = Owner { pid: child.id(), ..Owner::here(1) };
        core::mem::forget(taken(&path, &other));
        assert_eq!(held(&path, &Owner::here(2)).owner, Some(other));
        child.kill().unwrap();
        // Nobody has waited for the process yet. It counts as ended, now or in a moment.
        let ended = || matches!(Lease::take(&path, &Owner::here(2)).unwrap(), Taking::Taken(_));
        assert!((0..10_000_000).any(|_| ended()));
        child.wait().unwrap();
    }

    /// Both processes saw a stale lease. The slower process must not remove the new lease of the faster process.
    #[test]
    fn a_lease_that_was_taken_over_meanwhile_is_put_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shard.lock");
        core::mem::forget(taken(&path, &owner("dead", 1)));
        grow_old(&path, STALE);
        let stale = Holder::read(&path, now_beside(&path, &owner("b", 1)).unwrap()).unwrap().unwrap();
        let mut fast = taken(&path, &owner("a", 1));
        take_away(&path, &owner("b", 1), &stale).unwrap();
        assert!(fast.renew().unwrap());
        assert_eq!(held(&path, &owner("b", 1)).owner, Some(owner("a", 1)));
    }

    #[test]
    fn of_many_threads_one_takes_a_stale_lease() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shard.lock");
        for round in 0..50 {
            core::mem::forget(taken(&path, &owner("dead", round)));
            grow_old(&path, STALE);
            let mut leases: Vec<Lease> = std::thread::scope(|scope| {
                let take = |begun| {
                    let path = &path;
                    scope.spawn(move || match Lease::take(path, &owner("a", begun)).unwrap() {
                        Taking::Taken(lease) => Some(lease),
                        Taking::Held(_) => None,
                    })
                };
                let threads: Vec<_> = (0..4).map(|number| take(100 * (round + 1) + number)).collect();
                threads.into_iter().filter_map(|thread| thread.join().unwrap()).collect()
            });
            // A slow process may have renamed the lease of a fast process. The fast process notices at its next heartbeat, and a single owner is left.
            let mine = leases.iter_mut().filter_map(|lease| lease.renew().unwrap().then_some(())).count();
            assert_eq!(mine, 1, "round {round}");
        }
    }

    #[test]
    fn the_leases_of_a_folder_are_listed() {
        let folder = tempfile::tempdir().unwrap();
        let _one = taken(&folder.path().join("shard-1.lock"), &owner("a", 1));
        let _two = taken(&folder.path().join("shard-2.lock"), &owner("b", 1));
        fs::write(folder.path().join("other"), "").unwrap();
        let found = leases(folder.path(), &owner("c", 1), |name| name.starts_with("shard-")).unwrap();
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!((names, found[1].1.owner.clone()), (vec!["shard-1.lock", "shard-2.lock"], Some(owner("b", 1))));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    #[test]
    fn an_owner_reads_back_and_its_name_is_fit_for_a_file() {
        let owner = Owner::here(0x1f);
        let line = format!("{} {} {} {}", owner.host, owner.pid, owner.space, owner.begun);
        assert_eq!(Owner::read(&line), Some(owner.clone()));
        assert!(owner.name().ends_with("-1f") && owner.name().chars().all(|letter| letter.is_ascii_alphanumeric() || "._-".contains(letter)));
        assert_eq!((plain("a b/c\n"), plain("pid:[4]"), plain("")), ("a_b_c".to_owned(), "pid4".to_owned(), "unknown".to_owned()));
    }
}

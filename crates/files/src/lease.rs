//! A lock for processes on several machines that share a folder: a lease, which its owner renews and which goes stale if the owner does not.
//!
//! It needs of the file system what every one has, NFS among them: a file is made by one process alone (`O_EXCL`), a file that was closed is read as it was
//! written by a process that opens it later, and the times of files come from one clock, that of the server. Locks of the system are not needed.
//!
//! | rule | |
//! | --- | --- |
//! | owner | the first line of the file: host, process, and when it began |
//! | heartbeat | the second line, a number; the owner writes the next one every [`BEAT`] |
//! | stale | the file is older than [`STALE`], by the clock of its file system; or the owner was a process of this host that has ended |
//! | a stale lease | is renamed away, which only one process can do, and then taken as if it had never been there |
//! | a lease that is lost | its owner sees that at its next heartbeat, because another one stands in the file |
//!
//! A process that stands still for longer than [`STALE`] can lose its lease without knowing it until its next heartbeat. So two owners can work at the same
//! time, for a moment: a lease saves work, and the files that its owners write must be right without it.

use std::fmt;
use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::partial::{self, PARTIAL};

/// How often an owner renews its lease.
pub const BEAT: Duration = Duration::from_secs(5);

/// A lease that was not renewed for this long is stale: far longer than a file system takes to show what another machine wrote (60 s at most on NFS, whose
/// clients ask again after `acregmax`).
pub const STALE: Duration = Duration::from_secs(90);

/// A process that owns leases and writes files.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Owner {
    /// The name of its machine.
    pub host: String,
    /// Its number there.
    pub pid: u32,
    /// Within which processes the number counts: a container has its own.
    space: String,
    /// What tells it from other processes with the same number.
    begun: u64,
}

impl Owner {
    /// This process. `begun` tells it from earlier ones with the same number: the time by the wall clock, to the nanosecond.
    #[must_use]
    pub fn here(begun: u64) -> Self {
        let host = fs::read_to_string("/proc/sys/kernel/hostname").ok().or_else(|| std::env::var("COMPUTERNAME").ok());
        let space = fs::read_link("/proc/self/ns/pid").map(|link| link.to_string_lossy().into_owned());
        Self { host: plain(&host.unwrap_or_default()), pid: std::process::id(), space: plain(&space.unwrap_or_default()), begun }
    }

    /// What no other process is called; fit for names of files.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}-{}-{:x}", self.host, self.pid, self.begun)
    }

    fn read(line: &str) -> Option<Self> {
        let mut words = line.split(' ');
        let mut word = || words.next();
        Some(Self { host: word()?.to_owned(), pid: word()?.parse().ok()?, space: word()?.to_owned(), begun: word()?.parse().ok()? })
    }

    /// Whether its process has ended for certain: it was on this machine, and is no more.
    fn has_ended(&self) -> bool {
        let here = Self::here(0);
        if (&here.host, &here.space) != (&self.host, &self.space) || !Path::new("/proc/self/stat").exists() {
            return false;
        }
        // Behind the name, which may hold anything: Z is a process that has ended and was not waited for yet.
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

/// The letters of a text that may stand in names of files; never nothing.
fn plain(text: &str) -> String {
    let plain: String =
        text.trim().chars().map(|letter| if letter.is_ascii_alphanumeric() || ".:[]_-".contains(letter) { letter } else { '_' }).collect();
    if plain.is_empty() { "unknown".to_owned() } else { plain.replace([':', '[', ']'], "") }
}

/// A lease, for as long as this value lives, its owner renews it, and nobody takes it over.
#[derive(Debug)]
pub struct Lease {
    path: PathBuf,
    owner: Owner,
    beats: u64,
}

/// Whether a lease was free.
#[derive(Debug)]
pub enum Taking {
    /// It is this process's now.
    Taken(Lease),
    /// Another process has it.
    Held(Holder),
}

/// The process that has a lease.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Holder {
    /// The process; `None` if the file does not say so, as in the moment in which it is made.
    pub owner: Option<Owner>,
    /// How long ago it renewed the lease.
    pub age: Duration,
    /// The whole file.
    text: String,
}

impl Holder {
    /// Whether the lease may be taken over.
    #[must_use]
    pub fn is_stale(&self) -> bool {
        self.age >= STALE || self.owner.as_ref().is_some_and(Owner::has_ended)
    }

    /// Whether the lease was renewed, or taken, since it was looked at before: its holder lives.
    #[must_use]
    pub fn has_lived_since(&self, before: &Self) -> bool {
        // A file that is being written may look like anything, and is looked at again.
        self.text.ends_with('\n') && self.text != before.text
    }

    /// The holder of a lease; `None` if nobody has it. `now` is the time by the clock of the file system.
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
    /// Takes a lease, unless another process has it and it is not stale. Does not wait.
    ///
    /// # Errors
    ///
    /// The error of the system.
    pub fn take(path: &Path, owner: &Owner) -> io::Result<Taking> {
        loop {
            if let Some(lease) = Self::make(path, owner)? {
                return Ok(Taking::Taken(lease));
            }
            match Holder::read(path, now_beside(path, owner)?)? {
                Some(holder) if holder.is_stale() => take_away(path, owner, &holder)?,
                Some(holder) => return Ok(Taking::Held(holder)),
                // It was given back meanwhile.
                None => {}
            }
        }
    }

    /// The lease, if its file could be made.
    fn make(path: &Path, owner: &Owner) -> io::Result<Option<Self>> {
        let mut file = match OpenOptions::new().write(true).create_new(true).open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => return Ok(None),
            Err(error) => return Err(error),
        };
        let lease = Self { path: path.to_path_buf(), owner: owner.clone(), beats: 0 };
        if let Err(error) = file.write_all(lease.text().as_bytes()) {
            // On a full disk it would be nobody's lease.
            let _ = fs::remove_file(path);
            return Err(error);
        }
        Ok(Some(lease))
    }

    fn text(&self) -> String {
        let Owner { host, pid, space, begun } = &self.owner;
        format!("{host} {pid} {space} {begun}\n{}\n", self.beats)
    }

    /// Renews the lease; `false` if it is another process's by now.
    ///
    /// # Errors
    ///
    /// The error of the system.
    pub fn renew(&mut self) -> io::Result<bool> {
        if !self.is_mine()? {
            return Ok(false);
        }
        self.beats += 1;
        // The number never gets shorter, so nothing of the text before is left behind it.
        OpenOptions::new().write(true).open(&self.path)?.write_all(self.text().as_bytes())?;
        Ok(true)
    }

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
            // If it stays it goes stale.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// The time by the clock of the file system: that of a file which was made now.
fn now_beside(path: &Path, owner: &Owner) -> io::Result<SystemTime> {
    let (file, probe) = partial::create(&beside(path, owner))?;
    let made = file.metadata().and_then(|about| about.modified());
    let _ = fs::remove_file(probe);
    made
}

/// A name in the same folder that nobody else uses.
fn beside(path: &Path, owner: &Owner) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}", owner.name()));
    name.into()
}

/// Takes a stale lease away. If another process did the same meanwhile and has it now, it is put back.
fn take_away(path: &Path, owner: &Owner, stale: &Holder) -> io::Result<()> {
    let mut away = beside(path, owner).into_os_string();
    away.push(PARTIAL);
    let away = PathBuf::from(away);
    match fs::rename(path, &away) {
        Ok(()) => {}
        // Somebody else was faster, or the answer of a file server was lost.
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error),
    }
    if fs::read_to_string(&away).is_ok_and(|text| text != stale.text) && !path.exists() {
        return fs::rename(&away, path);
    }
    match fs::remove_file(&away) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// The leases in a folder, by the names of their files, which are those that `is_lease` says; stale ones among them. Nothing but a file for a moment is written.
///
/// # Errors
///
/// The error of the system.
pub fn leases(folder: &Path, reader: &Owner, is_lease: impl Fn(&str) -> bool) -> io::Result<Vec<(String, Holder)>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        names.extend(entry?.file_name().into_string().ok().filter(|name| is_lease(name)));
    }
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

    /// Makes the file older.
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
        // It is not the first one's to give back any more.
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
        // Not waited for yet: it has ended all the same, or does so now.
        let ended = || matches!(Lease::take(&path, &Owner::here(2)).unwrap(), Taking::Taken(_));
        assert!((0..10_000_000).any(|_| ended()));
        child.wait().unwrap();
    }

    /// Both have seen that the lease is stale; the slower one must not take away that of the faster one.
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
            // A slow process may have taken away the lease of a fast one, which then sees it: one owner is left.
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

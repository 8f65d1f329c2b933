//! Worker on a shard: holds the lease of the shard in the shared folder, renews the lease on a thread of its own, and logs finished pieces for `--status`.

use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant as Clock, SystemTime, UNIX_EPOCH};

use cohaptic_campaign::{Shard, worker_log};
use cohaptic_files::{BEAT, Holder, Lease, OwnFolder, Owner, STALE, Taking};

use crate::failure::Failure;
use crate::{interrupt, output};

/// Work of this process on one shard in a folder, from taking the lease to its end.
pub(crate) struct Worker {
    shard: Shard,
    folder: PathBuf,
    begun: Clock,
    log: Mutex<File>,
    /// Set by the heart once another process holds the lease of the shard.
    is_lost: Arc<AtomicBool>,
    /// Sender of a channel without messages: dropping the sender closes the channel, and so ends the heart.
    alive: Option<mpsc::Sender<()>>,
    /// Thread that renews the lease ([`renew`]).
    heart: Option<JoinHandle<()>>,
}

/// Returns this process as an owner of files, made unique by the current time \[ns since 1970\].
pub(crate) fn owner() -> Owner {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Owner::here(u64::try_from(since.as_nanos()).unwrap_or_default())
}

impl Worker {
    /// Takes the lease of a shard in an existing folder, opens the log and starts to renew the lease. If another worker holds the lease, waits until that
    /// worker renews the lease, which is an error, or until the lease is stale.
    pub(crate) fn begin(folder: &Path, shard: Shard, owner: &Owner) -> Result<Self, Failure> {
        let lease = take(folder, shard, owner)?;
        // The lease is taken before this check, and a process that takes the whole folder checks in the opposite order. At least one of the two sees the other.
        if OwnFolder::is_taken(folder) {
            let folder = output::path(folder);
            return Err(Failure::System(format!("another process works on all shards in {folder}: wait until it has ended")));
        }
        let path = folder.join(worker_log(&owner.name()));
        let head = format!("shard {shard} process {} host {}\n", owner.pid, owner.host);
        let begin = || {
            let mut log = OpenOptions::new().append(true).create_new(true).open(&path)?;
            log.write_all(head.as_bytes())?;
            Ok(log)
        };
        let log = begin().map_err(|error| Failure::File { verb: "write", path: path.clone(), error })?;
        let is_lost = Arc::new(AtomicBool::new(false));
        let (alive, ended) = mpsc::channel();
        let heart = thread::Builder::new().name("heart".to_owned()).spawn({
            let is_lost = is_lost.clone();
            move || renew(lease, &ended, &is_lost)
        });
        let heart = heart.map_err(|error| Failure::System(format!("cannot start a thread: {error}")))?;
        let folder = folder.to_path_buf();
        Ok(Self { shard, folder, begun: Clock::now(), log: Mutex::new(log), is_lost, alive: Some(alive), heart: Some(heart) })
    }

    /// Returns whether the worker may continue: the user has not asked for the end, and no other process has taken the shard.
    pub(crate) fn goes_on(&self) -> bool {
        !interrupt::requested() && !self.is_lost.load(Ordering::Relaxed)
    }

    /// Logs a finished piece of work with `units` units. If the line cannot be written, the piece is missing in the status, but the work itself is not
    /// affected.
    pub(crate) fn kept(&self, piece: u64, units: u64) {
        self.write(&format!("piece {piece} {units} {:.3}\n", self.begun.elapsed().as_secs_f64()));
    }

    fn write(&self, line: &str) {
        let _ = self.log.lock().unwrap_or_else(PoisonError::into_inner).write_all(line.as_bytes());
    }

    /// Returns the wall time since the worker began \[s\].
    pub(crate) fn wall_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// Logs the end, gives up the lease and returns `outcome`. If the work failed because another process has the shard now, returns the error of `said`.
    pub(crate) fn end<T, E>(mut self, outcome: Result<T, E>, said: impl FnOnce(Failure) -> E) -> Result<T, E> {
        let word = match &outcome {
            Ok(_) => "done",
            Err(_) if interrupt::requested() => "interrupted",
            Err(_) => "failed",
        };
        self.write(&format!("end {word} {:.3}\n", self.begun.elapsed().as_secs_f64()));
        self.stop();
        // Work that is complete stays valid even if another process took the shard meanwhile, because both processes compute the same pieces.
        if outcome.is_ok() || !self.is_lost.load(Ordering::Relaxed) {
            return outcome;
        }
        Err(said(Failure::System(format!(
            "another process has taken over shard {} in {}, because this one stood still for more than {} s. What it had done is kept; expected one process for a shard",
            self.shard,
            output::path(&self.folder),
            STALE.as_secs()
        ))))
    }

    fn stop(&mut self) {
        drop(self.alive.take());
        if let Some(heart) = self.heart.take() {
            // The heart waits only for the channel, which is closed now, so the join returns soon.
            let _ = heart.join();
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Renews a lease at each beat until the worker ends or the lease is lost. A lost lease sets `is_lost`.
fn renew(mut lease: Lease, ended: &mpsc::Receiver<()>, is_lost: &AtomicBool) {
    while ended.recv_timeout(BEAT) == Err(mpsc::RecvTimeoutError::Timeout) {
        // An error may be a short outage of a file server, so the next beat tries again. After a long outage another process may have taken the lease, and the
        // first successful renewal reports that loss.
        if lease.renew().is_ok_and(|is_mine| !is_mine) {
            is_lost.store(true, Ordering::Relaxed);
            return;
        }
    }
}

/// Interval at which a waiting worker tries again to take the lease.
const LOOK: Duration = Duration::from_millis(500);

fn take(folder: &Path, shard: Shard, owner: &Owner) -> Result<Lease, Failure> {
    let path = folder.join(shard.lease());
    let mut seen: Option<Holder> = None;
    loop {
        let taking = Lease::take(&path, owner).map_err(|error| Failure::File { verb: "lock", path: path.clone(), error })?;
        let holder = match taking {
            Taking::Taken(lease) => return Ok(lease),
            Taking::Held(holder) => holder,
        };
        // A killed process leaves its lease behind. Only a renewal between two looks proves a living holder.
        if seen.as_ref().is_some_and(|seen| holder.has_lived_since(seen)) {
            return Err(busy(folder, shard, &holder));
        }
        if seen.is_none() {
            say_that_it_waits(folder, shard, &holder);
        }
        if interrupt::requested() {
            return Err(Failure::Interrupted("nothing was begun".to_owned()));
        }
        seen.get_or_insert(holder);
        thread::sleep(LOOK);
    }
}

fn words(holder: &Holder) -> String {
    holder.owner.as_ref().map_or_else(|| "another process".to_owned(), ToString::to_string)
}

fn busy(folder: &Path, shard: Shard, holder: &Holder) -> Failure {
    Failure::System(format!("{} works on shard {shard} in {}: wait until it has ended, or do another shard", words(holder), output::path(folder)))
}

fn say_that_it_waits(folder: &Path, shard: Shard, holder: &Holder) {
    // A failed write to standard error does not end the wait.
    let _ = writeln!(
        std::io::stderr(),
        "{} has shard {shard} in {} and was heard of {} s ago: waiting until it is heard of again, or has not been for {} s",
        words(holder),
        output::path(folder),
        holder.age.as_secs(),
        STALE.as_secs()
    );
}

/// Checks that no worker holds the lease of a shard in a folder, so that this process may work there alone.
pub(super) fn nobody_works_in(folder: &Path) -> Result<(), Failure> {
    let unreadable = |error| Failure::File { verb: "read", path: folder.to_path_buf(), error };
    let leases = cohaptic_files::leases(folder, &owner(), |name| Shard::of_lease(name).is_some()).map_err(unreadable)?;
    match leases.iter().find_map(|(name, holder)| Shard::of_lease(name).filter(|_| !holder.is_stale()).map(|shard| (shard, holder))) {
        Some((shard, holder)) => Err(busy(folder, shard, holder)),
        None => Ok(()),
    }
}

//! The test bed: what it is made of, and its run.

mod again;
mod hitting;
#[cfg(feature = "strategies")]
mod network;
mod running;
#[cfg(feature = "tcp")]
mod tcp;

#[cfg(feature = "tcp")]
use std::collections::BTreeMap;
use std::future::Future;
use std::panic::{AssertUnwindSafe, Location, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

#[cfg(feature = "tcp")]
use cohaptic_wan::NodeId;

pub use running::Bed;

use crate::artefacts::Artefacts;
use crate::core::Core;
use crate::failure;
use crate::file::LinkFile;
use crate::link::ToLink;
use crate::names::Names;
use crate::record::Record;
use crate::seed::{Place, Seed};
use crate::setup::Setup;
#[cfg(feature = "tcp")]
use crate::tcp::TcpConfig;
use crate::trace::Trace;
use crate::watch::{Kind, Watched};
use crate::wire::Recorded;

/// Hosts, the links between them, and a program that is run on them in virtual time.
///
/// ```
/// use std::time::Duration;
/// use cohaptic_testkit::{Testbed, UdpSocket, time};
///
/// let delay = Testbed::new(["client", "server"]).links("delay 24ms").run(|bed| async move {
///     bed.host("server").spawn(async {
///         let socket = UdpSocket::bind("0.0.0.0:7").await?;
///         let mut buffer = [0; 1500];
///         let (len, from) = socket.recv_from(&mut buffer).await?;
///         socket.send_to(&buffer[..len], from).await
///     });
///     let socket = bed.host("client").bind("0.0.0.0:0").unwrap();
///     socket.send_to(b"echo", "server:7").await.unwrap();
///     socket.recv(&mut [0; 1500]).await.unwrap();
///     time::now()
/// });
/// assert_eq!(delay.as_nanos(), 48_000_000);
/// ```
#[derive(Clone, Debug)]
#[must_use = "a test bed does nothing until it is run"]
pub struct Testbed {
    setup: Setup,
    /// By host, where they are not Linux's.
    #[cfg(feature = "tcp")]
    tcp: BTreeMap<NodeId, TcpConfig>,
    #[cfg(feature = "tokio")]
    is_tokio: bool,
}

impl Testbed {
    /// Hosts of these names, with ideal links between them.
    ///
    /// # Panics
    ///
    /// If there is no host or more than 23,170, a name is empty or there twice, or has one of the characters that an address is written with (`:`, `[`, `]`,
    /// white space).
    pub fn new<N: Into<String>>(hosts: impl IntoIterator<Item = N>) -> Self {
        let names: Names = hosts.into_iter().collect();
        assert!(!names.is_empty(), "a test bed without hosts; expected one name at least");
        Self {
            setup: Setup::new("host", names),
            #[cfg(feature = "tcp")]
            tcp: BTreeMap::new(),
            #[cfg(feature = "tokio")]
            is_tokio: false,
        }
    }

    /// The hosts and the links between them that a file says: see [`LinkFile`].
    ///
    /// # Panics
    ///
    /// If the file cannot be read or makes no sense, with the path, the place and the line.
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    #[track_caller]
    pub fn from_file(path: impl AsRef<std::path::Path>) -> Self {
        match LinkFile::read(path) {
            Ok(file) => file.into(),
            Err(error) => panic!("{error}"),
        }
    }

    /// The names of the hosts.
    #[must_use]
    pub fn hosts(&self) -> &[String] {
        &self.setup.names
    }

    /// What every link is that is not named by [`Testbed::link`], before or after: a model, or words of `tc-netem`.
    ///
    /// # Panics
    ///
    /// If the words are none.
    pub fn links(mut self, link: impl ToLink) -> Self {
        self.setup.set_every(link);
        self
    }

    /// What the link from one host to another is; the way back is a link of its own.
    ///
    /// # Panics
    ///
    /// If there is no such host, both are the same, or the words are none.
    pub fn link(mut self, from: &str, to: &str, link: impl ToLink) -> Self {
        self.setup.set_link(from, to, link);
        self
    }

    /// What the links in both directions between two hosts are. Each has random numbers of its own.
    ///
    /// # Panics
    ///
    /// As [`Testbed::link`].
    pub fn link_both(self, one: &str, other: &str, link: impl ToLink) -> Self {
        self.link(one, other, &link).link(other, one, &link)
    }

    /// The seed of all chance in the links, unless the environment says another one ([`SEED_VARIABLE`](crate::SEED_VARIABLE)). Without it, the seed is made of
    /// the file in which the bed is run and the function in which the program stands. So it does not depend on threads, and is the same with `--test-threads=1` and with
    /// nextest; to edit other functions, or to move this one within its file, does not change it, and to rename it does. Two beds of one function have one seed.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.setup.seed = Some(seed);
        self
    }

    /// How many bytes of datagrams a socket holds that nobody has read; what comes beyond is lost. 212,992 if it is not said, as with Linux.
    pub const fn receive_buffer(mut self, bytes: usize) -> Self {
        self.setup.settings.receive_buffer = bytes;
        self
    }

    /// How often tasks may be polled at one instant before the run is given up, because time does not pass; a million if it is not said.
    pub const fn patience(mut self, polls: u64) -> Self {
        self.setup.settings.patience = polls;
        self
    }

    /// Until when the program may run, in its own time; an hour if it is not said. A run that goes on is given up, with the network, each task, and what the
    /// task waits for since when: a program that asks again and again over a network that answers nothing would never end. [`Duration::MAX`] is no limit.
    pub const fn time_limit(mut self, limit: Duration) -> Self {
        self.setup.settings.limits.time = limit;
        self
    }

    /// Limit of the polls of all tasks of a run; twenty million if it is not said, which takes some seconds. A run that goes on is given up as with
    /// [`Testbed::time_limit`]. `u64::MAX` is no limit.
    pub const fn step_limit(mut self, polls: u64) -> Self {
        self.setup.settings.limits.steps = polls;
        self
    }

    /// How many bytes the run may hold that were sent and neither read nor lost, on links, in buffers of sockets and in streams of TCP; a gibibyte if it is not
    /// said. Each packet counts 200 bytes more than its content, for its places in queues. A run that comes to hold more fails, and names the host, the
    /// socket and the task that sent last: a loop that only sends would take all memory otherwise. `u64::MAX` is no limit.
    pub const fn byte_limit(mut self, bytes: u64) -> Self {
        self.setup.settings.byte_limit = bytes;
        self
    }

    /// For how long by the wall clock a task may run without returning to the executor, a minute if it is not said. Then the process ends, after the task, its host, the
    /// time of the run and the seed have been told on standard error, and what happened has been written where [`Testbed::artefacts`] says: a loop without an `.await`
    /// cannot be stopped otherwise. Tasks of tokio's own that wake each other without letting time pass are found too. [`STALL_VARIABLE`](crate::STALL_VARIABLE)
    /// says it for all tests of a process; [`Duration::MAX`] is never. On Linux a process under a debugger is left alone.
    pub const fn stall_limit(mut self, limit: Duration) -> Self {
        self.setup.stall_limit = limit;
        self
    }

    /// Leaves what packets carry out of what [`Testbed::run_twice`] compares: for protocols whose keys are random. The times, the sizes and the ends of all
    /// packets are compared still.
    pub const fn without_digests(mut self) -> Self {
        self.setup.settings.digests = false;
        self
    }

    /// Records what happens, for [`Bed::trace`].
    pub const fn traced(mut self) -> Self {
        self.setup.settings.traces = true;
        self
    }

    /// If the run fails, what happened is written into this folder: see [`Record::write`]. [`ARTEFACTS_VARIABLE`](crate::ARTEFACTS_VARIABLE) asks for it without
    /// the test.
    pub fn artefacts(mut self, folder: impl Into<PathBuf>) -> Self {
        self.setup.artefacts = Some(folder.into());
        self
    }

    /// Runs the program on tokio, whose clock is paused: for programs that use tokio's timers and tasks. Otherwise an executor of this crate runs it.
    ///
    /// Packets arrive, and [`time`](crate::time) goes off, to the nanosecond all the same. Tokio's own timers are rounded up to the next millisecond since the run
    /// began, as they are with tokio's paused clock elsewhere: a `tokio::time::sleep` of 2.5 ms is over after 3 ms. `tokio::select!` without `biased` chooses
    /// at random, and so two runs differ.
    #[cfg(feature = "tokio")]
    pub const fn on_tokio(mut self) -> Self {
        self.is_tokio = true;
        self
    }

    /// Runs a program until it is over, and gives what came out. Tasks that run on then are dropped.
    ///
    /// # Panics
    ///
    /// If the program or one of its tasks does, with the task and the seed on standard error; if nothing will ever happen any more, time does not pass, the run
    /// goes on beyond [`Testbed::time_limit`] or [`Testbed::step_limit`], or more than [`Testbed::byte_limit`] is on its way; if another thread uses a socket
    /// of the run; inside another test bed or runtime.
    #[track_caller]
    pub fn run<T, F>(self, program: impl FnOnce(Bed) -> F) -> T
    where
        F: Future<Output = T> + 'static,
        T: 'static,
    {
        let seed = Seed::choose(self.setup.seed, &Place::of(&program));
        self.run_once(&seed, program, Location::caller()).0
    }

    /// Runs a program as [`Testbed::run`] does, and gives what happened too.
    ///
    /// # Panics
    ///
    /// As [`Testbed::run`].
    #[track_caller]
    pub fn run_recorded<T, F>(mut self, program: impl FnOnce(Bed) -> F) -> (T, Record)
    where
        F: Future<Output = T> + 'static,
        T: 'static,
    {
        self.setup.record();
        let seed = Seed::choose(self.setup.seed, &Place::of(&program));
        self.run_once(&seed, program, Location::caller())
    }

    /// Runs a program twice, and gives what came out first, if all that happened was the same to the nanosecond: every packet, with what it carried.
    ///
    /// # Panics
    ///
    /// As [`Testbed::run`]; and if the two runs differ, with the first difference and its time.
    #[track_caller]
    #[expect(clippy::panic, reason = "what it was asked to find out")]
    pub fn run_twice<T, F>(mut self, program: impl Fn(Bed) -> F) -> T
    where
        F: Future<Output = T> + 'static,
        T: 'static,
    {
        self.setup.settings.traces = true;
        let seed = Seed::choose(self.setup.seed, &Place::of(&program));
        let (outcome, first) = self.clone().run_once(&seed, &program, Location::caller());
        let (_, second) = self.run_once(&seed, &program, Location::caller());
        if let Some(difference) = first.trace().first_difference(second.trace()) {
            panic!(
                "the program does not do the same twice: {difference}Look for hash maps, threads, the time of day, random numbers without a seed, and \
                 `tokio::select!` without `biased`.\n{}",
                seed.advice()
            );
        }
        outcome
    }

    fn run_once<T, F>(self, seed: &Seed, program: impl FnOnce(Bed) -> F, origin: &'static Location<'static>) -> (T, Record)
    where
        F: Future<Output = T> + 'static,
        T: 'static,
    {
        let again = self.again(seed, origin);
        let mut setup = self.setup;
        let artefacts = Artefacts::new(setup.artefacts.take(), seed);
        if artefacts.is_wanted() {
            setup.record();
        }
        let (link, names) = (setup.links(), setup.names);
        #[cfg_attr(not(feature = "tcp"), expect(unused_mut, reason = "only TCP has constants"))]
        let mut core = Core::new(&names, seed.value, setup.settings, setup.changes, link);
        #[cfg(feature = "tcp")]
        self.tcp.iter().for_each(|(host, config)| core.set_tcp(*host, config.clone()));
        let mut recorded = None;
        #[cfg(feature = "tokio")]
        let kind = if self.is_tokio { Kind::Tokio } else { Kind::Own };
        #[cfg(not(feature = "tokio"))]
        let kind = Kind::Own;
        let watched = Watched::begin(kind, &names, setup.stall_limit, seed, &artefacts);
        let run = || {
            #[cfg(feature = "tokio")]
            if self.is_tokio {
                return crate::runtime::on_tokio::run(core, names.len(), |shared| program(Bed::new(shared)), origin, &watched, &mut recorded);
            }
            crate::runtime::own::run(core, names.len(), |shared| program(Bed::new(shared)), origin, &watched, &mut recorded)
        };
        let outcome = catch_unwind(AssertUnwindSafe(|| failure::__rust_begin_short_backtrace(run)));
        // While a panic is reported nothing is watched any more.
        let panicked = watched.pulse.running().map(|runner| runner.words(&names));
        drop(watched);
        let mut recorded = recorded.unwrap_or_else(|| Recorded { trace: Trace::new(Arc::clone(&names)), ..Recorded::default() });
        let drawn = std::mem::take(&mut recorded.drawn);
        let record = Record::new(seed.clone(), recorded);
        match outcome {
            Ok(outcome) => {
                failure::note_run(|| {
                    let record = record.clone();
                    Box::new(move || artefacts.report(None, again.test(&drawn, false), record))
                });
                (outcome, record)
            }
            Err(panic) => {
                // A test whose seed or links it does not get from elsewhere fails again as it stands.
                let differs = failure::is_searching() || !seed.is_of_place && again.has_chance();
                failure::report(Box::new(move || {
                    let test = if differs { again.test(&drawn, true) } else { String::new() };
                    artefacts.report(panicked, test, record)
                }));
                resume_unwind(panic)
            }
        }
    }
}

impl From<LinkFile> for Testbed {
    fn from(file: LinkFile) -> Self {
        let mut bed = Self::new(&*file.hosts);
        bed.setup.read(file);
        bed
    }
}

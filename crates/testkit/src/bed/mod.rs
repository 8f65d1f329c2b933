//! Test bed: parts and run.

mod addresses;
mod again;
mod hitting;
#[cfg(feature = "loopback")]
mod loopback;
mod nat;
#[cfg(feature = "strategies")]
mod network;
mod running;
#[cfg(feature = "facade")]
mod standard;
#[cfg(feature = "tcp")]
mod tcp;

use std::cell::RefCell;
#[cfg(feature = "tcp")]
use std::collections::BTreeMap;
use std::future::Future;
use std::panic::{AssertUnwindSafe, Location, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

#[cfg(feature = "tcp")]
use cohaptic_wan::NodeId;

pub use nat::{Nat, NatMapping, NatProtocol};
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
use crate::task::Program;
#[cfg(feature = "tcp")]
use crate::tcp::TcpConfig;
use crate::trace::Trace;
use crate::watch::{Kind, Watched};
use crate::wire::Recorded;
use crate::words::DeviceLine;

/// Test bed: hosts, the links between the hosts, and the settings of a run. A program runs on the hosts in virtual time.
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
    /// Constants of TCP of hosts with other constants than the defaults of Linux.
    #[cfg(feature = "tcp")]
    tcp: BTreeMap<NodeId, TcpConfig>,
    #[cfg(feature = "tokio")]
    is_tokio: bool,
}

impl Testbed {
    /// Creates a test bed with hosts of these names, and ideal links between them.
    ///
    /// # Panics
    ///
    /// If there is no host or more than 23,170, or if a name is empty, occurs twice, or contains a character with which an address is written (`:`, `[`, `]`,
    /// white space).
    pub fn new<N: Into<String>>(hosts: impl IntoIterator<Item = N>) -> Self {
        let names: Names = hosts.into_iter().collect();
        assert!(!names.is_empty(), "the test bed has no hosts: give at least one name");
        Self {
            setup: Setup::new("host", names),
            #[cfg(feature = "tcp")]
            tcp: BTreeMap::new(),
            #[cfg(feature = "tokio")]
            is_tokio: false,
        }
    }

    /// Creates a test bed with the hosts and links of a file: see [`LinkFile`].
    ///
    /// # Panics
    ///
    /// If the file cannot be read or makes no sense. The message names the path, the place and the line.
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    #[track_caller]
    pub fn from_file(path: impl AsRef<std::path::Path>) -> Self {
        match LinkFile::read(path) {
            Ok(file) => file.into(),
            Err(error) => panic!("{error}"),
        }
    }

    /// Returns the names of the hosts.
    #[must_use]
    pub fn hosts(&self) -> &[String] {
        &self.setup.names[..self.setup.hosts()]
    }

    /// Sets all links that no call of [`Testbed::link`] names, whether before or after this call. A link is a model, or words of `tc-netem`.
    ///
    /// # Panics
    ///
    /// If the words describe no link.
    pub fn links(mut self, link: impl ToLink) -> Self {
        self.setup.set_every(link);
        self
    }

    /// Sets the link from a host to another host. The link back is separate.
    ///
    /// # Panics
    ///
    /// If there is no such host, if both hosts are the same, or if the words describe no link.
    pub fn link(mut self, from: &str, to: &str, link: impl ToLink) -> Self {
        self.setup.set_link(from, to, link);
        self
    }

    /// Sets the links in both directions between two hosts. Each link draws random numbers of its own.
    ///
    /// # Panics
    ///
    /// As [`Testbed::link`].
    pub fn link_both(self, one: &str, other: &str, link: impl ToLink) -> Self {
        self.link(one, other, &link).link(other, one, &link)
    }

    /// Gives a host the access lines of a link of the library, such as `starlink`, `lte-driving delay*1.4` or `dsl queue.limit=60ms` (feature `files`): see
    /// [`LibraryLink`](crate::LibraryLink). Every packet of the host first passes the *uplink*, the link of the library away from the user; every packet to the
    /// host last passes the *downlink*, towards the user. In between is the link from host to host, ideal unless the test says otherwise. Packets to all other
    /// hosts share the uplink and wait for each other there.
    ///
    /// A modulator of the link, of its rate for example, changes uplink and downlink of one host together, and the access lines of two hosts apart.
    /// [`Bed::access_stats`] returns the statistics of the lines, and the trace names the part of the path on which a packet was lost. A packet dropped by a
    /// [hit](crate::hit) has passed the uplink, and goes no further.
    ///
    /// ```
    /// use cohaptic_testkit::{Instant, Testbed, time};
    ///
    /// let arrived = Testbed::new(["phone", "server"]).access("phone", "devtools/slow-4g").links("transatlantic").run(|bed| async move {
    ///     let server = bed.host("server").bind("0.0.0.0:7").unwrap();
    ///     bed.host("phone").bind("0.0.0.0:0").unwrap().send_to(&[0; 75], "server:7").await.unwrap();
    ///     server.recv(&mut [0; 75]).await.unwrap();
    ///     assert_eq!(bed.access_stats("phone").unwrap().uplink.delivered(), 1);
    ///     time::now()
    /// });
    /// // 600 bits at 750 kbit/s, 75 ms over the uplink, and 38 ms over the Atlantic.
    /// assert_eq!(arrived, Instant::from_nanos(113_800_000));
    /// ```
    ///
    /// # Panics
    ///
    /// If there is no such host, or the library has no such link. A name with a direction is refused, because a host has both.
    #[cfg(feature = "files")]
    pub fn access(mut self, host: &str, link: impl AsRef<str>) -> Self {
        self.setup.set_access(host, link.as_ref());
        self
    }

    /// Sets the seed of all chance in the links. The environment variable [`SEED_VARIABLE`](crate::SEED_VARIABLE) takes precedence. Without either, the seed is
    /// derived from the file in which the bed is run and the function that contains the program. So the seed does not depend on threads, and is the same with
    /// `--test-threads=1` and with nextest. Editing other functions or moving this function within its file does not change the seed; renaming the function
    /// does. Two beds of one function have the same seed.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.setup.seed = Some(seed);
        self
    }

    /// Sets the size of the receive buffer of a UDP socket \[bytes\]. As with Linux, a datagram counts with the memory that its packet takes, 832 bytes at
    /// least, and datagrams that do not fit are lost until the program reads. A datagram fits into an empty buffer, however long it is. The default is 212,992,
    /// as with Linux: 256 datagrams of at most 197 bytes, or 92 of 1472.
    pub const fn receive_buffer(mut self, bytes: usize) -> Self {
        self.setup.settings.receive_buffer = bytes;
        self
    }

    /// Sets how often tasks may be polled at one instant. Beyond this number the run fails, because time does not pass. The default is a million.
    pub const fn patience(mut self, polls: u64) -> Self {
        self.setup.settings.patience = polls;
        self
    }

    /// Sets the time limit of the program, in virtual time. The default is an hour. A run that goes on beyond the limit fails, and the message names the
    /// network, each waiting task, the things that the task waits for, and since when. Without a limit a program that repeats a request over a network without
    /// answers would never end. [`Duration::MAX`] stands for no limit.
    pub const fn time_limit(mut self, limit: Duration) -> Self {
        self.setup.settings.limits.time = limit;
        self
    }

    /// Sets the limit of the polls of all tasks of a run. The default is twenty million polls, which take some seconds. A run that goes on beyond the limit
    /// fails as with [`Testbed::time_limit`]. `u64::MAX` stands for no limit.
    pub const fn step_limit(mut self, polls: u64) -> Self {
        self.setup.settings.limits.steps = polls;
        self
    }

    /// Sets how many bytes the run may hold that were sent and neither read nor lost: on links, in buffers of sockets, and in streams of TCP. The default is a
    /// gibibyte. Each packet counts 200 bytes more than its content, for its entries in queues. A run that holds more fails, and the message names the host,
    /// the socket and the task that sent last. Without a limit a loop that only sends would take all memory. `u64::MAX` stands for no limit.
    pub const fn byte_limit(mut self, bytes: u64) -> Self {
        self.setup.settings.byte_limit = bytes;
        self
    }

    /// Sets how long a task may run without returning to the executor, by the wall clock. The default is a minute. After that time the process ends, because a
    /// loop without an `.await` cannot be stopped otherwise. Before, the task, its host, the time of the run and the seed are printed on standard error, and
    /// the record of the run is written where [`Testbed::artefacts`] says. Tasks of tokio that wake each other without letting time pass are found as well. The
    /// environment variable [`STALL_VARIABLE`](crate::STALL_VARIABLE) sets the limit for all tests of a process; [`Duration::MAX`] stands for no limit. On
    /// Linux a process under a debugger is left alone.
    pub const fn stall_limit(mut self, limit: Duration) -> Self {
        self.setup.stall_limit = limit;
        self
    }

    /// Leaves the contents of packets out of the comparison of [`Testbed::run_twice`], for protocols with random keys. The times, the sizes and the ends of all
    /// packets are still compared.
    pub const fn without_digests(mut self) -> Self {
        self.setup.settings.digests = false;
        self
    }

    /// Records the events of the run, for [`Bed::trace`].
    pub const fn traced(mut self) -> Self {
        self.setup.settings.traces = true;
        self
    }

    /// Sets the folder into which a failing run writes its record: see [`Record::write`]. The environment variable
    /// [`ARTEFACTS_VARIABLE`](crate::ARTEFACTS_VARIABLE) does the same without a change of the test.
    pub fn artefacts(mut self, folder: impl Into<PathBuf>) -> Self {
        self.setup.artefacts = Some(folder.into());
        self
    }

    /// Runs the program on tokio with a paused clock, for programs that use tokio's timers and tasks. Without this call an executor of this crate runs the
    /// program.
    ///
    /// Packets and [`time`](crate::time) still have a resolution of a nanosecond. Tokio's own timers are rounded up to the next millisecond since the beginning
    /// of the run, as always with tokio's paused clock: a `tokio::time::sleep` of 2.5 ms ends after 3 ms. `tokio::select!` without `biased` chooses at random,
    /// so that two runs differ.
    #[cfg(feature = "tokio")]
    pub const fn on_tokio(mut self) -> Self {
        self.is_tokio = true;
        self
    }

    /// Runs a program until it is over, and returns its output. Tasks that are still running are then dropped.
    ///
    /// # Panics
    ///
    /// If the program or one of its tasks panics, with the task and the seed on standard error. If nothing will ever happen any more, time does not pass, the
    /// run goes on beyond [`Testbed::time_limit`] or [`Testbed::step_limit`], or holds more than [`Testbed::byte_limit`]. If another thread uses a socket of
    /// the run. If the call is made inside the run of another test bed or, on tokio, inside another runtime.
    #[track_caller]
    pub fn run<T, F>(self, program: impl FnOnce(Bed) -> F) -> T
    where
        F: Future<Output = T> + 'static,
        T: 'static,
    {
        let seed = Seed::choose(self.setup.seed, &Place::of(&program));
        self.run_once(&seed, program, Location::caller()).0
    }

    /// Runs a program like [`Testbed::run`], and returns its output and the record of the run.
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

    /// Runs a program twice, compares every event of the two runs to the nanosecond, with the content of every packet, and returns the first output.
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
        // The same seed and place: every difference of the traces comes from the program itself.
        let (_, second) = self.run_once(&seed, &program, Location::caller());
        if let Some(difference) = first.trace().first_difference(second.trace()) {
            panic!(
                "two runs of the program are not the same: {difference}Look for hash maps, threads, the time of day, random numbers without a seed, and \
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
        let outcome = Rc::new(RefCell::new(None));
        let slot = Rc::clone(&outcome);
        let program = |bed| -> Program {
            // Boxed by itself, because a program may hold arrays, and without optimisation each future around it would keep a copy on the stack.
            let future = Box::pin(program(bed));
            Box::pin(async move {
                let came_out = future.await;
                *slot.borrow_mut() = Some(came_out);
            })
        };
        let record = self.run_boxed(seed, Box::new(program), origin);
        (outcome.take().expect("a run ends with its program, or panics"), record)
    }

    /// Not generic, so that the compiler translates both executors once, with the test kit, and not for each program.
    fn run_boxed(self, seed: &Seed, program: Box<dyn FnOnce(Bed) -> Program + '_>, origin: &'static Location<'static>) -> Record {
        #[cfg(feature = "tokio")]
        let is_tokio = self.is_tokio;
        let execute = |core, hosts, watched: &Watched, recorded: &mut Option<Recorded>| {
            #[cfg(feature = "tokio")]
            if is_tokio {
                #[cfg(feature = "facade")]
                cohaptic_sockets::seed_next_runtime(seed.value);
                return crate::runtime::on_tokio::run(core, hosts, |shared| program(Bed::new(shared)), origin, watched, recorded);
            }
            crate::runtime::own::run(core, hosts, |shared| program(Bed::new(shared)), origin, watched, recorded);
        };
        self.run_with(seed, origin, execute).1
    }

    /// Makes the state of a run, calls `execute` with the state and the number of hosts, and reports a failure.
    fn run_with<T>(
        self,
        seed: &Seed,
        origin: &'static Location<'static>,
        execute: impl FnOnce(Core, usize, &Watched, &mut Option<Recorded>) -> T,
    ) -> (T, Record) {
        let again = self.again(seed, origin);
        let mut setup = self.setup;
        setup.check_links();
        let artefacts = Artefacts::new(setup.artefacts.take(), seed);
        failure::install();
        if artefacts.is_wanted() {
            setup.record();
        }
        // A run on a loopback runs the runtime of a program without a test bed of its own. No printed test could repeat such a run.
        let has_test = setup.settings.loopback.is_none();
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
        let run = || execute(core, names.len(), &watched, &mut recorded);
        // The panic is caught, because the report needs the record, which `execute` stores while the panic unwinds.
        let outcome = catch_unwind(AssertUnwindSafe(|| failure::__rust_begin_short_backtrace(run)));
        // The watchdog ends here: the report of a panic may take long.
        let panicked = watched.pulse.running().map(|runner| runner.words(&names));
        drop(watched);
        // A run that failed before its start has no record.
        let mut recorded = recorded.unwrap_or_else(|| Recorded { trace: Trace::new(Arc::clone(&names)), ..Recorded::default() });
        let drawn = std::mem::take(&mut recorded.drawn);
        let record = Record::new(seed.clone(), recorded);
        match outcome {
            Ok(outcome) => {
                // The run has succeeded, but a property may still fail with the outcome. The record is copied only while a strategy searches.
                failure::note_run(|| {
                    let record = record.clone();
                    Box::new(move || artefacts.report(None, again.test(&drawn, false), record))
                });
                (outcome, record)
            }
            Err(panic) => {
                // A test with links of its own fails again as it stands, if the seed comes from the place of the test or nothing is left to chance. Otherwise,
                // or if a strategy drew the links, the report prints a test.
                let differs = has_test && (failure::is_searching() || !seed.is_of_place && again.has_chance());
                failure::report(Box::new(move || {
                    let test = if differs { again.test(&drawn, true) } else { String::new() };
                    artefacts.report(panicked, test, record)
                }));
                resume_unwind(failure::told(panic))
            }
        }
    }
}

impl From<LinkFile> for Testbed {
    fn from(file: LinkFile) -> Self {
        let mut bed = Self::new(file.hosts());
        for line in &file.devices {
            let first = bed.setup.names.len();
            let named = |nodes: &[usize]| nodes.iter().map(|node| &*file.hosts[*node]).collect::<Vec<_>>();
            match line {
                DeviceLine::Middlebox { behaviour, translates, inside } => {
                    bed.setup.add_middlebox(&file.hosts[first], behaviour.clone(), *translates, &named(inside));
                }
                DeviceLine::Interfaces { host, count } => {
                    bed.setup.add_interfaces(&file.hosts[*host], &named(&(first..first + count).collect::<Vec<_>>()));
                }
            }
        }
        bed.setup.read(file);
        bed
    }
}

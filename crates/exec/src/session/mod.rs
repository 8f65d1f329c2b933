//! A whole run: hosts with their commands, links, and the gateway.

mod output;
mod trial;
mod watch;

use core::time::Duration;
use std::ffi::OsString;
use std::io::BufWriter;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::thread;

use cohaptic_capture::CaptureWriter;
use cohaptic_linkfile::LinkTable;
use cohaptic_realtime::{LatenessSummary, Pacing, Prepared, Tolerance, Validity, Wishes, prepare_thread};
use cohaptic_units::Instant;
use cohaptic_wan::{LinkStats, NodeId};
use nix::sys::signalfd::SignalFd;

use crate::emulation::{Capture, Emulation, Port};
use crate::exchange::{Counts, Exchange, Node};
use crate::gateway::Gateway;
use crate::host::{Failed, Host, Output};
use crate::inside::Setup;
use crate::signals;
use output::Outputs;
pub use output::{Line, Stream};
use watch::{Ended, Watch};

/// Hosts, links and gateway of a run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Hosts, in the order of their start.
    pub hosts: Vec<HostPlan>,
    /// Way to the real world, or `None` for none.
    pub gateway: Option<GatewayPlan>,
    /// Links between the nodes, in the order of [`Plan::nodes`].
    pub links: LinkTable,
    /// Way in which the thread of the network waits.
    pub pacing: Pacing,
    /// Requests of the thread of the network to the system.
    pub wishes: Wishes,
    /// Lateness above which a packet counts as late.
    pub tolerance: Tolerance,
    /// Folder for a capture of each host, or `None` for no captures.
    pub captures: Option<PathBuf>,
}

/// Host of a [`Plan`].
#[derive(Clone, Debug)]
pub struct HostPlan {
    /// Name of the host, by which links, captures and output name the host.
    pub name: String,
    /// Network and names in the view of the command.
    pub setup: Setup,
    /// Command with its arguments.
    pub command: Vec<OsString>,
    /// `true` if the run ends with this command and has its status.
    pub is_main: bool,
    /// Text in the output after which the next hosts may start, or `None` if the next hosts may start at once.
    pub ready: Option<String>,
    /// Way of the command's output.
    pub output: Output,
}

/// Way to the real world.
#[derive(Clone, Debug)]
pub struct GatewayPlan {
    /// Name of the gateway, by which links name the gateway.
    pub name: String,
    /// Name server of the machine.
    pub name_server: Option<SocketAddr>,
    /// Addresses of the machine with a way to the same port of the first host.
    pub listen: Vec<SocketAddr>,
}

/// Name of the node of [`Plan::loopback`], by which links name the node.
const LOOPBACK: &str = "loopback";

impl Plan {
    /// Returns the index of the host whose packets to itself pass links: the first host with [`Setup::loopback`]. The last node of the network stands for the
    /// servers of this host. Packets of clients pass the link from the host to this node, and packets of servers the link back.
    #[must_use]
    pub fn loopback(&self) -> Option<usize> {
        self.hosts.iter().position(|host| host.setup.loopback)
    }

    /// Returns the names of the nodes: the hosts, then the gateway if there is one, then the loopback if there is one.
    #[must_use]
    pub fn nodes(&self) -> Vec<&str> {
        let gateway = self.gateway.iter().map(|gateway| gateway.name.as_str());
        self.hosts.iter().map(|host| host.name.as_str()).chain(gateway).chain(self.loopback().map(|_| LOOPBACK)).collect()
    }

    /// Returns whether packets can pass a link from one node to another, by their indices. A node has no link to itself, and a loopback has links from and to
    /// its host alone.
    #[must_use]
    pub fn has_link(&self, from: usize, to: usize) -> bool {
        let nodes = self.nodes().len();
        let is_apart = |one, other| self.loopback().is_some_and(|host| one + 1 == nodes && other != host);
        from != to && from < nodes && to < nodes && !is_apart(from, to) && !is_apart(to, from)
    }
}

/// Result of a run.
#[derive(Debug)]
pub struct Outcome {
    /// Exit status: that of the main command, or else of the first failed command, or else 0.
    pub status: u8,
    /// Exit status of each command, or `None` for a command ended by force.
    pub statuses: Vec<Option<u8>>,
    /// Number of the first signal of SIGHUP, SIGINT, SIGQUIT and SIGTERM that this program had during the run, or `None` for none.
    pub signal: Option<u8>,
    /// Counters of the links.
    pub report: Report,
}

/// Counters of a link at the end of a run.
#[derive(Debug)]
pub struct LinkReport {
    /// Index of the sender among [`Report::nodes`].
    pub from: usize,
    /// Index of the receiver among [`Report::nodes`].
    pub to: usize,
    /// Counters.
    pub stats: LinkStats,
    /// Numbers of the first dropped packets, as by [`Exchange::dropped`](crate::Exchange::dropped).
    pub dropped: Vec<u64>,
}

/// Counters of the network at the end of a run.
#[derive(Debug)]
pub struct Report {
    /// Length of the run.
    pub elapsed: Duration,
    /// Counters of each link, by sender and receiver.
    pub links: Vec<LinkReport>,
    /// Names of the nodes, as by [`Plan::nodes`].
    pub nodes: Vec<String>,
    /// Packets not taken by any link.
    pub untaken: Counts,
    /// Packets refused by the device of each host, or by the gateway, indexed by node. A loopback refuses nothing, and has no number.
    pub refused: Vec<u64>,
    /// Lateness of the packets.
    pub release: LatenessSummary,
    /// Verdict about the lateness.
    pub validity: Validity,
    /// Answers of the system to the requests of the thread.
    pub prepared: Prepared,
    /// First error of a capture.
    pub capture_error: Option<String>,
}

/// Runs a plan. `hear` gets each line of a piped command.
///
/// # Errors
///
/// [`Failed`] with an exit status, if the hosts cannot be made or a command cannot be started. All commands have ended by then.
pub fn run(plan: &Plan, hear: &(dyn Fn(Line<'_>) + Sync)) -> Result<Outcome, Failed> {
    // Before the first thread, so that all threads inherit the mask and the signals wait for `Watch`.
    let signals = signals::passed_on();
    let signals =
        signals.thread_block().and_then(|()| SignalFd::new(&signals)).map_err(|error| Failed::own(format!("cannot watch signals: {error}")))?;
    // Processes of all hosts are started before the first device is awaited, so that the namespaces are made in parallel.
    let mut hosts = Vec::new();
    for host in &plan.hosts {
        hosts.push(Host::begin(&host.setup, &host.command, host.output).map_err(|failed| named(plan, host, failed))?);
    }
    let mut ports = Vec::new();
    for (host, of) in hosts.iter().zip(&plan.hosts) {
        ports.push(Port::Device(host.device().map_err(|failed| named(plan, of, failed))?));
    }
    if let Some(gateway) = &plan.gateway {
        ports.push(Port::Gateway(Box::new(open(gateway)?)));
    }
    let nodes: Vec<Node> = plan.nodes().into_iter().enumerate().map(|(place, name)| node(plan, place, name)).collect();
    let gateway = plan.gateway.as_ref().map(|_| plan.hosts.len());
    let exchange = Exchange::new(plan.seed, &nodes, gateway, |from, to| plan.links.between(from, to).clone());
    let exchange = match plan.loopback() {
        Some(host) => exchange.with_loopback(host, nodes.len() - 1),
        None => exchange,
    };
    let captures = nodes.iter().enumerate().map(|(place, node)| capture(plan, place, node)).collect::<Result<_, _>>()?;
    let (mut emulation, stop) =
        Emulation::new(exchange, ports, captures).map_err(|error| Failed::own(format!("cannot make the network: {error}")))?;
    let outputs = Outputs::new(&mut hosts, plan).map_err(|error| Failed::own(format!("cannot read the output of the commands: {error}")))?;
    let (driven, ended) = thread::scope(|scope| {
        let driver = thread::Builder::new().name("network".to_owned()).spawn_scoped(scope, || {
            let prepared = prepare_thread(&plan.wishes);
            let ran = emulation.run(plan.pacing);
            // Without the network the commands would wait for ever.
            outputs.network_has_ended();
            (prepared, ran)
        });
        let driver = driver.map_err(|error| Failed::own(format!("the system gives the network no thread: {error}")))?;
        let readers = outputs.read(scope, hear);
        let ended = readers.and_then(|()| Watch::new(plan, &hosts, &signals, &outputs).until_all_have_ended(&stop));
        // After a failure no data has to arrive.
        if ended.is_err() {
            stop.now();
        }
        // Commands that did not end in time end here, and with them the pipes of their output. The devices stay, so that the network still passes on what the
        // commands have sent.
        hosts.clear();
        let driven = driver.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        Ok((driven, ended?))
    })?;
    let (prepared, ran) = driven;
    ran.map_err(|error| Failed::own(format!("the network has failed: {error}")))?;
    let Ended { status, statuses, signal } = ended;
    Ok(Outcome { status, statuses, signal, report: report(plan, &mut emulation, prepared) })
}

/// Returns a failure with the name of its host, if there are several.
fn named(plan: &Plan, host: &HostPlan, failed: Failed) -> Failed {
    if plan.hosts.len() < 2 { failed } else { Failed { why: format!("host {}: {}", host.name, failed.why), ..failed } }
}

/// Returns a node of the network. Gateway and loopback have no addresses of their own.
fn node(plan: &Plan, place: usize, name: &str) -> Node {
    let networks = plan.hosts.get(place).map_or(&[][..], |host| &host.setup.addresses);
    Node { name: name.to_owned(), addresses: networks.iter().map(|network| network.address()).collect() }
}

fn open(plan: &GatewayPlan) -> Result<Gateway, Failed> {
    let mut gateway = Gateway::new(plan.name_server).map_err(|error| Failed::own(format!("cannot make the gateway: {error}")))?;
    for address in &plan.listen {
        gateway.listen(*address).map_err(|error| Failed::own(format!("cannot listen at {address}: {error}")))?;
    }
    Ok(gateway)
}

/// Begins the capture of a host. The gateway has no capture, because the captures of the hosts have all packets.
fn capture(plan: &Plan, place: usize, node: &Node) -> Result<Option<Capture>, Failed> {
    let Some(folder) = plan.captures.as_deref().filter(|_| place < plan.hosts.len()) else { return Ok(None) };
    let path = capture_path(folder, &node.name);
    let begun = std::fs::File::create(&path).and_then(|file| CaptureWriter::new(BufWriter::new(file), &node.name));
    begun.map(Some).map_err(|error| Failed::own(format!("cannot write {}: {error}", path.display())))
}

/// Returns the path of the capture of a host.
#[must_use]
pub fn capture_path(folder: &Path, host: &str) -> PathBuf {
    folder.join(format!("{host}.pcapng"))
}

fn report(plan: &Plan, emulation: &mut Emulation, prepared: Prepared) -> Report {
    let capture_error = emulation.finish_captures().map(|error| error.to_string());
    let exchange = emulation.exchange();
    let nodes = exchange.names().to_vec();
    let pairs = (0..nodes.len()).flat_map(|from| (0..nodes.len()).map(move |to| (from, to))).filter(|(from, to)| plan.has_link(*from, *to));
    let link = |(from, to)| {
        let (sender, receiver) = (NodeId::new(from), NodeId::new(to));
        Some(LinkReport { from, to, stats: exchange.link_stats(sender, receiver)?, dropped: exchange.dropped(sender, receiver).to_vec() })
    };
    Report {
        elapsed: emulation.elapsed().saturating_duration_since(Instant::ZERO),
        links: pairs.filter_map(link).collect(),
        nodes,
        untaken: exchange.counts(),
        refused: emulation.refused().collect(),
        release: emulation.release().summary(),
        validity: plan.tolerance.judge(emulation.release(), "packets"),
        prepared,
        capture_error,
    }
}

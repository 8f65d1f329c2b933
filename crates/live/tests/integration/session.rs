//! Sessions on a loopback socket. The session's thread is held up on purpose; no result depends on further delays by a busy machine.

use std::collections::BTreeSet;
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::time::{Duration, Instant as Wall};

use cohaptic_live::{Conductor, LinkChange, Session, SessionConfig, Status};
use cohaptic_peer::State;
use cohaptic_peer::wire::{MAX_LEN, Sample};
use cohaptic_realtime::{Tolerance, Validity, Wishes};
use cohaptic_scene::{Scene, link_keys};
use cohaptic_units::Instant;

use crate::support::SESSION;

/// Returns a scene of two simulated peers, which tick together, and a peer in another program at place 1.
fn scene() -> String {
    format!(
        "scene = {{ duration = \"1h\", seed = {SESSION} }}\nobject = {{ mass = 0.45 }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = 300.0, damping = 5.0, update = \"8ms\" }}\n\
         peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = 800.0, damping = 5.0 }} }}\n\
         [[peers]]\nname = \"here\"\n[[peers]]\nname = \"there\"\nkind = \"udp\"\n[[peers]]\nname = \"beside\"\n"
    )
}

/// Opens a session without a key that records into the folder `out` in `folder`. Returns the session and the address of its socket.
fn open(folder: &Path, tolerance: Tolerance) -> (Session, SocketAddr) {
    let path = folder.join("scene.toml");
    std::fs::write(&path, scene()).unwrap();
    let scene = Scene::read_live(&path, &[]).unwrap();
    let out = Some(folder.join("out"));
    let config = SessionConfig { wishes: Wishes::NONE, tolerance, out, ..SessionConfig::new("127.0.0.1:0".parse().unwrap()) };
    let session = Session::open(&scene, config, |_| None).unwrap();
    let address = session.address().unwrap();
    (session, address)
}

/// Returns the lines of a file of the record, without the header, split into fields.
fn read(folder: &Path, name: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(folder.join("out").join(name)).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// Returns the histogram of ticks or of releases in `lateness.csv`: latenesses, each with its count.
fn late(folder: &Path, of: &'static str) -> impl Iterator<Item = (Duration, u64)> {
    let lines = read(folder, "lateness.csv").into_iter().filter(move |line| line[0] == of);
    // The file has microseconds with three decimals: without the point, the digits are nanoseconds.
    lines.map(|line| (Duration::from_nanos(line[1].replace('.', "").parse().unwrap()), line[2].parse().unwrap()))
}

/// Sends the sample number `number` of the program at place 1.
fn send(socket: &UdpSocket, door: SocketAddr, number: u64) {
    let sample = Sample { session: SESSION, sender: 1, sequence: number, sent: Instant::ZERO, state: State::<1>::REST };
    let mut bytes = [0; MAX_LEN];
    let len = sample.encode(1, &mut bytes);
    socket.send_to(&bytes[..len], door).unwrap();
}

/// Tolerance at the border of two steps of the histogram, so that the rounded latenesses of the file and the exact latenesses are on the same side.
const TOLERANCE: Tolerance = Tolerance { limit: Duration::from_nanos((1 << 25) - 1) };

/// Time for which the session's thread is held up between the two samples of a pair.
const HELD_UP: Duration = Duration::from_millis(100);
/// Allowance for adjustments of the time of day, to which the kernel's time stamps refer.
const ADJUSTED: Duration = Duration::from_millis(1);
/// Time within which a pair must have been read: the session does not believe a time stamp that is a second old.
const IN_TIME: Duration = Duration::from_millis(900);

/// Conductor that sends pairs of samples and holds the session up between the two samples, until a pair was read in time.
struct HoldsUp {
    socket: UdpSocket,
    door: SocketAddr,
    number: u64,
    /// Beginning of the latest pair.
    begun: Option<Wall>,
    /// `true` if the conductor has ended the session. The conductor must not be called afterwards.
    ended: bool,
}

impl HoldsUp {
    fn send(&mut self) {
        send(&self.socket, self.door, self.number);
        self.number += 1;
    }
}

impl Conductor for HoldsUp {
    fn keep_going(&mut self) -> bool {
        assert!(!self.ended, "a session that was ended goes on");
        self.ended = self.begun.is_some_and(|begun| begun.elapsed() < IN_TIME) || self.number > 200;
        if self.ended {
            return false;
        }
        self.begun = Some(Wall::now());
        self.send();
        std::thread::sleep(HELD_UP);
        self.send();
        true
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        None
    }

    fn show(&mut self, _: Status) {}
}

/// Both samples of a pair are read together, after the second sample was sent. Each sample counts from the instant at which the kernel received the datagram.
/// So the two instants differ by at least the time for which the thread was held up.
#[test]
fn a_sample_counts_from_when_the_kernel_had_it_and_not_from_when_it_was_read() {
    let folder = tempfile::tempdir().unwrap();
    let (session, door) = open(folder.path(), TOLERANCE);
    let mut conductor = HoldsUp { socket: UdpSocket::bind("127.0.0.1:0").unwrap(), door, number: 0, begun: None, ended: false };
    let report = session.run(&mut conductor).unwrap();
    assert!(conductor.begun.unwrap().elapsed() >= HELD_UP && conductor.number <= 200, "no pair was read in time");
    let taken = report.seats[1].unwrap().taken;
    assert_eq!(taken, conductor.number, "{:?}", report.admission);
    let inputs = read(folder.path(), "inputs.csv");
    let mut samples = inputs.iter().filter(|line| line[1] == "sample").map(|line| line[0].parse::<u64>().unwrap());
    let [last, first] = [(); 2].map(|()| samples.next_back().unwrap());
    let apart = Duration::from_nanos(last - first);
    assert!(apart >= HELD_UP - ADJUSTED, "{apart:?} apart");

    // Ticks that were due while the thread was held up were late, one tick per millisecond. The last of these ticks were within the tolerance.
    let counts = |of| late(folder.path(), of).map(|(_, count)| count).sum::<u64>();
    let late = |of| late(folder.path(), of).filter(|(late, _)| *late > TOLERANCE.limit).map(|(_, count)| count).sum::<u64>();
    assert_eq!((report.late_ticks, report.ticks.count, report.releases.count), (late("tick"), counts("tick"), counts("release")));
    let pairs = conductor.number / 2;
    let most = u64::try_from((HELD_UP - TOLERANCE.limit).as_millis()).unwrap();
    assert!(late("tick") >= pairs * (most - 1), "{} ticks were late", late("tick"));
    // Late releases count as well.
    let (late, of) = (late("tick") + late("release"), counts("tick") + counts("release"));
    assert_eq!(report.validity, Validity::NotValid { late, of, what: "ticks and datagrams", limit: TOLERANCE.limit });
    // Peers that tick at the same instant are one tick of the loop.
    let instants: BTreeSet<_> = read(folder.path(), "trajectory.csv").into_iter().map(|line| line[0].clone()).collect();
    assert_eq!(report.ticks.count, instants.len() as u64);
}

/// Conductor that acts as a program, until the session has sent some samples to the program. Then the conductor changes the link to the program, and then ends
/// the session.
struct TakesPart {
    socket: UdpSocket,
    door: SocketAddr,
    number: u64,
    begun: Wall,
    /// Number of samples sent to the program, from the latest status.
    released: u64,
    change: Option<LinkChange>,
    /// `true` if the conductor has ended the session. The conductor must not be called afterwards.
    ended: bool,
}

impl Conductor for TakesPart {
    fn keep_going(&mut self) -> bool {
        send(&self.socket, self.door, self.number);
        self.number += 1;
        assert!(!self.ended, "a session that was ended goes on");
        self.ended = self.change.is_none() || self.begun.elapsed() >= PATIENCE;
        !self.ended
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        self.change.take_if(|_| self.released >= ENOUGH)
    }

    fn show(&mut self, status: Status) {
        self.released = status.releases.count;
        for link in status.links {
            let ends = (link.from, link.to);
            assert_eq!((ends, link.recent.len() as u64), (ends, link.stats.delivered().min(125)));
            assert_eq!((ends, link.delivered_bytes > 0), (ends, link.stats.delivered() > 0));
        }
    }
}

/// Number of samples to the program before the link is changed.
const ENOUGH: u64 = 3;
/// Time limit of the test, long enough for any machine. Only a failing test takes this long.
const PATIENCE: Duration = Duration::from_secs(60);

/// Every sample that the network delivers to a present program is sent and recorded, with the instant of its delivery, which is its deadline, and with its
/// lateness. The changed link is the link that the conductor named.
#[test]
fn what_is_sent_to_a_program_is_recorded_and_the_link_that_was_meant_is_changed() {
    let folder = tempfile::tempdir().unwrap();
    let (session, door) = open(folder.path(), TOLERANCE);
    let keys = link_keys(&folder.path().join("scene.toml"), &[]).unwrap()[&(0, 1)].with("loss", "\"100%\"");
    let model = keys.model(folder.path()).unwrap();
    let change = Some(LinkChange { from: 0, to: 1, keys, model });
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut conductor = TakesPart { socket, door, number: 0, begun: Wall::now(), released: 0, change, ended: false };
    let report = session.run(&mut conductor).unwrap();
    assert!(conductor.change.is_none(), "{} were sent within {PATIENCE:?}", conductor.released);

    let changes: Vec<_> = read(folder.path(), "inputs.csv").into_iter().filter(|line| line[1] == "link").collect();
    assert_eq!(changes.iter().map(|line| (line[2].as_str(), line[3].as_str())).collect::<Vec<_>>(), [("here", "there")]);

    let released = report.releases.count;
    let (_, socket) = report.admission.unwrap();
    assert!(released >= ENOUGH);
    assert_eq!(socket.counts.sent + socket.counts.failures.in_all(), released);
    let releases = read(folder.path(), "releases.csv");
    assert_eq!((releases.len() as u64, late(folder.path(), "release").map(|(_, count)| count).sum::<u64>()), (released, released));
    let delivered = read(folder.path(), "packets.csv").into_iter().filter(|line| line[0].ends_with("->there") && line[4] == "delivered");
    let mut delivered = delivered.map(|line| line[3].clone());
    for release in releases {
        assert_eq!(release[0], "there");
        assert!(delivered.any(|at| at == release[1]), "nothing was delivered at {}", release[1]);
    }
}

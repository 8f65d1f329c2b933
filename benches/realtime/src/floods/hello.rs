//! Floods on the port of a session with a key: honest peers that come in meanwhile, and a peer that is in and stays.

use std::error::Error;
use std::fmt::Write as _;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use cohaptic_live::client::{Client, ClientConfig, Heard};
use cohaptic_live::{Conductor, LinkChange, MAX_DATAGRAM, Place, Session, SessionConfig, SessionKey, Status, SystemEntropy};
use cohaptic_peer::State;
use cohaptic_peer::wire::{MAX_LEN, Sample};
use cohaptic_realtime::{Clock as _, MonotonicClock, Wishes};
use cohaptic_units::Instant;

use crate::datagrams::{Aim, Flood, Flooding};
use crate::machine;
use crate::scene::with_programs;
use crate::visitor::{Invitation, UPDATE, Visitor};

/// The rates of the table \[datagrams/s\].
const RATES: [u32; 2] = [9_700, 50_000];

/// The peers of the session: two that are simulated, one that is in from the beginning, and the place that honest peers take one after another.
const SIMULATED: usize = 2;
const PRESENT: u32 = 2;
const ASKED_FOR: u32 = 3;

/// Longer than a session waits for a silent peer until its place is free.
const BETWEEN: Duration = Duration::from_millis(150);

/// An honest peer gives up after this.
const PATIENCE: Duration = Duration::from_secs(5);

/// Figures of one flood.
#[derive(Clone, Debug)]
pub struct Row {
    /// The flood; `None`: none.
    pub flood: Option<Flood>,
    /// Datagrams a second that were sent.
    pub offered: f64,
    /// Honest peers that came in.
    pub came_in: u32,
    /// The longest time from the first hello of an honest peer that came in to the first sample of another peer that it heard.
    pub longest: Duration,
    /// Samples of the peer that was in before that the session took.
    pub taken: u64,
    /// Datagrams that this peer sent.
    pub sent: u64,
    /// Ticks later than a millisecond, of a thousand.
    pub late: f64,
    /// Processor time of the session's thread, of a second.
    pub processor: f64,
    /// Datagrams that the kernel dropped because the session did not read in time; `None`: not told.
    pub kernel_drops: Option<u64>,
}

/// Runs a session under a flood, in which `honest` peers ask for a seat one after another.
///
/// # Errors
///
/// If something cannot be had, or ends by itself.
pub fn run(flood: Option<Flood>, rate: u32, honest: u32) -> Result<Row, Box<dyn Error>> {
    let scene = with_programs("A flood", 41, SIMULATED, &["present", "asked-for"], Duration::from_secs(3600))?;
    let key = SessionKey::generate(&mut SystemEntropy)?;
    let wishes = Wishes { lock_memory: false, ..Wishes::default() };
    let config = SessionConfig { key: Some(key.clone()), wishes, ..SessionConfig::new(SocketAddr::from(([127, 0, 0, 1], 0))) };
    let session = Session::open(&scene, config, |_| None)?;
    let door = session.address().ok_or("the session does not listen")?;
    let stop = Arc::new(AtomicBool::new(false));
    let mut host = UntilStopped(Arc::clone(&stop));
    let thread = std::thread::spawn(move || {
        let before = machine::thread_time();
        session.run(&mut host).map(|report| (report, machine::thread_time() - before))
    });
    let forever = Duration::from_secs(3600);
    let visitor = Visitor::start(Invitation { door, session: scene.seed, place: PRESENT, key: key.clone(), stay: forever, away: forever });
    let aim = Aim { session: scene.seed, place: ASKED_FOR, key };
    let flooding = flood.map(|flood| Flooding::start(flood, &aim, rate, vec![door])).transpose()?;
    let (mut came_in, mut longest) = (0, Duration::ZERO);
    for _ in 0..honest {
        std::thread::sleep(BETWEEN);
        if let Some(span) = come_in(door, &aim)? {
            came_in += 1;
            longest = longest.max(span);
        }
    }
    let offered = flooding.map(Flooding::end).transpose()?.map_or(0.0, |sent| sent.per_second());
    visitor.hush();
    // The session reads the last datagrams at its next tick.
    std::thread::sleep(Duration::from_millis(50));
    stop.store(true, Ordering::Release);
    let (report, processor) = thread.join().map_err(|_| "the session panicked")??;
    let sent = visitor.end()?.sent;
    let taken = report.seats[PRESENT as usize].map_or(0, |seat| seat.taken);
    let ticks = f64::from(u32::try_from(report.ticks.count.max(1))?);
    let late = f64::from(u32::try_from(report.late_ticks)?) * 1000.0 / ticks;
    let kernel_drops = report.admission.and_then(|(_, socket)| socket.kernel_drops);
    let processor = processor.as_secs_f64() / report.summary.duration.as_secs_f64();
    Ok(Row { flood, offered, came_in, longest, taken, sent, late, processor, kernel_drops })
}

/// Goes on until somebody wants the end.
struct UntilStopped(Arc<AtomicBool>);

impl Conductor for UntilStopped {
    fn keep_going(&mut self) -> bool {
        !self.0.load(Ordering::Acquire)
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        None
    }

    fn show(&mut self, _status: Status) {}

    fn wants_status(&self) -> bool {
        false
    }
}

/// Joins as a program that has just begun, and gives the time until it hears another peer; `None` if it gave up.
fn come_in(door: SocketAddr, aim: &Aim) -> Result<Option<Duration>, Box<dyn Error>> {
    let socket = UdpSocket::bind("127.0.0.1:0")?;
    socket.set_read_timeout(Some(Duration::from_millis(1)))?;
    let clock = MonotonicClock::start();
    let config = ClientConfig::Keyed { session: aim.session, place: Place(aim.place), key: aim.key.clone() };
    let mut client = Client::new(config, clock.now());
    let (mut sequence, mut next, mut buffer) = (0, clock.now(), [0; 2048]);
    loop {
        let now = clock.now();
        if now.saturating_duration_since(Instant::ZERO) > PATIENCE {
            return Ok(None);
        }
        if let Some(hello) = client.poll_hello(now, &mut SystemEntropy)? {
            socket.send_to(&hello, door)?;
        }
        if now >= next {
            next = now + UPDATE;
            let sample = Sample { session: aim.session, sender: aim.place, sequence, sent: now, state: State::<1>::REST };
            let (mut plain, mut sealed) = ([0; MAX_LEN], [0; MAX_DATAGRAM]);
            let len = sample.encode(1, &mut plain);
            if let Some(len) = client.seal(&plain[..len], &mut sealed) {
                socket.send_to(&sealed[..len], door)?;
                sequence += 1;
            }
        }
        if let Ok((len, _)) = socket.recv_from(&mut buffer)
            && let Heard::Newest(_) = client.handle_datagram(clock.now(), &buffer[..len])
        {
            return Ok(Some(clock.now().saturating_duration_since(Instant::ZERO)));
        }
    }
}

/// Measures all floods with `honest` honest peers each, and writes the section of the page.
///
/// # Errors
///
/// As [`run`], and none else.
pub fn section(honest: u32) -> Result<String, Box<dyn Error>> {
    let mut text = String::from("## Hellos and noise at a session with a key\n\n");
    writeln!(
        text,
        "A session with two simulated peers, one that is in from the beginning, and a free seat. The flood goes to the port of the session. Its hellos ask for the\n\
         free seat, for which {honest} honest peers ask one after another, each for at most {} s. *Longest* is the longest time from the first hello of a peer to the\n\
         first sample of another peer that it hears. *In before* are samples of the peer that is in, which the session took, of\n\
         its datagrams, hellos included. *Processor* is the share of one core that the session's thread used.\n",
        PATIENCE.as_secs()
    )?;
    text.push_str("| flood | datagrams/s | came in | longest \\[ms\\] | in before | dropped by the kernel | beyond 1 ms \\[‰\\] | processor |\n");
    text.push_str("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n");
    let floods = RATES.into_iter().flat_map(|rate| Flood::ALL.map(|flood| (Some(flood), rate)));
    for (flood, rate) in [(None, 0)].into_iter().chain(floods) {
        let Row { offered, came_in, longest, taken, sent, late, processor, kernel_drops, .. } = run(flood, rate, honest)?;
        let name = flood.map_or("none", Flood::name);
        let drops = kernel_drops.map_or_else(|| "not told".to_owned(), |drops| drops.to_string());
        writeln!(
            text,
            "| {name} | {offered:.0} | {came_in} of {honest} | {:.0} | {taken} of {sent} | {drops} | {late:.1} | {:.0} % |",
            longest.as_secs_f64() * 1e3,
            processor * 100.0
        )?;
    }
    Ok(text)
}

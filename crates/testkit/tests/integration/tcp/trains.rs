//! Segments of a flight travel together where no packet is watched. A run whose packets are recorded has no such trains, and every program sees the same.

use std::cell::RefCell;
use std::fmt::Debug;
use std::io::ErrorKind;
use std::rc::Rc;
use std::time::Duration;

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::{ImpairedNetwork, LinkBounds, Stage, any_network, networks_like};
use cohaptic_testkit::tcp::TcpConfig;
use cohaptic_testkit::{Bed, TcpListener, TcpStream, Testbed, time};
use cohaptic_tests_common::cases;

use crate::tcp::{millis, octets};

const HOSTS: [&str; 3] = ["a", "b", "c"];

/// A program of streams, and an event in its midst.
#[derive(Clone, Debug)]
struct Plan {
    network: ImpairedNetwork,
    /// Octets of each write, at both ends of each stream.
    writes: Vec<usize>,
    /// Pause of a writer after each write \[ms\].
    rest: u64,
    /// Octets of each read at most, and the pause of a reader before each read \[µs\].
    reads: (usize, u64),
    nodelay: bool,
    config: TcpConfig,
    event: Event,
    /// Instant of the event \[ms\].
    at: u64,
}

#[derive(Clone, Copy, Debug)]
enum Event {
    Nothing,
    Cut,
    Partition,
    Hold,
    Relink(&'static str),
    Crash,
    Kill,
    Readdress,
}

fn config() -> impl Strategy<Value = TcpConfig> {
    prop_oneof![
        3 => Just(TcpConfig::default()),
        1 => Just(TcpConfig::textbook()),
        1 => (3000usize..40_000).prop_map(|room| TcpConfig { receive_buffer: Some(room), ..TcpConfig::default() }),
        1 => (300usize..1500).prop_map(|mtu| TcpConfig { mtu, ..TcpConfig::default() }),
    ]
}

fn event() -> impl Strategy<Value = Event> {
    use Event::{Crash, Cut, Hold, Kill, Nothing, Partition, Readdress, Relink};

    let relinked = ["delay 3ms", "delay 3ms loss 10%", "delay 2ms rate 5mbit limit 10", ""];
    proptest::sample::select(
        [Nothing, Nothing, Cut, Partition, Hold, Crash, Kill, Readdress].into_iter().chain(relinked.map(Relink)).collect::<Vec<_>>(),
    )
}

fn plan() -> impl Strategy<Value = Plan> {
    let constant = networks_like(3, LinkBounds::ideal().delay(Duration::from_millis(1)..=Duration::from_millis(30)).always(Stage::Delay));
    let network = prop_oneof![3 => constant, 1 => any_network(3)];
    let writes = proptest::collection::vec(prop_oneof![1usize..3000, 3000usize..120_000], 1..6);
    let reads = prop_oneof![4 => (1usize..70_000, Just(0)), 1 => (1usize..70_000, 0u64..20_000), 1 => Just((1000, 60_000))];
    (network, writes, prop_oneof![Just(0), 0u64..40], reads, any::<bool>(), config(), event(), 20u64..150)
        .prop_map(|(network, writes, rest, reads, nodelay, config, event, at)| Plan { network, writes, rest, reads, nodelay, config, event, at })
}

/// Observations of programs, in the order of time.
#[derive(Clone, Default)]
struct Log(Rc<RefCell<Vec<String>>>);

impl Log {
    fn note(&self, who: &str, what: impl Debug) {
        self.0.borrow_mut().push(format!("{:?} {who}: {what:?}", time::now()));
    }
}

async fn write(log: Log, who: String, stream: Rc<TcpStream>, plan: Plan) {
    for count in plan.writes {
        let all = octets(count);
        let mut written = 0;
        while written < count {
            if let Err(error) = stream.writable().await {
                return log.note(&who, error.kind());
            }
            match stream.try_write(&all[written..]) {
                Ok(count) => written += count,
                Err(error) if error.kind() == ErrorKind::WouldBlock => continue,
                Err(error) => return log.note(&who, error.kind()),
            }
            log.note(&who, (written, stream.info()));
        }
        time::sleep(Duration::from_millis(plan.rest)).await;
    }
}

async fn read(log: Log, who: String, stream: Rc<TcpStream>, (most, pause): (usize, u64)) {
    let mut buffer = vec![0; most];
    loop {
        if pause > 0 {
            time::sleep(Duration::from_micros(pause)).await;
        }
        let ready = stream.readable().await;
        match ready.and_then(|()| stream.try_read(&mut buffer)) {
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Ok(0) => return log.note(&who, "end"),
            Ok(count) => log.note(&who, (count, buffer[..count].iter().map(|octet| u64::from(*octet)).sum::<u64>(), stream.info())),
            Err(error) => return log.note(&who, error.kind()),
        }
    }
}

/// Lets a stream be read and written by tasks of its own.
fn serve(bed: &Bed, log: &Log, host: &str, name: &str, stream: TcpStream, plan: &Plan) -> Rc<TcpStream> {
    let stream = Rc::new(stream);
    let who = format!("{host} {name}");
    bed.host(host).spawn(write(log.clone(), format!("{who} writes"), Rc::clone(&stream), plan.clone()));
    bed.host(host).spawn(read(log.clone(), format!("{who} reads"), Rc::clone(&stream), plan.reads));
    stream
}

fn happen(bed: &Bed, event: Event, is_over: bool) {
    match (event, is_over) {
        (Event::Nothing, _) | (Event::Relink(_) | Event::Readdress, true) => {}
        (Event::Cut, false) => bed.cut("a", "b"),
        (Event::Cut, true) => bed.mend("a", "b"),
        (Event::Partition, false) => bed.partition(&["a"], &["b", "c"]),
        (Event::Partition, true) => bed.mend_all(),
        (Event::Hold, false) => bed.hold("a", "b"),
        (Event::Hold, true) => bed.release("a", "b"),
        (Event::Relink(words), false) => bed.set_link("a", "b", words),
        (Event::Crash, false) => bed.host("b").crash(),
        (Event::Kill, false) => bed.host("a").kill(),
        (Event::Readdress, false) => drop(bed.host("a").change_addresses()),
        (Event::Crash, true) => bed.host("b").restart(),
        (Event::Kill, true) => bed.host("a").restart(),
    }
}

/// Runs the plan and returns the observations: of its programs, and every 7 ms of connections and links.
async fn program(bed: Bed, plan: Plan) -> Vec<String> {
    let log = Log::default();
    let (accepted, log_of, plan_of, bed_of) = (Rc::new(RefCell::new(Vec::new())), log.clone(), plan.clone(), bed.clone());
    let keeps = Rc::clone(&accepted);
    bed.host("b").spawn(async move {
        let listener = TcpListener::bind("0.0.0.0:80").await.unwrap();
        while let Ok((stream, from)) = listener.accept().await {
            stream.set_nodelay(plan_of.nodelay).unwrap();
            let stream = serve(&bed_of, &log_of, "b", &from.to_string(), stream, &plan_of);
            keeps.borrow_mut().push(stream);
        }
    });
    for (host, name) in [("a", "first"), ("a", "second"), ("c", "third")] {
        let (log, plan, bed, keeps) = (log.clone(), plan.clone(), bed.clone(), Rc::clone(&accepted));
        bed.host(host).spawn(async move {
            match time::timeout(Duration::from_secs(2), TcpStream::connect("b:80")).await {
                Ok(Ok(stream)) => {
                    let stream = serve(&bed, &log, host, name, stream, &plan);
                    keeps.borrow_mut().push(stream);
                }
                other => log.note(name, other.map(|connected| connected.map(drop).map_err(|error| error.kind())).is_err()),
            }
        });
    }
    let mut left = vec![(plan.at, false), (plan.at + 90, true)];
    for at in (0..400).step_by(7) {
        while left.first().is_some_and(|(when, _)| *when <= at) {
            let (when, is_over) = left.remove(0);
            time::sleep_until(millis(when)).await;
            happen(&bed, plan.event, is_over);
        }
        time::sleep_until(millis(at)).await;
        for stream in accepted.borrow().iter() {
            log.note("info", stream.info());
        }
        for [from, to] in HOSTS.into_iter().flat_map(|from| HOSTS.map(|to| [from, to])).filter(|[from, to]| from != to) {
            log.note("link", bed.link_stats(from, to));
        }
    }
    log.0.take()
}

proptest! {
    #![proptest_config(cases(100))]

    /// Programs see the same at the same instants, in the same order, whether packets are recorded or not.
    #[test]
    fn trains_are_not_seen(plan in plan(), seed in 0u64..1000, on_tokio in any::<bool>()) {
        let bed = Testbed::new(HOSTS).network(&plan.network).seed(seed).tcp(plan.config.clone());
        let bed = if on_tokio { bed.on_tokio() } else { bed };
        let [one, other] = [plan.clone(), plan];
        let together = bed.clone().run(move |bed| program(bed, one));
        let (alone, _) = bed.run_recorded(move |bed| program(bed, other));
        for (together, alone) in together.iter().zip(&alone) {
            prop_assert_eq!(together, alone);
        }
        prop_assert_eq!(together.len(), alone.len());
    }
}

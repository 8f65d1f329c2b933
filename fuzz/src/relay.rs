//! The relay's engine between three programs, or between clients and a server: every datagram that comes is refused, lost or delivered, where it should.

use std::net::SocketAddr;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use cohaptic_linkfile::{LinkTable, link_from_keys};
use cohaptic_realtime::udp::Ecn;
use cohaptic_relay::{Arrival, Change, Engine, Form, Intake, Limits, Mesh, Port, Program, Proxy, RelayConfig};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{LinkModel, NodeId};

use crate::Input;

/// Links of every kind: direct ones, stages, copies, damage, marks, a queue, and the kernel's netem. Packets of the first five are not damaged.
const LINKS: [&[&str]; 8] = [
    &[],
    &["delay=24ms"],
    &["delay=2ms", "jitter=1ms", "loss=20%"],
    &["rate=2Mbit", "queue={ limit = \"3 packets\" }", "delay=1ms", "duplicate=10%"],
    &["loss=50%", "mark-instead-of-loss=true", "delay=1ms", "duplicate=50%"],
    &["delay=2ms", "jitter=1ms", "duplicate=30%", "corrupt={ probability = 0.5, bits = 3, checksum = \"passes\" }"],
    &["netem=delay 2ms 1ms loss 10% duplicate 20% reorder 25% corrupt 5%", "netem-profile=kernel-6.6"],
    &["delay=1ms", "reorder=30%"],
];
const UNDAMAGED: usize = 5;
/// More than any input can make happen.
const MOST_STEPS: usize = 100_000;

/// The links, read once.
fn link(place: usize) -> LinkModel {
    static MODELS: OnceLock<Vec<LinkModel>> = OnceLock::new();
    let read =
        |keys: &&[&str]| link_from_keys(&keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>()).unwrap_or_else(|error| panic!("{error}"));
    MODELS.get_or_init(|| LINKS.iter().map(read).collect())[place].clone()
}

fn address(port: u16) -> SocketAddr {
    ([127, 0, 0, 1], port).into()
}

fn config(input: &mut Input<'_>) -> (RelayConfig, bool) {
    let setup = input.byte();
    let [usual, own, later] = [0; 3].map(|_| input.below(LINKS.len()));
    let (usual_link, own_link) = (link(usual), link(own));
    let form = if setup & 1 == 0 {
        // Addresses that are given, or learnt.
        let program = |n: u16| Program { name: n.to_string(), port: address(7000 + n), address: (setup >> n & 2 == 0).then(|| address(9000 + n)) };
        Form::Mesh(Mesh { programs: (0..3).map(program).collect(), links: LinkTable::new(3, Arc::new(usual_link), [((0, 1), Arc::new(own_link))]) })
    } else {
        Form::Proxy(Proxy { listen: address(7000), to: address(9009), forth: usual_link, back: own_link, most_clients: 2 })
    };
    let limits = if setup & 16 == 0 {
        Limits { packets: 20, bytes: Bytes::new(2000), forget_after: Duration::from_millis(50) }
    } else {
        Limits { forget_after: Duration::from_secs(1), ..Limits::default() }
    };
    let change = Change { at: Instant::from_nanos(20_000_000), from: NodeId(0), to: NodeId(1), model: link(later) };
    let changes = if setup & 32 == 0 { Vec::new() } else { vec![change] };
    let is_undamaged = usual.max(own) < UNDAMAGED && (changes.is_empty() || later < UNDAMAGED);
    (RelayConfig { seed: 5, form, limits, changes }, is_undamaged)
}

/// Model that the datagrams in flight are compared with.
struct World {
    engine: Engine,
    is_undamaged: bool,
    now: Instant,
    left: u64,
    left_bytes: u64,
    /// Datagrams that came, by number.
    came: Vec<Vec<u8>>,
}

/// The first bytes choose the relay and its links, and the rest are what happens to it.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let (config, is_undamaged) = config(&mut input);
    let engine = Engine::new(config).unwrap();
    let mut world = World { engine, is_undamaged, now: Instant::ZERO, left: 0, left_bytes: 0, came: Vec::new() };
    let mut offered = 0_u64;
    while !input.is_empty() {
        let action = input.byte();
        match action & 3 {
            // Time may stand still, or go back by what the kernel's stamps differ.
            0 | 1 => offered += u64::from(world.datagram(action, &mut input)),
            2 => {
                world.now = world.now.saturating_add(Duration::from_micros(u64::from(input.word()) * 4));
                world.engine.handle_timeout(world.now);
            }
            _ => world.change(action, &mut input),
        }
        world.drain();
    }
    world.run_out();
    let counts = *world.engine.counts();
    assert_eq!(
        (counts.offered, world.came.len() as u64),
        (offered, offered + counts.overload + counts.strangers + counts.to_itself + counts.no_room)
    );
    let nodes = || (0..world.engine.names().len()).map(NodeId::new);
    let links = || nodes().flat_map(|from| nodes().map(move |to| (from, to))).filter_map(|(from, to)| world.engine.link_stats(from, to));
    assert_eq!(links().map(|(stats, _)| stats.offered()).sum::<u64>(), offered);
    assert_eq!(links().map(|(stats, _)| stats.in_flight()).sum::<u64>(), 0);
    let undeliverable: u64 = links().map(|(_, link)| link.undeliverable).sum();
    assert_eq!(links().map(|(stats, _)| stats.delivered()).sum::<u64>(), world.left + undeliverable);
    assert!(links().map(|(_, link)| link.delivered_bytes).sum::<u64>() >= world.left_bytes);
}

impl World {
    /// Returns whether the datagram was offered to a link.
    fn datagram(&mut self, action: u8, input: &mut Input<'_>) -> bool {
        let is_mesh = self.engine.names().len() == 3;
        let step = input.byte();
        let at = if step & 128 == 0 {
            self.now.saturating_add(Duration::from_micros(u64::from(step) * 32))
        } else {
            Instant::from_nanos(self.now.as_nanos().saturating_sub(u64::from(step & 127) * 32_000))
        };
        self.now = self.now.max(at);
        let (from, to) = (action >> 2 & 3, action >> 4 & 3);
        let (port, from) = if is_mesh {
            (Port::Program(NodeId(u16::from(to % 3))), address(9000 + u16::from(from)))
        } else if to & 1 == 0 {
            (Port::Listen, address(8000 + u16::from(from)))
        } else {
            (Port::Client(u32::from(from)), address(if to & 2 == 0 { 9009 } else { 9010 }))
        };
        let ecn = [None, Some(Ecn::Ect0), Some(Ecn::Ect1), Some(Ecn::Ce)][usize::from(action >> 6)];
        // The number stands in front, so that what leaves is known again.
        let mut bytes = u16::try_from(self.came.len()).unwrap_or(u16::MAX).to_le_bytes().to_vec();
        bytes.resize(2 + usize::from(input.byte()), 0x5a);
        let offered = self.engine.counts().offered;
        let intake = self.engine.handle_datagram(Arrival { at, port, from, bytes: &bytes, ecn });
        self.came.push(bytes);
        let is_offered = self.engine.counts().offered > offered;
        match intake {
            Intake::Offered => assert!(is_offered),
            // The first datagram of a new client may be too much.
            Intake::FromNewClient(_) => {}
            Intake::Overload | Intake::Stranger | Intake::ToItself | Intake::NoRoom => assert!(!is_offered),
        }
        is_offered
    }

    fn change(&mut self, action: u8, input: &mut Input<'_>) {
        if action & 4 == 0 {
            self.engine.close_client(u32::from(input.byte() & 3));
            while self.engine.poll_closed().is_some() {}
        } else if let Some(due) = self.engine.poll_timeout() {
            self.now = self.now.max(due);
            self.engine.handle_timeout(due);
        }
    }

    fn drain(&mut self) {
        while let Some(release) = self.engine.poll_release() {
            assert!(release.at <= self.now);
            self.left += 1;
            self.left_bytes += release.bytes.len() as u64;
            if self.is_undamaged {
                let number = usize::from(u16::from_le_bytes([release.bytes[0], release.bytes[1]]));
                assert_eq!(self.came[number], release.bytes);
            }
        }
    }

    /// Lets everything happen that is on its way.
    fn run_out(&mut self) {
        for _ in 0..MOST_STEPS {
            let Some(due) = self.engine.poll_timeout() else {
                assert_eq!(self.engine.held(), (0, Bytes::new(0)));
                return;
            };
            self.now = self.now.max(due);
            self.engine.handle_timeout(due);
            self.drain();
        }
        panic!("the relay never rests");
    }
}

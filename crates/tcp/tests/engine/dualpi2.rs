//! DCTCP and CUBIC over one line with DualPI2 (RFC 9332): rates that are about equal, and waits of a millisecond beside waits of fifteen.

use std::time::Duration;

use cohaptic_tcp::{CongestionControl, Connection, Ecn, Segment, TcpConfig};
use cohaptic_units::{Bytes, Instant, Rate};
use cohaptic_wan::{Bottleneck, Delay, Discipline, DualPi2, Fate, Link, LinkConfig, LinkName, PacketInfo, QueueLimit};

/// Propagation in each direction.
const DELAY: Duration = Duration::from_millis(10);

type Packet = (usize, Box<Segment<'static>>);

/// Senders that always have data, and their receivers, over one link there and one link back.
struct Shared {
    now: Instant,
    senders: Vec<Connection>,
    receivers: Vec<Option<Connection>>,
    configs: Vec<TcpConfig>,
    there: Link<Packet>,
    back: Link<Packet>,
    rate: Rate,
    /// Octets that each receiver has read, and the sum and the number of the waits of each flow's packets before the line [s], both since `forget`.
    read: Vec<u64>,
    waits: Vec<(f64, u32)>,
}

/// Rate and wait of a flow over a span of time.
#[derive(Clone, Copy, Debug)]
struct Got {
    /// [bit/s]
    rate: f64,
    /// Mean wait before the line [ms].
    wait: f64,
}

impl Shared {
    fn new(rate: u64, congestion: &[CongestionControl]) -> Self {
        let rate = Rate::bits_per_sec(rate).unwrap();
        let bottleneck =
            Bottleneck { discipline: Discipline::DualPi2(DualPi2::default()), limit: Some(QueueLimit::Packets(10_000)), ..Bottleneck::at_rate(rate) };
        let link =
            |name: LinkName, bottleneck| Link::new(1, &name, LinkConfig { bottleneck, delay: Delay::constant(DELAY), ..LinkConfig::default() });
        let configs: Vec<TcpConfig> = congestion.iter().map(|congestion| TcpConfig { congestion: *congestion, ..TcpConfig::default() }).collect();
        let sender = |(place, config): (usize, &TcpConfig)| {
            let ends = [format!("10.0.0.1:{}", 1000 + place), "10.0.0.2:80".to_owned()].map(|end| end.parse().unwrap());
            Connection::connect(Instant::ZERO, config.clone(), ends[0], ends[1], 7).unwrap()
        };
        let count = configs.len();
        let mut shared = Self {
            now: Instant::ZERO,
            senders: configs.iter().enumerate().map(sender).collect(),
            receivers: vec![None; count],
            configs,
            there: link(LinkName::between("senders", "receivers"), Some(bottleneck)),
            back: link(LinkName::between("receivers", "senders"), None),
            rate,
            read: vec![0; count],
            waits: vec![(0.0, 0); count],
        };
        (0..count).for_each(|place| shared.flush(place));
        shared
    }

    /// Lets the programs of a flow write and read, and sends what may leave.
    fn flush(&mut self, place: usize) {
        let sender = &mut self.senders[place];
        if sender.state().is_synchronised() {
            while sender.write(&[7; 16_384]).is_ok() {}
        }
        let packet = |segment: Segment<'static>| {
            (PacketInfo { size: Bytes::new(segment.packet_length() as u64), ecn: segment.ecn }, (place, Box::new(segment)))
        };
        while let Some((info, segment)) = sender.poll_transmit(self.now).map(packet) {
            self.there.handle_packet(self.now, info, segment).unwrap();
        }
        let Some(receiver) = &mut self.receivers[place] else { return };
        let mut octets = [0; 16_384];
        while let Ok(count @ 1..) = receiver.read(&mut octets) {
            self.read[place] += count as u64;
        }
        while let Some((info, segment)) = receiver.poll_transmit(self.now).map(packet) {
            self.back.handle_packet(self.now, info, segment).unwrap();
        }
    }

    fn arrive(&mut self, is_there: bool, (place, mut segment): Packet, is_marked: bool) {
        if is_marked {
            segment.ecn = Ecn::Congestion;
        }
        match (is_there, &mut self.receivers[place]) {
            (false, _) => self.senders[place].handle_segment(self.now, &segment),
            (true, Some(receiver)) => receiver.handle_segment(self.now, &segment),
            (true, none) => *none = Some(Connection::accept(self.now, self.configs[place].clone(), &segment, 9).unwrap()),
        }
        self.flush(place);
    }

    fn run_until(&mut self, end: Instant) {
        loop {
            let ends = || self.senders.iter().chain(self.receivers.iter().flatten());
            let next =
                [self.there.poll_timeout(), self.back.poll_timeout()].into_iter().flatten().chain(ends().filter_map(Connection::poll_timeout)).min();
            let Some(next) = next.filter(|next| *next <= end) else { break };
            self.now = next;
            for is_there in [true, false] {
                let link = if is_there { &mut self.there } else { &mut self.back };
                link.handle_timeout(next).unwrap();
                let events: Vec<_> = std::iter::from_fn(|| link.poll_event()).collect();
                for event in events {
                    if let Fate::Delivered(at) = event.fate {
                        if is_there {
                            let travel = at.saturating_duration_since(event.offered) - DELAY - self.rate.serialisation_time(event.size);
                            let (sum, count) = &mut self.waits[event.payload.0];
                            (*sum, *count) = (*sum + travel.as_secs_f64(), *count + 1);
                        }
                        self.arrive(is_there, event.payload, event.record.marked);
                    }
                }
            }
            for place in 0..self.senders.len() {
                let mut is_due = false;
                for end in [Some(&mut self.senders[place]), self.receivers[place].as_mut()].into_iter().flatten() {
                    if end.poll_timeout() == Some(next) {
                        end.handle_timeout(next);
                        is_due = true;
                    }
                }
                if is_due {
                    self.flush(place);
                }
            }
        }
        self.now = end;
    }

    /// Returns rate and wait of each flow from `from` to `until` [s].
    fn got(&mut self, from: u64, until: u64) -> Vec<Got> {
        self.run_until(Instant::from_nanos(from * 1_000_000_000));
        self.read.fill(0);
        self.waits.fill((0.0, 0));
        self.run_until(Instant::from_nanos(until * 1_000_000_000));
        let span = (until - from) as f64;
        let got = |(read, (sum, count)): (&u64, &(f64, u32))| Got { rate: *read as f64 * 8.0 / span, wait: sum / f64::from(*count) * 1e3 };
        self.read.iter().zip(&self.waits).map(got).collect()
    }
}

/// A scalable sender alone: the step of a millisecond holds the queue there, and the line is full.
#[test]
fn alone_a_scalable_sender_keeps_the_queue_at_the_step() {
    let got = Shared::new(40_000_000, &[CongestionControl::Dctcp]).got(10, 40)[0];
    assert!(got.rate > 0.9 * 40e6 && (0.2..1.2).contains(&got.wait), "{got:?}");
}

/// CUBIC alone: the controller holds its queue at 15 ms.
#[test]
fn alone_a_classic_sender_has_the_target() {
    let got = Shared::new(40_000_000, &[CongestionControl::Cubic]).got(10, 40)[0];
    assert!(got.rate > 0.9 * 40e6 && (8.0..20.0).contains(&got.wait), "{got:?}");
}

/// With p′ as the probability, a scalable window is 2/(2·p′) and the classic one √1.5/p′, so that the rates are as R_C/(√1.5·R_L): a window that is 1.22
/// times smaller, but in a shorter round trip R_L, without the queue of the other one. p′ moves with the window of a lone classic sender, which loses a packet
/// when p′ is high, so the scalable one has up to 1.8 times as much.
fn share_the_line(rate: u64, scalable: usize, classic: usize) {
    let senders: Vec<CongestionControl> =
        [(CongestionControl::Dctcp, scalable), (CongestionControl::Cubic, classic)].into_iter().flat_map(|(kind, count)| vec![kind; count]).collect();
    let got = Shared::new(rate, &senders).got(20, 80);
    let (low, high) = got.split_at(scalable);
    let mean = |flows: &[Got], of: fn(&Got) -> f64| flows.iter().map(of).sum::<f64>() / flows.len() as f64;
    let [wait_l, wait_c] = [low, high].map(|flows| mean(flows, |got| got.wait));
    let [rate_l, rate_c] = [low, high].map(|flows| mean(flows, |got| got.rate));
    let round = |wait: f64| 2.0 * DELAY.as_secs_f64() + wait / 1e3;
    let expected = round(wait_c) / (1.5f64.sqrt() * round(wait_l));
    assert!((0.5..2.0).contains(&(rate_l / rate_c / expected)), "{got:?}: {}, expected {expected}", rate_l / rate_c);
    assert!(wait_l < 1.0 && (10.0..20.0).contains(&wait_c), "{got:?}");
    let sum: f64 = got.iter().map(|got| got.rate).sum();
    assert!(sum > 0.9 * rate as f64, "{got:?}");
}

// One test for each line, because the three together would end last, on one core.
#[test]
fn a_scalable_and_a_classic_sender_share_the_line() {
    share_the_line(40_000_000, 1, 1);
}

#[test]
fn a_scalable_and_a_classic_sender_share_a_fast_line() {
    share_the_line(100_000_000, 1, 1);
}

#[test]
fn two_scalable_and_two_classic_senders_share_the_line() {
    share_the_line(40_000_000, 2, 2);
}

//! nexosim: a model for each peer, whose ticks and samples its scheduler has.
//!
//! It has no links. A constant delay is an event that a sender schedules for itself, and then sends to all others at once: one event for N − 1 packets.
//! With jitter and loss each receiver is told at once that a sample departs, draws what becomes of it, and schedules its arrival for itself.
//!
//! What happens at one instant to one model has an order only if it comes from one place, so that ticks are a nanosecond after the instants at which
//! packets arrive.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use nexosim::model::{BuildContext, Context, Model, ProtoModel, schedulable};
use nexosim::ports::Output;
use nexosim::simulation::{Mailbox, SimInit};
use nexosim::time::MonotonicTime;
use serde::{Deserialize, Serialize};

use super::body::Body;
use super::draws::Draws;
use super::on_loop::outcome;
use super::{DELAY_NANOS, Mesh, Outcome, Packet, TICK_NANOS, TICKS_A_FRAME};

/// When the first tick is: events can only be scheduled for later than the start.
const BEGIN: u64 = TICK_NANOS;

/// How far ticks are behind the instants of packets.
const BEHIND: u64 = 1;

const fn at(nanos: u64) -> MonotonicTime {
    match MonotonicTime::EPOCH.checked_add(Duration::from_nanos(BEGIN + nanos)) {
        Some(time) => time,
        None => MonotonicTime::MAX,
    }
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Sample {
    from: usize,
    sequence: u64,
    sent: u64,
    x: f64,
    v: f64,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Arrival {
    sample: Sample,
    at: u64,
}

/// What nexosim saves of a peer: nothing here; what it runs on is in [`Seat`], which is not saved.
#[derive(Default, Serialize, Deserialize)]
struct Peer {
    /// To all others: a sample has arrived.
    arrivals: Output<Sample>,
    /// To all others: a sample departs.
    departures: Output<Sample>,
}

/// What each peer ends with, and its largest error of arrival.
type Ends = Arc<Mutex<Vec<Option<(Body, u64)>>>>;

struct Seat {
    me: usize,
    impaired: bool,
    body: Body,
    /// Of the links from each peer.
    draws: Vec<Draws>,
    tick: u64,
    ticks: u64,
    worst: u64,
    ends: Ends,
}

struct Proto(Peer, Seat);

impl ProtoModel for Proto {
    type Model = Peer;

    fn build(self, _: &mut BuildContext<Self>) -> (Peer, Seat) {
        (self.0, self.1)
    }
}

#[Model(type Env = Seat)]
impl Peer {
    #[nexosim(init)]
    async fn init(&mut self, cx: &Context<Self>) {
        let period = Duration::from_nanos(TICK_NANOS);
        cx.schedule_periodic_event(at(BEHIND), period, schedulable!(Self::tick), ()).expect("it is later than the start");
    }

    #[nexosim(schedulable)]
    async fn tick(&mut self, (): (), cx: &Context<Self>, seat: &mut Seat) {
        if seat.tick.is_multiple_of(TICKS_A_FRAME) {
            let [x, v] = seat.body.state();
            let sample = Sample { from: seat.me, sequence: seat.tick / TICKS_A_FRAME, sent: seat.tick * TICK_NANOS, x, v };
            if seat.impaired {
                self.departures.send(sample).await;
            } else {
                cx.schedule_event(at(sample.sent + DELAY_NANOS), schedulable!(Self::deliver), sample).expect("it is later");
            }
        }
        seat.body.tick();
        seat.tick += 1;
        if seat.tick == seat.ticks
            && let Ok(mut ends) = seat.ends.lock()
        {
            ends[seat.me] = Some((seat.body.clone(), seat.worst));
        }
    }

    #[nexosim(schedulable)]
    async fn deliver(&mut self, sample: Sample) {
        self.arrivals.send(sample).await;
    }

    async fn arrive(&mut self, sample: Sample, cx: &Context<Self>, seat: &mut Seat) {
        seat.take(cx.time(), Arrival { sample, at: sample.sent + DELAY_NANOS });
    }

    async fn depart(&mut self, sample: Sample, cx: &Context<Self>, seat: &mut Seat) {
        if let Some(delay) = seat.draws[sample.from].delay(sample.sequence) {
            let arrival = Arrival { sample, at: sample.sent + delay };
            cx.schedule_event(at(arrival.at), schedulable!(Self::arrive_drawn), arrival).expect("it is later");
        }
    }

    #[nexosim(schedulable)]
    async fn arrive_drawn(&mut self, arrival: Arrival, cx: &Context<Self>, seat: &mut Seat) {
        seat.take(cx.time(), arrival);
    }
}

impl Seat {
    fn take(&mut self, now: MonotonicTime, arrival: Arrival) {
        let error = now.duration_since(at(arrival.at));
        self.worst = self.worst.max(u64::try_from(error.as_nanos()).unwrap_or(u64::MAX));
        let Sample { from, sequence, x, v, .. } = arrival.sample;
        self.body.receive(&Packet { from, sequence, arrival: arrival.at, x, v });
    }
}

/// Runs the mesh for a number of ticks, on one thread: more would cost more processor time.
///
/// # Panics
///
/// If nexosim gives an error.
#[must_use]
pub fn run(mesh: Mesh, ticks: u64) -> Outcome {
    let n = mesh.peers;
    // With less, peers that send to each other at the same time wait for each other for ever.
    let mailboxes: Vec<Mailbox<Peer>> = (0..n).map(|_| Mailbox::with_capacity(4 * n)).collect();
    let ends = Arc::new(Mutex::new(vec![None; n]));
    let mut init = SimInit::with_num_threads(1);
    let peers: Vec<Peer> = (0..n)
        .map(|me| {
            let mut peer = Peer::default();
            for (_, mailbox) in mailboxes.iter().enumerate().filter(|(other, _)| *other != me) {
                peer.arrivals.connect(Peer::arrive, mailbox);
                peer.departures.connect(Peer::depart, mailbox);
            }
            peer
        })
        .collect();
    for ((me, peer), mailbox) in peers.into_iter().enumerate().zip(mailboxes) {
        let (body, draws) = (Body::new(mesh, me), Draws::to(mesh, me));
        let seat = Seat { me, impaired: mesh.impaired, body, draws, tick: 0, ticks, worst: 0, ends: Arc::clone(&ends) };
        init = init.add_model(Proto(peer, seat), mailbox, &format!("peer{}", me + 1));
    }
    let mut simulation = init.init(MonotonicTime::EPOCH).expect("a bench");
    simulation.step_until(at((ticks - 1) * TICK_NANOS + BEHIND)).expect("it runs to its end");
    let ends = ends.lock().expect("nobody panicked");
    let worst = ends.iter().flatten().map(|(_, worst)| *worst).max().unwrap_or(0);
    let bodies: Vec<Body> = ends.iter().flatten().map(|(body, _)| body.clone()).collect();
    outcome(&bodies, worst)
}

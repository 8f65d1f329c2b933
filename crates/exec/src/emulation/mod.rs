//! The network in real time: one thread reads the devices of the hosts and the sockets of the gateway, in the loop of [`cohaptic_realtime::drive()`].

mod stop;

use core::time::Duration;
use std::fs::File;
use std::io::{self, BufWriter, PipeReader};
use std::ops::ControlFlow;
use std::os::fd::{AsFd as _, BorrowedFd};
use std::sync::Arc;

use cohaptic_capture::CaptureWriter;
use cohaptic_realtime::{Clock as _, Driven, Lateness, MonotonicClock, Pacing, Received, Schedule, drive};
use cohaptic_router::{Device as _, Packet, Sent, Tun};
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use crate::exchange::{Departure, Exchange};
use crate::gateway::Gateway;
pub(crate) use stop::Stop;

/// Network of hosts, with the devices of the hosts.
#[derive(Debug)]
pub(crate) struct Emulation {
    exchange: Exchange,
    /// Ends of the network, indexed by node.
    ports: Vec<Port>,
    clock: MonotonicClock,
    stop: Arc<Stop>,
    /// Pipe of [`Stop`]; `None` after the loop has seen the wish.
    woken: Option<PipeReader>,
    /// Time from the logical departure of each packet to the write to its receiver.
    release: Lateness,
    /// Packets of the current read; empty between reads.
    incoming: Vec<Packet>,
    /// Packets at the end of their links, indexed by receiver.
    leaving: Vec<Leaving>,
    /// Packets refused by a device, indexed by node.
    refused: Vec<u64>,
    /// Captures of hosts, indexed by node; `None` without a capture.
    captures: Vec<Option<Capture>>,
    /// First error of a capture. The run goes on without the captures.
    capture_error: Option<io::Error>,
    /// `true` if the latest read of all devices and sockets found nothing.
    is_read_out: bool,
}

/// Writer of the packets from and to a host.
pub(crate) type Capture = CaptureWriter<BufWriter<File>>;

/// End of the network at a host.
#[derive(Debug)]
pub(crate) enum Port {
    Device(Tun),
    Gateway(Box<Gateway>),
}

#[derive(Debug, Default)]
struct Leaving {
    packets: Vec<Arc<Packet>>,
    at: Vec<Instant>,
}

/// Approximate time to read a packet and to offer the packet to its link, as for the router.
const READING: Duration = Duration::from_micros(10);

/// Packets read from one device before departures are written and the next device gets its turn, as for the router.
const IN_TURN: usize = 64;

impl Emulation {
    /// Returns the network, and the way to end its run.
    ///
    /// # Errors
    ///
    /// If the system gives no more descriptors.
    pub(crate) fn new(exchange: Exchange, ports: Vec<Port>, captures: Vec<Option<Capture>>) -> io::Result<(Self, Arc<Stop>)> {
        let (count, clock) = (ports.len(), MonotonicClock::start());
        let (stop, woken) = Stop::new(clock)?;
        let stop = Arc::new(stop);
        let emulation = Self {
            exchange,
            ports,
            clock,
            stop: Arc::clone(&stop),
            woken: Some(woken),
            release: Lateness::new(),
            incoming: Vec::new(),
            leaving: std::iter::repeat_with(Leaving::default).take(count).collect(),
            refused: vec![0; count],
            captures,
            capture_error: None,
            is_read_out: false,
        };
        Ok((emulation, stop))
    }

    /// Passes packets between the hosts until [`Stop`] says to end.
    ///
    /// # Errors
    ///
    /// The error of a device, or of the wait for packets.
    pub(crate) fn run(&mut self, pacing: Pacing) -> io::Result<()> {
        /// Time between two checks whether the last data has arrived.
        const LOOK: Duration = Duration::from_millis(50);
        drive(self, &Schedule { pacing, end: None, look_every: LOOK }, |_, _| ControlFlow::Continue(()))
    }

    /// Returns whether all data of the hosts has arrived.
    fn is_delivered(&self) -> bool {
        self.is_read_out
            && self.ports.iter().enumerate().all(|(node, port)| match port {
                Port::Device(_) => self.exchange.in_flight(NodeId::new(node)) == 0,
                Port::Gateway(gateway) => gateway.is_delivered(),
            })
    }

    pub(crate) const fn exchange(&self) -> &Exchange {
        &self.exchange
    }

    pub(crate) const fn release(&self) -> &Lateness {
        &self.release
    }

    pub(crate) fn elapsed(&self) -> Instant {
        self.clock.now()
    }

    /// Returns the numbers of packets refused by the device of each node, or by the gateway.
    pub(crate) fn refused(&self) -> impl Iterator<Item = u64> {
        self.refused.iter().zip(&self.ports).map(|(refused, port)| match port {
            Port::Device(_) => *refused,
            Port::Gateway(gateway) => gateway.dropped(),
        })
    }

    /// Ends the captures, and returns their first error.
    pub(crate) fn finish_captures(&mut self) -> Option<io::Error> {
        for capture in self.captures.iter_mut().filter_map(Option::take) {
            if let Err(error) = capture.finish() {
                self.capture_error.get_or_insert(error);
            }
        }
        self.capture_error.take()
    }

    /// Offers a packet of a host to the links.
    fn offer(&mut self, now: Instant, from: usize, packet: Packet) {
        self.capture(from, |capture| capture.write_sent(now, packet.bytes()));
        self.exchange.handle_packet(now, NodeId::new(from), packet);
    }

    fn capture(&mut self, node: usize, write: impl FnOnce(&mut Capture) -> io::Result<()>) {
        if let Some(capture) = &mut self.captures[node]
            && let Err(error) = write(capture)
        {
            self.captures[node] = None;
            self.capture_error.get_or_insert(error);
        }
    }

    /// Offers the packets of the gateways to the links.
    fn take_answers(&mut self, now: Instant) {
        for node in 0..self.ports.len() {
            while let Port::Gateway(gateway) = &mut self.ports[node]
                && let Some(packet) = gateway.poll_packet()
            {
                self.offer(now, node, packet);
            }
        }
    }

    /// Moves departures from the links to the queues of the receivers.
    fn take_departures(&mut self) {
        while let Some(Departure { at, record, to, packet }) = self.exchange.poll_departure() {
            let to = usize::from(to.0);
            self.capture(to, |capture| capture.write_packet(&record.without_path(), packet.bytes()));
            let leaving = &mut self.leaving[to];
            leaving.at.push(at);
            leaving.packets.push(packet);
        }
    }

    /// Writes the packets at the end of their links to the receiver `node`. Returns the number of packets.
    fn deliver(&mut self, node: usize) -> u64 {
        let Leaving { packets, at } = &mut self.leaving[node];
        let count = packets.len() as u64;
        match &mut self.ports[node] {
            Port::Device(device) => {
                let mut rest = packets.as_slice();
                let mut at = at.drain(..);
                while !rest.is_empty() {
                    // Lateness is measured before the call, because one call writes all packets of the group.
                    let now = self.clock.now();
                    let (done, sent) = device.send(rest);
                    // At least one packet is settled by each call, so that the loop ends.
                    let (gone, left) = rest.split_at(done.clamp(1, rest.len()));
                    (&mut at).take(gone.len()).for_each(|at| self.release.record(now.saturating_duration_since(at)));
                    self.refused[node] += if sent == Sent::Sent { 0 } else { gone.len() as u64 };
                    rest = left;
                }
            }
            Port::Gateway(gateway) => {
                for (packet, at) in packets.iter().zip(at.drain(..)) {
                    self.release.record(self.clock.now().saturating_duration_since(at));
                    gateway.handle_packet(at, packet);
                }
            }
        }
        packets.clear();
        count
    }
}

impl Driven for Emulation {
    type Clock = MonotonicClock;
    type Error = io::Error;

    /// While a departure is made ready, an arriving packet is read late by up to this time.
    const AHEAD: Option<Duration> = Some(READING);
    const RESTS: bool = false;

    fn clock(&self) -> &MonotonicClock {
        &self.clock
    }

    fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>> {
        let ports = self.ports.iter().map(|port| match port {
            Port::Device(device) => device.readable(),
            Port::Gateway(gateway) => gateway.readable(),
        });
        ports.chain(self.woken.as_ref().map(|woken| woken.as_fd()))
    }

    /// Reads waiting packets from the devices, and answers from the sockets, in turns.
    fn receive(&mut self, now: Instant) -> io::Result<Received> {
        // The pipe stays readable, and a loop with the pipe would never wait again. The loop still has to wait for the last data.
        if self.stop.is_wished() {
            self.woken = None;
        }
        // A packet counts from its reading, so departures already late leave first, as in the router.
        if self.poll_timeout().is_some_and(|due| now.saturating_duration_since(due) >= READING) {
            self.handle_timeout(now);
            self.send();
        }
        let mut received = 0;
        for node in 0..self.ports.len() {
            let mut count = 0;
            while count < IN_TURN {
                let is_read = match &mut self.ports[node] {
                    Port::Device(device) => device.receive(&mut self.incoming)?,
                    Port::Gateway(gateway) => {
                        count += gateway.poll(self.clock.now())?;
                        false
                    }
                };
                if !is_read {
                    break;
                }
                let now = self.clock.now();
                count += self.incoming.len();
                let mut incoming = core::mem::take(&mut self.incoming);
                incoming.drain(..).for_each(|packet| self.offer(now, node, packet));
                self.incoming = incoming;
            }
            received += count;
            self.take_answers(self.clock.now());
            self.take_departures();
            self.send();
        }
        self.is_read_out = received == 0;
        Ok(Received { count: received, until: now })
    }

    fn is_over(&self) -> bool {
        self.stop.is_over(|| self.is_delivered())
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let gateways = self.ports.iter().filter_map(|port| match port {
            Port::Device(_) => None,
            Port::Gateway(gateway) => gateway.poll_timeout(),
        });
        gateways.chain(self.exchange.poll_timeout()).min()
    }

    fn handle_timeout(&mut self, now: Instant) -> bool {
        self.exchange.handle_timeout(now);
        for port in &mut self.ports {
            if let Port::Gateway(gateway) = port {
                gateway.handle_timeout(now);
            }
        }
        self.take_answers(now);
        self.take_departures();
        false
    }

    /// Writes all packets at the end of their links to the receivers. An answer of the gateway over a link without delay leaves in the same call.
    fn send(&mut self) -> u64 {
        let mut sent = 0;
        loop {
            let count: u64 = (0..self.ports.len()).map(|node| self.deliver(node)).sum();
            if count == 0 {
                return sent;
            }
            sent += count;
            self.take_answers(self.clock.now());
            self.take_departures();
        }
    }
}

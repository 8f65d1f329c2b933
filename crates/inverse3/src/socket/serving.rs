//! A simulated service at ports of this machine, driven by a thread.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::os::fd::AsFd as _;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use cohaptic_device::Stopper;
use cohaptic_realtime::{Clock as _, MonotonicClock};
use cohaptic_units::Instant;

use super::wire::Wire;
use super::{StartError, events_of, local};
use crate::service::{Frame, Service};

/// Longest wait of the thread, after which the thread looks for a stop.
const LONGEST_WAIT: Duration = Duration::from_millis(20);
/// Attempts to find a free port whose port of events is free too.
const ATTEMPTS: u32 = 64;

/// A simulated service that serves any program of this machine. A drop ends the service.
#[derive(Debug)]
pub struct ServiceThread {
    service: Arc<Mutex<Service>>,
    address: SocketAddr,
    clock: MonotonicClock,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl ServiceThread {
    /// Listens at `address`, and 19 ports above for programs that want events. Port 0 means any free pair of ports.
    ///
    /// # Errors
    ///
    /// [`StartError`] for an address of another machine, for ports that are taken, or if no thread can be started.
    pub fn start(service: Service, address: SocketAddr) -> Result<Self, StartError> {
        let (listener, events) = listen(local(address)?)?;
        let address = listener.local_addr().map_err(|error| StartError::Listen(address, error))?;
        let (service, stopper, clock) = (Arc::new(Mutex::new(service)), Stopper::default(), MonotonicClock::start());
        let serving =
            Serving { service: Arc::clone(&service), listener, events, clock, stopper: stopper.clone(), programs: Vec::new(), hearers: Vec::new() };
        let thread = Builder::new().name("inverse service".to_owned()).spawn(move || serving.run()).map_err(StartError::Thread)?;
        Ok(Self { service, address, clock, stopper, thread: Some(thread) })
    }

    /// Returns the address of the service.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the time on the clock of the service.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.clock.now()
    }

    /// Calls `look` with the service at rest, for its true state.
    pub fn with<R>(&self, look: impl FnOnce(&Service) -> R) -> R {
        look(&self.service.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Returns whether the thread runs.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }
}

impl Drop for ServiceThread {
    fn drop(&mut self) {
        self.stopper.stop();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Opens the two ports of a service.
fn listen(address: SocketAddr) -> Result<(TcpListener, TcpListener), StartError> {
    let attempts = if address.port() == 0 { ATTEMPTS } else { 1 };
    let mut failed = None;
    for _ in 0..attempts {
        match pair(address) {
            Ok(pair) => return Ok(pair),
            Err(error) => failed = Some(error),
        }
    }
    Err(failed.unwrap_or_else(|| StartError::Listen(address, io::ErrorKind::AddrInUse.into())))
}

fn pair(address: SocketAddr) -> Result<(TcpListener, TcpListener), StartError> {
    let at = |address| {
        let listener = TcpListener::bind(address).and_then(|listener| listener.set_nonblocking(true).map(|()| listener));
        listener.map_err(|error| StartError::Listen(address, error))
    };
    let listener = at(address)?;
    let bound = listener.local_addr().map_err(|error| StartError::Listen(address, error))?;
    let events = events_of(bound).ok_or_else(|| StartError::Listen(bound, io::ErrorKind::AddrNotAvailable.into()))?;
    Ok((listener, at(events)?))
}

/// State of the thread.
struct Serving {
    service: Arc<Mutex<Service>>,
    listener: TcpListener,
    events: TcpListener,
    clock: MonotonicClock,
    stopper: Stopper,
    /// Connections of programs, with their numbers at the service.
    programs: Vec<(u64, Wire)>,
    /// Connections of programs that want events.
    hearers: Vec<Wire>,
}

impl Serving {
    fn run(mut self) {
        while !self.stopper.is_stopped() {
            let timeout = self.step();
            let latest = self.clock.now().saturating_add(LONGEST_WAIT);
            let until = timeout.map_or(latest, |until| until.min(latest));
            let wires = self.programs.iter().map(|(_, wire)| wire).chain(&self.hearers).map(|wire| wire.as_fd());
            let readable: Vec<_> = wires.chain([self.listener.as_fd(), self.events.as_fd()]).collect();
            if self.clock.block(Some(until), &readable).is_err() {
                return;
            }
        }
        for (_, wire) in self.programs {
            wire.close();
        }
    }

    /// Takes everything that has come, and sends everything that is due. Returns the next instant with something to do.
    fn step(&mut self) -> Option<Instant> {
        let Self { service, listener, events, clock, programs, hearers, .. } = self;
        let mut service = service.lock().unwrap_or_else(PoisonError::into_inner);
        while let Ok((stream, _)) = listener.accept() {
            // A program that does not shake hands is dropped.
            if let Ok(Some(wire)) = Wire::accept(stream, service.version())
                && let Some(session) = service.connect(clock.now())
            {
                programs.push((session, wire));
            }
        }
        while let Ok((stream, _)) = events.accept() {
            hearers.extend(Wire::accept(stream, service.version()).ok().flatten());
        }
        programs.retain_mut(|(session, wire)| {
            loop {
                match wire.receive() {
                    Ok(Some(text)) => service.receive(clock.now(), *session, &text),
                    Ok(None) => return true,
                    Err(_) => {
                        service.disconnect(clock.now(), *session);
                        return false;
                    }
                }
            }
        });
        let now = clock.now();
        while let Some(transmit) = service.poll_transmit(now) {
            let Some(place) = programs.iter().position(|(session, _)| *session == transmit.session) else { continue };
            match transmit.frame {
                Frame::Text(text) => {
                    if programs[place].1.send(text).is_err() {
                        let (session, _) = programs.remove(place);
                        service.disconnect(now, session);
                    }
                }
                Frame::Close => programs.remove(place).1.close(),
            }
        }
        while let Some(event) = service.poll_event() {
            hearers.retain_mut(|wire| wire.send(event.write()).is_ok());
        }
        hearers.retain_mut(|wire| wire.receive().is_ok());
        service.poll_timeout()
    }
}

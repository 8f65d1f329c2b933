//! The program on a bare loop: what its own awaits cost where a datagram has no link, no address, no socket and no record, and a task no waker.
//!
//! Datagrams lie in one ring, which works because all links have one delay; a timer is a field of its host.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::future::poll_fn;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::pin::Pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use super::program::{DELAY, Datagrams, Errors, PORT, Role, Runtime, SIZE, Stream, host};

/// A time that never comes \[ns\].
const NEVER: u64 = u64::MAX;

type Datagram = [u8; SIZE];
type Task = Pin<Box<dyn Future<Output = ()>>>;

#[derive(Default)]
struct World {
    now: Cell<u64>,
    /// Datagrams on the way: when each arrives, and where.
    ring: RefCell<VecDeque<(u64, usize, Datagram)>>,
    hosts: Vec<HostState>,
    /// The host whose task is polled.
    polled: Cell<usize>,
}

struct HostState {
    inbox: RefCell<VecDeque<Datagram>>,
    timer: Cell<u64>,
}

thread_local! {
    static WORLD: RefCell<Rc<World>> = RefCell::default();
}

fn world<T>(ask: impl FnOnce(&World) -> T) -> T {
    WORLD.with_borrow(|world| ask(world))
}

fn nanos(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).expect("no run takes 584 years")
}

#[derive(Clone, Copy)]
struct Bare;

/// The socket of a host.
struct Socket(usize);

impl Datagrams for Socket {
    async fn send_to(&self, bytes: &[u8], to: SocketAddr) -> io::Result<usize> {
        let IpAddr::V4(to) = to.ip() else { return Err(io::ErrorKind::InvalidInput.into()) };
        let datagram = bytes.try_into().map_err(|_| io::ErrorKind::InvalidInput)?;
        world(|world| world.ring.borrow_mut().push_back((world.now.get() + nanos(DELAY), to.to_bits() as usize, datagram)));
        Ok(bytes.len())
    }

    async fn receive(&self, buffer: &mut [u8]) -> io::Result<usize> {
        let datagram = poll_fn(|_| match world(|world| world.hosts[self.0].inbox.borrow_mut().pop_front()) {
            Some(datagram) => Poll::Ready(datagram),
            None => Poll::Pending,
        });
        buffer.copy_from_slice(&datagram.await);
        Ok(SIZE)
    }
}

impl Runtime for Bare {
    type Socket = Socket;

    async fn bind(self) -> io::Result<Socket> {
        Ok(Socket(world(|world| world.polled.get())))
    }

    fn now(self) -> Duration {
        Duration::from_nanos(world(|world| world.now.get()))
    }

    async fn sleep_until(self, at: Duration) {
        let at = nanos(at);
        poll_fn(|_| {
            world(|world| {
                let is_over = world.now.get() >= at;
                world.hosts[world.polled.get()].timer.set(if is_over { NEVER } else { at });
                if is_over { Poll::Ready(()) } else { Poll::Pending }
            })
        })
        .await;
    }
}

/// Runs it on a number of hosts, each sending that to each other one.
///
/// # Panics
///
/// If the program gives an error.
#[must_use]
pub fn run(hosts: u32, stream: Stream) -> Errors {
    let states = (0..hosts).map(|_| HostState { inbox: RefCell::default(), timer: Cell::new(NEVER) }).collect();
    let world = Rc::new(World { hosts: states, ..World::default() });
    WORLD.set(Rc::clone(&world));
    let errors = Rc::new(Cell::new(Errors::default()));
    let mut tasks: Vec<Option<Task>> = (0..hosts)
        .map(|me| {
            let others = (0..hosts).filter(|other| *other != me).map(|other| (Ipv4Addr::from_bits(other), PORT).into()).collect();
            let errors = Rc::clone(&errors);
            Some(Box::pin(async move {
                let seen = host(Bare, Role { me, others, stream }).await.expect("sockets work");
                errors.set(errors.get().and(seen));
            }) as Task)
        })
        .collect();
    let mut context = Context::from_waker(Waker::noop());
    let mut poll = |place: usize| {
        world.polled.set(place);
        if tasks[place].as_mut().is_some_and(|task| task.as_mut().poll(&mut context).is_ready()) {
            tasks[place] = None;
        }
    };
    (0..world.hosts.len()).for_each(&mut poll);
    let mut woken = Vec::new();
    loop {
        let arrival = world.ring.borrow().front().map_or(NEVER, |(at, ..)| *at);
        let timer = world.hosts.iter().map(|host| host.timer.get()).min().unwrap_or(NEVER);
        let now = arrival.min(timer);
        if now == NEVER {
            return errors.get();
        }
        world.now.set(now);
        while let Some((_, to, datagram)) = world.ring.borrow_mut().pop_front_if(|(at, ..)| *at <= now) {
            world.hosts[to].inbox.borrow_mut().push_back(datagram);
            woken.push(to);
        }
        woken.extend((0..world.hosts.len()).filter(|host| world.hosts[*host].timer.get() <= now));
        woken.drain(..).for_each(&mut poll);
    }
}

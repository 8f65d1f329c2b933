//! The program that is run on all: it knows its runtime by two small traits only.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use futures_util::future;

/// How long each is on its way.
pub const DELAY: Duration = Duration::from_millis(24);
/// The time between the begins of two hosts: the clocks of real ones are not aligned either.
const OFFSET: Duration = Duration::from_nanos(97_531);
/// The bytes of a datagram.
pub const SIZE: usize = 64;
/// Where all listen.
pub const PORT: u16 = 7000;

/// What the program asks of its runtime.
pub trait Runtime: Copy + 'static {
    /// A socket.
    type Socket: Datagrams;

    /// Binds a socket at [`PORT`].
    fn bind(self) -> impl Future<Output = io::Result<Self::Socket>>;
    /// The time since the run began.
    fn now(self) -> Duration;
    /// Waits until then.
    fn sleep_until(self, at: Duration) -> impl Future<Output = ()>;
}

/// What the program asks of a socket.
pub trait Datagrams {
    /// Sends a datagram.
    fn send_to(&self, bytes: &[u8], to: SocketAddr) -> impl Future<Output = io::Result<usize>>;
    /// Receives one.
    fn receive(&self, buffer: &mut [u8]) -> impl Future<Output = io::Result<usize>>;
}

/// What a host sends to another one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Stream {
    /// How far apart its datagrams are.
    pub period: Duration,
    /// How many there are.
    pub count: u32,
}

impl Stream {
    /// How long it takes.
    #[must_use]
    pub fn length(self) -> Duration {
        self.period * self.count
    }

    /// When a host sends its datagram of that number.
    fn when(self, host: u32, number: u32) -> Duration {
        OFFSET * host + self.period * number
    }
}

/// One host among others.
#[derive(Clone, Debug)]
pub struct Role {
    /// Which of them, from 0.
    pub me: u32,
    /// The others.
    pub others: Vec<SocketAddr>,
    /// What each sends to each other one.
    pub stream: Stream,
}

/// How far the arrivals were from when they should have been.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Errors {
    /// How many there were.
    pub packets: u64,
    /// The largest.
    pub worst: Duration,
    /// All of them.
    pub sum: Duration,
}

impl Errors {
    /// Both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self { packets: self.packets + other.packets, worst: self.worst.max(other.worst), sum: self.sum + other.sum }
    }
}

/// Sends to all others, and says how exact it was when their datagrams arrived.
///
/// # Errors
///
/// What a socket gives.
pub async fn host<R: Runtime>(runtime: R, role: Role) -> io::Result<Errors> {
    let socket = runtime.bind().await?;
    let sends = async {
        let mut datagram = [0; SIZE];
        datagram[..4].copy_from_slice(&role.me.to_be_bytes());
        for number in 0..role.stream.count {
            runtime.sleep_until(role.stream.when(role.me, number)).await;
            datagram[4..8].copy_from_slice(&number.to_be_bytes());
            for other in &role.others {
                socket.send_to(&datagram, *other).await?;
            }
        }
        io::Result::Ok(())
    };
    let receives = async {
        let (mut buffer, mut errors) = ([0; SIZE], Errors::default());
        let word = |bytes: &[u8]| bytes.try_into().map(u32::from_be_bytes).map_err(|_| io::ErrorKind::InvalidData);
        while errors.packets < role.others.len() as u64 * u64::from(role.stream.count) {
            let len = socket.receive(&mut buffer).await?;
            let error = runtime.now().abs_diff(role.stream.when(word(&buffer[..4])?, word(&buffer[4..8])?) + DELAY);
            assert_eq!(len, SIZE);
            errors = errors.and(Errors { packets: 1, worst: error, sum: error });
        }
        io::Result::Ok(errors)
    };
    future::try_join(sends, receives).await.map(|((), errors)| errors)
}

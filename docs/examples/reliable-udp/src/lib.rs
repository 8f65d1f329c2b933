//! A small reliable protocol over UDP: what is sent arrives, once and whole, whatever the network does.
//!
//! The sender numbers each datagram that it sends, so that an acknowledgement says which *transmission* arrived, not only which message. A message whose transmission
//! seems to be lost is sent again under a new number. One that only seemed to be lost is acknowledged late, and that is where the planted bug sits: see
//! [`Sender::acknowledge`]. With `FIXED` it is gone.

mod packet;
mod rtt;
mod sender;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;

use cohaptic_testkit::{UdpSocket, time};

use packet::{Acknowledgement, Data};
pub use sender::Sender;

/// No datagram of the protocol is longer \[bytes\].
const LONGEST: usize = 1200;

/// What a sender did and saw, in order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Event {
    /// It sent a message, with the transmission of that number.
    Sent {
        /// The number.
        transmission: u32,
        /// Which message.
        message: u32,
    },
    /// An acknowledgement of that transmission came.
    Acknowledged {
        /// The number.
        transmission: u32,
    },
}

/// Sends messages to the peer of a connected socket, until all are acknowledged. Gives what happened, in order.
///
/// # Errors
///
/// What the socket gives.
pub async fn send<const FIXED: bool>(socket: &UdpSocket, messages: &[Vec<u8>]) -> io::Result<Vec<Event>> {
    let mut sender = Sender::<FIXED>::new(messages.len() as u32, time::now());
    let mut events = Vec::new();
    let mut buffer = [0; LONGEST];
    loop {
        let now = time::now();
        sender.give_up_overdue(now);
        while let Some((transmission, message)) = sender.next(now) {
            events.push(Event::Sent { transmission, message });
            let data = Data { transmission, message, bytes: &messages[message as usize] };
            socket.send(&data.encode()).await?;
        }
        let Some(wake) = sender.wake() else { return Ok(events) };
        // If the time is up first, the loop begins again.
        let Ok(len) = time::timeout(wake.saturating_duration_since(now), socket.recv(&mut buffer)).await else { continue };
        if let Some(Acknowledgement { transmission }) = Acknowledgement::decode(&buffer[..len?]) {
            events.push(Event::Acknowledged { transmission });
            sender.acknowledge(time::now(), transmission);
        }
    }
}

/// Receives messages for ever, and acknowledges each transmission.
///
/// # Errors
///
/// What the socket gives.
pub async fn receive(socket: &UdpSocket, received: &RefCell<BTreeMap<u32, Vec<u8>>>) -> io::Result<()> {
    let mut buffer = [0; LONGEST];
    loop {
        let (len, from) = socket.recv_from(&mut buffer).await?;
        if let Some(data) = Data::decode(&buffer[..len]) {
            received.borrow_mut().entry(data.message).or_insert_with(|| data.bytes.to_vec());
            socket.send_to(&Acknowledgement { transmission: data.transmission }.encode(), from).await?;
        }
    }
}

//! One transfer over a network.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use cohaptic_testkit::Testbed;
use cohaptic_testkit::strategies::ImpairedNetwork;
use reliable_udp::{Event, receive, send};

/// How many messages are sent.
const MESSAGES: u32 = 300;

/// What came out of a transfer.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Outcome {
    /// The messages that the sender took for delivered, and that did not arrive, or not as they were.
    pub missing: Vec<u32>,
    /// What the sender saw.
    pub events: Vec<Event>,
}

/// Sends messages from the first host to the second.
pub fn transfer<const FIXED: bool>(network: &ImpairedNetwork) -> Outcome {
    Testbed::new(["sender", "receiver"]).network(network).run(|bed| async move {
        let (socket, inbox) = (bed.host("receiver").bind("0.0.0.0:7").unwrap(), Rc::new(RefCell::new(BTreeMap::new())));
        let received = Rc::clone(&inbox);
        bed.host("receiver").spawn(async move { receive(&socket, &received).await });
        let socket = bed.host("sender").bind("0.0.0.0:0").unwrap();
        socket.connect("receiver:7").await.unwrap();
        let messages: Vec<Vec<u8>> = (0..MESSAGES).map(|message| vec![message as u8; 100]).collect();
        let events = send::<FIXED>(&socket, &messages).await.unwrap();
        let inbox = inbox.borrow();
        Outcome { missing: (0..MESSAGES).filter(|message| inbox.get(message) != messages.get(*message as usize)).collect(), events }
    })
}

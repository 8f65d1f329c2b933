//! Samples: a datagram that decodes encodes to the same bytes, a peer holds the newest of each sender, and a server adds each displacement once.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use cohaptic_peer::operator::Seen;
use cohaptic_peer::wire::{Extra, MAX_LEN, Sample, SampleKind};
use cohaptic_peer::{
    Clock, Command, Contact, Context, CopyConfig, Exchange, Gains, Held, Integrator, ObjectCopy, Peer, PeerConfig, ReceiveError, Reception,
    RestingDevice, State, Strategy,
};

use crate::Input;

/// All kinds of samples.
pub(crate) const KINDS: [SampleKind; 6] =
    [SampleKind::State, SampleKind::Attitude, SampleKind::Energy, SampleKind::Wave, SampleKind::Force, SampleKind::Increment];

const SESSION: u64 = 7;
/// The place of the receiver, among three peers.
const PLACE: u32 = 1;
/// Quantity of sequence numbers up to the newest one that a server tells apart.
const REACH: u64 = 65_536;

/// A strategy without forces, whose samples are of a kind.
struct Nothing(SampleKind);

impl Strategy<3> for Nothing {
    fn command(&mut self, context: &Context<'_, 3>) -> Command<3> {
        Command { force: [0.0; 3], target: *context.held.mean() }
    }

    fn kind(&self) -> SampleKind {
        self.0
    }

    fn set_gains(&mut self, _: Gains) {}
}

/// Displacements of a sender that a server has added.
#[derive(Default)]
struct Added {
    numbers: BTreeSet<u64>,
    position: [f64; 3],
}

impl Added {
    fn take(&mut self, sample: &Sample<3>, extra: &Extra<3>) -> Reception {
        let newest = self.numbers.last().copied();
        let is_newest = newest.is_none_or(|newest| newest < sample.sequence);
        if !is_newest && newest.is_some_and(|newest| newest - sample.sequence >= REACH) || !self.numbers.insert(sample.sequence) {
            return Reception::Stale;
        }
        self.position.iter_mut().zip(extra.numbers).for_each(|(position, number)| *position += number);
        if is_newest { Reception::Newest } else { Reception::Added }
    }
}

fn peer(axes: usize, kind: SampleKind) -> Peer<3, RestingDevice<3>, Nothing> {
    let tick = Duration::from_millis(1);
    let gains = Gains { stiffness: 1.0, damping: 1.0 };
    let config = PeerConfig {
        session: SESSION,
        place: PLACE,
        axes,
        contact: Contact::None,
        coupling: gains,
        tick,
        compute_delay: false,
        exchange: Exchange::EACH_TICK,
        own_damping: 0.0,
        enclosure: None,
    };
    let object = ObjectCopy::new(CopyConfig { mass: 1.0, damping: 0.0 }, State::REST, Integrator::Exact, &Clock::regular(tick));
    Peer::new(config, RestingDevice { position: [0.0; 3] }, object, Nothing(kind), Held::new([State::REST; 2]))
}

/// The first byte chooses kind and axes, and the rest are datagrams of the right length, or one shorter or longer.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let choice = input.byte();
    let (kind, axes) = (KINDS[usize::from(choice % 6)], usize::from(choice / 6 % 3) + 1);
    let mut peer = peer(axes, if kind == SampleKind::Increment { kind } else { SampleKind::State });
    let mut added: BTreeMap<u32, Added> = BTreeMap::new();
    let mut newest: BTreeMap<u32, u64> = BTreeMap::new();
    let change = choice / 18 % 8;
    while !input.is_empty() {
        let length = kind.datagram_len(axes);
        let datagram = input.take(if change == 1 { length - 1 } else { length + usize::from(change == 2) });
        let decoded = Sample::<3>::decode_as(datagram, kind, axes);
        if let Ok((sample, extra)) = &decoded {
            let mut again = [0; MAX_LEN];
            let length = sample.encode_as(kind, extra, axes, &mut again);
            assert_eq!(&again[..length], datagram);
        }
        if kind == SampleKind::Increment {
            let expected = match &decoded {
                Err(error) => Err(ReceiveError::Decode(*error)),
                Ok((_, Extra { receiver, .. })) if *receiver != PLACE => Err(ReceiveError::Receiver { receiver: *receiver }),
                Ok((Sample { session, .. }, _)) if *session != SESSION => Err(ReceiveError::Session { found: *session }),
                Ok((Sample { sender, .. }, _)) if *sender == PLACE || *sender > 2 => Err(ReceiveError::Sender { sender: *sender }),
                Ok((sample, extra)) => Ok(added.entry(sample.sender).or_default().take(sample, extra)),
            };
            assert_eq!(peer.handle_datagram(datagram), expected);
            for (sender, Added { position, .. }) in &added {
                let found = peer.seen(Seen::Peer(*sender as usize)).expect("the sender is another peer");
                // Displacements near the end of the numbers may add up to infinity, and then to what is no number.
                assert!(found.iter().zip(position).all(|(found, expected)| found == expected || found.is_nan() && expected.is_nan()));
            }
        }
        if kind == SampleKind::State {
            let expected = match decoded {
                Err(error) => Err(ReceiveError::Decode(error)),
                Ok((Sample { session, .. }, _)) if session != SESSION => Err(ReceiveError::Session { found: session }),
                Ok((Sample { sender, .. }, _)) if sender == PLACE || sender > 2 => Err(ReceiveError::Sender { sender }),
                Ok((Sample { sender, sequence, .. }, _)) if newest.get(&sender).is_none_or(|newest| *newest < sequence) => {
                    newest.insert(sender, sequence);
                    Ok(Reception::Newest)
                }
                Ok(_) => Ok(Reception::Stale),
            };
            assert_eq!(peer.handle_datagram(datagram), expected);
        }
    }
}

//! Samples: a datagram that decodes encodes to the same bytes, and a peer holds the newest of each sender.

use std::collections::BTreeMap;
use std::time::Duration;

use cohaptic_peer::wire::{MAX_LEN, Sample, SampleKind};
use cohaptic_peer::{
    Clock, Command, Contact, Context, CopyConfig, Gains, Held, Integrator, ObjectCopy, Peer, PeerConfig, ReceiveError, Reception, RestingDevice,
    State, Strategy,
};

use crate::Input;

/// All kinds of samples.
pub(crate) const KINDS: [SampleKind; 5] = [SampleKind::State, SampleKind::Attitude, SampleKind::Energy, SampleKind::Wave, SampleKind::Force];

const SESSION: u64 = 7;
/// The place of the receiver, among three peers.
const PLACE: u32 = 1;

struct Nothing;

impl Strategy<3> for Nothing {
    fn command(&mut self, context: &Context<'_, 3>) -> Command<3> {
        Command { force: [0.0; 3], target: *context.held.mean() }
    }

    fn set_gains(&mut self, _: Gains) {}
}

fn peer(axes: usize) -> Peer<3, RestingDevice<3>, Nothing> {
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
        own_damping: 0.0,
        enclosure: None,
    };
    let object = ObjectCopy::new(CopyConfig { mass: 1.0, damping: 0.0 }, State::REST, Integrator::Exact, &Clock::regular(tick));
    Peer::new(config, RestingDevice { position: [0.0; 3] }, object, Nothing, Held::new([State::REST; 2]))
}

/// The first byte chooses kind and axes, and the rest are datagrams of the right length, or one shorter or longer.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let choice = input.byte();
    let (kind, axes) = (KINDS[usize::from(choice % 5)], usize::from(choice / 5 % 3) + 1);
    let mut peer = peer(axes);
    let mut newest: BTreeMap<u32, u64> = BTreeMap::new();
    let change = choice / 15 % 8;
    while !input.is_empty() {
        let length = kind.datagram_len(axes);
        let datagram = input.take(if change == 1 { length - 1 } else { length + usize::from(change == 2) });
        let decoded = Sample::<3>::decode_as(datagram, kind, axes);
        if let Ok((sample, extra)) = &decoded {
            let mut again = [0; MAX_LEN];
            let length = sample.encode_as(kind, extra, axes, &mut again);
            assert_eq!(&again[..length], datagram);
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

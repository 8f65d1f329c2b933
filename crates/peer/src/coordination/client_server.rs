//! A central server: a single peer has the object. The remaining peers are clients, and send the states of their devices to the server.
//!
//! The server computes the coupling forces of all peers by equation (9) from the held states. The coupling forces of the clients take the place of a
//! coordination force. The copy of a client *is* the newest state heard from the server. The device of a client feels the force returned by the server, a
//! force computed by the client from its device and the heard state, or nothing.
//!
//! Clients may send displacements in addition. The position that the server holds for a client is then the sum of these displacements, and not the position in
//! the newest sample: see [`SampleKind::Increment`].

use alloc::vec::Vec;

use super::session::{ControllerKind, SessionParameters};
use super::{Command, Context, LawForm, LawParameter, LawValue, LawValues, Role, Strategy, UsedGains};
use crate::sample_kind::SampleKind;
use crate::{Contact, Gains, Held, State};

/// Words of the parameter `returns`, each with its meaning.
const RETURNS: &[(&str, &str)] = &[
    ("force", "the coupling force, computed by the server"),
    ("object", "the object, from which the client computes the coupling force"),
    ("none", "the object, which the client sees; its device feels no force"),
];
/// Words of the parameter `sends`, each with its meaning.
const SENDS: &[(&str, &str)] = &[
    ("states", "the state of the device"),
    ("increments", "the displacement since the sample before, which the server adds once; a lost one loses motion"),
];
/// Index of `force` in [`RETURNS`].
const FORCE: usize = 0;
/// Index of `object` in [`RETURNS`].
const OBJECT: usize = 1;
/// Index of `increments` in [`SENDS`].
const INCREMENTS: usize = 1;

/// The server or a client.
#[derive(Clone, Debug)]
pub enum ClientServer<const A: usize> {
    /// The peer with the object.
    Server {
        /// Contact, KC and BC of each client, indexed by the order of peers without the server.
        couplings: Vec<(Contact, Gains)>,
        /// `true` if samples to clients carry coupling forces, and zeros otherwise.
        returns_forces: bool,
        /// Kind of the samples of the session.
        kind: SampleKind,
    },
    /// A peer without a copy of its own.
    Client {
        /// Index of the server in the order of peers without this client.
        server: usize,
        /// Force on the device.
        felt: Felt<A>,
        /// Position of the device at the server, if all displacements so far have arrived in order \[m\]; `None` if the client sends states.
        told: Option<[f64; A]>,
    },
}

/// Coupling force on the device of a client.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Felt<const A: usize> {
    /// Newest coupling force returned by the server \[N\].
    Returned([f64; A]),
    /// The client computes the force from its device and the heard state.
    Computed,
    /// No force.
    Nothing,
}

impl<const A: usize> Felt<A> {
    fn of(returns: LawValue) -> Self {
        if returns == LawValue::Word(FORCE) {
            Self::Returned([0.0; A])
        } else if returns == LawValue::Word(OBJECT) {
            Self::Computed
        } else {
            Self::Nothing
        }
    }
}

impl<const A: usize> ControllerKind<A> for ClientServer<A> {
    const GAINS: UsedGains = UsedGains::Neither;
    const KIND: SampleKind = SampleKind::Force;
    const PARAMETERS: &[LawParameter] = &[
        LawParameter {
            key: "server",
            form: LawForm::Peer,
            default: "",
            about: "Name of the peer that has the object; the first peer by default",
            can_change: false,
        },
        LawParameter {
            key: "returns",
            form: LawForm::Words(RETURNS),
            default: "\"force\"",
            about: "Content of the samples that the server sends to its clients",
            can_change: false,
        },
        LawParameter {
            key: "sends",
            form: LawForm::Words(SENDS),
            default: "\"states\"",
            about: "Content of the samples of clients by which the server places their devices",
            can_change: false,
        },
    ];

    fn kind(own: &LawValues) -> SampleKind {
        if own.get(2) == LawValue::Word(INCREMENTS) { SampleKind::Increment } else { Self::KIND }
    }

    fn new(session: &SessionParameters<A>) -> Self {
        let (place, server) = (session.place, session.law.own.place(0));
        let (felt, kind) = (Felt::of(session.law.own.get(1)), <Self as ControllerKind<A>>::kind(&session.law.own));
        if place == server {
            let others = session.couplings.iter().enumerate().filter(|(other, _)| *other != place);
            Self::Server { couplings: others.map(|(_, coupling)| *coupling).collect(), returns_forces: matches!(felt, Felt::Returned(_)), kind }
        } else {
            // The server holds the initial state of a client until the first sample.
            let told = (kind == SampleKind::Increment).then_some(session.initial[place].position);
            // Peers after this client move down by one in the order without this client.
            Self::Client { server: if server < place { server } else { server - 1 }, felt, told }
        }
    }
}

/// Returns FC of a client \[N\].
fn coupling_of<const A: usize>((contact, gains): &(Contact, Gains), device: &State<A>, object: &State<A>) -> [f64; A] {
    core::array::from_fn(|axis| contact.force_along(axis, gains, device.along(axis).relative_to(object.along(axis))))
}

impl<const A: usize> Strategy<A> for ClientServer<A> {
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let mut force = [0.0; A];
        if let Self::Server { couplings, .. } = self {
            for (other, coupling) in couplings.iter().enumerate() {
                // Every client is heard by the server: `new` made one coupling for each held sample.
                let device = context.held.state(other).expect("each of the others is held");
                for (force, coupling) in force.iter_mut().zip(coupling_of(coupling, device, context.own)) {
                    // A coordination force is subtracted from the forces on the copy, while couplings of clients push the object.
                    *force -= coupling;
                }
            }
        }
        Command { force, target: *context.own }
    }

    fn role(&self) -> Role {
        match self {
            Self::Server { .. } => Role::Copy,
            Self::Client { server, .. } => Role::Client { server: *server },
        }
    }

    fn kind(&self) -> SampleKind {
        match self {
            Self::Server { kind, .. } => *kind,
            Self::Client { told: Some(_), .. } => SampleKind::Increment,
            Self::Client { told: None, .. } => Self::KIND,
        }
    }

    fn extra(&mut self, receiver: usize, own: &State<A>, held: &Held<A>) -> [f64; A] {
        match self {
            // The force for the present object, not for the object of the last command: samples are sent before the command of a tick.
            Self::Server { couplings, returns_forces: true, .. } => {
                coupling_of(&couplings[receiver], held.state(receiver).expect("each of the others is held"), own)
            }
            Self::Client { told: Some(told), .. } => core::array::from_fn(|axis| own.position[axis] - told[axis]),
            Self::Server { .. } | Self::Client { .. } => [0.0; A],
        }
    }

    fn sent(&mut self, own: &State<A>) {
        // Rounded as the server rounds its sum: what rounding leaves out of one displacement is in the next, so errors do not add up.
        if let Self::Client { told: Some(told), .. } = self {
            for (told, position) in told.iter_mut().zip(own.position) {
                *told += position - *told;
            }
        }
    }

    fn accept(&mut self, other: usize, numbers: &[f64; A]) {
        // Samples of other clients carry zeros.
        if let Self::Client { server, felt: Felt::Returned(returned), .. } = self
            && other == *server
        {
            *returned = *numbers;
        }
    }

    fn heard_coupling(&self) -> Option<[f64; A]> {
        match self {
            Self::Client { felt: Felt::Returned(returned), .. } => Some(*returned),
            Self::Client { felt: Felt::Nothing, .. } => Some([0.0; A]),
            Self::Client { felt: Felt::Computed, .. } | Self::Server { .. } => None,
        }
    }

    fn set_contact(&mut self, other: usize, contact: Contact) {
        if let Self::Server { couplings, .. } = self {
            couplings[other].0 = contact;
        }
    }

    /// No effect: copies without coordination have no gains.
    fn set_gains(&mut self, _gains: Gains) {}
}

//! A server in the middle: one peer alone has the object, the others are clients that send it the states of their devices.
//!
//! The server computes the coupling forces of all by equation (9) from the states held, with those of its clients in place of a coordination force. The
//! copy of a client *is* the newest state heard from the server, and its device feels the force that the server returns, or one that it computes itself
//! from its device and the state heard.

use alloc::vec::Vec;

use super::session::{ControllerKind, SessionParameters};
use super::{Command, Context, LawForm, LawParameter, LawValue, Role, Strategy, UsedGains};
use crate::wire::SampleKind;
use crate::{Contact, Gains, Held, State};

/// The words of `returns`, and what they mean.
const RETURNS: &[(&str, &str)] =
    &[("force", "the coupling force, computed by the server"), ("object", "the object, from which the client computes the coupling force")];
const FORCE: usize = 0;

/// The server, or one of its clients.
#[derive(Clone, Debug)]
pub enum ClientServer<const A: usize> {
    /// The peer that has the object.
    Server {
        /// Contact, KC and BC of each of the others.
        couplings: Vec<(Contact, Gains)>,
    },
    /// Any other.
    Client {
        /// The place of the server among the others.
        server: usize,
        /// The coupling force that was heard of \[N\]; `None` if the client computes it.
        returned: Option<[f64; A]>,
    },
}

impl<const A: usize> ControllerKind<A> for ClientServer<A> {
    const GAINS: UsedGains = UsedGains::Neither;
    const KIND: SampleKind = SampleKind::Force;
    const PARAMETERS: &[LawParameter] = &[
        LawParameter {
            key: "server",
            form: LawForm::Peer,
            default: "",
            about: "The peer that has the object; the first if there is no such key",
            can_change: false,
        },
        LawParameter {
            key: "returns",
            form: LawForm::Words(RETURNS),
            default: "\"force\"",
            about: "What the server sends to its clients",
            can_change: false,
        },
    ];

    fn new(session: &SessionParameters<A>) -> Self {
        let (place, server) = (session.place, session.law.own.place(0));
        if place == server {
            let others = session.couplings.iter().enumerate().filter(|(other, _)| *other != place);
            Self::Server { couplings: others.map(|(_, coupling)| *coupling).collect() }
        } else {
            let returned = (session.law.own.get(1) == LawValue::Word(FORCE)).then_some([0.0; A]);
            Self::Client { server: if server < place { server } else { server - 1 }, returned }
        }
    }
}

/// FC of a client \[N\].
fn coupling_of<const A: usize>((contact, gains): &(Contact, Gains), device: &State<A>, object: &State<A>) -> [f64; A] {
    core::array::from_fn(|axis| contact.force_along(axis, gains, device.along(axis).relative_to(object.along(axis))))
}

impl<const A: usize> Strategy<A> for ClientServer<A> {
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let mut force = [0.0; A];
        if let Self::Server { couplings } = self {
            for (other, coupling) in couplings.iter().enumerate() {
                let device = context.held.state(other).expect("each of the others is held");
                for (force, coupling) in force.iter_mut().zip(coupling_of(coupling, device, context.own)) {
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
        Self::KIND
    }

    fn extra(&mut self, receiver: usize, own: &State<A>, held: &Held<A>) -> [f64; A] {
        match self {
            Self::Server { couplings } => coupling_of(&couplings[receiver], held.state(receiver).expect("each of the others is held"), own),
            Self::Client { .. } => [0.0; A],
        }
    }

    fn accept(&mut self, other: usize, numbers: &[f64; A]) {
        if let Self::Client { server, returned: Some(returned) } = self
            && other == *server
        {
            *returned = *numbers;
        }
    }

    fn heard_coupling(&self) -> Option<[f64; A]> {
        match self {
            Self::Client { returned, .. } => *returned,
            Self::Server { .. } => None,
        }
    }

    fn set_contact(&mut self, other: usize, contact: Contact) {
        if let Self::Server { couplings } = self {
            couplings[other].0 = contact;
        }
    }

    /// There is no coordination between copies.
    fn set_gains(&mut self, _gains: Gains) {}
}

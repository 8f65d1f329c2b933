//! Which packet goes where: the first rule that applies to it decides, and if none does, the default of the side that it comes from.

use cohaptic_linkfile::router::{Ports, RouterFile, RuleSpec, Side, Target};

use crate::packet::Headers;

/// The rules of a router.
#[derive(Clone, PartialEq, Debug)]
pub struct Rules {
    rules: Vec<RuleSpec>,
    default: [Target; 2],
}

/// What decided where a packet goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Decided {
    /// The rule in this place.
    Rule(usize),
    /// No rule.
    Default,
}

impl Rules {
    /// The rules of a file.
    #[must_use]
    pub fn new(file: &RouterFile) -> Self {
        Self { rules: file.rules.clone(), default: file.default }
    }

    /// Where a packet from this side goes, and what says so.
    #[must_use]
    pub fn choose(&self, from: Side, headers: &Headers) -> (Decided, Target) {
        match self.rules.iter().position(|rule| applies(rule, from, headers)) {
            Some(place) => (Decided::Rule(place), self.rules[place].target),
            None => (Decided::Default, self.default[from.index()]),
        }
    }

    /// How many there are, without the defaults.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.rules.len()
    }

    /// Whether there are only defaults.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.rules.is_empty()
    }
}

fn applies(rule: &RuleSpec, from: Side, headers: &Headers) -> bool {
    let port = |wanted: Option<Ports>, place: usize| wanted.is_none_or(|wanted| headers.ports.is_some_and(|ports| wanted.contain(ports[place])));
    rule.from.is_none_or(|side| side == from)
        && rule.protocol.is_none_or(|protocol| protocol == headers.protocol)
        && rule.source.is_none_or(|network| network.contains(headers.source))
        && rule.destination.is_none_or(|network| network.contains(headers.destination))
        && port(rule.source_port, 0)
        && port(rule.destination_port, 1)
        && (port(rule.port, 0) || port(rule.port, 1))
}

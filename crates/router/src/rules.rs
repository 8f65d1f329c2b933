//! Choice of a target for each packet: the first rule that applies decides. If no rule applies, the default of the side decides from which the packet comes.

use cohaptic_linkfile::router::{Ports, RouterFile, RuleSpec, Side, Target};

use crate::packet::Headers;

/// Rules and defaults of a router.
#[derive(Clone, PartialEq, Debug)]
pub struct Rules {
    /// Rules in the order of the file.
    rules: Vec<RuleSpec>,
    /// Target without a rule, indexed by the side from which the packet comes.
    default: [Target; 2],
}

/// Reason for the target of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Decided {
    /// Rule number, counted from zero in the order of the file.
    Rule(usize),
    /// Default of the side: no rule applied.
    Default,
}

impl Rules {
    /// Returns the rules and defaults of a file.
    #[must_use]
    pub fn new(file: &RouterFile) -> Self {
        Self { rules: file.rules.clone(), default: file.default }
    }

    /// Returns the target of a packet from the side `from`, and the rule or default that decided.
    #[must_use]
    pub fn choose(&self, from: Side, headers: &Headers) -> (Decided, Target) {
        match self.rules.iter().position(|rule| applies(rule, from, headers)) {
            Some(place) => (Decided::Rule(place), self.rules[place].target),
            None => (Decided::Default, self.default[from.index()]),
        }
    }

    /// Returns the number of rules, without the defaults.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.rules.len()
    }

    /// Returns whether the file has no rules, so that the defaults hold for all packets.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.rules.is_empty()
    }
}

/// Returns whether a rule applies to a packet. Every condition named by the rule must hold.
fn applies(rule: &RuleSpec, from: Side, headers: &Headers) -> bool {
    // A rule that names a port does not apply to a packet without ports, such as a later fragment.
    let port = |wanted: Option<Ports>, place: usize| wanted.is_none_or(|wanted| headers.ports.is_some_and(|ports| wanted.contain(ports[place])));
    rule.from.is_none_or(|side| side == from)
        && rule.protocol.is_none_or(|protocol| protocol == headers.protocol)
        && rule.source.is_none_or(|network| network.contains(headers.source))
        && rule.destination.is_none_or(|network| network.contains(headers.destination))
        && port(rule.source_port, 0)
        && port(rule.destination_port, 1)
        && (port(rule.port, 0) || port(rule.port, 1))
}

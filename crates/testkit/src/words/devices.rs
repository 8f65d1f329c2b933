//! Lines of link files for nodes without programs: NATs, firewalls and interfaces.

use std::ops::Range;

use cohaptic_wan::MOST_NODES;

use super::{Reader, rest_of};
use crate::fault::Fault;
use crate::middlebox::check_size;
use crate::names::name_fault;
use crate::nat::{self, Behaviour};

/// NAT, firewall or interfaces of a link file.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum DeviceLine {
    Middlebox {
        behaviour: Behaviour,
        /// `true` for a NAT, `false` for a firewall.
        translates: bool,
        /// Indices of the hosts, interfaces, NATs and firewalls directly behind.
        inside: Vec<usize>,
    },
    /// Interfaces, which have the next names.
    Interfaces {
        /// Index of the host.
        host: usize,
        /// Number of interfaces.
        count: usize,
    },
}

impl DeviceLine {
    /// Returns the number of names of the line.
    pub(crate) const fn names(&self) -> usize {
        match self {
            Self::Middlebox { .. } => 1,
            Self::Interfaces { count, .. } => *count,
        }
    }
}

impl Reader {
    /// Reads the line of a NAT, or of a firewall if `translates` is false. `subject` holds the name and the words of the behaviour, `rest` the hosts.
    pub(super) fn middlebox(&mut self, line: &str, translates: bool, subject: &[Range<usize>], rest: &[Range<usize>]) -> Result<(), Fault> {
        let (span, words) = (&subject[0], &subject[1..]);
        self.check_new(line, span)?;
        let behaviour = nat::parse(line, words, Behaviour::default(), translates)?;
        let mut inside = Vec::new();
        for span in rest {
            let host = self.host(line, span)?;
            let is_inside = |(_, other): &(usize, DeviceLine)| match other {
                DeviceLine::Middlebox { inside, .. } => inside.contains(&host),
                DeviceLine::Interfaces { host: with, .. } => *with == host,
            };
            if inside.contains(&host) || self.devices.iter().any(is_inside) {
                let name = &line[span.clone()];
                return Err((span.clone(), format!("host `{name}` is behind a NAT or a firewall already, or has interfaces: expected it once")));
            }
            inside.push(host);
        }
        let translating = self.devices.iter().filter(|(_, other)| matches!(other, DeviceLine::Middlebox { translates: true, .. })).count();
        check_size(translating, translates, inside.len()).map_err(|message| (rest_of(line, span, rest), message))?;
        let device = DeviceLine::Middlebox { behaviour, translates, inside };
        self.device(line, std::slice::from_ref(span), device)
    }

    /// Reads the interfaces of a host.
    pub(super) fn interfaces(&mut self, line: &str, subject: &Range<usize>, rest: &[Range<usize>]) -> Result<(), Fault> {
        let host = self.host(line, subject)?;
        let is_taken = |(first, other): &(usize, DeviceLine)| match other {
            DeviceLine::Middlebox { inside, .. } => inside.contains(&host) || *first == host,
            DeviceLine::Interfaces { host: with, count } => *with == host || (*first..first + count).contains(&host),
        };
        if self.devices.iter().any(is_taken) {
            return Err((subject.clone(), "expected a host that is behind no NAT and has no interfaces yet".to_owned()));
        }
        if rest.is_empty() {
            return Err((rest_of(line, subject, rest), "expected the names of the interfaces, separated by spaces".to_owned()));
        }
        self.device(line, rest, DeviceLine::Interfaces { host, count: rest.len() })
    }

    /// Adds a NAT, a firewall or interfaces with the names at `names`.
    fn device(&mut self, line: &str, names: &[Range<usize>], device: DeviceLine) -> Result<(), Fault> {
        let first = self.hosts.len();
        for span in names {
            self.check_new(line, span)?;
            self.hosts.add(line[span.clone()].to_owned());
        }
        self.devices.push((first, device));
        Ok(())
    }

    /// Checks that a name can be that of a further NAT, firewall or interface.
    fn check_new(&self, line: &str, span: &Range<usize>) -> Result<(), Fault> {
        let name = &line[span.clone()];
        if self.hosts.find(name).is_some() {
            return Err((span.clone(), format!("`{name}` is named already: expected a name of its own, in a line before those that name it")));
        }
        if self.hosts.len() == MOST_NODES {
            return Err((span.clone(), format!("expected at most {MOST_NODES} hosts, NATs, firewalls and interfaces")));
        }
        name_fault(name).map_or(Ok(()), |fault| Err((span.clone(), fault)))
    }
}

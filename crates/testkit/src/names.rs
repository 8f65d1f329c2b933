//! Names of hosts.

use std::fmt::{self, Write as _};
use std::ops::Deref;

use cohaptic_wan::{MOST_NODES, NodeId, Path};

use crate::current;

/// Names of hosts, in the given order, with an index sorted by name. Looking a host up takes as many steps as the number of hosts has bits.
/// Names that differ only in the case of letters of ASCII, or in a final dot, are the same name (RFC 4343).
#[derive(Clone, PartialEq, Eq, Default)]
pub(crate) struct Names {
    list: Vec<String>,
    /// Indices into `list`, sorted by [`key`].
    sorted: Vec<NodeId>,
}

/// Maximum number of hosts that a message names.
pub(crate) const SHOWN: usize = 16;

impl Names {
    /// Adds the name of a further host.
    ///
    /// # Panics
    ///
    /// If the name is not valid, another host has the name, or there are more hosts than a network can have.
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub(crate) fn add(&mut self, name: String) {
        let fault = name_fault(&name);
        assert!(fault.is_none(), "{}", fault.unwrap_or_default());
        assert!(self.list.len() < MOST_NODES, "the test bed has more than {MOST_NODES} hosts; give at most {MOST_NODES} names");
        // The failed search returns the place that keeps `sorted` in order.
        match self.search(&name) {
            Ok(_) => panic!("two hosts have the name `{name}`: expected a name of its own for each host"),
            Err(place) => self.sorted.insert(place, NodeId::new(self.list.len())),
        }
        self.list.push(name);
    }

    fn search(&self, name: &str) -> Result<usize, usize> {
        self.sorted.binary_search_by(|node| key(&self.list[node.index()]).cmp(key(name)))
    }

    /// Returns the host named `name`, if there is one.
    pub(crate) fn find(&self, name: &str) -> Option<NodeId> {
        self.search(name).ok().map(|place| self.sorted[place])
    }

    /// Returns the host named `name`.
    ///
    /// # Panics
    ///
    /// If no host has the name.
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub(crate) fn node(&self, name: &str) -> NodeId {
        self.find(name).unwrap_or_else(|| panic!("{}", self.unknown(name)))
    }

    /// Returns the path from a host to another host.
    ///
    /// # Panics
    ///
    /// If there is no such host.
    pub(crate) fn path(&self, from: &str, to: &str) -> Path {
        Path { from: self.node(from), to: self.node(to) }
    }

    /// Returns the message that no host has the name, with the names of the hosts and the task that asks.
    pub(crate) fn unknown(&self, name: &str) -> String {
        let mut text = format!("there is no host `{name}`; the hosts are {}", self.list[..self.list.len().min(SHOWN)].join(", "));
        // Writing to a `String` cannot fail.
        if self.list.len() > SHOWN {
            let _ = write!(text, " and {} more", self.list.len() - SHOWN);
        }
        if let Some(task) = current::task() {
            let _ = write!(text, "; the name was asked for by {task}");
        }
        text
    }
}

impl fmt::Debug for Names {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(&self.list).finish()
    }
}

impl Deref for Names {
    type Target = [String];

    fn deref(&self) -> &[String] {
        &self.list
    }
}

impl<N: Into<String>> FromIterator<N> for Names {
    /// # Panics
    ///
    /// As [`Names::add`].
    fn from_iter<I: IntoIterator<Item = N>>(names: I) -> Self {
        let mut all = Self::default();
        names.into_iter().for_each(|name| all.add(name.into()));
        all
    }
}

/// Returns the bytes of a name for comparisons of names.
fn key(name: &str) -> impl Iterator<Item = u8> {
    name.strip_suffix('.').unwrap_or(name).bytes().map(|byte| byte.to_ascii_lowercase())
}

/// Returns why a text is not a valid name of a host, or `None` for a valid name.
pub(crate) fn name_fault(name: &str) -> Option<String> {
    // A name stands before a port in `server:80`, in brackets in `[server]:80`, and between blanks in link files.
    let is_word = !matches!(name, "" | ".")
        && !name.contains([':', '[', ']'])
        && !name.contains(char::is_whitespace)
        && name.parse::<std::net::IpAddr>().is_err();
    (!is_word).then(|| format!("`{name}` cannot be the name of a host: expected a word without `:`, `[` and `]` that is not an IP address"))
}

//! The names of hosts.

use cohaptic_wan::{NodeId, Path};

/// Checks the name of one more host.
///
/// # Panics
///
/// If it is none, or one of the others has it.
pub(crate) fn check_name(others: &[String], name: &str) {
    let fault = name_fault(name);
    assert!(fault.is_none(), "{}", fault.unwrap_or_default());
    assert!(!others.iter().any(|other| other == name), "two hosts are called `{name}`");
}

/// Why a text is no name of a host; `None` if it is one.
pub(crate) fn name_fault(name: &str) -> Option<String> {
    let is_word =
        !name.is_empty() && !name.contains([':', '[', ']']) && !name.contains(char::is_whitespace) && name.parse::<std::net::IpAddr>().is_err();
    (!is_word).then(|| format!("`{name}` is no name of a host; expected a word without `:`, `[` and `]` that is no address"))
}

/// Which of the hosts is called so.
///
/// # Panics
///
/// If there is none.
#[expect(clippy::panic, reason = "a misuse, and the way out")]
pub(crate) fn node(names: &[String], name: &str) -> NodeId {
    let index = names.iter().position(|known| known == name);
    NodeId::new(index.unwrap_or_else(|| panic!("there is no host `{name}`; the hosts are {}", names.join(", "))))
}

/// The path from one host to another.
///
/// # Panics
///
/// If there is no such host.
pub(crate) fn path(names: &[String], from: &str, to: &str) -> Path {
    let [from, to] = [from, to].map(|name| node(names, name));
    Path { from, to }
}

//! Accounts: two numbers that must be equal.

use core::fmt;

/// Something that was counted in two places.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Account {
    /// What was counted, in words.
    pub what: &'static str,
    /// In the first place.
    pub first: u64,
    /// In the second.
    pub second: u64,
    /// Why the two may differ, if they may.
    pub open: Option<&'static str>,
}

impl Account {
    /// Of two numbers that are known.
    pub(super) const fn of(what: &'static str, first: u64, second: u64) -> Self {
        Self { what, first, second, open: None }
    }

    /// Of what was sent over loopback, and what was received and what the kernel dropped, if it tells.
    pub(super) fn with_drops(what: &'static str, sent: u64, received: u64, drops: Option<u64>) -> Self {
        Self {
            what,
            first: sent,
            second: received + drops.unwrap_or(0),
            open: if drops.is_none() { Some("the system does not tell what the kernel dropped") } else { None },
        }
    }

    /// Whether it balances, as far as that can be told.
    #[must_use]
    pub const fn balances(&self) -> bool {
        self.open.is_some() || self.first == self.second
    }
}

impl fmt::Display for Account {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, first, second, open } = self;
        let sign = if first == second { "=" } else { "≠" };
        write!(f, "{what}: {first} {sign} {second}")?;
        open.map_or(Ok(()), |why| write!(f, " ({why})"))
    }
}

//! Tickets: secrets that replace the token for a single request.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::{Token, TokenError};

/// The valid ticket; `None` before the first is issued and after its use.
#[derive(Debug, Default)]
pub(crate) struct Ticket(Mutex<Option<Token>>);

impl Ticket {
    /// Issues a ticket. An earlier ticket becomes invalid.
    pub(crate) fn issue(&self) -> Result<Token, TokenError> {
        let ticket = Token::random()?;
        *self.lock() = Some(ticket.clone());
        Ok(ticket)
    }

    /// Returns whether `offered` is the valid ticket. The ticket is invalid afterwards.
    pub(crate) fn redeem(&self, offered: &[u8]) -> bool {
        let mut ticket = self.lock();
        let is_it = ticket.as_ref().is_some_and(|ticket| ticket.is(offered));
        // Used up under the same lock as the comparison, so that two requests at once cannot both succeed.
        if is_it {
            *ticket = None;
        }
        is_it
    }

    fn lock(&self) -> MutexGuard<'_, Option<Token>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::Ticket;

    #[test]
    fn a_ticket_is_worth_something_once_and_only_the_last_one_is() {
        let tickets = Ticket::default();
        assert!(!tickets.redeem(b""));
        let (old, new) = (tickets.issue().unwrap(), tickets.issue().unwrap());
        assert!(!tickets.redeem(old.secret().as_bytes()));
        assert!(tickets.redeem(new.secret().as_bytes()));
        assert!(!tickets.redeem(new.secret().as_bytes()));
    }
}

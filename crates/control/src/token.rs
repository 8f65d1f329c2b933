//! The secret shown by every request, and tickets: secrets that replace the token for a single request.

use core::fmt;
use core::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use subtle::ConstantTimeEq as _;
use thiserror::Error;

/// Length of a random token \[byte\]: 160 bits.
const RANDOM_BYTES: usize = 20;
/// Length of the shortest accepted token \[character\]: 22 random characters out of 64 have 132 bits.
const SHORTEST: usize = 22;
/// Length of the longest accepted token \[character\].
const LONGEST: usize = 256;

/// A secret that every request must show. The time of a comparison does not depend on the content, and [`fmt::Debug`] hides the secret.
#[derive(Clone)]
pub struct Token(String);

/// Error of making a token.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum TokenError {
    /// The token is too short to be secret, or too long for an address.
    #[error("a token of {found} characters: expected {SHORTEST} to {LONGEST}, random ones; leave it out to get one")]
    Length {
        /// Length of the refused token \[character\].
        found: usize,
    },
    /// The token has a character with a meaning in addresses.
    #[error("a token with {found:?}: expected letters, digits, '-', '.', '_' and '~' only, so that it can stand in an address")]
    Character {
        /// First forbidden character.
        found: char,
    },
    /// The system returned no random numbers.
    #[error("the system gives no random numbers for a token ({0}): give a token of your own")]
    NoRandomNumbers(String),
}

impl Token {
    /// Returns a token of 160 random bits from the system, as 40 hexadecimal digits.
    ///
    /// # Errors
    ///
    /// [`TokenError::NoRandomNumbers`] if the system returns no random numbers.
    pub fn random() -> Result<Self, TokenError> {
        let mut bytes = [0; RANDOM_BYTES];
        getrandom::fill(&mut bytes).map_err(|error| TokenError::NoRandomNumbers(error.to_string()))?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Returns the secret in clear, to be shown to its owner.
    #[must_use]
    pub fn secret(&self) -> &str {
        &self.0
    }

    /// Returns whether `offered` equals the secret. The time depends only on the length of `offered`.
    pub(crate) fn is(&self, offered: &[u8]) -> bool {
        self.0.as_bytes().ct_eq(offered).into()
    }
}

impl FromStr for Token {
    type Err = TokenError;

    fn from_str(text: &str) -> Result<Self, TokenError> {
        // The unreserved characters of RFC 3986, section 2.3, which need no escapes in an address.
        let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '_' | '~');
        // Checked before the length: afterwards each character is one byte.
        if let Some(found) = text.chars().find(|c| !allowed(*c)) {
            return Err(TokenError::Character { found });
        }
        if !(SHORTEST..=LONGEST).contains(&text.len()) {
            return Err(TokenError::Length { found: text.len() });
        }
        Ok(Self(text.to_owned()))
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(hidden)")
    }
}

/// Tokens of guests, in an order that tells guests apart. The run may replace the tokens at any time. Clones share the tokens.
#[derive(Clone, Debug, Default)]
pub struct Guests(Arc<Mutex<Vec<Token>>>);

impl Guests {
    /// Replaces all tokens. A request with an old token is refused, and a WebSocket that was opened with an old token ends.
    pub fn set(&self, tokens: Vec<Token>) {
        *self.lock() = tokens;
    }

    /// Returns the tokens.
    #[must_use]
    pub fn tokens(&self) -> Vec<Token> {
        self.lock().clone()
    }

    /// Returns the number of the guest whose token is `offered`; `None` if no guest has the token.
    pub(crate) fn find(&self, offered: &[u8]) -> Option<usize> {
        self.lock().iter().position(|token| token.is(offered))
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Token>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

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
    use super::{Guests, Ticket, Token, TokenError};

    #[test]
    fn random_tokens_differ_and_can_be_given_again() {
        let (one, other) = (Token::random().unwrap(), Token::random().unwrap());
        assert_ne!(one.secret(), other.secret());
        assert_eq!(one.secret().len(), 40);
        let again: Token = one.secret().parse().unwrap();
        assert!(again.is(one.secret().as_bytes()));
        assert!(!again.is(other.secret().as_bytes()));
    }

    #[test]
    fn a_part_or_more_of_a_token_is_not_it() {
        let token: Token = "0123456789abcdef~._-XY".parse().unwrap();
        assert!(token.is(b"0123456789abcdef~._-XY"));
        for wrong in [&b""[..], b"0123456789abcdef~._-X", b"0123456789abcdef~._-XYZ", b"0123456789abcdef~._-Xy"] {
            assert!(!token.is(wrong));
        }
    }

    #[test]
    fn what_is_no_token_is_refused() {
        assert_eq!("short".parse::<Token>().unwrap_err(), TokenError::Length { found: 5 });
        assert_eq!("a".repeat(257).parse::<Token>().unwrap_err(), TokenError::Length { found: 257 });
        assert_eq!("0123456789abcdef&0123456".parse::<Token>().unwrap_err(), TokenError::Character { found: '&' });
        assert_eq!("ä".repeat(22).parse::<Token>().unwrap_err(), TokenError::Character { found: 'ä' });
    }

    #[test]
    fn guests_are_told_apart_by_their_tokens_until_these_are_replaced() {
        let guests = Guests::default();
        let tokens = [(); 3].map(|()| Token::random().unwrap());
        assert_eq!(guests.find(tokens[0].secret().as_bytes()), None);
        guests.clone().set(tokens.to_vec());
        assert_eq!(tokens.each_ref().map(|token| guests.find(token.secret().as_bytes())), [Some(0), Some(1), Some(2)]);
        guests.set(vec![tokens[2].clone()]);
        assert_eq!(tokens.each_ref().map(|token| guests.find(token.secret().as_bytes())), [None, None, Some(0)]);
    }

    #[test]
    fn a_token_is_not_printed_by_accident() {
        let token: Token = "0123456789abcdef012345".parse().unwrap();
        assert!(!format!("{token:?}").contains("0123"));
    }

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

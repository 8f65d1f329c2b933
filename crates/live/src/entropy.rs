//! Where keys and nonces come from.

/// A source of bytes that nobody can guess and that never repeat.
pub trait Entropy {
    /// Fills `bytes`.
    ///
    /// # Errors
    ///
    /// [`EntropyError`] if the source has none to give. What stands in `bytes` then must not be used.
    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), EntropyError>;
}

/// The system could not give random bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("the system gives no random bytes, and without them nobody can join safely: {0}")]
pub struct EntropyError(#[from] getrandom::Error);

/// The random bytes of the operating system.
#[derive(Clone, Copy, Default, Debug)]
pub struct SystemEntropy;

impl Entropy for SystemEntropy {
    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), EntropyError> {
        Ok(getrandom::fill(bytes)?)
    }
}

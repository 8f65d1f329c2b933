//! Source of the random bytes for keys and nonces.

/// Source of random bytes that nobody can guess and that never repeat.
pub trait Entropy {
    /// Fills `bytes` with random bytes.
    ///
    /// # Errors
    ///
    /// [`EntropyError`] if the source has no random bytes. The content of `bytes` must not be used then.
    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), EntropyError>;
}

/// Error of the operating system when random bytes are drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("the system gives no random bytes, and without them nobody can join safely: {0}")]
pub struct EntropyError(#[from] getrandom::Error);

/// Random bytes of the operating system.
#[derive(Clone, Copy, Default, Debug)]
pub struct SystemEntropy;

impl Entropy for SystemEntropy {
    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), EntropyError> {
        Ok(getrandom::fill(bytes)?)
    }
}

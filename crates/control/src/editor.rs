//! What the HTTP side asks for.

/// Reads and changes the links of a run. Called on the thread of the server, one call at a time.
///
/// The implementor reads and checks what it is given and hands the change to the real-time side, which takes it up at an instant of its own.
/// Calls should take milliseconds at most: until they return nobody else is answered.
pub trait LinkEditor: Send {
    /// The keys that this link was told, each once, in any order, with their values as TOML text: `("delay", "\"40ms\"")`. A key at its default
    /// may be left out. The number is below that of the links in the [`Description`](crate::Description).
    fn keys(&self, link: usize) -> Vec<(String, String)>;

    /// Lays keys over those of each of these links, or changes nothing at all.
    ///
    /// `links` has at least one number, each below that of the links, none twice. Of `keys` there is at least one and none twice. A key is of ASCII
    /// letters, digits, `_` and `-`; a value is TOML text: `"40ms"` with its quotes, `0.01`, `{ packets = [3] }`.
    ///
    /// # Errors
    ///
    /// Why it cannot be, as it is shown to the user: which key, what was found, what was expected.
    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String>;
}

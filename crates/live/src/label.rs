//! Label of a peer's device: a short name that a hello carries for displays.

use core::fmt;

/// Length of the longest label \[byte\].
pub(crate) const LABEL_LEN: usize = 8;

/// Name of the kind of device at a peer elsewhere, such as `falcon`: at most eight printable ASCII characters without a space. The session shows the label. No
/// decision depends on the label.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
pub struct Label([u8; LABEL_LEN]);

impl Label {
    /// No label: the peer does not name its device.
    pub const NONE: Self = Self([0; LABEL_LEN]);

    /// Returns the label with the text `text`, or `None` if the text is longer than eight bytes or contains other bytes than printable ASCII characters. The
    /// empty text gives [`Label::NONE`].
    #[must_use]
    pub fn new(text: &str) -> Option<Self> {
        let mut bytes = [0; LABEL_LEN];
        bytes.get_mut(..text.len())?.copy_from_slice(text.as_bytes());
        Self::from_bytes(bytes)
    }

    /// Returns the label with these bytes: printable ASCII characters, padded by zeros. `None` for any other bytes.
    pub(crate) fn from_bytes(bytes: [u8; LABEL_LEN]) -> Option<Self> {
        let len = bytes.iter().position(|byte| *byte == 0).unwrap_or(LABEL_LEN);
        let (text, rest) = bytes.split_at(len);
        // The page and the terminal show the label, so control characters are refused.
        let sound = text.iter().all(u8::is_ascii_graphic) && rest.iter().all(|byte| *byte == 0);
        sound.then_some(Self(bytes))
    }

    pub(crate) const fn bytes(self) -> [u8; LABEL_LEN] {
        self.0
    }

    /// Returns the text of the label; `None` for [`Label::NONE`].
    #[must_use]
    pub fn text(&self) -> Option<&str> {
        let len = self.0.iter().position(|byte| *byte == 0).unwrap_or(LABEL_LEN);
        // Both constructors accept ASCII only.
        core::str::from_utf8(&self.0[..len]).ok().filter(|text| !text.is_empty())
    }
}

impl fmt::Debug for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Label").field(&self.text()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_is_at_most_eight_printable_characters() {
        for text in ["falcon", "inverse3", "x"] {
            assert_eq!(Label::new(text).and_then(|label| Label::from_bytes(label.bytes())).unwrap().text(), Some(text));
        }
        assert_eq!(Label::new(""), Some(Label::NONE));
        assert_eq!(Label::NONE.text(), None);
        for text in ["simulated", "a b", "a\n", "é", "a\0b"] {
            assert_eq!(Label::new(text), None, "{text:?}");
        }
        assert_eq!(Label::from_bytes(*b"a\0\0\0\0\0\0b"), None);
    }
}

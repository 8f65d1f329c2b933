//! The rows as those who read them meet them.

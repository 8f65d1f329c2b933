//! The words in which the catalogue is written.

use crate::reading::values::Quantity;

/// A table: its keys, and what may stand under names that the file makes up.
#[derive(Debug)]
pub struct Table {
    /// The keys, in the order in which they are explained. Several tables share a group.
    pub groups: &'static [&'static [Key]],
    /// What stands under any other name; `None`: nothing.
    pub others: Option<&'static Form>,
    /// Whether it is laid over another table: without a key, what that one says holds, and the default only where that says nothing.
    pub is_laid_over: bool,
}

impl Table {
    /// A table of one group of keys.
    #[must_use]
    pub const fn of(groups: &'static [&'static [Key]]) -> Self {
        Self { groups, others: None, is_laid_over: false }
    }

    /// A table of groups of keys that is laid over another one.
    #[must_use]
    pub const fn over(groups: &'static [&'static [Key]]) -> Self {
        Self { groups, others: None, is_laid_over: true }
    }

    /// A table of keys and of names that the file makes up.
    #[must_use]
    pub const fn with_others(groups: &'static [&'static [Key]], others: &'static Form) -> Self {
        Self { groups, others: Some(others), is_laid_over: false }
    }

    /// All keys.
    pub fn keys(&self) -> impl Iterator<Item = &'static Key> {
        self.groups.iter().copied().flatten()
    }

    /// The key of that name.
    #[must_use]
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys().find(|key| key.name == name)
    }
}

/// A key and what may stand under it.
#[derive(Debug)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// What it means, in one or two sentences without the last full stop.
    pub about: &'static str,
    /// Whether it must be given.
    pub need: Need,
    /// What may stand there.
    pub form: Form,
}

/// Whether a key must be given.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Need {
    /// It must.
    Required,
    /// It must, there or in a table that holds for all, such as `[peer]`.
    RequiredSomewhere,
    /// Without it, it is this: a value that is the same in TOML and in JSON.
    Default(&'static str),
    /// Without it, what it says is not there, or what `about` says.
    Optional,
}

/// What may stand under a key.
#[derive(Debug)]
pub enum Form {
    /// Any text.
    Text,
    /// The name of a file, relative to the folder of the file that names it.
    File,
    /// `true` or `false`.
    Boolean,
    /// A whole number between these, both included.
    Integer(u64, u64),
    /// A number.
    Number(Quantity),
    /// A number for each axis, or one number.
    Vector(Quantity),
    /// Three numbers.
    Triple(Quantity),
    /// A number and a unit of time, as text.
    Duration,
    /// A number and a unit of a rate, as text.
    Rate,
    /// A number and a unit of a size, as text.
    Size,
    /// A number from 0 to 1, or a text with a percent sign.
    Probability,
    /// A text of some other form, with examples.
    Like(&'static [&'static str]),
    /// One of a few words.
    Words(Words),
    /// A table.
    Table(&'static Table),
    /// A list.
    List(&'static Self),
    /// A list of exactly two.
    Pair(&'static Self),
    /// Any of these.
    AnyOf(&'static [Self]),
}

/// A few words, each with its meaning.
pub type Words = &'static [(&'static str, &'static str)];

impl Form {
    /// The unit of what stands there, if it is always the same.
    #[must_use]
    pub const fn unit(&self) -> &'static str {
        if let Self::Number(amount) | Self::Vector(amount) | Self::Triple(amount) = self { amount.unit() } else { "" }
    }
}

impl Form {
    /// The table that may stand there, if one may.
    #[must_use]
    pub fn table(&self) -> Option<&'static Table> {
        if let Self::Table(table) = self {
            Some(table)
        } else if let Self::AnyOf(forms) = self {
            forms.iter().find_map(Self::table)
        } else {
            None
        }
    }
}

/// A key that must be given.
#[must_use]
pub const fn required(name: &'static str, form: Form, about: &'static str) -> Key {
    Key { name, about, need: Need::Required, form }
}

/// A key that must be given there or in a table that holds for all.
#[must_use]
pub const fn somewhere(name: &'static str, form: Form, about: &'static str) -> Key {
    Key { name, about, need: Need::RequiredSomewhere, form }
}

/// A key with a default.
#[must_use]
pub const fn usual(name: &'static str, form: Form, default: &'static str, about: &'static str) -> Key {
    Key { name, about, need: Need::Default(default), form }
}

/// A key that may be left out.
#[must_use]
pub const fn optional(name: &'static str, form: Form, about: &'static str) -> Key {
    Key { name, about, need: Need::Optional, form }
}

/// A number with the unit and range of the reader.
#[must_use]
pub const fn number(quantity: Quantity) -> Form {
    Form::Number(quantity)
}

/// A number or a vector with the unit and range of the reader.
#[must_use]
pub const fn vector(quantity: Quantity) -> Form {
    Form::Vector(quantity)
}

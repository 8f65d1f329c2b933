//! Parameters as data: each with its key, form, unit, default and documentation.
//!
//! The file of a stage says its parameters in these words. This crate reads no files: readers, schemas, editors and pages of documentation take the parameters
//! from here.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;

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

/// Groups of keys one behind the other.
///
/// # Panics
///
/// If `M` is not the number of all groups; in a constant, that fails to compile.
#[must_use]
pub const fn joined<const M: usize>(parts: &[&[&'static [Key]]]) -> [&'static [Key]; M] {
    let mut all: [&'static [Key]; M] = [&[]; M];
    let (mut count, mut part) = (0, 0);
    while part < parts.len() {
        let mut group = 0;
        while group < parts[part].len() {
            all[count] = parts[part][group];
            count += 1;
            group += 1;
        }
        part += 1;
    }
    assert!(count == M);
    all
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

/// The range and the unit of a number.
#[derive(Clone, Copy, Debug)]
pub struct Quantity {
    range: Range,
    unit: &'static str,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Range {
    Any,
    NotNegative,
    Positive,
    Fraction,
    Correlation,
}

impl Quantity {
    /// Any number [unit].
    #[must_use]
    pub const fn any(unit: &'static str) -> Self {
        Self { range: Range::Any, unit }
    }

    /// At least zero [unit].
    #[must_use]
    pub const fn not_negative(unit: &'static str) -> Self {
        Self { range: Range::NotNegative, unit }
    }

    /// Above zero [unit].
    #[must_use]
    pub const fn positive(unit: &'static str) -> Self {
        Self { range: Range::Positive, unit }
    }

    /// In words: `a number above zero \[kg\]`.
    #[must_use]
    pub fn expected(self) -> String {
        let range = match self.range {
            Range::Any => "a number",
            Range::NotNegative => "a number of at least zero",
            Range::Positive => "a number above zero",
            Range::Fraction => "a number from 0 to 1",
            Range::Correlation => "a number from -1 to below 1",
        };
        if self.unit.is_empty() { range.to_owned() } else { format!("{range} [{}]", self.unit) }
    }

    /// The unit, as in messages; empty for a plain number.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        self.unit
    }

    /// The range as JSON Schema says it: keywords and bounds.
    #[must_use]
    pub const fn bounds(self) -> &'static [(&'static str, i8)] {
        match self.range {
            Range::Any => &[],
            Range::NotNegative => &[("minimum", 0)],
            Range::Positive => &[("exclusiveMinimum", 0)],
            Range::Fraction => &[("minimum", 0), ("maximum", 1)],
            Range::Correlation => &[("minimum", -1), ("exclusiveMaximum", 1)],
        }
    }

    /// Whether a number is in the range.
    #[must_use]
    pub fn contains(self, value: f64) -> bool {
        match self.range {
            Range::Any => true,
            Range::NotNegative => value >= 0.0,
            Range::Positive => value > 0.0,
            Range::Fraction => (0.0..=1.0).contains(&value),
            Range::Correlation => (-1.0..1.0).contains(&value),
        }
    }
}

/// At least zero, together with others.
pub const WEIGHT: Quantity = Quantity::not_negative("");
/// At least zero \[packet\].
pub const PACKETS: Quantity = Quantity::not_negative("packets");
/// From 0 to 1.
pub const FRACTION: Quantity = Quantity { range: Range::Fraction, unit: "" };
/// From −1 to below 1.
pub const CORRELATION: Quantity = Quantity { range: Range::Correlation, unit: "" };

/// The word that takes away a table below.
pub(crate) const NONE: Form = Form::Words(&[("none", "takes away what it is laid over")]);
/// The word that takes away a limit below.
pub(crate) const UNLIMITED: Form = Form::Words(&[("unlimited", "takes away the limit that it is laid over")]);
/// The largest integer of TOML.
pub(crate) const MOST: u64 = i64::MAX.unsigned_abs();
/// The largest integer of 32 bits.
pub(crate) const MOST_OF_32_BITS: u64 = u32::MAX as u64;

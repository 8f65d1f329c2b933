//! Declarations of parameters as data: key, form, unit, default and documentation.
//!
//! The source file of a stage declares each parameter of the stage once, with the types of this module. This crate reads no files: readers, schemas, editors
//! and pages of documentation take names, forms, units, ranges and defaults from the declaration.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// Declaration of a table: its keys, and the form of values under names chosen by the file.
#[derive(Debug)]
pub struct Table {
    /// Groups of keys, in the order of the reference. Several tables can share a group.
    pub(crate) groups: &'static [&'static [Key]],
    /// Function with further keys, made by a registry while the program runs. These keys come after the keys of the groups.
    pub(crate) made: Option<fn() -> &'static [Key]>,
    /// Form of the value under any further name, or `None` if further names are unknown keys.
    pub others: Option<&'static Form>,
    /// `true` if the table is laid over another table. A missing key then has the value of the table below, and the default only if the table below lacks the
    /// key too.
    pub is_laid_over: bool,
}

impl Table {
    /// Declares a table with groups of keys.
    #[must_use]
    pub const fn of(groups: &'static [&'static [Key]]) -> Self {
        Self { groups, made: None, others: None, is_laid_over: false }
    }

    /// Declares a table with groups of keys, laid over another table.
    #[must_use]
    pub const fn over(groups: &'static [&'static [Key]]) -> Self {
        Self { is_laid_over: true, ..Self::of(groups) }
    }

    /// Declares a table with groups of keys and with names chosen by the file, for values of the form `others`.
    #[must_use]
    pub const fn with_others(groups: &'static [&'static [Key]], others: &'static Form) -> Self {
        Self { others: Some(others), ..Self::of(groups) }
    }

    /// Adds the keys made by a registry, after the keys of the table.
    #[must_use]
    pub const fn and(self, made: fn() -> &'static [Key]) -> Self {
        Self { made: Some(made), ..self }
    }

    /// Returns all keys in order.
    pub fn keys(&self) -> impl Iterator<Item = &'static Key> {
        let made: &[Key] = self.made.map_or(&[], |made| made());
        self.groups.iter().copied().flatten().chain(made)
    }

    /// Returns the key with a name, or `None` if the table declares no such key.
    #[must_use]
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys().find(|key| key.name == name)
    }

    /// Returns the form of the value at a dotted path below the table, such as `loss.bursts.length`. In the path, an entry of a list is given by name or
    /// index. Returns `None` if nothing is declared at the path.
    #[must_use]
    pub fn form(&self, path: &str) -> Option<&'static Form> {
        let mut names = path.split('.');
        let first = self.form_of(names.next()?)?;
        names.try_fold(first, Form::within)
    }

    /// Returns the form of the value under a name of this table.
    fn form_of(&self, name: &str) -> Option<&'static Form> {
        // A declared key wins over the form of names chosen by the file.
        self.key(name).map(|key| &key.form).or(self.others)
    }

    /// Returns the table at a dotted path below this table.
    ///
    /// # Panics
    ///
    /// If no table is declared at the path.
    #[must_use]
    #[track_caller]
    pub fn table(&self, path: &str) -> &'static Self {
        self.form(path).and_then(Form::table).expect("a table is declared at the path")
    }
}

/// Concatenates lists of groups of keys.
///
/// # Panics
///
/// If `M` is not the number of all groups; a constant then fails to compile.
#[must_use]
pub const fn joined<const M: usize>(parts: &[&[&'static [Key]]]) -> [&'static [Key]; M] {
    // Loops instead of iterators, because iterators cannot run in a constant.
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

/// Declaration of a key and of its value.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// Name of the key.
    pub name: &'static str,
    /// Meaning of the key, in one or two sentences without the last full stop.
    pub about: &'static str,
    /// Need for the key in a file, and the default.
    pub need: Need,
    /// Form of the value.
    pub form: Form,
    /// Expected text in messages about a missing key or a wrong integer. `{}` stands for the expected text of the form; an empty text stands for `{}`.
    expected: &'static str,
}

impl Key {
    /// Sets the expected text of messages. `{}` in the text stands for the expected text of the form.
    #[must_use]
    pub const fn expecting(self, expected: &'static str) -> Self {
        Self { expected, ..self }
    }

    /// Returns the expected text of messages: `a number of peers, an integer from 2 to 1000000`.
    #[must_use]
    pub fn expected(&self) -> String {
        if self.expected.is_empty() { self.form.expected() } else { self.expected.replace("{}", &self.form.expected()) }
    }

    /// Returns range and unit of the numbers under the key.
    ///
    /// # Panics
    ///
    /// If the form is no number, vector or triple.
    #[must_use]
    #[track_caller]
    pub const fn quantity(&self) -> Quantity {
        self.form.quantity().expect("the key holds numbers")
    }
}

/// Need for a key in a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Need {
    /// The key must be given.
    Required,
    /// The key must be given in this table, or in a table for all such tables, such as `[peer]`.
    RequiredSomewhere,
    /// The key may be left out and then has this value, written such that TOML and JSON read the same value.
    Default(&'static str),
    /// The key may be left out. The feature is then absent, unless `about` gives another meaning.
    Optional,
}

/// Form of a value.
#[derive(Clone, Copy, Debug)]
pub enum Form {
    /// Any text.
    Text,
    /// The name of a file, relative to the folder of the naming file.
    File,
    /// `true` or `false`.
    Boolean,
    /// A whole number between two bounds, both included.
    Integer(u64, u64),
    /// A number.
    Number(Quantity),
    /// A number for each axis, or one number.
    Vector(Quantity),
    /// Three numbers.
    Triple(Quantity),
    /// A number and a unit of time, as text.
    Duration,
    /// A number and a unit of time above zero, as text.
    PositiveDuration,
    /// A number and a unit of a rate, as text.
    Rate,
    /// A number and a unit of a size, as text.
    Size,
    /// A number from 0 to 1, or a text with a percent sign.
    Probability,
    /// A text of some further form, with examples.
    Like(&'static [&'static str]),
    /// One of a few words.
    Words(Words),
    /// A table.
    Table(&'static Table),
    /// A list.
    List(&'static Self),
    /// A list of exactly two.
    Pair(&'static Self),
    /// A value of any of several forms.
    AnyOf(&'static [Self]),
}

/// Words of a choice, each with its meaning.
pub type Words = &'static [(&'static str, &'static str)];

/// Words of a choice, each with its value and its meaning: the declaration of a [`Form::Words`], with the values for a reader.
pub type Choices<T, const N: usize> = [(&'static str, T, &'static str); N];

/// Returns the words of choices with their meanings, without the values.
#[must_use]
pub const fn words<T, const N: usize>(choices: &Choices<T, N>) -> [(&'static str, &'static str); N] {
    let mut words = [("", ""); N];
    // A loop with an index, because iterators cannot run in a constant.
    let mut place = 0;
    while place < N {
        words[place] = (choices[place].0, choices[place].2);
        place += 1;
    }
    words
}

impl Form {
    /// Returns the unit of the numbers of this form, or an empty text for a plain number and for a form without a fixed unit.
    #[must_use]
    pub const fn unit(&self) -> &'static str {
        if let Some(quantity) = self.quantity() { quantity.unit() } else { "" }
    }

    /// Returns range and unit of the numbers of this form.
    const fn quantity(&self) -> Option<Quantity> {
        if let Self::Number(quantity) | Self::Vector(quantity) | Self::Triple(quantity) = self { Some(*quantity) } else { None }
    }
}

impl Form {
    /// Returns the expected text of messages: `an integer from 2 to 1000000`.
    #[must_use]
    pub(crate) fn expected(&self) -> String {
        match self {
            Self::Duration => "a duration such as \"8ms\"".to_owned(),
            Self::PositiveDuration => "a duration above zero such as \"8ms\"".to_owned(),
            Self::Rate => "a rate such as \"10Mbit\"".to_owned(),
            Self::Size => "a size such as \"1500B\"".to_owned(),
            Self::Probability => "a probability such as \"1%\"".to_owned(),
            Self::Number(quantity) | Self::Vector(quantity) => quantity.expected(),
            Self::Integer(least, most) => format!("an integer from {least} to {most}"),
            Self::Boolean => "true or false".to_owned(),
            Self::Words(words) => words.iter().map(|(word, _)| *word).collect::<Vec<_>>().join(", "),
            Self::Text | Self::File | Self::Triple(_) | Self::Like(_) | Self::Table(_) | Self::List(_) | Self::Pair(_) | Self::AnyOf(_) => {
                "a value".to_owned()
            }
        }
    }

    /// Returns the form of the value under a name within a value of this form: a key of a table, or an entry of a list.
    fn within(&'static self, name: &str) -> Option<&'static Self> {
        if let Self::List(element) = self {
            Some(element)
        } else if let Self::AnyOf(forms) = self {
            // A key of an allowed table comes before an entry of an allowed list, because a list matches every name.
            let key = forms.iter().find_map(|form| form.table()?.key(name));
            key.map(|key| &key.form).or_else(|| forms.iter().find_map(|form| form.within(name)))
        } else {
            self.table()?.form_of(name)
        }
    }

    /// Returns the first table among the forms of the value, or `None` if the value is never a table.
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

/// Declares a required key.
#[must_use]
pub const fn required(name: &'static str, form: Form, about: &'static str) -> Key {
    Key { name, about, need: Need::Required, form, expected: "" }
}

/// Declares a key required in the table, or in a table for all such tables.
#[must_use]
pub const fn somewhere(name: &'static str, form: Form, about: &'static str) -> Key {
    Key { name, about, need: Need::RequiredSomewhere, form, expected: "" }
}

/// Declares a key with a default.
#[must_use]
pub const fn usual(name: &'static str, form: Form, default: &'static str, about: &'static str) -> Key {
    Key { name, about, need: Need::Default(default), form, expected: "" }
}

/// Declares an optional key.
#[must_use]
pub const fn optional(name: &'static str, form: Form, about: &'static str) -> Key {
    Key { name, about, need: Need::Optional, form, expected: "" }
}

/// Returns the form of a number with the given range and unit.
#[must_use]
pub const fn number(quantity: Quantity) -> Form {
    Form::Number(quantity)
}

/// Returns the form of a number or a vector with the given range and unit.
#[must_use]
pub const fn vector(quantity: Quantity) -> Form {
    Form::Vector(quantity)
}

/// Range and unit of a number.
#[derive(Clone, Copy, Debug)]
pub struct Quantity {
    range: Range,
    /// Unit as in messages. Empty for a plain number.
    unit: &'static str,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Range {
    Any,
    /// At least 0.
    NotNegative,
    /// Above 0.
    Positive,
    /// From 0 to 1, both included.
    Fraction,
    /// From −1, included, to 1, excluded.
    Correlation,
}

impl Quantity {
    /// Returns the range of all numbers [unit].
    #[must_use]
    pub const fn any(unit: &'static str) -> Self {
        Self { range: Range::Any, unit }
    }

    /// Returns the range of numbers from zero on [unit].
    #[must_use]
    pub const fn not_negative(unit: &'static str) -> Self {
        Self { range: Range::NotNegative, unit }
    }

    /// Returns the range of numbers above zero [unit].
    #[must_use]
    pub const fn positive(unit: &'static str) -> Self {
        Self { range: Range::Positive, unit }
    }

    /// Returns the expected text of messages: `a number above zero \[kg\]`.
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

    /// Returns the unit as in messages. Empty for a plain number.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        self.unit
    }

    /// Returns the range as keywords of JSON Schema with their bounds.
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

    /// Returns whether a number is in the range.
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

/// Weight of one of several alternatives, at least 0.
pub const WEIGHT: Quantity = Quantity::not_negative("");
/// Number of packets, at least 0, not necessarily whole \[packet\].
pub(crate) const PACKETS: Quantity = Quantity::not_negative("packets");
/// Fraction from 0 to 1.
pub(crate) const FRACTION: Quantity = Quantity { range: Range::Fraction, unit: "" };
/// Correlation from −1 to below 1.
pub(crate) const CORRELATION: Quantity = Quantity { range: Range::Correlation, unit: "" };

/// Word that removes the table below the key.
pub(crate) const NONE: Form = Form::Words(&[("none", "takes away what it is laid over")]);
/// Word that removes the limit below the key.
pub(crate) const UNLIMITED: Form = Form::Words(&[("unlimited", "takes away the limit that it is laid over")]);
/// Largest integer of TOML.
pub(crate) const MOST: u64 = i64::MAX.unsigned_abs();
/// Largest integer of 32 bits.
pub(crate) const MOST_OF_32_BITS: u64 = u32::MAX as u64;

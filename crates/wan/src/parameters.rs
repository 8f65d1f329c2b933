//! Parameters as data: each with its key, form, unit, default and documentation.
//!
//! The file of a stage declares its parameters in these words, each once. This crate reads no files: readers, schemas, editors and pages of documentation take
//! names, forms, units, ranges and defaults from the declaration.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// A table: its keys, and what may stand under names that the file makes up.
#[derive(Debug)]
pub struct Table {
    /// The keys, in the order in which they are explained. Several tables share a group.
    pub groups: &'static [&'static [Key]],
    /// Keys after those of the groups, if a registry makes them when the program runs.
    pub made: Option<fn() -> &'static [Key]>,
    /// What stands under any other name; `None`: nothing.
    pub others: Option<&'static Form>,
    /// Whether it is laid over another table: without a key, what that one says holds, and the default only where that says nothing.
    pub is_laid_over: bool,
}

impl Table {
    /// A table of one group of keys.
    #[must_use]
    pub const fn of(groups: &'static [&'static [Key]]) -> Self {
        Self { groups, made: None, others: None, is_laid_over: false }
    }

    /// A table of groups of keys that is laid over another one.
    #[must_use]
    pub const fn over(groups: &'static [&'static [Key]]) -> Self {
        Self { is_laid_over: true, ..Self::of(groups) }
    }

    /// A table of keys and of names that the file makes up.
    #[must_use]
    pub const fn with_others(groups: &'static [&'static [Key]], others: &'static Form) -> Self {
        Self { others: Some(others), ..Self::of(groups) }
    }

    /// The table with the keys that a registry makes, after its own.
    #[must_use]
    pub const fn and(self, made: fn() -> &'static [Key]) -> Self {
        Self { made: Some(made), ..self }
    }

    /// All keys.
    pub fn keys(&self) -> impl Iterator<Item = &'static Key> {
        let made: &[Key] = self.made.map_or(&[], |made| made());
        self.groups.iter().copied().flatten().chain(made)
    }

    /// The key of that name.
    #[must_use]
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys().find(|key| key.name == name)
    }

    /// The form of the value at a dotted path below the table, such as `loss.bursts.length`. An entry of a list stands in the path by its name or its place.
    #[must_use]
    pub fn form(&self, path: &str) -> Option<&'static Form> {
        let mut names = path.split('.');
        let first = self.form_of(names.next()?)?;
        names.try_fold(first, Form::within)
    }

    fn form_of(&self, name: &str) -> Option<&'static Form> {
        self.key(name).map(|key| &key.form).or(self.others)
    }

    /// The table at a dotted path below this one.
    ///
    /// # Panics
    ///
    /// If no table is declared there.
    #[must_use]
    #[track_caller]
    pub fn table(&self, path: &str) -> &'static Self {
        self.form(path).and_then(Form::table).expect("a table is declared at the path")
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
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// What it means, in one or two sentences without the last full stop.
    pub about: &'static str,
    /// Whether it must be given.
    pub need: Need,
    /// What may stand there.
    pub form: Form,
    /// What a message expects where the key is missing or an integer is wrong, with `{}` for what the form expects. Empty: that alone.
    expected: &'static str,
}

impl Key {
    /// The key with other words for what a message expects; `{}` in them stands for what the form expects.
    #[must_use]
    pub const fn expecting(self, expected: &'static str) -> Self {
        Self { expected, ..self }
    }

    /// What a message expects: `a number of peers, an integer from 2 to 1000000`.
    #[must_use]
    pub fn expected(&self) -> String {
        if self.expected.is_empty() { self.form.expected() } else { self.expected.replace("{}", &self.form.expected()) }
    }

    /// The range and the unit of the numbers that may stand there.
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
#[derive(Clone, Copy, Debug)]
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
    /// Such a duration above zero.
    PositiveDuration,
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

/// Words with what each stands for and its meaning: the declaration of a [`Form::Words`] from which a reader takes the values too.
pub type Choices<T, const N: usize> = [(&'static str, T, &'static str); N];

/// The words of choices with their meanings.
#[must_use]
pub const fn words<T, const N: usize>(choices: &Choices<T, N>) -> [(&'static str, &'static str); N] {
    let mut words = [("", ""); N];
    let mut place = 0;
    while place < N {
        words[place] = (choices[place].0, choices[place].2);
        place += 1;
    }
    words
}

impl Form {
    /// The unit of what stands there, if it is always the same.
    #[must_use]
    pub const fn unit(&self) -> &'static str {
        if let Some(quantity) = self.quantity() { quantity.unit() } else { "" }
    }

    const fn quantity(&self) -> Option<Quantity> {
        if let Self::Number(quantity) | Self::Vector(quantity) | Self::Triple(quantity) = self { Some(*quantity) } else { None }
    }
}

impl Form {
    /// What a message expects: `an integer from 2 to 1000000`.
    #[must_use]
    pub fn expected(&self) -> String {
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

    /// The form of the value under a name within the value: a key of a table, or an entry of a list.
    fn within(&'static self, name: &str) -> Option<&'static Self> {
        if let Self::List(element) = self {
            Some(element)
        } else if let Self::AnyOf(forms) = self {
            // A key of a table that may stand there is no entry of a list that may.
            let key = forms.iter().find_map(|form| form.table()?.key(name));
            key.map(|key| &key.form).or_else(|| forms.iter().find_map(|form| form.within(name)))
        } else {
            self.table()?.form_of(name)
        }
    }

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
    Key { name, about, need: Need::Required, form, expected: "" }
}

/// A key that must be given there or in a table that holds for all.
#[must_use]
pub const fn somewhere(name: &'static str, form: Form, about: &'static str) -> Key {
    Key { name, about, need: Need::RequiredSomewhere, form, expected: "" }
}

/// A key with a default.
#[must_use]
pub const fn usual(name: &'static str, form: Form, default: &'static str, about: &'static str) -> Key {
    Key { name, about, need: Need::Default(default), form, expected: "" }
}

/// A key that may be left out.
#[must_use]
pub const fn optional(name: &'static str, form: Form, about: &'static str) -> Key {
    Key { name, about, need: Need::Optional, form, expected: "" }
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

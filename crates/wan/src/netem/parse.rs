//! Reading of words into [`Netem`].
//!
//! An option may be shortened as in `tc`: a word means the first option in the order of [`KEYWORDS`] that begins with the word. An optional value is read if
//! the next word begins with a digit (or with a minus, for a possibly negative overhead).

use alloc::string::ToString;
use alloc::vec::Vec;
use core::iter::Peekable;
use core::num::NonZeroU32;
use core::ops::Range;
use core::time::Duration;

use super::cross::MOST_SOURCES;
use super::number::{self, PERCENT, Plain, RATE, TIME};
use super::{
    CellSpec, ChanceSpec, Contradiction, CrossSource, CrossSpec, DelaySpec, Distribution, FramingSpec, GemodelSpec, JitterSpec, LossSpec, Netem,
    NetemError, NetemErrorKind, Percent, RateSpec, ReorderSpec, SlotGap, SlotSpec, StateSpec,
};

/// Full name of an option, also in messages.
type Keyword = &'static str;

/// Words for options in the order of the comparisons of `tc`, and the option of each. So `l` is `limit`, `d` is `delay`, `r` is `reorder`, and `s` is
/// `seed`. Options that `tc` does not know come last, so that each shortened word of `tc` keeps its meaning.
const KEYWORDS: [(&str, Keyword); 15] = [
    ("limit", "limit"),
    ("latency", "delay"),
    ("delay", "delay"),
    ("loss", "loss"),
    ("drop", "loss"),
    ("seed", "seed"),
    ("ecn", "ecn"),
    ("reorder", "reorder"),
    ("corrupt", "corrupt"),
    ("gap", "gap"),
    ("duplicate", "duplicate"),
    ("distribution", "distribution"),
    ("rate", "rate"),
    ("slot", "slot"),
    ("cross", "cross"),
];

const COUNT: &str = "a count of packets from 0 to 4294967295";
const NAME: &str = "the name of a distribution: uniform, normal, pareto, paretonormal or that of a table";
const SLOT: &str = "a time such as 800us, or distribution NAME DELAY JITTER";
const SLOT_COUNT: &str = "a number from 1 to 2147483647";
const GAP: &str = "a number of packets from 1 to 4294967295";
const OVERHEAD: &str = "a number of bytes from -2147483648 to 2147483647";
const CELL: &str = "a cell size from 1 to 4294967295 bytes";
const CROSS: &str = "poisson RATE or on-off SOURCES PEAK ON OFF [SHAPE]";
const SOURCES: &str = "a number of sources from 1 to 65536";
const SPAN: &str = "a time above zero such as 200ms (units: s, ms, us, ns)";
const SHAPE: &str = "a shape above 1 and below 2 such as 1.5";
const SIZE: &str = "a size from 1 to 4294967295 bytes such as 1500";
const SEED: &str = "a decimal number from 0 to 18446744073709551615";

impl Netem {
    /// Reads the options of a netem, in any order: the words after `netem` in a command for `tc`.
    ///
    /// The reader is stricter than `tc`. Nothing may be given twice. Negative times, sizes and counts are refused, and so are zeros that would switch off an
    /// impairment (`gap 0`, a cell of 0, `rate 0`), rates below a byte per second, and chains whose ways out of a state sum to more than 1. Times and
    /// percentages other than zero need their units: `delay 20` is 20 µs for iproute2 6.6 and 20 ns from 6.9 on, and `loss 1` is 1 % where the number 1 in a
    /// scene is 100 %. In two points the reader is more lenient: `packets` and `bytes` of a slot may stand in either order, and `ns` is a unit of `delay` (as
    /// in iproute2 from 6.9 on).
    ///
    /// # Errors
    ///
    /// [`NetemError`], with the place of the faulty word.
    pub fn parse(input: &str) -> Result<Self, NetemError> {
        let mut parser =
            Parser { words: words(input).peekable(), last: 0..0, seen: Vec::new(), netem: Self::default(), distribution: None, gap: None };
        while let Some(word) = parser.words.next() {
            parser.option(word)?;
        }
        parser.finish()
    }
}

/// A word and its byte range in the input.
struct Word<'a> {
    text: &'a str,
    span: Range<usize>,
}

/// Splits a text into words at white space.
fn words(input: &str) -> impl Iterator<Item = Word<'_>> {
    let mut rest = 0;
    core::iter::from_fn(move || {
        let start = rest + input[rest..].find(|c: char| !c.is_whitespace())?;
        let end = input[start..].find(char::is_whitespace).map_or(input.len(), |length| start + length);
        rest = end;
        Some(Word { text: &input[start..end], span: start..end })
    })
}

/// Word that the error of a contradiction marks.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Option(Keyword),
    Probability(usize),
    SlotMax,
    SlotJitter,
}

struct Parser<'a, W: Iterator<Item = Word<'a>>> {
    words: Peekable<W>,
    /// Byte range of the latest word read.
    last: Range<usize>,
    /// Words for the error of a contradiction to point at, with their byte ranges.
    seen: Vec<(Place, Range<usize>)>,
    netem: Netem,
    /// Value of `distribution`, possibly given before its delay.
    distribution: Option<Distribution>,
    /// Value of `gap`, possibly given before its `reorder`.
    gap: Option<NonZeroU32>,
}

impl<'a, W: Iterator<Item = Word<'a>>> Parser<'a, W> {
    fn option(&mut self, word: Word<'a>) -> Result<(), NetemError> {
        let Some(&(_, option)) = KEYWORDS.iter().find(|(name, _)| name.starts_with(word.text)) else {
            return Err(NetemError { kind: NetemErrorKind::UnknownWord { word: word.text.to_string() }, span: word.span });
        };
        // Synonyms have one name in `KEYWORDS`, so `drop` after `loss` is a repetition too.
        if self.seen.iter().any(|(place, _)| *place == Place::Option(option)) {
            return Err(NetemError { kind: NetemErrorKind::Repeated { option }, span: word.span });
        }
        self.last = word.span;
        self.mark(Place::Option(option));
        match option {
            "limit" => self.netem.limit = Some(self.value(option, COUNT, number::size)?),
            "delay" => self.netem.delay = Some(self.delay()?),
            "loss" => self.netem.loss = Some(self.loss()?),
            "seed" => self.netem.seed = Some(self.value(option, SEED, number::decimal)?),
            "ecn" => self.netem.ecn = true,
            "reorder" => self.netem.reorder = Some(ReorderSpec { chance: self.chance(option)?, gap: None }),
            "corrupt" => self.netem.corrupt = Some(self.chance(option)?),
            "gap" => self.gap = Some(self.value(option, GAP, count)?),
            "duplicate" => self.netem.duplicate = Some(self.chance(option)?),
            "distribution" => self.distribution = Some(self.value(option, NAME, Distribution::named)?),
            "rate" => self.netem.rate = Some(self.rate()?),
            "cross" => self.netem.cross = Some(self.cross()?),
            // `slot`, the only option left in the table.
            _ => self.netem.slot = Some(self.slot()?),
        }
        Ok(())
    }

    /// Moves values into their options, and checks the whole.
    fn finish(mut self) -> Result<Netem, NetemError> {
        // `distribution` and `gap` may stand anywhere in the words, so their options are known only now.
        if let Some(distribution) = self.distribution.take() {
            match self.netem.delay.as_mut().and_then(|delay| delay.jitter.as_mut()) {
                Some(jitter) => jitter.distribution = Some(distribution),
                None => return Err(self.blame(Contradiction::DistributionWithoutJitter)),
            }
        }
        if let Some(gap) = self.gap {
            match self.netem.reorder.as_mut() {
                Some(reorder) => reorder.gap = Some(gap),
                None => return Err(self.blame(Contradiction::GapWithoutReorder)),
            }
        }
        self.netem.check().map_err(|contradiction| self.blame(contradiction))?;
        Ok(self.netem)
    }

    fn delay(&mut self) -> Result<DelaySpec, NetemError> {
        let mut delay = DelaySpec { time: self.time("delay", TIME, Plain::Delay)?, jitter: None };
        // A second time without a word before is the jitter.
        if self.number_follows() {
            let jitter = self.time("delay", TIME, Plain::Delay)?;
            delay.jitter = Some(JitterSpec { time: jitter, correlation: self.optional_percent("delay")?, distribution: None });
        }
        Ok(delay)
    }

    fn chance(&mut self, option: Keyword) -> Result<ChanceSpec, NetemError> {
        let percent = self.percent(option)?;
        Ok(ChanceSpec { percent, correlation: self.optional_percent(option)? })
    }

    fn loss(&mut self) -> Result<LossSpec, NetemError> {
        // `random` is the usual model and may be left out.
        match self.words.peek().map(|word| word.text) {
            Some("state") => {
                self.skip();
                let [p13, p31, p32, p23, p14] = self.probabilities::<5>()?;
                Ok(LossSpec::State(StateSpec { p13: p13.unwrap_or_default(), p31, p32, p23, p14 }))
            }
            Some("gemodel") => {
                self.skip();
                let [p, r, loss_in_bad, loss_in_good] = self.probabilities::<4>()?;
                Ok(LossSpec::Gemodel(GemodelSpec { p: p.unwrap_or_default(), r, loss_in_bad, loss_in_good }))
            }
            Some("random") => {
                self.skip();
                Ok(LossSpec::Random(self.chance("loss")?))
            }
            Some(_) | None => Ok(LossSpec::Random(self.chance("loss")?)),
        }
    }

    /// Reads the first probability, required, and further probabilities as long as numbers follow.
    fn probabilities<const N: usize>(&mut self) -> Result<[Option<Percent>; N], NetemError> {
        let mut said = [None; N];
        said[0] = Some(self.percent("loss")?);
        for (index, percent) in said.iter_mut().enumerate().skip(1) {
            *percent = self.optional_percent("loss")?;
            // A probability can be given only after all probabilities before it.
            if percent.is_none() {
                break;
            }
            self.mark(Place::Probability(index));
        }
        Ok(said)
    }

    fn rate(&mut self) -> Result<RateSpec, NetemError> {
        let bytes_per_sec = self.value("rate", RATE, number::rate)?;
        let overhead = |text: &str| i32::try_from(number::signed(text)?).ok();
        let framing = match self.optional_signed("rate", OVERHEAD, overhead)? {
            None => None,
            Some(bytes) => {
                // A minus here would be the overhead of a cell without a size. The reader of the size refuses the minus.
                let cell = match self.optional_signed("rate", CELL, count)? {
                    None => None,
                    Some(size) => Some(CellSpec { size, overhead: self.optional_signed("rate", OVERHEAD, overhead)? }),
                };
                Some(FramingSpec { overhead: bytes, cell })
            }
        };
        Ok(RateSpec { bytes_per_sec, framing })
    }

    fn cross(&mut self) -> Result<CrossSpec, NetemError> {
        let kind = self.value("cross", CROSS, |text| ["poisson", "on-off"].into_iter().find(|kind| *kind == text))?;
        let source = if kind == "poisson" {
            CrossSource::Poisson { bytes_per_sec: self.value("cross", RATE, number::rate)? }
        } else {
            let sources = self.value("cross", SOURCES, |text| count(text).filter(|sources| sources.get() <= MOST_SOURCES))?;
            let peak = self.value("cross", RATE, number::rate)?;
            let [on, off] = [self.span()?, self.span()?];
            let is_shape = |shape: &f64| *shape > 1.0 && *shape < 2.0;
            let shape =
                if self.number_follows() { Some(self.value("cross", SHAPE, |text| number::real_number(text).filter(is_shape))?) } else { None };
            CrossSource::OnOff { sources, peak, on, off, shape }
        };
        // Not shortened, because `s` is `seed`.
        let size = if self.words.peek().is_some_and(|word| word.text == "size") {
            self.skip();
            Some(self.value("cross", SIZE, |text| number::size(text).and_then(NonZeroU32::new))?)
        } else {
            None
        };
        Ok(CrossSpec { source, size })
    }

    /// Reads the mean of a span of sources of cross packets.
    fn span(&mut self) -> Result<Duration, NetemError> {
        self.with_unit("cross", SPAN, Plain::Cross, |text| number::time(text).filter(|span| !span.is_zero()))
    }

    fn slot(&mut self) -> Result<SlotSpec, NetemError> {
        let gap = if self.words.peek().is_some_and(|word| word.text == "distribution") {
            self.skip();
            let distribution = self.value("slot", NAME, Distribution::named)?;
            let delay = self.time("slot", TIME, Plain::Slot)?;
            let jitter = self.time("slot", TIME, Plain::Slot)?;
            self.mark(Place::SlotJitter);
            SlotGap::Drawn { distribution, delay, jitter }
        } else {
            let min = self.time("slot", SLOT, Plain::Slot)?;
            let max = if self.number_follows() { Some(self.time("slot", TIME, Plain::Slot)?) } else { None };
            self.mark(Place::SlotMax);
            SlotGap::Range { min, max }
        };
        let mut slot = SlotSpec { gap, packets: None, bytes: None };
        while let Some(word) = self.words.peek() {
            // The empty word does not occur, so a prefix has at least one letter.
            let budget = ["packets", "bytes"].into_iter().find(|name| name.starts_with(word.text));
            let Some(option) = budget else { break };
            let said = if option == "packets" { slot.packets } else { slot.bytes };
            if said.is_some() {
                return Err(NetemError { kind: NetemErrorKind::Repeated { option }, span: word.span.clone() });
            }
            self.skip();
            // The kernel counts both budgets in signed 32 bits.
            let countable = |count: NonZeroU32| (count.get() <= i32::MAX.unsigned_abs()).then_some(count);
            if option == "packets" {
                slot.packets = Some(self.value("packets", SLOT_COUNT, |text| count(text).and_then(countable))?);
            } else {
                slot.bytes = Some(self.value("bytes", SLOT_COUNT, |text| number::size(text).and_then(NonZeroU32::new).and_then(countable))?);
            }
        }
        Ok(slot)
    }

    /// Reads the next word with `read`. At the end of the words the error is a missing value, and after `None` from `read` a wrong value.
    fn value<V>(&mut self, option: Keyword, expected: &'static str, read: impl Fn(&str) -> Option<V>) -> Result<V, NetemError> {
        let Some(word) = self.words.next() else {
            return Err(NetemError { kind: NetemErrorKind::Missing { option, expected }, span: self.last.clone() });
        };
        self.last = word.span.clone();
        read(word.text).ok_or_else(|| NetemError { kind: NetemErrorKind::Value { option, word: word.text.to_string(), expected }, span: word.span })
    }

    /// Reads the next word as a time with a unit.
    fn time(&mut self, option: Keyword, expected: &'static str, kind: Plain) -> Result<Duration, NetemError> {
        self.with_unit(option, expected, kind, number::time)
    }

    /// Reads the next word as a percentage with its sign.
    fn percent(&mut self, option: Keyword) -> Result<Percent, NetemError> {
        self.with_unit(option, PERCENT, Plain::Percentage, number::percent)
    }

    /// Reads the next word as a percentage if the word begins with a digit.
    fn optional_percent(&mut self, option: Keyword) -> Result<Option<Percent>, NetemError> {
        if self.number_follows() { self.percent(option).map(Some) } else { Ok(None) }
    }

    /// Reads the next word like `value`, and refuses a number without unit if notations differ.
    fn with_unit<V>(&mut self, option: Keyword, expected: &'static str, kind: Plain, read: impl Fn(&str) -> Option<V>) -> Result<V, NetemError> {
        let text = self.words.peek().map_or("", |word| word.text);
        let value = self.value(option, expected, read)?;
        let no_unit = |readings| NetemError { kind: NetemErrorKind::NoUnit { option, word: text.to_string(), readings }, span: self.last.clone() };
        number::without_unit(text, kind).map_or(Ok(value), |readings| Err(no_unit(readings)))
    }

    /// Returns whether the next word begins with a digit, like optional values.
    fn number_follows(&mut self) -> bool {
        self.words.peek().is_some_and(|word| word.text.starts_with(|c: char| c.is_ascii_digit()))
    }

    /// Reads the next word if the word begins with a digit or a minus, and is then required to be a value.
    fn optional_signed<V>(&mut self, option: Keyword, expected: &'static str, read: impl Fn(&str) -> Option<V>) -> Result<Option<V>, NetemError> {
        let follows = self.words.peek().is_some_and(|word| word.text.starts_with(|c: char| c.is_ascii_digit() || c == '-'));
        if follows { self.value(option, expected, read).map(Some) } else { Ok(None) }
    }

    fn skip(&mut self) {
        if let Some(word) = self.words.next() {
            self.last = word.span;
        }
    }

    fn mark(&mut self, place: Place) {
        self.seen.push((place, self.last.clone()));
    }

    /// Returns the error of a contradiction. The error points at the last word of the contradiction, or at the last word read if no word belongs to it.
    fn blame(&self, contradiction: Contradiction) -> NetemError {
        let places: &[Place] = match contradiction {
            Contradiction::ReorderWithoutDelay => &[Place::Option("reorder")],
            Contradiction::GapWithoutReorder => &[Place::Option("gap")],
            Contradiction::EcnWithoutLoss => &[Place::Option("ecn")],
            Contradiction::DistributionWithoutJitter => &[Place::Option("distribution")],
            Contradiction::WaysOutOfState1 => &[Place::Probability(4)],
            Contradiction::WaysOutOfState3 => &[Place::Probability(2)],
            Contradiction::SlotRange => &[Place::SlotMax],
            Contradiction::SlotWithoutJitter => &[Place::SlotJitter],
            Contradiction::CrossWithoutRate | Contradiction::CrossFillsLine | Contradiction::CrossTooDense | Contradiction::CrossSpans => {
                &[Place::Option("cross")]
            }
            // The parser refuses these values word by word, so no text leads here.
            Contradiction::ProbabilitySkipped
            | Contradiction::SlotTooLarge
            | Contradiction::TimeTooLong
            | Contradiction::CrossShape
            | Contradiction::CrossSources
            | Contradiction::CrossInKernel => &[],
        };
        let at = self.seen.iter().find(|(place, _)| places.contains(place));
        let span = at.map_or_else(|| self.last.clone(), |(_, span)| span.clone());
        NetemError { kind: contradiction.into(), span }
    }
}

/// Reads an integer above zero.
fn count(text: &str) -> Option<NonZeroU32> {
    NonZeroU32::new(u32::try_from(number::unsigned(text)?).ok()?)
}

//! Links of the library of links, by name, with factors and keys that change a link.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
#[cfg(feature = "strategies")]
use std::ops::RangeInclusive;
use std::sync::Arc;

use cohaptic_linkfile::library::{Direction, Profile, ProfileName, of_owner};
use cohaptic_linkfile::link_from_keys;
use cohaptic_units::parse;
use cohaptic_wan::LinkModel;

use crate::access::AccessLines;

/// A link of the library, such as `starlink`, `starlink@1/up`, `lte-driving delay*1.4` or `starlink queue.discipline=codel`.
///
/// Links of one kind differ: two phones in two cars have different delays. A factor such as `delay*1.4` gives the place of a link between the extremes. The
/// factor multiplies the number of the key in both directions, or in the only direction for which the library has bounds of the key. A factor has at most
/// three decimal places. The strategy [`links_like`](crate::strategies::links_like) draws factors (feature `strategies`).
///
/// A key with a value, such as `rate=2Mbit` or `queue={ limit = '250 packets', discipline = 'fq-codel' }`, is laid over the link in both directions and at any
/// time, with the meaning of `[link]` in a scene. A value may have white space within quotes, braces and brackets.
///
/// `Display` prints the name with its version. `Debug` prints the same text as a literal, because [`Testbed::access`](crate::Testbed::access) and
/// [`Testbed::links`](crate::Testbed::links) take such a text.
#[derive(Clone)]
pub struct LibraryLink {
    profile: Arc<Profile>,
    /// Direction, if the name has one.
    direction: Option<Direction>,
    /// Factors in thousandths, by key. The factor 1 is not stored.
    factors: BTreeMap<String, u64>,
    /// Keys with their values, `KEY=VALUE`, in the order of laying over the link.
    laid: Vec<String>,
    /// Text of the name.
    text: String,
}

/// The factor 1.
pub(crate) const ONE: u64 = 1000;

impl LibraryLink {
    /// Parses a name. Returns `None` if the text does not begin with the name of a link of the library, and an error if the text goes on wrongly.
    pub(crate) fn parse(text: &str) -> Option<Result<Self, String>> {
        let words = words(text);
        let name = words.first()?.parse::<ProfileName>().ok()?;
        Some(Self::with_words(name, &words[1..]))
    }

    /// Parses a name, and refuses every other text.
    pub(crate) fn expect(text: &str) -> Result<Self, String> {
        let words = words(text);
        let (first, rest) = words.split_first().unwrap_or((&"", &[]));
        let name = first.parse::<ProfileName>().map_err(|error| error.to_string())?;
        Self::with_words(name, rest)
    }

    fn with_words(name: ProfileName, words: &[&str]) -> Result<Self, String> {
        let (profile, direction) = (Arc::new(name.profile), name.direction);
        let mut link = Self { profile, direction, factors: BTreeMap::new(), laid: Vec::new(), text: String::new() };
        // Values are sorted out first, because a key with a value must have no factor, and the words may come in any order.
        let (laid, factors): (Vec<&str>, Vec<&str>) = words.iter().copied().partition(|word| key_with_value(word).is_some());
        link.laid = laid.into_iter().map(str::to_owned).collect();
        for word in factors {
            let factor = word.split_once('*').and_then(|(key, factor)| Some((key, thousandths(factor)?)));
            let Some((key, factor)) = factor else {
                return Err(format!(
                    "`{word}` is not a factor: expected a key and a number above 0 with at most three decimal places, such as delay*1.4, or a key with its value, \
                     such as rate=2Mbit"
                ));
            };
            if link.is_laid(key) {
                return Err(format!("{key} has a factor and a value: expected one of them"));
            }
            if link.directions(key).next().is_none() {
                let known: Vec<&str> = link.keys().collect();
                let expected = if known.is_empty() { "the name alone".to_owned() } else { format!("a factor of {}", known.join(" or ")) };
                return Err(format!(
                    "the library does not say how the {key} of {} differs from link to link: expected {expected}",
                    link.profile.title()
                ));
            }
            link.factors.insert(key.to_owned(), factor);
        }
        Ok(link.named())
    }

    /// Sets the text of the name.
    fn named(mut self) -> Self {
        // A factor of 1 changes nothing. Without the removal two equal links would have different names.
        self.factors.retain(|_, factor| *factor != ONE);
        self.text = self.profile.title();
        // Writing to a `String` cannot fail.
        if let Some(direction) = self.direction {
            let _ = write!(self.text, "/{}", direction.word());
        }
        for (key, factor) in &self.factors {
            #[expect(clippy::cast_precision_loss, reason = "a factor has few digits")]
            let factor = *factor as f64 / ONE as f64;
            let _ = write!(self.text, " {key}*{factor}");
        }
        for word in &self.laid {
            let _ = write!(self.text, " {word}");
        }
        self
    }

    /// Returns whether the key has a value that is laid over the link.
    fn is_laid(&self, key: &str) -> bool {
        self.laid.iter().any(|word| key_with_value(word).is_some_and(|laid| laid == key))
    }

    /// Returns the directions with bounds for the key, and the bounds. In these directions the key differs from link to link.
    fn directions<'a>(&'a self, key: &'a str) -> impl Iterator<Item = (Direction, &'a [String; 2])> {
        Direction::BOTH.into_iter().filter_map(move |direction| Some((direction, self.profile.line(direction).between.get(key)?)))
    }

    /// Returns the keys that differ from link to link, sorted, without the keys whose value is laid over the link.
    fn keys(&self) -> impl Iterator<Item = &str> {
        let keys: std::collections::BTreeSet<&str> =
            Direction::BOTH.iter().flat_map(|direction| self.profile.line(*direction).between.keys()).map(String::as_str).collect();
        keys.into_iter().filter(|key| !self.is_laid(key))
    }

    /// Returns the model of the link in one direction.
    ///
    /// # Errors
    ///
    /// If a factor makes a number too large for its key, or a key or a value that is laid over the link means nothing.
    fn model(&self, direction: Direction) -> Result<LinkModel, String> {
        let mut keys = vec![format!("profile={}/{}", self.profile.title(), direction.word())];
        for (key, factor) in &self.factors {
            // A factor applies only to directions in which the library has bounds for the key; the other direction keeps its number.
            if self.directions(key).any(|(known, _)| known == direction) {
                let scaled = self.quantity(direction, key).and_then(|quantity| quantity.times(*factor)).ok_or("the factor is too large")?;
                keys.push(format!("{key}={scaled}"));
            }
        }
        keys.extend(self.laid.iter().cloned());
        link_from_keys(&keys).map_err(|error| error.to_string())
    }

    /// Returns the number of a key in one direction.
    fn quantity(&self, direction: Direction, key: &str) -> Option<Quantity> {
        let keys = self.profile.line(direction).keys();
        keys.iter().find(|(known, _)| *known == key).and_then(|(_, value)| Quantity::read(value.trim_matches('"')))
    }

    /// Returns the model of the link between two hosts.
    pub(crate) fn one_way(&self) -> Result<LinkModel, String> {
        let name = &self.profile.name;
        match self.direction {
            Some(direction) => self.model(direction),
            None if self.profile.is_symmetric() => self.model(Direction::Down),
            None => Err(format!(
                "{name} differs by direction: expected {name}/down, towards the user, or {name}/up; or `access` of a host, which has both"
            )),
        }
    }

    /// Returns the access lines of a host, in each of which a modulator of the library is the host's own.
    pub(crate) fn both_ways(&self, host: &str) -> Result<AccessLines, String> {
        if self.direction.is_some() {
            return Err(format!("an access line has both directions: expected the name without a direction, {}", self.profile.title()));
        }
        let line = |direction| self.model(direction).map(|link| Some(Arc::unwrap_or_clone(of_owner(Arc::new(link), host))));
        Ok(AccessLines { uplink: line(Direction::Up)?, downlink: line(Direction::Down)? })
    }
}

#[cfg(feature = "strategies")]
impl LibraryLink {
    /// Returns the keys that differ from link to link, each with the range of the factor in thousandths. The range comes from the first direction, because the
    /// profiles have the same range for both directions.
    pub(crate) fn ranges(&self) -> BTreeMap<String, RangeInclusive<u64>> {
        let range = |key: &str| {
            let (direction, bounds) = self.directions(key).next()?;
            let usual = self.quantity(direction, key)?.count;
            let [low, high] = bounds.each_ref().map(|bound| Some(u128::from(Quantity::read(bound)?.count) * u128::from(ONE)));
            // Rounded towards the inside, because the strategy must stay between the bounds.
            let low = low?.div_ceil(usual.into());
            let high = high? / u128::from(usual);
            Some(u64::try_from(low).ok()?..=u64::try_from(high).ok()?)
        };
        self.keys().filter_map(|key| Some((key.to_owned(), range(key)?))).collect()
    }

    /// Returns the factor of a key, in thousandths.
    pub(crate) fn factor(&self, key: &str) -> u64 {
        self.factors.get(key).copied().unwrap_or(ONE)
    }

    /// Returns the link with another factor of a key, in thousandths.
    pub(crate) fn with_factor(&self, key: &str, factor: u64) -> Self {
        let mut link = self.clone();
        link.factors.insert(key.to_owned(), factor);
        link.named()
    }
}

/// Number of a key with its unit.
#[derive(Clone, Copy, Debug)]
struct Quantity {
    /// Nanoseconds, or bits per second.
    count: u64,
    unit: &'static str,
}

impl Quantity {
    /// Reads a time or a rate.
    fn read(text: &str) -> Option<Self> {
        let time = || Some(Self { count: u64::try_from(parse::duration(text).ok()?.as_nanos()).ok()?, unit: "ns" });
        let rate = || Some(Self { count: parse::rate(text).ok()?.as_bits_per_sec(), unit: "bit" });
        // The units of times and rates differ, so at most one of the two readings succeeds.
        time().or_else(rate)
    }

    /// Returns the quantity times a factor in thousandths, as the value of a key.
    fn times(self, factor: u64) -> Option<String> {
        // Half of the divisor is added, so that the division rounds to the nearest number.
        let scaled = u64::try_from((u128::from(self.count) * u128::from(factor) + u128::from(ONE / 2)) / u128::from(ONE)).ok()?;
        Some(format!("{scaled}{}", self.unit))
    }
}

/// Splits a text at white space outside of quotes, braces and brackets, so that a value such as `{ limit = "9 packets" }` stays whole.
fn words(text: &str) -> Vec<&str> {
    let (mut quote, mut depth) = (None, 0_usize);
    let parts = text.split(|letter: char| {
        match (quote, letter) {
            // Brackets within quotes do not count, and the other kind of quote is text within a quote.
            (None, '"' | '\'') => quote = Some(letter),
            (None, '{' | '[') => depth += 1,
            (None, '}' | ']') => depth = depth.saturating_sub(1),
            (Some(open), _) if open == letter => quote = None,
            _ => {}
        }
        letter.is_whitespace() && quote.is_none() && depth == 0
    });
    parts.filter(|part| !part.is_empty()).collect()
}

/// Returns the key of a word `KEY=VALUE`, without the keys within it: `queue` of `queue.limit=20ms`. Returns `None` for any other word.
fn key_with_value(word: &str) -> Option<&str> {
    let (key, _) = word.split_once('=')?;
    let is_key = !key.is_empty() && key.chars().all(|letter| letter.is_ascii_alphanumeric() || "-.".contains(letter));
    is_key.then(|| key.split('.').next().unwrap_or(key))
}

/// Reads a factor. Returns `None` unless the factor is above zero and has at most three decimal places.
fn thousandths(text: &str) -> Option<u64> {
    let (whole, decimals) = text.split_once('.').unwrap_or((text, "0"));
    let are_digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if !are_digits(whole) || !are_digits(decimals) || decimals.len() > 3 {
        return None;
    }
    let factor = whole.parse::<u64>().ok()?.checked_mul(ONE)?.checked_add(format!("{decimals:0<3}").parse().ok()?)?;
    (factor > 0).then_some(factor)
}

impl PartialEq for LibraryLink {
    fn eq(&self, other: &Self) -> bool {
        // The name with its version and factors determines the link.
        self.text == other.text
    }
}

impl fmt::Display for LibraryLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.text)
    }
}

impl fmt::Debug for LibraryLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.text, f)
    }
}

impl AsRef<str> for LibraryLink {
    fn as_ref(&self) -> &str {
        &self.text
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_linkfile::library::profiles;

    use super::*;

    fn link(text: &str) -> LibraryLink {
        LibraryLink::expect(text).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn a_factor_multiplies_the_number_of_its_key() {
        let phone = link("lte-driving delay*1.4");
        assert_eq!((phone.to_string(), format!("{phone:?}")), ("lte-driving@1 delay*1.4".to_owned(), "\"lte-driving@1 delay*1.4\"".to_owned()));
        let lines = phone.both_ways("phone").unwrap();
        // 42.4 ms times 1.4. The rates of the walk stay.
        for line in [&lines.uplink, &lines.downlink] {
            let Some(LinkModel::Modulated(line)) = line else { panic!("the rate walks") };
            assert!(line.configs().iter().all(|config| config.delay.mean() == Duration::from_micros(59_360)));
        }
        // Only the rate up is known to differ from link to link.
        let up = link("5g-walking/up rate*0.5");
        assert_eq!(
            up.one_way(),
            link_from_keys(&["profile=5g-walking/up".to_owned(), "rate=33350kbit".to_owned()]).map_err(|error| error.to_string())
        );
        assert_eq!(link("5g-walking/down rate*0.5").one_way(), link("5g-walking/down").one_way());
        assert_eq!(link("cable delay*1.000"), link("cable@1"));
    }

    #[test]
    fn a_key_with_its_value_is_laid_over_both_directions() {
        let text = "dsl queue={ limit = '250 packets', discipline = 'fq-codel' }";
        let home = link(text);
        assert_eq!(home.to_string(), text.replace("dsl", "dsl@1"));
        let lines = home.both_ways("home").unwrap();
        for (direction, line) in [("up", lines.uplink), ("down", lines.downlink)] {
            let keys = [format!("profile=dsl/{direction}"), "queue.limit=250 packets".to_owned(), "queue.discipline=fq-codel".to_owned()];
            assert_eq!(line, Some(link_from_keys(&keys).unwrap()), "{direction}");
        }
        // A factor stands before the keys, in whatever order they are written.
        let phone = link("lte-driving  queue.limit='9 packets' delay*1.4\trate=2Mbit");
        assert_eq!(phone.to_string(), "lte-driving@1 delay*1.4 queue.limit='9 packets' rate=2Mbit");
        // A key with a value is the same for all links of the kind, and no factor is drawn for it.
        assert_eq!(link("5g-walking rate=9Mbit").keys().collect::<Vec<_>>(), ["delay"]);
    }

    #[test]
    fn what_is_no_link_is_refused_with_the_way_out() {
        for (text, expected) in [
            ("", "no link of the library is called \"\""),
            ("starlnk", "did you mean \"starlink\"?"),
            ("starlink@2", "starlink has no version \"2\": expected starlink@1"),
            ("lte-driving slow", "`slow` is not a factor: expected a key and a number above 0"),
            ("lte-driving delay*0", "`delay*0` is not a factor"),
            ("lte-driving delay*1.2345", "`delay*1.2345` is not a factor"),
            ("lte-driving delay*-1", "`delay*-1` is not a factor"),
            ("lte-driving rate*2", "does not say how the rate of lte-driving@1 differs from link to link: expected a factor of delay"),
            ("starlink delay*2", "expected the name alone"),
            ("cable delay*2 delay=4ms", "delay has a factor and a value: expected one of them"),
            ("cable =4ms", "`=4ms` is not a factor"),
        ] {
            let error = LibraryLink::expect(text).expect_err(text);
            assert!(error.contains(expected), "{text}: {error}");
        }
        assert!(LibraryLink::parse("delay 20ms").is_none());
        assert!(link("starlink/up").both_ways("phone").unwrap_err().contains("expected the name without a direction, starlink@1"));
        assert!(link("starlink").one_way().unwrap_err().contains("starlink differs by direction: expected starlink/down"));
        assert!(link("cable delay*9999999999999").one_way().is_err());
        for (text, expected) in
            [("dsl/up queue.discipline=codl", "one of tail-drop, head-drop, codel"), ("cable que.limit=4ms", "link.que: unknown key")]
        {
            let error = link(text).one_way().expect_err(text);
            assert!(error.contains(expected), "{text}: {error}");
        }
    }

    /// A factor belongs to a key that is a time or a rate and holds in every state, and one range serves both directions.
    #[test]
    fn every_range_of_the_library_is_a_range_of_factors() {
        for profile in profiles() {
            for direction in Direction::BOTH {
                let line = profile.line(direction);
                for (key, bounds) in &line.between {
                    let usual =
                        line.keys().iter().find(|(known, _)| known == key).and_then(|(_, value)| Quantity::read(value.trim_matches('"'))).unwrap();
                    let [low, high] = bounds.each_ref().map(|bound| Quantity::read(bound).unwrap());
                    assert!(low.unit == usual.unit && low.count < usual.count && usual.count < high.count, "{} {key}", profile.title());
                    let other = profile.line(if direction == Direction::Up { Direction::Down } else { Direction::Up });
                    let same = other.between.get(key).is_none_or(|others| {
                        others == bounds && line.keys().contains(&other.keys().into_iter().find(|(known, _)| known == key).unwrap())
                    });
                    assert!(same, "{} {key}", profile.title());
                    let states = line.keys().into_iter().find(|(key, _)| *key == "modulated").map(|(_, states)| states).unwrap_or_default();
                    assert!(!states.contains(&format!("{key} =")), "{} {key}", profile.title());
                }
            }
        }
    }
}

//! Strategies to be compared, as they are written: `average-position,local-damping{damping=58}`.

use cohaptic_linkfile::document::quote;
use cohaptic_linkfile::reading::one_of;
use cohaptic_peer::Coordination;

use crate::vary::{Variation, VaryError, split_at_commas};

/// Two strategies or more, of which the first is the baseline. As a campaign they are the values of `coordination.strategy`.
#[derive(Clone, PartialEq, Debug)]
pub struct Strategies {
    variation: Variation,
}

/// Why a text names no strategies to be compared.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum StrategiesError {
    /// There is one alone, or none.
    #[error(
        "{found} cannot be compared with another: expected at least two strategies with a comma between them, such as average-position,extrapolated"
    )]
    TooFew {
        /// The text as given.
        found: String,
    },
    /// No strategy has that name.
    #[error("unknown strategy {}: expected {expected}", quote(name))]
    Unknown {
        /// The name.
        name: String,
        /// Those that there are.
        expected: String,
    },
    /// The strategy has no such parameter.
    #[error(
        "{strategy} has no parameter {}: expected {expected}; another key of the scene is set by its dotted path, such as coordination.damping=0",
        quote(key)
    )]
    UnknownParameter {
        /// The strategy.
        strategy: String,
        /// The key within its braces.
        key: String,
        /// Those that there are.
        expected: String,
    },
    /// A strategy is there twice with equal settings.
    #[error("{strategy} is there twice: expected different strategies, or one with different settings, such as extrapolated{{horizon=50ms}}")]
    Twice {
        /// The strategy as it is written.
        strategy: String,
    },
    /// The values are no list of strategies with settings.
    #[error(transparent)]
    Values(#[from] VaryError),
}

impl Strategies {
    /// The key whose values they are.
    pub const KEY: &'static str = "coordination.strategy";

    /// Reads strategies with commas between them. Behind a name, in braces, stand values of its own parameters, and of other keys of the scene by their
    /// dotted paths.
    ///
    /// # Errors
    ///
    /// [`StrategiesError`], which says what was expected. Whether values are such as their keys take is found out when the campaign is planned.
    pub fn parse(text: &str) -> Result<Self, StrategiesError> {
        let texts: Vec<String> = split_at_commas(text).iter().map(|text| with_long_name(text)).collect();
        for text in &texts {
            check(text)?;
        }
        if texts.len() < 2 {
            return Err(StrategiesError::TooFew { found: quote(text.trim()) });
        }
        let variation = match Variation::parse(&format!("{}={}", Self::KEY, texts.join(","))) {
            Err(VaryError::Twice { value, .. }) => return Err(StrategiesError::Twice { strategy: value }),
            variation => variation?,
        };
        let sets: Vec<Vec<String>> = (0..variation.count()).map(|place| sorted(variation.overrides(place))).collect();
        if let Some(place) = (1..sets.len()).find(|place| sets[..*place].contains(&sets[*place])) {
            return Err(StrategiesError::Twice { strategy: variation.value_text(place).to_owned() });
        }
        Ok(Self { variation })
    }

    /// Every strategy of the registry, each with its parameters as the scene has them.
    ///
    /// # Panics
    ///
    /// If the registry has a strategy twice.
    #[must_use]
    pub fn all() -> Self {
        let names: Vec<&str> = Coordination::ALL.iter().map(|strategy| strategy.name()).collect();
        Self::parse(&names.join(",")).expect("names of the registry are different strategies, and more than one")
    }

    /// The key of a campaign that they vary.
    #[must_use]
    pub fn variation(&self) -> Variation {
        self.variation.clone()
    }

    /// The strategies as they are written, in order.
    pub fn names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.variation.texts()
    }

    /// What a strategy does, and the dotted paths of its own parameters with their defaults as a scene has them, by its place.
    ///
    /// # Panics
    ///
    /// If there are fewer strategies.
    #[must_use]
    pub fn registered(&self, place: usize) -> (&'static str, Vec<(String, &'static str)>) {
        let name = name(self.variation.value_text(place));
        let strategy = Coordination::named(name).expect("names are looked up when they are read");
        let parameters = strategy.parameters().iter().map(|parameter| (format!("coordination.{name}.{}", parameter.key), parameter.default));
        (strategy.about(), parameters.collect())
    }

    /// With these overrides on top a scene is run by a strategy that refuses no scene: a scene that is refused with another one, and is not with them, is refused by that
    /// strategy.
    #[must_use]
    pub fn fallback() -> Vec<String> {
        vec![format!("{}={}", Self::KEY, Coordination::AveragePosition.name())]
    }
}

/// The name of a strategy as it is written, without its settings.
fn name(text: &str) -> &str {
    text.split('{').next().unwrap_or_default().trim().trim_matches(['"', '\''])
}

/// A strategy as it is written, by its long name if it has a short one: `AP` and `average-position` are the same.
fn with_long_name(text: &str) -> String {
    let short = name(text);
    let long = Coordination::named(short).map_or(short, |strategy| strategy.name());
    text.replacen(short, long, usize::from(!short.is_empty()))
}

/// That a strategy and the parameters within its braces exist.
fn check(text: &str) -> Result<(), StrategiesError> {
    let settings = text.split_once('{').map_or("", |(_, settings)| settings);
    let name = name(text);
    let Some(strategy) = Coordination::named(name) else {
        let expected = one_of(Coordination::ALL.iter().map(|strategy| strategy.name()), name);
        return Err(StrategiesError::Unknown { name: name.to_owned(), expected });
    };
    for setting in split_at_commas(settings.strip_suffix('}').unwrap_or(settings)) {
        let Some((key, _)) = setting.split_once('=') else { continue };
        let key = key.trim();
        if key.is_empty() || key.contains('.') || strategy.parameters().iter().any(|parameter| parameter.key == key) {
            continue;
        }
        let expected = one_of(strategy.parameters().iter().map(|parameter| parameter.key), key);
        return Err(StrategiesError::UnknownParameter { strategy: name.to_owned(), key: key.to_owned(), expected });
    }
    Ok(())
}

fn sorted(mut texts: Vec<String>) -> Vec<String> {
    texts.sort_unstable();
    texts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_braces_it_is_the_list_that_a_campaign_takes() {
        let strategies = Strategies::parse(" average-position, extrapolated ").unwrap();
        assert_eq!(strategies.variation(), Variation::parse("coordination.strategy=average-position,extrapolated").unwrap());
        assert_eq!(strategies.names().collect::<Vec<&str>>(), ["average-position", "extrapolated"]);
    }

    #[test]
    fn one_strategy_may_stand_there_with_different_settings() {
        let strategies = Strategies::parse("extrapolated{horizon=50ms},extrapolated{ horizon = 200ms },extrapolated").unwrap();
        assert_eq!(strategies.names().collect::<Vec<&str>>(), ["extrapolated{horizon=50ms}", "extrapolated{horizon=200ms}", "extrapolated"]);
        assert_eq!(strategies.variation().overrides(1), ["coordination.strategy=extrapolated", "coordination.extrapolated.horizon=200ms"]);
    }

    #[test]
    fn what_cannot_be_compared_is_refused_and_says_why() {
        for (text, part) in [
            ("", "unknown strategy"),
            ("average-position", "cannot be compared with another"),
            ("average-position,", "unknown strategy"),
            ("average-position,extrapolatd", "did you mean \"extrapolated\"?"),
            ("average-position,extrapolated{horzon=50ms}", "extrapolated has no parameter \"horzon\": expected horizon"),
            ("average-position{damping=5},extrapolated", "average-position has no parameter \"damping\": expected none"),
            ("average-position,average-position", "average-position is there twice"),
            ("average-position,average-position{}", "average-position is there twice"),
            ("extrapolated{horizon=1ms},extrapolated{ horizon = 1ms }", "extrapolated{horizon=1ms} is there twice"),
            ("local-damping{age=1ms,damping=3},local-damping{damping=3,age=1ms}", "is there twice"),
            ("average-position,extrapolated{horizon}", "is no strategy with settings"),
            ("average-position,extrapolated{horizon=50ms", "is no strategy with settings"),
        ] {
            let error = Strategies::parse(text).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("expected"), "{text}: {error}");
        }
    }

    #[test]
    fn short_names_are_those_of_the_two_laws() {
        let both = Strategies::parse("AP, PD{coordination.stiffness=500}").unwrap();
        assert!(
            both.names().eq(["average-position", "proportional-derivative{coordination.stiffness=500}"]),
            "{:?}",
            both.names().collect::<Vec<_>>()
        );
        assert!(matches!(Strategies::parse("AP,average-position"), Err(StrategiesError::Twice { .. })));
        assert!(matches!(Strategies::parse("AP,pd"), Err(StrategiesError::Unknown { .. })));
    }

    #[test]
    fn all_strategies_are_those_of_the_registry() {
        let all = Strategies::all();
        assert!(all.names().eq(Coordination::ALL.iter().map(|strategy| strategy.name())));
        for (place, strategy) in Coordination::ALL.iter().enumerate() {
            let (about, parameters) = all.registered(place);
            assert_eq!((about, parameters.len()), (strategy.about(), strategy.parameters().len()));
        }
        let (_, parameters) = Strategies::parse("average-position,extrapolated{horizon=1ms}").unwrap().registered(1);
        assert_eq!(parameters, [("coordination.extrapolated.horizon".to_owned(), "\"100ms\"")]);
    }
}

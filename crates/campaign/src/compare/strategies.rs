//! Reads the list of strategies of a comparison: `average-position,local-damping{damping=58}`.

use cohaptic_linkfile::document::quote;
use cohaptic_linkfile::reading::one_of;
use cohaptic_peer::Coordination;

use crate::vary::{Variation, VaryError, split_at_commas};

/// Two or more strategies; the first is the baseline. In a campaign, the strategies are the values of `coordination.strategy`.
#[derive(Clone, PartialEq, Debug)]
pub struct Strategies {
    variation: Variation,
}

/// Why a text is no list of comparable strategies.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StrategiesError {
    /// The list has fewer than two strategies.
    #[error("{found} names fewer than two strategies: expected at least two with a comma between them, such as average-position,extrapolated")]
    TooFew {
        /// The text of the user.
        found: String,
    },
    /// No strategy has that name.
    #[error("unknown strategy {}: expected {expected}", quote(name))]
    Unknown {
        /// The unknown name.
        name: String,
        /// The known names, in words.
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
        /// The unknown key within the braces.
        key: String,
        /// The known parameters, in words.
        expected: String,
    },
    /// The list has a strategy twice with equal settings.
    #[error("{strategy} stands twice: expected different strategies, or one with different settings, such as extrapolated{{horizon=50ms}}")]
    Twice {
        /// The strategy as written.
        strategy: String,
    },
    /// The text is no list of strategies with settings.
    #[error(transparent)]
    Values(#[from] VaryError),
}

impl Strategies {
    /// Key of a scene whose values are the strategies.
    pub const KEY: &'static str = "coordination.strategy";

    /// Reads strategies separated by commas. Braces after a name hold values of the strategy's own parameters, and of other keys of the scene by their dotted
    /// paths.
    ///
    /// # Errors
    ///
    /// [`StrategiesError`] with the expected form. The values themselves are checked later, when the campaign checks its scenes.
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
        // `Variation::parse` finds equal texts only. Sorted overrides also find settings in another order.
        let sets: Vec<Vec<String>> = (0..variation.count()).map(|place| sorted(variation.overrides(place))).collect();
        if let Some(place) = (1..sets.len()).find(|place| sets[..*place].contains(&sets[*place])) {
            return Err(StrategiesError::Twice { strategy: variation.value_text(place).to_owned() });
        }
        Ok(Self { variation })
    }

    /// Returns every strategy of the registry, each with the parameters of the scene.
    ///
    /// # Panics
    ///
    /// If the registry has a strategy twice.
    #[must_use]
    pub fn all() -> Self {
        let names: Vec<&str> = Coordination::ALL.iter().map(|strategy| strategy.name()).collect();
        Self::parse(&names.join(",")).expect("names of the registry are different strategies, and more than one")
    }

    /// Returns the variation of [`Strategies::KEY`] over the strategies.
    #[must_use]
    pub fn variation(&self) -> Variation {
        self.variation.clone()
    }

    /// Returns the strategies as written, in order.
    pub fn names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.variation.texts()
    }

    /// Returns the description of a strategy, and the dotted paths of its own parameters with their default values. `place`: index of the strategy, from 0.
    ///
    /// # Panics
    ///
    /// If `place` is not below the number of strategies.
    #[must_use]
    pub fn registered(&self, place: usize) -> (&'static str, Vec<(String, &'static str)>) {
        let name = name(self.variation.value_text(place));
        let strategy = Coordination::named(name).expect("names are looked up when they are read");
        let parameters = strategy.parameters().iter().map(|parameter| (format!("coordination.{name}.{}", parameter.key), parameter.default));
        (strategy.about(), parameters.collect())
    }

    /// Returns overrides which select the strategy that accepts every scene. A scene refused without these overrides and accepted with them is refused because
    /// of its strategy.
    #[must_use]
    pub fn fallback() -> Vec<String> {
        vec![format!("{}={}", Self::KEY, Coordination::AveragePosition.name())]
    }
}

/// Returns the name of a written strategy, without settings and quotes.
fn name(text: &str) -> &str {
    text.split('{').next().unwrap_or_default().trim().trim_matches(['"', '\''])
}

/// Replaces a short name of a strategy by the long name: `AP` becomes `average-position`.
fn with_long_name(text: &str) -> String {
    let short = name(text);
    let long = Coordination::named(short).map_or(short, |strategy| strategy.name());
    // An empty name would match at the beginning of the text.
    text.replacen(short, long, usize::from(!short.is_empty()))
}

/// Checks the name of a strategy and the names of the parameters within its braces.
fn check(text: &str) -> Result<(), StrategiesError> {
    let settings = text.split_once('{').map_or("", |(_, settings)| settings);
    let name = name(text);
    let Some(strategy) = Coordination::named(name) else {
        let expected = one_of(Coordination::ALL.iter().map(|strategy| strategy.name()), name);
        return Err(StrategiesError::Unknown { name: name.to_owned(), expected });
    };
    for setting in split_at_commas(settings.strip_suffix('}').unwrap_or(settings)) {
        // `Variation::parse` refuses malformed settings later, with an error of its own.
        let Some((key, _)) = setting.split_once('=') else { continue };
        let key = key.trim();
        // key.contains('.')||// A dotted path is a key of the scene, which the scene's reader checks.
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
            ("average-position", "names fewer than two strategies"),
            ("average-position,", "unknown strategy"),
            ("average-position,extrapolatd", "did you mean \"extrapolated\"?"),
            ("average-position,extrapolated{horzon=50ms}", "extrapolated has no parameter \"horzon\": expected horizon"),
            ("average-position{damping=5},extrapolated", "average-position has no parameter \"damping\": expected none"),
            ("average-position,average-position", "average-position stands twice"),
            ("average-position,average-position{}", "average-position stands twice"),
            ("extrapolated{horizon=1ms},extrapolated{ horizon = 1ms }", "extrapolated{horizon=1ms} stands twice"),
            ("local-damping{age=1ms,damping=3},local-damping{damping=3,age=1ms}", "stands twice"),
            ("average-position,extrapolated{horizon}", "is not a strategy with settings"),
            ("average-position,extrapolated{horizon=50ms", "is not a strategy with settings"),
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

//! Strategy of links like a link of the library, with a factor for each number that differs from link to link.

use proptest::strategy::{NewTree, Strategy, ValueTree};
use proptest::test_runner::TestRunner;

use super::any::Likeness;
use super::grid::Dice;
use super::shrink::{Number, Search, Space};
use crate::library::LibraryLink;

/// Strategy of links like a link of the library: see [`Likeness`].
#[derive(Clone, Debug)]
#[must_use = "strategies do nothing unless used"]
pub struct LibraryLinks {
    usual: LibraryLink,
}

impl Likeness for &str {
    type Links = LibraryLinks;

    #[track_caller]
    #[expect(clippy::panic, reason = "documented: a name stands in a test")]
    fn links(self) -> LibraryLinks {
        match LibraryLink::expect(self) {
            Ok(usual) => LibraryLinks { usual },
            Err(error) => panic!("`{self}` is not a link of the library: {error}"),
        }
    }
}

impl Strategy for LibraryLinks {
    type Tree = Box<dyn ValueTree<Value = LibraryLink>>;
    type Value = LibraryLink;

    fn new_tree(&self, runner: &mut TestRunner) -> NewTree<Self> {
        let mut link = self.usual.clone();
        for (key, range) in self.usual.ranges() {
            let factor = Dice(runner.rng()).even_in_logarithm(&range);
            link = link.with_factor(&key, factor);
        }
        Ok(Box::new(Search::new(FactorSpace { usual: self.usual.clone() }, link)))
    }
}

/// Space of the links like a link of the library.
#[derive(Clone, Debug)]
struct FactorSpace {
    /// Link to which all links shrink.
    usual: LibraryLink,
}

impl FactorSpace {
    /// Returns the keys whose factor differs from the factor of the usual link.
    fn changed(&self, link: &LibraryLink) -> Vec<String> {
        self.usual.ranges().into_keys().filter(|key| link.factor(key) != self.usual.factor(key)).collect()
    }
}

impl Space for FactorSpace {
    type Value = LibraryLink;
    type Part = String;
    /// A factor has no plainer form.
    type Form = std::convert::Infallible;
    type Place = String;

    const LEVELS: usize = 1;

    fn parts(&self, link: &LibraryLink, _level: usize) -> Vec<String> {
        self.changed(link)
    }

    fn without(&self, link: &LibraryLink, keys: &[String]) -> Option<LibraryLink> {
        Some(keys.iter().fold(link.clone(), |link, key| link.with_factor(key, self.usual.factor(key))))
    }

    fn forms(&self, _link: &LibraryLink) -> Vec<std::convert::Infallible> {
        Vec::new()
    }

    fn plainer(&self, _link: &LibraryLink, form: &std::convert::Infallible) -> Option<LibraryLink> {
        match *form {}
    }

    fn places(&self, link: &LibraryLink) -> Vec<String> {
        self.changed(link)
    }

    fn number(&self, link: &LibraryLink, key: &String) -> Option<Number> {
        Some(Number { value: link.factor(key), goal: self.usual.factor(key), step: 1 })
    }

    fn with_number(&self, link: &LibraryLink, key: &String, factor: u64) -> Option<LibraryLink> {
        // A test may give a usual link outside of the range. The numbers on the way there need not lie within the range either.
        self.usual.ranges().contains_key(key).then(|| link.with_factor(key, factor))
    }
}

#[cfg(test)]
mod tests {
    use proptest::test_runner::{TestCaseError, TestError};

    use super::super::links_like;
    use super::*;
    use crate::library::ONE;

    fn drawn(name: &str, count: usize) -> Vec<LibraryLink> {
        let mut runner = TestRunner::deterministic();
        let links = links_like(name);
        (0..count).map(|_| links.new_tree(&mut runner).unwrap().current()).collect()
    }

    /// Delays lie between 24.65 and 83.5 ms, around 42.4 ms, with an even logarithm: half of them are below √(24.65·83.5) ms = 45.37 ms, a factor of 1.07.
    #[test]
    fn factors_are_even_in_their_logarithm_between_the_bounds() {
        let factors: Vec<u64> = drawn("lte-driving", 4000).iter().map(|link| link.factor("delay")).collect();
        assert!(factors.iter().all(|factor| (582..=1969).contains(factor)));
        let below = |bound: u64| factors.iter().filter(|factor| **factor < bound).count();
        // Quarters of the logarithm, of which each holds 1000 ± 3 · √(4000 · ¼ · ¾).
        for (low, high) in [(582, 789), (789, 1070), (1070, 1452), (1452, 1970)] {
            let count = below(high) - below(low);
            assert!(count.abs_diff(1000) < 83, "{low} to {high}: {count}");
        }
        assert!(drawn("starlink", 3).iter().all(|link| link.to_string() == "starlink@1"));
        let both = drawn("5g-walking", 100);
        assert!(both.iter().any(|link| link.factor("rate") < ONE && link.factor("delay") > ONE));
    }

    #[test]
    fn links_shrink_to_the_link_of_the_library() {
        let least = |is_wrong: &dyn Fn(&LibraryLink) -> bool| {
            let failure = TestRunner::deterministic()
                .run(&links_like("5g-walking"), |link| if is_wrong(&link) { Err(TestCaseError::fail("wrong")) } else { Ok(()) });
            let Err(TestError::Fail(_, link)) = failure else { panic!("it is right everywhere") };
            link.to_string()
        };
        assert_eq!(least(&|link| link.factor("rate") <= 812), "5g-walking@1 rate*0.81");
        assert_eq!(least(&|link| link.factor("delay") >= 1012), "5g-walking@1 delay*1.1");
        assert_eq!(least(&|_| true), "5g-walking@1");
    }

    #[test]
    #[should_panic(expected = "`starlnk` is not a link of the library: no link of the library is called \"starlnk\"")]
    fn a_name_that_is_not_there_is_refused() {
        let _ = links_like("starlnk");
    }
}

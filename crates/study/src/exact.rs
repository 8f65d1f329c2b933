//! Numbers in JSON files as texts, with the fewest digits that give the same number again.
//!
//! The reader of JSON rounds some numbers to a neighbour of the written one. A table of measures must have the measures of the replay to the last bit.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A number that is written and read without rounding.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Exact(pub(crate) f64);

impl Serialize for Exact {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{:?}", self.0))
    }
}

impl<'de> Deserialize<'de> for Exact {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map(Self).map_err(|_| serde::de::Error::custom(format!("{text:?} is no number")))
    }
}

/// Writes and reads a number, for `#[serde(with)]`.
pub(crate) mod number {
    use super::{Deserialize, Deserializer, Exact, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        Exact(*number).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Exact::deserialize(deserializer).map(|Exact(number)| number)
    }
}

/// Writes and reads names with their numbers, for `#[serde(with)]`.
pub(crate) mod named {
    use super::{Deserialize, Deserializer, Exact, Serializer};

    pub(crate) fn serialize<S: Serializer>(values: &[(String, Option<f64>)], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(values.iter().map(|(name, value)| (name, value.map(Exact))))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<(String, Option<f64>)>, D::Error> {
        let values = Vec::<(String, Option<Exact>)>::deserialize(deserializer)?;
        Ok(values.into_iter().map(|(name, value)| (name, value.map(|Exact(number)| number))).collect())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// As a number of JSON, the first of these is read as 7.4719999999999995.
    #[test]
    fn numbers_that_json_rounds_are_exact() {
        for number in [7.472, 0.3905362372062443, -0.0, 5e-324, f64::MAX] {
            let text = serde_json::to_string(&Exact(number)).unwrap();
            assert_eq!(serde_json::from_str::<Exact>(&text).unwrap().0.to_bits(), number.to_bits(), "{text}");
        }
        assert!(serde_json::from_str::<Exact>("\"7,4\"").is_err());
    }

    proptest! {
        #[test]
        fn every_number_is_read_back(number in any::<f64>().prop_filter("finite", |number| number.is_finite())) {
            let text = serde_json::to_string(&Exact(number)).unwrap();
            prop_assert_eq!(serde_json::from_str::<Exact>(&text).unwrap().0.to_bits(), number.to_bits());
        }
    }
}

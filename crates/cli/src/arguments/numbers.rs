//! Numbers on the command line. Any other text is refused in words, with the range that is taken.

use std::num::NonZeroUsize;

use cohaptic_units::{Probability, parse};

/// Returns a reader of integers from `least` to `most`, both included.
pub(crate) fn integer<T: TryFrom<u64>>(least: u64, most: u64) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.parse().ok().filter(|number| (least..=most).contains(number));
        number.and_then(|number: u64| T::try_from(number).ok()).ok_or_else(|| expected(least, most))
    }
}

/// Reads an integer that is not negative.
pub(crate) fn any_integer(text: &str) -> Result<u64, String> {
    integer(0, u64::MAX)(text)
}

/// Reads an integer of at least one.
pub(crate) fn some(text: &str) -> Result<NonZeroUsize, String> {
    let number = text.parse().ok();
    number.ok_or_else(|| expected(1, u64::MAX))
}

/// Reads a number of threads, at most 1024. Tens of thousands, which a slip of the finger asks for, would keep a machine busy with the threads alone.
pub(crate) fn threads(text: &str) -> Result<u16, String> {
    integer(1, 1024)(text)
}

/// Reads an amount of memory, written as a whole number with MiB or GiB, and returns the number of bytes. Zero is refused.
pub(crate) fn memory(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let of_unit = |unit: &str, shift: u32| {
        let number = text.strip_suffix(unit)?.trim_end().parse::<u64>().ok()?;
        number.checked_mul(1 << shift).filter(|bytes| *bytes > 0)
    };
    of_unit("MiB", 20).or_else(|| of_unit("GiB", 30)).ok_or_else(|| "expected an amount of memory such as 512MiB or 16GiB".to_owned())
}

/// Reads a duration with or without a sign, and returns seconds.
pub(crate) fn signed_duration(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (sign, rest) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let duration = parse::duration(rest).map_err(|_| "expected a duration such as 1.5s, -20ms or 2h".to_owned())?;
    Ok(sign * duration.as_secs_f64())
}

/// Reads a number of any range. Takes infinity and NaN too.
pub(crate) fn real(text: &str) -> Result<f64, String> {
    text.trim().parse().map_err(|_| "expected a number such as 0.25, 100 or 1e-3".to_owned())
}

/// Reads a probability, as a number from 0 to 1 or in percent.
pub(crate) fn probability(text: &str) -> Result<Probability, String> {
    let number = || text.trim().parse().ok().and_then(|number| Probability::new(number).ok());
    parse::probability(text).ok().or_else(number).ok_or_else(|| "expected a probability such as 0.015 or 1.5%".to_owned())
}

/// Reads a share of a round trip: `even` for one half, a number above 0 and at most 1, or a percentage.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    let read = if text.trim() == "even" { Some(0.5) } else { probability(text).ok().map(Probability::get) };
    read.filter(|share| *share > 0.0).ok_or_else(|| "expected even, or a share above 0 such as 0.4 or 60%".to_owned())
}

/// Reads a part of a whole: a number above 0 and below 1, or a percentage.
pub(crate) fn part(text: &str) -> Result<f64, String> {
    let read = probability(text).ok().map(Probability::get).filter(|part| *part > 0.0 && *part < 1.0);
    read.ok_or_else(|| "expected a part above 0 and below 1, such as 0.5 or 50%".to_owned())
}

fn expected(least: u64, most: u64) -> String {
    if most == u64::MAX {
        format!("expected an integer of at least {least}, below 2^64")
    } else {
        format!("expected an integer from {least} to {most}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_have_a_range_and_say_it() {
        assert_eq!((threads("1"), threads("1024"), any_integer("18446744073709551615")), (Ok(1), Ok(1024), Ok(u64::MAX)));
        for text in ["", "0", "1025", "-1", "1.5", "many", "1e3", "99999999999999999999999"] {
            assert_eq!(threads(text), Err("expected an integer from 1 to 1024".to_owned()), "{text}");
        }
        assert_eq!(any_integer("-1"), Err("expected an integer of at least 0, below 2^64".to_owned()));
        assert_eq!(some("0"), Err("expected an integer of at least 1, below 2^64".to_owned()));
        assert_eq!(integer::<u16>(0, 65_535)("65536"), Err("expected an integer from 0 to 65535".to_owned()));
    }

    #[test]
    fn memory_has_a_unit() {
        assert_eq!((memory("512MiB"), memory(" 16 GiB")), (Ok(512 << 20), Ok(16 << 30)));
        for text in ["", "8", "8GB", "0GiB", "-1GiB", "1.5GiB", "17179869184GiB"] {
            assert_eq!(memory(text), Err("expected an amount of memory such as 512MiB or 16GiB".to_owned()), "{text}");
        }
    }

    #[test]
    fn a_duration_may_have_a_sign() {
        assert_eq!(["1.5s", "-20ms", "+2h", "-0s"].map(signed_duration), [1.5, -0.02, 7_200.0, 0.0].map(Ok));
        for text in ["", "-", "--1s", "++1s", "5", "-5", "soon"] {
            assert_eq!(signed_duration(text), Err("expected a duration such as 1.5s, -20ms or 2h".to_owned()), "{text}");
        }
    }

    #[test]
    fn a_share_is_even_or_a_number() {
        assert_eq!(["even", "50%", "0.25", "1"].map(share), [0.5, 0.5, 0.25, 1.0].map(Ok));
        for text in ["", "0", "0%", "-1", "1.5", "odd"] {
            assert_eq!(share(text), Err("expected even, or a share above 0 such as 0.4 or 60%".to_owned()), "{text}");
        }
    }

    #[test]
    fn a_probability_is_a_number_or_a_percentage() {
        for text in ["0.015", "1.5%", " 0.015 ", "1.5 %"] {
            assert!((probability(text).unwrap().get() - 0.015).abs() < 1e-17, "{text}");
        }
        for text in ["", "1.1", "101%", "-0.1", "NaN", "half", "1.5ms"] {
            assert_eq!(probability(text), Err("expected a probability such as 0.015 or 1.5%".to_owned()), "{text}");
        }
    }
}

//! Question that a verdict answers, in words. The words are in this module alone, so that all answers call a verdict by the same name.

/// Radius by which the scenes of a family are judged. All scenes of a family have the same criterion, so that their radii can be compared in one map.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Criterion {
    /// The spectral radius over a frame, for scenes without random links.
    SpectralRadius,
    /// The radius of the second moment over a frame: see [`mean_square`](crate::mean_square()). Chosen if any scene of the family has random links. For a scene
    /// without random links this radius is the square of the spectral radius.
    MeanSquare,
}

impl Criterion {
    /// Returns the name of the criterion in JSON and CSV: `spectral-radius` or `mean-square`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::SpectralRadius => "spectral-radius",
            Self::MeanSquare => "mean-square",
        }
    }

    /// Returns the question that a verdict by this criterion answers: [`VerdictKind::Nominal`] if the radius is nominal.
    #[must_use]
    pub const fn kind(self, is_nominal: bool) -> VerdictKind {
        match (self, is_nominal) {
            (_, true) => VerdictKind::Nominal,
            (Self::SpectralRadius, false) => VerdictKind::Certain,
            (Self::MeanSquare, false) => VerdictKind::MeanSquare,
        }
    }
}

/// The question that a verdict answers.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum VerdictKind {
    /// The question is whether every disturbance dies out; links are not random.
    Certain,
    /// The question is whether the variance of every disturbance dies out; links are random.
    MeanSquare,
    /// The question is whether every disturbance would die out if the links were not random. The links of the scene are random.
    Nominal,
}

impl VerdictKind {
    /// The kinds, in the order in which answers list them.
    pub const ALL: [Self; 3] = [Self::Certain, Self::MeanSquare, Self::Nominal];

    /// Returns the word in JSON and CSV: `spectral-radius`, `mean-square` or `nominal`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Certain => Criterion::SpectralRadius.word(),
            Self::MeanSquare => Criterion::MeanSquare.word(),
            Self::Nominal => "nominal",
        }
    }

    /// Returns a verdict of this kind in a sentence: `stable`, `stable in the mean square`, `nominally stable`.
    #[must_use]
    pub fn says(self, verdict: &str) -> String {
        match self {
            Self::Certain => verdict.to_owned(),
            Self::MeanSquare => format!("{verdict} in the mean square"),
            Self::Nominal => format!("nominally {verdict}"),
        }
    }

    /// Returns the words for the judgement of scenes of this kind, to follow the word "judged".
    #[must_use]
    pub const fn manner(self) -> &'static str {
        match self {
            Self::Certain => "without chance",
            Self::MeanSquare => "in the mean square",
            Self::Nominal => "nominally",
        }
    }

    /// Returns the name of the deciding radius. Beside mean-square radii, a nominal radius is given as the square of the nominal spectral radius.
    #[must_use]
    pub const fn radius_name(self) -> &'static str {
        match self {
            Self::Certain => "spectral radius",
            Self::MeanSquare => "mean-square radius",
            Self::Nominal => "nominal radius squared",
        }
    }
}

/// Numbers of judged scenes, indexed by kind of verdict.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Kinds([usize; 3]);

impl Kinds {
    /// Counts the scenes judged by a criterion. Each scene may be nominal.
    #[must_use]
    pub fn of(criterion: Criterion, nominal: impl IntoIterator<Item = bool>) -> Self {
        Self::count(nominal.into_iter().map(|is_nominal| criterion.kind(is_nominal)))
    }

    /// Counts kinds.
    #[must_use]
    fn count(kinds: impl IntoIterator<Item = VerdictKind>) -> Self {
        let mut counts = [0; 3];
        kinds.into_iter().for_each(|kind| counts[kind as usize] += 1);
        Self(counts)
    }

    /// Returns the kinds with a count above zero, each with its count.
    pub fn present(self) -> impl Iterator<Item = (VerdictKind, usize)> {
        VerdictKind::ALL.into_iter().map(move |kind| (kind, self.0[kind as usize])).filter(|(_, count)| *count > 0)
    }

    /// Returns the only kind present; `None` if there are several kinds or none.
    #[must_use]
    pub fn only(self) -> Option<VerdictKind> {
        let mut present = self.present();
        present.next().filter(|_| present.next().is_none()).map(|(kind, _)| kind)
    }

    /// Returns a verdict on scenes of these kinds for a legend: `stable in the mean square, nominally stable where hatched`.
    #[must_use]
    pub fn says(self, verdict: &str) -> String {
        self.joined(|kind| kind.says(verdict))
    }

    /// Returns the names of the radii of these kinds for a title: `mean-square radius, nominal radius squared where hatched`.
    #[must_use]
    pub fn radius_name(self) -> String {
        self.joined(|kind| kind.radius_name().to_owned())
    }

    fn joined(self, words: impl Fn(VerdictKind) -> String) -> String {
        let kinds: Vec<VerdictKind> = self.present().map(|(kind, _)| kind).collect();
        let of = |kind: VerdictKind| {
            let is_beside = kind == VerdictKind::Nominal && kinds.len() > 1;
            if is_beside { format!("{} where hatched", words(kind)) } else { words(kind) }
        };
        if kinds.is_empty() { words(VerdictKind::Certain) } else { kinds.iter().map(|kind| of(*kind)).collect::<Vec<_>>().join(", ") }
    }
}

/// Returns the words at the head of every nominal verdict: `nominal (jitter and random loss left out)`.
#[must_use]
pub fn nominal_head(left_out: &[&str]) -> String {
    let list = match left_out {
        [] => "chance".to_owned(),
        [one] => (*one).to_owned(),
        [more @ .., last] => format!("{} and {last}", more.join(", ")),
    };
    format!("nominal ({list} left out)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_is_never_said_to_be_of_a_kind_that_no_cell_has() {
        let of = |nominal: &[bool]| Kinds::of(Criterion::MeanSquare, nominal.iter().copied());
        assert_eq!(of(&[true, true]).says("stable"), "nominally stable");
        assert_eq!(of(&[false]).says("stable"), "stable in the mean square");
        let mixed = of(&[true, false, true]);
        assert_eq!(mixed.says("stable"), "stable in the mean square, nominally stable where hatched");
        assert_eq!((mixed.only(), mixed.present().collect::<Vec<_>>()), (None, vec![(VerdictKind::MeanSquare, 1), (VerdictKind::Nominal, 2)]));
        assert_eq!(Kinds::of(Criterion::SpectralRadius, [false]).radius_name(), "spectral radius");
    }

    #[test]
    fn a_nominal_verdict_names_all_that_is_left_out() {
        assert_eq!(nominal_head(&["jitter"]), "nominal (jitter left out)");
        assert_eq!(nominal_head(&["jitter", "random loss", "duplicates"]), "nominal (jitter, random loss and duplicates left out)");
    }
}

//! How much a program that writes a page measures, and the first lines of its page.

use std::fmt::Write as _;

use crate::machine;

/// How much is measured.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub enum Effort {
    /// Every row once, with the least work: its figures say nothing, but the program has run.
    Smoke,
    /// Fewer rounds and less work in each.
    Quick,
    /// What the pages in `docs/` are measured with.
    #[default]
    Full,
}

impl Effort {
    /// From the arguments of a program that has no others.
    ///
    /// # Errors
    ///
    /// What was typed that is no effort.
    pub fn parse(arguments: impl IntoIterator<Item = String>) -> Result<Self, String> {
        let mut effort = Self::default();
        for argument in arguments {
            effort = Self::named(&argument).ok_or_else(|| format!("{argument:?} is neither --quick nor --smoke"))?;
        }
        Ok(effort)
    }

    /// The effort of that option.
    #[must_use]
    pub fn named(option: &str) -> Option<Self> {
        [Self::Smoke, Self::Quick].into_iter().find(|effort| effort.option() == option)
    }

    /// The option that asks for it; empty for the one that need not be asked for.
    #[must_use]
    pub const fn option(self) -> &'static str {
        match self {
            Self::Smoke => "--smoke",
            Self::Quick => "--quick",
            Self::Full => "",
        }
    }

    /// Chooses by it.
    pub fn of<T>(self, full: T, quick: T, smoke: T) -> T {
        match self {
            Self::Smoke => smoke,
            Self::Quick => quick,
            Self::Full => full,
        }
    }

    /// The command that makes a program of this package print its page with this effort.
    #[must_use]
    pub fn command(self, program: &str) -> String {
        let mut command = format!("cargo run --profile dist -p cohaptic-benches --bin {program}");
        if self != Self::Full {
            let _ = write!(command, " -- {}", self.option());
        }
        command
    }

    /// The first lines of a page: its title, its subject, the command that writes it, and where and when that was done.
    #[must_use]
    pub fn head(self, title: &str, what: &str, program: &str, page: &str) -> String {
        let (command, machine) = (self.command(program), machine::line());
        format!("# {title}\n\n{what} This page is written by\n\n    {command} > {page}\n\nand measured on {machine}.\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_option_that_asks_for_an_effort_stands_in_the_command() {
        let parse = |words: &[&str]| Effort::parse(words.iter().map(|&word| word.to_owned()));
        assert_eq!(parse(&[]), Ok(Effort::Full));
        assert_eq!(Effort::Full.command("a-table"), "cargo run --profile dist -p cohaptic-benches --bin a-table");
        for effort in [Effort::Smoke, Effort::Quick] {
            assert_eq!(parse(&[effort.option()]), Ok(effort));
            assert!(effort.command("a-table").ends_with(&format!("--bin a-table -- {}", effort.option())));
        }
        assert!(parse(&["--fast"]).is_err_and(|said| said.contains("--fast")));
        assert!(parse(&[""]).is_err());
    }
}

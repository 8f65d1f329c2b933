//! `inverse3` and its commands.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand, ValueEnum};
use cohaptic_units::{Probability, parse};

use super::examples::{self, after};
use super::falcon::{Force, damping, force, some_time, stiffness, within};
use super::numbers::{any_integer, probability};

#[derive(Debug, Args)]
#[command(after_help = after(examples::INVERSE3))]
pub(crate) struct Inverse3Arguments {
    #[command(subcommand)]
    pub(crate) command: Inverse3Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Inverse3Command {
    /// Says whether a device answers, how fast, and what hinders forces. No force
    Probe(Inverse3ProbeArguments),
    /// Shows where the cursor is: as a drawing on a terminal, as rows of CSV elsewhere. Pushes it gently if asked to
    Watch(Inverse3WatchArguments),
    /// Runs the client against a simulated service, the same each time; or serves the simulated device to other programs
    Simulate(Inverse3SimulateArguments),
}

/// Selection of a device and of its service.
#[derive(Debug, Args)]
pub(crate) struct WhichInverse3 {
    /// Address of Haply's Inverse Service on this machine
    #[arg(long, value_name = "IP:PORT", default_value = "127.0.0.1:10001", conflicts_with = "simulated")]
    pub(crate) service: SocketAddr,
    /// Use the device with this id
    #[arg(long, value_name = "ID", conflicts_with = "simulated")]
    pub(crate) device: Option<String>,
    /// Use a simulated device, whose hand holds it at the origin and then sways
    #[arg(long)]
    pub(crate) simulated: bool,
    #[arg(help = "Origin in the coordinates of the device [m], in place of the middle of the workspace")]
    #[arg(long, value_name = "X,Y,Z", value_parser = force, allow_hyphen_values = true)]
    pub(crate) origin: Option<Force>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::INVERSE3_PROBE))]
pub(crate) struct Inverse3ProbeArguments {
    #[command(flatten)]
    pub(crate) which: WhichInverse3,
    /// Time for which messages are exchanged
    #[arg(long = "for", value_name = "TIME", value_parser = some_time, default_value = "2s")]
    pub(crate) length: Duration,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::INVERSE3_WATCH))]
pub(crate) struct Inverse3WatchArguments {
    #[command(flatten)]
    pub(crate) which: WhichInverse3,
    /// Time to watch [default: until Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = some_time)]
    pub(crate) length: Option<Duration>,
    #[arg(help = "Push with this force [N], once the device is armed")]
    #[arg(long, value_name = "X,Y,Z", value_parser = force, allow_hyphen_values = true, conflicts_with = "spring")]
    pub(crate) force: Option<Force>,
    #[arg(help = "Pull to the origin as a spring of this stiffness [N/m], up to 3000, once the device is armed")]
    #[arg(long, value_name = "STIFFNESS", value_parser = stiffness)]
    pub(crate) spring: Option<f64>,
    #[arg(help = "Damp the spring by this much [N·s/m], up to 20")]
    #[arg(long, value_name = "DAMPING", value_parser = damping, requires = "spring", default_value_t = 0.0)]
    pub(crate) damping: f64,
    #[arg(help = "Give no greater force [N], above 0 and up to 2")]
    #[arg(long, value_name = "NEWTONS", value_parser = gentle, default_value_t = 0.5)]
    pub(crate) limit: f64,
    /// Write a row each millisecond into this file
    #[arg(long, value_name = "FILE")]
    pub(crate) csv: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::INVERSE3_SIMULATE))]
pub(crate) struct Inverse3SimulateArguments {
    /// Serve the simulated device to other programs at this address of this machine, in place of running the client
    #[arg(long, value_name = "IP:PORT", conflicts_with = "force")]
    pub(crate) listen: Option<SocketAddr>,
    /// The format of messages: of version 3.1, or of 3.5 and later
    #[arg(long, value_enum, default_value_t = FormatName::Current)]
    pub(crate) format: FormatName,
    #[arg(help = "Ask for this force [N] all the time")]
    #[arg(long, value_name = "X,Y,Z", value_parser = force, allow_hyphen_values = true)]
    pub(crate) force: Option<Force>,
    #[arg(help = "Give no greater force [N], above 0 and up to 10")]
    #[arg(long, value_name = "NEWTONS", value_parser = strong, default_value_t = 2.0)]
    pub(crate) limit: f64,
    /// Have a fault: NAME=PROBABILITY for each reply, or NAME@TIME+LENGTH. May be given several times (docs/inverse3.md lists the names)
    #[arg(long, value_name = "FAULT", value_parser = fault)]
    pub(crate) fault: Vec<FaultText>,
    /// Time from a message to the reply
    #[arg(long, value_name = "TIME", value_parser = parse::duration, default_value = "200us")]
    pub(crate) reply_after: Duration,
    /// Simulated time; with --listen, the time to serve [default: 6s; with --listen until Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = some_time)]
    pub(crate) length: Option<Duration>,
    /// Seed of the faults
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = any_integer, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

/// Format of the messages of a simulated service.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum FormatName {
    /// Forces in values, no presets
    #[value(name = "3.1")]
    Old,
    /// Forces in vector, and presets
    #[value(name = "3.5")]
    Current,
}

/// Name and time of a fault, as written. The command knows the names.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct FaultText {
    pub(crate) name: String,
    pub(crate) when: FaultWhen,
}

/// Time of a fault.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum FaultWhen {
    /// Each reply with this probability.
    Chance(Probability),
    /// From this time on, for this length.
    During(Duration, Duration),
}

fn fault(text: &str) -> Result<FaultText, String> {
    let expected = || "expected NAME=PROBABILITY or NAME@TIME+LENGTH, such as late=1% or gone@2s+500ms".to_owned();
    if let Some((name, chance)) = text.split_once('=') {
        let chance = probability(chance).map_err(|_| expected())?;
        return Ok(FaultText { name: name.to_owned(), when: FaultWhen::Chance(chance) });
    }
    let (name, times) = text.split_once('@').ok_or_else(expected)?;
    let (from, length) = times.split_once('+').ok_or_else(expected)?;
    let time = |text| parse::duration(text).map_err(|_| expected());
    Ok(FaultText { name: name.to_owned(), when: FaultWhen::During(time(from)?, time(length)?) })
}

fn gentle(text: &str) -> Result<f64, String> {
    within(text, 2.0, false)
}

fn strong(text: &str) -> Result<f64, String> {
    within(text, 10.0, false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_have_a_chance_or_a_time() {
        let late = fault("late=1%").unwrap();
        assert_eq!((late.name.as_str(), late.when), ("late", FaultWhen::Chance(Probability::new(0.01).unwrap())));
        let gone = fault("gone@2s+500ms").unwrap();
        assert_eq!((gone.name.as_str(), gone.when), ("gone", FaultWhen::During(Duration::from_secs(2), Duration::from_millis(500))));
        for text in ["", "late", "late=2", "late=x", "gone@2s", "gone@2s+", "gone@x+1s"] {
            assert!(fault(text).unwrap_err().contains("NAME@TIME+LENGTH"), "{text}");
        }
        assert!(gentle("2.1").is_err() && strong("10").is_ok() && strong("0").is_err());
    }
}

//! `falcon` and its commands.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand, ValueEnum};
use cohaptic_units::parse;

use super::examples::{self, after};
use super::numbers::{any_integer, probability};

#[derive(Debug, Args)]
#[command(after_help = after(examples::FALCON))]
pub(crate) struct FalconArguments {
    #[command(subcommand)]
    pub(crate) command: FalconCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum FalconCommand {
    /// Lists the Falcons that are plugged in, and says whether they may be opened and how well they answer. No force
    Probe(ProbeArguments),
    /// Guides through homing, and says where the grip is afterwards. No force
    Home(HomeArguments),
    /// Shows where the grip is: as a drawing on a terminal, as rows of CSV elsewhere. Pushes it gently if asked to
    Watch(WatchArguments),
    /// Runs the driver on a simulated device, as fast as the machine goes and the same each time
    Simulate(SimulateArguments),
}

/// Choice of a device, and its firmware.
#[derive(Debug, Args)]
pub(crate) struct WhichFalcon {
    /// Use the Falcon with this serial number
    #[arg(long, value_name = "SERIAL", conflicts_with = "simulated")]
    pub(crate) serial: Option<String>,
    /// Use a simulated Falcon, whose hand homes it and then sways
    #[arg(long)]
    pub(crate) simulated: bool,
    /// Simulate as fast as the machine goes, and the same each time, in place of real time
    #[arg(long, requires = "simulated")]
    pub(crate) virtual_time: bool,
    /// Firmware for a Falcon that has none yet (docs/falcon.md). With this, a simulated Falcon begins without firmware too
    #[arg(long, value_name = "FILE")]
    pub(crate) firmware: Option<PathBuf>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::FALCON_PROBE))]
pub(crate) struct ProbeArguments {
    #[command(flatten)]
    pub(crate) which: WhichFalcon,
    /// Time for which packets are exchanged with each Falcon
    #[arg(long = "for", value_name = "TIME", value_parser = some_time, default_value = "1s")]
    pub(crate) length: Duration,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::FALCON_HOME))]
pub(crate) struct HomeArguments {
    #[command(flatten)]
    pub(crate) which: WhichFalcon,
    /// Time that homing may take
    #[arg(long = "for", value_name = "TIME", value_parser = some_time, default_value = "2min")]
    pub(crate) length: Duration,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::FALCON_WATCH))]
pub(crate) struct WatchArguments {
    #[command(flatten)]
    pub(crate) which: WhichFalcon,
    /// Time to watch [default: until Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = some_time)]
    pub(crate) length: Option<Duration>,
    #[arg(help = "Push with this force [N], once the device is homed and its grip was pulled out")]
    #[arg(long, value_name = "X,Y,Z", value_parser = force, allow_hyphen_values = true, conflicts_with = "spring")]
    pub(crate) force: Option<Force>,
    #[arg(help = "Pull to the origin as a spring of this stiffness [N/m], up to 3000, once the device is homed and its grip was pulled out")]
    #[arg(long, value_name = "STIFFNESS", value_parser = stiffness)]
    pub(crate) spring: Option<f64>,
    #[arg(help = "Damp the spring by this much [N·s/m], up to 20")]
    #[arg(long, value_name = "DAMPING", value_parser = damping, requires = "spring", default_value_t = 0.0)]
    pub(crate) damping: f64,
    #[arg(help = "Give no greater force [N], above 0 and up to 4. A device may push several times as hard (docs/falcon.md)")]
    #[arg(long, value_name = "NEWTONS", value_parser = gentle, default_value_t = 0.5)]
    pub(crate) limit: f64,
    /// Write every exchange into this file
    #[arg(long, value_name = "FILE")]
    pub(crate) csv: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::FALCON_SIMULATE))]
pub(crate) struct SimulateArguments {
    /// The hand that holds the grip
    #[arg(long, value_enum, default_value_t = HandName::Swaying)]
    pub(crate) hand: HandName,
    #[arg(help = "Ask the driver for this force [N] all the time")]
    #[arg(long, value_name = "X,Y,Z", value_parser = force, allow_hyphen_values = true)]
    pub(crate) force: Option<Force>,
    #[arg(help = "Give no greater force [N], above 0 and up to 20")]
    #[arg(long, value_name = "NEWTONS", value_parser = strong, default_value_t = 4.0)]
    pub(crate) limit: f64,
    /// Change a byte to the host with this probability, and insert a byte before it with the same probability
    #[arg(long, value_name = "PROBABILITY", value_parser = probability)]
    pub(crate) garbage: Option<cohaptic_units::Probability>,
    /// Lose a byte in either direction with this probability
    #[arg(long, value_name = "PROBABILITY", value_parser = probability)]
    pub(crate) drop: Option<cohaptic_units::Probability>,
    /// Pull the plug after this time
    #[arg(long, value_name = "TIME", value_parser = parse::duration)]
    pub(crate) unplug_after: Option<Duration>,
    /// Simulated time
    #[arg(long = "for", value_name = "TIME", value_parser = some_time, default_value = "6s")]
    pub(crate) length: Duration,
    /// Seed of the faults, and of the counts of encoders that are not homed
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = any_integer, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

/// The hand on a simulated grip.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum HandName {
    /// No hand: the grip hangs free, and is never homed
    Still,
    /// Pulls the grip out, pushes it in, pulls it out again, and holds it in the middle
    Homing,
    /// As homing, and then moves the grip to and fro
    Swaying,
}

/// A force \[N\] along x, y and z.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Force(pub(crate) [f64; 3]);

pub(super) fn force(text: &str) -> Result<Force, String> {
    let parts: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok().filter(|number: &f64| number.is_finite())).collect();
    match parts.as_deref() {
        Some([x, y, z]) => Ok(Force([*x, *y, *z])),
        Some(_) | None => Err("expected three numbers, such as 0,0,0.3".to_owned()),
    }
}

pub(super) fn some_time(text: &str) -> Result<Duration, String> {
    let time = parse::duration(text).map_err(|error| error.to_string())?;
    if time.is_zero() { Err("expected a time above zero".to_owned()) } else { Ok(time) }
}

pub(super) fn stiffness(text: &str) -> Result<f64, String> {
    within(text, 3000.0, true)
}

pub(super) fn damping(text: &str) -> Result<f64, String> {
    within(text, 20.0, true)
}

fn gentle(text: &str) -> Result<f64, String> {
    within(text, 4.0, false)
}

fn strong(text: &str) -> Result<f64, String> {
    within(text, 20.0, false)
}

pub(super) fn within(text: &str, most: f64, zero: bool) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| (0.0..=most).contains(number) && (zero || *number > 0.0));
    number.ok_or_else(|| format!("expected a number {} {most}", if zero { "from 0 to" } else { "above 0 and up to" }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_three_finite_numbers() {
        assert_eq!(force("0, -0.5,1e-1"), Ok(Force([0.0, -0.5, 0.1])));
        for text in ["", "1", "1,2", "1,2,3,4", "a,b,c", "1,NaN,0", "1,inf,0"] {
            assert!(force(text).is_err(), "{text}");
        }
    }

    #[test]
    fn limits_have_ends() {
        assert_eq!((gentle("4"), stiffness("0"), damping("20")), (Ok(4.0), Ok(0.0), Ok(20.0)));
        assert!(["0", "-1", "4.01", "NaN", "inf", "many"].iter().all(|text| gentle(text).is_err()));
        assert!(stiffness("3001").is_err() && some_time("0s").is_err());
    }
}

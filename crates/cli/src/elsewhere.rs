//! Stand-ins for the commands that this program was built without, because of the system or of a feature of cargo: each stand-in takes the arguments of the
//! command, prints an error, and ends with status 3.

use crate::failure::Failure;

/// Makes a module per command. The function of the module fails with the message of `$without`, a function of the name of the command.
macro_rules! stand_in {
    ($without:ident; $($command:ident: $arguments:ident),* $(,)?) => {
        $(
            pub(crate) mod $command {
                use std::process::ExitCode;

                use crate::arguments::$arguments;
                use crate::failure::Failure;

                pub(crate) fn $command(_: &$arguments) -> Result<ExitCode, Failure> {
                    Err(super::$without(stringify!($command)))
                }
            }
        )*
    };
}

#[cfg(not(target_os = "linux"))]
fn without_linux(command: &str) -> Failure {
    let else_here = if command == "relay" { ". Between programs that speak TCP, relay --tcp runs here" } else { "" };
    Failure::System(format!("cohaptic {command} needs Linux: its clocks, sockets or devices are those of Linux{else_here}"))
}

#[cfg(not(target_os = "linux"))]
pub(crate) mod exec {
    use std::process::ExitCode;

    use crate::arguments::ExecArguments;
    use crate::failure::Failure;
    use crate::report;

    pub(crate) fn exec(_: &ExecArguments) -> ExitCode {
        report::report(&Failure::System("cohaptic exec needs Linux: its namespaces and devices are those of Linux".to_owned()))
    }
}

#[cfg(not(target_os = "linux"))]
stand_in! {
    without_linux;
    falcon: FalconArguments,
    inverse3: Inverse3Arguments,
    join: JoinArguments,
    live: LiveArguments,
    play: PlayArguments,
    relay: RelayArguments,
    router: RouterArguments,
}

/// The command of a device has the name of the feature that drives the device.
#[cfg(target_os = "linux")]
fn without_driver(command: &str) -> Failure {
    Failure::System(format!("cohaptic {command}: {}", crate::failure::without_feature(command)))
}

#[cfg(all(target_os = "linux", not(feature = "falcon")))]
stand_in! {
    without_driver;
    falcon: FalconArguments,
}

#[cfg(all(target_os = "linux", not(feature = "inverse3")))]
stand_in! {
    without_driver;
    inverse3: Inverse3Arguments,
}

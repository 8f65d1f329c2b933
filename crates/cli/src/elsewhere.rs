//! Stand-ins, on other systems, for the commands of Linux: each stand-in takes the arguments of the command, prints an error, and ends with status 3.

/// Makes a module per command. The function of the module fails with a message that the command needs Linux.
macro_rules! need_linux {
    ($($command:ident: $arguments:ident),* $(,)?) => {
        $(
            pub(crate) mod $command {
                use std::process::ExitCode;

                use crate::arguments::$arguments;
                use crate::failure::Failure;

                pub(crate) fn $command(_: &$arguments) -> Result<ExitCode, Failure> {
                    let command = stringify!($command);
                    Err(Failure::System(format!("cohaptic {command} needs Linux: its clocks, sockets or devices are those of Linux")))
                }
            }
        )*
    };
}

need_linux! {
    falcon: FalconArguments,
    live: LiveArguments,
    play: PlayArguments,
    relay: RelayArguments,
    router: RouterArguments,
}

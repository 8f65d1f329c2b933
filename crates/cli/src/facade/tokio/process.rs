//! Processes. A test bed refuses processes, because the sockets of a process would be real.

use std::ffi::OsStr;
use std::future::Future;
use std::io;
use std::ops::{Deref, DerefMut};
use std::path::Path;
use std::process::{ExitStatus, Output, Stdio};

pub use real::process::*;

/// See `tokio::process::Command`.
#[derive(Debug)]
pub struct Command(real::process::Command);

/// Methods that set one value of the command.
macro_rules! setters {
    ($($(#[$condition:meta])* $name:ident($($value:ident: $kind:ty),*);)*) => {
        $(
            $(#[$condition])*
            #[doc = concat!("See `tokio::process::Command::", stringify!($name), "`.")]
            pub fn $name(&mut self $(, $value: $kind)*) -> &mut Self {
                self.0.$name($($value),*);
                self
            }
        )*
    };
}

impl Command {
    /// See `tokio::process::Command::new`.
    pub fn new<S: AsRef<OsStr>>(program: S) -> Self {
        Self(real::process::Command::new(program))
    }

    setters! {
        arg(argument: impl AsRef<OsStr>);
        args(arguments: impl IntoIterator<Item = impl AsRef<OsStr>>);
        #[cfg(unix)]
        arg0(argument: impl AsRef<OsStr>);
        #[cfg(windows)]
        raw_arg(argument: impl AsRef<OsStr>);
        env(key: impl AsRef<OsStr>, value: impl AsRef<OsStr>);
        envs(variables: impl IntoIterator<Item = (impl AsRef<OsStr>, impl AsRef<OsStr>)>);
        env_remove(key: impl AsRef<OsStr>);
        env_clear();
        current_dir(folder: impl AsRef<Path>);
        stdin(stdio: impl Into<Stdio>);
        stdout(stdio: impl Into<Stdio>);
        stderr(stdio: impl Into<Stdio>);
        kill_on_drop(kill_on_drop: bool);
        #[cfg(unix)]
        uid(id: u32);
        #[cfg(unix)]
        gid(id: u32);
        #[cfg(unix)]
        process_group(group: i32);
        #[cfg(windows)]
        creation_flags(flags: u32);
    }

    /// See `tokio::process::Command::spawn`.
    #[track_caller]
    pub fn spawn(&mut self) -> io::Result<Child> {
        self.refuse_in_bed();
        self.0.spawn()
    }

    /// See `tokio::process::Command::status`.
    #[track_caller]
    pub fn status(&mut self) -> impl Future<Output = io::Result<ExitStatus>> + use<> {
        self.refuse_in_bed();
        self.0.status()
    }

    /// See `tokio::process::Command::output`.
    #[track_caller]
    pub fn output(&mut self) -> impl Future<Output = io::Result<Output>> + use<> {
        self.refuse_in_bed();
        self.0.output()
    }

    /// See `tokio::process::Command::into_std`.
    //@ has process/mod.rs|pub fn into_std(self)
    pub fn into_std(self) -> std::process::Command {
        self.0.into_std()
    }

    #[track_caller]
    fn refuse_in_bed(&self) {
        // Asked at the start of the process and not in `new`: a command that is never started does no harm.
        if cohaptic_sockets::is_in_bed() {
            let (place, program) = (std::panic::Location::caller(), self.0.as_std().get_program());
            panic!(
                "{place} starts the process {program:?} in a test bed, whose sockets the process would not have. Give what it does a host of the test bed by \
                 `Host::spawn`, or run the processes outside of tests, over `cohaptic relay`"
            );
        }
    }
}

impl From<std::process::Command> for Command {
    fn from(command: std::process::Command) -> Self {
        Self(command.into())
    }
}

impl Deref for Command {
    type Target = real::process::Command;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for Command {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

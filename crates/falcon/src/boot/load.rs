//! The conversation with the boot loader.

use core::time::Duration;

use cohaptic_units::Instant;
use thiserror::Error;

use super::Firmware;
use crate::ftdi::{self, PAYLOAD, STATUS};
use crate::protocol::{Command, Framer, Leds, Report};
use crate::transport::{Request, Transport, TransportError};

const HELLO: [u8; 3] = [0x0A, 0x43, 0x0D];
const HELLO_ANSWER: [u8; 4] = [0x0A, 0x44, 0x2C, 0x0D];
/// Asks for the firmware to be taken, and is answered with itself.
const READY: u8 = 0x41;

/// How patient loading is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BootOptions {
    /// How often the whole sequence is tried. At least once.
    pub attempts: u32,
    /// How often the boot loader is greeted within an attempt.
    pub greetings: u32,
    /// How long an answer may take. The chip alone may hold bytes back for 16 ms.
    pub patience: Duration,
    /// How many packets are sent to find out whether firmware runs already.
    pub probes: u32,
    /// How long the answer to such a packet may take.
    pub probe_patience: Duration,
}

impl BootOptions {
    /// Three attempts with 100 greetings each, answers within 100 ms; 20 probes, answered within 10 ms.
    pub const DEFAULT: Self =
        Self { attempts: 3, greetings: 100, patience: Duration::from_millis(100), probes: 20, probe_patience: Duration::from_millis(10) };
}

/// How far loading has come.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Progress {
    /// An attempt begins; counted from 1.
    Attempt(u32),
    /// The boot loader is there, after this number of greetings.
    Greeted(u32),
    /// `done` bytes of `of` are over and came back right.
    Loaded {
        /// Bytes that are over.
        done: usize,
        /// Bytes of the firmware.
        of: usize,
    },
    /// An attempt failed, for this reason; if more are left, the next begins.
    Failed(BootError),
    /// The firmware runs.
    Running,
}

/// Why the firmware did not get into the device.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
pub enum BootError {
    /// The transport failed.
    #[error(transparent)]
    Transport(#[from] TransportError),
    #[error("the boot loader did not answer {greetings} greetings: is the power supply plugged in? Switch the device off and on again")]
    NoBootLoader { greetings: u32 },
    #[error("the boot loader did not get ready for the firmware: {}", match found { Some(byte) => format!("it answered {byte:#04x}, not 0x41"), None => "no answer".to_owned() })]
    NotReady {
        /// What came instead; `None` is nothing.
        found: Option<u8>,
    },
    #[error("byte {at} of the firmware is {sent:#04x} and came back as {found:#04x}: try again, with another cable or port if it stays so")]
    Echo { at: usize, sent: u8, found: u8 },
    #[error("the boot loader sent back {back} of the {of} bytes of the firmware, and no more")]
    EchoStopped { back: usize, of: usize },
    #[error("the firmware is over, and the device does not answer: is the file a firmware for the Novint Falcon?")]
    NotRunning,
}

/// Whether firmware runs already: sets the chip up for it and sees whether packets are answered. The packets ask for no force, and for the device to stay homed
/// if it is.
///
/// # Errors
///
/// [`TransportError`].
pub fn is_loaded<T: Transport + ?Sized>(transport: &mut T, options: &BootOptions) -> Result<bool, TransportError> {
    ftdi::set_up_running(transport)?;
    let packet = Command { homing: true, leds: Leds::RED, ..Command::default() }.encode();
    let mut framer = Framer::new();
    for _ in 0..options.probes.max(1) {
        transport.write(&packet)?;
        let deadline = transport.now().saturating_add(options.probe_patience);
        let mut bytes = [0; PAYLOAD];
        while let Some(rest) = rest(transport, deadline) {
            let count = transport.read(&mut bytes, rest)?;
            if bytes[..count].iter().any(|byte| framer.push::<Report>(*byte).is_some()) {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// Loads the firmware if none runs. Gives whether it had to.
///
/// # Errors
///
/// [`BootError`].
pub fn ensure_loaded<T: Transport + ?Sized>(
    transport: &mut T,
    firmware: &Firmware,
    options: &BootOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<bool, BootError> {
    if is_loaded(transport, options)? {
        progress(Progress::Running);
        return Ok(false);
    }
    load(transport, firmware, options, progress).map(|()| true)
}

/// Wakes the boot loader and gives it the firmware, whatever ran before; leaves the chip set up for the running firmware.
///
/// # Errors
///
/// [`BootError`] of the last attempt. An unplugged device is not tried again.
pub fn load<T: Transport + ?Sized>(
    transport: &mut T,
    firmware: &Firmware,
    options: &BootOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<(), BootError> {
    let mut attempt = 1;
    loop {
        progress(Progress::Attempt(attempt));
        match load_once(transport, firmware, options, progress) {
            Ok(()) => {
                progress(Progress::Running);
                return Ok(());
            }
            Err(error) => {
                progress(Progress::Failed(error));
                if attempt >= options.attempts || error == BootError::Transport(TransportError::Unplugged) {
                    return Err(error);
                }
            }
        }
        attempt += 1;
    }
}

fn load_once<T: Transport + ?Sized>(
    transport: &mut T,
    firmware: &Firmware,
    options: &BootOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<(), BootError> {
    ftdi::set_up_handshake(transport)?;
    progress(Progress::Greeted(greet(transport, options)?));
    ftdi::set_up_loading(transport)?;
    get_ready(transport, options)?;
    send(transport, firmware.bytes(), options, progress)?;
    if is_loaded(transport, options)? { Ok(()) } else { Err(BootError::NotRunning) }
}

/// Greets until the boot loader answers; gives how often.
fn greet<T: Transport + ?Sized>(transport: &mut T, options: &BootOptions) -> Result<u32, BootError> {
    for greeting in 1..=options.greetings.max(1) {
        transport.write(&HELLO)?;
        // A zero byte may come first: some ways to the device show one more than others.
        let mut answer = [0; HELLO_ANSWER.len() + 1];
        let deadline = transport.now().saturating_add(options.patience);
        let mut count = 0;
        while let Some(rest) = rest(transport, deadline) {
            count += transport.read(&mut answer[count..], rest)?;
            if matches!(&answer[..count], [0, answer @ ..] | answer if *answer == HELLO_ANSWER) {
                return Ok(greeting);
            }
            if count == answer.len() {
                break;
            }
        }
        // The rest of a broken answer would spoil the next.
        transport.control(Request::Reset, ftdi::PURGE_RX)?;
    }
    Err(BootError::NoBootLoader { greetings: options.greetings.max(1) })
}

fn get_ready<T: Transport + ?Sized>(transport: &mut T, options: &BootOptions) -> Result<(), BootError> {
    transport.write(&[READY])?;
    let mut answer = [0];
    match fill(transport, &mut answer, options.patience)? {
        0 => Err(BootError::NotReady { found: None }),
        _ if answer == [READY] => Ok(()),
        _ => Err(BootError::NotReady { found: Some(answer[0]) }),
    }
}

/// Block by block: the device sends every byte back, and the next block goes when the last one is back.
fn send<T: Transport + ?Sized>(transport: &mut T, bytes: &[u8], options: &BootOptions, progress: &mut dyn FnMut(Progress)) -> Result<(), BootError> {
    let mut done = 0;
    for block in bytes.chunks(ftdi::PACKET - STATUS) {
        transport.write(block)?;
        let mut echo = [0; PAYLOAD];
        let count = fill(transport, &mut echo[..block.len()], options.patience)?;
        if let Some(place) = (0..count).find(|place| echo[*place] != block[*place]) {
            return Err(BootError::Echo { at: done + place, sent: block[place], found: echo[place] });
        }
        done += count;
        if count < block.len() {
            return Err(BootError::EchoStopped { back: done, of: bytes.len() });
        }
        progress(Progress::Loaded { done, of: bytes.len() });
    }
    Ok(())
}

/// Reads until there is no room left or the patience ends; gives how many bytes came.
fn fill<T: Transport + ?Sized>(transport: &mut T, into: &mut [u8], patience: Duration) -> Result<usize, TransportError> {
    let deadline = transport.now().saturating_add(patience);
    let mut count = 0;
    while count < into.len() {
        let Some(rest) = rest(transport, deadline) else { break };
        count += transport.read(&mut into[count..], rest)?;
    }
    Ok(count)
}

/// The time left until a deadline; `None` when it has passed.
fn rest<T: Transport + ?Sized>(transport: &T, deadline: Instant) -> Option<Duration> {
    deadline.checked_duration_since(transport.now()).filter(|rest| !rest.is_zero())
}

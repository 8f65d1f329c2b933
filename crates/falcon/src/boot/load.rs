//! Conversation with the boot loader.

use core::time::Duration;

use cohaptic_units::Instant;
use thiserror::Error;

use super::Firmware;
use crate::ftdi::{self, PAYLOAD, STATUS};
use crate::protocol::{Command, Framer, Leds, Report};
use crate::transport::{Request, Transport, TransportError};

/// Greeting to the boot loader.
const HELLO: [u8; 3] = [0x0A, 0x43, 0x0D];
/// Answer of the boot loader to the greeting.
const HELLO_ANSWER: [u8; 4] = [0x0A, 0x44, 0x2C, 0x0D];
/// Request for the transfer of the firmware. The boot loader answers with the same byte.
const READY: u8 = 0x41;

/// Numbers of attempts and waiting times of loading.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BootOptions {
    /// Attempts of the whole sequence. At least one attempt is made, also for 0.
    pub attempts: u32,
    /// Greetings per attempt. At least one greeting is sent, also for 0.
    pub greetings: u32,
    /// Waiting time for an answer. The chip alone may delay bytes by 16 ms.
    pub patience: Duration,
    /// Packets sent to find out whether firmware runs. At least one packet is sent, also for 0.
    pub probes: u32,
    /// Waiting time for the answer to such a packet.
    pub probe_patience: Duration,
}

impl BootOptions {
    /// Three attempts with 100 greetings each and 100 ms for an answer; 20 probes with 10 ms for an answer.
    pub const DEFAULT: Self =
        Self { attempts: 3, greetings: 100, patience: Duration::from_millis(100), probes: 20, probe_patience: Duration::from_millis(10) };
}

/// Progress of loading.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Progress {
    /// An attempt begins. Attempts count from 1.
    Attempt(u32),
    /// The boot loader has answered after this number of greetings.
    Greeted(u32),
    /// `done` of `of` bytes are transferred, and came back unchanged.
    Loaded {
        /// Transferred bytes.
        done: usize,
        /// Length of the firmware \[bytes\].
        of: usize,
    },
    /// An attempt failed. The next attempt begins, if one is left.
    Failed(BootError),
    /// The firmware runs.
    Running,
}

/// Reason why the firmware was not loaded.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
#[non_exhaustive]
pub enum BootError {
    /// The transport failed.
    #[error(transparent)]
    Transport(#[from] TransportError),
    #[error("the boot loader did not answer {greetings} greetings: is the power supply plugged in? Switch the device off and on again")]
    NoBootLoader { greetings: u32 },
    #[error("the boot loader did not get ready for the firmware: {}", match found { Some(byte) => format!("it answered {byte:#04x}, not 0x41"), None => "no answer".to_owned() })]
    NotReady {
        /// Received byte; `None` if no byte came.
        found: Option<u8>,
    },
    #[error("byte {at} of the firmware is {sent:#04x} and came back as {found:#04x}: try again, with another cable or port if it stays so")]
    Echo { at: usize, sent: u8, found: u8 },
    #[error("the boot loader sent back only {back} of the {of} bytes of the firmware: try again, with another cable or port if it stays so")]
    EchoStopped { back: usize, of: usize },
    #[error("the firmware is sent, and the device does not answer: is the file a firmware for the Novint Falcon?")]
    NotRunning,
}

/// Returns whether firmware runs: sets up the chip for running firmware, and sends packets until one is answered. The packets ask for zero force, and ask a
/// homed device to stay homed.
///
/// # Errors
///
/// [`TransportError`] if a transfer fails.
pub fn is_loaded<T: Transport + ?Sized>(transport: &mut T, options: &BootOptions) -> Result<bool, TransportError> {
    ftdi::set_up_running(transport)?;
    // A packet without the homing bit would make a homed device forget its position.
    let packet = Command { homing: true, leds: Leds::RED, ..Command::default() }.encode();
    // One framer for all probes: a late answer to an earlier packet counts too.
    let mut framer = Framer::new();
    for _ in 0..options.probes.max(1) {
        // Each probe is a complete packet: the firmware answers packets only.
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

/// Loads the firmware if none runs. Returns whether it was loaded.
///
/// # Errors
///
/// [`BootError`] if loading fails.
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

/// Wakes the boot loader and loads the firmware, whatever program ran before. The chip is then set up for the running firmware.
///
/// # Errors
///
/// [`BootError`] of the last attempt. An unplugged device ends the attempts.
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
                // Greetings wake the boot loader again in the next attempt, whatever state this one left behind.
                if attempt >= options.attempts || error == BootError::Transport(TransportError::Unplugged) {
                    return Err(error);
                }
            }
        }
        attempt += 1;
    }
}

/// Makes one attempt of the whole sequence.
fn load_once<T: Transport + ?Sized>(
    transport: &mut T,
    firmware: &Firmware,
    options: &BootOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<(), BootError> {
    ftdi::set_up_handshake(transport)?;
    progress(Progress::Greeted(greet(transport, options)?));
    // Speed and DTR change after the greeting: the boot loader takes firmware only then.
    ftdi::set_up_loading(transport)?;
    get_ready(transport, options)?;
    send(transport, firmware.bytes(), options, progress)?;
    if is_loaded(transport, options)? { Ok(()) } else { Err(BootError::NotRunning) }
}

/// Greets until the boot loader answers, and returns the number of greetings.
fn greet<T: Transport + ?Sized>(transport: &mut T, options: &BootOptions) -> Result<u32, BootError> {
    for greeting in 1..=options.greetings.max(1) {
        transport.write(&HELLO)?;
        // A zero byte may precede the answer: some connections deliver one.
        let mut answer = [0; HELLO_ANSWER.len() + 1];
        let deadline = transport.now().saturating_add(options.patience);
        let mut count = 0;
        while let Some(rest) = rest(transport, deadline) {
            count += transport.read(&mut answer[count..], rest)?;
            if matches!(&answer[..count], [0, answer @ ..] | answer if *answer == HELLO_ANSWER) {
                return Ok(greeting);
            }
            // Five wrong bytes cannot become an answer by more bytes.
            if count == answer.len() {
                break;
            }
        }
        // The rest of a broken answer would be taken for a part of the next answer.
        transport.control(Request::Reset, ftdi::PURGE_RX)?;
    }
    Err(BootError::NoBootLoader { greetings: options.greetings.max(1) })
}

/// Sends the request for the transfer, and checks the answer.
fn get_ready<T: Transport + ?Sized>(transport: &mut T, options: &BootOptions) -> Result<(), BootError> {
    transport.write(&[READY])?;
    let mut answer = [0];
    match fill(transport, &mut answer, options.patience)? {
        0 => Err(BootError::NotReady { found: None }),
        _ if answer == [READY] => Ok(()),
        _ => Err(BootError::NotReady { found: Some(answer[0]) }),
    }
}

/// Sends the firmware in blocks. The device returns every byte, and a block is sent after the whole preceding block has come back.
fn send<T: Transport + ?Sized>(transport: &mut T, bytes: &[u8], options: &BootOptions, progress: &mut dyn FnMut(Progress)) -> Result<(), BootError> {
    let mut done = 0;
    // A block fills one packet of the chip from the device, so its echo needs no second packet.
    for block in bytes.chunks(ftdi::PACKET - STATUS) {
        transport.write(block)?;
        // The next block waits for the whole echo: the chip is set up without flow control.
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

/// Reads until `into` is full or the patience ends, and returns the number of bytes.
fn fill<T: Transport + ?Sized>(transport: &mut T, into: &mut [u8], patience: Duration) -> Result<usize, TransportError> {
    let deadline = transport.now().saturating_add(patience);
    let mut count = 0;
    while count < into.len() {
        let Some(rest) = rest(transport, deadline) else { break };
        count += transport.read(&mut into[count..], rest)?;
    }
    Ok(count)
}

/// Returns the time left until a deadline; `None` after the deadline.
fn rest<T: Transport + ?Sized>(transport: &T, deadline: Instant) -> Option<Duration> {
    deadline.checked_duration_since(transport.now()).filter(|rest| !rest.is_zero())
}

//! Messages between this program outside and the process that begins a command inside the namespaces.
//!
//! A channel is a pair of Unix sockets that keep the boundaries of messages. The pair is made before the namespaces, so the process inside can still reach the
//! program outside. The system closes a socket when the process ends, so the other process notices the end without a message.

use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

use rustix::net::{
    AddressFamily, RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer, SendAncillaryMessage, SendFlags, SocketFlags,
    SocketType, recvmsg, sendmsg, socketpair,
};

/// End of a channel.
#[derive(Debug)]
pub(crate) struct Channel {
    socket: OwnedFd,
}

/// Message from inside.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Report {
    /// The descriptor of the message is the device. The number tells the offloads of the device.
    Device(u8),
    /// The command runs.
    Started,
    /// The command has ended with this exit status, or with 128 plus the number of a signal.
    Ended(u8),
    /// The command could not be started: exit status, and the reason in words.
    Failed(u8, String),
}

/// Message to the inside.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Order {
    /// Start the command, with the descriptor of the message as its standard input.
    Start,
    /// Send the signal with this number to the command.
    Signal(u8),
}

/// Longest message \[bytes\].
const LONGEST: usize = 4096;

impl Channel {
    /// Returns both ends of a new channel.
    pub(crate) fn pair() -> io::Result<(Self, Self)> {
        let (one, other) = socketpair(AddressFamily::UNIX, SocketType::SEQPACKET, SocketFlags::CLOEXEC, None)?;
        Ok((Self { socket: one }, Self { socket: other }))
    }

    /// Returns the end of a channel given to this process as standard input.
    pub(crate) fn of_standard_input() -> io::Result<Self> {
        Ok(Self { socket: io::stdin().as_fd().try_clone_to_owned()? })
    }

    /// Returns the end as a descriptor for another process.
    pub(crate) fn into_descriptor(self) -> OwnedFd {
        self.socket
    }

    pub(crate) fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }

    pub(crate) fn report(&self, report: &Report, descriptor: Option<BorrowedFd<'_>>) -> io::Result<()> {
        let bytes = match report {
            Report::Device(offloads) => vec![b'D', *offloads],
            Report::Started => vec![b'S'],
            Report::Ended(status) => vec![b'E', *status],
            Report::Failed(status, why) => [&[b'F', *status], why.as_bytes()].concat(),
        };
        self.send(&bytes[..bytes.len().min(LONGEST)], descriptor)
    }

    pub(crate) fn order(&self, order: Order, descriptor: Option<BorrowedFd<'_>>) -> io::Result<()> {
        match order {
            Order::Start => self.send(b"S", descriptor),
            Order::Signal(number) => self.send(&[b'K', number], descriptor),
        }
    }

    /// Waits for a report, and returns the report with the descriptor. Returns `None` if the other process has ended.
    pub(crate) fn next_report(&self) -> io::Result<Option<(Report, Option<OwnedFd>)>> {
        let Some((bytes, descriptor)) = self.receive()? else { return Ok(None) };
        let report = match bytes.as_slice() {
            [b'D', offloads] => Report::Device(*offloads),
            [b'S'] => Report::Started,
            [b'E', status] => Report::Ended(*status),
            [b'F', status, why @ ..] => Report::Failed(*status, String::from_utf8_lossy(why).into_owned()),
            _ => return Err(strange()),
        };
        Ok(Some((report, descriptor)))
    }

    /// Waits for an order, and returns the order with the descriptor. Returns `None` if the other process has ended.
    pub(crate) fn next_order(&self) -> io::Result<Option<(Order, Option<OwnedFd>)>> {
        let Some((bytes, descriptor)) = self.receive()? else { return Ok(None) };
        let order = match bytes.as_slice() {
            b"S" => Order::Start,
            [b'K', number] => Order::Signal(*number),
            _ => return Err(strange()),
        };
        Ok(Some((order, descriptor)))
    }

    fn send(&self, bytes: &[u8], descriptor: Option<BorrowedFd<'_>>) -> io::Result<()> {
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut control = SendAncillaryBuffer::new(&mut space);
        let descriptors: Vec<BorrowedFd<'_>> = descriptor.into_iter().collect();
        if !descriptors.is_empty() {
            control.push(SendAncillaryMessage::ScmRights(&descriptors));
        }
        sendmsg(&self.socket, &[IoSlice::new(bytes)], &mut control, SendFlags::NOSIGNAL)?;
        Ok(())
    }

    fn receive(&self) -> io::Result<Option<(Vec<u8>, Option<OwnedFd>)>> {
        let mut bytes = vec![0; LONGEST];
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut control = RecvAncillaryBuffer::new(&mut space);
        let received = loop {
            match recvmsg(&self.socket, &mut [IoSliceMut::new(&mut bytes)], &mut control, RecvFlags::CMSG_CLOEXEC) {
                Ok(received) => break received,
                Err(rustix::io::Errno::INTR) => {}
                // The socket of a process killed with unread orders is reset.
                Err(rustix::io::Errno::CONNRESET) => return Ok(None),
                Err(error) => return Err(error.into()),
            }
        };
        // No message is empty, so zero bytes mean the end of the channel.
        if received.bytes == 0 {
            return Ok(None);
        }
        bytes.truncate(received.bytes);
        let descriptor = control.drain().find_map(|message| match message {
            RecvAncillaryMessage::ScmRights(mut descriptors) => descriptors.next(),
            RecvAncillaryMessage::ScmCredentials(_) | _ => None,
        });
        Ok(Some((bytes, descriptor)))
    }
}

fn strange() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "a message that this version of the program does not know")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_and_descriptors_arrive_whole_and_the_end_is_told() {
        let (outside, inside) = Channel::pair().unwrap();
        let reports = [Report::Device(2), Report::Started, Report::Ended(143), Report::Failed(127, "no such command".to_owned())];
        let (reader, mut writer) = io::pipe().unwrap();
        for report in &reports {
            inside.report(report, matches!(report, Report::Device(_)).then(|| reader.as_fd())).unwrap();
        }
        let mut device = None;
        for report in &reports {
            let (got, descriptor) = outside.next_report().unwrap().unwrap();
            assert_eq!(&got, report);
            device = device.or(descriptor);
        }
        // The descriptor is the pipe's.
        io::Write::write_all(&mut writer, b"x").unwrap();
        let mut byte = [0];
        assert_eq!(rustix::io::read(device.unwrap(), &mut byte), Ok(1));
        outside.order(Order::Signal(15), None).unwrap();
        outside.order(Order::Start, Some(reader.as_fd())).unwrap();
        assert_eq!(inside.next_order().unwrap().unwrap().0, Order::Signal(15));
        assert!(matches!(inside.next_order().unwrap(), Some((Order::Start, Some(_)))));
        drop(inside);
        assert!(outside.next_report().unwrap().is_none());
    }
}

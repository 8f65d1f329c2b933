//! Sockets of a test bed, each with the placeholder that stands for the socket where a program asks for a descriptor.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use cohaptic_sockets::Configured;

/// Socket of a test bed. `P` is a pointer to the socket.
pub(crate) struct BedSocket<P> {
    socket: P,
    /// Made when a program first asks for a descriptor.
    #[cfg(unix)]
    placeholder: std::sync::OnceLock<cohaptic_descriptors::Placeholder>,
}

impl<P> BedSocket<P> {
    fn of(socket: P) -> Self {
        Self {
            socket,
            #[cfg(unix)]
            placeholder: std::sync::OnceLock::new(),
        }
    }
}

impl<T: ?Sized> From<Arc<T>> for BedSocket<Arc<T>> {
    fn from(socket: Arc<T>) -> Self {
        Self::of(socket)
    }
}

impl<T: ?Sized> From<Box<T>> for BedSocket<Arc<T>> {
    fn from(socket: Box<T>) -> Self {
        Self::of(socket.into())
    }
}

impl<T: ?Sized> From<Box<T>> for BedSocket<Box<T>> {
    fn from(socket: Box<T>) -> Self {
        Self::of(socket)
    }
}

impl<P: Deref> BedSocket<P>
where
    P::Target: Configured,
{
    /// Returns the socket without the placeholder, after taking over the options of the placeholder.
    pub(super) fn into_inner(self) -> P {
        self.take_over();
        self.socket
    }

    /// Takes over the options that the program has set on the placeholder since it last got the descriptor.
    #[cfg(unix)]
    fn take_over(&self) {
        if let Some(placeholder) = self.placeholder.get() {
            placeholder.take_over(&*self.socket);
        }
    }

    #[cfg(not(unix))]
    fn take_over(&self) {}
}

#[cfg(unix)]
mod with_placeholder {
    use std::io;
    use std::os::fd::{BorrowedFd, OwnedFd};

    use cohaptic_descriptors::{Placeholder, Pointer, keep};
    use socket2::Type;

    use super::*;

    impl<T: ?Sized> BedSocket<Arc<T>> {
        /// Returns the socket with its placeholder.
        pub(in super::super) fn with(socket: Arc<T>, placeholder: Placeholder) -> Self {
            Self { socket, placeholder: placeholder.into() }
        }
    }

    impl<P: Pointer> BedSocket<P>
    where
        P::Target: Configured,
    {
        /// Returns the descriptor of the placeholder.
        pub(in super::super) fn descriptor(&self, kind: Type) -> io::Result<BorrowedFd<'_>> {
            if self.placeholder.get().is_none() {
                let made = Placeholder::new(kind, &*self.socket)?;
                self.socket.share(&made)?;
                // Another thread may have made a placeholder in the meantime: the first placeholder counts.
                let _ = self.placeholder.set(made);
            }
            Ok(self.placeholder.get().expect("it was made above").shown())
        }

        /// Returns the placeholder in place of the socket. The socket is kept until the placeholder comes back.
        pub(in super::super) fn into_descriptor(self, kind: Type) -> io::Result<OwnedFd> {
            self.take_over();
            let Self { socket, placeholder } = self;
            let made = match placeholder.into_inner() {
                Some(made) => made,
                None => Placeholder::new(kind, &*socket)?,
            };
            keep(made, socket)
        }
    }
}

impl<P: Deref> Deref for BedSocket<P>
where
    P::Target: Configured,
{
    type Target = P::Target;

    #[inline]
    fn deref(&self) -> &P::Target {
        // Every use of the socket passes here, so options set on the placeholder are in force before the use.
        self.take_over();
        &self.socket
    }
}

impl<P: fmt::Debug> fmt::Debug for BedSocket<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.socket.fmt(f)
    }
}

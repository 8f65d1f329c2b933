//! Halves of streams: those that borrow a stream, and those that own it together.

/// Defines the halves of the stream `$stream`, whose addresses are of type `$address`, in the present module. `$more` are further methods of halves that read.
macro_rules! halves {
    ($stream:ty, $address:ty, { $($more:tt)* }) => {
        use std::fmt;
        use std::io::{self, IoSlice, IoSliceMut};
        use std::sync::Arc;

        use real::io::{Interest, Ready};

        use $crate::net::bytes::{reader, writer};

        /// Half of a stream that reads.
        #[derive(Debug)]
        pub struct ReadHalf<'a>(pub(in $crate::net) &'a $stream);

        /// Half of a stream that writes.
        #[derive(Debug)]
        pub struct WriteHalf<'a>(pub(in $crate::net) &'a $stream);

        /// Owned half of a stream that reads.
        #[derive(Debug)]
        pub struct OwnedReadHalf(Arc<$stream>);

        /// Owned half of a stream that writes. The stream ends for its reader when this half is dropped.
        #[derive(Debug)]
        pub struct OwnedWriteHalf {
            stream: Arc<$stream>,
            shuts_when_dropped: bool,
        }

        /// Splits a stream into halves that own it together.
        pub(in $crate::net) fn halves(stream: $stream) -> (OwnedReadHalf, OwnedWriteHalf) {
            let stream = Arc::new(stream);
            (OwnedReadHalf(Arc::clone(&stream)), OwnedWriteHalf { stream, shuts_when_dropped: true })
        }

        fn reunite(read: OwnedReadHalf, write: OwnedWriteHalf) -> Result<$stream, ReuniteError> {
            if !Arc::ptr_eq(&read.0, &write.stream) {
                return Err(ReuniteError(read, write));
            }
            write.forget();
            Ok(Arc::into_inner(read.0).expect("a stream has two halves, and one is gone"))
        }

        /// Error of joining halves of different streams.
        #[derive(Debug)]
        pub struct ReuniteError(pub OwnedReadHalf, pub OwnedWriteHalf);

        impl fmt::Display for ReuniteError {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("tried to reunite halves that are not from the same socket")
            }
        }

        impl std::error::Error for ReuniteError {}

        $crate::net::halves::half!(ReadHalf<'_>, $stream, $address, |half| half.0, { $crate::net::halves::reading!(); $($more)* });
        $crate::net::halves::half!(WriteHalf<'_>, $stream, $address, |half| half.0, { $crate::net::halves::writing!(); });
        $crate::net::halves::half!(OwnedReadHalf, $stream, $address, |half| &*half.0, {
            $crate::net::halves::reading!();
            $($more)*

            /// See the method of tokio.
            pub fn reunite(self, other: OwnedWriteHalf) -> Result<$stream, ReuniteError> {
                reunite(self, other)
            }
        });
        $crate::net::halves::half!(OwnedWriteHalf, $stream, $address, |half| &*half.stream, {
            $crate::net::halves::writing!();

            /// See the method of tokio.
            pub fn reunite(self, other: OwnedReadHalf) -> Result<$stream, ReuniteError> {
                reunite(other, self)
            }

            /// See the method of tokio.
            pub fn forget(mut self) {
                self.shuts_when_dropped = false;
                drop(self);
            }
        });

        impl Drop for OwnedWriteHalf {
            fn drop(&mut self) {
                if self.shuts_when_dropped {
                    self.stream.let_write_half_go();
                }
            }
        }

        reader!(ReadHalf<'_>, |half| half.0);
        reader!(OwnedReadHalf, |half| half.0);
        writer!(WriteHalf<'_>, |half| half.0, |_half| ());
        writer!(OwnedWriteHalf, |half| half.stream, |half| half.shuts_when_dropped = false);
    };
}

/// Implements the methods of one half, of which `$half` gives the stream.
macro_rules! half {
    ($name:ty, $stream:ty, $address:ty, |$half:ident| $get:expr, { $($methods:tt)* }) => {
        impl $name {
            fn stream(&self) -> &$stream {
                let $half = self;
                $get
            }

            /// See the method of the stream.
            pub async fn ready(&self, interest: Interest) -> io::Result<Ready> {
                self.stream().ready(interest).await
            }

            /// See the method of the stream.
            pub fn peer_addr(&self) -> io::Result<$address> {
                self.stream().peer_addr()
            }

            /// See the method of the stream.
            pub fn local_addr(&self) -> io::Result<$address> {
                self.stream().local_addr()
            }

            $($methods)*
        }

        impl AsRef<$stream> for $name {
            fn as_ref(&self) -> &$stream {
                self.stream()
            }
        }
    };
}

/// Methods of a half that reads.
macro_rules! reading {
    () => {
        /// See the method of the stream.
        pub async fn readable(&self) -> io::Result<()> {
            self.stream().readable().await
        }

        /// See the method of the stream.
        pub fn try_read(&self, buffer: &mut [u8]) -> io::Result<usize> {
            self.stream().try_read(buffer)
        }

        /// See the method of the stream.
        pub fn try_read_vectored(&self, buffers: &mut [IoSliceMut<'_>]) -> io::Result<usize> {
            self.stream().try_read_vectored(buffers)
        }

        /// See the method of the stream.
        #[cfg(feature = "io-util")]
        pub fn try_read_buf<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<usize> {
            self.stream().try_read_buf(buffer)
        }
    };
}

/// Methods of a half that writes.
macro_rules! writing {
    () => {
        /// See the method of the stream.
        pub async fn writable(&self) -> io::Result<()> {
            self.stream().writable().await
        }

        /// See the method of the stream.
        pub fn try_write(&self, buffer: &[u8]) -> io::Result<usize> {
            self.stream().try_write(buffer)
        }

        /// See the method of the stream.
        pub fn try_write_vectored(&self, buffers: &[IoSlice<'_>]) -> io::Result<usize> {
            self.stream().try_write_vectored(buffers)
        }
    };
}

pub(super) use {half, halves, reading, writing};

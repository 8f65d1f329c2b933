//! Methods that all streams of bytes have: TCP, Unix streams, and the ends of pipes. Each type has one field, an `Either` of a real stream and one of a test
//! bed.

/// Reading methods.
macro_rules! reads {
    () => {
        /// See the method of the same name of tokio.
        pub async fn readable(&self) -> std::io::Result<()> {
            match &self.0 {
                $crate::net::Either::Real(stream) => stream.readable().await,
                $crate::net::Either::Bed(stream) => std::future::poll_fn(|cx| stream.poll_readable(cx)).await,
            }
        }

        /// See the method of the same name of tokio.
        pub fn poll_read_ready(&self, cx: &mut std::task::Context<'_>) -> std::task::Poll<std::io::Result<()>> {
            $crate::net::either!(&self.0, |stream| stream.poll_read_ready(cx), stream.poll_readable(cx))
        }

        /// See the method of the same name of tokio.
        pub fn try_read(&self, buffer: &mut [u8]) -> std::io::Result<usize> {
            $crate::net::either!(&self.0, |stream| stream.try_read(buffer), stream.try_read(&mut [std::io::IoSliceMut::new(buffer)]))
        }

        /// See the method of the same name of tokio.
        pub fn try_read_vectored(&self, buffers: &mut [std::io::IoSliceMut<'_>]) -> std::io::Result<usize> {
            $crate::net::either!(&self.0, |stream| stream.try_read_vectored(buffers), stream.try_read(buffers))
        }

        /// See the method of the same name of tokio.
        #[cfg(feature = "io-util")]
        pub fn try_read_buf<B: bytes::BufMut>(&self, buffer: &mut B) -> std::io::Result<usize> {
            match &self.0 {
                $crate::net::Either::Real(stream) => stream.try_read_buf(buffer),
                $crate::net::Either::Bed(stream) => {
                    $crate::net::ready::read_into(buffer, |bytes| stream.try_read(&mut [std::io::IoSliceMut::new(bytes)]))
                }
            }
        }
    };
}

/// Writing methods.
macro_rules! writes {
    () => {
        /// See the method of the same name of tokio.
        pub async fn writable(&self) -> std::io::Result<()> {
            match &self.0 {
                $crate::net::Either::Real(stream) => stream.writable().await,
                $crate::net::Either::Bed(stream) => std::future::poll_fn(|cx| stream.poll_writable(cx)).await,
            }
        }

        /// See the method of the same name of tokio.
        pub fn poll_write_ready(&self, cx: &mut std::task::Context<'_>) -> std::task::Poll<std::io::Result<()>> {
            $crate::net::either!(&self.0, |stream| stream.poll_write_ready(cx), stream.poll_writable(cx))
        }

        /// See the method of the same name of tokio.
        pub fn try_write(&self, buffer: &[u8]) -> std::io::Result<usize> {
            $crate::net::either!(&self.0, |stream| stream.try_write(buffer), stream.try_write(&[std::io::IoSlice::new(buffer)]))
        }

        /// See the method of the same name of tokio.
        pub fn try_write_vectored(&self, buffers: &[std::io::IoSlice<'_>]) -> std::io::Result<usize> {
            $crate::net::either!(&self.0, |stream| stream.try_write_vectored(buffers), stream.try_write(buffers))
        }
    };
}

/// Method that waits for readiness.
macro_rules! waits {
    () => {
        /// See the method of the same name of tokio.
        pub async fn ready(&self, interest: real::io::Interest) -> std::io::Result<real::io::Ready> {
            match &self.0 {
                $crate::net::Either::Real(stream) => stream.ready(interest).await,
                $crate::net::Either::Bed(stream) => $crate::net::ready::until(&**stream, interest).await,
            }
        }
    };
}

/// Implements a stream of bytes in both directions, and the calls for both halves of the stream.
macro_rules! byte_stream {
    ($name:ident) => {
        impl $name {
            $crate::net::bytes::waits!();
            $crate::net::bytes::reads!();
            $crate::net::bytes::writes!();

            /// See the method of the same name of tokio.
            pub fn try_io<R>(&self, interest: real::io::Interest, operation: impl FnOnce() -> std::io::Result<R>) -> std::io::Result<R> {
                match &self.0 {
                    $crate::net::Either::Real(stream) => stream.try_io(interest, operation),
                    $crate::net::Either::Bed(stream) if $crate::net::ready::ready(interest, stream.ready()?).is_empty() => {
                        Err(std::io::ErrorKind::WouldBlock.into())
                    }
                    $crate::net::Either::Bed(_) => operation(),
                }
            }

            /// See the method of the same name of tokio.
            pub async fn async_io<R>(&self, interest: real::io::Interest, mut operation: impl FnMut() -> std::io::Result<R>) -> std::io::Result<R> {
                match &self.0 {
                    $crate::net::Either::Real(stream) => stream.async_io(interest, operation).await,
                    $crate::net::Either::Bed(_) => loop {
                        self.ready(interest).await?;
                        match operation() {
                            // Another task has read the bytes, or taken the room, since the stream was ready.
                            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
                            outcome => return outcome,
                        }
                    },
                }
            }

            #[inline]
            pub(in $crate::net) fn poll_read_shared(
                &self,
                cx: &mut std::task::Context<'_>,
                buffer: &mut real::io::ReadBuf<'_>,
            ) -> std::task::Poll<std::io::Result<()>> {
                match &self.0 {
                    $crate::net::Either::Real(stream) => stream.cohaptic_read(cx, buffer),
                    $crate::net::Either::Bed(stream) => stream.poll_read(cx, buffer.initialize_unfilled()).map_ok(|count| buffer.advance(count)),
                }
            }

            #[inline]
            pub(in $crate::net) fn poll_write_shared(
                &self,
                cx: &mut std::task::Context<'_>,
                buffer: &[u8],
            ) -> std::task::Poll<std::io::Result<usize>> {
                $crate::net::either!(&self.0, |stream| stream.cohaptic_write(cx, buffer), stream.poll_write(cx, &[std::io::IoSlice::new(buffer)]))
            }

            #[inline]
            pub(in $crate::net) fn poll_write_vectored_shared(
                &self,
                cx: &mut std::task::Context<'_>,
                buffers: &[std::io::IoSlice<'_>],
            ) -> std::task::Poll<std::io::Result<usize>> {
                $crate::net::either!(&self.0, |stream| stream.cohaptic_write_vectored(cx, buffers), stream.poll_write(cx, buffers))
            }

            pub(in $crate::net) fn shut_down_shared(&self) -> std::io::Result<()> {
                $crate::net::either!(&self.0, |stream| stream.cohaptic_shut_down(), stream.shut_down())
            }

            /// Ends the stream for a half that is dropped.
            pub(in $crate::net) fn let_write_half_go(&self) {
                match &self.0 {
                    // The connection may be over already.
                    $crate::net::Either::Real(stream) => drop(stream.cohaptic_shut_down()),
                    $crate::net::Either::Bed(stream) => stream.let_write_half_go(),
                }
            }
        }

        $crate::net::bytes::reader!($name, |stream| stream);
        $crate::net::bytes::writer!($name, |stream| stream, |_writer| ());

        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

/// Implements `AsyncRead` by the calls of a stream.
macro_rules! reader {
    ($name:ty, |$reader:ident| $stream:expr) => {
        impl real::io::AsyncRead for $name {
            #[inline]
            fn poll_read(
                self: std::pin::Pin<&mut Self>,
                cx: &mut std::task::Context<'_>,
                buffer: &mut real::io::ReadBuf<'_>,
            ) -> std::task::Poll<std::io::Result<()>> {
                let $reader = &*self;
                $stream.poll_read_shared(cx, buffer)
            }
        }
    };
}

/// Implements `AsyncWrite` by the calls of a stream. `$after` is called after the end of the stream.
macro_rules! writer {
    ($name:ty, |$writer:ident| $stream:expr, |$shut:ident| $after:expr) => {
        impl real::io::AsyncWrite for $name {
            #[inline]
            fn poll_write(self: std::pin::Pin<&mut Self>, cx: &mut std::task::Context<'_>, buffer: &[u8]) -> std::task::Poll<std::io::Result<usize>> {
                let $writer = &*self;
                $stream.poll_write_shared(cx, buffer)
            }

            #[inline]
            fn poll_write_vectored(
                self: std::pin::Pin<&mut Self>,
                cx: &mut std::task::Context<'_>,
                buffers: &[std::io::IoSlice<'_>],
            ) -> std::task::Poll<std::io::Result<usize>> {
                let $writer = &*self;
                $stream.poll_write_vectored_shared(cx, buffers)
            }

            fn is_write_vectored(&self) -> bool {
                true
            }

            #[inline]
            fn poll_flush(self: std::pin::Pin<&mut Self>, _cx: &mut std::task::Context<'_>) -> std::task::Poll<std::io::Result<()>> {
                std::task::Poll::Ready(Ok(()))
            }

            fn poll_shutdown(mut self: std::pin::Pin<&mut Self>, _cx: &mut std::task::Context<'_>) -> std::task::Poll<std::io::Result<()>> {
                let outcome = {
                    let $writer = &*self;
                    $stream.shut_down_shared()
                };
                // After a failure the half keeps its duty, and ends the stream when the half is dropped.
                if outcome.is_ok() {
                    let $shut = &mut *self;
                    $after;
                }
                std::task::Poll::Ready(outcome)
            }
        }
    };
}

pub(super) use {byte_stream, reader, reads, waits, writer, writes};

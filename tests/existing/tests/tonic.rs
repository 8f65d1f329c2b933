//! tonic: a server whose connections have options, and a channel, with octets as messages.

use std::convert::Infallible;
use std::future::ready;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use bytes::{Buf, BufMut, Bytes};
use http::uri::PathAndQuery;
use http::{HeaderValue, Request, Response};
use tonic::Status;
use tonic::body::Body;
use tonic::codec::{Codec, DecodeBuf, Decoder, EncodeBuf, Encoder};
use tonic::server::UnaryService;
use tonic::transport::server::TcpIncoming;
use tonic::transport::{Endpoint, Server};

#[derive(Clone, Copy, Default)]
struct Raw;

impl Codec for Raw {
    type Encode = Bytes;
    type Decode = Bytes;
    type Encoder = Self;
    type Decoder = Self;
    fn encoder(&mut self) -> Self {
        *self
    }
    fn decoder(&mut self) -> Self {
        *self
    }
}

impl Encoder for Raw {
    type Item = Bytes;
    type Error = Status;
    fn encode(&mut self, message: Bytes, to: &mut EncodeBuf<'_>) -> Result<(), Status> {
        to.put(message);
        Ok(())
    }
}

impl Decoder for Raw {
    type Item = Bytes;
    type Error = Status;
    fn decode(&mut self, from: &mut DecodeBuf<'_>) -> Result<Option<Bytes>, Status> {
        Ok(Some(from.copy_to_bytes(from.remaining())))
    }
}

/// Answers a message with its octets backwards.
#[derive(Clone)]
struct Backwards;

impl UnaryService<Bytes> for Backwards {
    type Response = Bytes;
    type Future = std::future::Ready<Result<tonic::Response<Bytes>, Status>>;
    fn call(&mut self, request: tonic::Request<Bytes>) -> Self::Future {
        ready(Ok(tonic::Response::new(request.into_inner().iter().rev().copied().collect())))
    }
}

impl tower_service::Service<Request<Body>> for Backwards {
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response<Body>, Infallible>> + Send>>;
    fn poll_ready(&mut self, _cx: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(()))
    }
    fn call(&mut self, request: Request<Body>) -> Self::Future {
        Box::pin(async {
            let mut response = tonic::server::Grpc::new(Raw).unary(Self, request).await;
            // hyper sets the time of day where there is no date.
            response.headers_mut().insert("date", HeaderValue::from_static("Fri, 01 Jan 2027 00:00:00 GMT"));
            Ok(response)
        })
    }
}

#[test]
fn calls_are_answered() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            bed.host("server").spawn(async {
                // A listener of the standard library.
                let incoming = TcpIncoming::bind("0.0.0.0:80".parse().unwrap()).unwrap();
                let incoming = incoming.with_nodelay(Some(true)).with_keepalive(Some(Duration::from_secs(30)));
                Server::builder().serve_with_incoming(Backwards, incoming).await.unwrap();
            });
            let client = bed.host("client").spawn(async {
                let channel = Endpoint::from_static("http://server:80").tcp_keepalive(Some(Duration::from_secs(30))).connect().await.unwrap();
                let mut client = tonic::client::Grpc::new(channel);
                for size in [10, 20_000] {
                    client.ready().await.unwrap();
                    let path = PathAndQuery::from_static("/test.Octets/Backwards");
                    let message: Bytes = (0..size).map(|octet| octet as u8).collect();
                    let answer = client.unary(tonic::Request::new(message.clone()), path, Raw).await.unwrap().into_inner();
                    assert!(answer.iter().rev().eq(&message));
                }
            });
            client.await.unwrap();
        },
    );
}

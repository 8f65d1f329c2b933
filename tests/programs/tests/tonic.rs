//! tonic: a server and a client, with octets as messages.

use std::convert::Infallible;
use std::future::{Future, ready};
use std::pin::Pin;
use std::task::{Context, Poll};

use bytes::{Buf, BufMut, Bytes};
use cohaptic_testkit::Bed;
use cohaptic_testkit::hyper::Connector;
use futures_util::stream::unfold;
use hyper::http::uri::PathAndQuery;
use hyper::http::{HeaderValue, Request, Response};
use tonic::Status;
use tonic::body::Body;
use tonic::codec::{Codec, DecodeBuf, Decoder, EncodeBuf, Encoder};
use tonic::server::UnaryService;
use tonic::transport::{Endpoint, Server};

use crate::{octets, over_a_bad_link};

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
fn a_call_of_tonic() {
    over_a_bad_link(
        |bed| bed.on_tokio(),
        |bed: Bed| async move {
            let listener = bed.host("server").listen("0.0.0.0:80").unwrap();
            let incoming = unfold(listener, async |listener| Some((listener.accept().await.map(|(stream, _)| stream), listener)));
            drop(bed.host("server").spawn(async move { Server::builder().serve_with_incoming(Backwards, Box::pin(incoming)).await }));
            let channel = Endpoint::from_static("http://server").connect_with_connector(Connector::new(&bed.host("client"))).await.unwrap();
            let mut client = tonic::client::Grpc::new(channel);
            for count in [10, 20_000] {
                client.ready().await.unwrap();
                let path = PathAndQuery::from_static("/test.Octets/Backwards");
                let answer = client.unary(tonic::Request::new(octets(count).into()), path, Raw).await.unwrap().into_inner();
                assert!(answer.iter().rev().eq(&octets(count)));
            }
        },
    );
}

//! hyper: HTTP/1 and HTTP/2, and the client of hyper-util.

use std::convert::Infallible;

use bytes::Bytes;
use cohaptic_testkit::hyper::{Connector, Executor};
use cohaptic_testkit::{Bed, Host};
use http_body_util::{BodyExt, Full};
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper::{Request, Response};
use hyper_util::client::legacy::Client;
use hyper_util::rt::TokioIo;

use crate::{octets, over_a_bad_link};

/// Answers a request with its body, backwards.
async fn backwards(request: Request<Incoming>) -> Result<Response<Full<Bytes>>, Infallible> {
    let mut body = request.into_body().collect().await.unwrap().to_bytes().to_vec();
    body.reverse();
    Ok(Response::new(body.into()))
}

fn serve(host: &Host, is_two: bool) {
    let (listener, executor) = (host.listen("0.0.0.0:80").unwrap(), Executor::new(host));
    let tasks = host.clone();
    drop(host.spawn(async move {
        while let Ok((stream, _)) = listener.accept().await {
            let (io, executor) = (TokioIo::new(stream), executor.clone());
            drop(tasks.spawn(async move {
                // A client that has gone is no fault here.
                let _ = if is_two {
                    hyper::server::conn::http2::Builder::new(executor).auto_date_header(false).serve_connection(io, service_fn(backwards)).await
                } else {
                    hyper::server::conn::http1::Builder::new().auto_date_header(false).serve_connection(io, service_fn(backwards)).await
                };
            }));
        }
    }));
}

fn question(count: usize) -> (Request<Full<Bytes>>, Vec<u8>) {
    let mut answer = octets(count);
    let request = Request::post("http://server/").header("host", "server").body(answer.clone().into()).unwrap();
    answer.reverse();
    (request, answer)
}

async fn read(response: Response<Incoming>) -> Bytes {
    response.into_body().collect().await.unwrap().to_bytes()
}

#[test]
fn http_1() {
    let program = |bed: Bed| async move {
        serve(&bed.host("server"), false);
        let stream = bed.host("client").connect("server:80").await.unwrap();
        let (mut sender, connection) = hyper::client::conn::http1::handshake(TokioIo::new(stream)).await.unwrap();
        drop(bed.host("client").spawn(connection));
        for count in [10, 20_000] {
            let (request, answer) = question(count);
            assert_eq!(read(sender.send_request(request).await.unwrap()).await, answer);
        }
    };
    over_a_bad_link(|bed| bed, program);
    over_a_bad_link(|bed| bed.on_tokio(), program);
}

#[test]
fn http_2_with_requests_side_by_side() {
    over_a_bad_link(
        |bed| bed,
        |bed| async move {
            serve(&bed.host("server"), true);
            let client = bed.host("client");
            let stream = client.connect("server:80").await.unwrap();
            let (sender, connection) = hyper::client::conn::http2::handshake(Executor::new(&client), TokioIo::new(stream)).await.unwrap();
            drop(client.spawn(connection));
            let asking: Vec<_> = (0..3)
                .map(|number| {
                    let mut sender = sender.clone();
                    client.spawn(async move {
                        let (request, answer) = question(4000 * (number + 1));
                        assert_eq!(read(sender.send_request(request).await.unwrap()).await, answer);
                    })
                })
                .collect();
            for asked in asking {
                asked.await.unwrap();
            }
        },
    );
}

#[test]
fn the_client_of_hyper_util() {
    over_a_bad_link(
        |bed| bed,
        |bed| async move {
            serve(&bed.host("server"), false);
            let host = bed.host("client");
            let client = Client::builder(Executor::new(&host)).build::<_, Full<Bytes>>(Connector::new(&host));
            for count in [1, 10_000] {
                let (request, answer) = question(count);
                assert_eq!(read(client.request(request).await.unwrap()).await, answer);
            }
        },
    );
}

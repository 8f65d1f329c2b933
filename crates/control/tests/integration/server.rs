//! The server over a real socket: addresses, events, and the end.

use core::net::SocketAddr;
use core::time::Duration;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;

use cohaptic_control::{Board, ServeError, ServerConfig, Snapshot, serve};

use crate::run::{NoLinks, Run, TOKEN, empty_board};

/// Far longer than any wait here takes, so that a fault fails the test instead of blocking it.
const PATIENCE: Duration = Duration::from_secs(60);

/// Publishes a snapshot, again and again if a reader holds the board's lock.
fn publish(board: &Board, elapsed: Duration) {
    let mut snapshot = Arc::new(Snapshot { elapsed, ..Snapshot::default() });
    while let Err(refused) = board.publish(snapshot) {
        snapshot = refused;
        std::thread::yield_now();
    }
}

fn send(address: SocketAddr, request: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    stream
}

/// Sends a request and returns the whole answer as text.
fn ask(run: &Run, method: &str, path: &str, body: &str) -> String {
    let address = run.server().address();
    let length = body.len();
    let request = format!(
        "{method} {path} HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {TOKEN}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}"
    );
    let mut answer = String::new();
    send(address, &request).read_to_string(&mut answer).unwrap();
    answer
}

#[test]
fn the_board_and_the_editor_are_behind_the_routes() {
    let run = Run::still(2, 0);
    publish(&run.board, Duration::from_millis(1500));
    let state = ask(&run, "GET", "/api/state", "");
    assert!(state.starts_with("HTTP/1.1 200 OK\r\n") && state.contains("\"elapsed_s\":1.5"), "{state}");
    let changed = ask(&run, "PATCH", "/api/links/1", "{\"delay\": \"40ms\"}");
    assert!(changed.starts_with("HTTP/1.1 200 OK\r\n") && changed.contains("\"delay\":\"40ms\""), "{changed}");
    assert_eq!(*run.told.lock().unwrap(), [(vec![1], vec![("delay".to_owned(), "\"40ms\"".to_owned())])]);
    let refused = ask(&run, "PATCH", "/api/links", "{\"dlay\": \"40ms\"}");
    assert!(refused.starts_with("HTTP/1.1 422 ") && refused.contains("did you mean"), "{refused}");
    assert!(ask(&run, "GET", "/metrics", "").contains("\ncohaptic_run_elapsed_seconds 1.5\n"));
    assert!(ask(&run, "GET", "/api/histograms", "").contains("\"clocks\":["));
    assert!(ask(&run, "PATCH", "/api/links/0", &"x".repeat(65_537)).starts_with("HTTP/1.1 413 "));
}

#[test]
fn events_come_for_what_is_published_and_end_with_the_server() {
    let run = Run::still(1, 0);
    let address = run.server().address();
    let mut lines = BufReader::new(send(address, &format!("GET /api/events?token={TOKEN} HTTP/1.1\r\nHost: localhost\r\n\r\n"))).lines();
    let mut line_with = |words: &str| lines.by_ref().map(Result::unwrap).find(|line| line.contains(words)).unwrap();
    assert!(line_with("text/event-stream").to_lowercase().starts_with("content-type"));
    assert!(line_with("data:").contains("\"number\":0"), "what there is comes at once");
    assert!(line_with(": ").contains("nothing new"), "silence is told from the end");
    publish(&run.board, Duration::from_secs(7));
    assert!(line_with("event:").contains("state"));
    assert!(line_with("data:").contains("\"elapsed_s\":7.0"));
    let port = run.stop();
    // The stream of events ends, and the port is free.
    assert!(lines.all(|line| line.is_err() || line.is_ok_and(|line| !line.contains("data:"))));
    drop(std::net::TcpListener::bind(("127.0.0.1", port)).unwrap());
}

#[test]
fn other_machines_are_let_in_only_on_demand() {
    let everywhere: SocketAddr = "0.0.0.0:0".parse().unwrap();
    let refused = serve(ServerConfig::new(everywhere), empty_board(), Box::new(NoLinks)).unwrap_err();
    assert!(matches!(refused, ServeError::NotLoopback { address } if address == everywhere));
    assert!(refused.to_string().contains("ssh -L"), "{refused}");
    let allowed = ServerConfig { allow_remote: true, ..ServerConfig::new(everywhere) };
    let server = serve(allowed, empty_board(), Box::new(NoLinks)).unwrap();
    assert!(server.url().starts_with(&format!("http://127.0.0.1:{}/?token=", server.address().port())));
    assert!(server.url().ends_with(server.token().secret()));
    assert!(!format!("{server:?}").contains(server.token().secret()));
}

#[test]
fn an_address_in_use_is_said() {
    let run = Run::still(1, 0);
    let refused = serve(ServerConfig::new(run.server().address()), empty_board(), Box::new(NoLinks)).unwrap_err();
    assert!(matches!(refused, ServeError::Listen { .. }) && refused.to_string().contains("port 0"), "{refused}");
}

#[test]
fn publishing_goes_on_while_others_read() {
    let board = empty_board();
    let reader = {
        let board = Arc::clone(&board);
        std::thread::spawn(move || while board.latest().number < 1000 {})
    };
    let mut published = 0;
    while published < 1000 {
        // The board returns the snapshot if a reader holds the lock.
        match board.publish(Arc::new(Snapshot { elapsed: Duration::from_secs(published + 1), ..Snapshot::default() })) {
            Ok(before) => {
                assert_eq!(before.elapsed, Duration::from_secs(published));
                published += 1;
            }
            Err(refused) => assert_eq!(refused.elapsed, Duration::from_secs(published + 1)),
        }
    }
    reader.join().unwrap();
    assert_eq!(board.latest().snapshot.elapsed, Duration::from_secs(1000));
}

#[test]
fn what_is_no_http_does_no_harm() {
    let run = Run::still(1, 0);
    let address = run.server().address();
    for nonsense in
        ["\r\n\r\n", "GET\r\n\r\n", "\0\u{1}\u{2}\r\n\r\n", "GET / HTTP/9.9\r\n\r\n", "PATCH /api/links/0 HTTP/1.1\r\nContent-Length: -1\r\n\r\n"]
    {
        let mut stream = send(address, nonsense);
        stream.shutdown(Shutdown::Write).unwrap();
        let mut answer = Vec::new();
        // An answer and a closed connection both count as an end.
        let _read = stream.read_to_end(&mut answer);
        assert!(answer.is_empty() || answer.starts_with(b"HTTP/1.1 4"), "{nonsense:?}: {}", String::from_utf8_lossy(&answer));
    }
    assert!(ask(&run, "GET", "/api/state", "").starts_with("HTTP/1.1 200 OK"));
}

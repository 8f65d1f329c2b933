//! async-nats, and a server that hands each message to all who have subscribed to its subject.

use std::cell::RefCell;
use std::rc::Rc;

use futures_util::StreamExt;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::tcp::OwnedReadHalf;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};

/// Subject and number of a subscription, and the way to its client.
type Subscription = (String, String, UnboundedSender<Vec<u8>>);

const INFO: &str =
    "INFO {\"server_id\":\"bed\",\"server_name\":\"bed\",\"version\":\"2.12.0\",\"proto\":1,\"max_payload\":1048576,\"headers\":true}\r\n";

async fn listen_to(read: OwnedReadHalf, client: UnboundedSender<Vec<u8>>, all: Rc<RefCell<Vec<Subscription>>>) -> std::io::Result<()> {
    let (mut read, mut line) = (BufReader::new(read), String::new());
    while read.read_line(&mut line).await? > 0 {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["PING"] => drop(client.send(b"PONG\r\n".to_vec())),
            ["SUB", subject, number] => all.borrow_mut().push((subject.to_owned(), number.to_owned(), client.clone())),
            ["PUB", subject, len] => {
                let mut payload = vec![0; len.parse::<usize>().unwrap() + 2];
                read.read_exact(&mut payload).await?;
                for (_, number, other) in all.borrow().iter().filter(|(of, ..)| of == subject) {
                    let head = format!("MSG {subject} {number} {len}\r\n");
                    // A client may be gone.
                    let _ = other.send([head.as_bytes(), &payload].concat());
                }
            }
            ["CONNECT", ..] | ["PONG"] => {}
            _ => panic!("unknown words: {line}"),
        }
        line.clear();
    }
    Ok(())
}

async fn serve(stream: TcpStream, all: Rc<RefCell<Vec<Subscription>>>) {
    let (read, mut write) = stream.into_split();
    let (client, mut messages) = unbounded_channel::<Vec<u8>>();
    client.send(INFO.as_bytes().to_vec()).unwrap();
    tokio::task::spawn_local(listen_to(read, client, all));
    while let Some(message) = messages.recv().await {
        if write.write_all(&message).await.is_err() {
            return;
        }
    }
}

#[test]
fn messages_reach_a_subscriber() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            bed.host("server").spawn(async {
                let listener = TcpListener::bind("[::]:4222").await.unwrap();
                let all = Rc::default();
                loop {
                    tokio::task::spawn_local(serve(listener.accept().await.unwrap().0, Rc::clone(&all)));
                }
            });
            let client = bed.host("client").spawn(async {
                let subscriber = async_nats::connect("server:4222").await.unwrap();
                let mut orders = subscriber.subscribe("orders").await.unwrap();
                // The server knows of the subscription when its own message comes back.
                subscriber.publish("orders", "open".into()).await.unwrap();
                assert_eq!(orders.next().await.unwrap().payload, "open");
                let publisher = async_nats::connect("server:4222").await.unwrap();
                for number in 0..20_u8 {
                    publisher.publish("orders", vec![number; 2000].into()).await.unwrap();
                }
                publisher.flush().await.unwrap();
                for number in 0..20_u8 {
                    assert_eq!(orders.next().await.unwrap().payload, vec![number; 2000]);
                }
            });
            client.await.unwrap();
        },
    );
}

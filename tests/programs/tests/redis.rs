//! The client of Redis, and a server that knows two commands.

use std::collections::BTreeMap;

use cohaptic_testkit::{Bed, TcpStream};
use redis::aio::MultiplexedConnection;
use redis::{AsyncConnectionConfig, AsyncTypedCommands, RedisConnectionInfo};
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};

use crate::{octets, over_a_bad_link};

/// A number behind one of the marks of the protocol; `None` at the end.
async fn number(stream: &mut BufReader<TcpStream>) -> Option<usize> {
    let mut line = String::new();
    stream.read_line(&mut line).await.ok().filter(|count| *count > 0)?;
    line[1..].trim_end().parse().ok()
}

/// A command: an array of strings.
async fn command(stream: &mut BufReader<TcpStream>) -> Option<Vec<Vec<u8>>> {
    let mut words = Vec::new();
    for _ in 0..number(stream).await? {
        let mut word = vec![0; number(stream).await? + 2];
        stream.read_exact(&mut word).await.ok()?;
        word.truncate(word.len() - 2);
        words.push(word);
    }
    Some(words)
}

async fn serve(stream: TcpStream) {
    let mut stream = BufReader::new(stream);
    let mut values = BTreeMap::new();
    while let Some(words) = command(&mut stream).await {
        let answer = match (&words[0].to_ascii_uppercase()[..], &words[1..]) {
            (b"SET", [key, value, ..]) => {
                values.insert(key.clone(), value.clone());
                b"+OK\r\n".to_vec()
            }
            (b"GET", [key, ..]) => {
                let value: &Vec<u8> = &values[key];
                [format!("${}\r\n", value.len()).as_bytes(), value, b"\r\n"].concat()
            }
            _ => b"+OK\r\n".to_vec(),
        };
        stream.get_mut().write_all(&answer).await.unwrap();
    }
}

#[test]
fn a_client_of_redis() {
    over_a_bad_link(
        |bed| bed.on_tokio(),
        |bed: Bed| async move {
            let listener = bed.host("server").listen("0.0.0.0:6379").unwrap();
            drop(bed.host("server").spawn(async move { serve(listener.accept().await.unwrap().0).await }));
            let stream = bed.host("client").connect("server:6379").await.unwrap();
            let config = AsyncConnectionConfig::new().set_response_timeout(None);
            let (mut connection, driver) = MultiplexedConnection::new_with_config(&RedisConnectionInfo::default(), stream, config).await.unwrap();
            drop(bed.host("client").spawn(driver));
            let mut other = connection.clone();
            let (long, short) = (octets(10_000), octets(20));
            let (one, two) = tokio::join!(connection.set("one", &long[..]), other.set("two", &short[..]));
            one.unwrap();
            two.unwrap();
            let read: Option<Vec<u8>> = redis::cmd("GET").arg("one").query_async(&mut connection).await.unwrap();
            assert_eq!(read.unwrap(), octets(10_000));
        },
    );
}

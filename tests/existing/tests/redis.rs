//! The client of Redis, which sets options of its connection through the standard library and `socket2`, and a server that knows two commands.

use std::collections::BTreeMap;
use std::time::Duration;

use redis::io::tcp::{TcpSettings, socket2::TcpKeepalive};
use redis::{AsyncConnectionConfig, AsyncTypedCommands, Client, IntoConnectionInfo};
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::{TcpListener, TcpStream};

/// Reads a number that follows one of the marks of the protocol; `None` at the end.
async fn number(stream: &mut BufReader<TcpStream>) -> Option<usize> {
    let mut line = String::new();
    stream.read_line(&mut line).await.ok().filter(|count| *count > 0)?;
    line[1..].trim_end().parse().ok()
}

/// Reads a command: an array of strings.
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
fn keys_are_set_and_read() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            bed.host("server").spawn(async {
                let listener = TcpListener::bind("0.0.0.0:6379").await.unwrap();
                loop {
                    tokio::spawn(serve(listener.accept().await.unwrap().0));
                }
            });
            let client = bed.host("client").spawn(async {
                let settings = TcpSettings::default()
                    .set_nodelay(true)
                    .set_keepalive(TcpKeepalive::new().with_time(Duration::from_secs(5)))
                    .set_user_timeout(Duration::from_secs(60));
                let config = AsyncConnectionConfig::new().set_connection_timeout(None).set_response_timeout(None);
                let server = "redis://server:6379/".into_connection_info().unwrap();
                let client = Client::open(server.set_tcp_settings(settings)).unwrap();
                let mut keys = client.get_multiplexed_async_connection_with_config(&config).await.unwrap();
                for number in 0..10_u8 {
                    let value = vec![number + b'a'; 2000];
                    keys.set(number, &value[..]).await.unwrap();
                    assert_eq!(keys.get(number).await.unwrap().unwrap().into_bytes(), value);
                }
            });
            client.await.unwrap();
        },
    );
}

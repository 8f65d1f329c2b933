//! tokio-postgres and sqlx, and a server of PostgreSQL that knows two commands of the simple protocol.

use bytes::{BufMut, BytesMut};
use sqlx::postgres::{PgConnectOptions, PgConnection, PgSslMode};
use sqlx::{AssertSqlSafe, ConnectOptions, Connection, Row};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio_postgres::{NoTls, SimpleQueryMessage};

/// Question of a client whether the server knows TLS.
const SSL_REQUEST: u32 = 80_877_103;

/// Number of the type `text`.
const TEXT: i32 = 25;

/// Adds a message to `answer`.
fn message(answer: &mut BytesMut, kind: u8, write: impl FnOnce(&mut BytesMut)) {
    let mut body = BytesMut::new();
    write(&mut body);
    answer.put_u8(kind);
    answer.put_i32(i32::try_from(body.len()).unwrap() + 4);
    answer.put(body);
}

fn is_ready(answer: &mut BytesMut) {
    message(answer, b'Z', |body| body.put_u8(b'I'));
}

/// Answers `insert WORD`, and `select`, which returns a row for each word.
fn answer(query: &str, words: &mut Vec<String>) -> BytesMut {
    let mut answer = BytesMut::new();
    let tag = match query.strip_prefix("insert ") {
        Some(word) => {
            words.push(word.to_owned());
            "INSERT 0 1\0".to_owned()
        }
        None => {
            message(&mut answer, b'T', |body| {
                body.put_i16(1);
                body.put(&b"word\0"[..]);
                body.put_i32(0);
                body.put_i16(0);
                body.put_i32(TEXT);
                body.put_i16(-1);
                body.put_i32(-1);
                body.put_i16(0);
            });
            for word in &*words {
                message(&mut answer, b'D', |body| {
                    body.put_i16(1);
                    body.put_i32(i32::try_from(word.len()).unwrap());
                    body.put(word.as_bytes());
                });
            }
            format!("SELECT {}\0", words.len())
        }
    };
    message(&mut answer, b'C', |body| body.put(tag.as_bytes()));
    is_ready(&mut answer);
    answer
}

/// Serves a client until it says that it goes, or is gone.
async fn serve(mut stream: TcpStream) -> std::io::Result<()> {
    let mut words = Vec::new();
    loop {
        let mut start = vec![0; stream.read_u32().await? as usize - 4];
        stream.read_exact(&mut start).await?;
        if start[..4] != SSL_REQUEST.to_be_bytes() {
            break;
        }
        stream.write_all(b"N").await?;
    }
    let mut begin = BytesMut::new();
    message(&mut begin, b'R', |body| body.put_i32(0));
    message(&mut begin, b'S', |body| body.put(&b"server_version\x0017.0\0"[..]));
    message(&mut begin, b'K', |body| body.put_u64(7));
    is_ready(&mut begin);
    stream.write_all(&begin).await?;
    loop {
        let kind = stream.read_u8().await?;
        let mut body = vec![0; stream.read_u32().await? as usize - 4];
        stream.read_exact(&mut body).await?;
        match kind {
            b'Q' => {
                let query = std::str::from_utf8(&body).unwrap().trim_end_matches('\0');
                stream.write_all(&answer(query, &mut words)).await?;
            }
            b'X' => return Ok(()),
            other => panic!("a message {} of another protocol than the simple one", other.escape_ascii()),
        }
    }
}

async fn server() {
    let listener = TcpListener::bind("[::]:5432").await.unwrap();
    loop {
        tokio::spawn(serve(listener.accept().await.unwrap().0));
    }
}

#[test]
fn tokio_postgres_asks_and_is_answered() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            bed.host("server").spawn(server());
            let client = bed.host("client").spawn(async {
                // Keep-alive and a user timeout are set through a descriptor.
                let (client, connection) =
                    tokio_postgres::connect("host=server user=me keepalives_idle=10 tcp_user_timeout=60", NoTls).await.unwrap();
                tokio::spawn(connection);
                for number in 0..10 {
                    client.simple_query(&format!("insert {number}{}", "x".repeat(2000))).await.unwrap();
                }
                let rows = client.simple_query("select").await.unwrap();
                let words = rows.iter().filter_map(|row| match row {
                    SimpleQueryMessage::Row(row) => row.get(0),
                    _ => None,
                });
                assert!(words.map(|word| word.trim_end_matches('x')).eq(["0", "1", "2", "3", "4", "5", "6", "7", "8", "9"]));
            });
            client.await.unwrap();
        },
    );
}

#[test]
fn sqlx_asks_and_is_answered() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            bed.host("server").spawn(server());
            let client = bed.host("client").spawn(async {
                let options =
                    PgConnectOptions::new_without_pgpass().host("server").port(5432).username("me").password("").ssl_mode(PgSslMode::Disable);
                let mut client: PgConnection = options.connect().await.unwrap();
                for number in 0..10 {
                    sqlx::raw_sql(AssertSqlSafe(format!("insert {number}{}", "x".repeat(2000)))).execute(&mut client).await.unwrap();
                }
                let rows = sqlx::raw_sql("select").fetch_all(&mut client).await.unwrap();
                let words: Vec<String> = rows.iter().map(|row| row.get(0)).collect();
                assert!(words.iter().map(|word| word.trim_end_matches('x')).eq(["0", "1", "2", "3", "4", "5", "6", "7", "8", "9"]));
                client.close().await.unwrap();
            });
            client.await.unwrap();
        },
    );
}

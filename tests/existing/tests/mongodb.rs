//! The client of MongoDB, and a server that knows three commands.

use mongodb::bson::{Document, doc};
use mongodb::{Client, bson};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

/// Kinds of messages.
const OP_REPLY: i32 = 1;
const OP_QUERY: i32 = 2004;
const OP_MSG: i32 = 2013;

/// Takes a document from the beginning of `bytes`.
fn document(bytes: &mut &[u8]) -> Document {
    let (one, rest) = bytes.split_at(number(bytes) as usize);
    *bytes = rest;
    bson::deserialize_from_slice(one).unwrap()
}

fn number(bytes: &[u8]) -> i32 {
    i32::from_le_bytes(bytes[..4].try_into().unwrap())
}

/// Takes the command and the documents beside it out of a message of kind `OP_MSG`.
fn command(mut bytes: &[u8]) -> (Document, Vec<Document>) {
    let (mut command, mut documents) = (Document::new(), Vec::new());
    bytes = &bytes[4..];
    while let Some((kind, rest)) = bytes.split_first() {
        bytes = rest;
        if *kind == 0 {
            command = document(&mut bytes);
            continue;
        }
        let (mut section, rest) = bytes.split_at(number(bytes) as usize);
        let name = section[4..].iter().position(|byte| *byte == 0).unwrap();
        (bytes, section) = (rest, &section[4 + name + 1..]);
        while !section.is_empty() {
            documents.push(document(&mut section));
        }
    }
    (command, documents)
}

fn answer(command: &Document, documents: Vec<Document>, kept: &mut Vec<Document>) -> Document {
    match command.keys().next().unwrap().as_str() {
        "hello" | "isMaster" | "ismaster" => {
            doc! { "ok": 1.0, "helloOk": true, "isWritablePrimary": true, "ismaster": true, "minWireVersion": 0, "maxWireVersion": 25,
            "maxBsonObjectSize": 16_777_216, "maxMessageSizeBytes": 48_000_000, "maxWriteBatchSize": 100_000, "readOnly": false }
        }
        "insert" => {
            let count = i32::try_from(documents.len()).unwrap();
            kept.extend(documents);
            doc! { "ok": 1.0, "n": count }
        }
        "find" => doc! { "ok": 1.0, "cursor": { "id": 0_i64, "ns": "shop.orders", "firstBatch": kept.clone() } },
        _ => doc! { "ok": 1.0 },
    }
}

async fn serve(mut stream: TcpStream) -> std::io::Result<()> {
    let mut kept = Vec::new();
    loop {
        let [len, id, _, kind] = [stream.read_i32_le().await?, stream.read_i32_le().await?, stream.read_i32_le().await?, stream.read_i32_le().await?];
        let mut body = vec![0; len as usize - 16];
        stream.read_exact(&mut body).await?;
        let (kind, mut bytes, command, documents) = if kind == OP_QUERY {
            // Flags, a name that ends with a zero, and two numbers precede the command.
            let name = body[4..].iter().position(|byte| *byte == 0).unwrap();
            let head = [0_i32, 0, 0, 0, 1].map(i32::to_le_bytes).concat();
            (OP_REPLY, head, document(&mut &body[4 + name + 1 + 8..]), Vec::new())
        } else {
            assert_eq!(kind, OP_MSG);
            let (command, documents) = command(&body);
            (OP_MSG, vec![0; 5], command, documents)
        };
        bytes.extend(bson::serialize_to_vec(&answer(&command, documents, &mut kept)).unwrap());
        let head = [i32::try_from(bytes.len()).unwrap() + 16, 0, id, kind].map(i32::to_le_bytes).concat();
        stream.write_all(&[head, bytes].concat()).await?;
    }
}

#[test]
fn documents_are_kept_and_found() {
    // The client draws the names of documents from the system, so that the contents of packets differ.
    crate::over_lossy_links(
        |bed| bed.without_digests(),
        async |bed| {
            bed.host("server").spawn(async {
                let listener = TcpListener::bind("[::]:27017").await.unwrap();
                loop {
                    tokio::spawn(serve(listener.accept().await.unwrap().0));
                }
            });
            let client = bed.host("client").spawn(async {
                let client = Client::with_uri_str("mongodb://server:27017/?retryWrites=false").await.unwrap();
                let orders = client.database("shop").collection::<Document>("orders");
                for number in 0..10 {
                    orders.insert_one(doc! { "number": number, "text": "x".repeat(2000) }).await.unwrap();
                }
                let mut found = orders.find(doc! {}).await.unwrap();
                for number in 0..10 {
                    assert!(found.advance().await.unwrap());
                    assert_eq!(found.current().get_i32("number").unwrap(), number);
                }
            });
            client.await.unwrap();
        },
    );
}

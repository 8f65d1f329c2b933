//! mini-redis: its server and its client, with `select!` and `signal::ctrl_c` in them.

use cohaptic_testkit::Bed;
use mini_redis::{client, server};
use tokio::net::TcpListener;

async fn serve() {
    let listener = TcpListener::bind("0.0.0.0:6379").await.unwrap();
    server::run(listener, tokio::signal::ctrl_c()).await.unwrap();
}

async fn set_and_get(bed: Bed) {
    bed.host("server").spawn(serve());
    let client = bed.host("client").spawn(async {
        let mut keys = client::connect("server:6379").await.unwrap();
        assert_eq!(keys.get("nothing").await.unwrap(), None);
        for number in 0..20 {
            let (key, value) = (format!("key {number}"), vec![number; 2000]);
            keys.set(&key, value.clone().into()).await.unwrap();
            assert_eq!(keys.get(&key).await.unwrap().unwrap(), value);
        }
    });
    client.await.unwrap();
}

#[test]
fn keys_are_set_and_read() {
    crate::over_lossy_links(|bed| bed, set_and_get);
}

#[test]
fn messages_reach_a_subscriber() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            bed.host("server").spawn(serve());
            let subscriber = bed.host("client").spawn(async {
                let mut subscriber = client::connect("server:6379").await.unwrap().subscribe(vec!["news".to_owned()]).await.unwrap();
                for number in 0..10_u8 {
                    let message = subscriber.next_message().await.unwrap().unwrap();
                    assert_eq!((message.channel.as_str(), &*message.content), ("news", &[number][..]));
                }
            });
            let publisher = bed.host("client").spawn(async {
                let mut publisher = client::connect("server:6379").await.unwrap();
                // Nobody hears what is published before there is a subscriber.
                while publisher.publish("news", vec![0].into()).await.unwrap() == 0 {}
                for number in 1..10 {
                    publisher.publish("news", vec![number].into()).await.unwrap();
                }
            });
            publisher.await.unwrap();
            subscriber.await.unwrap();
        },
    );
}

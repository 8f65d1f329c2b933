use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::links_like;
use cohaptic_testkit::{Bed, Testbed};
use network_test::ask;

async fn three_questions(bed: Bed) {
    let server = bed.host("server").bind("0.0.0.0:7").unwrap();
    bed.host("server").spawn(async move {
        let mut question = [0];
        while let Ok((_, from)) = server.recv_from(&mut question).await {
            server.send_to(&[question[0], question[0] + 100], from).await.unwrap();
        }
    });
    let client = bed.host("client").bind("0.0.0.0:0").unwrap();
    client.connect("server:7").await.unwrap();
    for question in 0..3 {
        assert_eq!(ask(&client, question).await, question + 100);
    }
}

#[test]
fn a_dish_in_europe_asks_a_server_in_america() {
    Testbed::new(["client", "server"]).access("client", "starlink").links("transatlantic").run(three_questions);
}

proptest! {
    #[test]
    fn a_phone_in_any_car_is_answered(phone in links_like("lte-driving")) {
        Testbed::new(["client", "server"]).access("client", phone).run(three_questions);
    }
}

#[cfg(test)]
use cohaptic_testkit::{Testbed, strategies::any_network};
use cohaptic_testkit::{UdpSocket, proptest::proptest, time};

pub async fn ask(socket: &UdpSocket, question: u8) -> u8 {
    let mut answer = [0];
    loop {
        socket.send(&[question]).await.unwrap();
        if time::timeout(std::time::Duration::from_millis(200), socket.recv(&mut answer)).await.is_ok() {
            return answer[0];
        }
    }
}

proptest! {
    #[test]
    fn each_question_has_its_own_answer(network in any_network(2)) {
        Testbed::new(["client", "server"]).network(&network).run(|bed| async move {
            let server = bed.host("server").bind("0.0.0.0:7").unwrap();
            bed.host("server").spawn(async move {
                let mut question = [0];
                while let Ok((_, from)) = server.recv_from(&mut question).await {
                    server.send_to(&[question[0] + 100], from).await.unwrap();
                }
            });
            let client = bed.host("client").bind("0.0.0.0:0").unwrap();
            client.connect("server:7").await.unwrap();
            for question in 0..10 {
                assert_eq!(ask(&client, question).await, question + 100);
            }
        });
    }
}

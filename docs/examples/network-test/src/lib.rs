use std::time::Duration;

use cohaptic_testkit::{UdpSocket, time};

/// An answer is two bytes: the question that it belongs to, and the answer itself.
pub async fn ask(socket: &UdpSocket, question: u8) -> u8 {
    let mut answer = [0; 2];
    loop {
        socket.send(&[question]).await.unwrap();
        let again = time::now() + Duration::from_millis(200);
        while time::timeout(again - time::now(), socket.recv(&mut answer)).await.is_ok() {
            if answer[0] == question {
                return answer[1];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_testkit::proptest::prelude::*;
    use cohaptic_testkit::strategies::any_network;
    use cohaptic_testkit::{Bed, Testbed};

    use super::ask;

    async fn ten_questions(bed: Bed) {
        let server = bed.host("server").bind("0.0.0.0:7").unwrap();
        bed.host("server").spawn(async move {
            let mut question = [0];
            while let Ok((_, from)) = server.recv_from(&mut question).await {
                server.send_to(&[question[0], question[0] + 100], from).await.unwrap();
            }
        });
        let client = bed.host("client").bind("0.0.0.0:0").unwrap();
        client.connect("server:7").await.unwrap();
        for question in 0..10 {
            assert_eq!(ask(&client, question).await, question + 100);
        }
    }

    proptest! {
        #[test]
        fn each_question_has_its_own_answer(network in any_network(2)) {
            Testbed::new(["client", "server"]).network(&network).run(ten_questions);
        }
    }

    #[test]
    fn each_question_has_its_own_answer_again() {
        Testbed::new(["client", "server"]).link("client", "server", "delay 210ms").run(ten_questions);
    }
}

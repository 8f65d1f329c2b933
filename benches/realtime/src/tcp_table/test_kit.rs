//! The connections on the test kit, in virtual time.

use std::error::Error;
use std::io;

use cohaptic_testkit::{TcpStream, Testbed, time};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

use crate::{QUESTION, Times, Work};

/// Connections one after the other, each in a run with a seed of its own.
pub(crate) fn times(words: &str, work: Work, count: u32) -> Result<Times, Box<dyn Error>> {
    (0..count).map(|seed| Ok(one(words, work, seed.into())?)).collect()
}

fn one(words: &str, work: Work, seed: u64) -> io::Result<std::time::Duration> {
    Testbed::new(["client", "server"]).links(words).seed(seed).run(move |bed| async move {
        let listener = bed.host("server").listen("0.0.0.0:80")?;
        drop(bed.host("server").spawn(async move { serve(listener.accept().await?.0, work).await }));
        let mut begin = time::now();
        let mut stream = bed.host("client").connect("server:80").await?;
        match work {
            Work::Gives(octets) => {
                let mut chunk = vec![0; 65_536];
                let mut left = octets;
                while left > 0 {
                    match stream.read(&mut chunk).await? {
                        0 => return Err(io::ErrorKind::UnexpectedEof.into()),
                        count => left -= count,
                    }
                }
            }
            Work::Answers(questions) => {
                begin = time::now();
                for _ in 0..questions {
                    stream.write_all(&[7; QUESTION]).await?;
                    stream.read_exact(&mut [0; QUESTION]).await?;
                }
            }
        }
        Ok(time::now().saturating_duration_since(begin))
    })
}

async fn serve(mut stream: TcpStream, work: Work) -> io::Result<()> {
    match work {
        Work::Gives(octets) => stream.write_all(&vec![7; octets]).await?,
        Work::Answers(questions) => {
            for _ in 0..questions {
                stream.read_exact(&mut [0; QUESTION]).await?;
                stream.write_all(&[7; QUESTION]).await?;
            }
        }
    }
    stream.read(&mut [0]).await.map(drop)
}

//! Before anything else: HELLO, again and again, because a real Uno is in its boot loader for a second or two after its
//! port was opened.

use std::time::{Duration, Instant};

use light_protocol::{Command, Hello, LightProtocolError, Message};

use crate::clock::{BoardClock, Exchange};
use crate::error::LinkError;
use crate::line::{Arrived, Line, Sent};

const PATIENCE: Duration = Duration::from_millis(3500);
const AGAIN_AFTER: Duration = Duration::from_millis(250);

/// Who answered, and what its answer said about its clock.
pub(crate) struct Greeted {
    pub(crate) hello: Hello,
    pub(crate) clock: BoardClock,
}

pub(crate) async fn greet(line: &mut Line) -> Result<Greeted, LinkError> {
    let deadline = Instant::now() + PATIENCE;
    while Instant::now() < deadline {
        let sent = line.send(&Command::HELLO).await?;
        if let Ok(answer) = tokio::time::timeout(AGAIN_AFTER, answer(line, sent)).await {
            return answer;
        }
    }
    Err(LinkError::NoAnswer {
        port: line.port().to_owned(),
        waited: PATIENCE,
    })
}

/// Waits for a firmware's answer; everything else on the line is of an earlier conversation.
async fn answer(line: &mut Line, mut sent: Sent) -> Result<Greeted, LinkError> {
    loop {
        let arrived = line.receive().await?;
        match arrived.content {
            // The number tells an answer to this HELLO from one to an earlier, which would say nothing of the clock.
            Ok(received) if received.sequence_number == sent.number => {
                if let Message::Hello(hello) = received.message {
                    return Ok(greeted(hello, sent, &arrived));
                }
            }
            // It has just started and did not hear what was sent before.
            Ok(received) if matches!(received.message, Message::Boot(_)) => sent = line.send(&Command::HELLO).await?,
            Err(source @ (LightProtocolError::VersionMismatch { .. } | LightProtocolError::WrongFirmware { .. })) => {
                return Err(LinkError::OtherFirmware {
                    port: line.port().to_owned(),
                    source,
                });
            }
            Ok(_) | Err(_) => {}
        }
    }
}

fn greeted(hello: Hello, sent: Sent, arrived: &Arrived) -> Greeted {
    let mut clock = BoardClock::new(sent.at);
    clock.add(hello.at, &Exchange::new(sent, arrived));
    Greeted { hello, clock }
}

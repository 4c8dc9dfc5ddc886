//! Shows whether RustDDS as published still loses large samples, and so whether our patch is still needed.
//!
//! Sends one 4.7 MB sample between two participants of this process, over loopback, reliable, with socket buffers of
//! the kernel's default size. Exit code 0: lost, the patch is needed; 1: it arrived, try without the patch.

use std::net::Ipv4Addr;
use std::process::ExitCode;
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustdds::policy::{History, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, DomainParticipantStatusEvent, GUID, QosPolicies, QosPolicyBuilder,
    RTPSEntity, StatusEvented, TopicKind,
};
use serde::{Deserialize, Serialize};

/// A 1536 x 1536 mono16 image.
const BYTES: usize = 1536 * 1536 * 2;
const KERNEL_DEFAULT_BUFFER: usize = 212_992;
const DOMAIN: u16 = 97;
const MATCH_PATIENCE: Duration = Duration::from_secs(10);
const SAMPLE_PATIENCE: Duration = Duration::from_secs(10);
const POLL: Duration = Duration::from_millis(20);

#[derive(Debug, Serialize, Deserialize)]
struct Sample {
    data: Vec<u8>,
}

fn participant() -> Result<DomainParticipant, Box<dyn std::error::Error>> {
    let builder = DomainParticipantBuilder::new(DOMAIN).with_only_networks([Ipv4Addr::LOCALHOST]);
    Ok(builder.socket_receive_buffer_size(KERNEL_DEFAULT_BUFFER).build()?)
}

fn qos() -> QosPolicies {
    let reliability = Reliability::Reliable {
        max_blocking_time: rustdds::Duration::from_secs(2),
    };
    QosPolicyBuilder::new()
        .reliability(reliability)
        .history(History::KeepLast { depth: 1 })
        .build()
}

fn main() -> Result<ExitCode, Box<dyn std::error::Error>> {
    let (sender, receiver) = (participant()?, participant()?);
    let topic = |participant: &DomainParticipant| {
        participant.create_topic("large".into(), "Sample".into(), &qos(), TopicKind::NoKey)
    };
    let writer = sender
        .create_publisher(&qos())?
        .create_datawriter_no_key_cdr::<Sample>(&topic(&sender)?, None)?;
    let mut reader = receiver
        .create_subscriber(&qos())?
        .create_datareader_no_key_cdr::<Sample>(&topic(&receiver)?, None)?;

    let (started, events) = (Instant::now(), sender.status_listener());
    while !matched(events.try_recv_status(), writer.guid()) {
        if started.elapsed() > MATCH_PATIENCE {
            return Err("the two participants did not find each other: this says nothing of large samples".into());
        }
        sleep(POLL);
    }
    sleep(POLL * 50); // the other direction of the match
    writer.write(Sample { data: vec![7; BYTES] }, None)?;
    let sent = Instant::now();
    while sent.elapsed() < SAMPLE_PATIENCE {
        if let Some(sample) = reader.take_next_sample()? {
            let bytes = sample.value().data.len();
            println!(
                "{bytes} bytes arrived after {:.2} s: try without the patch",
                sent.elapsed().as_secs_f64()
            );
            return Ok(ExitCode::FAILURE);
        }
        sleep(POLL);
    }
    println!("{BYTES} bytes were lost ({SAMPLE_PATIENCE:?} waited): the patch is still needed");
    Ok(ExitCode::SUCCESS)
}

fn matched(event: Option<DomainParticipantStatusEvent>, writer: GUID) -> bool {
    matches!(event, Some(DomainParticipantStatusEvent::RemoteReaderMatched { local_writer, .. }) if local_writer == writer)
}

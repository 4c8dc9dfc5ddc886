//! Serves a moving test picture until Ctrl-C.
//!
//! ```text
//! cargo run -p gige_vision --example 01_serve [-- ADDRESS]      # default 127.0.0.2
//! arv-tool-0.8                                                  # lists it
//! arv-tool-0.8 -a 127.0.0.2 values                              # its features
//! arv-camera-test-0.8 -n Rakelight-Simulated-TEST1 --duration=5 # frames
//! ```

use std::net::Ipv4Addr;
use std::time::Duration;

use anyhow::Context;
use bytes::Bytes;
use gige_vision::{DeviceConfig, FrameRequest, Server};

fn main() -> anyhow::Result<()> {
    let address = std::env::args().nth(1).unwrap_or_else(|| "127.0.0.2".into());
    let ip: Ipv4Addr = address
        .parse()
        .with_context(|| format!("{address:?} is no IPv4 address"))?;
    let config = DeviceConfig {
        sensor_width: 640,
        sensor_height: 480,
        ..DeviceConfig::new("TEST1", ip)
    };
    let server = Server::start(&config, picture)?;
    println!("A camera at {}. Look at it from another terminal:", server.address());
    println!("  arv-tool-0.8                                                    list it");
    println!("  arv-tool-0.8 -a {ip} values                              read its features");
    println!("  arv-camera-test-0.8 -n Rakelight-Simulated-TEST1 --duration=5   receive frames");
    println!("  arv-viewer-0.8                                                  see the picture move");
    println!("Ctrl-C ends it.");
    let mut frames = 0;
    loop {
        std::thread::sleep(Duration::from_secs(1));
        let counters = server.counters();
        if counters.frames_sent != frames {
            println!(
                "{} frames sent, {} packets again",
                counters.frames_sent, counters.packets_resent
            );
            frames = counters.frames_sent;
        }
    }
}

/// A ramp with a bright bar that moves 8 columns per frame.
fn picture(request: &FrameRequest) -> Bytes {
    let bar = request.index.wrapping_mul(8) % request.width;
    let samples: Vec<u16> = (0..request.height)
        .flat_map(|_| 0..request.width)
        .map(|x| {
            let in_bar = x.wrapping_sub(bar) < 16;
            let ramp = (u64::from(x) * 0x8000 / u64::from(request.width)) as u16;
            if in_bar { u16::MAX } else { ramp }
        })
        .collect();
    request.pixel_format.pack(&samples).into()
}

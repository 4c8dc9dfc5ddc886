//! A client of the light controller, at the other end of its serial port.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::{Duration, Instant};

use light_protocol::{Command, EndReason, Host, Message, Panels, Sequence, Step, TriggerPulse, Triggers};
use rustix::fs::OFlags;

use crate::PATIENCE;

pub(crate) struct Controller {
    port: File,
    host: Host,
}

impl Controller {
    /// A board that is just starting hears nothing, so it is greeted again.
    pub(crate) fn open(port: &Path) -> Self {
        let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
        let mut options = OpenOptions::new();
        options.read(true).write(true).custom_flags(flags.bits() as i32);
        let mut controller = Self {
            port: options.open(port).expect("the terminal opens"),
            host: Host::new(),
        };
        let hello = |message: &Message| matches!(message, Message::Hello(_)).then_some(());
        let greeted = (0..20).any(|_| {
            controller.send(&Command::HELLO);
            controller.hear(Duration::from_millis(250), hello).is_some()
        });
        assert!(greeted, "the firmware answers HELLO");
        controller
    }

    fn send(&mut self, command: &Command) {
        let (_, bytes) = self.host.send(command);
        self.port.write_all(&bytes).expect("the terminal takes a frame");
    }

    fn hear<T>(&mut self, patience: Duration, wanted: impl Fn(&Message) -> Option<T>) -> Option<T> {
        let deadline = Instant::now() + patience;
        let mut byte = [0];
        while Instant::now() < deadline {
            match self.port.read(&mut byte) {
                Ok(1) => {
                    let message = self.host.receive(byte[0]).and_then(Result::ok);
                    if let Some(found) = message.and_then(|received| wanted(&received.message)) {
                        return Some(found);
                    }
                }
                Ok(_) => panic!("the terminal hung up"),
                Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::sleep(Duration::from_millis(1)),
                Err(error) => panic!("{error}"),
            }
        }
        None
    }

    /// One step per entry, with these panels lit and both cameras triggered 200 us later.
    pub(crate) fn run(&mut self, panels: &[Panels]) {
        let steps: Vec<_> = panels
            .iter()
            .map(|&panels| Step {
                panels,
                triggers: Triggers::BOTH,
                on_micros: 2900,
                gap_micros: 1000,
            })
            .collect();
        let pulse = TriggerPulse {
            delay_micros: 200,
            width_micros: 300,
        };
        self.send(&Command::Sequence(Sequence::new(pulse, &steps).expect("in range")));
        let ended = |message: &Message| match message {
            Message::Ended(ended) => Some(ended.reason),
            _ => None,
        };
        assert_eq!(self.hear(PATIENCE, ended), Some(EndReason::Complete));
    }

    /// Dark, then L1 to L7.
    pub(crate) fn capture(&mut self) {
        let panels: Vec<_> = (0..=7)
            .map(|panel| Panels::single(panel).unwrap_or(Panels::NONE))
            .collect();
        self.run(&panels);
    }
}

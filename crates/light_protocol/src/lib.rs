//! The light controller's protocol: typed commands, replies and events, and the frames that carry them as bytes.
//!
//! It opens no port, keeps no time and allocates nothing (`no_std`): bytes go in and out as values, and whoever owns the
//! line decides when. The other side, the controller's firmware, is in this crate's folder `firmware`; both are tested
//! against `golden_frames.txt`.
//!
//! ```
//! use light_protocol::{Command, Host, Panels, Sequence, Step, TriggerPulse, Triggers};
//!
//! let pulse = TriggerPulse { delay_micros: 300, width_micros: 500 };
//! let dark = Step { panels: Panels::NONE, triggers: Triggers::BOTH, on_micros: 2500, gap_micros: 500 };
//! let lit = Step { panels: Panels::single(1)?, ..dark };
//! let mut host = Host::new();
//! let (sequence_number, bytes) = host.send(&Command::Sequence(Sequence::new(pulse, &[dark, lit])?));
//! // ... write `bytes` to the port; then push each byte that comes back:
//! # let from_port: [u8; 0] = [];
//! for received in from_port.into_iter().filter_map(|byte| host.receive(byte)) {
//!     println!("to {sequence_number}: {:?}", received?);
//! }
//! # assert_eq!((sequence_number, bytes.len()), (1, 32));
//! # Ok::<(), light_protocol::LightProtocolError>(())
//! ```
//!
//! # Frames
//!
//! On the line (115200 baud, 8N1): `00`, then the body encoded by COBS (consistent overhead byte stuffing), then `00`.
//! The body is `kind u8, sequence number u8, payload, CRC u16`; the CRC (polynomial 0x1021, start 0xFFFF, most
//! significant bit first) covers everything before it. Numbers are little-endian. A reply has its command's sequence
//! number; an event that of the SET or SEQ it tells of; 0 is nobody's.
//!
//! | kind | name | payload, in order |
//! |---|---|---|
//! | `01` | HELLO | protocol u8 |
//! | `02` | OFF | none |
//! | `03` | SET | panels u8, on-time u16 ms (1..=60000) |
//! | `04` | SEQ | trigger delay u16 us, trigger width u16 us, count u8 (1..=16), then per step: panels u8, triggers u8, on-time u32 us, gap u32 us |
//! | `05` | PING | none |
//! | `81` | HELLO reply | protocol u8, firmware id `RKLT`, version 3 x u8, reset cause u8, panels u8, triggers u8, steps u8, duty u8 %, watchdog u16 ms, longest SET u16 ms, longest step u32 us, stamp u32 us |
//! | `82` | ACK | command u8, stamp u32 us, panels lit u8 |
//! | `83` | NAK | command u8, reason u8, index u8, allowed u32 |
//! | `91` | BOOT | as the HELLO reply |
//! | `92` | STEP | index u8, panels u8, triggers u8, on at u32 us, trigger at u32 us (0: none), off at u32 us |
//! | `93` | ENDED | command u8 (SET or SEQ), reason u8, steps done u8, stamp u32 us |
//!
//! Masks: bit 0 = L1 .. bit 6 = L7; bit 0 = trigger of C1, bit 1 = of C2. Stamps are the firmware's clock, which wraps
//! after 71.6 minutes ([`BoardTime`]). An ACK's stamp is the time of the port write; of a SEQ, the time at which its
//! first step will start.
//!
//! # Rules the firmware keeps
//!
//! - Before a HELLO with its own protocol version it refuses every other command, so a host notices a reset; the first
//!   eight bytes of a HELLO reply have this form in every version. HELLO turns the lights off.
//! - 500 ms without a valid frame turn the lights off: ping during longer SETs and SEQs.
//! - A SET takes over from a SET; during a SEQ, SET and SEQ are refused and OFF aborts. Each SET or SEQ that was
//!   acknowledged ends with one ENDED. A SET or SEQ that is refused for another reason than `Busy` or its length still
//!   ends the SET before it.
//! - Per panel: at most 60 s on at a stretch and 50 % of the time in the long run; a command that would exceed what is
//!   left is refused. A step is lit for 200 us to 1 s, a gap lasts 100 us to 1 s, edges within a step are 64 us apart.
//! - A valid encoding with a wrong CRC is answered by a NAK with sequence number 0; other garbage is dropped.

#![no_std]

mod board_time;
mod command;
mod error;
mod fields;
mod frame;
mod host;
mod masks;
mod message;
mod refusal;
mod sequence;

pub use board_time::BoardTime;
pub use command::{Command, CommandKind};
pub use error::LightProtocolError;
pub use frame::{Frame, FrameDecoder, MAX_FRAME, MAX_PAYLOAD, Packet};
pub use host::{Host, Received};
pub use masks::{PANEL_COUNT, Panels, Triggers};
pub use message::{Ack, EndReason, Ended, Hello, Message, ResetCause, StepReport};
pub use refusal::{Refusal, RefusalReason};
pub use sequence::{MAX_STEPS, Sequence, Step, TriggerPulse};

/// Version of the protocol that this crate speaks.
pub const PROTOCOL_VERSION: u8 = 1;
/// What the light controller's firmware calls itself.
pub const FIRMWARE_ID: [u8; 4] = *b"RKLT";
/// Speed of the line, baud; 8 data bits, no parity, 1 stop bit.
pub const BAUD: u32 = 115_200;
/// Longest on-time of a SET, milliseconds.
pub const MAX_SET_MILLIS: u16 = 60_000;

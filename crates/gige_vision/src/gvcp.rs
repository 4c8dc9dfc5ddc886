//! The control protocol (GVCP): commands of the host and answers of the device.

use crate::GigeVisionError;
use crate::wire::Reader;

/// The port a GigE Vision device listens on.
pub const GVCP_PORT: u16 = 3956;
/// Most bytes of memory that one command reads or writes.
pub const MAX_MEMORY_BYTES: usize = 536;
/// Bytes of a discovery answer: the bootstrap registers from 0.
pub const DISCOVERY_BYTES: usize = 0xf8;

const COMMAND_KEY: u8 = 0x42;
const HEADER_BYTES: usize = 8;
const FLAG_ACKNOWLEDGE: u8 = 0x01;
const FLAG_EXTENDED_IDS: u8 = 0x10;

const DISCOVERY: u16 = 0x0002;
const PACKET_RESEND: u16 = 0x0040;
const READ_REGISTERS: u16 = 0x0080;
const WRITE_REGISTERS: u16 = 0x0082;
const READ_MEMORY: u16 = 0x0084;
const WRITE_MEMORY: u16 = 0x0086;
const PENDING_ANSWER: u16 = 0x0089;

/// Why a device refuses a command. On the wire 0x8000 is added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Refusal {
    /// The command does not exist here.
    NotImplemented = 1,
    /// A value out of range, or a body that makes no sense.
    InvalidParameter = 2,
    /// No such register.
    InvalidAddress = 3,
    /// The register cannot be written, or not now.
    WriteProtected = 4,
    /// Address or length is not a multiple of four.
    BadAlignment = 5,
    /// Another client holds control.
    AccessDenied = 6,
    /// The device is busy.
    Busy = 7,
}

impl Refusal {
    const ALL: [Self; 7] = [
        Self::NotImplemented,
        Self::InvalidParameter,
        Self::InvalidAddress,
        Self::WriteProtected,
        Self::BadAlignment,
        Self::AccessDenied,
        Self::Busy,
    ];
}

/// What the host asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Command {
    /// Who is there?
    Discovery,
    /// Read registers at these addresses.
    ReadRegisters(Vec<u32>),
    /// Write (address, value) in this order.
    WriteRegisters(Vec<(u32, u32)>),
    /// Read `count` bytes.
    ReadMemory {
        /// First byte; a multiple of four.
        address: u32,
        /// A multiple of four, at most [`MAX_MEMORY_BYTES`].
        count: u16,
    },
    /// Write bytes.
    WriteMemory {
        /// First byte; a multiple of four.
        address: u32,
        /// A multiple of four bytes, at most [`MAX_MEMORY_BYTES`].
        data: Vec<u8>,
    },
    /// Send these packets of the stream again.
    PacketResend {
        /// Block (frame) they belong to.
        block_id: u64,
        /// First packet, 24 bits.
        first: u32,
        /// Last packet, included, 24 bits.
        last: u32,
        /// Whether the block id has 64 bits on the wire.
        extended: bool,
    },
}

impl Command {
    fn code(&self) -> u16 {
        match self {
            Self::Discovery => DISCOVERY,
            Self::ReadRegisters(_) => READ_REGISTERS,
            Self::WriteRegisters(_) => WRITE_REGISTERS,
            Self::ReadMemory { .. } => READ_MEMORY,
            Self::WriteMemory { .. } => WRITE_MEMORY,
            Self::PacketResend { .. } => PACKET_RESEND,
        }
    }

    fn body(&self) -> Vec<u8> {
        match self {
            Self::Discovery => Vec::new(),
            Self::ReadRegisters(addresses) => words(addresses.iter().copied()),
            Self::WriteRegisters(writes) => words(writes.iter().flat_map(|&(address, value)| [address, value])),
            Self::ReadMemory { address, count } => words([*address, u32::from(*count)]),
            Self::WriteMemory { address, data } => [&address.to_be_bytes(), data.as_slice()].concat(),
            Self::PacketResend {
                block_id,
                first,
                last,
                extended,
            } => {
                let short_id = if *extended { 0 } else { *block_id as u32 & 0xffff };
                let mut body = words([short_id, *first, *last]);
                if *extended {
                    body.extend(block_id.to_be_bytes());
                }
                body
            }
        }
    }

    fn decode(code: u16, flags: u8, body: &[u8]) -> Result<Self, GigeVisionError> {
        match code {
            DISCOVERY => Ok(Self::Discovery),
            READ_REGISTERS => decode_words("READREG", 1, body).map(Self::ReadRegisters),
            WRITE_REGISTERS => {
                let words = decode_words("WRITEREG", 2, body)?;
                let writes = words.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
                Ok(Self::WriteRegisters(writes))
            }
            READ_MEMORY => {
                let mut reader = Reader::new("READMEM", body);
                Ok(Self::ReadMemory {
                    address: reader.u32()?,
                    count: reader.u32()? as u16,
                })
            }
            WRITE_MEMORY => {
                let mut reader = Reader::new("WRITEMEM", body);
                let address = reader.u32()?;
                let data = reader.rest().to_vec();
                check_memory_length("WRITEMEM", data.len())?;
                Ok(Self::WriteMemory { address, data })
            }
            _ => decode_resend(flags & FLAG_EXTENDED_IDS != 0, body),
        }
    }
}

fn check_memory_length(what: &'static str, found: usize) -> Result<(), GigeVisionError> {
    if found == 0 || found > MAX_MEMORY_BYTES {
        return Err(GigeVisionError::BodyLength {
            what,
            found,
            allowed: "1 to 536 bytes of data",
        });
    }
    Ok(())
}

fn decode_resend(extended: bool, body: &[u8]) -> Result<Command, GigeVisionError> {
    let mut reader = Reader::new("PACKETRESEND", body);
    let short_id = reader.u32()? & 0xffff;
    let first = reader.u32()? & 0x00ff_ffff;
    let last = reader.u32()? & 0x00ff_ffff;
    let block_id = if extended { reader.u64()? } else { u64::from(short_id) };
    Ok(Command::PacketResend {
        block_id,
        first,
        last,
        extended,
    })
}

fn words(words: impl IntoIterator<Item = u32>) -> Vec<u8> {
    words.into_iter().flat_map(u32::to_be_bytes).collect()
}

fn decode_words(what: &'static str, multiple: usize, body: &[u8]) -> Result<Vec<u32>, GigeVisionError> {
    if body.is_empty() || !body.len().is_multiple_of(4 * multiple) || body.len() > MAX_MEMORY_BYTES + 4 {
        return Err(GigeVisionError::BodyLength {
            what,
            found: body.len(),
            allowed: "whole entries, 1 to 540 bytes",
        });
    }
    let mut reader = Reader::new(what, body);
    let mut words = Vec::with_capacity(body.len() / 4);
    while !reader.is_empty() {
        words.push(reader.u32()?);
    }
    Ok(words)
}

/// A command as it travels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// Repeated in the answer; never 0.
    pub id: u16,
    /// Whether an answer is wanted.
    pub acknowledge: bool,
    /// What is asked.
    pub command: Command,
}

impl Request {
    /// As a datagram.
    pub fn encode(&self) -> Vec<u8> {
        let body = self.command.body();
        let mut flags = if self.acknowledge { FLAG_ACKNOWLEDGE } else { 0 };
        if matches!(self.command, Command::PacketResend { extended: true, .. }) {
            flags |= FLAG_EXTENDED_IDS;
        }
        let mut datagram = vec![COMMAND_KEY, flags];
        datagram.extend(self.command.code().to_be_bytes());
        datagram.extend((body.len() as u16).to_be_bytes());
        datagram.extend(self.id.to_be_bytes());
        datagram.extend(body);
        datagram
    }

    /// From a datagram. Bytes after the announced body are ignored.
    pub fn decode(datagram: &[u8]) -> Result<Self, GigeVisionError> {
        let mut reader = Reader::new("a GVCP command", datagram);
        let key = reader.u8()?;
        if key != COMMAND_KEY {
            return Err(GigeVisionError::NotGvcp { found: key });
        }
        let (flags, command, length, id) = (reader.u8()?, reader.u16()?, reader.u16()?, reader.u16()?);
        let acknowledge = flags & FLAG_ACKNOWLEDGE != 0;
        let known = [
            DISCOVERY,
            PACKET_RESEND,
            READ_REGISTERS,
            WRITE_REGISTERS,
            READ_MEMORY,
            WRITE_MEMORY,
        ];
        if !known.contains(&command) {
            return Err(GigeVisionError::UnknownCommand {
                command,
                id,
                acknowledge,
            });
        }
        let decoded = reader
            .take(usize::from(length))
            .and_then(|body| Command::decode(command, flags, body));
        match decoded {
            Ok(command) => Ok(Self {
                id,
                acknowledge,
                command,
            }),
            Err(reason) => Err(GigeVisionError::Command {
                command,
                id,
                acknowledge,
                reason: Box::new(reason),
            }),
        }
    }
}

/// What the device answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// The first [`DISCOVERY_BYTES`] of the bootstrap registers.
    Discovery(Vec<u8>),
    /// Values in the order asked for.
    ReadRegisters(Vec<u32>),
    /// How many were written.
    WriteRegisters(u32),
    /// Bytes read.
    ReadMemory {
        /// First byte.
        address: u32,
        /// As many as asked for.
        data: Vec<u8>,
    },
    /// Address written to.
    WriteMemory(u32),
    /// The answer takes this much longer.
    Pending {
        /// Milliseconds from now.
        millis: u16,
    },
    /// No.
    Refused {
        /// Code of the command that is refused.
        command: u16,
        /// Why.
        refusal: Refusal,
    },
}

impl Answer {
    fn code(&self) -> u16 {
        match self {
            Self::Discovery(_) => DISCOVERY + 1,
            Self::ReadRegisters(_) => READ_REGISTERS + 1,
            Self::WriteRegisters(_) => WRITE_REGISTERS + 1,
            Self::ReadMemory { .. } => READ_MEMORY + 1,
            Self::WriteMemory(_) => WRITE_MEMORY + 1,
            Self::Pending { .. } => PENDING_ANSWER,
            Self::Refused { command, .. } => command.wrapping_add(1),
        }
    }

    fn body(&self) -> Vec<u8> {
        match self {
            Self::Discovery(registers) => registers.clone(),
            Self::ReadRegisters(values) => words(values.iter().copied()),
            Self::WriteRegisters(word) | Self::WriteMemory(word) => words([*word]),
            Self::ReadMemory { address, data } => [&address.to_be_bytes(), data.as_slice()].concat(),
            Self::Pending { millis } => words([u32::from(*millis)]),
            Self::Refused { .. } => Vec::new(),
        }
    }

    /// As a datagram that answers request `id`.
    pub fn encode(&self, id: u16) -> Vec<u8> {
        let body = self.body();
        let mut datagram = Vec::with_capacity(HEADER_BYTES + body.len());
        match self {
            Self::Refused { refusal, .. } => datagram.extend([0x80, *refusal as u8]),
            _ => datagram.extend([0, 0]),
        }
        datagram.extend(self.code().to_be_bytes());
        datagram.extend((body.len() as u16).to_be_bytes());
        datagram.extend(id.to_be_bytes());
        datagram.extend(body);
        datagram
    }

    /// From a datagram, with the id of the request it answers.
    pub fn decode(datagram: &[u8]) -> Result<(u16, Self), GigeVisionError> {
        let mut reader = Reader::new("a GVCP answer", datagram);
        let (key, status, code) = (reader.u8()?, reader.u8()?, reader.u16()?);
        let (length, id) = (reader.u16()?, reader.u16()?);
        let body = reader.take(usize::from(length))?;
        match key {
            0 => Self::decode_body(code, id, body).map(|answer| (id, answer)),
            0x80 => {
                // A code we do not know is still a refusal.
                let refusal = Refusal::ALL.into_iter().find(|refusal| *refusal as u8 == status);
                Ok((
                    id,
                    Self::Refused {
                        command: code.wrapping_sub(1),
                        refusal: refusal.unwrap_or(Refusal::NotImplemented),
                    },
                ))
            }
            found => Err(GigeVisionError::NotAnAnswer { found }),
        }
    }

    fn decode_body(code: u16, id: u16, body: &[u8]) -> Result<Self, GigeVisionError> {
        let mut reader = Reader::new("a GVCP answer", body);
        match code.wrapping_sub(1) {
            DISCOVERY => Ok(Self::Discovery(reader.take(DISCOVERY_BYTES)?.to_vec())),
            READ_REGISTERS => decode_words("an answer to READREG", 1, body).map(Self::ReadRegisters),
            WRITE_REGISTERS => reader.u32().map(Self::WriteRegisters),
            READ_MEMORY => Ok(Self::ReadMemory {
                address: reader.u32()?,
                data: reader.rest().to_vec(),
            }),
            WRITE_MEMORY => reader.u32().map(Self::WriteMemory),
            _ if code == PENDING_ANSWER => Ok(Self::Pending {
                millis: reader.u32()? as u16,
            }),
            command => Err(GigeVisionError::UnknownCommand {
                command,
                id,
                acknowledge: false,
            }),
        }
    }
}

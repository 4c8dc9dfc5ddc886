// Numbers of the light protocol. The layouts are in the table of the Rust crate `light_protocol`; golden_frames.txt
// holds one frame of each kind, checked on both sides.
#pragma once
#include <stdint.h>

namespace protocol {

// Another number makes a firmware that this release's host refuses: a test wants one.
#ifndef RAKELIGHT_PROTOCOL_VERSION
#define RAKELIGHT_PROTOCOL_VERSION 1
#endif
const uint8_t VERSION = RAKELIGHT_PROTOCOL_VERSION;
const uint8_t FIRMWARE_ID[4] = {'R', 'K', 'L', 'T'};
const uint8_t FIRMWARE_VERSION[3] = {1, 0, 0};

// Commands, host to firmware.
const uint8_t HELLO = 0x01;
const uint8_t OFF = 0x02;
const uint8_t SET = 0x03;
const uint8_t SEQ = 0x04;
const uint8_t PING = 0x05;
// Replies, with the sequence number of their command.
const uint8_t HELLO_REPLY = 0x81;
const uint8_t ACK = 0x82;
const uint8_t NAK = 0x83;
// Events; BOOT has sequence number 0, the others that of the command they belong to.
const uint8_t BOOT = 0x91;
const uint8_t STEP = 0x92;
const uint8_t ENDED = 0x93;

enum NakReason : uint8_t {
  BAD_CRC = 1,          // sequence number and command unknown, both 0
  UNKNOWN_COMMAND = 2,
  BAD_LENGTH = 3,       // allowed: the length that fits, bytes
  NO_HELLO = 4,         // allowed: the firmware's protocol version
  BUSY = 5,
  BAD_MASK = 6,         // index: step; allowed: panels | triggers << 8
  BAD_STEP_COUNT = 7,   // allowed: the largest count
  ON_TIME_SHORT = 8,    // index: step; allowed: microseconds
  ON_TIME_LONG = 9,     // index: step; allowed: microseconds
  BAD_GAP = 10,         // index: step; allowed: the least or the most, microseconds
  BAD_TRIGGER = 11,     // index: step; allowed: latest end of the pulse after the step's start, microseconds
  DUTY = 12,            // index: panel 1..7; allowed: on-time left to it, microseconds
};

enum EndReason : uint8_t {
  COMPLETE = 0,  // every step of a SEQ was done
  EXPIRED = 1,   // a SET's time was over
  STOPPED = 2,   // OFF or HELLO
  REPLACED = 3,  // a new SET or SEQ took over from a SET
  SILENCE = 4,   // no valid frame for WATCHDOG_MS
};

const uint8_t PANELS = 7;
const uint8_t TRIGGERS = 2;
const uint8_t PANEL_MASK = (1 << PANELS) - 1;
const uint8_t TRIGGER_MASK = (1 << TRIGGERS) - 1;
const uint8_t MAX_STEPS = 16;

const uint16_t WATCHDOG_MS = 500;
const uint16_t MAX_SET_MS = 60000;
const uint32_t MAX_STEP_ON_US = 1000000;
const uint32_t MAX_GAP_US = 1000000;
const uint32_t MIN_STEP_ON_US = 200;
const uint32_t MIN_GAP_US = 100;
// Two edges of one step are at least this far apart, so that the timer interrupt is done with one before the next.
const uint16_t MIN_EDGE_US = 64;
// A panel may be on for BUCKET_US at a stretch and DUTY_PERCENT of the time in the long run.
const uint8_t DUTY_PERCENT = 50;
const uint32_t BUCKET_US = 60000000;
// From accepting a SEQ to its first edge.
const uint16_t SEQUENCE_LEAD_US = 1000;

const uint8_t STEP_BYTES = 10;
const uint8_t SEQ_HEADER_BYTES = 5;
const uint8_t MAX_PAYLOAD = SEQ_HEADER_BYTES + MAX_STEPS * STEP_BYTES;
const uint8_t MAX_BODY = 2 + MAX_PAYLOAD + 2;  // type, sequence number, payload, CRC
const uint8_t MAX_ENCODED = MAX_BODY + 1;      // one code byte; a body is shorter than 254 bytes

}  // namespace protocol

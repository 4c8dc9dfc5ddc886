// Framing: 0x00, COBS(type, sequence number, payload, CRC-16), 0x00. Knows no hardware.
#pragma once
#include <stdint.h>

#include "protocol.h"

// CRC-16 with polynomial 0x1021, initial value 0xFFFF, most significant bit first.
uint16_t crc16(const uint8_t* bytes, uint8_t length);

uint16_t get_u16(const uint8_t* bytes);
uint32_t get_u32(const uint8_t* bytes);

// Collects one frame's body and encodes it. Fields are little-endian.
class FrameWriter {
 public:
  FrameWriter(uint8_t type, uint8_t sequence);
  FrameWriter& u8(uint8_t value);
  FrameWriter& u16(uint16_t value);
  FrameWriter& u32(uint32_t value);
  FrameWriter& bytes(const uint8_t* values, uint8_t length);
  // Writes the whole frame, delimiters included, into `out` (MAX_ENCODED + 2 bytes) and returns its length.
  uint8_t finish(uint8_t* out);

 private:
  uint8_t body_[protocol::MAX_BODY];
  uint8_t length_;
};

// Takes bytes as they come, however they are split, and finds the frames in them.
class FrameReader {
 public:
  enum Result : uint8_t { NOTHING, FRAME, BAD_CRC };
  FrameReader() : length_(0), body_length_(0), too_long_(false) {}
  Result push(uint8_t byte);
  // Valid after FRAME until the next push.
  uint8_t type() const { return buffer_[0]; }
  uint8_t sequence() const { return buffer_[1]; }
  const uint8_t* payload() const { return buffer_ + 2; }
  uint8_t payload_length() const { return body_length_ - 4; }

 private:
  Result end_of_frame();
  bool unstuff(uint8_t encoded);
  uint8_t buffer_[protocol::MAX_ENCODED];
  uint8_t length_;
  uint8_t body_length_;
  bool too_long_;
};

#include "frame.h"

using protocol::MAX_BODY;
using protocol::MAX_ENCODED;

static const uint8_t CRC_BYTES = 2;
static const uint8_t MIN_BODY = 2 + CRC_BYTES;

uint16_t crc16(const uint8_t* bytes, uint8_t length) {
  uint16_t crc = 0xFFFF;
  for (uint8_t i = 0; i < length; i++) {
    crc ^= (uint16_t)bytes[i] << 8;
    for (uint8_t bit = 0; bit < 8; bit++) {
      crc = (crc & 0x8000) ? (uint16_t)((crc << 1) ^ 0x1021) : (uint16_t)(crc << 1);
    }
  }
  return crc;
}

uint16_t get_u16(const uint8_t* bytes) { return (uint16_t)(bytes[0] | ((uint16_t)bytes[1] << 8)); }

uint32_t get_u32(const uint8_t* bytes) { return get_u16(bytes) | ((uint32_t)get_u16(bytes + 2) << 16); }

FrameWriter::FrameWriter(uint8_t type, uint8_t sequence) : length_(0) { u8(type).u8(sequence); }

FrameWriter& FrameWriter::u8(uint8_t value) {
  if (length_ < MAX_BODY - CRC_BYTES) body_[length_++] = value;
  return *this;
}

FrameWriter& FrameWriter::u16(uint16_t value) { return u8((uint8_t)value).u8((uint8_t)(value >> 8)); }

FrameWriter& FrameWriter::u32(uint32_t value) { return u16((uint16_t)value).u16((uint16_t)(value >> 16)); }

FrameWriter& FrameWriter::bytes(const uint8_t* values, uint8_t length) {
  for (uint8_t i = 0; i < length; i++) u8(values[i]);
  return *this;
}

uint8_t FrameWriter::finish(uint8_t* out) {
  uint16_t crc = crc16(body_, length_);
  body_[length_++] = (uint8_t)crc;
  body_[length_++] = (uint8_t)(crc >> 8);
  uint8_t end = 0;
  out[end++] = 0;
  uint8_t code_at = end++;
  for (uint8_t i = 0; i < length_; i++) {
    if (body_[i] == 0) {
      out[code_at] = end - code_at;
      code_at = end++;
    } else {
      out[end++] = body_[i];
    }
  }
  out[code_at] = end - code_at;
  out[end++] = 0;
  return end;
}

FrameReader::Result FrameReader::push(uint8_t byte) {
  if (byte == 0) return end_of_frame();
  if (length_ == MAX_ENCODED) {
    too_long_ = true;
  } else {
    buffer_[length_++] = byte;
  }
  return NOTHING;
}

FrameReader::Result FrameReader::end_of_frame() {
  uint8_t encoded = length_;
  bool whole = !too_long_;
  length_ = 0;
  too_long_ = false;
  if (!whole || !unstuff(encoded) || body_length_ < MIN_BODY) return NOTHING;
  uint8_t checked = body_length_ - CRC_BYTES;
  return crc16(buffer_, checked) == get_u16(buffer_ + checked) ? FRAME : BAD_CRC;
}

// COBS, in place: what is written is never ahead of what is read.
bool FrameReader::unstuff(uint8_t encoded) {
  uint8_t from = 0;
  body_length_ = 0;
  while (from < encoded) {
    uint8_t code = buffer_[from++];
    if (code - 1 > encoded - from) return false;
    for (uint8_t i = 1; i < code; i++) buffer_[body_length_++] = buffer_[from++];
    if (from < encoded) buffer_[body_length_++] = 0;
  }
  return true;
}

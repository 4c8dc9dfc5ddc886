// Runs the firmware's hardware-free part on a computer: the golden frames, a whole conversation with them, the
// sequencer's edges and the refusals. Usage: portable_test golden_frames.txt
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "board.h"
#include "controller.h"

typedef std::vector<uint8_t> Bytes;

// ---- a board in simulated time ----

struct Edge {
  uint32_t at;
  Pins pins;
};

static Controller* controller;
static uint32_t now;
static Bytes sent;
static std::vector<Edge> edges;

uint32_t board_micros() { return now; }
uint32_t board_write(Pins pins) {
  edges.push_back(Edge{now, pins});
  return now;
}
void board_arm() {}
uint8_t board_lock() { return 0; }
void board_unlock(uint8_t) {}
void board_send(const uint8_t* bytes, uint8_t length) { sent.insert(sent.end(), bytes, bytes + length); }

static void reset_board() {
  delete controller;
  controller = new Controller();
  now = 1000000;
  sent.clear();
  edges.clear();
}

static void pass(uint32_t micros) {
  uint32_t end = now + micros;
  Sequencer& sequencer = controller->sequencer;
  while (sequencer.active() && (int32_t)(sequencer.due() - end) <= 0) {
    now = sequencer.due();
    sequencer.fired(board_write(sequencer.pins()));
  }
  now = end;
  controller->poll();
}

// ---- checks ----

static std::map<std::string, Bytes> golden;
static int failures;

static std::string hex(const Bytes& bytes) {
  std::string text;
  char digits[3];
  for (uint8_t byte : bytes) {
    snprintf(digits, sizeof digits, "%02x", byte);
    text += digits;
  }
  return text;
}

static void check(bool holds, const std::string& what) {
  if (holds) return;
  failures++;
  printf("FAILED: %s\n", what.c_str());
}

static Bytes frame(const std::string& name) {
  check(golden.count(name) == 1, "golden_frames.txt has " + name);
  return golden[name];
}

// Feeds bytes and returns what the firmware sent.
static Bytes feed(const Bytes& bytes) {
  sent.clear();
  for (uint8_t byte : bytes) controller->receive(byte);
  return sent;
}

static void expect_sent(const std::vector<std::string>& names, const std::string& what) {
  Bytes expected;
  for (const std::string& name : names) {
    Bytes bytes = frame(name);
    expected.insert(expected.end(), bytes.begin(), bytes.end());
  }
  check(sent == expected, what + ": sent " + hex(sent) + ", expected " + hex(expected));
}

static Bytes written(FrameWriter writer) {
  uint8_t bytes[protocol::MAX_ENCODED + 2];
  uint8_t length = writer.finish(bytes);
  return Bytes(bytes, bytes + length);
}

static void read_golden(const char* path) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    std::string name, bar, digits;
    words >> name >> bar >> digits;
    Bytes bytes;
    for (size_t i = 0; i + 1 < digits.size(); i += 2) {
      bytes.push_back((uint8_t)strtoul(digits.substr(i, 2).c_str(), nullptr, 16));
    }
    golden[name] = bytes;
  }
  check(golden.size() >= 20, std::string(path) + " holds the golden frames");
}

// ---- tests ----

static void golden_frames_are_read_and_written_back() {
  for (const auto& entry : golden) {
    bool broken = entry.first.compare(0, 7, "broken_") == 0;
    FrameReader reader;
    bool found = false;
    for (uint8_t byte : entry.second) {
      if (reader.push(byte) != FrameReader::FRAME) continue;
      found = true;
      FrameWriter writer(reader.type(), reader.sequence());
      writer.bytes(reader.payload(), reader.payload_length());
      check(written(writer) == entry.second, entry.first + " is written as it was read");
    }
    check(found != broken, entry.first + (broken ? " is not a frame" : " is a frame"));
  }
}

static void frames_are_found_after_garbage() {
  uint32_t random = 12345;
  for (int round = 0; round < 2000; round++) {
    FrameReader reader;
    for (int i = 0; i < round % 400; i++) {
      random = random * 1664525 + 1013904223;
      reader.push((uint8_t)(random >> 24));
    }
    int found = 0;
    for (uint8_t byte : frame("sequence")) {
      if (reader.push(byte) == FrameReader::FRAME) found++;
    }
    check(found >= 1 && reader.type() == protocol::SEQ, "a frame is found after garbage");
  }
}

static void the_golden_conversation() {
  reset_board();
  controller->boot(8);
  expect_sent({"boot"}, "boot");
  reset_board();
  controller->boot(1);
  feed(frame("ping"));
  expect_sent({"nak_no_hello"}, "a command before HELLO");
  feed(frame("hello"));
  expect_sent({"hello_reply"}, "hello");
  feed(frame("broken_crc"));
  expect_sent({"nak_bad_crc"}, "bad CRC");
  feed(frame("broken_cobs"));
  feed(frame("ping"));
  expect_sent({"ack_ping"}, "ping after garbage");
  feed(frame("set"));
  expect_sent({"ack_set"}, "set");
  check(edges.back().pins.panels == 0x41, "SET lights L1 and L7");
  feed(frame("off"));
  expect_sent({"ended_stopped", "ack_off"}, "off");
  check(edges.back().pins.panels == 0, "OFF turns the lights off");
  feed(frame("sequence"));
  expect_sent({"ack_sequence"}, "sequence");
  feed(frame("sequence"));
  expect_sent({"nak_busy"}, "a sequence during another");
  sent.clear();
  pass(6500);
  expect_sent({"step_dark", "step_lit", "ended_complete"}, "the sequence's reports");
}

static void the_sequence_makes_these_edges() {
  reset_board();
  feed(frame("hello"));
  feed(frame("sequence"));
  edges.clear();
  pass(20000);
  const Edge expected[] = {{1001000, {0, 0}}, {1001300, {0, 3}}, {1001800, {0, 0}}, {1003500, {0, 0}},
                           {1004000, {1, 0}}, {1004300, {1, 3}}, {1004800, {1, 0}}, {1006500, {0, 0}}};
  check(edges.size() == 8, "eight edges");
  for (size_t i = 0; i < 8 && i < edges.size(); i++) {
    bool same = edges[i].at == expected[i].at && edges[i].pins.panels == expected[i].pins.panels &&
                edges[i].pins.triggers == expected[i].pins.triggers;
    check(same, "edge " + std::to_string(i) + " at " + std::to_string(edges[i].at));
  }
}

static void silence_turns_the_lights_off() {
  reset_board();
  feed(frame("hello"));
  feed(frame("set"));
  sent.clear();
  pass(499999);
  check(sent.empty(), "lights stay on for 500 ms of silence");
  pass(1);
  expect_sent({"ended_silence"}, "silence");
  check(edges.back().pins.panels == 0, "silence turns the lights off");
}

static void a_clock_that_wraps_changes_nothing() {
  reset_board();
  now = 0xFFFFFFFFu - 2000;
  feed(frame("hello"));
  feed(frame("sequence"));
  pass(6000);
  check(controller->sequencer.active(), "the sequence runs across the wrap");
  pass(500);
  check(controller->sequencer.completed() == 2, "and is complete in time");
}

static Bytes one_step(uint8_t panels, uint8_t triggers, uint32_t on_us, uint32_t gap_us, uint16_t delay, uint16_t width) {
  FrameWriter writer(protocol::SEQ, 7);
  writer.u16(delay).u16(width).u8(1).u8(panels).u8(triggers).u32(on_us).u32(gap_us);
  return written(writer);
}

static void expect_refused(const Bytes& command, uint8_t reason, uint8_t index, uint32_t allowed) {
  reset_board();
  feed(frame("hello"));
  FrameWriter expected(protocol::NAK, 7);
  expected.u8(protocol::SEQ).u8(reason).u8(index).u32(allowed);
  Bytes answer = feed(command);
  check(answer == written(expected), "reason " + std::to_string(reason) + ": sent " + hex(answer));
  check(!controller->sequencer.active(), "a refused sequence does not start");
}

static void what_is_out_of_range_is_refused() {
  using namespace protocol;
  expect_refused(one_step(0x80, 0, 1000, 500, 0, 0), BAD_MASK, 0, 0x37F);
  expect_refused(one_step(1, 4, 1000, 500, 0, 100), BAD_MASK, 0, 0x37F);
  expect_refused(one_step(1, 0, 199, 500, 0, 0), ON_TIME_SHORT, 0, 200);
  expect_refused(one_step(1, 0, 1000001, 500, 0, 0), ON_TIME_LONG, 0, 1000000);
  expect_refused(one_step(1, 0, 1000, 99, 0, 0), BAD_GAP, 0, 100);
  expect_refused(one_step(1, 0, 1000, 1000001, 0, 0), BAD_GAP, 0, 1000000);
  expect_refused(one_step(1, 3, 1000, 500, 500, 437), BAD_TRIGGER, 0, 936);
  expect_refused(one_step(1, 3, 1000, 500, 10, 100), BAD_TRIGGER, 0, 936);
  expect_refused(one_step(1, 3, 1000, 500, 0, 63), BAD_TRIGGER, 0, 936);
  expect_refused(written(FrameWriter(SEQ, 7).u16(0).u16(0).u8(17)), BAD_STEP_COUNT, 0, 16);
  expect_refused(written(FrameWriter(SEQ, 7).u16(0).u16(0).u8(2)), BAD_LENGTH, 0, 25);
}

static void duty_is_capped() {
  reset_board();
  feed(frame("hello"));
  FrameWriter full(protocol::SET, 7);
  full.u8(1).u16(60000);
  Bytes full_set = written(full);
  pass(0);
  feed(full_set);
  for (int i = 0; i < 150; i++) {
    pass(400000);
    feed(frame("ping"));
  }
  pass(0);
  check(!controller->sequencer.active(), "the SET expired after 60 s");
  // Half of what passed came back; as much again may be asked for, and no more.
  sent.clear();
  Bytes answer = feed(full_set);
  FrameWriter expected(protocol::NAK, 7);
  expected.u8(protocol::SET).u8(protocol::DUTY).u8(1).u32(30000000);
  check(answer == written(expected), "duty: sent " + hex(answer));
  FrameWriter other(protocol::SET, 8);
  other.u8(2).u16(60000);
  feed(written(other));
  check(controller->sequencer.lit() == 2, "another panel may still be lit");
}

static void another_protocol_version_gets_no_light() {
  reset_board();
  feed(frame("hello"));
  feed(frame("set"));
  feed(frame("hello_other_version"));
  check(edges.back().pins.panels == 0, "HELLO turns the lights off");
  feed(frame("ping"));
  expect_sent({"nak_no_hello"}, "after a HELLO of another version");
}

int main(int count, char** arguments) {
  if (count != 2) return 2;
  read_golden(arguments[1]);
  golden_frames_are_read_and_written_back();
  frames_are_found_after_garbage();
  the_golden_conversation();
  the_sequence_makes_these_edges();
  silence_turns_the_lights_off();
  a_clock_that_wraps_changes_nothing();
  what_is_out_of_range_is_refused();
  duty_is_capped();
  another_protocol_version_gets_no_light();
  printf("%zu golden frames, %d failures\n", golden.size(), failures);
  return failures == 0 ? 0 : 1;
}

#include "controller.h"

#include "board.h"

using namespace protocol;

Controller::Controller()
    : reset_cause_(0), greeted_(false), last_frame_at_(0), running_(0), running_sequence_(0), reported_(0) {}

void Controller::boot(uint8_t reset_cause) {
  reset_cause_ = reset_cause;
  greet(BOOT, 0);
}

void Controller::receive(uint8_t byte) {
  switch (reader_.push(byte)) {
    case FrameReader::NOTHING:
      break;
    case FrameReader::BAD_CRC:
      nak(0, 0, protocol::BAD_CRC, 0, 0);
      break;
    case FrameReader::FRAME:
      last_frame_at_ = board_micros();
      handle();
      break;
  }
}

void Controller::handle() {
  if (reader_.type() == HELLO) {
    hello();
  } else if (!greeted_) {
    // Also what a host is told whose device was reset behind its back.
    nak(reader_.sequence(), reader_.type(), NO_HELLO, 0, VERSION);
  } else if (reader_.type() == OFF) {
    if (!length_is(0)) return;
    stop(STOPPED);
    uint8_t before = board_lock();
    uint32_t stamp = board_write(Pins());
    board_unlock(before);
    ack(stamp);
  } else if (reader_.type() == SET) {
    set();
  } else if (reader_.type() == SEQ) {
    seq();
  } else if (reader_.type() == PING) {
    if (length_is(0)) ack(board_micros());
  } else {
    nak(reader_.sequence(), reader_.type(), UNKNOWN_COMMAND, 0, 0);
  }
}

bool Controller::length_is(uint8_t expected) {
  if (reader_.payload_length() == expected) return true;
  nak(reader_.sequence(), reader_.type(), BAD_LENGTH, 0, expected);
  return false;
}

// A host that speaks another version learns ours from the reply, and can do nothing else.
void Controller::hello() {
  stop(STOPPED);
  greeted_ = reader_.payload_length() >= 1 && reader_.payload()[0] == VERSION;
  greet(HELLO_REPLY, reader_.sequence());
}

// One step without a trigger: the timer ends it, like any other.
void Controller::set() {
  if (!length_is(3)) return;
  uint8_t panels = reader_.payload()[0];
  uint16_t on_ms = get_u16(reader_.payload() + 1);
  if (running_ == SEQ) return nak(reader_.sequence(), SET, BUSY, 0, 0);
  stop(REPLACED);
  if (panels & ~PANEL_MASK) return nak(reader_.sequence(), SET, BAD_MASK, 0, PANEL_MASK);
  if (on_ms == 0) return nak(reader_.sequence(), SET, ON_TIME_SHORT, 0, 1000);
  if (on_ms > MAX_SET_MS) return nak(reader_.sequence(), SET, ON_TIME_LONG, 0, MAX_SET_MS * 1000UL);
  Plan& plan = sequencer.plan;
  plan.count = 1;
  plan.trigger_delay_us = 0;
  plan.trigger_width_us = 0;
  plan.steps[0].pins.panels = panels;
  plan.steps[0].pins.triggers = 0;
  plan.steps[0].on_us = on_ms * 1000UL;
  plan.steps[0].gap_us = 0;
  if (refused(check_budget())) return;
  charge_plan();
  running_ = SET;
  running_sequence_ = reader_.sequence();
  uint8_t before = board_lock();
  sequencer.start(board_micros());
  uint32_t stamp = board_write(sequencer.pins());
  sequencer.fired(stamp);
  board_arm();
  board_unlock(before);
  ack(stamp);
}

void Controller::seq() {
  if (running_ == SEQ) return nak(reader_.sequence(), SEQ, BUSY, 0, 0);
  stop(REPLACED);
  if (refused(read_seq())) return;
  for (uint8_t i = 0; i < sequencer.plan.count; i++) {
    if (refused(check_step(i))) return;
  }
  if (refused(check_budget())) return;
  charge_plan();
  running_ = SEQ;
  running_sequence_ = reader_.sequence();
  reported_ = 0;
  uint8_t before = board_lock();
  uint32_t first_on_at = board_micros() + SEQUENCE_LEAD_US;
  sequencer.start(first_on_at);
  board_arm();
  board_unlock(before);
  ack(first_on_at);
}

Controller::Refusal Controller::read_seq() {
  const uint8_t* payload = reader_.payload();
  if (reader_.payload_length() < SEQ_HEADER_BYTES) return Refusal{BAD_LENGTH, 0, SEQ_HEADER_BYTES};
  uint8_t count = payload[4];
  if (count == 0 || count > MAX_STEPS) return Refusal{BAD_STEP_COUNT, 0, MAX_STEPS};
  uint8_t expected = SEQ_HEADER_BYTES + count * STEP_BYTES;
  if (reader_.payload_length() != expected) return Refusal{BAD_LENGTH, 0, expected};
  Plan& plan = sequencer.plan;
  plan.trigger_delay_us = get_u16(payload);
  plan.trigger_width_us = get_u16(payload + 2);
  plan.count = count;
  payload += SEQ_HEADER_BYTES;
  for (uint8_t i = 0; i < count; i++, payload += STEP_BYTES) {
    plan.steps[i].pins.panels = payload[0];
    plan.steps[i].pins.triggers = payload[1];
    plan.steps[i].on_us = get_u32(payload + 2);
    plan.steps[i].gap_us = get_u32(payload + 6);
  }
  return Refusal();
}

Controller::Refusal Controller::check_step(uint8_t index) const {
  const Plan& plan = sequencer.plan;
  const Step& step = plan.steps[index];
  if ((step.pins.panels & ~PANEL_MASK) || (step.pins.triggers & ~TRIGGER_MASK)) {
    return Refusal{BAD_MASK, index, PANEL_MASK | (uint16_t)TRIGGER_MASK << 8};
  }
  if (step.on_us < MIN_STEP_ON_US) return Refusal{ON_TIME_SHORT, index, MIN_STEP_ON_US};
  if (step.on_us > MAX_STEP_ON_US) return Refusal{ON_TIME_LONG, index, MAX_STEP_ON_US};
  if (step.gap_us < MIN_GAP_US) return Refusal{BAD_GAP, index, MIN_GAP_US};
  if (step.gap_us > MAX_GAP_US) return Refusal{BAD_GAP, index, MAX_GAP_US};
  if (!step.pins.triggers) return Refusal();
  uint32_t latest_end = step.on_us - MIN_EDGE_US;
  bool delay_fits = plan.trigger_delay_us == 0 || plan.trigger_delay_us >= MIN_EDGE_US;
  bool width_fits = plan.trigger_width_us >= MIN_EDGE_US;
  bool end_fits = (uint32_t)plan.trigger_delay_us + plan.trigger_width_us <= latest_end;
  if (!delay_fits || !width_fits || !end_fits) return Refusal{BAD_TRIGGER, index, latest_end};
  return Refusal();
}

Controller::Refusal Controller::check_budget() const {
  const Plan& plan = sequencer.plan;
  for (uint8_t panel = 0; panel < PANELS; panel++) {
    uint32_t wanted = 0;
    for (uint8_t i = 0; i < plan.count; i++) {
      if (plan.steps[i].pins.panels >> panel & 1) wanted += plan.steps[i].on_us;
    }
    if (wanted > budget_.left(panel)) return Refusal{DUTY, (uint8_t)(panel + 1), budget_.left(panel)};
  }
  return Refusal();
}

bool Controller::refused(const Refusal& refusal) {
  if (refusal.reason == 0) return false;
  nak(reader_.sequence(), reader_.type(), refusal.reason, refusal.index, refusal.allowed);
  return true;
}

void Controller::charge_plan() {
  const Plan& plan = sequencer.plan;
  for (uint8_t i = 0; i < plan.count; i++) budget_.charge(plan.steps[i].pins.panels, plan.steps[i].on_us);
}

void Controller::stop(uint8_t reason) {
  if (!running_) return;
  uint8_t before = board_lock();
  bool was_active = sequencer.active();
  sequencer.abort();
  board_write(Pins());
  board_unlock(before);
  if (was_active) {
    refund_rest();
  } else {
    reason = running_ == SEQ ? COMPLETE : EXPIRED;
  }
  if (running_ == SEQ) report_steps();
  report_end(reason);
}

// What was charged and not used. The step in which a sequence was stopped counts as used.
void Controller::refund_rest() {
  const Plan& plan = sequencer.plan;
  if (running_ == SET) {
    budget_.refund(plan.steps[0].pins.panels, sequencer.due() - board_micros());
    return;
  }
  for (uint8_t i = sequencer.current() + 1; i < plan.count; i++) {
    budget_.refund(plan.steps[i].pins.panels, plan.steps[i].on_us);
  }
}

void Controller::poll() {
  uint32_t now = board_micros();
  budget_.refill(now);
  if (!running_) return;
  bool active = sequencer.active();
  if (running_ == SEQ) report_steps();
  if (!active) {
    report_end(running_ == SEQ ? COMPLETE : EXPIRED);
  } else if ((int32_t)(now - last_frame_at_) >= WATCHDOG_MS * 1000L) {
    stop(SILENCE);
  }
}

void Controller::report_steps() {
  while (reported_ < sequencer.completed()) {
    uint8_t before = board_lock();
    StepTimes times = sequencer.times(reported_);
    board_unlock(before);
    const Pins& pins = sequencer.plan.steps[reported_].pins;
    FrameWriter frame(STEP, running_sequence_);
    frame.u8(reported_).u8(pins.panels).u8(pins.triggers).u32(times.on_at).u32(times.trigger_at).u32(times.off_at);
    reported_++;
    send(frame);
  }
}

void Controller::report_end(uint8_t reason) {
  FrameWriter frame(ENDED, running_sequence_);
  frame.u8(running_).u8(reason).u8(running_ == SEQ ? reported_ : 0).u32(board_micros());
  running_ = 0;
  send(frame);
}

void Controller::ack(uint32_t stamp) {
  FrameWriter frame(ACK, reader_.sequence());
  frame.u8(reader_.type()).u32(stamp).u8(sequencer.lit());
  send(frame);
}

void Controller::nak(uint8_t sequence, uint8_t command, uint8_t reason, uint8_t index, uint32_t allowed) {
  FrameWriter frame(NAK, sequence);
  frame.u8(command).u8(reason).u8(index).u32(allowed);
  send(frame);
}

void Controller::greet(uint8_t type, uint8_t sequence) {
  FrameWriter frame(type, sequence);
  frame.u8(VERSION).bytes(FIRMWARE_ID, sizeof FIRMWARE_ID).bytes(FIRMWARE_VERSION, sizeof FIRMWARE_VERSION);
  frame.u8(reset_cause_).u8(PANELS).u8(TRIGGERS).u8(MAX_STEPS).u8(DUTY_PERCENT);
  frame.u16(WATCHDOG_MS).u16(MAX_SET_MS).u32(MAX_STEP_ON_US).u32(board_micros());
  send(frame);
}

void Controller::send(FrameWriter& frame) {
  uint8_t bytes[MAX_ENCODED + 2];
  board_send(bytes, frame.finish(bytes));
}

// Commands in, replies and events out; decides what may be lit. Knows no hardware but board.h.
#pragma once
#include <stdint.h>

#include "budget.h"
#include "frame.h"
#include "sequencer.h"

class Controller {
 public:
  Controller();
  // The timer interrupt drives it through board_arm; everything else is the main loop's.
  Sequencer sequencer;

  // Announces the start to the host. `reset_cause` is the MCU's reset flags.
  void boot(uint8_t reset_cause);
  void receive(uint8_t byte);
  // Watchdog, reports, refill; to be called as often as possible.
  void poll();

 private:
  struct Refusal {
    uint8_t reason;  // 0: none
    uint8_t index;
    uint32_t allowed;
  };

  void handle();
  bool length_is(uint8_t expected);
  void hello();
  void set();
  void seq();
  Refusal read_seq();
  Refusal check_step(uint8_t index) const;
  Refusal check_budget() const;
  bool refused(const Refusal& refusal);
  void charge_plan();

  void stop(uint8_t reason);
  void refund_rest();
  void report_steps();
  void report_end(uint8_t reason);

  void ack(uint32_t stamp);
  void nak(uint8_t sequence, uint8_t command, uint8_t reason, uint8_t index, uint32_t allowed);
  void greet(uint8_t type, uint8_t sequence);
  void send(FrameWriter& frame);

  FrameReader reader_;
  Budget budget_;
  uint8_t reset_cause_;
  bool greeted_;
  uint32_t last_frame_at_;
  uint8_t running_;           // SET, SEQ or 0
  uint8_t running_sequence_;  // its sequence number
  uint8_t reported_;          // steps reported
};

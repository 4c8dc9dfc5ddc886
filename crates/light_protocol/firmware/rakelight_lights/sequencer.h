// Which pin changes when. Knows no hardware: the board writes the pins when they are due and says when it did.
#pragma once
#include <stdint.h>

#include "protocol.h"

// Levels of the outputs: bit 0 = L1 .. bit 6 = L7; bit 0 = trigger of C1, bit 1 = of C2.
struct Pins {
  uint8_t panels;
  uint8_t triggers;
};

struct Step {
  Pins pins;
  uint32_t on_us;
  uint32_t gap_us;
};

// Stamps of the port writes, microseconds of the board's clock.
struct StepTimes {
  uint32_t on_at;
  uint32_t trigger_at;  // 0 when the step triggers no camera
  uint32_t off_at;
};

struct Plan {
  Step steps[protocol::MAX_STEPS];
  uint8_t count;
  uint16_t trigger_delay_us;  // from the step's start to the rising edge
  uint16_t trigger_width_us;
};

// Every due time follows from the first one and the plan, so that no error adds up.
class Sequencer {
 public:
  Sequencer() : index_(0), completed_(0), edge_(IDLE), lit_(0), step_start_(0), due_(0), pins_() {}

  // The plan may be written only while nothing is active.
  Plan plan;

  void start(uint32_t first_on_at);
  // The caller turns the outputs off.
  void abort() {
    edge_ = IDLE;
    lit_ = 0;
  }
  // The pins were written at `stamp`: prepares the next edge.
  void fired(uint32_t stamp);

  bool active() const { return edge_ != IDLE; }
  uint32_t due() const { return due_; }
  Pins pins() const { return pins_; }
  // Panels that are on now.
  uint8_t lit() const { return lit_; }
  // Steps whose lights went off again, and their times.
  uint8_t completed() const { return completed_; }
  uint8_t current() const { return index_; }
  const StepTimes& times(uint8_t step) const { return times_[step]; }

 private:
  enum Edge : uint8_t { IDLE, ON, TRIGGER_UP, TRIGGER_DOWN, LIGHTS_OFF };
  void prepare(Edge edge, uint32_t after_start, uint8_t panels, uint8_t triggers);
  void prepare_on();
  void prepare_off();
  void step_done();

  StepTimes times_[protocol::MAX_STEPS];
  uint8_t index_;
  volatile uint8_t completed_;
  volatile Edge edge_;
  volatile uint8_t lit_;
  uint32_t step_start_;
  uint32_t due_;
  Pins pins_;
};

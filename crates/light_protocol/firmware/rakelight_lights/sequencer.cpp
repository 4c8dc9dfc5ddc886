#include "sequencer.h"

void Sequencer::start(uint32_t first_on_at) {
  index_ = 0;
  completed_ = 0;
  step_start_ = first_on_at;
  prepare_on();
}

void Sequencer::prepare(Edge edge, uint32_t after_start, uint8_t panels, uint8_t triggers) {
  due_ = step_start_ + after_start;
  pins_.panels = panels;
  pins_.triggers = triggers;
  edge_ = edge;
}

// Without a delay the trigger rises in the same write as the lights.
void Sequencer::prepare_on() {
  const Pins& pins = plan.steps[index_].pins;
  prepare(ON, 0, pins.panels, plan.trigger_delay_us == 0 ? pins.triggers : 0);
}

void Sequencer::prepare_off() { prepare(LIGHTS_OFF, plan.steps[index_].on_us, 0, 0); }

void Sequencer::fired(uint32_t stamp) {
  lit_ = pins_.panels;
  const Pins& pins = plan.steps[index_].pins;
  StepTimes& times = times_[index_];
  uint32_t pulse_end = (uint32_t)plan.trigger_delay_us + plan.trigger_width_us;
  switch (edge_) {
    case IDLE:
      break;
    case ON:
      times.on_at = stamp;
      times.trigger_at = pins_.triggers ? stamp : 0;
      if (!pins.triggers) {
        prepare_off();
      } else if (pins_.triggers) {
        prepare(TRIGGER_DOWN, pulse_end, pins.panels, 0);
      } else {
        prepare(TRIGGER_UP, plan.trigger_delay_us, pins.panels, pins.triggers);
      }
      break;
    case TRIGGER_UP:
      times.trigger_at = stamp;
      prepare(TRIGGER_DOWN, pulse_end, pins.panels, 0);
      break;
    case TRIGGER_DOWN:
      prepare_off();
      break;
    case LIGHTS_OFF:
      times.off_at = stamp;
      step_done();
      break;
  }
}

void Sequencer::step_done() {
  const Step& done = plan.steps[index_];
  completed_ = index_ + 1;
  if (completed_ >= plan.count) {
    edge_ = IDLE;
    return;
  }
  step_start_ += done.on_us + done.gap_us;
  index_++;
  prepare_on();
}

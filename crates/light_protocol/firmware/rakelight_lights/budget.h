// Caps the on-time and the duty of every panel: a bucket of on-time that refills with DUTY_PERCENT of time passed.
#pragma once
#include <stdint.h>

#include "protocol.h"

class Budget {
 public:
  Budget();
  // Time passed; to be called at least once a second.
  void refill(uint32_t now_us);
  uint32_t left(uint8_t panel) const { return left_[panel]; }
  void charge(uint8_t panels, uint32_t on_us);
  void refund(uint8_t panels, uint32_t on_us);

 private:
  uint32_t left_[protocol::PANELS];
  uint32_t refilled_at_;
};

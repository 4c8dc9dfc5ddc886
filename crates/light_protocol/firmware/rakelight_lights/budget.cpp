#include "budget.h"

using protocol::BUCKET_US;
using protocol::PANELS;

// Fine enough for the cap, coarse enough to cost the main loop nothing.
static const uint32_t REFILL_EVERY_US = 10000;

Budget::Budget() : refilled_at_(0) {
  for (uint8_t panel = 0; panel < PANELS; panel++) left_[panel] = BUCKET_US;
}

void Budget::refill(uint32_t now_us) {
  uint32_t passed = now_us - refilled_at_;
  if (passed < REFILL_EVERY_US) return;
  refilled_at_ = now_us;
  refund(protocol::PANEL_MASK, passed / 100 * protocol::DUTY_PERCENT);
}

void Budget::charge(uint8_t panels, uint32_t on_us) {
  for (uint8_t panel = 0; panel < PANELS; panel++) {
    if (!(panels >> panel & 1)) continue;
    left_[panel] = left_[panel] > on_us ? left_[panel] - on_us : 0;
  }
}

void Budget::refund(uint8_t panels, uint32_t on_us) {
  for (uint8_t panel = 0; panel < PANELS; panel++) {
    if (!(panels >> panel & 1)) continue;
    left_[panel] = BUCKET_US - left_[panel] > on_us ? left_[panel] + on_us : BUCKET_US;
  }
}

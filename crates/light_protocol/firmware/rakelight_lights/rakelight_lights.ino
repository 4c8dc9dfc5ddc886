// Lights of the Rakelight cell: steps seven panels and pulses two cameras' trigger lines, exactly timed.
//
// Board: Arduino Uno. Open this folder in the Arduino IDE and upload, or run `make` one folder up. The wiring is in
// board_uno.cpp, the protocol in the Rust crate around this folder.
#include <avr/wdt.h>

#include "board_uno.h"
#include "controller.h"

Controller controller;

void setup() {
  board_begin();
  controller.boot(board_reset_cause());
}

void loop() {
  wdt_reset();
  int byte;
  while ((byte = board_receive()) >= 0) controller.receive((uint8_t)byte);
  controller.poll();
  board_rest();
}

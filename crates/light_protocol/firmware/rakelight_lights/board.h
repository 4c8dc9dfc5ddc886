// What the controller needs of the hardware. board_uno.cpp has it for the ATmega328P; a test has it for a computer.
#pragma once
#include <stdint.h>

#include "sequencer.h"

// Microseconds since reset; wraps after 71.6 minutes.
uint32_t board_micros();
// Writes the outputs and returns the time of it. Call it with interrupts off.
uint32_t board_write(Pins pins);
// Sets the timer to the sequencer's next edge. Call it with interrupts off.
void board_arm();
// Turns interrupts off; the value goes back into board_unlock.
uint8_t board_lock();
void board_unlock(uint8_t before);
// Queues bytes for the host; waits while the queue is full.
void board_send(const uint8_t* bytes, uint8_t length);

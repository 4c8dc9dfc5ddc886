// Hardware of an Arduino Uno that only the sketch uses; what the controller uses is in board.h.
#pragma once
#include <stdint.h>

// Outputs off, clock, UART and hardware watchdog on.
void board_begin();
// The MCU's reset flags (MCUSR): 1 power on, 2 external, 4 brown-out, 8 watchdog.
uint8_t board_reset_cause();
// The next byte from the host, or -1.
int board_receive();
// Sleeps until there may be something to do.
void board_rest();

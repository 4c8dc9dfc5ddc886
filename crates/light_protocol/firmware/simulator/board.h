/* The firmware on a simulated ATmega328P at 16 MHz, in simulated time. Knows neither a terminal nor the time of day. */
#pragma once
#include <stdint.h>

#include <sim_avr.h>

enum { CYCLES_PER_US = 16, FIRST_PIN = 4, LAST_PIN = 12 };

/* What the program around it does with the board's outputs. */
void board_on_byte(uint8_t byte);
void board_on_pin(int pin, int level);

/* Powers the board on with a firmware; 0 when it could. */
int board_start(const char *firmware);

avr_cycle_count_t board_cycle(void);
/* Lets time pass up to a cycle. Ends the program when the CPU stops, which this firmware never makes it do. */
void board_run_until(avr_cycle_count_t end);
/* The cycle at which a sleeping board has something to do; no later than `latest`. */
avr_cycle_count_t board_next_event(avr_cycle_count_t latest);

/* Queues a byte for the firmware's UART: it arrives one byte's time after the one before, and not before a cycle. */
int board_receive(uint8_t byte, avr_cycle_count_t not_before);
/* Bytes that still fit into the queue. */
unsigned board_room(void);
/* Takes every byte off the queue. */
void board_forget_bytes(void);
/* Cycle numbers of what is queued were given by a clock that was set back. */
void board_shift_bytes(avr_cycle_count_t earlier);

/* As its reset line does. */
void board_reset(void);
/* The main loop gets nowhere until the next reset. */
void board_hang(void);

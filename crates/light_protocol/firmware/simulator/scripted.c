/* Runs the firmware on a simulated ATmega328P, driven by lines on standard input, in simulated time only.
 *
 *   send HEX     bytes for the UART, one after another at the line's speed, while the time of `run` passes
 *   run MICROS   lets simulated time pass
 *   hang         the firmware gets nowhere until its next reset (to see the hardware watchdog act)
 *
 * It prints, with the CPU cycle (16 to the microsecond) of each:
 *   uart CYCLE HEX       a byte from the firmware
 *   pin CYCLE NAME 0|1   an output that changed (D4..D12)
 *   ran CYCLE            a `run` is over
 * It ends with standard input. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "board.h"

enum { LINE = 8192 };

void board_on_byte(uint8_t byte) { printf("uart %llu %02x\n", (unsigned long long)board_cycle(), byte); }

void board_on_pin(int pin, int level) { printf("pin %llu D%d %d\n", (unsigned long long)board_cycle(), pin, level); }

static void run(unsigned long micros) {
  board_run_until(board_cycle() + (avr_cycle_count_t)micros * CYCLES_PER_US);
  printf("ran %llu\n", (unsigned long long)board_cycle());
  fflush(stdout);
}

static void queue_bytes(const char *hex) {
  unsigned byte;
  for (; sscanf(hex, "%2x", &byte) == 1; hex += 2) board_receive((uint8_t)byte, 0);
}

static int obey(char *line) {
  if (strncmp(line, "send ", 5) == 0) {
    queue_bytes(line + 5);
  } else if (strncmp(line, "run ", 4) == 0) {
    run(strtoul(line + 4, NULL, 10));
  } else if (strncmp(line, "hang", 4) == 0) {
    board_hang();
  } else {
    return -1;
  }
  return 0;
}

int main(int count, char **arguments) {
  if (count != 2 || board_start(arguments[1]) != 0) {
    fprintf(stderr, "usage: scripted firmware.elf\n");
    return 2;
  }
  static char line[LINE];
  while (fgets(line, sizeof line, stdin) != NULL) {
    if (obey(line) != 0) {
      fprintf(stderr, "unknown line: %s", line);
      return 2;
    }
  }
  return 0;
}

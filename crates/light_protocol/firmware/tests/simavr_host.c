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
#include <ctype.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <avr_ioport.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>

enum { CYCLES_PER_US = 16, FIRST_PIN = 4, LAST_PIN = 12, LINE = 8192 };
/* simavr's UART takes 11 bit times for a byte: feeding it faster would fill its queue. */
enum { CYCLES_PER_BYTE = 96 * CYCLES_PER_US };

static avr_t *avr;
static avr_irq_t *uart_in;
static uint8_t queue[LINE];
static size_t queued, sent;
static avr_cycle_count_t next_byte_at;
static int hung;
static avr_flashaddr_t hung_at;
static uint8_t displaced[2];

static void on_uart(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  (void)param;
  printf("uart %llu %02x\n", (unsigned long long)avr->cycle, value & 0xff);
}

static void on_pin(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  printf("pin %llu D%d %u\n", (unsigned long long)avr->cycle, (int)(intptr_t)param, value & 1);
}

static void watch_pins(void) {
  for (int pin = FIRST_PIN; pin <= LAST_PIN; pin++) {
    char port = pin < 8 ? 'D' : 'B';
    avr_irq_t *irq = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), pin % 8);
    avr_irq_register_notify(irq, on_pin, (void *)(intptr_t)pin);
  }
}

static void watch_uart(void) {
  uint32_t flags = 0;
  avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
  flags &= ~(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
  avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_uart, NULL);
  uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
}

/* Replaces the next instruction by a jump to itself (rjmp .-2). */
static void hang(void) {
  hung_at = avr->pc;
  memcpy(displaced, avr->flash + hung_at, sizeof displaced);
  avr->flash[hung_at] = 0xff;
  avr->flash[hung_at + 1] = 0xcf;
  hung = 1;
}

static void recover(void) {
  memcpy(avr->flash + hung_at, displaced, sizeof displaced);
  hung = 0;
}

static void run(unsigned long micros) {
  avr_cycle_count_t end = avr->cycle + (avr_cycle_count_t)micros * CYCLES_PER_US;
  while (avr->cycle < end) {
    if (sent < queued && avr->cycle >= next_byte_at) {
      avr_raise_irq(uart_in, queue[sent++]);
      next_byte_at = avr->cycle + CYCLES_PER_BYTE;
    }
    int state = avr_run(avr);
    if (hung && avr->pc == 0) recover();
    if (state == cpu_Done || state == cpu_Crashed) {
      fprintf(stderr, "the simulated CPU stopped, state %d\n", state);
      exit(1);
    }
  }
  printf("ran %llu\n", (unsigned long long)avr->cycle);
  fflush(stdout);
}

static void queue_bytes(const char *hex) {
  unsigned byte;
  for (; sscanf(hex, "%2x", &byte) == 1 && queued < sizeof queue; hex += 2) queue[queued++] = (uint8_t)byte;
}

static int obey(char *line) {
  if (strncmp(line, "send ", 5) == 0) {
    queue_bytes(line + 5);
  } else if (strncmp(line, "run ", 4) == 0) {
    run(strtoul(line + 4, NULL, 10));
  } else if (strncmp(line, "hang", 4) == 0) {
    hang();
  } else {
    return -1;
  }
  return 0;
}

int main(int count, char **arguments) {
  elf_firmware_t firmware;
  memset(&firmware, 0, sizeof firmware);
  if (count != 2 || elf_read_firmware(arguments[1], &firmware) != 0) {
    fprintf(stderr, "usage: simavr_host firmware.elf\n");
    return 2;
  }
  avr = avr_make_mcu_by_name("atmega328p");
  if (avr == NULL || avr_init(avr) != 0) return 1;
  avr->frequency = 16000000;
  avr_load_firmware(avr, &firmware);
  watch_uart();
  watch_pins();
  static char line[LINE];
  while (fgets(line, sizeof line, stdin) != NULL) {
    if (obey(line) != 0) {
      fprintf(stderr, "unknown line: %s", line);
      return 2;
    }
  }
  return 0;
}

#include "board.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <avr_extint.h>
#include <avr_ioport.h>
#include <avr_uart.h>
#include <sim_elf.h>

enum { QUEUE = 8192 };
/* simavr's UART takes 11 bit times for a byte: feeding it faster would fill its queue. */
enum { CYCLES_PER_BYTE = 96 * CYCLES_PER_US };

struct queued_byte {
  avr_cycle_count_t not_before;
  uint8_t byte;
};

static avr_t *avr;
static avr_irq_t *uart_in;
static struct queued_byte queue[QUEUE];
static unsigned first, count;
static avr_cycle_count_t line_free_at;
static int levels[LAST_PIN + 1];
static int hung;
static avr_flashaddr_t hung_at;
static uint8_t displaced[2];

static void on_uart(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  (void)param;
  board_on_byte((uint8_t)value);
}

static void set_level(int pin, int level) {
  if (levels[pin] == level) return;
  levels[pin] = level;
  board_on_pin(pin, level);
}

static void on_pin(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  set_level((int)(intptr_t)param, value & 1);
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

/* simavr would sleep on this computer's clock; here whoever calls decides how fast time passes. */
static void do_not_sleep(avr_t *board, avr_cycle_count_t cycles) {
  (void)board;
  (void)cycles;
}

/* A sleeping CPU jumps to the next timer: this one is where it shall stop. */
static avr_cycle_count_t stop_here(avr_t *board, avr_cycle_count_t when, void *param) {
  (void)board;
  (void)when;
  (void)param;
  return 0;
}

static void keep_quiet(avr_t *board, const int level, const char *format, va_list arguments) {
  (void)board;
  if (level <= LOG_ERROR) vfprintf(stderr, format, arguments);
}

int board_start(const char *path) {
  elf_firmware_t firmware;
  memset(&firmware, 0, sizeof firmware);
  avr_global_logger_set(keep_quiet);
  if (elf_read_firmware(path, &firmware) != 0) return -1;
  avr = avr_make_mcu_by_name("atmega328p");
  if (avr == NULL || avr_init(avr) != 0) return -1;
  avr->frequency = CYCLES_PER_US * 1000000;
  avr->sleep = do_not_sleep;
  avr_load_firmware(avr, &firmware);
  /* Otherwise simavr looks at these pins in every cycle while they are low. */
  avr_extint_set_strict_lvl_trig(avr, 0, 0);
  avr_extint_set_strict_lvl_trig(avr, 1, 0);
  watch_uart();
  watch_pins();
  return 0;
}

avr_cycle_count_t board_cycle(void) { return avr->cycle; }

static avr_cycle_count_t next_byte_at(void) {
  avr_cycle_count_t not_before = queue[first].not_before;
  return not_before > line_free_at ? not_before : line_free_at;
}

static void feed(void) {
  if (count == 0 || avr->cycle < next_byte_at()) return;
  avr_raise_irq(uart_in, queue[first].byte);
  line_free_at = avr->cycle + CYCLES_PER_BYTE;
  first = (first + 1) % QUEUE;
  count--;
}

/* A reset makes inputs of all pins, and the panels' switches take those for low. */
static void was_reset(void) {
  for (int pin = FIRST_PIN; pin <= LAST_PIN; pin++) set_level(pin, 0);
  if (hung) memcpy(avr->flash + hung_at, displaced, sizeof displaced);
  hung = 0;
}

static void run_without_bytes(avr_cycle_count_t end) {
  avr_cycle_timer_register(avr, end - avr->cycle, stop_here, NULL);
  while (avr->cycle < end) {
    int state = avr_run(avr);
    if (state == cpu_Done || state == cpu_Crashed) {
      fprintf(stderr, "the simulated CPU stopped, state %d\n", state);
      exit(1);
    }
    if (avr->pc == 0) {
      was_reset();
      return; /* the reset took the timer away */
    }
  }
  avr_cycle_timer_cancel(avr, stop_here, NULL);
}

void board_run_until(avr_cycle_count_t end) {
  while (avr->cycle < end) {
    feed();
    avr_cycle_count_t stop = end;
    if (count > 0 && next_byte_at() < stop) stop = next_byte_at();
    if (stop <= avr->cycle) stop = avr->cycle + 1;
    run_without_bytes(stop);
  }
}

avr_cycle_count_t board_next_event(avr_cycle_count_t latest) {
  if (avr->state != cpu_Sleeping || avr->interrupt_state > 0) return avr->cycle;
  avr_cycle_timer_slot_p next = avr->cycle_timers.timer;
  if (next != NULL && next->when < latest) latest = next->when;
  if (count > 0 && next_byte_at() < latest) latest = next_byte_at();
  return latest;
}

int board_receive(uint8_t byte, avr_cycle_count_t not_before) {
  if (count == QUEUE) return -1;
  queue[(first + count++) % QUEUE] = (struct queued_byte){not_before, byte};
  return 0;
}

unsigned board_room(void) { return QUEUE - count; }

void board_forget_bytes(void) { count = 0; }

void board_shift_bytes(avr_cycle_count_t earlier) {
  for (unsigned i = 0; i < count; i++) {
    avr_cycle_count_t *not_before = &queue[(first + i) % QUEUE].not_before;
    *not_before = *not_before > earlier ? *not_before - earlier : 0;
  }
}

void board_reset(void) {
  avr_reset(avr);
  avr_regbit_set(avr, avr->reset_flags.extrf);
  was_reset();
}

/* Replaces the next instruction by a jump to itself (rjmp .-2). */
void board_hang(void) {
  if (hung) return;
  hung_at = avr->pc;
  memcpy(displaced, avr->flash + hung_at, sizeof displaced);
  avr->flash[hung_at] = 0xff;
  avr->flash[hung_at + 1] = 0xcf;
  hung = 1;
}

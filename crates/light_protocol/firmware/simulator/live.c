/* A light controller to plug into a program: the firmware on a simulated ATmega328P behind a pseudo-terminal, in step
 * with this computer's monotonic clock. When it was held up it catches up, as long as it is not too late for that; then
 * its clock is set back (a `slip`). Whatever happens, edges are exact against each other in cycles.
 *
 * Usage: live firmware.elf [MICROS]; with MICROS, opening the terminal resets the board as a real Uno's is, and its boot
 * loader is silent for so long.
 *
 * It prints (NANOS: the monotonic clock at the board's cycle CYCLE, 16 to the microsecond):
 *   port PATH                    the terminal to open
 *   unplugged                    it is gone
 *   pin CYCLE NANOS PIN 0|1      an output that changed (4..12)
 *   time CYCLE NANOS             answers `sync`: everything before has been printed
 *   slip NANOS                   the board's clock was set back by so much
 * It obeys:
 *   sync                         to be answered once the board's time has caught up
 *   reset MICROS                 resets the board; its boot loader is silent for so long
 *   unplug, plug                 takes the terminal away, gives a new one; the board stays powered
 *   inject HEX                   bytes to the host between the firmware's
 *   drop N, corrupt N            the next N bytes to the firmware are lost, or changed
 *   corrupt_replies N            the next N bytes to the host are changed
 *   hang                         the firmware gets nowhere until its next reset
 * It ends with standard input. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "board.h"

enum { LINE = 8192, OUTGOING = 4096, PATH = 64 };
enum { QUANTUM_NS = 100000, LONGEST_NAP_NS = 2000000, CATCH_UP_LIMIT_NS = 250000000 };
/* Simulated at a stretch before looking at input and output again. */
enum { STRETCH_CYCLES = 1000 * CYCLES_PER_US };
/* A byte is whole for its receiver only after its ten bits: 115200 baud, 2.1 % fast. */
enum { CYCLES_PER_BYTE = 85 * CYCLES_PER_US };
enum { CORRUPTION = 0x15 };

struct outgoing_byte {
  avr_cycle_count_t due;
  uint8_t byte;
};

static int64_t start_ns; /* of cycle 0 */
static int master = -1, slave = -1, watcher = -1;
static int openers;
static long reset_on_open_us = -1;
static struct outgoing_byte outgoing[OUTGOING];
static unsigned first_out, count_out;
static unsigned long to_drop, to_corrupt, replies_to_corrupt;
static int sync_wanted;

/* ---- time ---- */

static int64_t now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1000000000LL + now.tv_nsec;
}

static avr_cycle_count_t cycle_at(int64_t ns) {
  return ns <= start_ns ? 0 : (avr_cycle_count_t)(ns - start_ns) * 2 / 125;
}

static int64_t ns_at(avr_cycle_count_t cycle) { return start_ns + (int64_t)(cycle * 125 / 2); }

/* The board stands still for a while. */
static void hold_back(int64_t ns) {
  start_ns += ns;
  board_shift_bytes((avr_cycle_count_t)ns * 2 / 125);
}

/* ---- the board's outputs ---- */

void board_on_pin(int pin, int level) {
  avr_cycle_count_t cycle = board_cycle();
  printf("pin %llu %lld %d %d\n", (unsigned long long)cycle, (long long)ns_at(cycle), pin, level);
}

void board_on_byte(uint8_t byte) {
  if (count_out == OUTGOING) return;
  if (replies_to_corrupt > 0) {
    replies_to_corrupt--;
    byte ^= CORRUPTION;
  }
  outgoing[(first_out + count_out++) % OUTGOING] = (struct outgoing_byte){board_cycle() + CYCLES_PER_BYTE, byte};
}

/* What nobody reads in time is lost, as in the Uno's USB chip. */
static void write_to_host(const uint8_t *bytes, size_t length) {
  if (master >= 0 && length > 0 && write(master, bytes, length) < 0 && errno != EAGAIN) perror("writing to the terminal");
}

static void send_due_bytes(void) {
  uint8_t bytes[OUTGOING];
  size_t length = 0;
  while (count_out > 0 && outgoing[first_out].due <= board_cycle()) {
    bytes[length++] = outgoing[first_out].byte;
    first_out = (first_out + 1) % OUTGOING;
    count_out--;
  }
  write_to_host(bytes, length);
}

/* ---- the terminal ---- */

static void fail(const char *what) {
  perror(what);
  exit(1);
}

static void plug(void) {
  char path[PATH];
  struct termios raw;
  if (master >= 0) return;
  master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0 || ptsname_r(master, path, sizeof path) != 0) {
    fail("opening a pseudo-terminal");
  }
  /* Held open: otherwise the master sees a hang-up whenever a client closes. */
  slave = open(path, O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (slave < 0 || tcgetattr(slave, &raw) != 0) fail(path);
  cfmakeraw(&raw);
  tcsetattr(slave, TCSANOW, &raw);
  openers = 0;
  watcher = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (watcher < 0 || inotify_add_watch(watcher, path, IN_OPEN | IN_CLOSE) < 0) fail("watching the terminal");
  printf("port %s\n", path);
}

static void unplug(void) {
  if (master < 0) return;
  close(watcher);
  close(slave);
  close(master);
  master = slave = watcher = -1;
  board_forget_bytes();
  printf("unplugged\n");
}

static void reset(long silence_us) {
  board_reset();
  count_out = 0;
  /* A boot loader reads what comes and keeps it. */
  board_forget_bytes();
  hold_back(silence_us * 1000LL);
}

/* A client that was killed leaves the terminal in exclusive mode, and no other could open it. */
static void watch_openers(void) {
  char events[4096] __attribute__((aligned(__alignof__(struct inotify_event))));
  ssize_t length = read(watcher, events, sizeof events);
  for (ssize_t at = 0; at < length;) {
    const struct inotify_event *event = (const struct inotify_event *)(events + at);
    at += sizeof *event + event->len;
    if (event->mask & IN_OPEN) {
      if (openers++ == 0 && reset_on_open_us >= 0) reset(reset_on_open_us);
    } else if (openers > 0 && --openers == 0) {
      ioctl(slave, TIOCNXCL);
    }
  }
}

static void read_from_host(void) {
  uint8_t bytes[512];
  size_t room = board_room() < sizeof bytes ? board_room() : sizeof bytes;
  ssize_t length = read(master, bytes, room);
  /* Taken after reading, so that no byte arrives before it was sent. */
  avr_cycle_count_t arrived = cycle_at(now_ns());
  for (ssize_t i = 0; i < length; i++) {
    if (to_drop > 0) {
      to_drop--;
      continue;
    }
    if (to_corrupt > 0) {
      to_corrupt--;
      bytes[i] ^= CORRUPTION;
    }
    board_receive(bytes[i], arrived);
  }
}

/* ---- orders ---- */

static void inject(const char *hex) {
  uint8_t bytes[LINE / 2];
  size_t length = 0;
  unsigned byte;
  for (; length < sizeof bytes && sscanf(hex, "%2x", &byte) == 1; hex += 2) bytes[length++] = (uint8_t)byte;
  write_to_host(bytes, length);
}

static void obey(char *line) {
  char *argument = strchr(line, ' ');
  if (argument != NULL) *argument++ = 0;
  unsigned long number = argument == NULL ? 0 : strtoul(argument, NULL, 10);
  if (strcmp(line, "sync") == 0) {
    sync_wanted = 1;
  } else if (strcmp(line, "reset") == 0) {
    reset((long)number);
  } else if (strcmp(line, "unplug") == 0) {
    unplug();
  } else if (strcmp(line, "plug") == 0) {
    plug();
  } else if (strcmp(line, "inject") == 0) {
    inject(argument == NULL ? "" : argument);
  } else if (strcmp(line, "drop") == 0) {
    to_drop = number;
  } else if (strcmp(line, "corrupt") == 0) {
    to_corrupt = number;
  } else if (strcmp(line, "corrupt_replies") == 0) {
    replies_to_corrupt = number;
  } else if (strcmp(line, "hang") == 0) {
    board_hang();
  } else {
    fprintf(stderr, "unknown order: %s\n", line);
    exit(2);
  }
}

static void read_orders(void) {
  static char text[LINE];
  static size_t length;
  ssize_t got = read(STDIN_FILENO, text + length, sizeof text - length);
  if (got == 0) exit(0);
  if (got < 0) return;
  length += (size_t)got;
  char *end;
  while ((end = memchr(text, '\n', length)) != NULL) {
    *end = 0;
    size_t used = (size_t)(end - text) + 1;
    obey(text);
    length -= used;
    memmove(text, text + used, length);
  }
  if (length == sizeof text) length = 0;
}

/* ---- the board in step with the clock ---- */

/* Runs a stretch; nonzero when the board's time has reached the clock's. */
static int run_a_stretch(void) {
  int64_t late = now_ns() - ns_at(board_cycle());
  if (late > CATCH_UP_LIMIT_NS) {
    hold_back(late);
    printf("slip %lld\n", (long long)late);
  }
  avr_cycle_count_t end = cycle_at(now_ns());
  int reached = end <= board_cycle() + STRETCH_CYCLES;
  board_run_until(reached ? end : board_cycle() + STRETCH_CYCLES);
  send_due_bytes();
  return reached;
}

static int64_t nap_ns(void) {
  avr_cycle_count_t latest = board_cycle() + LONGEST_NAP_NS / 125 * 2;
  if (count_out > 0 && outgoing[first_out].due < latest) latest = outgoing[first_out].due;
  int64_t until = ns_at(board_next_event(latest));
  int64_t now = now_ns();
  if (ns_at(board_cycle()) + QUANTUM_NS > until) until = ns_at(board_cycle()) + QUANTUM_NS;
  return until > now ? until - now : 0;
}

static void wait_for_input(int64_t ns) {
  struct pollfd inputs[] = {{STDIN_FILENO, POLLIN, 0}, {master, POLLIN, 0}, {watcher, POLLIN, 0}};
  struct timespec timeout = {ns / 1000000000, ns % 1000000000};
  if (board_room() == 0) inputs[1].fd = -1;
  if (ppoll(inputs, 3, &timeout, NULL) <= 0) return;
  /* An order holds for bytes that were sent after it, which may have come while the terminal was being looked at. */
  if (poll(inputs, 1, 0) > 0) read_orders();
  if (inputs[2].revents) watch_openers();
  if (inputs[1].revents) read_from_host();
}

int main(int count, char **arguments) {
  if (count < 2 || count > 3 || board_start(arguments[1]) != 0) {
    fprintf(stderr, "usage: live firmware.elf [MICROS]\n");
    return 2;
  }
  if (count == 3) reset_on_open_us = strtol(arguments[2], NULL, 10);
  /* Wake-ups to 10 us instead of 50. */
  prctl(PR_SET_TIMERSLACK, 10000UL);
  start_ns = now_ns();
  plug();
  for (;;) {
    int caught_up = run_a_stretch();
    if (sync_wanted && caught_up) {
      sync_wanted = 0;
      printf("time %llu %lld\n", (unsigned long long)board_cycle(), (long long)ns_at(board_cycle()));
    }
    fflush(stdout);
    wait_for_input(caught_up ? nap_ns() : 0);
  }
}

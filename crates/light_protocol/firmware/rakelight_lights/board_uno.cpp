// Arduino Uno (ATmega328P, 16 MHz). Panels L1..L7 on D4..D10, triggers of C1 and C2 on D11 and D12, all active high.
//
// Timer1 runs freely at 16 MHz and is the clock. Timer2 wakes the CPU LEAD_US before an edge is due, and its interrupt
// then waits for the exact tick of Timer1, so that other interrupts (the UART's, a few microseconds) do not move an edge
// and nothing but the set-up ever writes to the clock. The core's millis() timer is switched off; so is `Serial`, whose
// interrupts this file replaces.
#if defined(__AVR_ATmega328P__)
#include "board.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "board_uno.h"
#include "controller.h"

extern Controller controller;

static const uint8_t TICKS_PER_US_LOG2 = 4;
static const uint8_t WAKE_US_PER_TICK_LOG2 = 1;
// Covers a tick of the wake-up timer and the longest time for which interrupts are off or busy.
static const int32_t LEAD_US = 40;
// An edge nearer than this is waited for: not worth a wake-up. Less than a byte on the line (87 us), of which the UART
// holds two while interrupts are off.
static const int32_t WAIT_US = 72;
// An edge further away is looked at again after this.
static const int32_t LONGEST_NAP_US = 400;

static volatile uint32_t overflows;
// An interrupt may have left something to do for the main loop.
static volatile bool woken;

// Not cleared by the start-up code, which runs after they are written.
static uint8_t mcu_flags __attribute__((section(".noinit"), used));
static uint8_t boot_loader_flags __attribute__((section(".noinit"), used));

// Before main: a watchdog that fired stays on with its shortest time until it is told otherwise. The boot loader clears
// MCUSR and leaves a copy in r2. No function returns from here: the code runs on into the next start-up section.
void save_reset_flags() __attribute__((naked, used, section(".init3")));
void save_reset_flags() {
  __asm__ volatile("sts %0, r2" : : "i"(&boot_loader_flags) : "memory");
  mcu_flags = MCUSR;
  MCUSR = 0;
  wdt_disable();
}

// ---- outputs ----

static const uint8_t PORTD_PANELS = 0xF0;  // L1..L4
static const uint8_t PORTB_OUTPUTS = 0x1F; // L5..L7, then the triggers

static inline void write_outputs(Pins pins) {
  uint8_t port_d = (PORTD & ~PORTD_PANELS) | (uint8_t)(pins.panels << 4);
  uint8_t port_b = (PORTB & ~PORTB_OUTPUTS) | (pins.panels >> 4 & 0x07) | (uint8_t)(pins.triggers << 3);
  PORTD = port_d;
  PORTB = port_b;
}

// ---- clock ----

ISR(TIMER1_OVF_vect) { overflows++; }

static uint32_t micros_locked() {
  uint16_t ticks = TCNT1;
  uint32_t high = overflows;
  if ((TIFR1 & _BV(TOV1)) && ticks < 0x8000) high++;
  return (high << (16 - TICKS_PER_US_LOG2)) | (ticks >> TICKS_PER_US_LOG2);
}

uint32_t board_micros() {
  uint8_t before = board_lock();
  uint32_t now = micros_locked();
  board_unlock(before);
  return now;
}

uint8_t board_lock() {
  uint8_t before = SREG;
  cli();
  return before;
}

void board_unlock(uint8_t before) {
  __asm__ volatile("" ::: "memory");
  SREG = before;
}

uint32_t board_write(Pins pins) {
  write_outputs(pins);
  return micros_locked();
}

// ---- edges ----

static inline void wait_for(uint32_t due) {
  uint16_t due_ticks = (uint16_t)(due << TICKS_PER_US_LOG2);
  while ((int16_t)(TCNT1 - due_ticks) < 0) {
  }
}

static void wake_in(int32_t micros) {
  if (micros > LONGEST_NAP_US) micros = LONGEST_NAP_US;
  OCR2A = (uint8_t)(micros >> WAKE_US_PER_TICK_LOG2);
  TCNT2 = 0;
  TCCR2B = _BV(CS21) | _BV(CS20);  // 16 MHz / 32
  TIFR2 = _BV(OCF2A);
  TIMSK2 = _BV(OCIE2A);
}

static void make_due_edges() {
  Sequencer& sequencer = controller.sequencer;
  while (sequencer.active()) {
    int32_t left = (int32_t)(sequencer.due() - micros_locked());
    if (left >= WAIT_US) return wake_in(left - LEAD_US);
    Pins pins = sequencer.pins();
    wait_for(sequencer.due());
    sequencer.fired(board_write(pins));
  }
  TIMSK2 = 0;
  TCCR2B = 0;
}

ISR(TIMER2_COMPA_vect) {
  make_due_edges();
  woken = true;
}

void board_arm() { make_due_edges(); }

// ---- UART ----

struct Ring {
  volatile uint8_t bytes[256];
  volatile uint8_t head;
  volatile uint8_t tail;
};

static Ring received;
static Ring to_send;

ISR(USART_RX_vect) {
  uint8_t byte = UDR0;
  uint8_t next = received.head + 1;
  // Full: the byte is lost and its frame's CRC will tell.
  if (next == received.tail) return;
  received.bytes[received.head] = byte;
  received.head = next;
  woken = true;
}

ISR(USART_UDRE_vect) {
  if (to_send.tail == to_send.head) {
    UCSR0B &= ~_BV(UDRIE0);
    return;
  }
  UDR0 = to_send.bytes[to_send.tail];
  to_send.tail = to_send.tail + 1;
}

int board_receive() {
  if (received.tail == received.head) return -1;
  uint8_t byte = received.bytes[received.tail];
  received.tail = received.tail + 1;
  return byte;
}

void board_send(const uint8_t* bytes, uint8_t length) {
  for (uint8_t i = 0; i < length; i++) {
    uint8_t next = to_send.head + 1;
    // The interrupt empties it at the line's speed, whatever the host does.
    while (next == to_send.tail) {
    }
    to_send.bytes[to_send.head] = bytes[i];
    to_send.head = next;
    uint8_t before = board_lock();
    UCSR0B |= _BV(UDRIE0);
    board_unlock(before);
  }
}

// ---- rest ----

// Timer1 wakes the CPU every 4 ms at the latest, Timer2 every 0.4 ms while lights are on.
void board_rest() {
  cli();
  if (!woken) {
    sleep_enable();
    // The instruction after sei() is executed before any interrupt: none slips in between.
    sei();
    sleep_cpu();
    sleep_disable();
  }
  woken = false;
  sei();
}

// ---- start ----

uint8_t board_reset_cause() { return mcu_flags ? mcu_flags : boot_loader_flags; }

void board_begin() {
  cli();
  write_outputs(Pins());
  DDRD |= PORTD_PANELS;
  DDRB |= PORTB_OUTPUTS;

  TIMSK0 = 0;
  TCCR0B = 0;
  TCCR1A = 0;
  TCCR1B = _BV(CS10);
  TCNT1 = 0;
  TIMSK1 = _BV(TOIE1);
  TCCR2A = 0;
  TCCR2B = 0;
  TIMSK2 = 0;

  // 115200 baud, 8N1, as the Uno's own USB chip makes it: 2.1 % fast on both sides.
  UCSR0A = _BV(U2X0);
  UBRR0 = 16;
  UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);

  set_sleep_mode(SLEEP_MODE_IDLE);
  wdt_enable(WDTO_250MS);
  sei();
}
#endif

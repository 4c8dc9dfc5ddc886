// Arduino Uno (ATmega328P, 16 MHz). Panels L1..L7 on D4..D10, triggers of C1 and C2 on D11 and D12, all active high.
//
// Timer1 runs freely at 2 MHz. It is the clock, and its compare interrupt makes the edges: it comes LEAD_US early and
// waits for the exact tick, so that other interrupts (the UART's, a few microseconds) do not move an edge. The core's
// millis() timer is switched off; so is `Serial`, whose interrupts this file replaces.
#if defined(__AVR_ATmega328P__)
#include "board.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "board_uno.h"
#include "controller.h"

extern Controller controller;

static const uint16_t LEAD_US = 16;
// An edge nearer than this is waited for, because arming the timer for it could come too late.
static const int32_t WAIT_US = 48;

static volatile uint32_t overflows;

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
  return (high << 15) | (ticks >> 1);
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
  uint16_t due_ticks = (uint16_t)(due << 1);
  while ((int16_t)(TCNT1 - due_ticks) < 0) {
  }
}

static void make_due_edges() {
  Sequencer& sequencer = controller.sequencer;
  while (sequencer.active() && (int32_t)(sequencer.due() - micros_locked()) < WAIT_US) {
    Pins pins = sequencer.pins();
    wait_for(sequencer.due());
    sequencer.fired(board_write(pins));
  }
  if (!sequencer.active()) {
    TIMSK1 &= ~_BV(OCIE1A);
    return;
  }
  OCR1A = (uint16_t)((sequencer.due() - LEAD_US) << 1);
  TIFR1 = _BV(OCF1A);
  TIMSK1 |= _BV(OCIE1A);
}

// The compare matches once per turn of the timer (32.8 ms); an edge of a later turn is not due yet.
ISR(TIMER1_COMPA_vect) { make_due_edges(); }

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

// ---- start ----

uint8_t board_reset_cause() { return mcu_flags ? mcu_flags : boot_loader_flags; }

void board_begin() {
  cli();
  write_outputs(Pins());
  DDRD |= PORTD_PANELS;
  DDRB |= PORTB_OUTPUTS;

  TIMSK0 = 0;
  TCCR1A = 0;
  TCCR1B = _BV(CS11);  // 16 MHz / 8
  TCNT1 = 0;
  TIMSK1 = _BV(TOIE1);

  // 115200 baud, 8N1, as the Uno's own USB chip makes it: 2.1 % fast on both sides.
  UCSR0A = _BV(U2X0);
  UBRR0 = 16;
  UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);

  wdt_enable(WDTO_250MS);
  sei();
}
#endif

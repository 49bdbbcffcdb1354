#include "safety.h"
#include "axis.h"
#include "pins.h"
#include <avr/interrupt.h>
#include <avr/wdt.h>
#include <util/atomic.h>

#define TICK_COUNTS 250 /* of 4 us */
#define CHIP_WATCHDOG WDTO_30MS

static volatile uint32_t milliseconds;
static volatile uint8_t state, faults, silent_ms;
static volatile uint8_t settle_left;
static uint8_t open_half_ms; /* by how much the emergency stop input has read open more than half as long as closed */
static volatile uint16_t watchdog_left, stop_left;
static volatile bool homed;
volatile bool safety_estop_heard;
static uint8_t state_after_stop;
static uint16_t longest_stop_ms;
static struct configuration config;

#if SETTLE_MS > 255
#error "settle_left is 8 bits"
#endif

/* Watches the millisecond interrupt, which watches the main loop. It interrupts and never resets: the stock bootloader of
 * the Mega may loop on a watchdog reset. */
static void start_chip_watchdog(void) {
  wdt_reset();
  WDTCSR = _BV(WDCE) | _BV(WDE);
  WDTCSR = _BV(WDIE) | (CHIP_WATCHDOG & 7);
}

void safety_init(void) {
  TCCR0A = _BV(WGM01);
  TCCR0B = _BV(CS01) | _BV(CS00);
  OCR0A = TICK_COUNTS - 1;
  TIMSK0 = _BV(OCIE0A);
  start_chip_watchdog();
}

void safety_configure(struct configuration c, uint16_t stop_ms) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    config = c;
    longest_stop_ms = stop_ms;
  }
}

/* Interrupts are off in the next four. */
static void stop_at_once(uint8_t next) {
  axes_halt();
  if (next == STATE_DISABLED) drives_off();
  state = next;
}

static void ramp_down_to(uint8_t next) {
  state_after_stop = next;
  stop_left = longest_stop_ms;
  state = STATE_STOPPING;
}

static void note(uint8_t fault) {
  faults |= fault;
  homed = false;
}

static void latch(uint8_t fault, bool release) {
  note(fault);
  stop_at_once(STATE_FAULT);
  if (release) drives_off();
}

static void latch_estop_command(void) {
  safety_estop_heard = false;
  latch(FAULT_ESTOP_COMMAND, true);
}

static void end_stop(void) {
  stop_at_once(state_after_stop);
  if (!config.hold_on_fault) drives_off();
}

static void count_down_watchdog(void) {
  if (watchdog_left) {
    watchdog_left--;
  } else {
    note(FAULT_LINK);
    ramp_down_to(STATE_FAULT);
  }
}

static void show_state(uint16_t ms) { /* ENABLED lit, FAULT fast, else slow */
  uint16_t blink = state == STATE_FAULT ? 128 : 1024;
  if (state == STATE_ENABLED || (ms & blink))
    PORTB |= _BV(PB7);
  else
    PORTB &= ~_BV(PB7);
}

/* One stray reading among motor wires is no button, and a contact that chatters is one: two up while it is open, one down
 * while it is closed. A drive's alarm output has a low impedance, and one reading is enough. Without energised drives an
 * alarm input only tells that the motors' supply is off. */
static void look_at_inputs(void) {
  if (estop_open())
    open_half_ms += open_half_ms < 2 * ESTOP_MS ? 2 : 0;
  else if (open_half_ms)
    open_half_ms--;
  if (open_half_ms >= 2 * ESTOP_MS && !(state == STATE_FAULT && (faults & FAULT_ESTOP_INPUT))) latch(FAULT_ESTOP_INPUT, true);
  if (alarm_open() && (state == STATE_ENABLED || state == STATE_STOPPING)) latch(FAULT_DRIVE, !config.hold_on_fault);
}

ISR(TIMER0_COMPA_vect) {
  uint32_t ms = ++milliseconds;
  wdt_reset();
  look_at_inputs();
  if (safety_estop_heard) latch_estop_command();
  if (silent_ms < HEARTBEAT_MS)
    silent_ms++;
  else if (!(faults & FAULT_HANG))
    latch(FAULT_HANG, !config.hold_on_fault);
  if (settle_left) settle_left--;
  if (state == STATE_ENABLED)
    count_down_watchdog();
  else if (state == STATE_STOPPING && !stop_left--)
    end_stop();
  show_state(ms);
}

ISR(WDT_vect) {
  if (!(faults & FAULT_WATCHDOG)) latch(FAULT_WATCHDOG, !config.hold_on_fault);
}

void safety_alive(void) { silent_ms = 0; }

uint8_t safety_state(void) { return state; }
bool safety_homed(void) { return homed; }

struct safety safety_now(void) {
  struct safety now;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    now = (struct safety){.state = state, .faults = faults, .watchdog_left_ms = watchdog_left};
    now.flags = (homed ? FLAG_HOMED : 0) | (drives_are_on() ? FLAG_DRIVES_ON : 0) | (estop_open() ? FLAG_ESTOP_OPEN : 0) |
                (settle_left ? FLAG_SETTLING : 0) | (alarm_open() ? FLAG_ALARM : 0);
  }
  return now;
}

bool safety_may_move(void) { return state == STATE_ENABLED && !settle_left; }

void safety_feed_watchdog(void) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { watchdog_left = config.watchdog_ms; }
}

void safety_enable(void) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (state == STATE_DISABLED && !estop_open() && !alarm_open()) {
      drives_on();
      axes_permit();
      settle_left = SETTLE_MS;
      watchdog_left = config.watchdog_ms;
      state = STATE_ENABLED;
    }
  }
}

void safety_disable(void) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    homed = false;
    if (state == STATE_ENABLED) ramp_down_to(STATE_DISABLED);
    if (state == STATE_FAULT) drives_off();
  }
}

void safety_trust_positions(void) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (state == STATE_ENABLED) homed = true;
  }
}

void safety_emergency_stop(void) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { latch_estop_command(); }
}

void safety_clear(void) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (state == STATE_FAULT && !estop_open()) {
      faults = 0;
      stop_at_once(STATE_DISABLED);
    }
  }
}

void safety_at_rest(void) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (state == STATE_STOPPING) end_stop();
  }
}

uint32_t clock_ms(void) {
  uint32_t ms;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { ms = milliseconds; }
  return ms;
}

uint32_t clock_us(void) {
  uint32_t ms;
  uint8_t counts;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    ms = milliseconds;
    counts = TCNT0;
    if ((TIFR0 & _BV(OCF0A)) && counts < TICK_COUNTS / 2) ms++; /* the tick is due but waits for us */
  }
  return ms * 1000 + (uint16_t)counts * 4;
}

#include "load_cells.h"
#include "messages.h"
#include "pins.h"
#include "safety.h"
#include <stdbool.h>
#include <util/atomic.h>
#include <util/delay.h>

/* HX711: DOUT falls when a conversion is done. Each clock pulse brings the next bit, the highest first, in two's
 * complement; the 25th asks for channel A at a gain of 128, and DOUT is high from then on until the next conversion. */
#define BITS 16 /* that are kept: the lower 8 are noise */
#define PULSES 25
#define HIGH_US 1 /* 0.2 to 50; 60 of it switch the amplifier off, so nothing may come between */

static int16_t counts[AXES];
static uint32_t read_ms[AXES];
static bool heard[AXES]; /* at all */

static bool low(uint8_t dout) { return !(PINF & dout); }

/* No interrupt's routine writes port F, so `idle` stays what it was. */
static void pulse(uint8_t idle, uint8_t clock) {
  ATOMIC_BLOCK(ATOMIC_FORCEON) {
    PORTF = idle | clock;
    _delay_us(HIGH_US);
    PORTF = idle;
  }
}

static void read(uint8_t axis, uint8_t dout) {
  uint8_t idle = PORTF, clock = LOAD_CLOCK_BIT(axis);
  uint16_t bits = 0;
  bool driven = false;
  for (uint8_t i = 0; i < PULSES; i++) {
    pulse(idle, clock);
    bool zero = low(dout);
    driven |= zero;
    if (i < BITS) bits = bits << 1 | !zero;
  }
  if (low(dout) || !driven) return; /* a wire to GND, or a spike on an open one: no amplifier has spoken */
  counts[axis] = bits;
  read_ms[axis] = clock_ms();
  heard[axis] = true;
}

void load_cells_poll(void) {
  static uint8_t axis, polled_ms;
  uint8_t now = clock_ms(), dout = LOAD_DATA_BIT(axis);
  if (now == polled_ms) return;
  polled_ms = now;
  if (low(dout)) read(axis, dout);
  if (++axis == AXES) axis = 0;
}

int16_t load_cell_counts(uint8_t axis) { return counts[axis]; }

uint8_t load_cell_age_ms(uint8_t axis) {
  uint32_t age = clock_ms() - read_ms[axis];
  if (age >= LOAD_CELL_SILENT) heard[axis] = false; /* the clock wraps */
  return heard[axis] ? age : LOAD_CELL_SILENT;
}

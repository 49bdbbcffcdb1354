#include "axis.h"
#include "messages.h"
#include "pins.h"
#include <avr/interrupt.h>
#include <util/atomic.h>
#include <util/delay.h>

/* A step interval is one compare of `rest` timer ticks (62.5 ns, plus `fraction`/256 carried from step to step) and
 * `chunks` compares of CHUNK: 16-bit arithmetic in the interrupt for any interval up to 1 s, and a mean rate without drift. */
#define CHUNK 0x4000U
#define REST_LEAST 0x2000U /* of an interval with chunks: far more than any interrupt latency */
#define AHEAD 60           /* ticks: the nearest compare that is certainly still to come once it is set */
#define DIR_HOLD_US 5      /* DM542: DIR holds this long after a step's rising edge */

static struct axis {
  int32_t position;
  int32_t stop_position;
  uint16_t chunks, rest, chunks_left;
  uint8_t fraction, phase;
  int8_t direction;
  bool stop_armed;
  volatile bool stepping;
} axes[AXES];

static volatile uint16_t late_steps;
volatile bool axes_permitted; /* so that a rate worked out before a halt cannot start an axis after it */

struct timer {
  volatile uint16_t *count, *compare;
  volatile uint8_t *mask, *flags;
};
static const struct timer timers[AXES] = {{&TCNT1, &OCR1A, &TIMSK1, &TIFR1},
                                          {&TCNT3, &OCR3A, &TIMSK3, &TIFR3},
                                          {&TCNT4, &OCR4A, &TIMSK4, &TIFR4},
                                          {&TCNT5, &OCR5A, &TIMSK5, &TIFR5}};
#define COMPARE_BIT _BV(OCIE1A) /* the same bit in all four timers' masks and flags */

/* STEP rises first and falls last: what lies between takes longer than the 2.5 us a DM542 asks for (40 cycles). */
static inline __attribute__((always_inline)) void compare_interrupt(uint8_t axis, volatile uint16_t *count,
                                                                    volatile uint16_t *compare, volatile uint8_t *mask) {
  struct axis *a = &axes[axis];
  if (a->chunks_left) {
    a->chunks_left--;
    *compare += CHUNK;
    return;
  }
  PORTA |= STEP_BIT(axis);
  uint8_t phase = a->phase + a->fraction;
  uint16_t next = *compare + a->rest;
  if (phase < a->phase) next++;
  a->phase = phase;
  a->chunks_left = a->chunks;
  uint16_t now = *count;
  if ((int16_t)(next - now) < AHEAD) {
    next = now + AHEAD;
    late_steps++;
  }
  *compare = next;
  int32_t position = a->position + a->direction;
  a->position = position;
  if (a->stop_armed && position == a->stop_position) {
    *mask &= ~COMPARE_BIT;
    a->stepping = false;
  }
  PORTA &= ~STEP_BIT(axis);
}

ISR(TIMER1_COMPA_vect) { compare_interrupt(0, &TCNT1, &OCR1A, &TIMSK1); }
ISR(TIMER3_COMPA_vect) { compare_interrupt(1, &TCNT3, &OCR3A, &TIMSK3); }
ISR(TIMER4_COMPA_vect) { compare_interrupt(2, &TCNT4, &OCR4A, &TIMSK4); }
ISR(TIMER5_COMPA_vect) { compare_interrupt(3, &TCNT5, &OCR5A, &TIMSK5); }

void axes_init(void) {
  TCCR1B = TCCR3B = TCCR4B = TCCR5B = 1; /* normal mode, one tick per cycle */
  for (uint8_t i = 0; i < AXES; i++) axes[i].direction = 1;
}

static void halt(uint8_t axis) {
  *timers[axis].mask &= ~COMPARE_BIT;
  axes[axis].stepping = false;
}

void axis_halt(uint8_t axis) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { halt(axis); }
}

void axes_permit(void) { axes_permitted = true; }

void axes_halt(void) {
  axes_silence();
  for (uint8_t i = 0; i < AXES; i++) axes[i].stepping = false;
}

static void point(uint8_t axis, int8_t direction) {
  _delay_us(DIR_HOLD_US);
  axes[axis].direction = direction;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (direction > 0)
      PORTA &= ~DIR_BIT(axis);
    else
      PORTA |= DIR_BIT(axis);
  }
}

static void start(uint8_t axis) {
  const struct timer *t = &timers[axis];
  struct axis *a = &axes[axis];
  a->chunks_left = a->chunks;
  a->stepping = true;
  *t->compare = *t->count + a->rest;
  *t->flags = COMPARE_BIT; /* a stale match would step at once */
  *t->mask |= COMPARE_BIT;
}

void axis_turn(uint8_t axis, float rate) {
  struct axis *a = &axes[axis];
  int8_t direction = rate < 0 ? -1 : 1;
  uint32_t interval = (float)F_CPU * 256.0f / (rate < 0 ? -rate : rate) + 0.5f; /* 1/256 ticks */
  uint32_t ticks = interval >> 8;
  uint16_t chunks = ticks < REST_LEAST + CHUNK ? 0 : (ticks - REST_LEAST) / CHUNK;
  uint16_t rest = ticks - (uint32_t)chunks * CHUNK;
  if (direction != a->direction) {
    axis_halt(axis);
    point(axis, direction);
  }
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    a->chunks = chunks;
    a->rest = rest;
    a->fraction = interval;
    if (!a->stepping && axes_permitted)
      start(axis);
    else if (a->chunks_left > chunks)
      a->chunks_left = chunks; /* speeding up: do not sit out the old long wait */
  }
}

void axis_stop_at(uint8_t axis, int32_t position, bool armed) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    axes[axis].stop_position = position;
    axes[axis].stop_armed = armed;
  }
}

bool axis_stepping(uint8_t axis) { return axes[axis].stepping; }

int32_t axis_position(uint8_t axis) {
  int32_t position;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { position = axes[axis].position; }
  return position;
}

void axis_set_position(uint8_t axis, int32_t position) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { axes[axis].position = position; }
}

uint16_t axes_late_steps(void) {
  uint16_t count;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { count = late_steps; }
  return count;
}

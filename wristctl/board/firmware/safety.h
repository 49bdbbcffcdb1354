/* The board's state, its faults, and the millisecond interrupt that stops it whatever the main loop does. */
#ifndef SAFETY_H
#define SAFETY_H
#include "messages.h"
#include <stdbool.h>
#include <stdint.h>

struct configuration {
  uint16_t watchdog_ms;
  bool hold_on_fault;
};

void safety_init(void);
void safety_configure(struct configuration c, uint16_t longest_stop_ms); /* the stop is cut off after that long */
uint8_t safety_state(void);

struct safety {
  uint8_t state, faults, flags; /* HOMED, DRIVES_ON, ESTOP_OPEN, SETTLING, ALARM */
  uint16_t watchdog_left_ms;
};
struct safety safety_now(void); /* all at one instant: no stop falls between them */
bool safety_may_move(void); /* ENABLED and settled */
bool safety_homed(void);

void safety_alive(void);         /* the main loop, every turn */
void safety_feed_watchdog(void); /* a command that feeds has come */
void safety_enable(void);
void safety_disable(void); /* ramp down first; in FAULT: release held drives */
void safety_trust_positions(void);
void safety_emergency_stop(void);
extern volatile bool safety_estop_heard; /* the receive interrupt has silenced the axes; the next millisecond latches it */
void safety_clear(void);
void safety_at_rest(void); /* motion has ended: a stop is complete */

uint32_t clock_us(void); /* since reset, in steps of 4 us; wraps */
uint32_t clock_ms(void);

#endif

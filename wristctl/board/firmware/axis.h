/* One step/direction drive: counted steps at an exact mean rate, timed by one compare interrupt per step. */
#ifndef AXIS_H
#define AXIS_H
#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

#define SLOWEST_RATE 1.0f /* steps/s: the fixed point holds intervals up to 1.05 s */

void axes_init(void);
void axes_halt(void);   /* no step on any axis until axes_permit(); call both with interrupts off */
void axes_permit(void);

extern volatile bool axes_permitted;

/* The part of axes_halt() that an interrupt can afford which is not to save every register: not a step comes after it. */
static inline void axes_silence(void) {
  axes_permitted = false;
  TIMSK1 = TIMSK3 = TIMSK4 = TIMSK5 = 0;
}

void axis_halt(uint8_t axis);
void axis_turn(uint8_t axis, float rate); /* signed steps/s, at least SLOWEST_RATE; halts before it turns DIR */
void axis_stop_at(uint8_t axis, int32_t position, bool armed); /* while armed, stepping ends exactly there */
bool axis_stepping(uint8_t axis);
int32_t axis_position(uint8_t axis);
void axis_set_position(uint8_t axis, int32_t position);
uint16_t axes_late_steps(void);

#endif

/* What each axis is to do, turned into step rates: ramps of constant acceleration, exact ends, soft limits. */
#ifndef MOTION_H
#define MOTION_H
#include <stdbool.h>
#include <stdint.h>

void motion_configure(uint32_t acceleration, uint32_t stop_acceleration);
uint16_t motion_longest_stop_ms(void);
void motion_set_limits(const int32_t *lowest, const int32_t *highest);
bool motion_within_limits(const int32_t *positions);
void motion_go_to(uint8_t axis, int32_t position, float top_rate);
void motion_go_at(uint8_t axis, float rate); /* as far as the soft limit */
void motion_stop(void);                      /* ramp every axis down */
bool motion_moving(void);
bool motion_at_limit(void);
int16_t motion_rate(uint8_t axis);
void motion_poll(void); /* updates at most one axis, so that a command never waits for more */

#endif

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
void motion_turn(const float *rates, uint8_t life_ms); /* all axes; ramp down once that long has passed without another */
void motion_stop(void);                      /* ramp every axis down */
bool motion_moving(void);
bool motion_has_goal(uint8_t axis, int32_t position);  /* from there */
bool motion_held_back(uint8_t axis, int32_t position); /* by the soft limit */
bool motion_lapsed(void);     /* the last motion_turn() has outlived its life, and nothing has been asked since */
uint8_t motion_lapses(void);  /* how many have, since reset; wraps */
int16_t motion_rate(uint8_t axis); /* as worked out last: that of an axis that is stepping */
void motion_poll(void); /* updates at most one axis, so that a command never waits for more */

#endif

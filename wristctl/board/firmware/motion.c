#include "motion.h"
#include "axis.h"
#include "messages.h"
#include "safety.h"
#include <math.h>
#include <stdlib.h>

#define UPDATE_MS 2         /* between two new rates of one axis */
#define LONGEST_UPDATE_MS 8 /* a late update must not leap */
#define BRAKING 0.9f        /* of the acceleration is planned with; the rest makes up for updates that come late */
#define CREEP 50.0f         /* steps/s at least, on the way to a goal */

static struct motion {
  int32_t goal;
  float top_rate; /* below SLOWEST_RATE: stand still */
  float rate;
  bool to_limit; /* the goal is a soft limit, and reaching it means being held back */
  uint8_t updated_ms;
} motions[AXES];

static int32_t lowest[AXES], highest[AXES];
static float acceleration, stop_acceleration;
static float braking;         /* planned deceleration */
static float half_change;     /* of the rate, in one update of planned braking */
static float arrival_rate;    /* an axis this slow may end its motion from one step to the next */
static int32_t braking_steps; /* from MAX_RATE, with a margin */

static uint8_t turned_ms, life_ms; /* of motion_turn(); life 0: nothing that could lapse */
static bool lapsed;
static uint8_t lapses;

void motion_configure(uint32_t accelerate, uint32_t stop) {
  acceleration = accelerate;
  stop_acceleration = stop;
  braking = BRAKING * acceleration;
  half_change = braking * (UPDATE_MS * 0.0005f);
  arrival_rate = 2.0f * sqrtf(2.0f * acceleration);
  braking_steps = (float)MAX_RATE * MAX_RATE / (2.0f * braking) + MAX_RATE * 0.01f;
}

uint16_t motion_longest_stop_ms(void) { return MAX_RATE * 1000.0f / stop_acceleration + 3 * UPDATE_MS; }

void motion_set_limits(const int32_t *low, const int32_t *high) {
  for (uint8_t i = 0; i < AXES; i++) {
    lowest[i] = low[i];
    highest[i] = high[i];
  }
}

bool motion_within_limits(const int32_t *positions) {
  for (uint8_t i = 0; i < AXES; i++)
    if (positions[i] < lowest[i] || positions[i] > highest[i]) return false;
  return true;
}

/* What is asked from here on is no rate, or a fresh one. */
static void forget_life(void) {
  life_ms = 0;
  lapsed = false;
}

void motion_go_to(uint8_t axis, int32_t position, float top_rate) {
  struct motion *m = &motions[axis];
  forget_life();
  m->goal = position;
  m->top_rate = top_rate;
  m->to_limit = false;
}

void motion_go_at(uint8_t axis, float rate) {
  struct motion *m = &motions[axis];
  m->goal = rate < 0 ? lowest[axis] : highest[axis];
  m->top_rate = fabsf(rate);
  m->to_limit = m->top_rate >= SLOWEST_RATE;
}

void motion_turn(const float *rates, uint8_t life) {
  forget_life();
  turned_ms = clock_ms();
  for (uint8_t i = 0; i < AXES; i++) {
    motion_go_at(i, rates[i]);
    if (motions[i].top_rate >= SLOWEST_RATE) life_ms = life;
  }
}

void motion_stop(void) {
  forget_life();
  for (uint8_t i = 0; i < AXES; i++) motion_go_at(i, 0);
}

static void lapse(void) {
  motion_stop();
  lapsed = true;
  lapses++;
}

bool motion_has_goal(uint8_t axis, int32_t position) {
  return motions[axis].top_rate >= SLOWEST_RATE && motions[axis].goal != position;
}

bool motion_moving(void) {
  for (uint8_t i = 0; i < AXES; i++)
    if (axis_stepping(i) || (safety_state() == STATE_ENABLED && motion_has_goal(i, axis_position(i)))) return true;
  return false;
}

bool motion_lapsed(void) { return lapsed; }
uint8_t motion_lapses(void) { return lapses; }

bool motion_held_back(uint8_t axis, int32_t position) {
  return motions[axis].to_limit && !motion_has_goal(axis, position);
}

int16_t motion_rate(uint8_t axis) { return motions[axis].rate; }

/* The rate from which constant braking, in updates of this length, ends exactly after `distance` steps. */
static float braking_rate(int32_t distance) {
  return fmaxf(sqrtf(2.0f * braking * distance + half_change * half_change) - half_change, CREEP);
}

static float wanted_rate(const struct motion *m, int32_t left) {
  if (!safety_may_move() || left == 0 || m->top_rate < SLOWEST_RATE) return 0;
  float rate = m->top_rate;
  int32_t distance = labs(left);
  if (distance < braking_steps) rate = fminf(rate, braking_rate(distance));
  return left < 0 ? -rate : rate;
}

static void update(uint8_t axis, uint8_t elapsed_ms) {
  struct motion *m = &motions[axis];
  if (!axis_stepping(axis)) m->rate = 0; /* never started, halted, or arrived */
  int32_t left = m->goal - axis_position(axis);
  float wanted = wanted_rate(m, left), before = m->rate;
  float change = (safety_state() == STATE_STOPPING ? stop_acceleration : acceleration) * 0.001f * elapsed_ms;
  float rate = fminf(fmaxf(wanted, before - change), before + change);
  m->rate = rate;
  bool arriving = wanted * rate > 0 && fabsf(rate) <= arrival_rate;
  axis_stop_at(axis, m->goal, arriving);
  if (rate == before) return;
  if (fabsf(rate) < SLOWEST_RATE)
    axis_halt(axis);
  else
    axis_turn(axis, rate);
}

static bool at_rest(void) {
  for (uint8_t i = 0; i < AXES; i++)
    if (axis_stepping(i)) return false;
  return true;
}

void motion_poll(void) {
  static uint8_t axis;
  if (++axis == AXES) axis = 0;
  uint8_t now = clock_ms(), elapsed = now - motions[axis].updated_ms;
  if (life_ms && (uint8_t)(now - turned_ms) > life_ms) lapse();
  if (elapsed < UPDATE_MS) return;
  motions[axis].updated_ms = now;
  update(axis, elapsed < LONGEST_UPDATE_MS ? elapsed : LONGEST_UPDATE_MS);
  if (safety_state() == STATE_STOPPING && at_rest()) safety_at_rest();
}

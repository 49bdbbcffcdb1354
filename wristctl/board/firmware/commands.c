#include "commands.h"
#include "axis.h"
#include "boot.h"
#include "motion.h"
#include "safety.h"
#include "uart.h"
#include <math.h>
#include <string.h>

#define RATE_SCALE (1.0f / 65536) /* of RATE on the wire */
#define FURTHEST 1000000000L      /* the widest LIMITS */

static uint8_t configure(const struct configure_command *c) {
  motion_configure(c->acceleration, c->stop_acceleration);
  safety_configure((struct configuration){c->watchdog, c->hold_on_fault}, motion_longest_stop_ms());
  return RESULT_OK;
}

static uint8_t set_limits(const struct limits_command *c) {
  for (uint8_t i = 0; i < AXES; i++)
    if (c->lowest[i] > c->highest[i]) return RESULT_RANGE;
  motion_set_limits(c->lowest, c->highest);
  return RESULT_OK;
}

static uint8_t enable(const struct enable_command *c) {
  if (c->key != ENABLE_KEY) return RESULT_KEY;
  if (safety_state() == STATE_ENABLED) return RESULT_OK;
  motion_stop();
  safety_enable();
  return safety_state() == STATE_ENABLED ? RESULT_OK : RESULT_ESTOP_OPEN;
}

static uint8_t go_at_rates(const struct rate_command *c) {
  float rates[AXES], total = 0;
  for (uint8_t i = 0; i < AXES; i++) {
    rates[i] = c->rate[i] * RATE_SCALE;
    total += fabsf(rates[i]);
  }
  if (total > TOTAL_RATE) return RESULT_RANGE;
  for (uint8_t i = 0; i < AXES; i++) motion_go_at(i, rates[i]);
  return RESULT_OK;
}

static uint8_t go_to_targets(const struct target_command *c) {
  uint32_t total = 0;
  for (uint8_t i = 0; i < AXES; i++) total += c->rate[i];
  if (total > TOTAL_RATE || !motion_within_limits(c->position)) return RESULT_RANGE;
  for (uint8_t i = 0; i < AXES; i++) motion_go_to(i, c->position[i], c->rate[i]);
  return RESULT_OK;
}

static uint8_t jog(const struct jog_command *c) {
  for (uint8_t i = 0; i < AXES; i++) {
    int32_t way = c->position[i] - axis_position(i);
    if (way > JOG_SPAN || way < -JOG_SPAN) return RESULT_RANGE;
  }
  for (uint8_t i = 0; i < AXES; i++) motion_go_to(i, c->position[i], JOG_RATE);
  return RESULT_OK;
}

static uint8_t home(const struct home_command *c) {
  if (motion_moving()) return RESULT_MOVING;
  if (!motion_within_limits(c->position)) return RESULT_RANGE;
  for (uint8_t i = 0; i < AXES; i++) axis_set_position(i, c->position[i]);
  motion_stop();
  safety_trust_positions();
  return RESULT_OK;
}

static uint8_t stop(void) {
  motion_stop();
  return RESULT_OK;
}

static uint8_t disable(void) {
  safety_disable();
  return RESULT_OK;
}

static uint8_t emergency_stop(void) {
  safety_emergency_stop();
  return RESULT_OK;
}

static uint8_t clear(void) {
  if (safety_state() == STATE_FAULT) safety_clear();
  if (safety_state() == STATE_FAULT) return RESULT_ESTOP_OPEN;
  return safety_state() == STATE_DISABLED ? RESULT_OK : RESULT_STATE;
}

static uint8_t admission(uint8_t when) {
  uint8_t state = safety_state();
  bool enabled = state == STATE_ENABLED, disabled = state == STATE_DISABLED;
  if (when == WHEN_ANY) return RESULT_OK;
  if (state == STATE_FAULT) return RESULT_FAULTED;
  if (when == WHEN_READY) return enabled || disabled ? RESULT_OK : RESULT_STATE;
  if (when == WHEN_DISABLED) return disabled ? RESULT_OK : RESULT_STATE;
  if (!enabled) return RESULT_STATE;
  if (when == WHEN_HOMED) return safety_homed() ? RESULT_OK : RESULT_UNHOMED;
  if (when == WHEN_UNHOMED) return safety_homed() ? RESULT_STATE : RESULT_OK;
  return RESULT_OK;
}

static uint8_t carry_out(uint8_t command, const void *payload) {
  switch (command) {
  case COMMAND_ENABLE: return enable(payload);
  case COMMAND_DISABLE: return disable();
  case COMMAND_RATE: return go_at_rates(payload);
  case COMMAND_TARGET: return go_to_targets(payload);
  case COMMAND_JOG: return jog(payload);
  case COMMAND_HOME: return home(payload);
  case COMMAND_STOP: return stop();
  case COMMAND_ESTOP: return emergency_stop();
  case COMMAND_CLEAR: return clear();
  case COMMAND_CONFIGURE: return configure(payload);
  case COMMAND_LIMITS: return set_limits(payload);
  }
  return RESULT_OK; /* HELLO, PING, STATUS, COUNTERS only ask */
}

static struct { uint8_t length, when, feeds; } const known[] = {
#define ROW(NAME, WHEN, LENGTH, FEEDS) [COMMAND_##NAME] = {LENGTH, WHEN, FEEDS},
    COMMANDS(ROW)};

static bool is_known(uint8_t code) { return code > 0 && code < sizeof known / sizeof known[0]; }

static uint8_t obey(const struct frame *f) {
  if (!is_known(f->code)) return RESULT_UNKNOWN;
  if (f->length != known[f->code].length) return RESULT_LENGTH;
  uint8_t result = admission(known[f->code].when);
  if (result != RESULT_OK) return result;
  if (!command_in_range(f->code, f->payload)) return RESULT_RANGE;
  result = carry_out(f->code, f->payload);
  if (result == RESULT_OK && known[f->code].feeds) safety_feed_watchdog();
  return result;
}

static struct hello_answer hello(void) {
  return (struct hello_answer){PROTOCOL_VERSION, DICTIONARY_HASH, FIRMWARE_VERSION, boot_nonce(),
                               boot_cause(),     AXES,            MAX_RATE,         TOTAL_RATE};
}

static struct status_answer status(void) {
  struct status_answer s = {.time = clock_us(), .state = safety_state(), .faults = safety_faults()};
  s.flags = safety_flags() | (motion_moving() ? FLAG_MOVING : 0) | (motion_at_limit() ? FLAG_AT_LIMIT : 0);
  s.watchdog_left = safety_watchdog_left_ms();
  for (uint8_t i = 0; i < AXES; i++) {
    s.position[i] = axis_position(i);
    s.rate[i] = motion_rate(i);
  }
  return s;
}

static struct counters_answer counters(void) {
  return (struct counters_answer){frames_received, frames_bad_crc, frames_malformed,
                                  frames_dropped,  uart_errors(),  axes_late_steps()};
}

#define APPEND(STRUCTURE)                                    \
  do {                                                       \
    __typeof__(STRUCTURE) body = STRUCTURE;                  \
    memcpy(f->payload + f->length, &body, sizeof body);      \
    f->length += sizeof body;                                \
  } while (0)

void commands_answer(struct frame *f) {
  uint8_t command = f->code;
  f->payload[0] = obey(f);
  f->length = 1;
  f->code |= 0x80;
  if (!is_known(command) || command == COMMAND_PING) return;
  if (command == COMMAND_HELLO)
    APPEND(hello());
  else if (command == COMMAND_COUNTERS)
    APPEND(counters());
  else
    APPEND(status());
}

void commands_init(void) {
  static const int32_t lowest[AXES] = {-FURTHEST, -FURTHEST, -FURTHEST, -FURTHEST};
  static const int32_t highest[AXES] = {FURTHEST, FURTHEST, FURTHEST, FURTHEST};
  motion_set_limits(lowest, highest);
  configure(&(struct configure_command){DEFAULT_WATCHDOG, DEFAULT_HOLD_ON_FAULT, DEFAULT_ACCELERATION,
                                        DEFAULT_STOP_ACCELERATION});
}

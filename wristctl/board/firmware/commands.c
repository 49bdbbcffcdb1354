#include "commands.h"
#include "axis.h"
#include "boot.h"
#include "load_cells.h"
#include "motion.h"
#include "safety.h"
#include "uart.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

#define RATE_SCALE (1.0f / 65536) /* of RATE on the wire */

/* These change nothing: what they ask for is their answer. */
uint8_t on_hello(void) { return RESULT_OK; }
uint8_t on_ping(void) { return RESULT_OK; }
uint8_t on_status(void) { return RESULT_OK; }
uint8_t on_counters(void) { return RESULT_OK; }
uint8_t on_pulls(void) { return RESULT_OK; }

/* The number that bound commands must name. Each start of the board has its own 256. */
static uint16_t connection;

uint8_t on_connect(const struct connect_command *c) {
  if (c->number != connection && c->number != (uint16_t)(connection + 1)) return RESULT_CONNECTION;
  connection = c->number;
  return RESULT_OK;
}

/* What was told last, byte for byte: ENABLE names its check, so that no motor turns by settings that the host knows not of. */
static struct {
  struct configure_command configure;
  struct limits_command limits;
} __attribute__((packed)) told;

uint8_t on_configure(const struct configure_command *c) {
  told.configure = *c;
  motion_configure(c->acceleration, c->stop_acceleration);
  safety_configure((struct configuration){c->watchdog, c->hold_on_fault}, motion_longest_stop_ms());
  return RESULT_OK;
}

uint8_t on_limits(const struct limits_command *c) {
  for (uint8_t i = 0; i < AXES; i++)
    if (c->lowest[i] > c->highest[i]) return RESULT_RANGE;
  told.limits = *c;
  motion_set_limits(c->lowest, c->highest);
  return RESULT_OK;
}

/* Where the drives were switched on: no tendon is pulled by more than its stiffness makes of the way from there. */
static int32_t jog_origin[AXES];

uint8_t on_enable(const struct enable_command *c) {
  if (c->key != ENABLE_KEY) return RESULT_KEY;
  if (c->configuration != crc16(&told, sizeof told)) return RESULT_CONFIGURATION;
  if (safety_state() == STATE_ENABLED) return RESULT_OK;
  motion_stop();
  for (uint8_t i = 0; i < AXES; i++) jog_origin[i] = axis_position(i);
  safety_enable();
  if (safety_state() == STATE_ENABLED) return RESULT_OK;
  return safety_now().flags & FLAG_ESTOP_OPEN ? RESULT_ESTOP_OPEN : RESULT_ALARM;
}

uint8_t on_rate(const struct rate_command *c) {
  float rates[AXES], total = 0;
  for (uint8_t i = 0; i < AXES; i++) {
    rates[i] = c->rate[i] * RATE_SCALE;
    total += fabsf(rates[i]);
  }
  if (total > TOTAL_RATE) return RESULT_RANGE;
  motion_turn(rates, c->life);
  return RESULT_OK;
}

_Static_assert(sizeof(struct turn_command) == sizeof(struct rate_command), "TURN is a RATE");
uint8_t on_turn(const struct turn_command *c) { return on_rate((const struct rate_command *)c); }

uint8_t on_target(const struct target_command *c) {
  uint32_t total = 0;
  for (uint8_t i = 0; i < AXES; i++) total += c->rate[i];
  if (total > TOTAL_RATE || !motion_within_limits(c->position)) return RESULT_RANGE;
  for (uint8_t i = 0; i < AXES; i++) motion_go_to(i, c->position[i], c->rate[i]);
  return RESULT_OK;
}

uint8_t on_jog(const struct jog_command *c) {
  for (uint8_t i = 0; i < AXES; i++) {
    int32_t way = c->position[i] - jog_origin[i];
    if (way > told.limits.jog || way < -(int32_t)told.limits.jog) return RESULT_RANGE;
  }
  for (uint8_t i = 0; i < AXES; i++) motion_go_to(i, c->position[i], JOG_RATE);
  return RESULT_OK;
}

uint8_t on_home(const struct home_command *c) {
  if (motion_moving()) return RESULT_MOVING;
  if (!motion_within_limits(c->position)) return RESULT_RANGE;
  for (uint8_t i = 0; i < AXES; i++) axis_set_position(i, c->position[i]);
  motion_stop();
  safety_trust_positions();
  return RESULT_OK;
}

uint8_t on_stop(void) {
  motion_stop();
  return RESULT_OK;
}

uint8_t on_disable(void) {
  safety_disable();
  return RESULT_OK;
}

uint8_t on_estop(void) {
  safety_emergency_stop();
  return RESULT_OK;
}

uint8_t on_clear(void) {
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

static struct { uint8_t length, when, bound, feeds; } const known[] = {
#define ROW(NAME, WHEN, LENGTH, BOUND, FEEDS) [COMMAND_##NAME] = {LENGTH, WHEN, BOUND, FEEDS},
    COMMANDS(ROW)};

static bool is_known(uint8_t code) { return code < sizeof known / sizeof known[0] && known[code].when; }

static uint8_t obey(const struct frame *f) {
  if (!is_known(f->code)) return RESULT_UNKNOWN;
  uint8_t named = known[f->code].bound ? sizeof connection : 0;
  if (f->length != named + known[f->code].length) return RESULT_LENGTH;
  if (memcmp(f->payload, &connection, named)) return RESULT_CONNECTION;
  uint8_t result = admission(known[f->code].when);
  if (result != RESULT_OK) return result;
  result = command_carry_out(f->code, f->payload + named);
  if (result == RESULT_OK && known[f->code].feeds) safety_feed_watchdog();
  return result;
}

void answer_hello(struct hello_answer *a) {
  *a = (struct hello_answer){PROTOCOL_VERSION, DICTIONARY_HASH, FIRMWARE_VERSION, boot_nonce(),
                             boot_cause(),     AXES,            MAX_RATE,         TOTAL_RATE,   connection};
}

void answer_status(struct status_answer *a) {
  a->time = clock_us();
  struct safety now = safety_now(); /* before the positions: of a board that has stopped they are final */
  a->state = now.state;
  a->faults = now.faults;
  a->flags = now.flags;
  a->watchdog_left = now.watchdog_left_ms;
  for (uint8_t i = 0; i < AXES; i++) {
    bool stepping = axis_stepping(i);
    a->position[i] = axis_position(i);
    a->rate[i] = stepping ? motion_rate(i) : 0;
    if (stepping || (a->state == STATE_ENABLED && motion_has_goal(i, a->position[i]))) a->flags |= FLAG_MOVING;
    if (motion_held_back(i, a->position[i])) a->flags |= FLAG_AT_LIMIT;
  }
  if (motion_lapsed()) a->flags |= FLAG_LAPSED;
  a->lapses = motion_lapses();
}

_Static_assert(offsetof(struct pulls_answer, counts) == sizeof(struct status_answer), "Pulls begins with a Status");
void answer_pulls(struct pulls_answer *a) {
  answer_status((struct status_answer *)a);
  for (uint8_t i = 0; i < AXES; i++) {
    a->counts[i] = load_cell_counts(i);
    a->age[i] = load_cell_age_ms(i);
  }
}

void answer_counters(struct counters_answer *a) {
  *a = (struct counters_answer){frames_received, frames_bad_crc, frames_malformed,
                                frames_dropped,  uart_errors(),  axes_late_steps()};
}

void commands_answer(struct frame *f) {
  uint8_t command = f->code;
  f->payload[0] = obey(f);
  f->length = 1 + command_answer(command, f->payload + 1);
  f->code |= 0x80;
}

void commands_init(void) {
  connection = (uint16_t)boot_nonce() << 8;
  struct limits_command widest = {.jog = DEFAULT_JOG};
  for (uint8_t i = 0; i < AXES; i++) {
    widest.lowest[i] = DEFAULT_LOWEST;
    widest.highest[i] = DEFAULT_HIGHEST;
  }
  on_limits(&widest);
  on_configure(&(struct configure_command){DEFAULT_WATCHDOG, DEFAULT_HOLD_ON_FAULT, DEFAULT_ACCELERATION,
                                           DEFAULT_STOP_ACCELERATION});
}

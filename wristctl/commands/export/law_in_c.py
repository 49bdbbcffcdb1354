"""A law in C99 for a firmware of one's own: a header, a source, and a program that holds it against vectors."""

from string import Template

from wristctl.commands.export.law_programs import LEVELS, LawPrograms, Observed
from wristctl.commands.export.written_code import c_function, listed, number, shared_words
from wristctl.control.response import OF_A_PLANE

_HEADER = Template("""\
/* $about
 *
 * C99, double, no memory from the heap, <math.h> and <string.h> alone. README.md says when to call what.
 * Do not compile with -ffast-math. */
#ifndef ${upper}_H
#define ${upper}_H

#ifdef __cplusplus
extern "C" {
#endif

#define ${upper}_PLANES $planes
#define ${upper}_PLACES $places /* places of tendons: $place_words */
#define ${upper}_REFERENCE $reference /* values of the reference, of all planes */
#define ${upper}_PERIOD $period /* between two ticks [s] */

typedef struct {
    double memory[$memory];
    double motors[$motors];
$observed    long long tick;
} ${name}_state;

typedef struct {
    double wanted[$planes]; /* torque that is wanted in each plane [N m] */
    double torque[$planes]; /* torque that the pulls give, by the belief [N m] */
    double share[1]; /* share of the wanted torque that they give; 1: all of it */
    double pull[$places]; /* pull of all tendons of each place [N], within limits */
    double tension[$places]; /* tension of one tendon of each place [N] */
    double count[$places]; /* $count_words */
$speed_member} ${name}_output;

/* The controller at rest on the straight wrist, its tendons at their least pull. */
void ${name}_reset(${name}_state *state);
$frame_declared
/* One control period, every ${upper}_PERIOD. */
void ${name}_tick(${name}_state *state, $measured const double *reference, ${name}_output *out);

/* Torque [N m] in each plane that your motors could not give of the last command. */
double *${name}_withheld(${name}_state *state);
$shared_declared
#ifdef __cplusplus
}
#endif
#endif
""")

_FRAME = Template("""
/* Before a tick: a picture's bends [rad], which is `age` old [s]; NULL where it shows no wrist. Returns 0, and does
 * nothing, for a picture older than one that has come before. */
int ${name}_frame(${name}_state *state, const double *bend, double age);
""")

_SOURCE = Template("""\
/* $about
 * Straight-line code of the law, its allocation$observer_words; each comment names the line that it is from. */
#include "$name.h"

#include <math.h>
#include <string.h>

$constants

$functions

void ${name}_reset(${name}_state *state)
{
    static const double motors[] = {$motor_start};
    memset(state, 0, sizeof *state);
    memcpy(state->motors, motors, sizeof motors);
$reset}

double *${name}_withheld(${name}_state *state)
{
    return state->motors + $withheld;
}
$frame_defined
void ${name}_tick(${name}_state *state, $measured const double *reference, ${name}_output *out)
{
    static const double alike[] = {$alike};
    double bend_ref[$planes], rate_ref[$planes];
$see    respond(seen, reference, state->motors, state->memory, out->wanted, out->torque, out->pull, out->share);
    for (int p = 0; p < $planes; ++p) {
        bend_ref[p] = reference[$of_a_plane * p];
        rate_ref[p] = LEAD * reference[$of_a_plane * p + 1];
    }
    actuate(bend_ref, rate_ref, out->pull, state->motors, out->count);
    for (int t = 0; t < $places; ++t) {
        out->tension[t] = out->pull[t] / alike[t];
$speed_set    }
$predict    state->tick += 1;
}
$shared_defined""")

_SHARED = Template("""
/* Out of a shared library, for `wristctl compare`: planes, periods of preview and bytes of a state; the period [s]. */
void ${name}_shape(int shape[3], double *period);

/* Torque [N m] that is wanted in each plane. The state began as zeros. */
void ${name}_wanted(
    void *state, const double *bend, const double *rate, const double *reference, double *torque);
""")

_SHARED_BODY = Template("""
void ${name}_shape(int shape[3], double *period)
{
    shape[0] = $planes;
    shape[1] = $preview;
    shape[2] = (int)sizeof(${name}_state);
    *period = ${upper}_PERIOD;
}

void ${name}_wanted(
    void *state, const double *bend, const double *rate, const double *reference, double *torque)
{
    ${name}_state *own = state;
    ${name}_output out;
    if (own->tick == 0) {
        ${name}_reset(own);
    }
    ${name}_tick(own, bend, rate, reference, &out);
    memcpy(torque, out.wanted, sizeof out.wanted);
}
""")

_FRAME_BODY = Template("""
int ${name}_frame(${name}_state *state, const double *bend, double age)
{
    static const double gain[] = {$gain};
    const double past_tick = (double)state->tick - age / PERIOD;
    const double at = past_tick > 0.0 ? past_tick : 0.0;
    const long long captured = (long long)floor(at + 1e-6);
    const double since = at > (double)captured ? (at - (double)captured) * PERIOD : 0.0;
    if (captured < state->fused_tick || captured > state->tick) {
        return 0;
    }
    for (long long past = state->fused_tick; past < captured; ++past) {
        propagate(state->counts[past % $remembered], state->fused);
    }
    for (int p = 0; bend != NULL && p < $planes; ++p) {
        double *x = state->fused + $of_x * p;
        const double innovation = bend[p] - x[0] - since * x[1];
        for (int i = 0; i < $of_x; ++i) {
            x[i] += gain[$of_x * p + i] * innovation;
        }
    }
    memcpy(state->now, state->fused, sizeof state->now);
    for (long long past = captured; past < state->tick; ++past) {
        propagate(state->counts[past % $remembered], state->now);
    }
    state->fused_tick = captured;
    return 1;
}
""")

_PREDICT = Template("""\
    if (state->tick - state->fused_tick >= $remembered) { /* no picture for long: go on before this tick is forgotten */
        propagate(state->counts[state->fused_tick % $remembered], state->fused);
        state->fused_tick += 1;
    }
    memcpy(state->counts[state->tick % $remembered], out->count, sizeof out->count);
    propagate(out->count, state->now);
""")

_TEST = Template("""\
/* Holds $name.c against vectors.csv:
 * cc -std=c99 -O2 $name.c ${name}_test.c -lm -o law_test && ./law_test vectors.csv */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "$name.h"

int main(int argc, char **argv)
{
    static char text[$line];
    static ${name}_state state;
    ${name}_output out;
    double values[$columns], largest = 0.0;
    long ticks = 0;
    FILE *file = fopen(argc > 1 ? argv[1] : "vectors.csv", "r");
    if (file == NULL || fgets(text, sizeof text, file) == NULL) {
        fprintf(stderr, "no vectors\\n");
        return 2;
    }
    ${name}_reset(&state);
    while (fgets(text, sizeof text, file) != NULL) {
        char *at = text;
        for (int k = 0; k < $columns; ++k) {
            values[k] = strtod(at, &at);
            at += *at == ',';
        }
        $call
        const double *expected = values + $expected;
        double found[$results];
        int n = 0;
        for (int p = 0; p < $planes; ++p) {
            found[n++] = out.wanted[p];
        }
        for (int t = 0; t < $places; ++t) {
            found[n++] = out.tension[t];
        }
        for (int t = 0; t < $places; ++t) {
            found[n++] = out.$driven[t];
        }
        for (int k = 0; k < n; ++k) {
            const double error = fabs(found[k] - expected[k]) / fmax(1.0, fabs(expected[k]));
            largest = error <= largest ? largest : error; /* not a number is the largest */
        }
        ++ticks;
    }
    fclose(file);
    printf("%ld ticks, largest difference %.3g\\n", ticks, largest);
    return ticks > 0 && largest <= 1e-9 ? 0 : 1;
}
""")


def c_files(programs: LawPrograms, about: str) -> dict[str, str]:
    """Texts of header, source and test by the names of their files."""
    words, name = _words(programs, about), programs.name
    return {
        f"{name}.h": _HEADER.substitute(words),
        f"{name}.c": _SOURCE.substitute(words),
        f"{name}_test.c": _TEST.substitute(words),
    }


def _words(programs: LawPrograms, about: str) -> dict[str, str]:
    planes, places, inputs = programs.planes, programs.places, programs.inputs
    results = planes + 2 * places
    words = shared_words(programs) | {
        "about": about.replace("*/", "* /"), "upper": programs.name.upper(), "motors": str(len(programs.motors)),
        "count_words": LEVELS[programs.level].reckoned,
        "place_words": "the + and the - side" if planes == 1 else "tendons in the study's order",
        "columns": str(inputs + results), "results": str(results), "line": str(32 * (inputs + results)),
        "observer_words": ", its drive and its observer" if programs.observer else " and its drive",
        "speed_member": "", "speed_set": "",
    }  # fmt: skip
    if programs.remembered:
        words["speed_member"] = f"    double {programs.driven}[{places}]; /* {LEVELS[programs.level].sent} */\n"
        words["speed_set"] = (
            f"        out->{programs.driven}[t] = state->motors[{2 * (places + planes)} + {programs.remembered} * t];\n"
        )
    values = programs.constants.items()
    words["constants"] = "\n".join(f"static const double {key} = {number(value, 'c')};" for key, value in values)
    words["functions"] = "\n\n".join(c_function(key, function) for key, function in programs.functions.items())
    return words | (_measured(programs) if programs.observer is None else _observed(programs, programs.observer))


def _measured(programs: LawPrograms) -> dict[str, str]:
    planes = programs.planes
    see = [
        f"    double seen[{OF_A_PLANE * planes}];",
        f"    for (int p = 0; p < {planes}; ++p) {{",
        f"        seen[{OF_A_PLANE} * p] = bend[p];",
        f"        seen[{OF_A_PLANE} * p + 1] = rate[p];",
        f"        seen[{OF_A_PLANE} * p + 2] = 0.0;",
        "    }\n",
    ]
    words = shared_words(programs) | {"upper": programs.name.upper(), "preview": str(programs.preview)}
    return {
        "observed": "", "frame_declared": "", "frame_defined": "", "reset": "", "predict": "",
        "shared_declared": _SHARED.substitute(words), "shared_defined": _SHARED_BODY.substitute(words),
        "measured": "const double *bend, const double *rate,", "see": "\n".join(see),
        "call": f"{programs.name}_tick(&state, values + 1, values + {1 + planes}, values + {1 + 2 * planes}, &out);",
    }  # fmt: skip


def _observed(programs: LawPrograms, observer: Observed) -> dict[str, str]:
    planes, name, size = programs.planes, programs.name, OF_A_PLANE * programs.planes
    of_observer = {"of_x": str(OF_A_PLANE), "remembered": str(observer.remembered), "gain": listed(observer.gain)}
    words = shared_words(programs) | of_observer
    state = [
        f"    double fused[{size}]; /* bend, rate and load of each plane at the last picture */",
        f"    double now[{size}]; /* and now */",
        f"    double counts[{observer.remembered}][{programs.places}];",
        "    long long fused_tick;\n",
    ]
    call = [
        "if (values[0] >= 0.0) {",
        f"            {name}_frame(&state, isnan(values[1]) ? NULL : values + 1, values[0]);",
        "        }",
        f"        {name}_tick(&state, values + {1 + planes}, &out);",
    ]
    reset = [
        f"    static const double start[] = {{{listed(observer.start)}}};",
        "    memcpy(state->fused, start, sizeof start);",
        "    memcpy(state->now, start, sizeof start);\n",
    ]
    return {
        "observed": "\n".join(state), "frame_declared": _FRAME.substitute(words),
        "frame_defined": _FRAME_BODY.substitute(words), "predict": _PREDICT.substitute(words),
        "shared_declared": "", "shared_defined": "",
        "reset": "\n".join(reset), "measured": "", "see": "    const double *seen = state->now;\n",
        "call": "\n".join(call),
    }  # fmt: skip

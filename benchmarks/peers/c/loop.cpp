/* Closed loops of the sliding mode law on the wrist, LANES rollouts side by side: the machine's limit.
 *
 * Same equations, law, allocation, step and running metrics as wristctl's kernel; built for SEGMENTS and LANES. */
#include "wrist.h"
#include "rodas3.h"

enum { SQUARED, MOVE, EXIT, ABSOLUTE, LATE, LATE_COUNT, EXIT2, EXIT5, OVER, PEAK, TENSION, VARIATION, SATURATED, SLACK,
       TICKS, TICKS_MOVE, PLUS, MINUS, ALIVE, SUMS };

struct work {
    const double *plant, *model;          /* 12 values each: the wrist of N segments, and of one */
    double low, high;                     /* pull of one side [N] */
    double last, move, rest, horizon;    /* of the reference */
    const double *reference;              /* [tick][3]: angle, rate, acceleration */
    const double *gains;                  /* [rollout][3] */
    double *state;                        /* [rollout][2 N]: angles and rates at the end */
    double *sums;                         /* [rollout][SUMS] */
    double *record;                       /* [tick] tip angle of the first rollout, or NULL */
    double period;
    int rollouts, ticks, substeps;
    int next;
};

INLINE void gather(lane *s, const work *job, double time, lane theta, double theta_ref, lane plus, lane minus, lane out)
{
    const lane one = 1.0, error = theta - theta_ref, squared = error * error;
    const lane off = size(theta - job->last), now = time;
    const double moving = time <= job->rest, late = time >= 0.9 * job->horizon;
    s[SQUARED] += squared;
    s[MOVE] += moving * squared;
    s[ABSOLUTE] += size(error);
    s[LATE] += late * size(error);
    s[LATE_COUNT] += late;
    s[EXIT2] = where(off > 0.02 * job->move, now, s[EXIT2]);
    s[EXIT] = where(off > 0.02 * job->move, s[SQUARED], s[EXIT]);
    s[EXIT5] = where(off > 0.05 * job->move, now, s[EXIT5]);
    s[OVER] = greater(s[OVER], job->last < 0 ? job->last - theta : theta - job->last);
    s[PEAK] = greater(s[PEAK], greater(plus, minus));
    s[TENSION] += 0.5 * (plus * plus + minus * minus);
    s[VARIATION] += where(s[TICKS] > 0.0, size(plus - s[PLUS]) + size(minus - s[MINUS]), 0.0);
    s[PLUS] = plus;
    s[MINUS] = minus;
    s[SATURATED] += out;
    s[SLACK] += where((plus <= 0.0) | (minus <= 0.0), one, 0.0);
    s[TICKS] += 1.0;
    s[TICKS_MOVE] += moving;
}

static void block(work *job, int first)
{
    const segment plant = segment_of(job->plant), model = segment_of(job->model);
    const lane low = job->low, high = job->high, one = 1.0;
    const lane half = 0.5 * model.length / model.spans, share = 0.5 / model.spans;
    lane theta[N], omega[N], old_theta[N], gain[3], sum[SUMS];
    EACH(i) theta[i] = omega[i] = 0.0;
    for (int i = 0; i < SUMS; i++) sum[i] = i == ALIVE;
    for (int l = 0; l < LANES; l++)
        for (int i = 0; i < 3; i++) {
            int from = first + l < job->rollouts ? first + l : job->rollouts - 1;
            ((double *)&gain[i])[l] = job->gains[3 * from + i];
        }
    for (int tick = 0; tick < job->ticks; tick++) {
        const double *ref = job->reference + 3 * tick;
        lane angle = 0.0, rate = 0.0;
        EACH(i) { angle += theta[i]; rate += omega[i]; }
        lane wanted = sliding_mode(&model, angle, rate, ref[0], gain);
        lane y = angle * share;
        bessels b = bessel(y);
        lane bending = model.tendon_offset * (b.e0 - b.s * b.e1), squeeze = half * y * b.e1;
        lane arm_plus = bending + squeeze, arm_minus = squeeze - bending;
        lane least = arm_plus * low + arm_minus * high, most = arm_plus * high + arm_minus * low;
        mask forward = wanted > (arm_plus + arm_minus) * low;
        lane plus = clip(where(forward, (wanted - arm_minus * low) / arm_plus, low), low, high);
        lane minus = clip(where(forward, low, (wanted - arm_plus * low) / arm_minus), low, high);
        lane out = where((wanted > most) | (wanted < least), one, 0.0);
        gather(sum, job, tick * job->period, angle, ref[0], 0.5 * plus, 0.5 * minus, out);
        if (job->record && first == 0) job->record[tick] = ((double *)&angle)[0];
        for (int i = 0; i < job->substeps; i++) {
            EACH(i) old_theta[i] = theta[i];
            step(&plant, theta, omega, tendons{plus, minus}, job->period / job->substeps);
            EACH(i) sum[ALIVE] = where(size(theta[i]) < 6.283185307179586, sum[ALIVE], 0.0);
            EACH(i) {
                theta[i] = where(sum[ALIVE] > 0.0, theta[i], old_theta[i]);
                omega[i] = where(sum[ALIVE] > 0.0, omega[i], 0.0);
            }
        }
    }
    for (int l = 0; l < LANES && first + l < job->rollouts; l++) {
        for (int i = 0; i < N; i++) {
            job->state[2 * N * (first + l) + i] = ((double *)&theta[i])[l];
            job->state[2 * N * (first + l) + N + i] = ((double *)&omega[i])[l];
        }
        for (int i = 0; i < SUMS; i++) job->sums[SUMS * (first + l) + i] = ((double *)&sum[i])[l];
    }
}

#include "threads.h" /* below what it runs */

/* Closed loops in two planes, LANES rollouts side by side: the sliding mode law once for each plane, four tendons.
 *
 * Same equations, law, allocation and step as wristctl's kernel; running sums of what metrics are made of. */
#include "segment.h"
#include "spatial.h"
#include "rodas3.h"

enum { SQUARED_Y, SQUARED_Z, ABSOLUTE, LATE, LATE_COUNT, EXIT, FARTHEST, PEAK, TENSION, VARIATION, SATURATED, TICKS,
       ALIVE, SUMS };
enum { PARAMETERS = 17, OF_A_TENDON = 3 };

struct work {
    const double *plant, *believed;      /* the wrist of N segments, and of one: parameters, then each tendon's three */
    const double *model_y, *model_z;     /* 12 values each: the law's one segment in each plane */
    const double *reference;             /* [tick][2]: bends */
    const double *gains;                 /* [rollout][3] */
    double *state;                       /* [rollout][2 G]: coordinates and rates at the end */
    double *sums;                        /* [rollout][SUMS] */
    double *record;                      /* [tick][G] coordinates of the first rollout, or NULL */
    double low, high;                    /* pull of a tendon [N] */
    double reach;                        /* bend beyond which a wrist has failed */
    double horizon, period;
    int rollouts, ticks, substeps;
    int next;
};

INLINE wrist wrist_of(const double *v)
{
    wrist s = {v[0], v[1], v[2], v[3], v[4], {v[5], v[6], v[7]}, {v[8], v[9], v[10]},
               {v[11], v[12], v[13]}, {v[14], v[15], v[16]}, {}, {}};
    for (int i = 0; i < TENDONS; i++) {
        s.place_y[i] = v[PARAMETERS + OF_A_TENDON * i];
        s.place_z[i] = v[PARAMETERS + OF_A_TENDON * i + 1];
    }
    return s;
}

/* angle of the point (x, y) from the x axis, y >= 0, as wristctl.lanes.functions.atan2 */
INLINE lane arc(lane y, lane x)
{
    static const double REST[] = {SERIES_ARC};
    lane along = size(x), small = lesser(y, along), large = greater(y, along);
    mask steep = y > along, far = small > 0.41421356237309503 * large; /* tan(pi/8) */
    lane t = where(far, small - large, small) / where(large <= 0.0, 1.0, where(far, small + large, large));
    lane angle = t + t * (t * t * polynomial(REST, t * t)) + where(far, 0.7853981633974483, 0.0);
    angle = where(steep, 1.5707963267948966 - angle, angle);
    return where(x < 0.0, 3.141592653589793 - angle, angle);
}

/* bend of the last tangent from the base, y and z, and its rates */
INLINE void tip_bend(const lane *q, const lane *rate, lane *at, lane *speed)
{
    const lane none = 0.0, one = 1.0;
    space tangent = {one, none, none}, y = {none, one, none}, z = {none, none, one}, spin = {none, none, none};
    EACH(k) {
        const lane *u = q + 2 * k, *v = rate + 2 * k;
        lane c[9];
        stumpff(u[0] * u[0] + u[1] * u[1], c);
        space nu = u[0] * y + u[1] * z, both = c[1] * tangent + c[2] * nu;
        lane along = c[3] * (u[0] * v[0] + u[1] * v[1]);
        spin = spin + (c[2] * (u[0] * v[1] - u[1] * v[0])) * tangent + (c[1] * v[0] + along * u[0]) * z
               - (c[1] * v[1] + along * u[1]) * y;
        tangent = c[0] * tangent + c[1] * nu;
        y = y - u[0] * both;
        z = z - u[1] * both;
    }
    space moving = cross(spin, tangent);
    lane across = tangent.y * tangent.y + tangent.z * tangent.z, sine = root(across);
    mask straight = across < 1e-14;
    lane per_sine = where(straight, one, arc(sine, tangent.x) / where(straight, one, sine));
    lane slope = where(straight, -1.0 / 3.0, (tangent.x * per_sine - 1.0) / where(straight, one, across)) * moving.x;
    at[0] = per_sine * tangent.y;
    at[1] = per_sine * tangent.z;
    speed[0] = per_sine * moving.y + slope * tangent.y;
    speed[1] = per_sine * moving.z + slope * tangent.z;
}

/* moment arms of the tendons on one segment, bent by u */
INLINE void moment_arms(const wrist *s, const lane *u, plane *arms)
{
    lane c[9], per_span = 0.25 / (s->spans * s->spans);
    stumpff(per_span * (u[0] * u[0] + u[1] * u[1]), c);
    lane fall = per_span * (c[2] - c[3]);
    EACH_TENDON(i) {
        lane squeeze = fall * (s->length - s->place_y[i] * u[0] - s->place_z[i] * u[1]);
        arms[i] = planar(s->place_y[i] * c[1] + squeeze * u[0], s->place_z[i] * c[1] + squeeze * u[1]);
    }
}

INLINE void gather(lane *s, const work *job, double time, const lane *at, const double *ref, const lane *pulls,
                   lane *before, lane share)
{
    const lane one = 1.0, off_y = at[0] - ref[0], off_z = at[1] - ref[1];
    const lane squared = off_y * off_y + off_z * off_z, off = root(squared);
    const double late = time >= 0.9 * job->horizon;
    s[SQUARED_Y] += off_y * off_y;
    s[SQUARED_Z] += off_z * off_z;
    s[ABSOLUTE] += off;
    s[LATE] += late * off;
    s[LATE_COUNT] += late;
    s[EXIT] = where(off > 0.02, lane(time), s[EXIT]);
    s[FARTHEST] = greater(s[FARTHEST], off);
    EACH_TENDON(i) {
        s[PEAK] = greater(s[PEAK], pulls[i]);
        s[TENSION] += pulls[i] * pulls[i];
        s[VARIATION] += where(s[TICKS] > 0.0, size(pulls[i] - before[i]), 0.0);
        before[i] = pulls[i];
    }
    s[SATURATED] += where(share < one, one, 0.0);
    s[TICKS] += 1.0;
}

static void block(work *job, int first)
{
    const wrist plant = wrist_of(job->plant), believed = wrist_of(job->believed);
    const segment model_y = segment_of(job->model_y), model_z = segment_of(job->model_z);
    const lane low = job->low, high = job->high;
    lane q[G], rate[G], before[G], last[TENDONS], gain[3], sum[SUMS];
    ALL(i) q[i] = rate[i] = 0.0;
    EACH_TENDON(i) last[i] = 0.0;
    for (int i = 0; i < SUMS; i++) sum[i] = i == ALIVE;
    for (int l = 0; l < LANES; l++)
        for (int i = 0; i < 3; i++) {
            int from = first + l < job->rollouts ? first + l : job->rollouts - 1;
            ((double *)&gain[i])[l] = job->gains[3 * from + i];
        }
    for (int tick = 0; tick < job->ticks; tick++) {
        const double *ref = job->reference + 2 * tick;
        lane at[2], speed[2], T[TENDONS];
        plane arms[TENDONS];
        tip_bend(q, rate, at, speed);
        sum[ALIVE] = where(at[0] * at[0] + at[1] * at[1] < job->reach * job->reach, sum[ALIVE], 0.0);
        moment_arms(&believed, at, arms);
        lane wanted_y = sliding_mode(&model_y, at[0], speed[0], ref[0], gain);
        lane wanted_z = sliding_mode(&model_z, at[1], speed[1], ref[1], gain);
        lane share = allocate(arms, planar(wanted_y, wanted_z), low, high, T);
        gather(sum, job, tick * job->period, at, ref, T, last, share);
        if (job->record && first == 0) ALL(i) job->record[G * tick + i] = ((double *)&q[i])[0];
        tendons pulls = {0.0, 0.0, 0.0};
        EACH_TENDON(i) {
            pulls.sum += T[i];
            pulls.y += T[i] * plant.place_y[i];
            pulls.z += T[i] * plant.place_z[i];
        }
        for (int i = 0; i < job->substeps; i++) {
            ALL(k) before[k] = q[k];
            step(&plant, q, rate, pulls, job->period / job->substeps);
            EACH(k) {
                lane square = q[2 * k] * q[2 * k] + q[2 * k + 1] * q[2 * k + 1];
                sum[ALIVE] = where(square < 3.1 * 3.1, sum[ALIVE], 0.0);
            }
            ALL(k) {
                q[k] = where(sum[ALIVE] > 0.0, q[k], before[k]);
                rate[k] = where(sum[ALIVE] > 0.0, rate[k], 0.0);
            }
        }
    }
    for (int l = 0; l < LANES && first + l < job->rollouts; l++) {
        for (int i = 0; i < G; i++) {
            job->state[2 * G * (first + l) + i] = ((double *)&q[i])[l];
            job->state[2 * G * (first + l) + G + i] = ((double *)&rate[i])[l];
        }
        for (int i = 0; i < SUMS; i++) job->sums[SUMS * (first + l) + i] = ((double *)&sum[i])[l];
    }
}

#include "threads.h" /* below what it runs */

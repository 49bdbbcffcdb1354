/* The planar wrist's equation of motion and its exact Jacobian, formula by formula as in wristctl.wrist. */
#include "segment.h"
#define N SEGMENTS
#define EACH(k) _Pragma("GCC unroll 8") for (int k = 0; k < N; k++)
#define BACK(k) _Pragma("GCC unroll 8") for (int k = N - 1; k >= 0; k--)
#define BELOW(i, j) _Pragma("GCC unroll 8") for (int i = 0; i < j; i++)

enum { COORDINATES = N };
typedef segment wrist;
struct tendons { lane plus, minus; }; /* pulls of both sides [N] */
struct posture { /* a posture: chords with derivatives, last tangent, tendon torque and its slope */
    plane z[N], dz[N], d2z[N], d3z[N], tangent;
    lane pull[N], slope[N];
};

INLINE void bend(const segment *s, const lane *theta, tendons pulls, posture *p)
{
    plane tangent = planar(1.0, 0.0);
    const lane share = 1.0 / s->spans, half = 0.5 * s->length * share;
    const lane bending = s->tendon_offset * (pulls.plus - pulls.minus), squeeze = half * (pulls.plus + pulls.minus);
    EACH(k) {
        lane x = 0.5 * theta[k];
        bessels b = bessel(x);
        plane half_turn = planar(b.e0 - b.s * b.e1, x * b.e0), direction = product(tangent, half_turn);
        lane c = s->length * b.e0, c1 = -0.5 * s->length * x * b.e1;
        lane c2 = 0.25 * s->length * (b.s * b.e2 - b.e1), c3 = 0.125 * s->length * x * (3.0 * b.e2 - b.s * b.e3);
        p->z[k] = mul(c, direction);
        p->dz[k] = product(planar(c1, 0.5 * c), direction);
        p->d2z[k] = product(planar(c2 - 0.25 * c, c1), direction);
        p->d3z[k] = product(planar(c3 - 0.75 * c1, 1.5 * c2 - 0.125 * c), direction);
        tangent = product(direction, half_turn);
        lane y = x * share;
        bessels t = bessel(y);
        p->pull[k] = bending * (t.e0 - t.s * t.e1) + squeeze * y * t.e1;
        p->slope[k] = 0.5 * share * (squeeze * (t.e1 - t.s * t.e2) - bending * y * t.e0);
    }
    p->tangent = tangent;
}

INLINE void mass_matrix(const segment *s, const posture *p, lane mass[N][N])
{
    plane end[N], q[N];
    end[0] = p->z[0];
    _Pragma("GCC unroll 8") for (int k = 1; k < N; k++) end[k] = add(end[k - 1], p->z[k]);
    EACH(k) q[k] = add(end[k], turn(p->dz[k]));
    lane m0 = s->hand_mass;
    plane place = add(end[N - 1], mul(s->hand_offset, p->tangent)), m1 = mul(m0, place);
    lane m2 = m0 * dot(place, place);
    BACK(j) {
        plane middle = add(end[j], mul(-0.5, p->z[j])), own = mul(0.5 * s->mass, p->dz[j]);
        mass[j][j] = m2 - 2.0 * dot(q[j], m1) + m0 * dot(q[j], q[j]) + 0.5 * dot(own, p->dz[j]);
        BELOW(i, j) {
            lane beyond = m2 - dot(add(q[i], q[j]), m1) + m0 * dot(q[i], q[j]);
            mass[i][j] = mass[j][i] = beyond + dot(own, turn(sub(middle, q[i])));
        }
        m0 += s->mass;
        m1 = add(m1, mul(s->mass, middle));
        m2 += s->mass * dot(middle, middle);
    }
}

/* terms of the motion at zero acceleration: M theta'' + bias = 0 */
INLINE void bias(const segment *s, const lane *theta, const lane *omega, const posture *p, lane *r)
{
    plane force[N], a = planar(0.0, 0.0), weight = planar(s->gravity_x, s->gravity_y);
    lane spin = 0.0;
    EACH(k) {
        lane w = omega[k];
        plane bent = mul(w * w, p->d2z[k]);
        if (k > 0) /* the base does not turn */
            bent = sub(add(bent, mul(2.0 * spin * w, turn(p->dz[k]))), mul(spin * spin, p->z[k]));
        force[k] = mul(s->mass, sub(add(a, mul(0.5, bent)), weight));
        a = add(a, bent);
        spin += w;
    }
    plane hand = mul(s->hand_offset, p->tangent);
    plane beyond = mul(s->hand_mass, sub(sub(a, mul(spin * spin, hand)), weight));
    lane torque = dot(turn(hand), beyond);
    beyond = sub(beyond, planar(s->force_x, s->force_y));
    BACK(k) {
        plane on = add(beyond, mul(0.5, force[k]));
        r[k] = torque + dot(p->dz[k], on) + s->stiffness * theta[k] + s->damping * omega[k] - p->pull[k];
        torque += dot(turn(p->z[k]), on);
        beyond = add(beyond, force[k]);
    }
}

INLINE void jacobians(const segment *s, const lane *, const lane *omega, const lane *acceleration, const posture *at,
                      lane by_theta[N][N], lane by_rate[N][N])
{
    const plane *z = at->z, *dz = at->dz, *d2z = at->d2z, *d3z = at->d3z;
    plane pivot[N], middle[N], velocity[N], force[N], field[N], sweep[N], own_field[N], own_sweep[N];
    plane p = planar(0.0, 0.0), v = p, a = p, weight = planar(s->gravity_x, s->gravity_y);
    lane spin = 0.0, spin_rate = 0.0;
    EACH(k) {
        lane w = omega[k];
        plane rate = mul(w, dz[k]), bent = add(mul(acceleration[k], dz[k]), mul(w * w, d2z[k]));
        own_field[k] = add(mul(acceleration[k], d2z[k]), mul(w * w, d3z[k]));
        own_sweep[k] = mul(w, d2z[k]);
        if (k > 0) { /* the base does not turn */
            plane turning = planar(-spin * spin, spin_rate);
            lane across = 2.0 * spin * w;
            rate = add(rate, mul(spin, turn(z[k])));
            bent = add(bent, add(product(turning, z[k]), mul(across, turn(dz[k]))));
            own_field[k] = add(own_field[k], add(product(turning, dz[k]), mul(across, turn(d2z[k]))));
            own_sweep[k] = add(own_sweep[k], mul(spin, turn(dz[k])));
        }
        middle[k] = add(p, mul(0.5, z[k]));
        velocity[k] = add(v, mul(0.5, rate));
        force[k] = mul(s->mass, sub(add(a, mul(0.5, bent)), weight));
        p = add(p, z[k]);
        pivot[k] = add(p, turn(dz[k]));
        field[k] = sub(own_field[k], turn(sub(add(a, bent), weight)));
        sweep[k] = sub(own_sweep[k], turn(add(v, rate)));
        v = add(v, rate);
        a = add(a, bent);
        spin += w;
        spin_rate += acceleration[k];
    }
    plane hand = mul(s->hand_offset, at->tangent), place = add(p, hand);
    lane m0 = s->hand_mass;
    plane m1 = mul(m0, place), momentum = mul(m0, add(v, mul(spin, turn(hand))));
    lane stretch = dot(place, momentum);
    plane load = planar(s->force_x, s->force_y);
    plane beyond = sub(mul(m0, sub(add(a, product(planar(-spin * spin, spin_rate), hand)), weight)), load);
    lane tip[N]; /* the force's part of all of row or column i's entries further out */
    EACH(i) tip[i] = dot(sub(p, pivot[i]), load);
    BACK(j) {
        plane half = mul(0.5, dz[j]), own = mul(s->mass, half);
        plane moment_j = turn(sub(m1, mul(m0, pivot[j]))), whole_j = add(moment_j, own);
        lane turned_j = stretch - dot(pivot[j], momentum), circling = turned_j + dot(own, turn(velocity[j]));
        BELOW(i, j) {
            by_theta[j][i] = dot(whole_j, field[i]) + tip[j];
            by_rate[j][i] = 2.0 * (circling + dot(whole_j, sweep[i]));
            plane moment = turn(sub(m1, mul(m0, pivot[i])));
            plane reach = mul(0.5 * s->mass, turn(sub(middle[j], pivot[i])));
            lane shifted = dot(sub(pivot[j], pivot[i]), beyond) + dot(turn(half), force[j]);
            by_theta[i][j] = shifted + dot(moment, field[j]) + dot(reach, own_field[j]) + tip[i];
            lane turned = stretch - dot(pivot[i], momentum);
            by_rate[i][j] = 2.0 * (turned + dot(moment, sweep[j]) + dot(reach, own_sweep[j]));
        }
        lane curved = dot(d2z[j], add(beyond, mul(0.5, force[j]))) - dot(turn(dz[j]), beyond);
        by_theta[j][j] = curved + dot(moment_j, field[j]) + 0.5 * dot(own, own_field[j]) + tip[j] + s->stiffness - at->slope[j];
        by_rate[j][j] = 2.0 * (turned_j + dot(moment_j, sweep[j]) + 0.5 * dot(own, own_sweep[j])) + s->damping;
        m0 += s->mass;
        m1 = add(m1, mul(s->mass, middle[j]));
        momentum = add(momentum, mul(s->mass, velocity[j]));
        stretch += s->mass * dot(middle[j], velocity[j]);
        beyond = add(beyond, force[j]);
    }
}

/* The wrist of equal segments in one plane, and the sliding mode law on its one-segment model. */
#ifndef SEGMENT_H
#define SEGMENT_H
#include "lanes.h"

struct segment {
    lane length, mass, hand_mass, hand_offset, gravity_x, gravity_y, tendon_offset, spans, stiffness, damping,
        force_x, force_y;
};

INLINE segment segment_of(const double *v)
{
    return segment{v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9], v[10], v[11]};
}

/* inertia and load of the one-segment model, as wristctl.control.model */
INLINE lane sliding_mode(const segment *m, lane theta, lane rate, lane theta_ref, const lane *gain)
{
    lane x = 0.5 * theta;
    bessels b = bessel(x);
    lane c = m->length * b.e0, c1 = -0.5 * m->length * x * b.e1, c2 = 0.25 * m->length * (b.s * b.e2 - b.e1);
    plane half_turn = planar(b.e0 - b.s * b.e1, x * b.e0), hand = mul(m->hand_offset, half_turn);
    plane chord = planar(c1, 0.5 * c), bent = planar(c2 - 0.25 * c, c1);
    plane along = add(chord, turn(hand)), hand_bent = sub(bent, hand), g = planar(m->gravity_x, m->gravity_y);
    lane inertia = 0.25 * m->mass * dot(chord, chord) + m->hand_mass * dot(along, along);
    lane curving = 0.25 * m->mass * dot(chord, bent) + m->hand_mass * dot(along, hand_bent);
    plane weight = planar(dot(g, half_turn), dot(g, turn(half_turn)));
    lane falling = dot(add(mul(0.5 * m->mass, chord), mul(m->hand_mass, along)), weight);
    lane load = curving * rate * rate - falling + m->damping * rate + m->stiffness * theta;
    lane sigma = gain[0] * (theta - theta_ref) + gain[1] * rate;
    return load - inertia / gain[1] * (gain[0] * rate + gain[2] * hyperbolic_tangent(sigma));
}
#endif

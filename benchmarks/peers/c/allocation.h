/* Pulls of four tendons within limits that give a torque in two planes with the least sum, as in wristctl. */
#ifndef ALLOCATION_H
#define ALLOCATION_H
#include "lanes.h"
#define TENDONS 4
#define EACH_TENDON(i) _Pragma("GCC unroll 4") for (int i = 0; i < TENDONS; i++)

INLINE lane not_zero(lane a) { return greater(size(a), 1e-300); }
/* a distance that is not 0 but for rounding */
INLINE lane distance(lane to_edge, lane blur) { return where(size(to_edge) < blur, blur, to_edge); }

/* what of a torque is reached, less that of the least pulls; its share of the wanted one */
INLINE plane reachable(const plane *arms, plane torque, plane resting, lane room, const lane cross[TENDONS][TENDONS],
                       lane square, lane *share)
{
    const lane one = 1.0;
    const plane increment = sub(torque, resting);
    lane low = 0.0, high = one, way = one;
    EACH_TENDON(i) {
        lane above = 0.0, below = 0.0;
        EACH_TENDON(k) {
            lane moment = room * cross[i][k];
            above += greater(moment, 0.0);
            below += greater(-moment, 0.0);
        }
        plane across = turn(arms[i]);
        lane base = dot(across, resting), along = dot(across, torque), further = dot(across, increment);
        lane blur = 1e-13 * (above + below + size(base));
        lane plus = distance(base + above, blur), minus = distance(below - base, blur);
        mask is_arm = dot(across, across) > 1e-20 * square;
        lane inverse = 1.0 / not_zero(along);
        high = where(is_arm, lesser(high, where(along > 0.0, plus, minus) * inverse), high);
        low = where(is_arm, greater(low, where(along > 0.0, -minus, -plus) * inverse), low);
        lane ahead = distance(where(further > 0.0, above, below), blur);
        way = where(is_arm, lesser(way, ahead / not_zero(further)), way);
    }
    mask on_ray = low <= high;
    *share = where(on_ray, high, way);
    lane straight = where(on_ray, one, 0.0);
    plane toward = add(mul(straight, torque), mul(one - straight, increment));
    return sub(mul(*share, toward), mul(straight, resting));
}

/* pulls from 0 to `room` with the least sum: of all pairs as a basis the one that exceeds its limits least */
INLINE void cheapest(const plane *arms, plane torque, lane room, const lane cross[TENDONS][TENDONS], lane square,
                     lane *pulls)
{
    lane least = 1e300;
    EACH_TENDON(k) pulls[k] = 0.0;
    EACH_TENDON(j) EACH_TENDON(i) {
        if (i >= j) continue;
        lane carried[TENDONS], area = cross[i][j];
        plane rest = torque;
        EACH_TENDON(k) {
            if (k == i || k == j) continue;
            lane price = (1.0 + 1e-12 * i * i) * cross[j][k] + (1.0 + 1e-12 * j * j) * cross[k][i];
            carried[k] = where((price + (1.0 + 1e-12 * k * k) * area) * area < 0.0, room, 0.0);
            rest = sub(rest, mul(carried[k], arms[k]));
        }
        mask is_basis = size(area) > 1e-10 * square;
        lane inverse = 1.0 / where(is_basis, area, 1.0);
        lane one = dot(turn(rest), arms[j]) * inverse, other = dot(turn(arms[i]), rest) * inverse;
        lane excess = greater(greater(greater(-one, one - room), greater(-other, other - room)), 0.0);
        carried[i] = clip(one, 0.0, room);
        carried[j] = clip(other, 0.0, room);
        mask is_better = is_basis & (excess < least);
        least = where(is_better, excess, least);
        EACH_TENDON(k) pulls[k] = where(is_better, carried[k], pulls[k]);
    }
}

/* writes the pulls; the share of the torque that is reached */
INLINE lane allocate(const plane *arms, plane torque, lane low, lane high, lane *pulls)
{
    lane cross[TENDONS][TENDONS], square = 0.0, share;
    plane resting = planar(0.0, 0.0);
    EACH_TENDON(k) {
        square = greater(square, dot(arms[k], arms[k]));
        resting = add(resting, mul(low, arms[k]));
        EACH_TENDON(i) cross[i][k] = dot(turn(arms[i]), arms[k]);
    }
    plane more = reachable(arms, torque, resting, high - low, cross, square, &share);
    cheapest(arms, more, high - low, cross, square, pulls);
    EACH_TENDON(k) pulls[k] = lesser(low + pulls[k], high);
    return share;
}
#endif

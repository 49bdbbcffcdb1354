/* A lane: one number of LANES rollouts side by side, in PARTS vectors of WIDTH. C but for the operators. */
#ifndef LANES_H
#define LANES_H
#include <stdint.h>
#define INLINE static inline __attribute__((always_inline))
#define PARTS ((LANES + 7) / 8)
#define WIDTH (LANES / PARTS)
#define EACH_PART(p) _Pragma("GCC unroll 8") for (int p = 0; p < PARTS; p++)

typedef double reals __attribute__((vector_size(8 * WIDTH)));
typedef int64_t wholes __attribute__((vector_size(8 * WIDTH)));
struct mask { wholes part[PARTS]; };
struct lane {
    reals part[PARTS];
    lane() = default;
    inline __attribute__((always_inline)) lane(double x) { EACH_PART(p) part[p] = reals{} + x; }
};
struct plane { lane x, y; }; /* x + i y */

#define OPERATOR(kind, type, o) \
    INLINE kind operator o(type a, type b) { kind c; EACH_PART(p) c.part[p] = a.part[p] o b.part[p]; return c; }
OPERATOR(lane, lane, +) OPERATOR(lane, lane, -) OPERATOR(lane, lane, *) OPERATOR(lane, lane, /)
OPERATOR(mask, lane, <) OPERATOR(mask, lane, >) OPERATOR(mask, lane, <=) OPERATOR(mask, mask, |)
INLINE lane operator-(lane a) { EACH_PART(p) a.part[p] = -a.part[p]; return a; }
INLINE lane &operator+=(lane &a, lane b) { return a = a + b; }
INLINE lane &operator-=(lane &a, lane b) { return a = a - b; }
INLINE lane &operator*=(lane &a, lane b) { return a = a * b; }
INLINE lane where(mask c, lane yes, lane no) { EACH_PART(p) yes.part[p] = c.part[p] ? yes.part[p] : no.part[p]; return yes; }
INLINE lane size(lane a) { EACH_PART(p) a.part[p] = (reals)((wholes)a.part[p] & 0x7fffffffffffffff); return a; }
INLINE lane exp2i(lane shifted) /* 2^k from 1.5 2^52 + k, whose last bits are k */
{
    EACH_PART(p) shifted.part[p] = (reals)(((wholes)shifted.part[p] + 1023) << 52);
    return shifted;
}
INLINE lane lesser(lane a, lane b) { return where(a < b, a, b); }
INLINE lane greater(lane a, lane b) { return where(a > b, a, b); }
INLINE lane clip(lane a, lane low, lane high) { return lesser(greater(a, low), high); }

INLINE plane planar(lane x, lane y) { return plane{x, y}; }
INLINE plane turn(plane v) { return plane{-v.y, v.x}; }
INLINE lane dot(plane u, plane v) { return u.x * v.x + u.y * v.y; }
INLINE plane add(plane u, plane v) { return plane{u.x + v.x, u.y + v.y}; }
INLINE plane sub(plane u, plane v) { return plane{u.x - v.x, u.y - v.y}; }
INLINE plane mul(lane s, plane v) { return plane{s * v.x, s * v.y}; }
INLINE plane product(plane u, plane v) { return plane{u.x * v.x - u.y * v.y, u.x * v.y + u.y * v.x}; }

/* E_n(x) = j_n(x)/x^n, n = 0..3, |x| <= pi: Taylor for E2 and E3, the recurrence down to E0 */
struct bessels { lane e0, e1, e2, e3, s; };
INLINE bessels bessel(lane x)
{
    static const double E2[] = {SERIES2}, E3[] = {SERIES3};
    bessels b;
    b.s = x * x;
    b.e2 = E2[0];
    b.e3 = E3[0];
#pragma GCC unroll 16
    for (int k = 1; k < (int)(sizeof E2 / sizeof *E2); k++) {
        b.e2 = b.e2 * b.s + E2[k];
        b.e3 = b.e3 * b.s + E3[k];
    }
    b.e1 = 5.0 * b.e2 - b.s * b.e3;
    b.e0 = 3.0 * b.e1 - b.s * b.e2;
    return b;
}

/* tanh by expm1(-2|x|): reduction to |r| <= ln(2)/2, Taylor of degree 13 */
INLINE lane hyperbolic_tangent(lane x)
{
    static const double C[] = {1 / 479001600.0, 1 / 39916800.0, 1 / 3628800.0, 1 / 362880.0, 1 / 40320.0,
                               1 / 5040.0, 1 / 720.0, 1 / 120.0, 1 / 24.0, 1 / 6.0, 0.5};
    const double round = 6755399441055744.0; /* 1.5 2^52 */
    lane y = -2.0 * lesser(size(x), 22.0);
    lane shifted = y * 1.4426950408889634 + round, k = shifted - round;
    lane r = (y - k * 6.93147180369123816490e-01) - k * 1.90821492927058770002e-10;
    lane p = 1 / 6227020800.0;
#pragma GCC unroll 16
    for (int i = 0; i < 11; i++)
        p = p * r + C[i];
    lane scale = exp2i(shifted);
    lane t = scale * (r + r * r * p) + (scale - 1.0), h = -t / (t + 2.0);
    return where(x < 0.0, -h, h);
}
#endif

/* The wrist in two planes: its equation of motion and its exact Jacobian, as in wristctl.wrist.spatial.
 *
 * A coordinate of segment j moves all beyond the segment by one screw: a point x by move + spin x x. Sums over the
 * masses beyond give M and both Jacobians as products of screws and momenta. Tendons run along the whole wrist. */
#include "allocation.h"
#define N SEGMENTS
#define EACH(k) _Pragma("GCC unroll 8") for (int k = 0; k < N; k++)
#define BACK(k) _Pragma("GCC unroll 8") for (int k = N - 1; k >= 0; k--)
#define TWO(a) _Pragma("GCC unroll 2") for (int a = 0; a < 2; a++)
#define BELOW(i, j) _Pragma("GCC unroll 16") for (int i = 0; i < j; i++)

enum { COORDINATES = 2 * N };

struct space { lane x, y, z; };
INLINE space operator+(space a, space b) { return space{a.x + b.x, a.y + b.y, a.z + b.z}; }
INLINE space operator-(space a, space b) { return space{a.x - b.x, a.y - b.y, a.z - b.z}; }
INLINE space operator*(lane s, space a) { return space{s * a.x, s * a.y, s * a.z}; }
INLINE lane dot(space a, space b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
INLINE space cross(space a, space b)
{
    return space{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
struct screw { space spin, move; };     /* motion: angular, and of the origin */
struct momenta { space angular, linear; }; /* or moment and force; about the origin */
INLINE lane dot(screw s, momenta p) { return dot(s.spin, p.angular) + dot(s.move, p.linear); }

struct symmetric { lane of[3]; }; /* yy, yz, zz */
struct wrist {
    lane length, mass, hand_mass, hand_offset, spans;
    symmetric stiffness, damping; /* of a segment */
    space gravity, force;
    lane place_y[TENDONS], place_z[TENDONS];
};
/* sums over the tendons, which are all that straight spans ask of their pulls T: T, T c_y, T c_z */
struct tendons { lane sum, y, z; };

/* Stumpff's c_k(s) = sum (-s)^j/(2j + k)!: c1 = sin x/x, c2 = (1 - cos x)/x^2. Its derivative by u_a, of s = |u|^2, is
 * u_a (k c_{k+2} - c_{k+1}). */
INLINE void stumpff(lane s, lane c[9])
{
    static const double C7[] = {SERIES7}, C8[] = {SERIES8};
    c[7] = polynomial(C7, s);
    c[8] = polynomial(C8, s);
    c[6] = 1.0 / 720.0 - s * c[8];
    c[5] = 1.0 / 120.0 - s * c[7];
    c[4] = 1.0 / 24.0 - s * c[6];
    c[3] = 1.0 / 6.0 - s * c[5];
    c[2] = 0.5 - s * c[4];
    c[1] = 1.0 - s * c[3];
    c[0] = 1.0 - s * c[2];
}

struct posture { /* in the ground's axes; frame before a segment: tangent, normal[0], normal[1] */
    space tangent[N + 1], normal[N + 1][2], bend[N], chord[N], end[N], chord_by[N][2];
    screw by[N][2];
    momenta moved[N][2]; /* of all that a coordinate moves, its half chord's included */
    lane c[N][9], d[N][7], torque[N][2];
    symmetric slope[N]; /* of the tendons' torque */
};

INLINE void bend(const wrist *s, const lane *q, tendons pulls, posture *p)
{
    const lane length = s->length, per_span = 0.25 / (s->spans * s->spans), none = 0.0;
    p->tangent[0] = space{1.0, 0.0, 0.0};
    p->normal[0][0] = space{0.0, 1.0, 0.0};
    p->normal[0][1] = space{0.0, 0.0, 1.0};
    space end = {none, none, none};
    EACH(k) {
        const lane *u = q + 2 * k, square = u[0] * u[0] + u[1] * u[1];
        lane *c = p->c[k], *d = p->d[k], turned[2] = {-u[1], u[0]}, span[9];
        stumpff(square, c);
        _Pragma("GCC unroll 6") for (int i = 1; i < 7; i++) d[i] = (double)i * c[i + 2] - c[i + 1];
        space t = p->tangent[k], *n = p->normal[k], nu = p->bend[k] = u[0] * n[0] + u[1] * n[1];
        p->chord[k] = (length * c[1]) * t + (length * c[2]) * nu;
        p->end[k] = end = end + p->chord[k];
        space along = (length * d[1]) * t + (length * d[2]) * nu;
        space rotation = u[0] * n[1] - u[1] * n[0], axis[2] = {n[1], -1.0 * n[0]};
        TWO(a) {
            p->chord_by[k][a] = u[a] * along + (length * c[2]) * n[a];
            space spin = (c[2] * turned[a]) * t + c[1] * axis[a] + (c[3] * u[a]) * rotation;
            p->by[k][a] = screw{spin, p->chord_by[k][a] - cross(spin, end)};
        }
        space both = c[1] * t + c[2] * nu;
        p->tangent[k + 1] = c[0] * t + c[1] * nu;
        TWO(a) p->normal[k + 1][a] = n[a] - u[a] * both;

        stumpff(per_span * square, span); /* a tendon is (l - c.u) c1 long, by u_a: -c_a c1 - u_a fall (l - c.u) */
        lane fall = per_span * (span[2] - span[3]), rest = length * pulls.sum - pulls.y * u[0] - pulls.z * u[1];
        lane squeeze = fall * rest, bent = per_span * per_span * (span[3] - 3.0 * span[4] + 3.0 * span[5]) * rest;
        p->torque[k][0] = span[1] * pulls.y + squeeze * u[0];
        p->torque[k][1] = span[1] * pulls.z + squeeze * u[1];
        p->slope[k].of[0] = squeeze - 2.0 * fall * pulls.y * u[0] - bent * u[0] * u[0];
        p->slope[k].of[1] = -fall * (pulls.y * u[1] + pulls.z * u[0]) - bent * u[0] * u[1];
        p->slope[k].of[2] = squeeze - 2.0 * fall * pulls.z * u[1] - bent * u[1] * u[1];
    }
}

struct bulk { /* point masses as one: mass, first moment, inertia about the origin */
    lane mass;
    space moment;
    lane xx, xy, xz, yy, yz, zz;
};
INLINE void gather(bulk *b, lane mass, space at)
{
    space moment = mass * at;
    lane x = moment.x * at.x, y = moment.y * at.y, z = moment.z * at.z;
    b->mass += mass;
    b->moment = b->moment + moment;
    b->xx += y + z;
    b->yy += x + z;
    b->zz += x + y;
    b->xy -= moment.x * at.y;
    b->xz -= moment.x * at.z;
    b->yz -= moment.y * at.z;
}
INLINE momenta momentum(const bulk *b, screw s)
{
    space w = s.spin, of_inertia = {b->xx * w.x + b->xy * w.y + b->xz * w.z, b->xy * w.x + b->yy * w.y + b->yz * w.z,
                                    b->xz * w.x + b->yz * w.y + b->zz * w.z};
    return momenta{of_inertia + cross(b->moment, s.move), b->mass * s.move - cross(b->moment, w)};
}
INLINE bulk hand_of(const wrist *s, const posture *p)
{
    bulk b = {0.0, {0.0, 0.0, 0.0}, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    gather(&b, s->hand_mass, p->end[N - 1] + s->hand_offset * p->tangent[N]);
    return b;
}

INLINE void mass_matrix(const wrist *s, posture *p, lane mass[COORDINATES][COORDINATES])
{
    const screw *by = p->by[0];
    bulk beyond = hand_of(s, p);
    BACK(j) {
        space middle = p->end[j] - 0.5 * p->chord[j];
        TWO(a) {
            momenta moved = momentum(&beyond, p->by[j][a]);
            space half_chord = (0.5 * s->mass) * p->chord_by[j][a];
            BELOW(b, a + 1)
                mass[2 * j + a][2 * j + b] = mass[2 * j + b][2 * j + a] =
                    dot(p->by[j][b], moved) + 0.5 * dot(half_chord, p->chord_by[j][b]);
            moved = momenta{moved.angular + cross(middle, half_chord), moved.linear + half_chord};
            BELOW(i, 2 * j) mass[2 * j + a][i] = mass[i][2 * j + a] = dot(by[i], moved);
            p->moved[j][a] = moved;
        }
        gather(&beyond, s->mass, middle);
    }
}

INLINE lane passive(symmetric m, const lane *pair, int a) { return m.of[a] * pair[0] + m.of[a + 1] * pair[1]; }

/* terms of the motion at zero acceleration: M q'' + bias = 0. Accelerations outward to the tip, forces back */
INLINE void bias(const wrist *s, const lane *q, const lane *rate, const posture *p, lane *r)
{
    const lane length = s->length, none = 0.0;
    space force[N], a = {none, none, none}, spin = a, spin_rate = a;
    EACH(k) {
        const lane *u = q + 2 * k, *v = rate + 2 * k, *c = p->c[k], *d = p->d[k];
        const lane curved_1 = d[3] - d[2], curved_2 = 2.0 * d[4] - d[3];
        lane along = u[0] * v[0] + u[1] * v[1], speed = v[0] * v[0] + v[1] * v[1], twice = along * along;
        const space *n = p->normal[k];
        space turning = v[0] * n[0] + v[1] * n[1];
        space bent = (length * (curved_1 * twice + d[1] * speed)) * p->tangent[k]
                     + (length * (d[2] * speed + curved_2 * twice)) * p->bend[k]
                     + (2.0 * length * d[2] * along) * turning;
        lane by_rate = (d[1] + c[3]) * along, by_bend = d[3] * twice + c[3] * speed;
        space turned = (d[2] * along * (u[0] * v[1] - u[1] * v[0])) * p->tangent[k]
                       + (by_rate * v[0] + by_bend * u[0]) * n[1] - (by_rate * v[1] + by_bend * u[1]) * n[0];
        space spun = v[0] * p->by[k][0].spin + v[1] * p->by[k][1].spin;
        if (k > 0) { /* the base does not turn */
            space swept = v[0] * p->chord_by[k][0] + v[1] * p->chord_by[k][1];
            bent = bent + cross(spin_rate, p->chord[k]) + cross(spin, cross(spin, p->chord[k]) + 2.0 * swept);
            turned = turned + cross(spin, spun);
        }
        force[k] = s->mass * (a + 0.5 * bent - s->gravity);
        a = a + bent;
        spin_rate = spin_rate + turned;
        spin = spin + spun;
    }
    space hand = s->hand_offset * p->tangent[N];
    space beyond = s->hand_mass * (a + cross(spin_rate, hand) + cross(spin, cross(spin, hand)) - s->gravity);
    space moment = cross(hand, beyond);
    beyond = beyond - s->force;
    BACK(k) {
        space on_chord = beyond + 0.5 * force[k];
        TWO(i)
            r[2 * k + i] = dot(p->by[k][i].spin, moment) + dot(p->chord_by[k][i], on_chord) - p->torque[k][i]
                           + passive(s->stiffness, q + 2 * k, i) + passive(s->damping, rate + 2 * k, i);
        moment = moment + cross(p->chord[k], on_chord);
        beyond = beyond + force[k];
    }
}

/* derivatives of one segment's chord and spins, in axes that stay: by its bends, and along the motion */
struct derivatives {
    space chord_by[3], spin_by[2][2];                       /* second: yy, yz, zz; of spin a by bend b */
    space chord_1[2], chord_2[2], spin_1[2], spin_2[2];     /* of chord_by and spin: once and twice along the motion */
};
INLINE derivatives along_motion(const wrist *s, const lane *u, const lane *x, const lane *y, const posture *p, int k)
{
    derivatives m;
    const lane length = s->length, *c = p->c[k], *d = p->d[k];
    const lane e1 = d[3] - d[2], e2 = 2.0 * d[4] - d[3], e3 = 3.0 * d[5] - d[4], e4 = 4.0 * d[6] - d[5];
    const lane f1 = e3 - e2, f2 = 2.0 * e4 - e3, lean = length * d[2];
    const lane turned_u[2] = {-u[1], u[0]}, turned_x[2] = {-x[1], x[0]}, turned_y[2] = {-y[1], y[0]};
    const space t = p->tangent[k], *n = p->normal[k], nu = p->bend[k], axis[2] = {n[1], -1.0 * n[0]};
    lane ux = u[0] * x[0] + u[1] * x[1], twice = ux * ux;
    lane bowed = u[0] * y[0] + u[1] * y[1] + x[0] * x[0] + x[1] * x[1];
    space nx = x[0] * n[0] + x[1] * n[1], ny = y[0] * n[0] + y[1] * n[1];
    space about_u = u[0] * axis[0] + u[1] * axis[1], about_x = x[0] * axis[0] + x[1] * axis[1];
    space about_y = y[0] * axis[0] + y[1] * axis[1];

    space stretched = (length * d[1]) * t + lean * nu, curved = (length * e1) * t + (length * e2) * nu;
    m.chord_by[0] = (u[0] * u[0]) * curved + (2.0 * lean * u[0]) * n[0] + stretched;
    m.chord_by[1] = (u[0] * u[1]) * curved + (lean * u[1]) * n[0] + (lean * u[0]) * n[1];
    m.chord_by[2] = (u[1] * u[1]) * curved + (2.0 * lean * u[1]) * n[1] + stretched;
    TWO(a) TWO(b) {
        space by = (d[2] * u[b] * turned_u[a]) * t + (d[1] * u[b]) * axis[a] + (d[3] * u[a] * u[b]) * about_u
                   + (c[3] * u[a]) * axis[b];
        m.spin_by[a][b] = a == b ? by + c[3] * about_u : a > b ? by + c[2] * t : by - c[2] * t;
    }
    /* along the motion: by x twice and by y once, over u_a, x_a, y_a and along n_a */
    lane d1_twice = d[1] * bowed + e1 * twice, d2_twice = d[2] * bowed + e2 * twice;
    lane d3_twice = d[3] * bowed + e3 * twice;
    space by_u = (length * (e1 * bowed + f1 * twice)) * t + (length * (e2 * bowed + f2 * twice)) * nu
                 + (2.0 * length * e2 * ux) * nx + lean * ny;
    space by_x = (2.0 * length * e1 * ux) * t + (2.0 * length * e2 * ux) * nu + (2.0 * lean) * nx;
    space spun_u = d3_twice * about_u + (2.0 * d[3] * ux) * about_x + c[3] * about_y;
    space spun_x = (2.0 * d[3] * ux) * about_u + (2.0 * c[3]) * about_x, spun_y = c[3] * about_u;
    TWO(a) {
        m.chord_1[a] = x[0] * m.chord_by[a] + x[1] * m.chord_by[a + 1];
        m.spin_1[a] = x[0] * m.spin_by[a][0] + x[1] * m.spin_by[a][1];
        m.chord_2[a] = u[a] * by_u + x[a] * by_x + y[a] * stretched + (length * d2_twice) * n[a];
        lane twisted = d2_twice * turned_u[a] + 2.0 * d[2] * ux * turned_x[a] + c[2] * turned_y[a];
        m.spin_2[a] = twisted * t + d1_twice * axis[a] + u[a] * spun_u + x[a] * spun_x + y[a] * spun_y;
    }
    return m;
}

struct tensor { space x, y, z; }; /* by rows */
INLINE tensor circling(space at, space p) /* (at.p) 1 - at p^T */
{
    lane x = at.x * p.x, y = at.y * p.y, z = at.z * p.z;
    return tensor{{y + z, -(at.x * p.y), -(at.x * p.z)}, {-(at.y * p.x), x + z, -(at.y * p.z)},
                  {-(at.z * p.x), -(at.z * p.y), x + y}};
}
INLINE tensor operator+(tensor a, tensor b) { return tensor{a.x + b.x, a.y + b.y, a.z + b.z}; }
INLINE space operator*(const tensor &a, space v) { return space{dot(a.x, v), dot(a.y, v), dot(a.z, v)}; }
INLINE space operator*(space v, const tensor &a) { return v.x * a.x + v.y * a.y + v.z * a.z; }

/* dr/dq and dr/d(rate) at these accelerations */
INLINE void jacobians(const wrist *s, const lane *q, const lane *rate, const lane *acceleration, const posture *p,
                      lane by_q[COORDINATES][COORDINATES], lane by_rate[COORDINATES][COORDINATES])
{
    const lane none = 0.0;
    const space tip = p->end[N - 1], load = s->force;
    derivatives m[N];
    space middle[N], velocity[N], force[N];
    screw first[N][2], second[N][2]; /* derivatives of the screws along the motion; gravity is in the second */
    space place = {none, none, none}, v = place, a = place, spin = place, spin_rate = place;
    EACH(k) {
        const lane *x = rate + 2 * k, *y = acceleration + 2 * k;
        m[k] = along_motion(s, q + 2 * k, x, y, p, k);
        const space chord = p->chord[k], *by = p->chord_by[k];
        space swept = x[0] * by[0] + x[1] * by[1], spun = x[0] * p->by[k][0].spin + x[1] * p->by[k][1].spin;
        space bent = x[0] * m[k].chord_1[0] + x[1] * m[k].chord_1[1] + y[0] * by[0] + y[1] * by[1];
        space turned = x[0] * m[k].spin_1[0] + x[1] * m[k].spin_1[1];
        turned = turned + y[0] * p->by[k][0].spin + y[1] * p->by[k][1].spin;
        space chord_rate = swept;
        if (k > 0) { /* the base does not turn */
            space carried = cross(spin, chord);
            bent = bent + cross(spin_rate, chord) + cross(spin, carried + 2.0 * swept);
            turned = turned + cross(spin, spun);
            chord_rate = swept + carried;
        }
        middle[k] = place + 0.5 * chord;
        velocity[k] = v + 0.5 * chord_rate;
        force[k] = s->mass * (a + 0.5 * bent - s->gravity);
        place = p->end[k];
        v = v + chord_rate;
        a = a + bent;
        TWO(i) {
            space w = p->by[k][i].spin, w_1 = m[k].spin_1[i], w_2 = m[k].spin_2[i];
            if (k > 0) {
                space c = by[i], c_1 = m[k].chord_1[i], w_turned = cross(spin, w), c_turned = cross(spin, c);
                w_2 = w_2 + cross(spin_rate, w) + cross(spin, w_turned + 2.0 * w_1);
                m[k].chord_2[i] = m[k].chord_2[i] + cross(spin_rate, c) + cross(spin, c_turned + 2.0 * c_1);
                m[k].chord_1[i] = c_1 + c_turned;
                w_1 = w_1 + w_turned;
            }
            first[k][i] = screw{w_1, m[k].chord_1[i] - cross(w_1, place) - cross(w, v)};
            space move_2 = m[k].chord_2[i] - cross(w_2, place) - 2.0 * cross(w_1, v) - cross(w, a - s->gravity);
            second[k][i] = screw{w_2, move_2};
        }
        spin_rate = spin_rate + turned;
        spin = spin + spun;
    }
    /* of all beyond: masses, momentum, place with momentum, force and moment about the origin */
    const space hand = s->hand_offset * p->tangent[N], moment_of_load = cross(tip, load);
    bulk beyond = hand_of(s, p);
    space linear = s->hand_mass * (v + cross(spin, hand));
    tensor circle = circling(tip + hand, linear);
    space push = s->hand_mass * (a + cross(spin_rate, hand) + cross(spin, cross(spin, hand)) - s->gravity);
    space moment = cross(tip + hand, push);
    const lane half_mass = 0.5 * s->mass;
    BACK(j) {
        momenta on_q[2], on_rate[2];
        space total = push - load, on_chord = total + 0.5 * force[j], load_turned[2], stretched[2];
        space about_end = moment - moment_of_load - cross(p->end[j], total);
        TWO(i) {
            screw by = p->by[j][i];
            space w_1 = first[j][i].spin;
            momenta twice = momentum(&beyond, second[j][i]), once = momentum(&beyond, first[j][i]);
            load_turned[i] = cross(by.move + cross(by.spin, tip), load);
            on_q[i].angular = twice.angular + 2.0 * (w_1 * circle) + cross(by.spin, moment) + cross(by.move, push);
            on_q[i].angular = on_q[i].angular - load_turned[i];
            on_q[i].linear = twice.linear + 2.0 * cross(w_1, linear) + cross(by.spin, push);
            on_rate[i].angular = 2.0 * (once.angular + by.spin * circle);
            on_rate[i].linear = 2.0 * (once.linear + cross(by.spin, linear));
            space own = cross(velocity[j], half_mass * p->chord_by[j][i]);
            stretched[i] = 2.0 * (cross(linear, by.move) + circle * by.spin + own);
        }
        TWO(i) TWO(b) { /* the segment's own block */
            space chord_by = p->chord_by[j][i];
            by_q[2 * j + i][2 * j + b] = dot(p->by[j][i], on_q[b]) + 0.5 * half_mass * dot(chord_by, m[j].chord_2[b])
                                         - dot(cross(p->by[j][i].spin, p->chord_by[j][b]), total)
                                         + dot(m[j].spin_by[i][b], about_end) + dot(m[j].chord_by[i + b], on_chord)
                                         + s->stiffness.of[i + b] - p->slope[j].of[i + b];
            by_rate[2 * j + i][2 * j + b] =
                dot(p->by[j][i], on_rate[b]) + half_mass * dot(chord_by, m[j].chord_1[b]) + s->damping.of[i + b];
        }
        TWO(i) {
            const int row = 2 * j + i;
            space half_2 = half_mass * m[j].chord_2[i], half_1 = s->mass * m[j].chord_1[i];
            on_q[i].angular = on_q[i].angular + cross(middle[j], half_2) + 0.5 * cross(p->chord_by[j][i], force[j]);
            on_q[i].linear = on_q[i].linear + half_2;
            on_rate[i].angular = on_rate[i].angular + cross(middle[j], half_1);
            on_rate[i].linear = on_rate[i].linear + half_1;
            BELOW(b, 2 * j) { /* coordinates nearer to the base */
                screw by = p->by[b / 2][b % 2], by_1 = first[b / 2][b % 2], by_2 = second[b / 2][b % 2];
                by_q[b][row] = dot(by, on_q[i]);
                by_rate[b][row] = dot(by, on_rate[i]);
                by_q[row][b] = dot(by_2, p->moved[j][i]) + dot(stretched[i], by_1.spin) - dot(by.spin, load_turned[i]);
                by_rate[row][b] = 2.0 * dot(by_1, p->moved[j][i]) + dot(stretched[i], by.spin);
            }
        }
        gather(&beyond, s->mass, middle[j]);
        linear = linear + s->mass * velocity[j];
        circle = circle + circling(middle[j], s->mass * velocity[j]);
        push = push + force[j];
        moment = moment + cross(middle[j], force[j]);
    }
}

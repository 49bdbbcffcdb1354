/* One step of RODAS3 (Sandu et al. 1997) on M q'' + r = 0, stages reduced to as many equations as coordinates.
 *
 * The header before it has the model: wrist, tendons, posture, bend, mass_matrix, bias and jacobians. */
#define G COORDINATES
#define ALL(i) _Pragma("GCC unroll 16") for (int i = 0; i < G; i++)
#define LAST_FIRST(i) _Pragma("GCC unroll 16") for (int i = G - 1; i >= 0; i--)
#define BEFORE(i, j) _Pragma("GCC unroll 16") for (int i = 0; i < j; i++)
#define AFTER(i, k) _Pragma("GCC unroll 16") for (int i = k + 1; i < G; i++)

INLINE void factorise(lane a[G][G])
{
    ALL(k) {
        a[k][k] = 1.0 / a[k][k];
        AFTER(i, k) {
            a[i][k] *= a[k][k];
            AFTER(j, k) a[i][j] -= a[i][k] * a[k][j];
        }
    }
}

INLINE void solve(lane lu[G][G], lane *b)
{
    ALL(i) BEFORE(k, i) b[i] -= lu[i][k] * b[k];
    LAST_FIRST(i) {
        AFTER(k, i) b[i] -= lu[i][k] * b[k];
        b[i] *= lu[i][i];
    }
}

INLINE void accelerate(const wrist *s, const lane *q, const lane *rate, tendons pulls, lane *a)
{
    posture p;
    lane mass[G][G];
    bend(s, q, pulls, &p);
    mass_matrix(s, &p, mass);
    bias(s, q, rate, &p, a);
    factorise(mass);
    solve(mass, a);
    ALL(i) a[i] = -a[i];
}

INLINE void stage(lane mass[G][G], lane by_q[G][G], lane lu[G][G], lane hg, const lane *u, const lane *w,
                  lane *k, lane *l)
{
    ALL(i) {
        lane total = 0.0;
        ALL(j) total += mass[i][j] * w[j] - by_q[i][j] * u[j];
        l[i] = total;
    }
    solve(lu, l);
    ALL(i) k[i] = hg * (u[i] + l[i]);
}

static __attribute__((noinline)) void step(const wrist *s, lane *q, lane *rate, tendons pulls, double h)
{
    posture p;
    lane mass[G][G], other[G][G], lu[G][G], by_q[G][G], a0[G], a[G], u[G], w[G], at[G], speed[G];
    lane k1[G], l1[G], k2[G], l2[G], k3[G], l3[G], k4[G], l4[G];
    const lane hg = 0.5 * h;
    const double back = 1.0 / h;
    bend(s, q, pulls, &p);
    mass_matrix(s, &p, mass);
    bias(s, q, rate, &p, a0);
    ALL(i) {
        a0[i] = -a0[i];
        ALL(j) other[i][j] = mass[i][j];
    }
    factorise(other);
    solve(other, a0);
    jacobians(s, q, rate, a0, &p, by_q, lu);
    ALL(i) ALL(j) {
        by_q[i][j] *= hg;
        lu[i][j] += 2.0 * back * mass[i][j] + by_q[i][j];
    }
    factorise(lu);
    stage(mass, by_q, lu, hg, rate, a0, k1, l1);
    ALL(i) {
        u[i] = rate[i] + 4.0 * back * k1[i];
        w[i] = a0[i] + 4.0 * back * l1[i];
    }
    stage(mass, by_q, lu, hg, u, w, k2, l2);
    ALL(i) {
        at[i] = q[i] + 2.0 * k1[i];
        speed[i] = rate[i] + 2.0 * l1[i];
    }
    accelerate(s, at, speed, pulls, a);
    ALL(i) {
        u[i] = speed[i] + (k1[i] - k2[i]) * back;
        w[i] = a[i] + (l1[i] - l2[i]) * back;
    }
    stage(mass, by_q, lu, hg, u, w, k3, l3);
    ALL(i) {
        at[i] += k3[i];
        speed[i] += l3[i];
    }
    accelerate(s, at, speed, pulls, a);
    ALL(i) {
        u[i] = speed[i] + (k1[i] - k2[i] - 8.0 / 3.0 * k3[i]) * back;
        w[i] = a[i] + (l1[i] - l2[i] - 8.0 / 3.0 * l3[i]) * back;
    }
    stage(mass, by_q, lu, hg, u, w, k4, l4);
    ALL(i) {
        q[i] = at[i] + k4[i];
        rate[i] = speed[i] + l4[i];
    }
}

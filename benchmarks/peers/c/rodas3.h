/* One step of RODAS3 (Sandu et al. 1997) on the second-order system, stages reduced to N equations. */
#include "wrist.h"

INLINE void factorise(lane a[N][N])
{
    EACH(k) {
        a[k][k] = 1.0 / a[k][k];
        ABOVE(i, k) {
            a[i][k] *= a[k][k];
            ABOVE(j, k) a[i][j] -= a[i][k] * a[k][j];
        }
    }
}

INLINE void solve(lane lu[N][N], lane *b)
{
    EACH(i) BELOW(k, i) b[i] -= lu[i][k] * b[k];
    BACK(i) {
        ABOVE(k, i) b[i] -= lu[i][k] * b[k];
        b[i] *= lu[i][i];
    }
}

INLINE void accelerate(const segment *s, const lane *theta, const lane *omega, lane plus, lane minus, lane *a)
{
    posture p;
    lane mass[N][N];
    bend(s, theta, plus, minus, &p);
    mass_matrix(s, &p, mass);
    bias(s, theta, omega, &p, a);
    factorise(mass);
    solve(mass, a);
    EACH(i) a[i] = -a[i];
}

INLINE void stage(lane mass[N][N], lane by_theta[N][N], lane lu[N][N], lane hg, const lane *u, const lane *w,
                  lane *k, lane *l)
{
    EACH(i) {
        lane total = 0.0;
        EACH(j) total += mass[i][j] * w[j] - by_theta[i][j] * u[j];
        l[i] = total;
    }
    solve(lu, l);
    EACH(i) k[i] = hg * (u[i] + l[i]);
}

static __attribute__((noinline)) void step(const segment *s, lane *theta, lane *omega, lane plus, lane minus, double h)
{
    posture p;
    lane mass[N][N], other[N][N], lu[N][N], by_theta[N][N], a0[N], a[N], u[N], w[N], at[N], rate[N];
    lane k1[N], l1[N], k2[N], l2[N], k3[N], l3[N], k4[N], l4[N];
    const lane hg = 0.5 * h;
    const double back = 1.0 / h;
    bend(s, theta, plus, minus, &p);
    mass_matrix(s, &p, mass);
    bias(s, theta, omega, &p, a0);
    EACH(i) {
        a0[i] = -a0[i];
        EACH(j) other[i][j] = mass[i][j];
    }
    factorise(other);
    solve(other, a0);
    jacobians(s, omega, a0, &p, by_theta, lu);
    EACH(i) EACH(j) {
        by_theta[i][j] *= hg;
        lu[i][j] += 2.0 * back * mass[i][j] + by_theta[i][j];
    }
    factorise(lu);
    stage(mass, by_theta, lu, hg, omega, a0, k1, l1);
    EACH(i) {
        u[i] = omega[i] + 4.0 * back * k1[i];
        w[i] = a0[i] + 4.0 * back * l1[i];
    }
    stage(mass, by_theta, lu, hg, u, w, k2, l2);
    EACH(i) {
        at[i] = theta[i] + 2.0 * k1[i];
        rate[i] = omega[i] + 2.0 * l1[i];
    }
    accelerate(s, at, rate, plus, minus, a);
    EACH(i) {
        u[i] = rate[i] + (k1[i] - k2[i]) * back;
        w[i] = a[i] + (l1[i] - l2[i]) * back;
    }
    stage(mass, by_theta, lu, hg, u, w, k3, l3);
    EACH(i) {
        at[i] += k3[i];
        rate[i] += l3[i];
    }
    accelerate(s, at, rate, plus, minus, a);
    EACH(i) {
        u[i] = rate[i] + (k1[i] - k2[i] - 8.0 / 3.0 * k3[i]) * back;
        w[i] = a[i] + (l1[i] - l2[i] - 8.0 / 3.0 * l3[i]) * back;
    }
    stage(mass, by_theta, lu, hg, u, w, k4, l4);
    EACH(i) {
        theta[i] = at[i] + k4[i];
        omega[i] = rate[i] + l4[i];
    }
}

/* The impact in plain C, as a careful programmer would write it for speed: the closed form, the switches inside the
 * right-hand side, Runge and Kutta's classical step, and eight designs side by side in loops that the compiler turns
 * into vector instructions. `constants.h` numbers the constants of a design; peaks are the largest at the step ends. */
#include <math.h>
#include "constants.h"

#define LANES 8
#define STATES 6
#define TINY 1e-30

enum { X_B, V_B, THETA, OMEGA, X_V, V_V };
typedef double lanes[LANES];

static double larger(double a, double b) { return a > b ? a : b; }
static double clipped(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

static double away_from_zero(double x) { return copysign(larger(fabs(x), TINY), x); }

static void rates(lanes *restrict y, lanes *restrict c, lanes *restrict rate) {
    for (int i = 0; i < LANES; i++) {
        double theta = y[THETA][i], omega = y[OMEGA][i], q = 0.25 * theta * theta;
        double half = 0.5 * theta * (1 + q * (-1 / 6. + q * (1 / 120. + q * (-1 / 5040. + q * (1 / 362880.)))));
        double sin = 2 * half * sqrt(1 - half * half), versin = 2 * half * half, cos = 1 - versin;

        double depth = c[d][i] * cos, arm = c[l_n][i] * sin - c[z_0][i] * cos;
        double A = y[X_B][i] - c[l_n][i] * versin + c[z_0][i] * sin, B = y[V_B][i] - omega * arm;
        double s = away_from_zero(c[d][i] * sin), p = away_from_zero(omega * depth);
        double yield = copysign(c[x_yield][i], s), below = yield - A, above = yield + A;
        double r1 = clipped(-below / s, 0, 1), r2 = clipped(above / s, 0, 1), r0 = clipped(B / p, 0, 1);
        double a1 = r1 * r1, a2 = r2 * r2, a0 = r0 * r0;
        double spring = 0.5 * (below * a1 + above * a2 - yield) + s / 3 * (a1 * r1 - a2 * r2);
        double spring_r = (below * a1 * r1 + above * a2 * r2 - yield) / 3 + 0.25 * s * (a1 * a1 - a2 * a2);
        double one = 2 * r0 - 1, two = 2 * a0 - 1, three = 2 * a0 * r0 - 1, four = 2 * a0 * a0 - 1;
        double drag = B * B * one - B * p * two + p * p * three / 3;
        double drag_r = 0.5 * B * B * two - 2 / 3. * B * p * three + 0.25 * p * p * four;
        double R = copysign(c[R_soil][i], p);
        double pressed = c[K_soil][i] * spring + R * drag, pressed_r = c[K_soil][i] * spring_r + R * drag_r;

        double reach = y[X_B][i] + c[h][i] * sin + c[g_x][i] * versin;
        double u = larger(y[X_V][i] - reach - c[tau_v][i] * (c[v_0][i] - y[V_V][i]), 0), F_v = c[k_v][i] * u;
        double M = depth * pressed_r + arm * pressed + F_v * (c[h][i] * cos + c[g_x][i] * sin);
        double direction = copysign(1, theta != 0 ? theta : omega);
        double turning = M - direction * (c[C_cos][i] * cos + c[C_sin][i] * fabs(sin));
        double seated = M - clipped(M, -c[C_cos][i], c[C_cos][i]);
        double net = theta == 0 && omega == 0 ? seated : turning;

        rate[X_B][i] = y[V_B][i];
        rate[V_B][i] = (F_v - pressed) * c[inverse_m_eff][i];
        rate[THETA][i] = omega;
        rate[OMEGA][i] = net * c[inverse_J_eff][i];
        rate[X_V][i] = y[V_V][i];
        rate[V_V][i] = -c[k_m][i] * u;
    }
}

static void moved(lanes *restrict y, lanes *restrict rate, const double *restrict by, double share,
                  lanes *restrict end) {
    for (int n = 0; n < STATES; n++)
        for (int i = 0; i < LANES; i++) end[n][i] = y[n][i] + share * by[i] * rate[n][i];
}

/* Largest |rotation| of `designs` designs [rad], a multiple of LANES; constants have one row a constant. */
void solve(long designs, const double *constants, const double *t_end, double longest_step, double *theta_max) {
    for (long first = 0; first < designs; first += LANES) {
        lanes c[CONSTANTS], y[STATES], at[STATES], k[4][STATES], step, most = {0};
        double last = 0;
        for (int n = 0; n < CONSTANTS; n++)
            for (int i = 0; i < LANES; i++) c[n][i] = constants[n * designs + first + i];
        for (int n = 0; n < STATES; n++)
            for (int i = 0; i < LANES; i++) y[n][i] = n == V_V ? c[v_0][i] : 0;
        for (int i = 0; i < LANES; i++) last = larger(last, t_end[first + i]);
        long steps = (long)ceil(last / longest_step);
        for (int i = 0; i < LANES; i++) step[i] = t_end[first + i] / steps;
        for (long count = 0; count < steps; count++) {
            rates(y, c, k[0]);
            moved(y, k[0], step, 0.5, at);
            rates(at, c, k[1]);
            moved(y, k[1], step, 0.5, at);
            rates(at, c, k[2]);
            moved(y, k[2], step, 1.0, at);
            rates(at, c, k[3]);
            for (int n = 0; n < STATES; n++)
                for (int i = 0; i < LANES; i++)
                    y[n][i] += step[i] / 6 * (k[0][n][i] + 2 * (k[1][n][i] + k[2][n][i]) + k[3][n][i]);
            for (int i = 0; i < LANES; i++) most[i] = larger(most[i], fabs(y[THETA][i]));
        }
        for (int i = 0; i < LANES; i++) theta_max[first + i] = most[i];
    }
}

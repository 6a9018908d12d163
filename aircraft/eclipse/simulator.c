/* Nonlinear longitudinal flight of the Eclipse in closed loop (equations and constants in simulator.py).
 *
 * State [u, w, theta, q, p_N, h] in m/s, rad, rad/s, m; input [eta in degrees, tau]; disturbance [d_u, d_w, d_q] in
 * m/s^2 and rad/s^2; measurement [V, alpha, theta, q].
 */
#include "core.h"
#include "vectors.h"

enum { STATES = 6, SUBSTEPS = 2 }; /* substeps of Runge and Kutta's method a sample */

typedef struct { /* in the order of Surrogate.packed */
    double CL0, CLa, CLe, CD0, k, CDe, k_r, Cma, Cmq, Cmad, Cme, coupling;
    double M_wdot, force, torque, half_chord, gravity, X_tau, M_tau;
} Surrogate;

typedef struct { /* of the moment of speed M_u, a polynomial of V, from a reference of u */
    double polynomial[3], reference;
} SpeedMoment;

typedef struct { /* in the order of the fields of Controller */
    double A[4][4], B[4][2], C[4][4], M[4][4], K[2][4], u_trim[2], y_trim[4], lower[2], upper[2];
} Controller;

/* Right-hand side at one state (6,), input and disturbance; `increase` is that of M_u, relative. */
static void derivative(const Surrogate *s, const SpeedMoment *of_speed, double increase, const double *x,
                       const double *u, const double *d, double *out)
{
    const double speed_squared = x[0] * x[0] + x[1] * x[1], speed = sqrt(speed_squared);
    const double alpha = atan2(x[1], x[0]), sine = x[1] / speed, cosine = x[0] / speed;
    const double lift = s->CL0 + s->CLa * alpha + s->CLe * u[0];
    const double drag = s->CD0 + s->k * lift * lift + s->CDe * u[0];
    const double moment = s->Cma * alpha + s->Cmq * x[3] * s->half_chord / speed + s->Cme * u[0];
    const double aero_x = lift * sine - drag * cosine, aero_z = -lift * cosine - drag * sine;
    const double sine_theta = sin(x[2]), cosine_theta = cos(x[2]), *M = of_speed->polynomial;
    out[0] = s->force * speed_squared * aero_x + s->X_tau * u[1] - s->k_r * x[0] - s->gravity * sine_theta -
             x[3] * x[1] + d[0];
    out[1] = s->force * speed_squared * aero_z + s->gravity * cosine_theta + s->coupling * x[3] * x[0] + d[1];
    out[2] = x[3];
    out[3] = s->torque * speed_squared * moment + s->M_tau * u[1] + s->M_wdot * out[1] + d[2];
    out[3] += increase * ((M[0] * speed + M[1]) * speed + M[2]) * (x[0] - of_speed->reference);
    out[4] = x[0] * cosine_theta + x[1] * sine_theta;
    out[5] = x[0] * sine_theta - x[1] * cosine_theta;
}

/* d/dt (K, 6) at states x (K, 6), inputs u (K, 2) and disturbances d (K, 3). */
EXPORTED void fdi_eclipse_derivative(integer rows, const Surrogate *s, const double *x, const double *u,
                                     const double *d, double *out)
{
    const SpeedMoment none = {{0.0, 0.0, 0.0}, 0.0};
    for (integer k = 0; k < rows; k++)
        derivative(s, &none, 0.0, x + STATES * k, u + 2 * k, d + 3 * k, out + STATES * k);
}

static void stage(const double *x, double factor, const double *slope, double *out)
{
    for (int i = 0; i < STATES; i++) out[i] = x[i] + factor * slope[i];
}

/* One sample with everything but the state held. */
static void advance(const Surrogate *s, const SpeedMoment *of_speed, double increase, double Ts, const double *x,
                    const double *u, const double *d, double *out)
{
    const double h = Ts / SUBSTEPS;
    double k1[STATES], k2[STATES], k3[STATES], k4[STATES], at[STATES];
    copy(out, x, STATES);
    for (int substep = 0; substep < SUBSTEPS; substep++) {
        derivative(s, of_speed, increase, out, u, d, k1);
        stage(out, 0.5 * h, k1, at);
        derivative(s, of_speed, increase, at, u, d, k2);
        stage(out, 0.5 * h, k2, at);
        derivative(s, of_speed, increase, at, u, d, k3);
        stage(out, h, k3, at);
        derivative(s, of_speed, increase, at, u, d, k4);
        for (int i = 0; i < STATES; i++) out[i] += (h / 6.0) * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
}

/* The autopilot's input from a measurement, superposed; `predicted` (4,) is its memory. */
static void control(const Controller *law, const double *y, const double *superposed, double *predicted, double *u)
{
    double innovation[4], estimate[4];
    for (int i = 0; i < 4; i++) innovation[i] = y[i] - law->y_trim[i] - dot(law->C[i], predicted, 4);
    for (int i = 0; i < 4; i++) estimate[i] = predicted[i] + dot(law->M[i], innovation, 4);
    for (int i = 0; i < 2; i++)
        u[i] = clipped(law->u_trim[i] - dot(law->K[i], estimate, 4) + superposed[i], law->lower[i], law->upper[i]);
    for (int i = 0; i < 4; i++) {
        const double driven = law->B[i][0] * (u[0] - law->u_trim[0]) + law->B[i][1] * (u[1] - law->u_trim[1]);
        predicted[i] = dot(law->A[i], estimate, 4) + driven;
    }
}

/* A flight of K samples from the first state: x (K, 6), commands u (K, 2), measurements y (K, 4).
 *
 * disturbance (K, 3); noise and bias (K, 4), added to the measurements; excitation (K, 2), superposed on the commands;
 * effectiveness (K, 2), factors on the inputs achieved; moment (K,), the relative increase of M_u.
 */
EXPORTED void fdi_eclipse_fly(integer samples, double Ts, const Surrogate *s, const SpeedMoment *of_speed,
                              const Controller *law, const double *disturbance, const double *noise,
                              const double *excitation, const double *bias, const double *effectiveness,
                              const double *moment, double *x, double *u, double *y)
{
    double predicted[4] = {0.0, 0.0, 0.0, 0.0};
    for (integer k = 0; k < samples; k++) {
        double *state = x + STATES * k, *command = u + 2 * k, *measured = y + 4 * k;
        const double output[4] = {hypot(state[0], state[1]), atan2(state[1], state[0]), state[2], state[3]};
        for (int i = 0; i < 4; i++) measured[i] = output[i] + noise[4 * k + i] + bias[4 * k + i];
        control(law, measured, excitation + 2 * k, predicted, command);
        if (k + 1 == samples) break;
        const double achieved[2] = {effectiveness[2 * k] * command[0], effectiveness[2 * k + 1] * command[1]};
        advance(s, of_speed, moment[k], Ts, state, achieved, disturbance + 3 * k, state + STATES);
    }
}

/* Guidance and autopilot of the missile, from delayed measurements.
 *
 * Guidance is proportional navigation, N times closing speed times the rate of the line of sight, plus the compensation
 * of gravity. The autopilot inverts the trim: it finds the incidence that gives the commanded acceleration with the
 * moments balanced, commands an angular rate towards it, and inverts the moment equations (2) for the deflections.
 */
#include "missile.h"

static void cross(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double product(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Non-gravitational acceleration in body axes that proportional navigation asks for. */
static void commanded(const Airframe *p, const Guidance *g, double t, const double *y, const double *R, double *out)
{
    double position[3], velocity[3], gap[3], closing[3], rate[3], towards[3], wanted[3];
    target_at(t, position, velocity);
    for (int i = 0; i < 3; i++) {
        gap[i] = position[i] - y[6 + i];
        closing[i] = velocity[i] - product(R + 3 * i, y + 9);
    }
    const double squared = product(gap, gap), distance = sqrt(squared);
    cross(gap, closing, rate);
    for (int i = 0; i < 3; i++) rate[i] /= squared, towards[i] = gap[i] / distance;
    const double speed = -product(towards, closing);
    cross(rate, towards, wanted);
    for (int i = 0; i < 3; i++) wanted[i] *= g->navigation * speed;
    wanted[2] -= p->gravity;
    for (int i = 0; i < 3; i++) out[i] = R[i] * wanted[0] + R[3 + i] * wanted[1] + R[6 + i] * wanted[2];
}

/* Incidence at which force coefficient and zero moment hold: k1 s + k2 s |s| = coefficient. */
static double trim_incidence(const Airframe *p, double coefficient, double limit)
{
    const double k1 = p->cz_alpha - p->cz_dm * p->cm_alpha / p->cm_dm;
    const double k2 = p->cz_alpha_abs - p->cz_dm * p->cm_alpha_abs / p->cm_dm;
    const double size = (-k1 + sqrt(k1 * k1 + 4.0 * k2 * fabs(coefficient))) / (2.0 * k2);
    const double sign = (double)((coefficient > 0.0) - (coefficient < 0.0));
    return sign * (size > limit ? limit : size);
}

/* Angular rates [roll, pitch, yaw] that lead to the commanded acceleration. */
static void wanted_rates(const Airframe *p, const Guidance *g, double Ts, const double *y, const double *R,
                         double per_force, const double *wanted, double *memory, double *rates)
{
    const double *v = y + 9, speed = sqrt(product(v, v)), alpha = atan2(v[2], v[0]), beta = atan2(v[1], v[0]);
    double asked[2];
    for (int i = 0; i < 2; i++) {
        const double limited = clipped(wanted[i + 1], -g->acceleration_limit, g->acceleration_limit);
        memory[i] += Ts * (limited - y[i + 1]);
        memory[i] = clipped(memory[i], -g->acceleration_limit, g->acceleration_limit);
        asked[i] = limited + g->acceleration_integral * memory[i];
    }
    const double alpha_c = trim_incidence(p, -asked[1] * per_force, g->incidence_limit);
    const double beta_c = trim_incidence(p, -asked[0] * per_force, g->incidence_limit);
    rates[0] = -g->roll_angle * y[12];
    rates[1] = g->incidence * (alpha_c - alpha) - (y[2] + p->gravity * R[8]) / speed;
    rates[2] = -g->incidence * (beta_c - beta) + (y[1] + p->gravity * R[7]) / speed;
}

/* Deflections that give angular accelerations, by the moment equations (2). */
static void invert_moments(const Airframe *p, const double *y, double torque, const double *accelerations, double *u)
{
    const double *v = y + 9, wp = y[3], wq = y[4], wr = y[5];
    const double alpha = atan2(v[2], v[0]), beta = atan2(v[1], v[0]);
    const double damping = p->reference_length / sqrt(product(v, v));
    const double a = p->roll_inertia, b = p->pitch_inertia;
    const double L = a * accelerations[0] / torque - p->cl_beta * beta - p->cl_p * damping * wp;
    const double M = (b * accelerations[1] + (a - b) * wp * wr) / torque -
                     (p->cm_alpha + p->cm_alpha_abs * fabs(alpha)) * alpha - p->cm_q * damping * wq;
    const double N = (b * accelerations[2] + (b - a) * wp * wq) / torque -
                     (p->cn_beta + p->cn_beta_abs * fabs(beta)) * beta - p->cn_r * damping * wr;
    const double determinant = p->cl_dl * p->cn_dn - p->cl_dn * p->cn_dl;
    u[0] = (p->cn_dn * L - p->cl_dn * N) / determinant;
    u[1] = M / p->cm_dm;
    u[2] = (p->cl_dl * N - p->cn_dl * L) / determinant;
}

void steer(const Airframe *p, const Guidance *g, const double *limits, double Ts, double t, const double *y,
           double *memory, double *u)
{
    const double pressure = pressure_at(p, y[8], y + 9), force = pressure * p->reference_area;
    double R[9], wanted[3], rates[3], accelerations[3];
    fdi_missile_rotation(y + 12, R);
    commanded(p, g, t, y, R, wanted);
    wanted_rates(p, g, Ts, y, R, p->mass / force, wanted, memory, rates);
    accelerations[0] = g->roll_rate * (rates[0] - y[3]);
    accelerations[1] = g->rate * (rates[1] - y[4]);
    accelerations[2] = g->rate * (rates[2] - y[5]);
    invert_moments(p, y, force * p->reference_length, accelerations, u);
    const double lag = g->speed - sqrt(product(y + 9, y + 9));
    u[3] = g->thrust_trim + g->thrust_gain * lag + g->thrust_integral * (memory[2] + Ts * lag);
    if (0.0 < u[3] && u[3] < 1.0) memory[2] += Ts * lag; /* the integral waits while the thrust is at a limit */
    for (int i = 0; i < INPUTS; i++) u[i] = clipped(u[i], limits[i], limits[INPUTS + i]);
}

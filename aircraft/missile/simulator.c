/* Closed-loop flight of the missile: dynamics, target, delayed measurements (equations in simulator.py, SI units).
 *
 * State [x y z, vbx vby vbz, p q r, phi theta psi] (z down), input [dl dm dn, eta], measurement [abx aby abz, p q r,
 * x y z, vbx vby vbz, phi theta psi]. Guidance and autopilot stand in autopilot.c.
 */
#include "missile.h"

static const double PI = 3.14159265358979323846;

/* Coefficients of equation (1), to be used with its signs: -x, +y, -z. */
static Coefficients coefficients_at(const Airframe *p, double alpha, double beta)
{
    return (Coefficients){
        p->cx_zero + p->cx_alpha_squared * alpha * alpha, p->cx_dl, p->cx_dm * (1.0 + alpha), p->cx_dn * (1.0 + beta),
        (p->cy_beta + p->cy_beta_abs * fabs(beta)) * beta, p->cy_dl, p->cy_dn,
        (p->cz_alpha + p->cz_alpha_abs * fabs(alpha)) * alpha, p->cz_dm,
    };
}

EXPORTED void fdi_missile_coefficients(const Airframe *p, integer count, const double *alpha, const double *beta,
                                       Coefficients *out)
{
    for (integer k = 0; k < count; k++) out[k] = coefficients_at(p, alpha[k], beta[k]);
}

double pressure_at(const Airframe *p, double z, const double *v)
{
    return 0.5 * p->density * exp(z / p->scale_height) * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Q = rho V^2 / 2 at heights -z (count,) and velocities (count, 3) [Pa]. */
EXPORTED void fdi_missile_pressure(const Airframe *p, integer count, const double *z, const double *v, double *out)
{
    for (integer k = 0; k < count; k++) out[k] = pressure_at(p, z[k], v + 3 * k);
}

/* Non-gravitational acceleration in body axes at one state and input, (3,): what an IMU measures. */
EXPORTED void fdi_missile_specific_force(const Airframe *p, const double *x, const double *u, double *out)
{
    const double alpha = atan2(x[5], x[3]), beta = atan2(x[4], x[3]);
    const Coefficients c = coefficients_at(p, alpha, beta);
    const double scale = pressure_at(p, x[2], x + 3) * p->reference_area / p->mass;
    const double thrust = (p->thrust_min + (p->thrust_max - p->thrust_min) * u[3]) / p->mass;
    out[0] = -scale * (c.cx + c.cx_dl * u[0] + c.cx_dm * u[1] + c.cx_dn * u[2]) + thrust;
    out[1] = scale * (c.cy + c.cy_dl * u[0] + c.cy_dn * u[2]);
    out[2] = -scale * (c.cz + c.cz_dm * u[1]);
}

/* Matrix of equation (4), (3, 3), from body to inertial axes, for [phi, theta, psi]. */
EXPORTED void fdi_missile_rotation(const double *angles, double *R)
{
    const double sf = sin(angles[0]), cf = cos(angles[0]), st = sin(angles[1]), ct = cos(angles[1]);
    const double ss = sin(angles[2]), cs = cos(angles[2]);
    R[0] = cs * ct, R[1] = -ss * cf + cs * st * sf, R[2] = ss * sf + cs * st * cf;
    R[3] = ss * ct, R[4] = cs * cf + ss * st * sf, R[5] = -cs * sf + ss * st * cf;
    R[6] = -st, R[7] = ct * sf, R[8] = ct * cf;
}

/* Right-hand sides of the moment equations (2). */
static void turning(const Airframe *p, const double *x, const double *u, double *out)
{
    const double *v = x + 3, wp = x[6], wq = x[7], wr = x[8];
    const double alpha = atan2(v[2], v[0]), beta = atan2(v[1], v[0]);
    const double damping = p->reference_length / sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    const double torque = pressure_at(p, x[2], v) * p->reference_area * p->reference_length;
    const double L = p->cl_beta * beta + p->cl_dl * u[0] + p->cl_dn * u[2] + p->cl_p * damping * wp;
    const double M = (p->cm_alpha + p->cm_alpha_abs * fabs(alpha)) * alpha + p->cm_dm * u[1] + p->cm_q * damping * wq;
    const double N = (p->cn_beta + p->cn_beta_abs * fabs(beta)) * beta + p->cn_dl * u[0] + p->cn_dn * u[2] +
                     p->cn_r * damping * wr;
    const double a = p->roll_inertia, b = p->pitch_inertia;
    out[0] = torque * L / a;
    out[1] = (torque * M - (a - b) * wp * wr) / b;
    out[2] = (torque * N - (b - a) * wp * wq) / b;
}

/* Right-hand side of equations (1) to (4), (12,). */
EXPORTED void fdi_missile_derivative(const Airframe *p, const double *x, const double *u, double *out)
{
    const double vx = x[3], vy = x[4], vz = x[5], wp = x[6], wq = x[7], wr = x[8];
    double R[9], a[3];
    fdi_missile_rotation(x + 9, R);
    fdi_missile_specific_force(p, x, u, a);
    for (int i = 0; i < 3; i++) out[i] = R[3 * i] * vx + R[3 * i + 1] * vy + R[3 * i + 2] * vz;
    out[3] = a[0] + p->gravity * R[6] - (wq * vz - wr * vy);
    out[4] = a[1] + p->gravity * R[7] - (wr * vx - wp * vz);
    out[5] = a[2] + p->gravity * R[8] - (wp * vy - wq * vx);
    turning(p, x, u, out + 6);
    const double sf = sin(x[9]), cf = cos(x[9]), turn = sf * wq + cf * wr;
    out[9] = wp + turn * tan(x[10]);
    out[10] = cf * wq - sf * wr;
    out[11] = turn / cos(x[10]);
}

void target_at(double t, double *position, double *velocity)
{
    const double w1 = 2.0 * PI / 9.0, w2 = 2.0 * PI / 11.0;
    position[0] = 40000.0 + 40.0 * t, velocity[0] = 40.0;
    position[1] = 2000.0 + 200.0 * t + 100.0 * sin(w1 * t), velocity[1] = 200.0 + 100.0 * w1 * cos(w1 * t);
    position[2] = -6000.0 - 60.0 * sin(w2 * t), velocity[2] = -60.0 * w2 * cos(w2 * t);
}

static void stage(const double *x, double factor, const double *slope, double *out)
{
    for (int i = 0; i < STATES; i++) out[i] = x[i] + factor * slope[i];
}

/* One step of Runge and Kutta's method. */
static void advance(const Airframe *p, double Ts, const double *x, const double *u, double *out)
{
    double k1[STATES], k2[STATES], k3[STATES], k4[STATES], at[STATES];
    fdi_missile_derivative(p, x, u, k1);
    stage(x, 0.5 * Ts, k1, at);
    fdi_missile_derivative(p, at, u, k2);
    stage(x, 0.5 * Ts, k2, at);
    fdi_missile_derivative(p, at, u, k3);
    stage(x, Ts, k3, at);
    fdi_missile_derivative(p, at, u, k4);
    for (int i = 0; i < STATES; i++) out[i] = x[i] + (Ts / 6.0) * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
}

/* The measurement of a state and an acceleration, as the sensors corrupt it. */
static void measure(const Flight *f, integer then, integer k, double *y)
{
    const double *x = f->x + STATES * then, *a = f->acceleration + 3 * then;
    const double true_values[MEASUREMENTS] = {a[0], a[1], a[2], x[6], x[7],  x[8],  x[0], x[1],
                                              x[2], x[3], x[4], x[5], x[9], x[10], x[11]};
    for (int i = 0; i < MEASUREMENTS; i++) {
        const double read = f->scale[i] * true_values[i] + f->error[MEASUREMENTS * k + i];
        y[i] = f->sensor_gain[MEASUREMENTS * then + i] * read + f->sensor_offset[MEASUREMENTS * then + i];
    }
}

/* What the actuators make of the computed input; held (4,): those achieved before each was held. */
static void actuate(const Flight *f, integer k, double *held)
{
    for (integer i = INPUTS * k; i < INPUTS * (k + 1); i++) {
        const integer input = i - INPUTS * k, before = i - INPUTS;
        if (f->hold[i] > 0.0 && (k == 0 || f->hold[before] == 0.0))
            held[input] = k > 0 ? f->achieved[before] : f->computed[i];
        const double moved = f->gain[i] * f->computed[i] + f->hold[i] * held[input] + f->offset[i];
        f->achieved[i] = clipped(moved, f->lower[i], f->upper[i]);
    }
}

/* A flight from its first state; limits (2, 4): least and largest inputs. */
EXPORTED void fdi_missile_fly(integer samples, integer delay, double Ts, const Airframe *airframe,
                              const Airframe *believed, const Guidance *guidance, const double *limits,
                              const Flight *f)
{
    double memory[3] = {0.0, 0.0, 0.0}, held[INPUTS] = {0.0, 0.0, 0.0, 0.0}, velocity[3];
    for (integer k = 0; k < samples; k++) {
        double *x = f->x + STATES * k, *y = f->y + MEASUREMENTS * k, *u = f->achieved + INPUTS * k;
        const double t = (double)k * Ts;
        measure(f, most(k - delay, 0), k, y);
        steer(believed, guidance, limits, Ts, t, y, memory, f->computed + INPUTS * k);
        actuate(f, k, held);
        fdi_missile_specific_force(airframe, x, u, f->acceleration + 3 * k);
        target_at(t, f->target + 3 * k, velocity);
        if (k + 1 < samples) advance(airframe, Ts, x, u, x + STATES);
    }
}

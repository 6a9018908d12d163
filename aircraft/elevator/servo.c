/* Nonlinear servo-loop of an elevator, run over samples (equations in servo.py).
 *
 *     dx/dt = gamma(u, x) (u - x),  gamma = k sqrt((1 - F sign(u - x)) / (1 + Ka (k (u - x))^2))
 *
 * Angles in radians, times in seconds, forces as fractions of S dPref.
 */
#include "core.h"

static const integer SUBSTEPS = 10; /* a sample */
static const double PI = 3.14159265358979323846;

typedef struct { /* in the order of the fields of Servo */
    double gain, damping, force, force_slope, force_swing, force_period, stop;
} Servo;

typedef struct { /* of a fault, at a sample */
    double gain, hold, offset, lower, upper;
} Law;

static double sign_of(double value) { return (double)((value > 0.0) - (value < 0.0)); }

static double rate(const Servo *servo, double u, double x, double t)
{
    const double swing = 1.0 + servo->force_swing * sin(2.0 * PI * t / servo->force_period);
    const double load = (servo->force + servo->force_slope * x) * swing, move = servo->gain * (u - x);
    return servo->gain * sqrt((1.0 - load * sign_of(u - x)) / (1.0 + servo->damping * move * move));
}

/* gamma [1/s] at a command, a position and a time. */
EXPORTED double fdi_servo_rate(const Servo *servo, double u, double x, double t) { return rate(servo, u, x, t); }

static double by_law(const Law *law, double value, double held)
{
    return clipped(law->gain * value + law->hold * held + law->offset, law->lower, law->upper);
}

/* Positions x (samples,) from the first one, the commands u (samples,) held over each sample.
 *
 * command, surface (samples,): what a fault makes of the command that the loop follows, and of the position that the
 * surface takes. Over a substep gamma is held, so that the loop cannot overshoot its command.
 */
EXPORTED void fdi_servo_run(const Servo *servo, integer samples, double Ts, const double *u, const Law *command,
                            const Law *surface, double *x)
{
    const double h = Ts / (double)SUBSTEPS, stop = servo->stop;
    double held_command = samples > 0 ? u[0] : 0.0, held_position = samples > 0 ? x[0] : 0.0;
    for (integer k = 0; k < samples; k++) {
        if (k > 0) {
            double free = x[k - 1];
            const double target = by_law(command + k - 1, u[k - 1], held_command);
            for (integer i = 0; i < SUBSTEPS; i++) {
                const double t = ((double)(k - 1) + (double)i / (double)SUBSTEPS) * Ts;
                free += (1.0 - exp(-rate(servo, target, free, t) * h)) * (target - free);
                free = clipped(free, -stop, stop);
            }
            x[k] = free;
        }
        if (surface[k].hold == 0.0) held_position = x[k];
        if (command[k].hold == 0.0) held_command = u[k];
        x[k] = clipped(by_law(surface + k, x[k], held_position), -stop, stop);
    }
}

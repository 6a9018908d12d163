/* The missile: its constants, and what simulator and autopilot share. SI units, angles in radians. */
#ifndef MISSILE_H
#define MISSILE_H

#include "core.h"

enum { STATES = 12, INPUTS = 4, MEASUREMENTS = 15 };

typedef struct { /* in the order of the fields of Airframe */
    double cx_zero, cx_alpha_squared, cx_dl, cx_dm, cx_dn, cy_beta, cy_beta_abs, cy_dl, cy_dn, cz_alpha, cz_alpha_abs;
    double cz_dm, cl_beta, cl_dl, cl_dn, cl_p, cm_alpha, cm_alpha_abs, cm_dm, cm_q, cn_beta, cn_beta_abs, cn_dl, cn_dn;
    double cn_r, mass, roll_inertia, pitch_inertia, reference_area, reference_length, thrust_min, thrust_max;
    double density, scale_height, gravity;
} Airframe;

typedef struct { /* in the order of the fields of Guidance */
    double navigation, incidence, rate, roll_angle, roll_rate, acceleration_integral, thrust_trim, thrust_gain;
    double thrust_integral, speed, incidence_limit, acceleration_limit;
} Guidance;

typedef struct {
    double cx, cx_dl, cx_dm, cx_dn, cy, cy_dl, cy_dn, cz, cz_dm; /* cx, cy, cz: at the incidence alone */
} Coefficients;

typedef struct { /* arrays of K samples; whoever calls hands over their addresses in this order */
    double *x, *acceleration, *computed, *achieved, *y, *target; /* (K, 12), (K, 3), (K, 4) twice, (K, 15), (K, 3) */
    const double *error, *scale;                                 /* (K, 15), (15,) */
    const double *gain, *hold, *offset, *lower, *upper;          /* (K, 4) each */
    const double *sensor_gain, *sensor_offset;                   /* (K, 15) each */
} Flight;

double pressure_at(const Airframe *p, double z, const double *v);
void target_at(double t, double *position, double *velocity);
EXPORTED void fdi_missile_rotation(const double *angles, double *R);

/* Inputs (4,) from one measurement (15,); memory = integrals of [a_y error, a_z error, speed error]. */
void steer(const Airframe *p, const Guidance *g, const double *limits, double Ts, double t, const double *y,
           double *memory, double *u);

#endif

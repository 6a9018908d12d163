/* Interacting multiple models (Blom and Bar-Shalom 1988): a Kalman filter a model, and the probability of each.
 *
 * Probabilities are kept as logarithms (minus infinity: never), for without switching that of a wrong model falls
 * without end.
 */
#include "filters/filters.h"
#include "vectors.h"

static const double IMPOSSIBLE = 1e300; /* half a squared innovation, in variances: only floats end there */

typedef struct {
    double *means, *covariances; /* (m, n), (m, n, n) after a possible switch */
    double *predicted, *joint, *away; /* (m,), (m,), (n,) */
} Mixture;

static void lay_out_mixture(Mixture *mixture, Memory *memory, integer m, integer n)
{
    mixture->means = doubles(memory, m * n), mixture->covariances = doubles(memory, m * n * n);
    mixture->predicted = doubles(memory, m), mixture->joint = doubles(memory, m), mixture->away = doubles(memory, n);
}

EXPORTED integer fdi_models_room(integer m, integer n, integer ny)
{
    Filter filter;
    Mixture mixture;
    Memory memory = {NULL, 0};
    lay_out_filter(&filter, &memory, n, ny);
    lay_out_mixture(&mixture, &memory, m, n);
    return memory.used;
}

/* ln of the sum of exponentials; minus infinity if all are. */
static double log_sum(const double *logs, integer m)
{
    double largest = -INFINITY, sum = 0.0;
    for (integer i = 0; i < m; i++) largest = larger(logs[i], largest);
    if (!(largest > -INFINITY)) return largest;
    for (integer i = 0; i < m; i++) sum += exp(logs[i] - largest);
    return largest + log(sum);
}

/* Mean and covariance of model j from those of all, by their shares in it; `mixture->joint` has the logarithms. */
static void mix(Mixture *mixture, const double *xs, const double *Ps, integer m, integer n, integer j)
{
    double *mean = mixture->means + j * n, *covariance = mixture->covariances + j * n * n, *away = mixture->away;
    fill(mean, 0.0, n);
    fill(covariance, 0.0, n * n);
    for (integer i = 0; i < m; i++) {
        mixture->joint[i] = exp(mixture->joint[i] - mixture->predicted[j]);
        if (mixture->joint[i] > 0.0) /* a model that is never switched from may have run off to infinity */
            add_multiple(mean, mixture->joint[i], xs + i * n, n);
    }
    for (integer i = 0; i < m; i++) {
        const double share = mixture->joint[i];
        if (!(share > 0.0)) continue;
        for (integer q = 0; q < n; q++) away[q] = xs[i * n + q] - mean[q];
        for (integer r = 0; r < n; r++)
            for (integer q = 0; q < n; q++)
                covariance[r * n + q] += share * (Ps[i * n * n + r * n + q] + away[r] * away[q]);
    }
}

/* Means, covariances and log probabilities of the models after a possible switch. */
static void switch_models(Mixture *mixture, double *xs, double *Ps, double *log_mu, const double *log_transition,
                          integer m, integer n)
{
    for (integer j = 0; j < m; j++) {
        for (integer i = 0; i < m; i++) mixture->joint[i] = log_transition[i * m + j] + log_mu[i];
        mixture->predicted[j] = log_sum(mixture->joint, m);
        mix(mixture, xs, Ps, m, n, j);
    }
    copy(xs, mixture->means, m * n);
    copy(Ps, mixture->covariances, m * n * n);
    copy(log_mu, mixture->predicted, m);
}

/* The log likelihood of a whitened innovation, but for a constant. */
static double log_likelihood(const Filter *filter)
{
    const integer ny = filter->ny;
    const double distance = 0.5 * sum_of_squares(filter->white, ny);
    double volume = 0.0;
    for (integer i = 0; i < ny; i++) volume += log(filter->L[i * ny + i]);
    return -((distance < IMPOSSIBLE ? distance : IMPOSSIBLE) + volume);
}

/* K samples; returns DONE or NOT_POSITIVE.
 *
 * xs (m, n), Ps (m, n, n) and log_mu (m,) as x and P of fdi_filter; the arrays of the models are (m, K, ...), y is
 * (K, ny). Writes posterior (K, m) and log_odds (K,): ln of the odds of all models but the first.
 */
EXPORTED integer fdi_models(integer m, integer samples, integer n, integer ny, integer first, double *xs, double *Ps,
                            double *log_mu, const double *log_transition, const double *A, const double *f,
                            const double *Q, const double *C, const double *g, const double *R, const double *y,
                            double *log_odds, double *posterior, double *block)
{
    Filter filter;
    Mixture mixture;
    Memory memory = {block, 0};
    lay_out_filter(&filter, &memory, n, ny);
    lay_out_mixture(&mixture, &memory, m, n);
    for (integer k = 0; k < samples; k++) {
        const int start = first && k == 0;
        if (!start) switch_models(&mixture, xs, Ps, log_mu, log_transition, m, n);
        for (integer j = 0; j < m; j++) {
            const integer q = j * samples + k;
            const Sample at = {A + q * n * n, f + q * n,      Q + q * n * n, C + q * ny * n,
                               g + q * ny,    R + q * ny * ny, y + k * ny};
            if (!start) predict(&filter, &at, xs + j * n, Ps + j * n * n);
            if (!innovate(&filter, &at, xs + j * n, Ps + j * n * n)) return NOT_POSITIVE;
            correct(&filter, xs + j * n, Ps + j * n * n);
            log_mu[j] += log_likelihood(&filter);
        }
        const double total = log_sum(log_mu, m);
        for (integer j = 0; j < m; j++) {
            log_mu[j] -= total;
            posterior[k * m + j] = exp(log_mu[j]);
        }
        log_odds[k] = log_sum(log_mu + 1, m - 1) - log_mu[0];
    }
    return DONE;
}

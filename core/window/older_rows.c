/* Rows of samples that are not the newest: a measurement that arrives late, a channel whose s is bounded anew. */
#include "window.h"

/* The state at sample k over z, as `w->psi` is that of the newest. */
static const double *response_at(const window *w, integer k)
{
    fill(w->older, 0.0, w->n * w->Z);
    for (integer j = 0; j < w->n; j++) w->older[j * w->Z + j] = w->xr[j];
    for (integer at = w->clock[BASE]; at < k; at++) move_response(w, w->older, at);
    return w->older;
}

/* Rows of the sensors in in_y that are not NaN, at sample k of the window; they must have been missing. */
EXPORTED void fdi_window_add_late(void *block, integer k, double eps)
{
    window w;
    window_open(&w, block);
    const double *psi = response_at(&w, k);
    for (integer o = 0; o < w.ny; o++)
        if (!isnan(w.in_y[o])) {
            w.y[slot(&w, k) * w.ny + o] = w.in_y[o];
            measure_sensor(&w, psi, k, o, eps);
        }
}

/* The rows of channel q at sample k for s in [low, high], within its bounds; the box of p stays. */
EXPORTED void fdi_window_redraw_channel(void *block, integer k, integer q, double low, double high)
{
    window w;
    window_open(&w, block);
    const integer at = variables(&w, k) * w.nq + q;
    w.s_lower[at] = low;
    w.s_upper[at] = high;
    channel_rows(&w, response_at(&w, k), k, q);
}

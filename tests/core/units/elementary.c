/* Elementary functions: values of the platform's long doubles are inside, and every build gives the same bits. */
#include <float.h>
#include <string.h>

#include "check.h"
#include "tape/elementary.h"

static uint64_t hash = 0xcbf29ce484222325u; /* of Fowler, Noll and Vo: of all bits of all intervals */

static void mix(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    hash = (hash ^ bits) * 0x100000001b3u;
}

static int holds(fdi_interval a, long double exact)
{
    const long double slack = 8.0L * LDBL_EPSILON * fabsl(exact);
    mix(a.low);
    mix(a.high);
    return a.low <= exact + slack && exact - slack <= a.high && a.high - a.low <= 1e-15 * fabs((double)exact);
}

static void values(void)
{
    for (integer i = 0; i < 20000; i++) {
        const double x = 40.0 * uniform() * uniform(), y = 40.0 * uniform(), size = fabs(x) + DBL_MIN;
        CHECK(holds(fdi_exp_at(x), expl(x)));
        CHECK(holds(fdi_log_at(size), logl(size)));
        CHECK(holds(fdi_sin_at(x), sinl(x)));
        CHECK(holds(fdi_cos_at(x), cosl(x)));
        CHECK(holds(fdi_tanh_at(x), tanhl(x)));
        CHECK(holds(fdi_atan2_at(y, x), atan2l(y, x)));
    }
}

/* Any bits, infinity and NaN too: ends in order, and no undefined behaviour on the way. */
static void any_bits(void)
{
    for (integer i = 0; i < 20000; i++) {
        double pair[2];
        for (int k = 0; k < 2; k++) {
            uint64_t bits = seed += 0x9e3779b97f4a7c15u;
            bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9u;
            bits ^= bits >> 31;
            memcpy(&pair[k], &bits, sizeof bits);
        }
        const fdi_interval found[] = {fdi_exp_at(pair[0]), fdi_log_at(pair[0]),  fdi_sin_at(pair[0]),
                                      fdi_cos_at(pair[0]), fdi_tanh_at(pair[0]), fdi_atan2_at(pair[0], pair[1])};
        const fdi_interval range = {pair[0] < pair[1] ? pair[0] : pair[1], pair[0] < pair[1] ? pair[1] : pair[0]};
        const fdi_interval over[] = {fdi_sin_over(range), fdi_cos_over(range), fdi_tanh_over(range)};
        for (int k = 0; k < 6; k++) {
            CHECK(found[k].low <= found[k].high);
            mix(found[k].low);
            mix(found[k].high);
        }
        for (int k = 0; k < 3; k++) CHECK(over[k].low <= over[k].high && over[k].low >= -1.0 && over[k].high <= 1.0);
    }
}

int main(void)
{
    values();
    any_bits();
    CHECK(hash == 0xf3ade4a10ecbb50du);
    if (failures) fprintf(stderr, "hash %016llx\n", (unsigned long long)hash);
    return failures > 0;
}

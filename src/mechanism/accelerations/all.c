/* Every pattern of modes, one after the other. */
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"

/* Clock readings are rare: once in so many patterns. */
#define PATTERNS_A_READING 256
#define PI 3.14159265358979323846

static perp_status keep(perp__acceleration *a, int32_t dimension)
{
    int32_t at_vertex;

    if (dimension > 0)
        return perp__found_keep_family(a, dimension);
    if (dimension < 0 ||
        !perp__found_keeps(a, &a->pattern, a->f, a->u, a->f_width, a->u_width, 0, 1, &at_vertex))
        return PERP_OK;
    return perp__found_keep_point(a, at_vertex, 0);
}

/* With many slips that start in a plane at once their directions are many: every second, then every
 * fourth of each are where Newton's method starts. */
static int32_t is_start(const perp__acceleration *a, int32_t turning)
{
    const int32_t stride = turning <= 2 ? 1 : turning <= 4 ? 2 : 4;
    const int32_t ways = a->m->settings.directions;
    int32_t i;

    for (i = 0; i < a->units && stride > 1 && ways >= 2 * stride; i++) {
        const double *way = a->pattern.way + 2 * (size_t)i;
        int32_t k;

        if (!perp__found_turns(a, i))
            continue;
        k = (int32_t)lround(atan2(way[1], way[0]) / (2.0 * PI) * ways);
        if ((k + ways) % ways % stride != 0)
            return 0;
    }
    return 1;
}

perp_status perp__found_try(perp__acceleration *a, double singular)
{
    if (perp__found_turning(a) == 0)
        return keep(a, perp__found_solve(a));
    return keep(a, perp__found_turn(a, singular));
}

/* A slip that starts in the first of the directions: all of its directions are found at once. In
 * the others there is nothing left to do. */
static perp_status try_directions(perp__acceleration *a)
{
    const int32_t ways = a->m->settings.directions;
    double angles[PERP__MOST_ANGLES], *way;
    perp_status status = PERP_OK;
    int32_t index = 0, count, k;

    while (!perp__found_turns(a, index))
        index++;
    way = a->pattern.way + 2 * (size_t)index;
    if (way[0] != 1.0)
        return PERP_OK;
    count = perp__found_angles(a, angles);
    for (k = 0; k < (count < 0 ? ways : count) && status == PERP_OK; k++) {
        const double angle = count < 0 ? 2.0 * PI * k / ways : angles[k];

        way[0] = cos(angle);
        way[1] = sin(angle);
        status = keep(a, perp__found_turn(a, PERP__FOUND_TOLERANCE));
    }
    return status;
}

static perp_status try_pattern(perp__acceleration *a)
{
    const int32_t turning = perp__found_turning(a);
    perp_status status;
    int32_t dimension;

    if (turning == 0) {
        dimension = perp__found_solve(a);
        perp__found_note_sign(a);
        return keep(a, dimension);
    }
    perp__found_solve_roughly(a, PERP__FOUND_SINGULAR, a->active);
    perp__found_note_sign(a);
    if (turning == 1)
        status = try_directions(a);
    else
        status = is_start(a, turning) ? perp__found_try(a, PERP__FOUND_TOLERANCE) : PERP_OK;
    return status;
}

/* The number of patterns, or more than `most`. */
static int64_t count_patterns(const perp__acceleration *a, int64_t most)
{
    int64_t product = 1;
    int32_t i;

    for (i = 0; i < a->units && product <= most; i++)
        product *= perp__found_choices(a, a->unit + i);
    return product;
}

static perp_status enumerate(perp__acceleration *a, perp_mechanism_summary *summary,
                             int64_t patterns)
{
    perp_status status = PERP_OK;
    int64_t k;

    for (k = 0; k < patterns && status == PERP_OK; k++) {
        int64_t rest = k;
        int32_t i;

        if (k % PATTERNS_A_READING == 0 && perp__mechanism_is_late(a->m)) {
            summary->exhaustive = a->complete = 0;
            break;
        }
        for (i = 0; i < a->units; i++) {
            const int32_t count = perp__found_choices(a, a->unit + i);

            perp__found_choose(a, i, (int32_t)(rest % count));
            rest /= count;
        }
        status = try_pattern(a);
    }
    summary->patterns = k;
    return status;
}

perp_status perp__found_all(perp__acceleration *a, perp_mechanism_summary *summary)
{
    const int64_t most = a->m->settings.most_patterns, patterns = count_patterns(a, most);

    perp_status status = PERP_OK;

    summary->exhaustive = patterns <= most && a->closed <= PERP__MOST_CONTACTS;
    a->complete = summary->exhaustive;
    if (summary->exhaustive)
        status = enumerate(a, summary, patterns);
    if (status == PERP_OK)
        status = perp__found_seed(a);
    summary->exhaustive = summary->exhaustive && !a->incomplete;
    if (status == PERP_OK && !summary->exhaustive)
        status = perp__found_search(a, summary);
    return status;
}

/* A step in time over load-dependent friction: all answers of the implicit equations, and the
 * choice of one of them by stability and continuity. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/load_friction/load_friction.h"

PERP__INIT(perp_load_step)

/* ---- the question -------------------------------------------------------------------------- */

/* Every coordinate may stop, at x = -v / h, or go on in either direction. */
static void ask_step(perp_load_friction *f, const double *velocity, double h)
{
    f->question.tau = f->tau;
    for (int32_t i = 0; i < f->n; i++) {
        const double v = velocity[i];

        f->question.sign[i] = 0;
        f->question.before[i] = (int8_t)((v > 0.0) - (v < 0.0));
        f->question.stop[i] = v == 0.0 ? 0.0 : -v / h;
        f->question.mu_stick[i] = v == 0.0 ? f->mu_static[i] : f->mu[i];
    }
}

/* Marks coordinates that some stable acceleration of the rigid system brings to rest within h:
 * their stop needs no impulse. */
static perp_status find_regular_stops(perp_load_friction *f, perp_load_step *own,
                                      const double *velocity, double h)
{
    const perp__answer *a;
    perp_load_summary summary;
    perp_status status = perp__friction_solve(f, &summary, f->tau, velocity);

    if (status != PERP_OK)
        return status;
    own->accelerations = summary.count;
    memset(f->regular, 0, (size_t)f->n);
    for (a = f->answers.first; a; a = a->next)
        for (int32_t i = 0; i < f->n; i++)
            if (a->stable && velocity[i] * (velocity[i] + h * a->middle[i]) <= 0.0)
                f->regular[i] = 1;
    return PERP_OK;
}

/* ---- the choice ---------------------------------------------------------------------------- */

typedef struct merit {
    int32_t unstable; /* in this order, less is better */
    int32_t signs;    /* normal forces of moving coordinates on another side than before */
    int32_t starts;   /* coordinates that leave rest */
    double energy;    /* x'A x */
} merit;

/* What separates the sides of a normal force: for one coordinate the unstable answer, else 0. */
static double find_divide(const perp_load_friction *f)
{
    const perp__answer *a;
    double divide = 0.0;

    for (a = f->answers.first; a && f->n == 1; a = a->next)
        if (!a->stable && a->dimension == 0)
            divide = perp__friction_normal(a)[0];
    return divide;
}

static merit judge(const perp_load_friction *f, const perp__answer *a, double divide,
                   const double *previous)
{
    merit m = {!a->stable, 0, 0, 0.0};

    for (int32_t i = 0; i < f->n; i++) {
        if (previous && f->question.before[i] != 0 && f->mu[i] > 0.0)
            m.signs += (previous[i] - divide) * (perp__friction_normal(a)[i] - divide) < 0.0;
        m.starts += f->question.before[i] == 0 && a->pattern[i] != PERP_LOAD_STICK;
        for (int32_t j = 0; j < f->n; j++)
            m.energy += a->middle[i] * f->A[(size_t)i + (size_t)f->n * (size_t)j] * a->middle[j];
    }
    return m;
}

static int32_t is_better(const merit *a, const merit *b)
{
    if (a->unstable != b->unstable)
        return a->unstable < b->unstable;
    if (a->signs != b->signs)
        return a->signs < b->signs;
    if (a->starts != b->starts)
        return a->starts < b->starts;
    return a->energy < b->energy;
}

static const perp__answer *choose(const perp_load_friction *f, perp_load_step *own,
                                  const double *previous)
{
    const double divide = find_divide(f);
    const perp__answer *a, *best = NULL;
    merit least = {0, 0, 0, 0.0};
    int32_t index = 0;

    for (a = f->answers.first; a; a = a->next, index++) {
        const merit m = judge(f, a, divide, previous);

        if (!best || is_better(&m, &least)) {
            best = a;
            least = m;
            own->chosen = index;
        }
    }
    return best;
}

/* ---- the call ------------------------------------------------------------------------------ */

static perp_status run(perp_load_friction *f, double *next, double *normal, perp_load_step *own,
                       const double *velocity, const double *previous, double h)
{
    const perp__answer *taken;
    perp_load_summary summary;
    perp_status status = find_regular_stops(f, own, velocity, h);

    if (status != PERP_OK)
        return status;
    ask_step(f, velocity, h);
    status = perp__check_vector(f->context, "velocity / h", f->question.stop, (size_t)f->n);
    PERP__THEN(status, perp__friction_answer_all(f, &summary));
    if (status != PERP_OK)
        return status;
    own->answers = summary.count;
    own->exhaustive = summary.exhaustive;
    taken = choose(f, own, previous);
    own->stable = taken && taken->stable;
    for (int32_t i = 0; i < f->n; i++) {
        const int32_t sticks = taken && taken->pattern[i] == PERP_LOAD_STICK;

        own->stopped += sticks && velocity[i] != 0.0;
        own->jam |= sticks && velocity[i] != 0.0 && !f->regular[i];
        f->linear.x[i] = sticks ? 0.0 : taken ? velocity[i] + h * taken->middle[i] : velocity[i];
    }
    status = perp__check_finite(f->context, "next", f->linear.x, (size_t)f->n);
    for (int32_t i = 0; i < f->n && status == PERP_OK; i++) {
        next[i] = f->linear.x[i];
        if (normal)
            normal[i] = taken ? perp__friction_normal(taken)[i] : NAN;
    }
    return status;
}

static perp_status check(perp_load_friction *f, const double *next, const perp_load_step *step,
                         const double *tau, const double *velocity, const double *previous,
                         double h)
{
    perp_status status = perp__check_pointer(f->context, "next", next);

    if (status == PERP_OK && step)
        status = PERP__CHECK(perp_load_step, f->context, step);
    PERP__THEN(status, perp__check_vector(f->context, "tau", tau, (size_t)f->n));
    PERP__THEN(status, perp__check_vector(f->context, "velocity", velocity, (size_t)f->n));
    for (int32_t i = 0; i < f->n && status == PERP_OK && previous; i++)
        if (isinf(previous[i]))
            status = perp__fail(f->context, PERP_ERROR_NOT_FINITE, "previous[%d] is %g", (int)i,
                                previous[i]);
    if (status == PERP_OK && !(h > 0.0 && isfinite(h)))
        status = perp__refuse(f->context, "h is %g, expected a positive number", h);
    return status;
}

perp_status perp_load_friction_step(perp_load_friction *friction, double *next, double *normal,
                                    perp_load_step *step, const double *tau, const double *velocity,
                                    const double *previous, double h)
{
    perp_status status = perp__friction_enter(friction);
    perp_load_step own = {0};

    if (status != PERP_OK)
        return status;
    own.chosen = -1;
    status = check(friction, next, step, tau, velocity, previous, h);
    if (status == PERP_OK) {
        memcpy(friction->tau, tau, (size_t)friction->n * sizeof *tau);
        status = run(friction, next, normal, &own, velocity, previous, h);
    }
    if (status == PERP_OK && step)
        perp__struct_write(step, &own, sizeof own);
    return perp__leave(friction->context, status);
}

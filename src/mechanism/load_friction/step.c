/* A step in time over load-dependent friction: all answers of the implicit equations, and the
 * choice of one of them by stability and continuity. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/load_friction/load_friction.h"

/* The best answer by, in this order: it is stable; fewer normal forces of moving coordinates are on
 * another side than before; fewer coordinates leave rest; x'A x is less. */
static const perp__answer *choose(const perp_load_friction *f, perp_load_step *copy,
                                  const double *previous)
{
    const perp__answer *a, *best = NULL;
    double least[4] = {INFINITY, 0.0, 0.0, 0.0};
    double divide = 0.0; /* of the sides of N: for one coordinate that of the unstable answer */
    int32_t index = 0;

    for (a = f->answers.first; a && f->n == 1; a = a->next)
        if (!a->stable && a->dimension == 0)
            divide = a->extra[0];
    for (a = f->answers.first; a; a = a->next, index++) {
        const double *x = a->middle, *N = a->extra;
        double merit[4] = {!a->stable, 0.0, 0.0, 0.0};
        int32_t k = 0;

        for (int32_t i = 0; i < f->n; i++) {
            if (previous && f->question.before[i] != 0 && f->mu[i] > 0.0)
                merit[1] += (previous[i] - divide) * (N[i] - divide) < 0.0;
            merit[2] += f->question.before[i] == 0 && a->pattern[i] != PERP_LOAD_STICK;
            for (int32_t j = 0; j < f->n; j++)
                merit[3] += x[i] * f->A[(size_t)i + (size_t)f->n * (size_t)j] * x[j];
        }
        while (k < 3 && merit[k] == least[k])
            k++;
        if (!(merit[k] < least[k]))
            continue;
        best = a;
        memcpy(least, merit, sizeof least);
        copy->chosen = index;
    }
    return best;
}

static perp_status run(perp_load_friction *f, double *next, double *normal, perp_load_step *copy,
                       const double *velocity, const double *previous, double h)
{
    const perp__answer *a, *taken;
    perp_load_summary summary;
    perp_status status = perp__friction_solve(f, &summary, velocity);

    if (status != PERP_OK)
        return status;
    /* 1. what some stable acceleration of the rigid system brings to rest within h: its stop needs
     * no impulse */
    copy->accelerations = summary.count;
    memset(f->regular, 0, (size_t)f->n);
    for (a = f->answers.first; a; a = a->next)
        for (int32_t i = 0; i < f->n; i++)
            if (a->stable && velocity[i] * (velocity[i] + h * a->middle[i]) <= 0.0)
                f->regular[i] = 1;
    /* 2. every coordinate may stop, at x = -v / h, or go on in either direction */
    for (int32_t i = 0; i < f->n; i++) {
        const double v = velocity[i];

        f->question.sign[i] = 0;
        f->question.before[i] = (int8_t)((v > 0.0) - (v < 0.0));
        f->question.stop[i] = v == 0.0 ? 0.0 : -v / h;
        f->question.mu_stick[i] = v == 0.0 ? f->mu_static[i] : f->mu[i];
    }
    status = perp__check_vector(f->context, "velocity / h", f->question.stop, (size_t)f->n);
    PERP__THEN(status, perp__friction_answer_all(f, &summary));
    if (status != PERP_OK)
        return status;
    /* 3. the choice */
    copy->answers = summary.count;
    copy->exhaustive = summary.exhaustive;
    taken = choose(f, copy, previous);
    copy->stable = taken && taken->stable;
    for (int32_t i = 0; i < f->n; i++) {
        const bool sticks = taken && taken->pattern[i] == PERP_LOAD_STICK;

        copy->stopped += sticks && velocity[i] != 0.0;
        copy->jam |= sticks && velocity[i] != 0.0 && !f->regular[i];
        f->linear.x[i] = sticks ? 0.0 : taken ? velocity[i] + h * taken->middle[i] : velocity[i];
    }
    status = perp__check_finite(f->context, "next", f->linear.x, (size_t)f->n);
    for (int32_t i = 0; i < f->n && status == PERP_OK; i++) {
        next[i] = f->linear.x[i];
        if (normal)
            normal[i] = taken ? taken->extra[i] : NAN;
    }
    return status;
}

perp_status perp_load_friction_step(perp_load_friction *friction, double *next, double *normal,
                                    perp_load_step *step, const double *tau, const double *velocity,
                                    const double *previous, double h)
{
    perp_load_friction *f = friction;
    perp_load_step copy = {.chosen = -1};
    perp_status status = perp__friction_enter(f);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(f->context, "next", next);
    if (step)
        PERP__THEN(status, PERP__CHECK(perp_load_step, f->context, step));
    PERP__THEN(status, perp__check_vector(f->context, "tau", tau, (size_t)f->n));
    PERP__THEN(status, perp__check_vector(f->context, "velocity", velocity, (size_t)f->n));
    for (int32_t i = 0; i < f->n && status == PERP_OK && previous; i++)
        if (isinf(previous[i]))
            status = perp__fail(f->context, PERP_ERROR_NOT_FINITE, "previous[%d] is %g", (int)i,
                                previous[i]);
    if (status == PERP_OK && !(h > 0.0 && isfinite(h)))
        status = perp__refuse(f->context, "h is %g, expected a positive number", h);
    if (status == PERP_OK) {
        memcpy(f->tau, tau, (size_t)f->n * sizeof *tau);
        status = run(f, next, normal, &copy, velocity, previous, h);
    }
    if (status == PERP_OK && step)
        perp__struct_write(step, &copy, sizeof copy);
    return perp__leave(f->context, status);
}

/* What passes have come to: u of all rows, and the residual that contact.h calls tested, from the
 * rows as they were packed, beside what drives the impulses. No set-up, no second witness: this is
 * for what a budget ended. */
#include <math.h>

#include "base/outcome.h"
#include "contact/coloured/coloured.h"

/* The joints' equations: their velocities, which are rounding, and what they bear. */
static void measure_joints(const perp__coloured *c, perp__coloured_part *part, double share)
{
    const perp__rigid_problem *problem = part->problem;
    const perp__joint_block *b = &c->joints;
    int32_t n = 0;

    if (b->rows > 0 && !b->factored)
        part->residual = INFINITY;
    for (int32_t k = problem->contacts; k < problem->contacts + problem->joints; k++)
        for (int32_t i = 0; i < problem->rows[k].dim; i++, n++) {
            double u = b->w[n], q = b->w[n], size = fabs(q);

            for (int32_t side = 0; side < 2; side++)
                for (int32_t j = 0; j < 6 && b->body[2 * n + side] >= 0; j++) {
                    const double P = b->P[16 * n + 8 * side + j];
                    const int32_t at = 8 * b->body[2 * n + side] + j;

                    u += P * c->y[at];
                    q += P * c->free[at];
                    size += fabs(P * c->free[at]);
                }
            part->answer->velocity[3 * k + i] = u;
            perp__raise_to(&part->drive, fmax(fabs(q), share * size) * b->scale[n]);
            perp__raise_to(&part->residual, fabs(u) * b->scale[n]);
        }
}

/* Whether the passes go on, whatever else is measured. */
static bool is_over(const perp__coloured_part *part)
{
    return !part->ends &&
           (part->residual > part->problem->tol * part->drive || part->sinks > PERP__CLEARED_SHARE);
}

/* The contacts of a group, of parts that are not over. Returns how many of them are so then. */
static int32_t measure_group(const perp__coloured *c, int32_t g, double share)
{
    const perp__lane_group *group = &c->group[g];
    int32_t over = 0;

    for (int32_t i = 0; i < group->points && !group->rests; i++) {
        const perp__lane_point *p = &c->point[group->first + i];
        perp__lane_measure found;

        c->kernels->measure(c, group, p, share, &found);
        for (int32_t l = 0; l < group->pairs; l++) {
            perp__coloured_part *part = &c->part[c->pair_part[group->pair[l]]];
            const int32_t k = p->contact[l];
            const double guard = p->guard[l], way = part->step->h * -found.u[0][l];

            if (k < 0 || part->ended || is_over(part))
                continue;
            if (p->inverse_normal[l] == 0.0 && part->problem->rows[k].bounded) {
                /* between bounds, whose normal moves nothing: how far r is from what u asks for */
                const double t = found.trace[l], most = p->mu[l] * p->r[0][l], r = p->r[1][l];
                const double aim = fmin(fmax(r - found.u[1][l] / t, -most), most);

                found.mode[l] = fabs(aim) < most ? PERP_CONTACT_STICK : PERP_CONTACT_SLIP;
                found.natural[l] = t > 0.0 ? sqrt(t) * fabs(r - aim) : 0.0;
                found.u[0][l] = 0.0;
            }
            if (guard > 0.0 && fmax(-p->gap[l], 0.0) + way > part->step->deep * guard)
                perp__raise_to(&part->sinks, way / guard);
            for (int32_t row = 0; row < 3; row++)
                part->answer->velocity[3 * k + row] = found.u[row][l];
            part->answer->modes[k] = (int32_t)found.mode[l];
            perp__raise_to(&part->answer->drive, found.drive[l]);
            perp__raise_to(&part->residual, found.natural[l]);
            part->worst = is_over(part) ? g : part->worst;
            over += is_over(part);
        }
    }
    return over;
}

void perp__coloured_measure(const perp__coloured *c)
{
    const double share = fmin(1.0, PERP__ROUNDING_LIMIT / c->part->problem->tol);
    int32_t open = 0;

    for (int32_t k = 0; k < c->parts; k++) {
        perp__coloured_part *part = &c->part[k];

        open += !part->ended;
        if (!part->ended)
            part->answer->drive = part->residual = part->sinks = 0.0;
    }
    /* 1. What told that last tells most that the passes go on, which is all that is asked then. */
    for (int32_t k = 0; k < c->parts && open > 0; k++)
        if (!c->part[k].ended && c->part[k].worst >= 0)
            open -= measure_group(c, c->part[k].worst, share);
    for (int32_t g = 0; g < c->groups && open > 0; g++)
        open -= measure_group(c, g, share);
    /* 2. The answers. */
    for (int32_t k = 0; k < c->parts; k++) {
        perp__coloured_part *part = &c->part[k];

        if (part->ended)
            continue;
        if (!is_over(part))
            part->drive = part->answer->drive;
        measure_joints(c, part, share);
        part->answer->tested = part->residual == 0.0 ? 0.0 : part->residual / part->drive;
        part->answer->drive = part->drive;
    }
}

/* What passes have come to: u of all rows, and the residual that contact.h calls tested, from the
 * rows as they were packed, beside what drives the impulses. No set-up, no second witness: this is
 * for what a budget ended. */
#include <math.h>

#include "base/outcome.h"
#include "contact/coloured/coloured.h"

/* A row between two bounds: its distance from the impulse that its velocity asks for. */
static void measure_bounded(const perp__rigid_rows *rows, const double *r, double *u, double t,
                            double *natural, int32_t *mode)
{
    const double most = rows->mu * r[0], aim = fmin(fmax(r[1] - u[1] / t, -most), most);

    *mode = fabs(aim) < most ? PERP_CONTACT_STICK : PERP_CONTACT_SLIP;
    *natural = t > 0.0 ? sqrt(t) * fabs(r[1] - aim) : 0.0;
    u[0] = 0.0;
}

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

static void raise_sinking(perp__coloured_part *part, const perp__lane_point *p, int32_t l,
                          double speed)
{
    const double guard = p->guard[l], way = part->step->h * speed;

    if (guard > 0.0 && fmax(-p->gap[l], 0.0) + way > part->step->deep * guard)
        perp__raise_to(&part->sinks, way / guard);
}

void perp__coloured_measure(const perp__coloured *c)
{
    const double share = fmin(1.0, PERP__ROUNDING_LIMIT / c->part->problem->tol);

    for (int32_t k = 0; k < c->parts; k++)
        c->part[k].drive = c->part[k].residual = c->part[k].sinks = 0.0;
    for (int32_t g = 0; g < c->groups; g++)
        for (int32_t i = 0; i < c->group[g].points && !c->group[g].rests; i++) {
            const perp__lane_point *p = &c->point[c->group[g].first + i];
            perp__lane_measure found;

            c->kernels->measure(c, &c->group[g], p, share, &found);
            for (int32_t l = 0; l < c->group[g].pairs; l++) {
                perp__coloured_part *part = &c->part[c->pair_part[c->group[g].pair[l]]];
                const perp__rigid_problem *problem = part->problem;
                perp__rigid_answer *answer = part->answer;
                const int32_t k = p->contact[l];

                if (k < 0 || part->ended)
                    continue;
                for (int32_t row = 0; row < 3; row++)
                    answer->velocity[3 * k + row] = found.u[row][l];
                answer->modes[k] = (int32_t)found.mode[l];
                if (problem->rows[k].bounded)
                    measure_bounded(&problem->rows[k], answer->impulse + 3 * k,
                                    answer->velocity + 3 * k, found.trace[l], &found.natural[l],
                                    &answer->modes[k]);
                raise_sinking(part, p, l, -found.u[0][l]);
                perp__raise_to(&part->drive, found.drive[l]);
                perp__raise_to(&part->residual, found.natural[l]);
            }
        }
    for (int32_t k = 0; k < c->parts; k++) {
        perp__coloured_part *part = &c->part[k];
        perp__rigid_answer *answer = part->answer;

        if (part->ended)
            continue;
        measure_joints(c, part, share);
        answer->tested = part->residual > 0.0 ? part->residual / part->drive : 0.0;
        answer->drive = part->drive;
    }
}

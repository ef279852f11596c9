/* What passes have come to: u of all rows, and the residual that contact.h calls tested, from the
 * rows as they were packed, beside what drives the impulses. No set-up, no second witness: this is
 * for what a budget ended. */
#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "contact/coloured/coloured.h"
#include "contact/law.h"
#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/spatial.h"

/* What rows of a point are, all of its lanes side by side: u, the free q, the sizes of q's terms,
 * and the trace of P P'. */
typedef struct lane_rows {
    double u[3][PERP__GROUP], q[3][PERP__GROUP], sizes[3][PERP__GROUP], trace[PERP__GROUP];
} lane_rows;

/* Number k of y of A's and B's bodies in four lanes from `at` on. */
#define BODY_LANES(y, bodies, at, k)                                                 \
    ((perp__lanes){(y)[8 * (bodies)[(at)] + (k)], (y)[8 * (bodies)[(at) + 1] + (k)], \
                   (y)[8 * (bodies)[(at) + 2] + (k)], (y)[8 * (bodies)[(at) + 3] + (k)]})

PERP__MULTIVERSION(find_rows,
                   (const perp__coloured *c, const perp__lane_group *group,
                    const perp__lane_point *p, lane_rows *rows),
                   (c, group, p, rows))
{
    for (int32_t at = 0; at < group->pairs; at += 4) {
        perp__lanes y[12], free[12], trace = PERP__SAME_LANES(0.0);

        for (int32_t k = 0; k < 12; k++) {
            const int32_t *bodies = k < 6 ? group->a : group->b;

            y[k] = BODY_LANES(c->y, bodies, at, k % 6);
            free[k] = BODY_LANES(c->free, bodies, at, k % 6);
        }
        for (int32_t i = 0; i < 3; i++) {
            const double *w = (i == 0 ? p->bias : p->w[i]) + at;
            perp__lanes u = PERP__CONST_LANES_AT(w), q = u, sizes = PERP__ABSOLUTE_LANES(u);

            for (int32_t k = 0; k < 12; k++) {
                const perp__lanes P = PERP__CONST_LANES_AT(p->P[12 * i + k] + at);
                const perp__lanes term = P * free[k];

                u += P * y[k];
                q += term;
                sizes += PERP__ABSOLUTE_LANES(term);
                trace += P * P;
            }
            PERP__LANES_AT(rows->u[i] + at) = u;
            PERP__LANES_AT(rows->q[i] + at) = q;
            PERP__LANES_AT(rows->sizes[i] + at) = sizes;
        }
        PERP__LANES_AT(rows->trace + at) = trace;
    }
}

/* u and modes of the contact in a lane; raises *drive to its |q| / sqrt(t), of whose terms `share`
 * is granted for their roundings (evaluation.c), and *residual to sqrt(t) times its natural one. A
 * gap that nothing closes is no velocity, however short the step: it drives nothing. Nor does a
 * slip drive more than friction can do about it: that is mu times what presses, however fast it is.
 */
static void measure_lane(const perp__lane_point *p, const lane_rows *lanes, int32_t l,
                         const perp__rigid_rows *rows, perp__rigid_answer *answer, double share,
                         double *drive, double *residual)
{
    const int32_t k = p->contact[l];
    const double t = lanes->trace[l];
    double *r = answer->impulse + 3 * k, *u = answer->velocity + 3 * k;
    double driven = 0.0, natural;

    for (int32_t i = 0; i < 3; i++)
        u[i] = lanes->u[i][l];
    for (int32_t i = rows->bounded; i < rows->dim; i++) {
        const double q = lanes->q[i][l], apart = i == 0 ? p->bias[l] - p->w[0][l] : 0.0;
        const double closing = q > 0.0 ? fmin(q, fabs(q - apart)) : -q;
        const double most = i == 0 || rows->bounded ? INFINITY : t * rows->mu * r[0];
        const double speed = fmin(closing, most);

        driven = perp__length2(driven, fmax(speed, share * lanes->sizes[i][l]));
    }
    if (rows->bounded) {
        /* between two bounds: its distance from the impulse that its velocity asks for */
        const double most = rows->mu * r[0], aim = fmin(fmax(r[1] - u[1] / t, -most), most);

        answer->modes[k] = fabs(aim) < most ? PERP_CONTACT_STICK : PERP_CONTACT_SLIP;
        natural = fabs(r[1] - aim);
        u[0] = 0.0;
    } else {
        natural = perp__contact_natural_of(rows->mu, rows->dim - 1, t, r, u, &answer->modes[k]);
        if (r[0] == 0.0)
            answer->modes[k] = PERP_CONTACT_SEPARATE;
        else if (answer->modes[k] == PERP_CONTACT_SEPARATE)
            answer->modes[k] = PERP_CONTACT_SLIP;
    }
    if (t > 0.0) {
        perp__raise_to(drive, driven / sqrt(t));
        perp__raise_to(residual, sqrt(t) * natural);
    }
}

void perp__coloured_measure(const perp__coloured *c, perp__rigid_answer *answer,
                            const perp__rigid_problem *problem)
{
    const double share = fmin(1.0, PERP__ROUNDING_LIMIT / problem->tol);
    const perp__joint_block *b = &c->joints;
    double drive = 0.0, residual = 0.0;
    int32_t n = 0;

    for (int32_t g = 0; g < c->groups; g++)
        for (int32_t k = 0; k < c->group[g].points; k++) {
            const perp__lane_point *p = &c->point[c->group[g].first + k];
            lane_rows rows;

            find_rows(c, &c->group[g], p, &rows);
            for (int32_t l = 0; l < c->group[g].pairs; l++)
                if (p->contact[l] >= 0)
                    measure_lane(p, &rows, l, &problem->rows[p->contact[l]], answer, share, &drive,
                                 &residual);
        }
    /* the same of the joints' equations: their velocities, which are rounding, and what they bear
     */
    answer->joints = b->rows > 0 && !b->factored ? INFINITY : 0.0;
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
            answer->velocity[3 * k + i] = u;
            perp__raise_to(&drive, fmax(fabs(q), share * size) * b->scale[n]);
            perp__raise_to(&answer->joints, fabs(u) * b->scale[n]);
        }
    perp__raise_to(&residual, answer->joints);
    answer->tested = residual > 0.0 ? residual / drive : 0.0;
    answer->joints = answer->joints > 0.0 ? answer->joints / drive : 0.0;
    answer->own = answer->tested;
    answer->backward = 1.0;
    answer->held = 0;
    answer->method = PERP_CONTACT_METHOD_SWEEP;
    answer->certificate = PERP_CONTACT_CERTIFICATE_NONE;
}

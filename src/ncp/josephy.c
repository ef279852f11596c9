/* Josephy-Newton: z_N solves the linear complementarity problem of the linearisation at z (Josephy,
 * "Newton's method for generalized equations", 1979), by the front door of perp/lcp.h; then a step
 * towards it. Full steps are taken on trust for a while, and taken back where Psi has not fallen by
 * then (the watchdog of Chamberlain, Powell, Lemarechal & Pedersen 1982, as in Dirkse & Ferris,
 * "The PATH solver", 1995). Where the linear problem has no solution, rho (z - z_k) is added. */
#include <math.h>

#include "base/clock.h"
#include "base/context.h"
#include "base/outcome.h"
#include "lcp/lcp.h"
#include "linalg/sparse_block.h"
#include "ncp/newton.h"

/* Iterations of a linear problem with so many rows where trust has led away. */
enum { AWAY = 25, CLOSE = 32 };

/* rho, until the linear problem has a solution; S has a unit diagonal */
enum { TRIALS = 6 };
static const double proximal[TRIALS] = {0.0, 1e-3, 1e-1, 1.0, 10.0, 1e3};

/* l->z := the solution of the linearisation with rho. 1 if it has one, 0 if not. */
static perp_status solve_linear(perp__ncp_linear *l, double rho, bool is_away)
{
    perp__ncp_run *r = l->run;
    perp__newton *f = &r->newton;
    const perp__ncp_model *m = r->model;
    perp_lcp_settings settings;
    perp_lcp_result result;
    perp_matrix M = perp__view(PERP_STORAGE_COLUMN_MAJOR, m->n, m->n, r->H);
    perp_status status = perp_struct_init(&result, sizeof result);

    /* 1. S + rho I, and q := w - (S + rho I) z; neither may overflow. */
    for (int32_t i = 0; i < m->n; i++) {
        f->slope_z[i] = 0.0;
        f->slope_w[i] = 1.0;
        f->part[i] = -f->z[i];
        l->q[i] = f->w[i] - r->signs[i] * rho * f->z[i];
    }
    perp__ncp_fill(r, rho);
    perp__multiply_add(&f->S, f->part, l->q);
    if (!perp__all_finite(l->q, (size_t)m->n) || !perp__all_finite(r->H, m->entries))
        return 0;
    if (status == PERP_OK && m->sparse)
        status = perp_matrix_csc(&M, m->n, m->n, m->starts, m->rows, r->H);
    /* 2. The time that is left is the linear problem's, too; none may be left over from the last
     * solve. Iterations are few where there is a point to go back to: obstacles take ten, pivots
     * from a basis nearby a few for each that is not the solution's (one in CLOSE is near), and
     * where pivoting would have to solve a large problem it may have no solution. */
    PERP__THEN(status, perp_lcp_settings_init(&settings, sizeof settings));
    if (status == PERP_OK && m->control.deadline > 0.0)
        settings.time_limit = fmax(1e-6, m->control.deadline - perp__now());
    if (status == PERP_OK && is_away && m->sparse && m->n >= PERP__LARGE_MATRIX)
        settings.max_iterations = AWAY + m->n / CLOSE;
    PERP__THEN(status, perp__lcp_set(l->lcp, &settings));
    /* 3. The solve. */
    PERP__THEN(status, perp__lcp_setup(l->lcp, &M, m->low, m->high));
    PERP__THEN(status, perp__lcp_solve(l->lcp, l->z, NULL, NULL, &result, l->q, f->z));
    return status == PERP_OK ? perp__is_good(result.outcome) : status;
}

/* Back to the point kept, and from there a step that is checked. */
static perp_status go_back(perp__newton *f, perp__ncp_linear *l)
{
    perp_status status;

    perp__copy(f->z, l->kept_z, f->n);
    perp__copy(f->d, l->kept_d, f->n);
    status = perp__newton_set_point(f);
    f->steps = 0;
    perp__ncp_sharpen(l->run->model);
    l->since = -1; /* the next point is kept */
    if (status == PERP_OK)
        status = perp__newton_search(f, f->psi, -2.0 * f->psi, NULL, PERP__HALVINGS);
    else if (status > 0)
        return 0;
    if (status != 0)
        return status;
    status = perp__ncp_update_jacobian(l->run);
    if (status != PERP_OK)
        return status < 0 ? status : 0;
    return perp__newton_descend(f);
}

/* 1 if it moved, 0 if not, or a negative status. */
static perp_status step(perp__newton *f, void *user)
{
    perp__ncp_linear *l = user;
    const bool is_away = l->since > 0 && f->psi > PERP__PROGRESS * l->kept_psi;
    const int32_t trials = is_away ? 1 : TRIALS;
    perp_status moved = 0;

    /* d := z_N - z. Where trust led away from what is kept no linear problem is worth forcing. */
    for (int32_t k = 0; k < trials && moved == 0 && !perp__ncp_is_late(l->run->model); k++)
        moved = solve_linear(l, proximal[k], is_away);
    if (moved < 0)
        return moved;
    for (int32_t i = 0; i < f->n && moved == 1; i++)
        f->d[i] = l->z[i] - f->z[i];
    if (moved == 0 && is_away)
        return go_back(f, l);
    if (moved == 0) {
        l->since = -1;
        return perp__newton_descend(f);
    }
    if (l->since < 0 || f->psi <= PERP__PROGRESS * l->kept_psi) {
        perp__copy(l->kept_z, f->z, f->n);
        perp__copy(l->kept_d, f->d, f->n);
        l->kept_psi = f->psi;
        l->since = 0;
    } else if (l->since >= PERP__WATCH || f->psi > PERP__WATCH_GROWTH * l->kept_psi) {
        return go_back(f, l);
    }
    l->since++;
    moved = perp__newton_search(f, INFINITY, 0.0, NULL, 0);
    if (moved != 0)
        return moved;
    return perp__newton_search(f, perp__newton_reference(f), -2.0 * f->psi, NULL, PERP__HALVINGS);
}

perp_status perp__ncp_josephy(perp__ncp_run *r, perp__ncp_linear *l)
{
    const perp_status status =
        l->lcp ? PERP_OK : perp__lcp_create(r->model->context, &l->lcp, NULL);

    l->run = r;
    l->since = -1;
    return status == PERP_OK ? perp__newton_iterate(&r->newton, step, l) : status;
}

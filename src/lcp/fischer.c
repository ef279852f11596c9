/* Semismooth Newton on the Fischer-Burmeister function: De Luca, Facchinei & Kanzow, "A semismooth
 * equation approach to the solution of nonlinear complementarity problems", Math. Programming 75
 * (1996) 407, with the bounds of Billups' thesis (1995). In their notation, for F(z) = S z + q:
 *
 *   Phi_i(z) = phi of row i,  Psi = 1/2 |Phi|^2,  H = D_z + D_w S in the B-subdifferential of Phi,
 *   grad Psi = H' Phi;  d from H d = -Phi, else -grad Psi;  z := z + t d with Psi falling.
 *
 * What differs: phi has the opposite sign; the line search is nonmonotone (Grippo, Lampariello &
 * Lucidi 1986); before the gradient, the proximal matrix S + rho I is tried; the first point comes
 * from a few projected Jacobi steps. A descent method on Psi may end in a local minimum that solves
 * nothing (Billups): that is outcome 'stalled'. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/fischer_function.h"
#include "lcp/fischer_matrix.h"
#include "lcp/method.h"

#define ITERATIONS 500 /* default limit */
#define MEMORY 8       /* values of Psi that the line search looks back on */
#define ARMIJO 1e-4    /* beta */
#define HALVINGS 40    /* t >= 2^-40 */
#define DESCENT 1e-8   /* rho and p of the test grad Psi' d <= -rho |d|^p */
#define POWER 2.1
#define AIM 0.1     /* goes on to tol * AIM while it can: the next step is cheap or the last */
#define PATIENCE 30 /* iterations without progress, see is_stuck */
#define ATTEMPTS 4

/* Before attempt 0, 1, ... from a cold start and from a warm one: different starts end in different
 * local minima of Psi, and 20 steps save two to four iterations on most problems. */
static const int32_t jacobi_steps[2][ATTEMPTS] = {{20, 0, 5, 60}, {0, 20, 5, 60}};

/* rho, one after the other until a direction serves. */
static const double proximal[] = {0.0, 1e-12, 1e-9, 1e-6, 1e-3};

typedef struct fischer_work {
    perp__lcp_work common;
    perp__fischer_matrix S;
    double *w, *phi;           /* F and Phi at z */
    double *slope_z, *slope_w; /* diagonals of H */
    double *gradient, *d;      /* H' Phi; the direction */
    double *trial_z, *trial_w, *trial_phi;
    double *kink_z, *kink_w; /* direction in which slopes at kinks are taken, and S times it */
    double *best;            /* within the bounds, the smallest natural residual so far */
    double best_residual;
} fischer_work;

static perp_status check(const perp__lcp_problem *problem)
{
    (void)problem;
    return PERP_OK;
}

static void layout(perp__arena *arena, void *object)
{
    fischer_work *work = object;
    size_t n = (size_t)work->common.problem->n;

    perp__fischer_matrix_layout(arena, &work->S, work->common.problem);
    work->w = perp__arena_take(arena, n, sizeof(double));
    work->phi = perp__arena_take(arena, n, sizeof(double));
    work->slope_z = perp__arena_take(arena, n, sizeof(double));
    work->slope_w = perp__arena_take(arena, n, sizeof(double));
    work->gradient = perp__arena_take(arena, n, sizeof(double));
    work->d = perp__arena_take(arena, n, sizeof(double));
    work->trial_z = perp__arena_take(arena, n, sizeof(double));
    work->trial_w = perp__arena_take(arena, n, sizeof(double));
    work->trial_phi = perp__arena_take(arena, n, sizeof(double));
    work->kink_z = perp__arena_take(arena, n, sizeof(double));
    work->kink_w = perp__arena_take(arena, n, sizeof(double));
    work->best = perp__arena_take(arena, n, sizeof(double));
}

static double dot(int32_t n, const double *x, const double *y)
{
    double sum = 0.0;

    for (int32_t i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

/* w = F(z) */
static void multiply(const fischer_work *work, const double *z, double *w)
{
    const perp__lcp_problem *problem = work->common.problem;

    perp__multiply(&work->S.S, z, w);
    for (int32_t i = 0; i < problem->n; i++)
        w[i] += problem->q[i];
}

/* w = F(z), phi = Phi(z); returns Psi(z). */
static double evaluate(const fischer_work *work, const double *z, double *w, double *phi)
{
    const perp__lcp_problem *problem = work->common.problem;

    multiply(work, z, w);
    for (int32_t i = 0; i < problem->n; i++)
        phi[i] = perp__fischer_bounded(z[i], problem->lower[i], problem->upper[i], w[i]);
    return 0.5 * dot(problem->n, phi, phi);
}

/* max |mid(z - l, z - u, w)| after projecting z; keeps the projected z if it is the best so far.
 * Overwrites trial_z and trial_w. */
static double judge(fischer_work *work, const double *z)
{
    const perp__lcp_problem *problem = work->common.problem;
    double residual = 0.0;

    for (int32_t i = 0; i < problem->n; i++)
        work->trial_z[i] = perp__clamp(z[i], problem->lower[i], problem->upper[i]);
    multiply(work, work->trial_z, work->trial_w);
    for (int32_t i = 0; i < problem->n; i++) {
        double r = fabs(
            perp__mid(work->trial_z[i], problem->lower[i], problem->upper[i], work->trial_w[i]));

        if (!(r <= residual) && !isnan(residual)) /* NaN stays */
            residual = r;
    }
    if (residual < work->best_residual) {
        work->best_residual = residual;
        memcpy(work->best, work->trial_z, (size_t)problem->n * sizeof(double));
    }
    return residual;
}

/* Projected Jacobi, z := mid(l, u, z - w_i / |S_i|_1): a guess at which bounds are active, safe for
 * any S since only the best point met is kept. */
static void find_start(fischer_work *work, double *z, int32_t steps)
{
    const perp__lcp_problem *problem = work->common.problem;

    judge(work, z);
    for (int32_t step = 0; step < steps; step++) {
        multiply(work, z, work->w);
        for (int32_t i = 0; i < problem->n; i++) {
            double s = problem->row_norms[i] > 0.0 ? problem->row_norms[i] : 1.0;

            z[i] = perp__clamp(z[i] - work->w[i] / s, problem->lower[i], problem->upper[i]);
        }
        judge(work, z);
    }
    memcpy(z, work->best, (size_t)problem->n * sizeof(double));
}

/* D_z and D_w. At kinks the direction is 1 in every variable at a kink (DFK, section 7). */
static void find_slopes(fischer_work *work, const double *z)
{
    const perp__lcp_problem *p = work->common.problem;
    int32_t kinks = 0;

    for (int32_t i = 0; i < p->n; i++) {
        work->kink_z[i] =
            perp__fischer_at_kink(z[i], p->lower[i], p->upper[i], work->w[i]) ? 1.0 : 0.0;
        kinks += work->kink_z[i] != 0.0;
    }
    if (kinks > 0)
        perp__multiply(&work->S.S, work->kink_z, work->kink_w);
    for (int32_t i = 0; i < p->n; i++) {
        perp__slopes slopes =
            perp__fischer_bounded_slopes(z[i], p->lower[i], p->upper[i], work->w[i],
                                         work->kink_z[i], kinks > 0 ? work->kink_w[i] : 0.0);

        work->slope_z[i] = slopes.z;
        work->slope_w[i] = slopes.w;
    }
}

/* gradient = H' Phi, but 0 for fixed variables, which do not move. */
static void find_gradient(fischer_work *work)
{
    const perp__lcp_problem *problem = work->common.problem;

    for (int32_t i = 0; i < problem->n; i++)
        work->d[i] = work->slope_w[i] * work->phi[i];
    perp__fischer_matrix_transposed(&work->S, work->d, work->gradient);
    for (int32_t i = 0; i < problem->n; i++) {
        work->gradient[i] += work->slope_z[i] * work->phi[i];
        if (!(problem->lower[i] < problem->upper[i]))
            work->gradient[i] = 0.0;
    }
}

/* Solves for d with S + rho I. Returns 1 if d is a direction of sufficient descent, 0 if not, or
 * PERP_ERROR_MEMORY. */
static perp_status newton_direction(fischer_work *work, double rho, double *slope)
{
    const int32_t n = work->common.problem->n;
    perp_status status = perp__fischer_matrix_factor(&work->S, work->slope_z, work->slope_w, rho);
    double length;

    if (status != PERP_OK)
        return status < 0 ? status : 0;
    for (int32_t i = 0; i < n; i++)
        work->d[i] = -work->phi[i];
    perp__fischer_matrix_solve(&work->S, work->d);
    *slope = dot(n, work->gradient, work->d);
    length = sqrt(dot(n, work->d, work->d));
    return *slope <= -DESCENT * pow(length, POWER) ? 1 : 0;
}

/* d = -t grad Psi with the t that minimises |Phi + H d|. */
static void gradient_direction(fischer_work *work, double *slope)
{
    const int32_t n = work->common.problem->n;
    double square = dot(n, work->gradient, work->gradient);
    double image = 0.0;

    perp__multiply(&work->S.S, work->gradient, work->trial_w);
    for (int32_t i = 0; i < n; i++) {
        double r = work->slope_z[i] * work->gradient[i] + work->slope_w[i] * work->trial_w[i];

        image += r * r;
    }
    for (int32_t i = 0; i < n; i++)
        work->d[i] = -(square / image) * work->gradient[i];
    *slope = -square * (square / image);
}

/* Moves z, w, phi and Psi along d; returns 0 if no t gives enough descent. */
static int32_t line_search(fischer_work *work, double *z, double *psi, double slope,
                           double reference)
{
    const int32_t n = work->common.problem->n;
    size_t size = (size_t)n * sizeof(double);
    double t = 1.0;

    for (int32_t halving = 0; halving <= HALVINGS; halving++, t *= 0.5) {
        double trial;

        for (int32_t i = 0; i < n; i++)
            work->trial_z[i] = z[i] + t * work->d[i];
        trial = evaluate(work, work->trial_z, work->trial_w, work->trial_phi);
        if (trial <= reference + ARMIJO * t * slope) {
            memcpy(z, work->trial_z, size);
            memcpy(work->w, work->trial_w, size);
            memcpy(work->phi, work->trial_phi, size);
            *psi = trial;
            return 1;
        }
    }
    return 0;
}

/* One iteration. Returns 1 if z moved, 0 if nothing more can be done, or PERP_ERROR_MEMORY. */
static perp_status iteration(fischer_work *work, double *z, double *psi, double reference)
{
    double slope = 0.0;

    find_slopes(work, z);
    find_gradient(work);
    for (size_t k = 0; k < sizeof proximal / sizeof proximal[0]; k++) {
        perp_status found = newton_direction(work, proximal[k], &slope);

        if (found < 0)
            return found;
        if (found && line_search(work, z, psi, slope, reference))
            return 1;
    }
    find_gradient(work);
    gradient_direction(work, &slope);
    return slope < 0.0 && line_search(work, z, psi, slope, reference);
}

/* The largest of the last MEMORY values of Psi. */
static double largest(const double *recent, int64_t count)
{
    double most = 0.0;

    for (int64_t k = 0; k < MEMORY && k < count; k++)
        most = recent[k] > most ? recent[k] : most;
    return most;
}

/* Neither the residual nor Psi has fallen by a quarter for PATIENCE iterations. */
typedef struct milestone {
    double residual, psi;
    int64_t iteration;
} milestone;

static int32_t is_stuck(milestone *last, double residual, double psi, int64_t k)
{
    if (residual < 0.75 * last->residual || psi < 0.75 * last->psi) {
        last->residual = residual;
        last->psi = psi;
        last->iteration = k;
    }
    return k - last->iteration > PATIENCE;
}

static perp_status run(fischer_work *work, double *z, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *problem = work->common.problem;
    int64_t limit = problem->iteration_limit > 0 ? problem->iteration_limit : ITERATIONS;
    double goal = AIM * problem->settings->tol;
    double recent[MEMORY];
    double psi = evaluate(work, z, work->w, work->phi);
    milestone last = {INFINITY, INFINITY, 0};

    iterate->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    for (int64_t k = 0; k < limit && work->best_residual > goal; k++) {
        perp_status moved;
        perp_outcome request;

        recent[k % MEMORY] = psi;
        moved = iteration(work, z, &psi, largest(recent, k + 1));
        if (moved < 0)
            return moved;
        iterate->iterations = k + 1;
        judge(work, z);
        if (!moved || is_stuck(&last, work->best_residual, psi, k)) {
            iterate->outcome = PERP_OUTCOME_STALLED;
            break;
        }
        request = perp__lcp_tick(problem->control, k + 1, work->best_residual);
        if (request >= 0) {
            iterate->outcome = request;
            break;
        }
    }
    if (work->best_residual <= problem->settings->tol)
        iterate->outcome = PERP_OUTCOME_SOLVED;
    return PERP_OK;
}

static perp_status solve(void *object, perp__lcp_iterate *iterate)
{
    fischer_work *work = object;
    const perp__lcp_problem *problem = work->common.problem;
    size_t size = (size_t)problem->n * sizeof(double);
    perp_status status = perp__fischer_matrix_read(&work->S, problem);

    if (status != PERP_OK)
        return status;
    work->best_residual = INFINITY;
    memcpy(work->best, iterate->z, size);
    find_start(work, iterate->z, jacobi_steps[iterate->warm ? 1 : 0][iterate->attempt]);
    status = run(work, iterate->z, iterate);
    memcpy(iterate->z, work->best, size);
    iterate->has_places = 0;
    return status;
}

static void release(void *object)
{
    fischer_work *work = object;

    perp__fischer_matrix_release(&work->S);
}

const perp__lcp_method perp__lcp_fischer = {
    PERP_LCP_FISCHER, sizeof(fischer_work), ATTEMPTS, NULL, check, layout, solve, release,
};

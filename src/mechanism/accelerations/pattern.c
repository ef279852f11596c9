/* Within a pattern the forces are the solution of a linear system. Unknowns: the normal force of a
 * contact that presses, with it the friction -mu way of one that slips; tangential forces of what
 * sticks; bilateral forces. Equations: the accelerations of the same rows are 0. */
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"

/* A pivot below this, beside the largest entry of the equilibrated system, is 0. */
#define SINGULAR PERP__FOUND_SINGULAR

int32_t perp__found_choices(const perp__acceleration *a, const perp__unit *unit)
{
    const int32_t ways = unit->tangents == 2 ? a->m->settings.directions : 2;
    const int32_t separate = unit->dry ? 0 : 1;

    if (unit->moves || !unit->friction)
        return separate + 1;
    return separate + 1 + ways;
}

/* Choices of a contact: to separate, to stick, to slip; in motion and without friction the second
 * is to slip. Groups of dry friction don't separate. */
void perp__found_choose(perp__acceleration *a, int32_t index, int32_t choice)
{
    const perp__unit *unit = a->unit + index;
    const int32_t press = choice - (unit->dry ? 0 : 1);
    int8_t *mode = a->pattern.mode + index;
    double *way = a->pattern.way + 2 * (size_t)index;

    way[0] = way[1] = 0.0;
    *mode = (int8_t)(press < 0 ? PERP_MECHANISM_SEPARATE : PERP_MECHANISM_SLIP);
    if (press < 0 || !unit->friction)
        return;
    if (unit->moves) {
        way[0] = unit->way[0];
        way[1] = unit->way[1];
    } else if (press == 0) {
        *mode = PERP_MECHANISM_STICK;
    } else if (unit->tangents == 1) {
        way[0] = press == 1 ? 1.0 : -1.0;
    } else {
        const double angle = 2.0 * 3.14159265358979323846 * (press - 1) / a->m->settings.directions;

        way[0] = cos(angle);
        way[1] = sin(angle);
    }
}

int32_t perp__found_starts(const perp__unit *unit, int32_t mode)
{
    return mode == PERP_MECHANISM_SLIP && unit->friction && !unit->moves;
}

int32_t perp__found_presses(const perp__unit *unit, int32_t mode)
{
    return !unit->dry && mode != PERP_MECHANISM_SEPARATE;
}

void perp__found_row_accelerations(const perp__acceleration *a, double *u, double *size,
                                   const double *f, int32_t homogeneous)
{
    const size_t active = (size_t)a->active;
    size_t i, j;

    for (i = 0; i < active; i++) {
        double sum = homogeneous ? 0.0 : a->beta[i], terms = homogeneous ? 0.0 : a->load[i];

        for (j = 0; j < active; j++) {
            const double term = a->W[i * active + j] * f[j];

            sum += term;
            terms += fabs(term);
        }
        u[i] = sum;
        if (size)
            size[i] = terms;
    }
}

/* ---- the system ---------------------------------------------------------------------------- */

static void add_column(perp__acceleration *a, int32_t row, int32_t count, double first,
                       double second, double third)
{
    const int32_t c = a->system.n++;
    double *coefficient = a->coefficient + 3 * (size_t)c;

    a->first[c] = row;
    a->count[c] = count;
    coefficient[0] = first;
    coefficient[1] = second;
    coefficient[2] = third;
}

static void add_unit(perp__acceleration *a, int32_t index)
{
    const perp__unit *unit = a->unit + index;
    const int32_t mode = a->pattern.mode[index], sticks = mode == PERP_MECHANISM_STICK;
    const double *way = a->pattern.way + 2 * (size_t)index;
    int32_t i;

    if (unit->dry) {
        for (i = 0; i < unit->tangents; i++)
            if (sticks)
                add_column(a, unit->row + i, 1, 1.0, 0.0, 0.0);
            else
                a->known[unit->row + i] = -unit->bound * way[i];
    } else if (mode != PERP_MECHANISM_SEPARATE) {
        if (sticks)
            add_column(a, unit->row, 1, 1.0, 0.0, 0.0);
        else
            add_column(a, unit->row, 1 + unit->tangents, 1.0, -unit->mu * way[0],
                       -unit->mu * way[1]);
        for (i = 1; i <= unit->tangents && sticks; i++)
            add_column(a, unit->row + i, 1, 1.0, 0.0, 0.0);
    }
}

static void list_columns(perp__acceleration *a)
{
    int32_t index, row;

    a->system.n = 0;
    memset(a->known, 0, (size_t)a->active * sizeof *a->known);
    for (index = 0; index < a->closed; index++)
        add_unit(a, index);
    for (row = 0; row < a->m->bilateral; row++)
        add_column(a, a->bilateral_row + row, 1, 1.0, 0.0, 0.0);
    for (index = a->closed; index < a->units; index++)
        add_unit(a, index);
}

/* The equilibrated matrix; returns its largest entry, without cancellation. */
static double load_matrix(perp__acceleration *a)
{
    const int32_t n = a->system.n;
    double top = 0.0;
    int32_t r, c, i;

    for (r = 0; r < n; r++) {
        const double *W = a->W + (size_t)a->first[r] * (size_t)a->active;

        for (c = 0; c < n; c++) {
            const double unit = a->scale[a->first[r]] * a->scale[a->first[c]];
            double sum = 0.0, size = 0.0;

            for (i = 0; i < a->count[c]; i++) {
                const double term = W[a->first[c] + i] * a->coefficient[3 * (size_t)c + (size_t)i];

                sum += term;
                size += fabs(term);
            }
            a->system.K[(size_t)r * (size_t)n + (size_t)c] = sum * unit;
            top = fmax(top, size * unit);
        }
    }
    return top;
}

static void add_forces(const perp__acceleration *a, double *f, const double *x, int32_t absolute)
{
    int32_t c, i;

    for (c = 0; c < a->system.n; c++)
        for (i = 0; i < a->count[c]; i++) {
            const double term =
                a->coefficient[3 * (size_t)c + (size_t)i] * x[c] * a->scale[a->first[c]];

            f[a->first[c] + i] += absolute ? fabs(term) : term;
        }
}

/* x := x + K^-1 (what is left of the equations), and their load. */
static void correct(perp__acceleration *a)
{
    const int32_t n = a->system.n;
    double *change = a->work, *size = change + n;
    int32_t r;

    perp__found_row_accelerations(a, a->u, size, a->f, 0);
    for (r = 0; r < n; r++) {
        a->rhs[r] = -a->u[a->first[r]] * a->scale[a->first[r]];
        a->rhs_load[r] = size[a->first[r]] * a->scale[a->first[r]];
    }
    perp__pivoting_solve(&a->system, change, a->rhs);
    for (r = 0; r < n; r++)
        a->x[r] += change[r];
    memcpy(a->f, a->known, (size_t)a->active * sizeof *a->f);
    add_forces(a, a->f, a->x, 0);
}

/* What a tolerance of the equations is worth in forces and in accelerations. */
static void find_widths(perp__acceleration *a)
{
    const size_t n = (size_t)a->system.n, active = (size_t)a->active;
    double *size = a->work;
    size_t k, r, i, j;

    memset(a->x_width, 0, n * sizeof *a->x_width);
    for (k = 0; k < (size_t)a->system.rank; k++) {
        double sum = 0.0;

        for (r = 0; r < n; r++)
            sum += fabs(a->system.E[k * n + r]) * a->rhs_load[r];
        a->x_width[a->system.columns[k]] = PERP__FOUND_TOLERANCE * sum;
    }
    memset(a->f_width, 0, active * sizeof *a->f_width);
    add_forces(a, a->f_width, a->x_width, 1);
    perp__found_row_accelerations(a, a->u, size, a->f, 0);
    for (i = 0; i < active; i++) {
        a->u_width[i] = PERP__FOUND_TOLERANCE * size[i];
        for (j = 0; j < active; j++)
            a->u_width[i] += fabs(a->W[i * active + j]) * a->f_width[j];
    }
}

/* Whether what the elimination left without a pivot asks for nothing. */
static int32_t is_consistent(const perp__acceleration *a)
{
    const size_t n = (size_t)a->system.n;
    size_t k, r;

    for (k = (size_t)a->system.rank; k < n; k++) {
        double sum = 0.0, size = 0.0;

        for (r = 0; r < n; r++) {
            sum += a->system.E[k * n + r] * a->rhs[r];
            size += fabs(a->system.E[k * n + r]) * a->rhs_load[r];
        }
        if (!(fabs(sum) <= 4.0 * PERP__FOUND_TOLERANCE * size))
            return 0;
    }
    return 1;
}

static void find_null_space(perp__acceleration *a)
{
    const size_t active = (size_t)a->active;
    int32_t k;

    for (k = 0; k < a->system.n - a->system.rank; k++) {
        double *direction = a->null + (size_t)k * active;

        perp__pivoting_null(&a->system, a->work, k);
        memset(direction, 0, active * sizeof *direction);
        add_forces(a, direction, a->work, 0);
    }
}

void perp__found_add_forces(const perp__acceleration *a, double *f, const double *x)
{
    add_forces(a, f, x, 0);
}

void perp__found_correct(perp__acceleration *a)
{
    double *change = a->work;
    int32_t r;

    perp__found_row_accelerations(a, a->u, NULL, a->f, 0);
    for (r = 0; r < a->system.n; r++)
        a->rhs[r] = -a->u[a->first[r]] * a->scale[a->first[r]];
    perp__pivoting_solve(&a->system, change, a->rhs);
    add_forces(a, a->f, change, 0);
}

void perp__found_solve_roughly(perp__acceleration *a, double singular, int32_t most)
{
    list_columns(a);
    perp__pivoting_eliminate(&a->system, singular * load_matrix(a), most);
    memset(a->x, 0, (size_t)a->system.n * sizeof *a->x);
    memcpy(a->f, a->known, (size_t)a->active * sizeof *a->f);
    correct(a);
    perp__found_row_accelerations(a, a->u, NULL, a->f, 0);
}

int32_t perp__found_solve(perp__acceleration *a)
{
    double *size = a->work + (size_t)a->active;
    int32_t r;

    perp__found_solve_roughly(a, SINGULAR, a->active);
    correct(a);
    perp__found_row_accelerations(a, a->u, size, a->f, 0);
    for (r = 0; r < a->system.n; r++)
        a->rhs[r] = -a->u[a->first[r]] * a->scale[a->first[r]];
    find_widths(a);
    if (a->system.rank == a->system.n)
        return 0;
    if (!is_consistent(a))
        return -1;
    find_null_space(a);
    return a->system.n - a->system.rank;
}

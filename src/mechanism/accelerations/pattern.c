/* Within a pattern the forces are the solution of a linear system. Unknowns: the normal force of a
 * contact that presses, with it the friction -mu way of one that slips; tangential forces of what
 * sticks; bilateral forces. Equations: the accelerations of the same rows are 0. */
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"

/* Directions of a slip that starts in 3 dimensions are found to this. */
#define SAME_DIRECTION 1e-10

int32_t perp__element_choices(const perp__acceleration *a, const perp__element *element)
{
    const int32_t ways = element->tangents == 2 ? a->m->settings.directions : 2;
    const int32_t separate = element->dry ? 0 : 1;

    if (element->moves || !element->friction)
        return separate + 1;
    return separate + 1 + ways;
}

/* Choices of a contact: to separate, to stick, to slip; in motion and without friction the second
 * is to slip. Groups of dry friction don't separate. */
void perp__element_choose(perp__acceleration *a, int32_t index, int32_t choice)
{
    const perp__element *element = a->element + index;
    const int32_t press = choice - (element->dry ? 0 : 1);
    int8_t *mode = a->pattern.mode + index;
    double *direction = a->pattern.direction + 2 * (size_t)index;

    direction[0] = direction[1] = 0.0;
    *mode = (int8_t)(press < 0 ? PERP_MECHANISM_SEPARATE : PERP_MECHANISM_SLIP);
    if (press < 0 || !element->friction)
        return;
    if (element->moves) {
        direction[0] = element->direction[0];
        direction[1] = element->direction[1];
    } else if (press == 0) {
        *mode = PERP_MECHANISM_STICK;
    } else if (element->tangents == 1) {
        direction[0] = press == 1 ? 1.0 : -1.0;
    } else {
        const double angle = 2.0 * PERP__PI * (press - 1) / a->m->settings.directions;

        direction[0] = cos(angle);
        direction[1] = sin(angle);
    }
}

int32_t perp__element_tangent(const perp__element *element)
{
    return element->row + !element->dry;
}

int32_t perp__element_starts(const perp__element *element, int32_t mode)
{
    return mode == PERP_MECHANISM_SLIP && element->friction && !element->moves;
}

int32_t perp__element_presses(const perp__element *element, int32_t mode)
{
    return !element->dry && mode != PERP_MECHANISM_SEPARATE;
}

void perp__row_accelerations(const perp__acceleration *a, double *u, double *size, const double *f,
                             int32_t homogeneous)
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
    const perp__element *element = a->element + index;
    const int32_t mode = a->pattern.mode[index], sticks = mode == PERP_MECHANISM_STICK;
    const double *direction = a->pattern.direction + 2 * (size_t)index;
    int32_t i;

    if (element->dry) {
        for (i = 0; i < element->tangents; i++)
            if (sticks)
                add_column(a, element->row + i, 1, 1.0, 0.0, 0.0);
            else
                a->known[element->row + i] = -element->bound * direction[i];
    } else if (mode != PERP_MECHANISM_SEPARATE) {
        if (sticks)
            add_column(a, element->row, 1, 1.0, 0.0, 0.0);
        else
            add_column(a, element->row, 1 + element->tangents, 1.0, -element->mu * direction[0],
                       -element->mu * direction[1]);
        for (i = 1; i <= element->tangents && sticks; i++)
            add_column(a, element->row + i, 1, 1.0, 0.0, 0.0);
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
    for (index = a->closed; index < a->elements; index++)
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

void perp__pattern_add_forces(const perp__acceleration *a, double *f, const double *x)
{
    add_forces(a, f, x, 0);
}

/* What is left of the equations, and the size of their terms. */
static void find_rhs(perp__acceleration *a)
{
    double *size = a->work + (size_t)a->active;
    int32_t r;

    perp__row_accelerations(a, a->u, size, a->f, 0);
    for (r = 0; r < a->system.n; r++) {
        a->rhs[r] = -a->u[a->first[r]] * a->scale[a->first[r]];
        a->rhs_load[r] = size[a->first[r]] * a->scale[a->first[r]];
    }
}

/* x := x + K^-1 (what is left of the equations), and the forces. */
static void correct(perp__acceleration *a)
{
    double *change = a->work;
    int32_t r;

    find_rhs(a);
    perp__pivoting_solve(&a->system, change, a->rhs);
    for (r = 0; r < a->system.n; r++)
        a->x[r] += change[r];
    memcpy(a->f, a->known, (size_t)a->active * sizeof *a->f);
    add_forces(a, a->f, a->x, 0);
}

void perp__pattern_correct(perp__acceleration *a)
{
    find_rhs(a);
    perp__pivoting_solve(&a->system, a->work, a->rhs);
    add_forces(a, a->f, a->work, 0);
}

/* What a tolerance of the equations is worth in forces and in accelerations. */
static void find_widths(perp__acceleration *a)
{
    const size_t active = (size_t)a->active;
    double *size = a->work;
    size_t i, j;
    int32_t c;

    perp__pivoting_widths(&a->system, a->x_width, a->rhs_load);
    for (c = 0; c < a->system.n; c++)
        a->x_width[c] *= PERP__ACCELERATION_TOLERANCE;
    memset(a->f_width, 0, active * sizeof *a->f_width);
    add_forces(a, a->f_width, a->x_width, 1);
    perp__row_accelerations(a, a->u, size, a->f, 0);
    for (i = 0; i < active; i++) {
        a->u_width[i] = PERP__ACCELERATION_TOLERANCE * size[i];
        for (j = 0; j < active; j++)
            a->u_width[i] += fabs(a->W[i * active + j]) * a->f_width[j];
    }
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

void perp__pattern_solve_roughly(perp__acceleration *a, double singular, int32_t most)
{
    list_columns(a);
    perp__pivoting_eliminate(&a->system, singular * load_matrix(a), most);
    memset(a->x, 0, (size_t)a->system.n * sizeof *a->x);
    memcpy(a->f, a->known, (size_t)a->active * sizeof *a->f);
    correct(a);
    perp__row_accelerations(a, a->u, NULL, a->f, 0);
}

int32_t perp__pattern_solve(perp__acceleration *a)
{
    perp__pattern_solve_roughly(a, PERP__ACCELERATION_SINGULAR, a->active);
    correct(a);
    find_widths(a);
    if (a->system.rank == a->system.n)
        return 0;
    find_rhs(a);
    if (!perp__pivoting_is_consistent(&a->system, a->rhs, a->rhs_load,
                                      4.0 * PERP__ACCELERATION_TOLERANCE))
        return -1;
    find_null_space(a);
    return a->system.n - a->system.rank;
}

/* ---- what the pattern says ------------------------------------------------------------------ */

/* A slip that starts: along its direction, and nowhere else. */
static int32_t slips(const perp__element *element, const double *direction,
                     const perp__loads *loads)
{
    const double *u = loads->u + perp__element_tangent(element);
    const double *width = loads->u_width + perp__element_tangent(element);
    double along = direction[0] * u[0], along_width = fabs(direction[0]) * width[0];

    if (element->tangents == 2) {
        const double across = direction[0] * u[1] - direction[1] * u[0];

        along += direction[1] * u[1];
        along_width += fabs(direction[1]) * width[1];
        if (!(fabs(across) <= SAME_DIRECTION * fabs(along) + width[0] + width[1]))
            return 0;
    }
    return loads->strict ? along > along_width : along >= -along_width;
}

/* The forces along the tangents, with what the friction of the element is multiplied with. */
static int32_t drags(const perp__element *element, int32_t mode, const double *direction,
                     const perp__loads *loads, int32_t *at_vertex)
{
    const int32_t t = perp__element_tangent(element);
    const double *f = loads->f + t, *width = loads->f_width + t;
    const double factor = element->dry                   ? 1.0
                          : mode == PERP_MECHANISM_STICK ? element->mu_stick
                                                         : element->mu;
    const double size = !element->dry        ? loads->f[element->row]
                        : loads->homogeneous ? 0.0
                                             : element->bound;
    const double size_width = element->dry ? 0.0 : loads->f_width[element->row];
    double length = 0.0, length_width = 0.0;
    int32_t i;

    for (i = 0; i < element->tangents; i++) {
        length = hypot(length, f[i]);
        length_width += width[i];
        if (mode == PERP_MECHANISM_SLIP &&
            !(fabs(f[i] + factor * size * direction[i]) <= width[i] + factor * size_width))
            return 0;
    }
    return mode == PERP_MECHANISM_SLIP ||
           perp__is_met(factor * size - length, length_width + factor * size_width, at_vertex);
}

static int32_t are_zero(const double *x, const double *width, int32_t count)
{
    int32_t i;

    for (i = 0; i < count; i++)
        if (!(fabs(x[i]) <= width[i]))
            return 0;
    return 1;
}

static int32_t element_holds(const perp__element *element, int32_t mode, const double *direction,
                             const perp__loads *loads, int32_t *at_vertex)
{
    const int32_t r = element->row, t = perp__element_tangent(element);

    if (mode == PERP_MECHANISM_SEPARATE && !element->dry)
        return are_zero(loads->f + r, loads->f_width + r, 1 + element->tangents) &&
               perp__is_met(loads->u[r], loads->u_width[r], at_vertex);
    if (!element->dry && (!are_zero(loads->u + r, loads->u_width + r, 1) ||
                          !perp__is_met(loads->f[r], loads->f_width[r], at_vertex)))
        return 0;
    if (mode == PERP_MECHANISM_STICK &&
        !are_zero(loads->u + t, loads->u_width + t, element->tangents))
        return 0;
    return drags(element, mode, direction, loads, at_vertex) &&
           (!perp__element_starts(element, mode) || slips(element, direction, loads));
}

int32_t perp__pattern_holds(const perp__acceleration *a, const perp__mode_pattern *pattern,
                            const perp__loads *loads, int32_t *at_vertex)
{
    int32_t i;

    *at_vertex = 0;
    if (!are_zero(loads->u + a->bilateral_row, loads->u_width + a->bilateral_row, a->m->bilateral))
        return 0;
    for (i = 0; i < a->elements; i++)
        if (!element_holds(a->element + i, pattern->mode[i], pattern->direction + 2 * (size_t)i,
                           loads, at_vertex))
            return 0;
    return 1;
}

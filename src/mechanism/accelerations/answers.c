/* Answers: what there is to say of one whose forces are known, and which of them are one.
 *
 * M v' = k + J'f, u' = J v' + bias, the modes, and how well the laws are met. Rows that hold have
 * u' = 0 exactly, and v' is found in what they leave free: at rest it is 0.0. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/accelerations/accelerations.h"
#include "mechanism/eigenvalues.h"

/* ---- stability ------------------------------------------------------------------------------
 *
 * The contacts give way a little: displacements y of the normals that press and of the tangents
 * that stick, forces -(k y + c y'), so that
 *
 *   y'' = -Gamma (k y + c y') + const,   Gamma = J_a M^-1 C_a,
 *
 * with the bilateral rows held and C_a the columns of forces: a normal with the friction of its
 * slip, or one of its own. y moves in the range of S = J_a M^-1 J_a' alone: rows that depend on
 * each other count once. With S = B B' (Cholesky with pivoting), Gamma B = B Gamma_r. */

/* Cholesky factor of S, n by n, with pivoting: B, its columns; the rank. diagonal: work. */
static size_t factor(size_t n, double *S, double *B, double *diagonal, int32_t *pivot)
{
    size_t rank;

    for (size_t i = 0; i < n; i++)
        diagonal[i] = S[i * (n + 1)];
    for (rank = 0; rank < n; rank++) {
        size_t p = 0;
        double best = PERP__NOTHING;

        for (size_t i = 0; i < n; i++)
            if (diagonal[i] > 0.0 && S[i * (n + 1)] > best * diagonal[i]) {
                best = S[i * (n + 1)] / diagonal[i];
                p = i;
            }
        if (best <= PERP__NOTHING)
            break;
        pivot[rank] = (int32_t)p;
        for (size_t i = 0; i < n; i++)
            B[i * n + rank] = S[i * n + p] / sqrt(S[p * (n + 1)]);
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++)
                S[i * n + j] -= B[i * n + rank] * B[j * n + rank];
        for (size_t i = 0; i <= rank; i++) /* exactly nothing is left there */
            for (size_t j = 0; j < n; j++)
                S[(size_t)pivot[i] * n + j] = S[j * n + (size_t)pivot[i]] = 0.0;
    }
    return rank;
}

/* The answer is of the pattern that was solved last. */
static void label(perp__acceleration *a, perp__answer *answer)
{
    const perp_mechanism_settings *settings = &a->m->settings;
    const perp__linear *p = &a->linear;
    const size_t active = (size_t)a->active;
    double *Gamma = a->work, *S = Gamma + active * active, *B = S + active * active;
    double *reduced = B + active * active;
    int32_t *column = a->indices, *pivot = column + active; /* column: of the pattern's system */
    size_t n = 0, rank;

    /* 1. Gamma and S of the rows that give way */
    for (int32_t k = 0; k < p->system.n; k++)
        if (p->first[k] < a->bilateral_row || p->first[k] >= a->bilateral_row + a->m->bilateral)
            column[n++] = k;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            const size_t at = i * n + j;
            const int32_t from = column[j];
            const double *row = a->held + (size_t)p->first[column[i]] * active + p->first[from];

            S[at] = Gamma[at] = row[0];
            for (int32_t k = 1; k < p->count[from]; k++)
                Gamma[at] += p->coefficient[PERP__MOST_TERMS * (size_t)from + (size_t)k] * row[k];
        }
    /* 2. Gamma_r = B_p^-1 (Gamma B)_p, by columns, with B_p the pivots' rows: triangular */
    rank = factor(n, S, B, reduced, pivot);
    for (size_t j = 0; j < rank; j++)
        for (size_t i = 0; i < rank; i++) {
            const size_t row = (size_t)pivot[i];
            double sum = 0.0;

            for (size_t k = 0; k < n; k++)
                sum += Gamma[row * n + k] * B[k * n + j];
            for (size_t k = 0; k < i; k++)
                sum -= B[row * n + k] * reduced[k + rank * j];
            reduced[i + rank * j] = sum / B[row * n + i];
        }
    /* 3. what it says */
    perp__stability_of((int32_t)rank, reduced, settings->stiffness, settings->damping, S,
                       answer->eigenvalues, &answer->stable, &answer->flutter);
    answer->eigenvalue_count = 2 * (int32_t)rank;
    answer->stable = answer->stable && answer->free == 0;
}

/* ---- description --------------------------------------------------------------------------- */

void perp__acceleration_mark_rows(const perp__acceleration *a, const perp__answer *answer,
                                  int8_t *holds)
{
    const perp_mechanism *m = a->m;

    memset(holds, 0, (size_t)m->rows);
    memset(holds + m->contact_rows, 1, (size_t)m->bilateral);
    for (int32_t index = 0; index < a->elements; index++) {
        const perp__element *element = a->element + index;
        const int32_t mode = answer->pattern[index];

        for (int32_t i = 0; i < element->tangents + element->normals; i++)
            holds[a->row_of[element->row] + i] =
                (int8_t)(mode == PERP_MECHANISM_STICK ||
                         (i < element->normals && perp__element_presses(element, mode)));
    }
}

/* How far u' of active row r is off where it is to be 0 (sign 0) or not negative (sign 1). */
static double row_residual(const perp__acceleration *a, const perp__answer *answer, int32_t r,
                           bool sign)
{
    const perp_mechanism *m = a->m;
    const int32_t row = a->row_of[r];
    const double sum = perp__row_times(m, &m->begin, row, a->bias[row], answer->extra);
    double size = a->load[r];

    for (size_t k = 0; k < (size_t)a->active; k++)
        size += fabs(a->W[(size_t)r * (size_t)a->active + k] * answer->middle[a->row_of[k]]);
    if (!sign || sum < 0.0)
        return size == 0.0 ? 0.0 : fabs(sum) / size;
    return sum >= 0.0 ? 0.0 : sum; /* NaN */
}

/* largest: of the forces in their units. */
static double element_residual(const perp__acceleration *a, const perp__answer *answer,
                               int32_t index, double largest)
{
    const perp__element *element = a->element + index;
    const int32_t mode = answer->pattern[index], row = a->row_of[element->row];
    const int32_t tangent = row + element->normals;
    const double *f = answer->middle;
    const double size = element->dry ? element->bound : perp__load_of(a->m, f, element->source);
    double worst = 0.0, length = 0.0, limit;

    for (int32_t i = 0; i < element->normals; i++)
        perp__raise_to(&worst,
                       row_residual(a, answer, element->row + i, mode == PERP_MECHANISM_SEPARATE));
    if (!element->two_sided && !element->dry)
        perp__raise_to(&worst, -size / (largest * a->scale[element->row]));
    for (int32_t i = 0; i < element->tangents; i++) {
        length = hypot(length, f[tangent + i]);
        if (mode == PERP_MECHANISM_STICK)
            perp__raise_to(&worst, row_residual(a, answer, element->tangent + i, 0));
    }
    limit = (element->dry                   ? 1.0
             : mode == PERP_MECHANISM_STICK ? element->mu_stick
                                            : element->mu) *
            fmax(size, 0.0);
    if (element->tangents > 0)
        perp__raise_to(&worst, (length - limit) / (largest * a->scale[element->tangent]));
    return worst;
}

static void describe(perp__acceleration *a, perp__answer *answer)
{
    perp_mechanism *m = a->m;
    perp__terms terms = m->begin;
    const perp__velocity_problem problem = {
        .terms = &terms, .momentum = terms.k, .shift = a->zeros};
    perp__motion held = {.v = answer->extra,
                         .r = answer->middle,
                         .u = perp__answer_row_acceleration(a, answer),
                         .holds = m->second.holds};
    double largest = DBL_MIN;

    /* 1. v' and u' from the forces */
    terms.drift = a->bias;
    perp__acceleration_mark_rows(a, answer, held.holds);
    memcpy(held.v, terms.k, (size_t)m->n * sizeof *held.v);
    perp__add_impulses(m, &terms, held.v, held.r);
    perp__solve_mass(m, &terms, held.v, held.v);
    perp__hold_velocities(m, &held, &problem);
    /* 2. how well the laws are met */
    for (int32_t i = 0; i < a->active; i++)
        largest = fmax(largest, fabs(answer->middle[a->row_of[i]]) / a->scale[i]);
    answer->residual = perp__momentum_residual(m, &m->begin, m->begin.k, held.v, answer->middle);
    for (int32_t i = 0; i < m->bilateral; i++)
        perp__raise_to(&answer->residual, row_residual(a, answer, a->bilateral_row + i, 0));
    for (int32_t i = 0; i < a->elements; i++)
        perp__raise_to(&answer->residual, element_residual(a, answer, i, largest));
    /* 3. the modes, and the stability */
    memset(answer->modes, 0, (size_t)(m->contacts + m->dry) * sizeof *answer->modes);
    answer->kind = 0;
    for (int32_t index = 0; index < a->elements; index++) {
        const perp__element *element = a->element + index;
        int32_t mode = answer->pattern[index];

        answer->kind += perp__element_presses(element, mode);
        if (mode == PERP_MECHANISM_SLIP && !element->dry && !element->friction && !element->moves) {
            mode = PERP_MECHANISM_STICK; /* nothing holds it, but it does not move either */
            for (int32_t i = 0; i < element->tangents; i++)
                if (row_residual(a, answer, element->tangent + i, 0) > PERP__NOTHING)
                    mode = PERP_MECHANISM_SLIP;
        }
        answer->modes[element->source] = mode;
    }
    label(a, answer);
}

/* ---- one answer in another ----------------------------------------------------------------- */

/* Whether a point or, homogeneous, a direction does what the pattern of `outer` says. spread: as of
 * perp__linear_holds_at. */
static bool has_point(perp__acceleration *a, const perp__answer *outer, const double *point,
                      int32_t homogeneous, double spread, int32_t *at_vertex)
{
    const perp__mode_pattern pattern = perp__answer_pattern(a, outer);

    for (int32_t i = 0; i < a->active; i++)
        a->work[i] = point[a->row_of[i]];
    return perp__linear_holds_at(&a->linear, &pattern, a->work, homogeneous, spread, at_vertex);
}

static bool is_turned(const perp__acceleration *a, const perp__answer *answer)
{
    for (int32_t i = 0; i < a->elements; i++)
        if ((a->element[i].tangents == 2 &&
             perp__element_starts(a->element + i, answer->pattern[i])) ||
            perp__load_bends(a->element + i))
            return 1;
    return 0;
}

int32_t perp__acceleration_holds(void *user, perp__answer *outer, const perp__answer *inner)
{
    perp__acceleration *a = user;
    double same, largest = 0.0;
    int32_t at_vertex, holds = 1;

    if (outer->dimension > 0) {
        for (int32_t k = 0; k < inner->vertices + inner->rays && holds; k++)
            holds = has_point(a, outer, inner->points + (size_t)k * (size_t)a->m->rows,
                              k >= inner->vertices, 1.0, &at_vertex);
        return holds;
    }
    same = is_turned(a, outer) || is_turned(a, inner) ? PERP__SAME_DIRECTION : PERP__SUM_ROUNDING;
    for (int32_t i = 0; i < a->active; i++)
        largest = fmax(largest, fabs(outer->points[a->row_of[i]]) / a->scale[i]);
    for (int32_t i = 0; i < a->active && holds; i++) {
        const int32_t row = a->row_of[i];
        const double width = outer->width[row] + inner->width[row];

        holds = fabs(outer->points[row] - inner->points[row]) <=
                4.0 * width + same * largest * a->scale[i];
    }
    outer->at_vertex |= holds; /* two patterns meet there */
    return holds;
}

/* ---- the store ----------------------------------------------------------------------------- */

/* The new answer with its points is described and joins the others, or goes where another one has
 * it already, or where its residuals say that it is none: numbers overflow, and a pattern's tests
 * are those of its equations. */
static void keep(perp__acceleration *a, perp__answer *answer)
{
    const size_t rows = (size_t)a->m->rows, points = (size_t)(answer->vertices + answer->rays);
    perp__evidence evidence = {0.0, 0.0, INFINITY, 0};

    describe(a, answer);
    evidence.tested = evidence.own_residual = answer->residual;
    evidence.sound = perp__all_finite(answer->extra, (size_t)a->m->n) &&
                     perp__all_finite(answer->middle, rows) &&
                     perp__all_finite(perp__answer_row_acceleration(a, answer), rows) &&
                     perp__all_finite(answer->points, points * rows);
    if (perp__is_good(perp__gate(&evidence, PERP__AGREEMENT, -1))) {
        perp__answers_keep(&a->answers, answer);
    } else {
        perp__answer_release(&a->answers, answer);
        a->answers.incomplete = 1;
    }
}

/* The answer's pattern := that of now. */
static void set_pattern(const perp__acceleration *a, perp__answer *answer)
{
    const perp__mode_pattern pattern = perp__answer_pattern(a, answer);

    memcpy(pattern.mode, a->pattern.mode, (size_t)a->elements);
    memcpy(pattern.direction, a->pattern.direction,
           2 * (size_t)a->elements * sizeof *pattern.direction);
    memcpy(pattern.load, a->pattern.load,
           PERP__MOST_NORMALS * (size_t)a->elements * sizeof *pattern.load);
}

perp_status perp__acceleration_keep_point(perp__acceleration *a, int32_t at_vertex)
{
    const size_t rows = (size_t)a->m->rows;
    perp__answer *answer = perp__answer_create(&a->answers, 1);

    if (!answer)
        return perp__fail_memory(a->m->context, "an acceleration");
    answer->free = 0;
    answer->at_vertex = at_vertex;
    set_pattern(a, answer);
    memset(answer->middle, 0, rows * sizeof *answer->middle);
    memset(answer->width, 0, rows * sizeof *answer->width);
    for (int32_t i = 0; i < a->active; i++) {
        answer->middle[a->row_of[i]] = a->linear.x[i];
        answer->width[a->row_of[i]] = a->linear.x_width[i];
    }
    memcpy(answer->points, answer->middle, rows * sizeof *answer->points);
    keep(a, answer);
    return PERP_OK;
}

/* ---- families ---------------------------------------------------------------------------------
 *
 * A pattern whose forces are not unique: f = f_0 + sum of null directions, cut by the inequalities
 * of the pattern. The polyhedron is given by its vertices and rays.
 *
 * In 3 dimensions a disc of friction is replaced by a regular polygon: at first around it (where
 * nothing is left there is no answer), turned so that it cuts off what is outside of the disc,
 * until the middle of what is left is inside; then within the disc, with corners in the directions
 * of that middle. So no family is missed, and all of its points are answers, but not all answers
 * are there. */

/* The polyhedron in `null` directions as an answer without a description; NULL if empty. */
static perp_status enumerate(perp__acceleration *a, int32_t dimension, int32_t discs, bool inside,
                             perp__answer **made)
{
    perp_status status;
    int32_t edges;

    *made = NULL;
    for (int32_t i = 0; i < a->elements; i++) /* what sticks by a load that turns is not convex */
        a->answers.incomplete |= perp__load_bends(a->element + i);
    a->linear.inside = inside;
    /* fewer edges where there are many corners, and as many as there is room for */
    edges = dimension <= 2 ? a->m->settings.directions : dimension <= 4 ? 6 : 4;
    while (edges > 3 && 1 + 4 * a->elements + edges * discs > PERP__CONE_ROWS)
        edges--;
    a->linear.edges = discs > 0 ? edges : 0;
    status = perp__polyhedron_begin(&a->polyhedron, 4 * a->elements + a->linear.edges * discs,
                                    dimension);
    if (status != PERP_OK)
        return status;
    perp__linear_cut(&a->linear, &a->pattern, &a->polyhedron);
    if (a->polyhedron.empty)
        return PERP_OK;
    status = perp__polyhedron_enumerate(&a->polyhedron, &a->answers);
    PERP__THEN(status, perp__polyhedron_list(&a->polyhedron, &a->answers, made));
    if (!*made)
        return status;
    set_pattern(a, *made);
    for (int32_t i = 0; i < a->m->rows; i++)
        (*made)->width[i] = PERP__AGREEMENT * fabs((*made)->middle[i]);
    return PERP_OK;
}

/* The rank of the points' differences, as forces or as accelerations, in the units of the rows. */
static int32_t rank_of(perp__acceleration *a, const perp__answer *answer, bool accelerations)
{
    const size_t active = (size_t)a->active, rows = (size_t)a->m->rows;
    double *difference = a->work + active * active, largest = 0.0;
    const int32_t points = answer->vertices + answer->rays;
    int32_t rank = 0, k;

    for (k = 1; k < points; k++)
        for (size_t i = 0; i < active; i++)
            largest = fmax(largest, fabs(answer->points[(size_t)k * rows + (size_t)a->row_of[i]]) /
                                        a->scale[i]);
    for (k = 1; k < points && rank < a->active; k++) {
        double *d = a->work + (size_t)rank * active;

        for (size_t i = 0; i < active; i++)
            difference[i] = answer->points[(size_t)k * rows + (size_t)a->row_of[i]] -
                            (k < answer->vertices ? answer->points[a->row_of[i]] : 0.0);
        if (accelerations)
            perp__linear_rows(&a->linear, d, NULL, difference, 1);
        for (size_t i = 0; i < active; i++)
            d[i] = accelerations ? d[i] * a->scale[i] : difference[i] / a->scale[i];
        rank = perp__rank_add(a->work, rank, a->active, PERP__AGREEMENT * largest);
    }
    return rank;
}

perp_status perp__acceleration_keep_family(perp__acceleration *a, int32_t dimension)
{
    const size_t active = (size_t)a->active;
    perp__answer *answer = NULL;
    double size = 0.0;
    int32_t discs = 0, at_vertex = 0, holds = 0;
    perp_status status;

    /* 1. the discs that it has to stay in; forces in units of the loads, for entries near 1 */
    for (int32_t i = 0; i < a->elements; i++)
        discs += a->pattern.mode[i] == PERP_MECHANISM_STICK && a->element[i].tangents == 2;
    for (size_t i = 0; i < active; i++)
        size = fmax(size, fmax(fabs(a->linear.x[i]) / a->scale[i], a->load[i] * a->scale[i]));
    for (size_t i = 0; i < (size_t)dimension * active && size > 0.0; i++)
        a->linear.null[i] *= size;
    memset(a->linear.angle, 0, (size_t)a->elements * sizeof *a->linear.angle);
    /* 2. within polygons around them, turned to where the middle is until that is inside */
    for (int32_t round = 0; round < PERP__MOST_ITERATES && !holds; round++) {
        if (answer)
            perp__answer_release(&a->answers, answer);
        status = enumerate(a, dimension, discs, 0, &answer);
        if (!answer)
            return status;
        holds = discs == 0 || has_point(a, answer, answer->middle, 0, 0.0, &at_vertex);
        for (int32_t i = 0; i < a->elements; i++) {
            const perp__element *element = a->element + i;
            const double *f = answer->middle + a->row_of[element->row] + element->normals;

            if (element->tangents == 2)
                a->linear.angle[i] = atan2(f[1], f[0]);
        }
    }
    /* 3. within polygons in them */
    if (discs > 0) {
        perp__answer_release(&a->answers, answer);
        answer = NULL;
        status = holds ? enumerate(a, dimension, discs, 1, &answer) : PERP_OK;
        a->answers.incomplete |= !answer;
        if (!answer)
            return status;
    }
    has_point(a, answer, answer->middle, 0, 0.0, &at_vertex);
    answer->dimension = answer->vertices + answer->rays == 1 ? 0 : rank_of(a, answer, 0);
    answer->free = answer->dimension == 0 ? 0 : rank_of(a, answer, 1);
    answer->at_vertex = at_vertex;
    if (answer->dimension == 0)
        answer->vertices = 1;
    keep(a, answer);
    return PERP_OK;
}

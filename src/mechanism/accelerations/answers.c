/* Answers: what there is to say of one whose forces are known, and which of them are one.
 *
 * M v' = k + J'f, u' = J v' + bias, the modes, and how well the laws are met. Rows that hold have
 * u' = 0 exactly, and v' is found in what they leave free: at rest it is 0.0. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/accelerations/accelerations.h"
#include "mechanism/stability.h"

/* Directions of a slip that starts in 3 dimensions are found to this. */
#define SAME_FORCE 1e-10
/* Rows that do not hold say something about u' all the same: to this, relative to its terms. */
#define SMALL 1e-11
/* What is left of a diagonal entry, beside what it was, that counts as 0. */
#define DEPENDENT 1e-11
/* Turns of the polygons until the middle is in the discs. */
#define MOST_CUTS 24
/* Polyhedra of more have too many vertices. */
#define LARGEST_DIMENSION 10

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

typedef struct compliant {
    int32_t count;
    int32_t *column; /* of the pattern's system */
    double *Gamma, *S, *B, *product;
    int32_t *pivot;
} compliant;

static void fill(const perp__acceleration *a, compliant *c)
{
    const perp__linear *p = &a->linear;

    c->count = 0;
    for (int32_t k = 0; k < p->system.n; k++)
        if (p->first[k] < a->bilateral_row || p->first[k] >= a->bilateral_row + a->m->bilateral)
            c->column[c->count++] = k;
    for (int32_t i = 0; i < c->count; i++)
        for (int32_t j = 0; j < c->count; j++) {
            const size_t at = (size_t)i * (size_t)c->count + (size_t)j;
            const int32_t from = c->column[j];
            const double *row = a->held + (size_t)p->first[c->column[i]] * (size_t)a->active;

            row += p->first[from];
            c->S[at] = c->Gamma[at] = row[0];
            for (int32_t k = 1; k < p->count[from]; k++)
                c->Gamma[at] +=
                    p->coefficient[PERP__MOST_TERMS * (size_t)from + (size_t)k] * row[k];
        }
}

/* Returns the rank. B: n by n, its columns the factor's. product: the diagonal at the start. */
static int32_t factor(compliant *c)
{
    const size_t n = (size_t)c->count;
    size_t rank;

    for (size_t i = 0; i < n; i++)
        c->product[i] = c->S[i * (n + 1)];
    for (rank = 0; rank < n; rank++) {
        size_t p = 0;
        double best = DEPENDENT;

        for (size_t i = 0; i < n; i++)
            if (c->product[i] > 0.0 && c->S[i * (n + 1)] > best * c->product[i]) {
                best = c->S[i * (n + 1)] / c->product[i];
                p = i;
            }
        if (best <= DEPENDENT)
            break;
        c->pivot[rank] = (int32_t)p;
        for (size_t i = 0; i < n; i++)
            c->B[i * n + rank] = c->S[i * n + p] / sqrt(c->S[p * (n + 1)]);
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++)
                c->S[i * n + j] -= c->B[i * n + rank] * c->B[j * n + rank];
        for (size_t i = 0; i <= rank; i++) /* exactly nothing is left there */
            for (size_t j = 0; j < n; j++)
                c->S[(size_t)c->pivot[i] * n + j] = c->S[j * n + (size_t)c->pivot[i]] = 0.0;
    }
    return (int32_t)rank;
}

/* Gamma_r = B_p^-1 (Gamma B)_p, rank by rank by columns, with B_p the pivots' rows: triangular. */
static void restrict_to_range(compliant *c, int32_t rank)
{
    const size_t n = (size_t)c->count, r = (size_t)rank;

    for (size_t j = 0; j < r; j++)
        for (size_t i = 0; i < r; i++) {
            const size_t p = (size_t)c->pivot[i];
            double sum = 0.0;

            for (size_t k = 0; k < n; k++)
                sum += c->Gamma[p * n + k] * c->B[k * n + j];
            for (size_t k = 0; k < i; k++)
                sum -= c->B[p * n + k] * c->product[k + r * j];
            c->product[i + r * j] = sum / c->B[p * n + i];
        }
}

/* The answer is of the pattern that was solved last. */
static void label(perp__acceleration *a, perp__answer *answer)
{
    const perp_mechanism_settings *settings = &a->m->settings;
    const size_t active = (size_t)a->active;
    perp__stability verdict;
    compliant c;
    int32_t rank;

    c.Gamma = a->work;
    c.S = c.Gamma + active * active;
    c.B = c.S + active * active;
    c.product = c.B + active * active;
    c.column = a->indices;
    c.pivot = c.column + active;
    fill(a, &c);
    rank = factor(&c);
    restrict_to_range(&c, rank);
    verdict = perp__stability_of(rank, c.product, settings->stiffness, settings->damping, c.S,
                                 answer->eigenvalues);
    answer->eigenvalue_count = 2 * rank;
    answer->stable = verdict.stable && answer->free == 0;
    answer->flutter = verdict.flutter;
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

/* v' and u' from the forces. */
static void find_acceleration(perp__acceleration *a, perp__answer *answer)
{
    perp_mechanism *m = a->m;
    perp__terms terms = m->begin;
    perp__velocity_problem problem = {0};
    perp__motion held = {0};

    terms.drift = a->bias;
    problem.terms = &terms;
    problem.momentum = terms.k;
    problem.shift = a->zeros;
    held.v = perp__answer_acceleration(answer);
    held.r = answer->middle;
    held.u = perp__answer_row_acceleration(a, answer);
    held.holds = m->second.holds;
    perp__acceleration_mark_rows(a, answer, held.holds);
    memcpy(held.v, terms.k, (size_t)m->n * sizeof *held.v);
    perp__add_impulses(m, &terms, held.v, held.r);
    perp__solve_mass(m, &terms, held.v, held.v);
    perp__hold_velocities(m, &held, &problem);
}

/* How far u' of active row r is off where it is to be 0 (sign 0) or not negative (sign 1). */
static double row_residual(const perp__acceleration *a, const perp__answer *answer, int32_t r,
                           int32_t sign)
{
    const perp_mechanism *m = a->m;
    const int32_t row = a->row_of[r];
    const double sum =
        perp__row_times(m, &m->begin, row, a->bias[row], perp__answer_acceleration(answer));
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
    double worst = 0.0, size = element->dry ? element->bound : f[row], length = 0.0, limit;

    for (int32_t i = 0; i < element->normals; i++)
        perp__raise_to(&worst,
                       row_residual(a, answer, element->row + i, mode == PERP_MECHANISM_SEPARATE));
    if (element->two_sided)
        size = hypot(size, hypot(element->normals > 1 ? f[row + 1] : 0.0,
                                 element->normals > 2 ? f[row + 2] : 0.0));
    else if (!element->dry)
        perp__raise_to(&worst, -size / (largest * a->scale[element->row]));
    for (int32_t i = 0; i < element->tangents; i++) {
        length = hypot(length, f[tangent + i]);
        if (mode == PERP_MECHANISM_STICK)
            perp__raise_to(&worst, row_residual(a, answer, perp__element_tangent(element) + i, 0));
    }
    limit = (element->dry                   ? 1.0
             : mode == PERP_MECHANISM_STICK ? element->mu_stick
                                            : element->mu) *
            fmax(size, 0.0);
    if (element->tangents > 0)
        perp__raise_to(&worst,
                       (length - limit) / (largest * a->scale[perp__element_tangent(element)]));
    return worst;
}

static void name_modes(const perp__acceleration *a, perp__answer *answer)
{
    const perp_mechanism *m = a->m;

    memset(answer->modes, 0, (size_t)(m->contacts + m->dry) * sizeof *answer->modes);
    answer->kind = 0;
    for (int32_t index = 0; index < a->elements; index++) {
        const perp__element *element = a->element + index;
        int32_t mode = answer->pattern[index];

        answer->kind += perp__element_presses(element, mode);
        if (mode == PERP_MECHANISM_SLIP && !element->dry && !element->friction && !element->moves) {
            mode = PERP_MECHANISM_STICK; /* nothing holds it, but it does not move either */
            for (int32_t i = 0; i < element->tangents; i++)
                if (row_residual(a, answer, perp__element_tangent(element) + i, 0) > SMALL)
                    mode = PERP_MECHANISM_SLIP;
        }
        answer->modes[element->source] = mode;
    }
}

static void describe(perp__acceleration *a, perp__answer *answer)
{
    perp_mechanism *m = a->m;
    double largest = DBL_MIN;

    find_acceleration(a, answer);
    for (int32_t i = 0; i < a->active; i++)
        largest = fmax(largest, fabs(answer->middle[a->row_of[i]]) / a->scale[i]);
    answer->residual = perp__momentum_residual(m, &m->begin, m->begin.k,
                                               perp__answer_acceleration(answer), answer->middle);
    for (int32_t i = 0; i < m->bilateral; i++)
        perp__raise_to(&answer->residual, row_residual(a, answer, a->bilateral_row + i, 0));
    for (int32_t i = 0; i < a->elements; i++)
        perp__raise_to(&answer->residual, element_residual(a, answer, i, largest));
    name_modes(a, answer);
    label(a, answer);
}

/* ---- one answer in another ----------------------------------------------------------------- */

/* Whether a point or, homogeneous, a direction does what the pattern of `outer` says. spread: as of
 * perp__linear_holds_at. */
static int32_t has_point(perp__acceleration *a, const perp__answer *outer, const double *point,
                         int32_t homogeneous, double spread, int32_t *at_vertex)
{
    const perp__mode_pattern pattern = perp__answer_pattern(a, outer);

    for (int32_t i = 0; i < a->active; i++)
        a->work[i] = point[a->row_of[i]];
    return perp__linear_holds_at(&a->linear, &pattern, a->work, homogeneous, PERP__FAMILY_TOLERANCE,
                                 spread, at_vertex);
}

static int32_t is_turned(const perp__acceleration *a, const perp__answer *answer)
{
    for (int32_t i = 0; i < a->elements; i++)
        if ((a->element[i].tangents == 2 &&
             perp__element_starts(a->element + i, answer->pattern[i])) ||
            perp__load_bends(a->element + i))
            return 1;
    return 0;
}

static int32_t is_same(const perp__acceleration *a, const perp__answer *one,
                       const perp__answer *other)
{
    const double same = is_turned(a, one) || is_turned(a, other) ? SAME_FORCE : 1e-14;
    double largest = 0.0;

    for (int32_t i = 0; i < a->active; i++)
        largest = fmax(largest, fabs(one->points[a->row_of[i]]) / a->scale[i]);
    for (int32_t i = 0; i < a->active; i++) {
        const int32_t row = a->row_of[i];
        const double width = one->width[row] + other->width[row];

        if (!(fabs(one->points[row] - other->points[row]) <=
              4.0 * width + same * largest * a->scale[i]))
            return 0;
    }
    return 1;
}

int32_t perp__acceleration_holds(void *user, perp__answer *outer, const perp__answer *inner)
{
    perp__acceleration *a = user;
    int32_t at_vertex;

    if (outer->dimension == 0) {
        const int32_t same = is_same(a, outer, inner);

        outer->at_vertex |= same; /* two patterns meet there */
        return same;
    }
    for (int32_t k = 0; k < inner->vertices + inner->rays; k++)
        if (!has_point(a, outer, inner->points + (size_t)k * (size_t)a->m->rows,
                       k >= inner->vertices, 1.0, &at_vertex))
            return 0;
    return 1;
}

/* ---- the store ----------------------------------------------------------------------------- */

/* Whether what would be handed out is an answer: numbers overflow, and a pattern's tests are those
 * of its equations. */
static int32_t is_sound(const perp__acceleration *a, const perp__answer *answer)
{
    const size_t rows = (size_t)a->m->rows;
    const perp__evidence evidence = {
        answer->residual, answer->residual, INFINITY,
        perp__all_finite(perp__answer_acceleration(answer), (size_t)a->m->n) &&
            perp__all_finite(answer->middle, rows) &&
            perp__all_finite(perp__answer_row_acceleration(a, answer), rows) &&
            perp__all_finite(answer->points, (size_t)(answer->vertices + answer->rays) * rows)};

    return perp__is_good(perp__gate(&evidence, PERP__FAMILY_TOLERANCE, -1));
}

/* The new answer with its points is described and joins the others, or goes where another one has
 * it already, or where its residuals say that it is none. */
static void keep(perp__acceleration *a, perp__answer *answer)
{
    describe(a, answer);
    if (is_sound(a, answer)) {
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

perp_status perp__acceleration_keep_point(perp__acceleration *a, int32_t at_vertex,
                                          int32_t dimension)
{
    const size_t rows = (size_t)a->m->rows;
    perp__answer *answer = perp__answer_create(&a->answers, 1);

    if (!answer)
        return perp__fail_memory(a->m->context, "an acceleration");
    answer->free = 0;
    answer->dimension = dimension;
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

/* Discs of friction that the family has to stay in. */
static int32_t count_discs(const perp__acceleration *a)
{
    int32_t discs = 0, i;

    for (i = 0; i < a->elements; i++)
        discs += a->pattern.mode[i] == PERP_MECHANISM_STICK && a->element[i].tangents == 2;
    return discs;
}

/* Edges of their polygons: fewer where there are many corners, and as many as there is room for. */
static int32_t edges_of(const perp__acceleration *a, int32_t dimension, int32_t discs)
{
    int32_t edges = dimension <= 2 ? a->m->settings.directions : dimension <= 4 ? 6 : 4;

    while (edges > 3 && 1 + 4 * a->elements + edges * discs > PERP__CONE_ROWS)
        edges--;
    return edges;
}

/* Forces in units of the loads, so that points have entries near 1. */
static void scale_directions(perp__acceleration *a, int32_t dimension)
{
    const size_t active = (size_t)a->active;
    double size = 0.0;

    for (size_t i = 0; i < active; i++)
        size = fmax(size, fmax(fabs(a->linear.x[i]) / a->scale[i], a->load[i] * a->scale[i]));
    for (size_t i = 0; i < (size_t)dimension * active && size > 0.0; i++)
        a->linear.null[i] *= size;
}

/* ---- the family ----------------------------------------------------------------------------- */

/* The polyhedron in `null` directions as an answer without a description; NULL if empty. */
static perp_status enumerate(perp__acceleration *a, int32_t dimension, int32_t discs,
                             int32_t inside, perp__answer **made)
{
    perp_status status;

    *made = NULL;
    for (int32_t i = 0; i < a->elements; i++) /* what sticks by a load that turns is not convex */
        a->answers.incomplete |= perp__load_bends(a->element + i);
    a->linear.inside = inside;
    a->linear.edges = discs > 0 ? edges_of(a, dimension, discs) : 0;
    status = perp__polyhedron_begin(&a->polyhedron, 4 * a->elements + a->linear.edges * discs,
                                    dimension);
    if (status != PERP_OK)
        return status;
    perp__linear_cut(&a->linear, &a->pattern, &a->polyhedron);
    if (a->polyhedron.empty)
        return PERP_OK;
    if (dimension > LARGEST_DIMENSION) {
        a->answers.incomplete = 1;
        return PERP_OK;
    }
    status = perp__polyhedron_enumerate(&a->polyhedron, &a->answers);
    PERP__THEN(status, perp__polyhedron_list(&a->polyhedron, &a->answers, made));
    if (!*made)
        return status;
    set_pattern(a, *made);
    for (int32_t i = 0; i < a->m->rows; i++)
        (*made)->width[i] = PERP__FAMILY_TOLERANCE * fabs((*made)->middle[i]);
    return PERP_OK;
}

/* Whether the middle does what the pattern says; *at_vertex: at a limit, and so is the family. */
static int32_t holds_middle(perp__acceleration *a, const perp__answer *answer, int32_t *at_vertex)
{
    return has_point(a, answer, answer->middle, 0, 0.0, at_vertex);
}

/* Turns the polygons to where the middle is. */
static void aim(perp__acceleration *a, const perp__answer *answer)
{
    for (int32_t i = 0; i < a->elements; i++) {
        const perp__element *element = a->element + i;
        const double *f = answer->middle + a->row_of[element->row] + element->normals;

        if (element->tangents == 2)
            a->linear.angle[i] = atan2(f[1], f[0]);
    }
}

/* The rank of the points' differences, as forces or as accelerations, in the units of the rows. */
static int32_t rank_of(perp__acceleration *a, const perp__answer *answer, int32_t accelerations)
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
        rank = perp__rank_add(a->work, rank, a->active, PERP__FAMILY_TOLERANCE * largest);
    }
    return rank;
}

perp_status perp__acceleration_keep_family(perp__acceleration *a, int32_t dimension)
{
    const int32_t discs = count_discs(a);
    perp__answer *answer = NULL;
    int32_t at_vertex = 0, holds = 0, round;
    perp_status status;

    scale_directions(a, dimension);
    memset(a->linear.angle, 0, (size_t)a->elements * sizeof *a->linear.angle);
    for (round = 0; round < MOST_CUTS && !holds; round++) {
        if (answer)
            perp__answer_release(&a->answers, answer);
        status = enumerate(a, dimension, discs, 0, &answer);
        if (!answer)
            return status;
        holds = discs == 0 || holds_middle(a, answer, &at_vertex);
        aim(a, answer);
    }
    if (discs > 0) {
        perp__answer_release(&a->answers, answer);
        answer = NULL;
        status = holds ? enumerate(a, dimension, discs, 1, &answer) : PERP_OK;
        a->answers.incomplete |= !answer;
        if (!answer)
            return status;
    }
    holds_middle(a, answer, &at_vertex);
    answer->dimension = answer->vertices + answer->rays == 1 ? 0 : rank_of(a, answer, 0);
    answer->free = answer->dimension == 0 ? 0 : rank_of(a, answer, 1);
    answer->at_vertex = at_vertex;
    if (answer->dimension == 0)
        answer->vertices = 1;
    keep(a, answer);
    return PERP_OK;
}

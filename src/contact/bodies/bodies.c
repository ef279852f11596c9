/* From a caller's M and H to blocks, factors and pieces. */
#include "contact/bodies/bodies.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/groups.h"

void perp__bodies_release(perp__bodies *bodies)
{
    perp__arena_release(&bodies->constraints_arena);
    perp__arena_release(&bodies->blocks_arena);
    perp__arena_release(&bodies->pieces_arena);
}

static void layout_constraints(perp__arena *arena, void *object)
{
    perp__bodies *b = object;
    const size_t n = (size_t)b->n, constraints = (size_t)b->constraints, size = (size_t)b->size;

    PERP__INTEGERS(arena, n, &b->block_of, &b->place_of);
    b->rows = perp__arena_take(arena, constraints + 1, sizeof *b->rows);
    b->constraint_of = perp__arena_take(arena, size, sizeof *b->constraint_of);
    b->compliance = perp__arena_take(arena, size, sizeof *b->compliance);
    b->piece_starts = perp__arena_take(arena, constraints + 1, sizeof *b->piece_starts);
    b->mark = perp__arena_take(arena, (n > constraints ? n : constraints) + 1, sizeof *b->mark);
}

static void layout_blocks(perp__arena *arena, void *object)
{
    perp__bodies *b = object;
    const size_t padded = (size_t)b->blocks * (size_t)b->width;

    b->sizes = perp__arena_take(arena, (size_t)b->blocks, sizeof *b->sizes);
    b->dofs = perp__arena_take(arena, padded, sizeof *b->dofs);
    b->factors = perp__arena_take(arena, padded, (size_t)b->width * sizeof *b->factors);
    PERP__DOUBLES(arena, padded, &b->y, &b->free);
    b->block_starts = perp__arena_take(arena, (size_t)b->blocks + 1, sizeof *b->block_starts);
}

/* ---- constraints --------------------------------------------------------------------------- */

static void fill_constraints(perp__bodies *bodies, const perp__bodies_input *input)
{
    int32_t row = 0;

    bodies->most_rows = 1;
    for (int32_t k = 0; k < bodies->constraints; k++) {
        const int32_t rows = k < input->contacts ? input->starts[k + 1] - input->starts[k] : 1;

        bodies->rows[k] = row;
        if (rows > bodies->most_rows)
            bodies->most_rows = rows;
        for (int32_t i = 0; i < rows; i++)
            bodies->constraint_of[row++] = k;
    }
    bodies->rows[bodies->constraints] = row;
    for (int32_t i = 0; i < bodies->size; i++)
        bodies->compliance[i] = input->compliance ? input->compliance[i] : 0.0;
}

/* ---- blocks ---------------------------------------------------------------------------------- */

void perp__visit_column(const perp__matrix *A, int32_t column, perp__visitor visit, void *user)
{
    if (A->column_starts) {
        for (int32_t k = A->column_starts[column]; k < A->column_starts[column + 1]; k++)
            if (A->values[k] != 0.0)
                visit(user, A->row_indices[k], column, A->values[k]);
        return;
    }
    for (int32_t i = 0; i < A->rows; i++) {
        const double value =
            A->values[(size_t)i * A->row_stride + (size_t)column * A->column_stride];

        if (value != 0.0)
            visit(user, i, column, value);
    }
}

typedef struct components {
    int32_t *parents;
    int32_t apart[7]; /* apart[g]: some entry joins two groups of g unknowns; g = 3, 6 */
    int32_t count;    /* of a column: more than a block has room for, and there are none */
} components;

static void join(void *user, int32_t i, int32_t j, double value)
{
    components *c = user;

    (void)value;
    c->count++;
    for (int32_t g = 3; g <= 6; g += 3)
        c->apart[g] |= i / g != j / g;
    perp__join(c->parents, i, j);
}

/* Numbers the components in the order of their first unknowns; returns the largest. */
static int32_t number_components(perp__bodies *bodies, int32_t *parents)
{
    int32_t most = 0;

    bodies->blocks = perp__number_parts(parents, bodies->n);
    for (int32_t i = 0; i < bodies->n; i++)
        bodies->block_of[i] = parents[i];
    memset(parents, 0, (size_t)bodies->n * sizeof *parents); /* now: how many there are */
    for (int32_t i = 0; i < bodies->n; i++) {
        bodies->place_of[i] = parents[bodies->block_of[i]]++;
        if (bodies->place_of[i] + 1 > most)
            most = bodies->place_of[i] + 1;
    }
    return most;
}

static int32_t find_blocks(perp__bodies *bodies, const perp__bodies_input *input)
{
    const int32_t groups[2] = {bodies->most_rows == 2 ? 3 : 6, bodies->most_rows == 2 ? 6 : 3};
    components c = {bodies->mark, {0}, 0};

    for (int32_t i = 0; i < bodies->n; i++)
        c.parents[i] = i;
    for (int32_t j = 0; j < bodies->n; j++) {
        c.count = 0;
        perp__visit_column(input->M, j, join, &c);
        if (c.count > PERP__BODY_WIDTH_MOST)
            return 0;
    }
    for (int32_t k = 0; k < 2; k++) { /* planar bodies have 3 unknowns, others 6 */
        const int32_t g = groups[k];

        if (bodies->n % g != 0 || c.apart[g])
            continue;
        for (int32_t i = 0; i < bodies->n; i++) {
            bodies->block_of[i] = i / g;
            bodies->place_of[i] = i % g;
        }
        bodies->blocks = bodies->n / g;
        bodies->width = g;
        return 1;
    }
    bodies->width = number_components(bodies, c.parents);
    return bodies->width <= PERP__BODY_WIDTH_MOST;
}

static void add_mass(void *user, int32_t i, int32_t j, double value)
{
    perp__bodies *b = user;
    const size_t row = (size_t)b->block_of[i] * (size_t)b->width + (size_t)b->place_of[i];

    if (b->place_of[j] <= b->place_of[i])
        b->factors[row * (size_t)b->width + (size_t)b->place_of[j]] = value;
}

/* L in place of the lower triangle; returns the place at fault, or -1. */
static int32_t factor_block(double *L, int32_t width)
{
    for (int32_t j = 0; j < width; j++) {
        double pivot = L[j * width + j];

        for (int32_t k = 0; k < j; k++)
            pivot -= L[j * width + k] * L[j * width + k];
        if (!(pivot > DBL_EPSILON * L[j * width + j]))
            return j;
        pivot = sqrt(pivot);
        L[j * width + j] = pivot;
        for (int32_t i = j + 1; i < width; i++) {
            double sum = L[i * width + j];

            for (int32_t k = 0; k < j; k++)
                sum -= L[i * width + k] * L[j * width + k];
            L[i * width + j] = sum / pivot;
        }
    }
    return -1;
}

static perp_status fill_blocks(perp__bodies *bodies, const perp__bodies_input *input)
{
    const size_t width = (size_t)bodies->width, padded = (size_t)bodies->blocks * width;

    memset(bodies->free, 0, padded * sizeof *bodies->free);
    memset(bodies->factors, 0, padded * width * sizeof *bodies->factors);
    memset(bodies->sizes, 0, (size_t)bodies->blocks * sizeof *bodies->sizes);
    for (size_t k = 0; k < padded; k++)
        bodies->dofs[k] = -1;
    for (int32_t i = 0; i < bodies->n; i++) {
        bodies->dofs[(size_t)bodies->block_of[i] * width + (size_t)bodies->place_of[i]] = i;
        bodies->sizes[bodies->block_of[i]]++;
        perp__visit_column(input->M, i, add_mass, bodies);
    }
    for (size_t k = 0; k < padded; k++)
        if (bodies->dofs[k] < 0)
            bodies->factors[k * width + k % width] = 1.0;
    for (int32_t b = 0; b < bodies->blocks; b++) {
        const int32_t wrong =
            factor_block(bodies->factors + (size_t)b * width * width, bodies->width);

        if (wrong >= 0)
            return perp__refuse(bodies->context, "M is not positive definite: found at unknown %d",
                                (int)bodies->dofs[(size_t)b * width + (size_t)wrong]);
    }
    return PERP_OK;
}

perp_status perp__bodies_setup(perp__bodies *bodies, const perp__bodies_input *input,
                               int32_t *suits)
{
    perp_status status;

    bodies->n = input->n;
    bodies->contacts = input->contacts;
    bodies->size = input->size;
    bodies->constraints = input->contacts + input->size - input->starts[input->contacts];
    status =
        perp__arena_fit(&bodies->constraints_arena, bodies->context, layout_constraints, bodies);
    if (status != PERP_OK)
        return status;
    fill_constraints(bodies, input);
    *suits = find_blocks(bodies, input);
    if (!*suits)
        return PERP_OK;
    status = perp__arena_fit(&bodies->blocks_arena, bodies->context, layout_blocks, bodies);
    PERP__THEN(status, fill_blocks(bodies, input));
    if (status != PERP_OK)
        return status;
    return perp__bodies_fill_pieces(bodies, input);
}

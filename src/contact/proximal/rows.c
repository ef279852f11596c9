/* The problem as the method sees it: scaled rows on bodies, part after part, and their graph. */
#include "contact/proximal/proximal.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/sort.h"
#include "contact/law.h"

/* Whether r of its one row is of any sign: bilateral ones, and those with two bounds. */
static bool is_row(const perp__contact_problem *problem, int32_t constraint)
{
    return constraint >= problem->contacts ||
           perp__contact_first_row(problem, constraint) > problem->starts[constraint];
}

static int32_t own_rows(const perp__contact_problem *problem, int32_t constraint)
{
    int32_t rows;

    if (is_row(problem, constraint))
        return 1;
    rows = problem->starts[constraint + 1] - problem->starts[constraint];
    if (problem->mu[constraint] > 0.0 || rows > problem->dims[constraint] ||
        perp__contact_two_sided(problem, constraint) > 0)
        return rows;
    return 1;
}

/* Blocks that a constraint with compliance has to itself: as u = J v + c x, each row that yields
 * moves a body of its own by sqrt(c). */
static int32_t own_blocks(const perp__contact_problem *problem, int32_t constraint)
{
    const perp__bodies *b = problem->bodies;
    const int32_t rows = own_rows(problem, constraint);

    for (int32_t i = 0; i < rows; i++)
        if (b->compliance[perp__contact_first_row(problem, constraint) + i] > 0.0)
            return (rows + b->width - 1) / b->width;
    return 0;
}

/* The next constraint that W couples with this one, in ascending order, -1 behind the last; at:
 * where in the columns, as begin_constraint leaves it at first. */
static int32_t next_constraint(const perp__contact_problem *problem, int32_t constraint,
                               int32_t *at)
{
    const perp__matrix *W = problem->W;
    const int32_t constraints = problem->contacts + problem->size - problem->rows;
    const int32_t row = perp__contact_first_row(problem, constraint);
    const int32_t *ends = W->column_starts ? W->column_starts + row + 1 : NULL;
    int32_t least = INT32_MAX;

    while (!ends && at[0] < constraints) {
        const int32_t other = at[0]++, first = perp__contact_first_row(problem, other);

        for (int32_t j = row; j < row + own_rows(problem, constraint); j++)
            for (int32_t i = first; i < first + own_rows(problem, other); i++)
                if (perp__entry(problem->W, i, j) != 0.0)
                    return other;
    }
    for (int32_t j = 0; ends && j < own_rows(problem, constraint); j++)
        if (at[j] < ends[j] && problem->constraint_of[W->row_indices[at[j]]] < least)
            least = problem->constraint_of[W->row_indices[at[j]]];
    for (int32_t j = 0; ends && j < own_rows(problem, constraint); j++)
        while (at[j] < ends[j] && problem->constraint_of[W->row_indices[at[j]]] == least)
            at[j]++;
    return least < INT32_MAX ? least : -1;
}

static void begin_constraint(const perp__contact_problem *problem, int32_t constraint, int32_t *at)
{
    const int32_t *starts = problem->W->column_starts;

    for (int32_t j = 0; j < PERP__ROWS_MOST; j++)
        at[j] = starts && j < own_rows(problem, constraint)
                    ? starts[perp__contact_first_row(problem, constraint) + j]
                    : 0;
}

int64_t perp__proximal_couplings(const perp__contact_problem *problem)
{
    const int64_t constraints = problem->contacts + problem->size - problem->rows;
    int64_t count = 0;
    int32_t at[PERP__ROWS_MOST];

    for (int32_t k = 0; k < constraints; k++) {
        begin_constraint(problem, k, at);
        while (next_constraint(problem, k, at) >= 0)
            count++;
    }
    return 2 * count; /* and the other way round, where that is missing */
}

typedef struct sizes {
    size_t pieces, entries, edges, slots;
} sizes;

/* What there is of each at most; sets the numbers of constraints and blocks, and their width.
 * Without bodies: a block a constraint, or, where W is dense and so has no more entries, a block a
 * part; and that with W = Y'Y in the place of J J' where Y has so few rows that this is cheaper. */
static sizes measure(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;
    const perp__bodies *b = problem->bodies;
    const int32_t parts = problem->part && !problem->leaks ? problem->parts : 1;
    sizes most = {0, 0, 0, 0};
    int32_t all = 0, widest = 0;

    s->by_rows = b == NULL;
    s->whole = 0;
    s->side = problem->has_discs || problem->two_sided ? PERP__ROWS_MOST : 3;
    s->constraints = problem->contacts + problem->size - problem->rows;
    s->blocks = b ? b->blocks : s->constraints;
    s->width = b ? b->width : 1;
    for (int32_t k = 0; k < s->constraints; k++) {
        const int32_t rows = own_rows(problem, k), diagonal = b ? own_blocks(problem, k) : 0;
        const size_t pieces =
            b ? (size_t)(b->piece_starts[k + 1] - b->piece_starts[k] + diagonal) : 0;

        all += rows;
        s->blocks += diagonal;
        most.pieces += pieces;
        most.entries += pieces * (size_t)(rows * s->width);
        most.slots += pieces * pieces;
        s->width = !b && s->width < rows ? rows : s->width;
    }
    most.edges = most.slots + (size_t)s->blocks;
    if (b)
        return most;
    most.pieces = most.edges = most.slots = (size_t)perp__proximal_couplings(problem);
    most.entries = most.pieces * (size_t)(s->width * s->width);
    for (int32_t p = 0; p < parts && !problem->W->column_starts; p++) {
        int32_t rows = 0;

        for (int32_t k = 0; k < s->constraints; k++)
            if (parts == 1 || problem->part[k] == p)
                rows += own_rows(problem, k);
        widest = widest < rows ? rows : widest;
    }
    s->whole = widest > 0 && (double)parts * widest * widest <= 2.0 * (double)most.entries;
    if (!s->whole)
        return most;
    s->by_rows = !problem->half || 4 * widest < 5 * problem->half_rows;
    widest = s->by_rows ? widest : problem->half_rows;
    s->width = (widest + PERP__WHOLE_STEP - 1) / PERP__WHOLE_STEP * PERP__WHOLE_STEP;
    s->blocks = parts;
    most.pieces = most.slots = (size_t)s->constraints;
    most.edges = (size_t)parts;
    most.entries = (size_t)all * (size_t)s->width;
    return most;
}

void perp__proximal_layout(perp__arena *arena, void *work)
{
    perp__proximal *s = work;
    const perp__contact_problem *problem = s->common.problem;
    const sizes most = measure(s);
    const size_t constraints = (size_t)s->constraints, blocks = (size_t)s->blocks + 1;
    const size_t size = (size_t)problem->size, numbers = blocks * (size_t)s->width;
    const size_t square = (size_t)(s->side * s->side);

    s->part = perp__arena_take(arena, (size_t)problem->parts + 1, sizeof *s->part);
    PERP__INTEGERS(arena, constraints, &s->constraint, &s->place, &s->home);
    PERP__INTEGERS(arena, blocks, &s->block, &s->number, &s->mark, &s->graph_starts);
    s->starts = perp__arena_take(arena, constraints + 1, sizeof(int32_t));
    PERP__DOUBLES(arena, constraints, &s->radius);
    s->discs = NULL;
    if (s->side > 3)
        s->discs = perp__arena_take(arena, constraints, sizeof *s->discs);
    s->piece_starts = perp__arena_take(arena, constraints + 1, sizeof(int64_t));
    s->piece_blocks = perp__arena_take(arena, most.pieces, sizeof(int32_t));
    s->value_starts = perp__arena_take(arena, constraints, sizeof(int64_t));
    s->values = perp__arena_take(arena, most.entries, sizeof(double));
    PERP__DOUBLES(arena, s->whole ? most.entries : 0, &s->sloping, &s->images);
    s->slot_starts = perp__arena_take(arena, constraints, sizeof(int64_t));
    s->slots = perp__arena_take(arena, most.slots, sizeof(int32_t));
    s->graph = perp__arena_take(arena, most.edges, sizeof(int32_t));
    s->cones = perp__arena_take(arena, constraints, sizeof *s->cones);
    s->K = perp__arena_take(arena, square * constraints, sizeof(double));
    PERP__DOUBLES(arena, size, &s->scale, &s->q, &s->r, &s->u, &s->x, &s->z, &s->y, &s->best,
                  &s->start, &s->speed, &s->spare);
    PERP__DOUBLES(arena, numbers, &s->v, &s->step, &s->image, &s->rhs, &s->rest);
}

/* Constraints in the order of their parts. */
static void sort_constraints(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;
    const int32_t *part = problem->leaks ? NULL : problem->part;

    s->parts = part ? problem->parts : s->constraints > 0;
    for (int32_t p = 0; p < s->parts; p++)
        s->part[p].last_constraint = 0;
    for (int32_t k = 0; k < s->constraints; k++)
        s->part[part ? part[k] : 0].last_constraint++;
    for (int32_t p = 0, at = 0; p < s->parts; p++) {
        s->part[p].constraint = at;
        at += s->part[p].last_constraint;
        s->part[p].last_constraint = s->part[p].constraint;
    }
    for (int32_t k = 0; k < s->constraints; k++)
        s->constraint[s->part[part ? part[k] : 0].last_constraint++] = k;
    for (int32_t k = 0; k < s->constraints; k++)
        s->place[s->constraint[k]] = k;
}

/* 1 / sqrt(trace) in rows of a constraint; 1 where they move nothing. */
static void scale_rows(perp__proximal *s, int32_t k, int32_t first, int32_t count)
{
    const perp__contact_problem *problem = s->common.problem;
    const double *diagonal = problem->diagonal + perp__contact_first_row(problem, s->constraint[k]);
    double trace = 0.0;

    for (int32_t i = first; i < first + count; i++)
        trace += diagonal[i];
    for (int32_t i = first; i < first + count; i++)
        s->scale[s->starts[k] + i] = trace > 0.0 ? 1.0 / sqrt(trace) : 1.0;
}

/* Scales without the part's unit, and discs. */
static void set_scales(perp__proximal *s, int32_t k)
{
    const perp__contact_problem *problem = s->common.problem;
    const int32_t constraint = s->constraint[k], row = s->starts[k], rows = s->starts[k + 1] - row;
    const int32_t both = perp__contact_two_sided(problem, constraint);
    perp__contact_part parts[3];
    perp__discs *discs;
    bool turns;
    double m;

    for (int32_t i = row; i < row + rows; i++)
        s->scale[i] = 1.0 / sqrt(problem->trace[constraint]);
    if (s->discs)
        s->discs[k].count = 0;
    if (is_row(problem, constraint)) {
        s->radius[k] = -INFINITY;
        if (constraint < problem->contacts) /* -0.0 would be a contact's */
            s->radius[k] = -fmax(DBL_MIN, problem->mu[constraint] * problem->bound[constraint] /
                                              problem->omega[constraint] / s->scale[row]);
        return;
    }
    m = fmin(fmax(problem->mu[constraint], 1.0 / PERP__FIRST_RHO), 1.0); /* ice: not 1 / mu^2 */
    s->radius[k] = problem->mu[constraint] > 0.0 ? problem->mu[constraint] / m : 1.0;
    turns = rows > problem->dims[constraint];
    if (turns)
        scale_rows(s, k, 0, problem->dims[constraint]);
    if (rows > 1 && problem->mu[constraint] > 0.0)
        for (int32_t i = row; i < row + perp__contact_normals(problem, constraint); i++)
            s->scale[i] /= m;
    if (!turns && both == 0)
        return;
    discs = &s->discs[k];
    discs->both = both;
    discs->count = perp__contact_parts(problem, constraint, parts);
    for (int32_t p = 0, at = perp__discs_first(discs); p < discs->count; at += parts[p++].size) {
        discs->sizes[p] = parts[p].size;
        if (p > 0)
            scale_rows(s, k, at, parts[p].size);
        discs->radii[p] = parts[p].coefficient * (s->scale[row] / s->scale[row + at]);
    }
}

/* The pieces of a constraint, scaled, and, where it yields, those on blocks of its own. Blocks are
 * numbered as they are met. */
static int64_t copy_pieces(perp__proximal *s, int32_t k, int64_t at)
{
    const perp__contact_problem *problem = s->common.problem;
    const perp__bodies *b = problem->bodies;
    const int32_t constraint = s->constraint[k], d = s->starts[k + 1] - s->starts[k];
    const int32_t width = b->width, first = perp__contact_first_row(problem, constraint);
    const double *scale = s->scale + s->starts[k], *c = b->compliance + first;
    int64_t next = s->piece_starts[k];

    s->value_starts[k] = at;
    for (int64_t p = b->piece_starts[constraint]; p < b->piece_starts[constraint + 1]; p++) {
        const double *P = b->values + b->piece_values[p] + (first - b->rows[constraint]) * width;
        const int32_t block = b->piece_blocks[p];

        if (s->number[block] < 0) {
            s->block[s->blocks] = block;
            s->number[block] = s->blocks++;
        }
        s->piece_blocks[next++] = s->number[block];
        for (int32_t i = 0; i < d; i++)
            for (int32_t j = 0; j < width; j++)
                s->values[at++] = P[i * width + j] * scale[i];
    }
    for (int32_t e = 0; e < own_blocks(problem, constraint); e++) {
        s->block[s->blocks] = -1 - k;
        s->piece_blocks[next++] = s->blocks++;
        for (int32_t i = 0; i < d; i++)
            for (int32_t j = 0; j < width; j++)
                s->values[at++] = i == e * width + j ? sqrt(c[i]) * scale[i] : 0.0;
    }
    s->piece_starts[k + 1] = next;
    return at;
}

/* Rows of one part after the other. */
static void read_rows(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;
    int64_t at = 0;

    for (int32_t i = 0; problem->bodies && i < problem->bodies->blocks; i++)
        s->number[i] = -1;
    s->blocks = s->starts[0] = 0;
    s->piece_starts[0] = 0;
    for (int32_t p = 0; p < s->parts; p++) {
        perp__proximal_part *part = &s->part[p];

        part->block = s->blocks;
        part->row = s->starts[part->constraint];
        for (int32_t k = part->constraint; k < part->last_constraint; k++) {
            s->starts[k + 1] = s->starts[k] + own_rows(problem, s->constraint[k]);
            set_scales(s, k);
            if (problem->bodies) {
                at = copy_pieces(s, k, at);
                continue;
            }
            if (!s->whole || k == part->constraint)
                s->block[s->blocks++] = -1 - k;
            s->home[k] = (s->blocks - 1) * s->width + (s->whole ? s->starts[k] - part->row : 0);
        }
        part->last_block = s->blocks;
        part->last_row = s->starts[part->last_constraint];
    }
}

/* The constraints that couple every two of a list, W alone: a piece for each, in ascending order.
 * Room is left for what only one of two columns knows of, until the lists are closed up. */
static void list_couplings(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;
    int64_t *ends = s->slot_starts, at = 0;
    int32_t cursor[PERP__ROWS_MOST], constraint;

    memset(s->piece_starts, 0, ((size_t)s->constraints + 1) * sizeof *s->piece_starts);
    for (int32_t k = 0; k < s->constraints; k++)
        for (begin_constraint(problem, s->constraint[k], cursor);
             (constraint = next_constraint(problem, s->constraint[k], cursor)) >= 0;) {
            s->piece_starts[k + 1]++;
            s->piece_starts[s->place[constraint] + 1]++;
        }
    for (int32_t k = 0; k < s->constraints; k++) {
        s->piece_starts[k + 1] += s->piece_starts[k];
        ends[k] = s->piece_starts[k];
        s->mark[k] = -1;
    }
    for (int32_t k = 0; k < s->constraints; k++) /* row by row, */
        for (begin_constraint(problem, s->constraint[k], cursor);
             (constraint = next_constraint(problem, s->constraint[k], cursor)) >= 0;)
            s->piece_blocks[ends[s->place[constraint]]++] = k;
    for (int32_t k = 0; k < s->constraints; k++) { /* and what the columns alone have */
        for (int64_t p = s->piece_starts[k]; p < ends[k]; p++)
            s->mark[s->piece_blocks[p]] = k;
        for (begin_constraint(problem, s->constraint[k], cursor);
             (constraint = next_constraint(problem, s->constraint[k], cursor)) >= 0;)
            if (s->mark[s->place[constraint]] != k)
                s->piece_blocks[ends[k]++] = s->place[constraint];
        perp__sort_few(s->piece_blocks + s->piece_starts[k],
                       (int32_t)(ends[k] - s->piece_starts[k]));
    }
    for (int32_t k = 0; k < s->constraints; k++) {
        const int64_t from = s->piece_starts[k];

        s->piece_starts[k] = at;
        for (int64_t p = from; p < ends[k]; p++)
            s->piece_blocks[at++] = s->piece_blocks[p];
    }
    s->piece_starts[s->constraints] = at;
}

/* J = W, scaled on both sides. */
static void read_couplings(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;
    int64_t at = 0;

    list_couplings(s);
    for (int32_t k = 0; k < s->constraints; k++) {
        const int32_t row = perp__contact_first_row(problem, s->constraint[k]),
                      d = s->starts[k + 1] - s->starts[k];

        s->value_starts[k] = at;
        for (int64_t p = s->piece_starts[k]; p < s->piece_starts[k + 1]; p++) {
            const int32_t j = s->piece_blocks[p],
                          column = perp__contact_first_row(problem, s->constraint[j]);

            for (int32_t i = 0; i < d; i++)
                for (int32_t c = 0; c < s->width; c++)
                    s->values[at++] = c >= s->starts[j + 1] - s->starts[j]
                                          ? 0.0
                                          : perp__entry(problem->W, row + i, column + c) *
                                                s->scale[s->starts[k] + i] *
                                                s->scale[s->starts[j] + c];
        }
    }
}

/* J where a part is a block: W or Y'. */
static void read_whole(perp__proximal *s, const perp__proximal_part *part, int64_t at)
{
    const perp__contact_problem *problem = s->common.problem;

    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        s->piece_blocks[k] = part->block;
        s->piece_starts[k + 1] = k + 1;
        s->value_starts[k] = at;
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++, at += s->width) {
            const int32_t row =
                perp__contact_first_row(problem, s->constraint[k]) + i - s->starts[k];

            if (s->by_rows)
                memset(s->values + at, 0, (size_t)s->width * sizeof *s->values);
            for (int32_t j = part->constraint; s->by_rows && j < part->last_constraint; j++) {
                const int32_t column =
                    perp__contact_first_row(problem, s->constraint[j]) - s->starts[j];

                for (int32_t c = s->starts[j]; c < s->starts[j + 1]; c++)
                    s->values[at + c - part->row] =
                        perp__entry(problem->W, row, column + c) * s->scale[i] * s->scale[c];
            }
            for (int32_t l = 0; l < s->width && !s->by_rows; l++)
                s->values[at + l] =
                    l < problem->half_rows
                        ? problem->half[(size_t)l * problem->half_stride + (size_t)row] *
                              s->scale[i]
                        : 0.0;
        }
    }
}

/* The blocks that a constraint couples with block i. */
static int32_t list_neighbours(perp__proximal *s, int32_t i, int32_t k, int32_t at)
{
    for (int64_t p = s->piece_starts[k]; p < s->piece_starts[k + 1]; p++) {
        const int32_t j = s->piece_blocks[p];

        if (s->mark[j] != i)
            s->graph[at++] = j;
        s->mark[j] = i;
    }
    return at;
}

/* Which blocks share a constraint, or, with W alone, are coupled. */
static void read_graph(perp__proximal *s)
{
    const perp__bodies *b = s->common.problem->bodies;
    int32_t at = 0;

    for (int32_t i = 0; i < s->blocks; i++)
        s->mark[i] = -1;
    for (int32_t i = 0; i < s->blocks; i++) {
        const int32_t block = s->block[i];

        s->graph_starts[i] = at;
        s->mark[i] = i;
        s->graph[at++] = i;
        if (block < 0) /* of one constraint alone */
            at = list_neighbours(s, i, -1 - block, at);
        for (int64_t e = block < 0 ? 0 : b->block_starts[block];
             e < (block < 0 ? 0 : b->block_starts[block + 1]); e++)
            at = list_neighbours(s, i, s->place[b->block_constraints[e]], at);
        perp__sort_few(s->graph + s->graph_starts[i], at - s->graph_starts[i]);
    }
    s->graph_starts[s->blocks] = at;
}

perp_status perp__proximal_read(void *work)
{
    perp__proximal *s = work;
    const perp__contact_problem *problem = s->common.problem;
    perp_status status;
    int64_t at = 0;

    /* 1. Rows, pieces and speeds. */
    sort_constraints(s);
    read_rows(s);
    if (s->by_rows && !s->whole)
        read_couplings(s);
    for (int32_t p = 0; p < s->parts && s->whole; p++)
        read_whole(s, &s->part[p], (int64_t)s->part[p].row * s->width);
    for (int32_t k = 0; k < s->constraints; k++) {
        const double omega = problem->omega[s->constraint[k]];
        const double *q =
            problem->q + perp__contact_first_row(problem, s->constraint[k]) - s->starts[k];

        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            s->q[i] = q[i] / omega * s->scale[i];
    }
    /* 2. The graph of the factors, and where in it every two pieces of a constraint meet. */
    read_graph(s);
    status = perp__fronts_analyse(&s->fronts, problem->context, s->blocks, s->width,
                                  s->graph_starts, s->graph);
    for (int32_t k = 0; k < s->constraints && status == PERP_OK; k++) {
        s->slot_starts[k] = at;
        for (int64_t q = s->piece_starts[k]; q < s->piece_starts[k + 1]; q++)
            if (s->by_rows)
                s->slots[at++] =
                    perp__fronts_edge(&s->fronts, s->home[k] / s->width, s->piece_blocks[q]);
            else
                for (int64_t p = s->piece_starts[k]; p < s->piece_starts[k + 1]; p++)
                    s->slots[at++] =
                        perp__fronts_edge(&s->fronts, s->piece_blocks[p], s->piece_blocks[q]);
    }
    return status;
}

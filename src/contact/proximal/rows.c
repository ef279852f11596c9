/* The problem as the method sees it: scaled rows on bodies, part after part, and their graph. */
#include "contact/proximal/proximal.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/sort.h"
#include "contact/law.h"

/* Whether r of its one row is of any sign: bilateral ones, and those with two bounds. */
static int32_t is_row(const perp__contact_problem *problem, int32_t constraint)
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

static int32_t is_coupled(const perp__contact_problem *problem, int32_t constraint, int32_t other)
{
    for (int32_t j = 0; j < own_rows(problem, constraint); j++)
        for (int32_t i = 0; i < own_rows(problem, other); i++)
            if (perp__entry(problem->W, perp__contact_first_row(problem, other) + i,
                            perp__contact_first_row(problem, constraint) + j) != 0.0)
                return 1;
    return 0;
}

/* The next constraint that W couples with this one, in ascending order, -1 behind the last; at:
 * where in the columns, as begin_constraint leaves it at first. */
static int32_t next_constraint(const perp__contact_problem *problem, int32_t constraint,
                               int32_t *at)
{
    const perp__matrix *W = problem->W;
    const int32_t constraints = problem->contacts + problem->size - problem->rows;
    const int32_t *ends = W->column_starts
                              ? W->column_starts + perp__contact_first_row(problem, constraint) + 1
                              : NULL;
    int32_t least = INT32_MAX;

    while (!ends && at[0] < constraints)
        if (is_coupled(problem, constraint, at[0]++))
            return at[0] - 1;
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

static int32_t rows_of_part(const perp__contact_problem *problem, int32_t part)
{
    const int32_t constraints = problem->contacts + problem->size - problem->rows;
    int32_t rows = 0;

    for (int32_t k = 0; k < constraints; k++)
        rows +=
            !problem->part || problem->leaks || problem->part[k] == part ? own_rows(problem, k) : 0;
    return rows;
}

/* Without bodies: a block a constraint, or, where W is dense and so has no more entries, a block a
 * part; and that with W = Y'Y in the place of J J' where Y has so few rows that this is cheaper. */
static void choose_blocks(perp__proximal *s, sizes *most)
{
    const perp__contact_problem *problem = s->common.problem;
    const int32_t parts = problem->part && !problem->leaks ? problem->parts : 1;
    int32_t rows = 0, widest = 0;

    s->width = 1;
    for (int32_t k = 0; k < s->constraints; k++) {
        const int32_t own = own_rows(problem, k);

        rows += own;
        s->width = s->width < own ? own : s->width;
    }
    most->pieces = most->edges = most->slots = (size_t)perp__proximal_couplings(problem);
    most->entries = most->pieces * (size_t)(s->width * s->width);
    for (int32_t p = 0; p < parts && !problem->W->column_starts; p++) {
        const int32_t own = rows_of_part(problem, p);

        widest = widest < own ? own : widest;
    }
    s->whole = widest > 0 && (double)parts * widest * widest <= 2.0 * (double)most->entries;
    if (!s->whole)
        return;
    s->by_rows = !problem->half || widest < 2 * problem->half_rows;
    widest = s->by_rows ? widest : problem->half_rows;
    s->width = (widest + PERP__WHOLE_STEP - 1) / PERP__WHOLE_STEP * PERP__WHOLE_STEP;
    s->blocks = parts;
    most->pieces = most->slots = (size_t)s->constraints;
    most->edges = (size_t)parts;
    most->entries = (size_t)rows * (size_t)s->width;
}

/* What there is of each at most; sets the numbers of constraints and blocks, and their width. */
static sizes measure(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;
    const perp__bodies *b = problem->bodies;
    sizes most = {0, 0, 0, 0};

    s->by_rows = b == NULL;
    s->side = problem->has_discs || problem->two_sided ? PERP__ROWS_MOST : 3;
    s->constraints = problem->contacts + problem->size - problem->rows;
    s->blocks = b ? b->blocks : s->constraints;
    s->width = b ? b->width : 0;
    s->whole = 0;
    for (int32_t k = 0; b && k < s->constraints; k++) {
        const int32_t rows = own_rows(problem, k), own = own_blocks(problem, k);
        const size_t pieces = (size_t)(b->piece_starts[k + 1] - b->piece_starts[k] + own);

        s->blocks += own;
        most.pieces += pieces;
        most.entries += pieces * (size_t)(rows * s->width);
        most.slots += pieces * pieces;
    }
    most.edges = most.slots + (size_t)s->blocks;
    if (!b)
        choose_blocks(s, &most);
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
    if (s->side > 3) {
        s->discs = perp__arena_take(arena, constraints, sizeof *s->discs);
        PERP__DOUBLES(arena, size, &s->r, &s->u);
    }
    s->piece_starts = perp__arena_take(arena, constraints + 1, sizeof(int64_t));
    s->piece_blocks = perp__arena_take(arena, most.pieces, sizeof(int32_t));
    s->value_starts = perp__arena_take(arena, constraints, sizeof(int64_t));
    s->values = perp__arena_take(arena, most.entries, sizeof(double));
    s->slot_starts = perp__arena_take(arena, constraints, sizeof(int64_t));
    s->slots = perp__arena_take(arena, most.slots, sizeof(int32_t));
    s->graph = perp__arena_take(arena, most.edges, sizeof(int32_t));
    s->K = perp__arena_take(arena, square * constraints, sizeof(double));
    PERP__DOUBLES(arena, size, &s->scale, &s->q, &s->x, &s->z, &s->y, &s->best, &s->start,
                  &s->speed, &s->spare, &s->pull);
    PERP__DOUBLES(arena, numbers, &s->v, &s->step, &s->image, &s->rhs, &s->rest, &s->bend,
                  &s->ahead, &s->normal, &s->across);
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

/* The pieces of a constraint, scaled. */
static int64_t copy_pieces(perp__proximal *s, int32_t k, int64_t at)
{
    const perp__bodies *b = s->common.problem->bodies;
    const int32_t constraint = s->constraint[k], d = s->starts[k + 1] - s->starts[k],
                  width = b->width;
    const int32_t skipped =
        perp__contact_first_row(s->common.problem, constraint) - b->rows[constraint];
    int64_t own = s->piece_starts[k];

    s->value_starts[k] = at;
    for (int64_t p = b->piece_starts[constraint]; p < b->piece_starts[constraint + 1]; p++) {
        const double *P = b->values + b->piece_values[p] + skipped * width;

        s->piece_blocks[own++] = s->number[b->piece_blocks[p]];
        for (int32_t i = 0; i < d; i++)
            for (int32_t j = 0; j < width; j++)
                s->values[at++] = P[i * width + j] * s->scale[s->starts[k] + i];
    }
    s->piece_starts[k + 1] = own;
    return at;
}

/* The pieces of a constraint that yields on the blocks of its own. */
static int64_t add_compliance(perp__proximal *s, int32_t k, int64_t at)
{
    const perp__contact_problem *problem = s->common.problem;
    const double *c =
        problem->bodies->compliance + perp__contact_first_row(problem, s->constraint[k]);
    const int32_t d = s->starts[k + 1] - s->starts[k], width = s->width;

    for (int32_t e = 0; e < own_blocks(problem, s->constraint[k]); e++) {
        s->block[s->blocks] = -1 - k;
        s->piece_blocks[s->piece_starts[k + 1]++] = s->blocks++;
        for (int32_t i = 0; i < d; i++)
            for (int32_t j = 0; j < width; j++)
                s->values[at++] =
                    i == e * width + j ? sqrt(c[i]) * s->scale[s->starts[k] + i] : 0.0;
    }
    return at;
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

static void set_discs(perp__proximal *s, int32_t k)
{
    const int32_t row = s->starts[k];
    perp__contact_part parts[3];
    perp__discs *discs = &s->discs[k];

    discs->both = perp__contact_two_sided(s->common.problem, s->constraint[k]);
    discs->count = perp__contact_parts(s->common.problem, s->constraint[k], parts);
    for (int32_t p = 0, at = perp__discs_first(discs); p < discs->count; at += parts[p++].size) {
        discs->sizes[p] = parts[p].size;
        if (p > 0)
            scale_rows(s, k, at, parts[p].size);
        discs->radii[p] = parts[p].coefficient * (s->scale[row] / s->scale[row + at]);
    }
}

/* Scales without the part's unit. */
static void set_scales(perp__proximal *s, int32_t k)
{
    const perp__contact_problem *problem = s->common.problem;
    const int32_t constraint = s->constraint[k], row = s->starts[k], rows = s->starts[k + 1] - row;
    int32_t turns;

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
    s->radius[k] = fmax(problem->mu[constraint], 1.0);
    turns = rows > problem->dims[constraint];
    if (turns)
        scale_rows(s, k, 0, problem->dims[constraint]);
    if (rows > 1 && problem->mu[constraint] > 0.0)
        for (int32_t i = row; i < row + perp__contact_normals(problem, constraint); i++)
            s->scale[i] /= fmin(problem->mu[constraint], 1.0);
    if (turns || perp__contact_two_sided(problem, constraint) > 0)
        set_discs(s, k);
}

/* Blocks are numbered as they are met. */
static int64_t read_pieces(perp__proximal *s, const perp__proximal_part *part, int32_t k,
                           int64_t at)
{
    const perp__bodies *b = s->common.problem->bodies;
    const int32_t constraint = s->constraint[k];

    if (!b) {
        if (!s->whole || k == part->constraint)
            s->block[s->blocks++] = -1 - k;
        s->home[k] = (s->blocks - 1) * s->width + (s->whole ? s->starts[k] - part->row : 0);
        return at;
    }
    for (int64_t q = b->piece_starts[constraint]; q < b->piece_starts[constraint + 1]; q++)
        if (s->number[b->piece_blocks[q]] < 0) {
            s->block[s->blocks] = b->piece_blocks[q];
            s->number[b->piece_blocks[q]] = s->blocks++;
        }
    return add_compliance(s, k, copy_pieces(s, k, at));
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
            at = read_pieces(s, part, k, at);
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

/* Row i of W, row `of_W` there, scaled on both sides. */
static void copy_row(const perp__proximal *s, const perp__proximal_part *part, int32_t i,
                     int32_t of_W, double *to)
{
    const perp__contact_problem *problem = s->common.problem;

    memset(to, 0, (size_t)s->width * sizeof *to);
    for (int32_t j = part->constraint; j < part->last_constraint; j++) {
        const int32_t column = perp__contact_first_row(problem, s->constraint[j]) - s->starts[j];

        for (int32_t c = s->starts[j]; c < s->starts[j + 1]; c++)
            to[c - part->row] =
                perp__entry(problem->W, of_W, column + c) * s->scale[i] * s->scale[c];
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
                copy_row(s, part, i, row, s->values + at);
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

static void find_slots(perp__proximal *s)
{
    int64_t at = 0;

    for (int32_t k = 0; k < s->constraints; k++) {
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
}

static void read_speeds(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;

    for (int32_t k = 0; k < s->constraints; k++) {
        const double omega = problem->omega[s->constraint[k]];
        const double *q =
            problem->q + perp__contact_first_row(problem, s->constraint[k]) - s->starts[k];

        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            s->q[i] = q[i] / omega * s->scale[i];
    }
}

perp_status perp__proximal_read(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;
    perp_status status;

    sort_constraints(s);
    read_rows(s);
    if (s->by_rows && !s->whole)
        read_couplings(s);
    for (int32_t p = 0; p < s->parts && s->whole; p++)
        read_whole(s, &s->part[p], (int64_t)s->part[p].row * s->width);
    read_speeds(s);
    read_graph(s);
    status = perp__fronts_analyse(&s->fronts, problem->context, s->blocks, s->width,
                                  s->graph_starts, s->graph);
    if (status == PERP_OK)
        find_slots(s);
    return status;
}

#include "contact/coloured/joint_block.h"

#include <math.h>
#include <string.h>

#include "base/context.h"

/* On a unit diagonal, between rounding, which a factor of 1 / RIDGE makes larger, and what the next
 * pass has to make up for: eps^(5/6). */
#define RIDGE 0x1p-43

static void lay_out_rows(perp__arena *arena, void *object)
{
    perp__joint_block *b = object;
    const size_t rows = (size_t)b->most_rows;

    PERP__INTEGERS(arena, rows, &b->all, &b->mark, &b->place);
    PERP__INTEGERS(arena, 2 * rows, &b->body, &b->touching);
    b->starts = perp__arena_take(arena, rows + 1, sizeof *b->starts);
    b->first = perp__arena_take(arena, (size_t)b->most_bodies + 2, sizeof *b->first);
    PERP__DOUBLES(arena, rows, &b->scale, &b->w, &b->r, &b->last, &b->error);
    b->P = perp__arena_take(arena, 16 * rows, sizeof *b->P);
}

static void lay_out_entries(perp__arena *arena, void *object)
{
    perp__joint_block *b = object;

    b->indices = perp__arena_take(arena, (size_t)b->most_entries, sizeof *b->indices);
    b->values = perp__arena_take(arena, (size_t)b->most_entries, sizeof *b->values);
}

/* Row i of the unit g as row n of the block. */
static void read_row(perp__joint_block *b, const perp__rigid_problem *problem,
                     const perp__rigid_rows *g, int32_t i, int32_t n)
{
    const int32_t width = problem->width;

    b->w[n] = g->bias[i];
    memset(b->P + 16 * n, 0, 16 * sizeof *b->P);
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = g->body[side], moves = body >= 0 && body < problem->bodies;
        const double *J = g->rows[side][i],
                     *C = problem->factors + (moves ? width * width * body : 0);
        double *P = b->P + 16 * n + 8 * side;

        b->body[2 * n + side] = moves ? body : -1;
        for (int32_t k = 0; k < width && body >= 0; k++)
            if (!moves)
                b->w[n] += J[k] * problem->free[width * body + k];
            else if (J[k] != 0.0)
                for (int32_t j = 0; j < width; j++)
                    P[j] += J[k] * C[width * k + j];
    }
}

/* The rows of each body, in order; returns the most entries that K can have. */
static int64_t list_rows(perp__joint_block *b, int32_t bodies)
{
    int64_t most = 0;

    memset(b->first, 0, (size_t)(bodies + 2) * sizeof *b->first);
    for (int32_t k = 0; k < 2 * b->rows; k++)
        if (b->body[k] >= 0)
            b->first[b->body[k] + 2]++;
    for (int32_t i = 0; i < bodies; i++) {
        most += (int64_t)b->first[i + 2] * b->first[i + 2];
        b->first[i + 2] += b->first[i + 1];
    }
    for (int32_t k = 0; k < 2 * b->rows; k++)
        if (b->body[k] >= 0)
            b->touching[b->first[b->body[k] + 1]++] = k;
    return most;
}

/* K = P P', column by column: rows meet on the bodies that they share. */
static void multiply(perp__joint_block *b)
{
    int32_t entries = 0;

    for (int32_t j = 0; j < b->rows; j++)
        b->mark[j] = -1;
    for (int32_t j = 0; j < b->rows; j++) {
        b->starts[j] = entries;
        for (int32_t side = 0; side < 2; side++) {
            const int32_t body = b->body[2 * j + side];
            const double *P = b->P + 16 * j + 8 * side;

            for (int32_t k = body < 0 ? 0 : b->first[body]; body >= 0 && k < b->first[body + 1];
                 k++) {
                const int32_t i = b->touching[k] / 2;
                const double *Q = b->P + 8 * b->touching[k];
                double sum = 0.0;

                for (int32_t l = 0; l < 6; l++)
                    sum += P[l] * Q[l];
                if (b->mark[i] != j) {
                    b->mark[i] = j;
                    b->place[i] = entries;
                    b->indices[entries] = i;
                    b->values[entries++] = 0.0;
                }
                b->values[b->place[i]] += sum;
            }
        }
        b->scale[j] = b->mark[j] == j ? b->values[b->place[j]] : 0.0;
        b->scale[j] = b->scale[j] > 0.0 ? 1.0 / sqrt(b->scale[j]) : 0.0;
        b->all[j] = j;
    }
    b->starts[b->rows] = entries;
}

/* 1. P of the equations, 2. K, 3. its factors: with a larger ridge where rounding made a pivot
 * negative. A ridge beyond the number of rows is enough unless K left the range of doubles. */
perp_status perp__joint_block_set_up(perp__joint_block *b, perp_context *context,
                                     const perp__rigid_problem *problem)
{
    double ridge = RIDGE;
    int32_t rows = 0;
    int64_t entries;
    perp_status status;

    b->rows = 0;
    for (int32_t k = problem->contacts; k < problem->contacts + problem->joints; k++)
        rows += problem->rows[k].dim;
    if (rows == 0)
        return PERP_OK;
    perp__raise_room(&b->most_rows, rows);
    perp__raise_room(&b->most_bodies, problem->bodies);
    status = perp__arena_fit(&b->arena, context, lay_out_rows, b);
    if (status != PERP_OK)
        return status;
    for (int32_t k = problem->contacts; k < problem->contacts + problem->joints; k++)
        for (int32_t i = 0; i < problem->rows[k].dim; i++, b->rows++) {
            read_row(b, problem, &problem->rows[k], i, b->rows);
            b->r[b->rows] = b->last[b->rows] = problem->warm ? problem->warm[3 * k + i] : 0.0;
        }
    entries = list_rows(b, problem->bodies);
    if (entries > INT32_MAX)
        return perp__fail_memory(context, "the equations of joints");
    perp__raise_room(&b->most_entries, (int32_t)entries);
    status = perp__arena_fit(&b->entry_arena, context, lay_out_entries, b);
    if (status != PERP_OK)
        return status;
    multiply(b);
    b->K = (perp__matrix){.rows = rows,
                          .columns = rows,
                          .row_stride = 1,
                          .column_stride = 1,
                          .column_starts = b->starts,
                          .row_indices = b->indices,
                          .values = b->values};
    status = perp__sparse_cholesky_analyse(&b->cholesky, context, &b->K, b->scale);
    for (b->factored = 0; status == PERP_OK && !b->factored && ridge < 1e6 * rows; ridge *= 100.0)
        b->factored = perp__sparse_cholesky_factor(&b->cholesky, b->all, rows, ridge);
    return status;
}

void perp__joint_block_release(perp__joint_block *b)
{
    perp__sparse_cholesky_release(&b->cholesky);
    perp__arena_release(&b->arena);
    perp__arena_release(&b->entry_arena);
}

/* y += P_n' r of row n. */
static void push(const perp__joint_block *b, int32_t n, double r, double *y)
{
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = b->body[2 * n + side];
        const double *P = b->P + 16 * n + 8 * side;

        for (int32_t k = 0; body >= 0 && k < 6; k++)
            y[8 * body + k] += P[k] * r;
    }
}

void perp__joint_block_add(const perp__joint_block *b, double *y)
{
    for (int32_t n = 0; n < b->rows; n++)
        push(b, n, b->r[n], y);
}

/* b->error := K^-1 (P y + share w), and y less what that pushes. Returns the largest that a row
 * lacked before. */
static double meet(perp__joint_block *b, double share, double *y)
{
    double *e = b->error, largest = 0.0;

    if (!b->factored) {
        memset(e, 0, (size_t)b->rows * sizeof *e);
        return INFINITY;
    }
    for (int32_t n = 0; n < b->rows; n++) {
        double sum = share * b->w[n];

        for (int32_t side = 0; side < 2; side++) {
            const int32_t body = b->body[2 * n + side];
            const double *P = b->P + 16 * n + 8 * side;

            for (int32_t k = 0; body >= 0 && k < 6; k++)
                sum += P[k] * y[8 * body + k];
        }
        e[n] = b->scale[n] * sum;
        largest = fabs(e[n]) > largest ? fabs(e[n]) : largest;
    }
    perp__sparse_cholesky_solve(&b->cholesky, e);
    for (int32_t n = 0; n < b->rows; n++) {
        e[n] *= b->scale[n];
        push(b, n, -e[n], y);
    }
    return largest;
}

double perp__joint_block_solve(perp__joint_block *b, double momentum, double *y)
{
    const double lack = b->rows > 0 ? meet(b, 1.0, y) : 0.0;

    for (int32_t n = 0; n < b->rows; n++) {
        const double now = b->r[n];

        b->r[n] = now + momentum * (now - b->last[n]) - b->error[n];
        b->last[n] = now;
    }
    return lack;
}

void perp__joint_block_project(perp__joint_block *b, double *y)
{
    if (b->rows > 0)
        (void)meet(b, 0.0, y);
}

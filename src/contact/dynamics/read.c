/* Checks of the dynamics that a caller hands over. */
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "contact/dynamics/dynamics.h"

/* Of sqrt(M_ii M_jj): mass matrices from the field are symmetric to rounding. */
#define SYMMETRIC 1e-8

/* Up to so many velocities places in the columns of a sparse M are kept, not looked for. */
enum { KEPT = 128 };

static perp_status check_pair(perp_context *context, const perp__matrix *M, int32_t i, int32_t j)
{
    const double a = perp__entry(M, i, j), b = perp__entry(M, j, i);

    if (a == b ||
        fabs(a - b) <= SYMMETRIC * sqrt(perp__entry(M, i, i)) * sqrt(perp__entry(M, j, j)))
        return PERP_OK;
    return perp__refuse(context, "M(%d,%d) is %g but M(%d,%d) is %g: M is not symmetric", (int)i,
                        (int)j, a, (int)j, (int)i, b);
}

static perp_status check_dense(perp_context *context, const perp__matrix *M)
{
    perp_status status = PERP_OK;

    for (int32_t j = 0; j < M->columns; j++) {
        const double *column = M->values + (size_t)j * M->column_stride;
        const double *row = M->values + (size_t)j * M->row_stride;

        for (int32_t i = 0; i < j && status == PERP_OK; i++)
            if (column[(size_t)i * M->row_stride] != row[(size_t)i * M->column_stride])
                status = check_pair(context, M, i, j);
    }
    return status;
}

/* The mirror images of the entries of the columns 0, 1, ... come in the order of their columns. */
static perp_status check_sparse(perp_context *context, const perp__matrix *M)
{
    const int32_t keeps = M->columns <= KEPT;
    perp_status status = PERP_OK;
    int32_t next[KEPT];

    for (int32_t j = 0; keeps && j < M->columns; j++)
        next[j] = M->column_starts[j];
    for (int32_t j = 0; j < M->columns; j++)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1] && status == PERP_OK;
             k++) {
            const int32_t i = M->row_indices[k], at = keeps ? next[i] : 0;

            if (keeps && at < M->column_starts[i + 1] && M->row_indices[at] == j) {
                next[i]++;
                if (M->values[at] == M->values[k])
                    continue;
            }
            status = check_pair(context, M, i, j);
        }
    return status;
}

static perp_status check_mass(perp_context *context, const perp__matrix *M)
{
    for (int32_t i = 0; i < M->rows; i++)
        if (!(perp__entry(M, i, i) > 0.0))
            return perp__refuse(context, "M(%d,%d) is %g: M is not positive definite", (int)i,
                                (int)i, perp__entry(M, i, i));
    return M->column_starts ? check_sparse(context, M) : check_dense(context, M);
}

static perp_status read_mass(perp_context *context, perp__dynamics *own,
                             const perp_contact_dynamics *dynamics)
{
    perp_status status;

    if (!dynamics->M == !dynamics->solve)
        return perp__refuse(context, "dynamics.M and dynamics.solve are %s: exactly one is needed",
                            dynamics->M ? "both given" : "both NULL");
    own->has_M = dynamics->M != NULL;
    own->solve = dynamics->solve;
    own->user = dynamics->user;
    if (!own->has_M)
        return PERP_OK;
    status = perp__matrix_read_sized(context, "M", &own->M, dynamics->M, own->n, own->n);
    return status == PERP_OK ? check_mass(context, &own->M) : status;
}

static perp_status read_rows(perp_context *context, const char *name, perp__matrix *own,
                             const perp_matrix *given, int32_t rows, int32_t n)
{
    perp_status status = perp__matrix_read(context, name, own, given);

    if (status == PERP_OK && own->columns != n)
        status =
            perp__refuse(context, "%s has %d columns, expected one for each of the %d velocities",
                         name, (int)own->columns, (int)n);
    if (status == PERP_OK && rows >= 0 && own->rows != rows)
        status = perp__refuse(context, "%s has %d rows, but the contacts have %d", name,
                              (int)own->rows, (int)rows);
    return status;
}

perp_status perp__dynamics_read(perp_context *context, perp__dynamics *own, int32_t rows,
                                const perp_contact_dynamics *dynamics)
{
    perp_contact_dynamics read = {0};
    perp_status status = perp__check_pointer(context, "dynamics", dynamics);

    PERP__THEN(status, PERP__READ(perp_contact_dynamics, context, &read, dynamics));
    if (status != PERP_OK)
        return status;
    if (read.n < 0 || read.reserved != 0)
        return perp__refuse(context, "dynamics.%s is %d", read.n < 0 ? "n" : "reserved",
                            (int)(read.n < 0 ? read.n : read.reserved));
    own->context = context;
    own->n = read.n;
    status = read_mass(context, own, &read);
    PERP__THEN(status, read_rows(context, "H", &own->H, read.H, rows, read.n));
    memset(&own->G, 0, sizeof own->G);
    own->G.columns = read.n;
    own->G.row_stride = own->G.column_stride = 1;
    if (status == PERP_OK && read.G)
        status = read_rows(context, "G", &own->G, read.G, -1, read.n);
    if (status == PERP_OK && own->G.rows > INT32_MAX - own->H.rows)
        status = perp__refuse(context, "H and G have too many rows");
    own->size = status == PERP_OK ? own->H.rows + own->G.rows : 0;
    return status;
}

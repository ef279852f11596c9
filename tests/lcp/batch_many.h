/* Many problems of one size for perp_lcp_batch, and groups of its kernels that read them. For
 * test_batch*.c. */
#ifndef PERP_TESTS_LCP_BATCH_MANY_H
#define PERP_TESTS_LCP_BATCH_MANY_H

#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "lcp/batch/group.h"
#include "run.h"

#include "context.h"

enum { N = 12, COUNT = 203 }; /* 203: not a multiple of any vector's width */

/* COUNT problems, one after the other, and what perp_lcp_batch says of them. */
typedef struct many {
    int32_t n;
    double *M, *q, *lower, *upper, *known; /* known: exact solutions */
    double *z, *w, *residuals;
    int32_t *outcomes;
} many;

static inline void allocate(many *p, int32_t n)
{
    const size_t all = (size_t)COUNT * (size_t)n;

    p->n = n;
    p->M = check_allocate(all * (size_t)n, sizeof(double));
    p->q = check_allocate(all, sizeof(double));
    p->lower = check_allocate(all, sizeof(double));
    p->upper = check_allocate(all, sizeof(double));
    p->known = check_allocate(all, sizeof(double));
    p->z = check_allocate(all, sizeof(double));
    p->w = check_allocate(all, sizeof(double));
    p->residuals = check_allocate(COUNT, sizeof(double));
    p->outcomes = check_allocate(COUNT, sizeof(int32_t));
}

static inline void release(many *p)
{
    free(p->M);
    free(p->q);
    free(p->lower);
    free(p->upper);
    free(p->known);
    free(p->z);
    free(p->w);
    free(p->residuals);
    free(p->outcomes);
}

static inline perp_status solve(many *p, const perp_lcp_settings *settings, int32_t threads)
{
    return perp_lcp_batch(context, p->z, p->w, p->outcomes, p->residuals, settings, threads,
                          LCP_STACK(COUNT, p->n, p->M, p->q, p->lower, p->upper));
}

/* As groups read them. */
static inline perp__batch_data data_of(const many *p)
{
    perp__batch_data data;

    memset(&data, 0, sizeof data);
    data.stack.count = COUNT;
    data.stack.n = p->n;
    data.scaling = 1;
    data.stack.M = p->M;
    data.stack.q = p->q;
    data.stack.lower = p->lower;
    data.stack.upper = p->upper;
    return data;
}

/* A group of the kernel's width, in an arena of its own. */
static inline void open_group(perp__batch_group *group, perp__arena *arena, const many *p,
                              const perp__batch_kernel *kernel)
{
    memset(group, 0, sizeof *group);
    group->n = p->n;
    group->width = kernel->width;
    memset(arena, 0, sizeof *arena);
    assert_int_equal(perp__arena_fit(arena, context, perp__batch_group_layout, group), PERP_OK);
}

#endif

/* Linear complementarity problems from bytes, for the targets of perp/lcp.h. */
#ifndef PERP_TESTS_FUZZ_PROBLEM_H
#define PERP_TESTS_FUZZ_PROBLEM_H

#include "fuzz.h"
#include "oracle.h"

typedef struct lcp_problem {
    int32_t n;
    fuzz_mood mood;
    fuzz_matrix M;
    double *q, *lower, *upper;               /* n each, what holds */
    const double *lower_given, *upper_given; /* what is handed over: NULL for the defaults */
    int plain;                               /* 0 <= z perp w >= 0 */
    int integer;                             /* plain, n <= ORACLE_LARGEST, entries -3 .. 3: */
    int iM[ORACLE_LARGEST * ORACLE_LARGEST], iq[ORACLE_LARGEST];
} lcp_problem;

/* From `least` to `most` unknowns. */
void lcp_problem_make(fuzz_bytes *bytes, lcp_problem *problem, int32_t least, int32_t most);
/* w = M z + q and the sizes of its terms. */
void lcp_problem_rows(const lcp_problem *problem, const double *z, wide *w, wide *t);
/* The same with every setting of the bytes' choice; returns whether one of them may end a solve
 * before its method does. */
int lcp_settings_make(fuzz_bytes *bytes, perp_lcp_settings *settings);
/* Everything that perp/lcp.h promises of z, w (or NULL) and an outcome. */
void lcp_problem_check(const char *where, const lcp_problem *problem, const double *z,
                       const double *w, int32_t outcome, double tol, int ended_early);

#endif

/* What the gate is told of the point that was evaluated last. */
#ifndef PERP_LCP_EVIDENCE_H
#define PERP_LCP_EVIDENCE_H

#include "base/outcome.h"
#include "lcp/solver.h"

/* `unit`: that of a point which is not refined, so that rounding is beside its largest entry; 1
 * else. */
static inline perp__evidence perp__evidence_of(const perp_lcp_solver *solver,
                                               const perp__evaluation *worth, double unit)
{
    const size_t n = (size_t)solver->n;
    const perp__evidence evidence = {worth->tested / unit, worth->tested / unit, worth->backward,
                                     perp__all_finite(solver->z, n) &&
                                         perp__all_finite(solver->w_high, n)};

    return evidence;
}

#endif

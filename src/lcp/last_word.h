/* Enumeration as the end of `auto` on small problems. */
#ifndef PERP_LCP_LAST_WORD_H
#define PERP_LCP_LAST_WORD_H

#include "lcp/solver.h"

/* Whether the solver's problem is small enough and its method `auto`. */
int32_t perp__has_last_word(const perp_lcp_solver *solver);

/* Searches the index sets and keeps the first solution that the gate takes as the best candidate.
 * PERP_OK, _MEMORY, or _CALLBACK if the monitor aborts. */
perp_status perp__last_word(perp_lcp_solver *solver);

void perp__last_word_release(perp_lcp_solver *solver);

#endif

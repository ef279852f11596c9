/* The NCP front door for the layers above: as the public functions, without entering the context
 * (the caller is inside a public call already) and with failures written into its message. */
#ifndef PERP_NCP_NCP_H
#define PERP_NCP_NCP_H

#include <perp/ncp.h>

perp_status perp__ncp_create(perp_context *context, perp_ncp_solver **solver,
                             const perp_ncp_settings *settings);
perp_status perp__ncp_setup(perp_ncp_solver *solver, const perp_ncp_problem *problem);
perp_status perp__ncp_solve(perp_ncp_solver *solver, double *z, double *w, perp_ncp_result *result,
                            const double *z0);

#endif

/* A problem in velocities as perp/contact.h takes it. */
#ifndef PERP_MECHANISM_ASSEMBLY_H
#define PERP_MECHANISM_ASSEMBLY_H

#include "mechanism/mechanism.h"

/* Makes room and a solver. pressures: contacts with friction of a pressure; PERP_OK or _MEMORY. */
perp_status perp__assembly_create(perp_mechanism *m, perp__assembly *a, int32_t pressures,
                                  double tol, int32_t cone);
void perp__assembly_release(perp__assembly *a);

/* Sets up and solves what a->... describe; fills a->v, r, u, modes, ray and answer's outcome.
 * G has `bilateral` rows. PERP_OK or a negative status with its message. */
perp_status perp__assembly_solve(perp_mechanism *m, perp__assembly *a, int32_t bilateral,
                                 perp__velocity_answer *answer);

#endif

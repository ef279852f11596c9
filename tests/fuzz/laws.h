/* Contacts and their coefficients from bytes, for the targets of perp/contact.h. */
#ifndef PERP_TESTS_FUZZ_LAWS_H
#define PERP_TESTS_FUZZ_LAWS_H

#include "fuzz.h"
#include "oracle.h"

#define LAWS_CONTACTS 5
#define LAWS_BOUNDED 3
#define LAWS_ROWS (6 * LAWS_CONTACTS + LAWS_BOUNDED + 2)
#define LAWS_MOST (4 * LAWS_CONTACTS + LAWS_BOUNDED + 2)

typedef struct laws_problem {
    perp_contact_laws laws;
    int32_t rows, count; /* rows with the bilateral ones; of `law` */
    int32_t dims[LAWS_CONTACTS], two_sided[LAWS_CONTACTS];
    double mu[LAWS_CONTACTS], rolling[LAWS_CONTACTS], spinning[LAWS_CONTACTS];
    double compliance[LAWS_ROWS], lower[LAWS_BOUNDED], upper[LAWS_BOUNDED];
    oracle_law law[LAWS_MOST];
    int32_t first[LAWS_CONTACTS];
} laws_problem;

void laws_make(fuzz_bytes *bytes, fuzz_mood mood, laws_problem *problem);
int laws_settings_make(fuzz_bytes *bytes, perp_contact_settings *settings, laws_problem *problem);
/* Everything that perp/contact.h promises of an answer; W and q without compliance. u and modes as
 * returned. */
void laws_check(const char *where, const laws_problem *problem, wide *W, const wide *q,
                const wide *t, const perp_contact_settings *settings,
                const perp_contact_result *result, const double *r, const double *u,
                const int32_t *modes);

#endif

/* The numbers that the files of statics, and who asks them, share. */
#ifndef PERP_CONTACT_STATICS_TUNING_H
#define PERP_CONTACT_STATICS_TUNING_H

/* Beside its terms: what a body's balance may lack in the end, and what counts as nothing of it
 * before: entries of a column, a gap, a share of the way; and what doubles come to at best, where
 * refinement ends. The margins of tests/contact/test_statics are down to 1e-9, those that doubled
 * precision tells to 1e-13. */
#define PERP__BALANCED 1e-12
#define PERP__BALANCED_AT_BEST 1e-15

/* Factorisations of a decision at most: some 30 do. */
#define PERP__STATICS_ITERATIONS 100

#endif

/* The numbers that several files of the contact layer share. */
#ifndef PERP_CONTACT_TUNING_H
#define PERP_CONTACT_TUNING_H

/* How far beyond what is known now an impulse is likely to reach. */
#define PERP__REACH 16.0

/* Added to the diagonal of what may be singular, beside its trace; what is exact is refined. */
#define PERP__REGULAR 1e-10

/* The same of blocks of joints and of the equations of statics, whose rows may say the same:
 * between rounding, which a factor of one over it makes larger, and what is to be made up for: near
 * eps^(5/6). */
#define PERP__RIDGE 1e-13

/* Sweeps after which their rate is looked at, and it shows what comes to rest. */
#define PERP__FIRST_LOOK 10

/* Of statics, beside its terms: what a body's balance may lack in the end, and what counts as
 * nothing of it before: entries of a column, a gap, a share of the way; and what doubles come to at
 * best, where refinement ends. The margins of tests/contact/test_statics are down to 1e-9, those
 * that doubled precision tells to 1e-13. */
#define PERP__BALANCED 1e-12
#define PERP__BALANCED_AT_BEST 1e-15

/* Factorisations of a decision at most: some 30 do. */
#define PERP__STATICS_ITERATIONS 100

#endif

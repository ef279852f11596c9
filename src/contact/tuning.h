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

#endif

/* Wall time for reports and, only where a time limit is set, for decisions. */
#ifndef PERP_BASE_CLOCK_H
#define PERP_BASE_CLOCK_H

/* Seconds on a clock that never goes backwards. */
double perp__now(void);

/* Seconds until a deadline on that clock, for a time limit: more than 0 where it is over. */
double perp__time_left(double deadline);

#endif

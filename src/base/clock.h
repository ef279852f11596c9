/* Wall time for reports and, only where a time limit is set, for decisions. */
#ifndef PERP_BASE_CLOCK_H
#define PERP_BASE_CLOCK_H

/* Seconds on a clock that never goes backwards. */
double perp__now(void);

#endif

/* Wall time for reports and, only where a time limit is set, for decisions. */
#ifndef PERP_BASE_CLOCK_H
#define PERP_BASE_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

/* Looks between two readings of it, of what takes next to no time. */
enum { PERP__A_READING = 256 };

/* Seconds on a clock that never goes backwards. */
double perp__now(void);

/* Seconds until a deadline on that clock, for a time limit: more than 0 where it is over. */
double perp__time_left(double deadline);

/* Whether it is over; 0: there is none, and the clock is not read. */
static inline bool perp__is_past(double deadline)
{
    return deadline > 0.0 && perp__now() > deadline;
}

#endif

/* How the next step's length follows from what the last one's error was: of mechanism and world. */
#ifndef PERP_STEP_LENGTH_H
#define PERP_STEP_LENGTH_H

/* Of the length that would just do, what is tried; and how much longer or shorter than the last
 * step the next may be at all, as errors far away say little. */
#define PERP__STEP_SAFETY 0.9
#define PERP__STEP_GROWTH 5.0
#define PERP__STEP_SHRINKING 0.1

#endif

/* Numbers that look random and are the same in every run: Steele, Lea & Flood, "Fast splittable
 * pseudorandom number generators" (2014). */
#ifndef PERP_BASE_RANDOM_H
#define PERP_BASE_RANDOM_H

#include <stdint.h>

#define PERP__GOLDEN UINT64_C(0x9e3779b97f4a7c15)

static inline uint64_t perp__next_random(uint64_t *seed)
{
    uint64_t x = *seed += PERP__GOLDEN;

    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return x ^ (x >> 31);
}

/* In [-1, 1). */
static inline double perp__draw(uint64_t *seed)
{
    return (double)(perp__next_random(seed) >> 11) * 0x1p-52 - 1.0;
}

#endif

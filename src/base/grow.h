/* Arrays that grow, alone or side by side. */
#ifndef PERP_BASE_GROW_H
#define PERP_BASE_GROW_H

#include <perp/base.h>

/* One of them: where its pointer is, the bytes that are kept, and those of an entry. */
typedef struct perp__growing {
    void *pointer;
    size_t kept, entry;
} perp__growing;

/* The first `used` numbers of `array` are kept; an entry has `wide` of them. */
#define PERP__GROWING(array, used, wide)                                             \
    {                                                                                \
        &(array), (size_t)(used) * sizeof *(array), (size_t)(wide) * sizeof *(array) \
    }

/* Room for `needed` entries: *capacity is doubled until it is enough. Where there is no memory,
 * what was there is in place, the message names `what`; NULL: no message. PERP_OK or _MEMORY. */
perp_status perp__grow(perp_context *context, const char *what, int32_t *capacity, int64_t needed,
                       const perp__growing *arrays, size_t count);

#endif

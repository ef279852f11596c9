/* Calls that have to be refused: the status, and what the message names. */
#ifndef PERP_TESTS_REFUSED_H
#define PERP_TESTS_REFUSED_H

#include <string.h>

#include <perp/base.h>

enum {
    ARGUMENT = PERP_ERROR_ARGUMENT,
    NOT_FINITE = PERP_ERROR_NOT_FINITE,
    ABI = PERP_ERROR_ABI,
    HANDLE = PERP_ERROR_HANDLE,
    CALLBACK = PERP_ERROR_CALLBACK
};

/* Requires that status, and that the message has the words; `what` tells which call it was. */
static inline void refused(const perp_context *context, perp_status found, perp_status expected,
                           const char *words, const char *what)
{
    const char *message = perp_context_message(context);

    if (found != expected || !strstr(message, words))
        fail_msg("%s gave %s: '%s', expected %s with '%s'", what, perp_status_text(found), message,
                 perp_status_text(expected), words);
}

/* ---- tables -----------------------------------------------------------------------------------
 */

/* What the library has to say of a call. */
typedef struct refusal {
    perp_status status;
    const char *names[2];
} refusal;

/* A case in a function that spoils a good call: where *k counts down to it, the statements do so,
 * and what is expected is returned. Behind the last case comes END_OF_CASES. */
#define SPOIL(expected, first, second, ...)                \
    if ((*k)-- == 0) {                                     \
        __VA_ARGS__;                                       \
        return (refusal){(expected), {(first), (second)}}; \
    }
#define END_OF_CASES \
    return (refusal) \
    {                \
        PERP_OK,     \
        {            \
            "", ""   \
        }            \
    }

static inline void refused_as(const perp_context *context, perp_status found, refusal expected)
{
    refused(context, found, expected.status, expected.names[0], expected.names[1]);
    refused(context, found, expected.status, expected.names[1], expected.names[0]);
}

#endif

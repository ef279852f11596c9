/* Texts and numbers that tell a caller what was loaded. PERP__BLAS_NAME comes from the
 * Makefile. */
#include <perp/base.h>

#ifndef PERP__BLAS_NAME
#define PERP__BLAS_NAME "blas"
#endif
#define PERP__TEXT2(x) #x
#define PERP__TEXT(x) PERP__TEXT2(x)
#define PERP__LIST_CASE(name, value, text) \
    case name:                             \
        return text;

const char *perp_status_text(perp_status status)
{
    switch (status) {
        PERP_STATUS_LIST(PERP__LIST_CASE)
    }
    return "unknown status";
}

const char *perp_outcome_text(perp_outcome outcome)
{
    switch (outcome) {
        PERP_OUTCOME_LIST(PERP__LIST_CASE)
    }
    return "unknown outcome";
}

int32_t perp_version(void)
{
    return PERP_VERSION;
}

int32_t perp_abi_version(void)
{
    return PERP_ABI_VERSION;
}

const char *perp_version_text(void)
{
    return PERP__TEXT(PERP_VERSION_MAJOR) "." PERP__TEXT(PERP_VERSION_MINOR) "." PERP__TEXT(
        PERP_VERSION_PATCH) " " PERP__BLAS_NAME " klu";
}

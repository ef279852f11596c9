/* Structs of the interface as their initialisers leave them: perp_lcp_settings settings =
 * fresh_lcp_settings(). */
#ifndef PERP_TESTS_FRESH_H
#define PERP_TESTS_FRESH_H

#include <perp/mechanism.h>
#include <perp/perp.h>

#include "calls.h"

#define FRESH_BY(kind, init)                                   \
    static inline perp_##kind fresh_##kind(void)               \
    {                                                          \
        perp_##kind fresh;                                     \
                                                               \
        assert_int_equal(init(&fresh, sizeof fresh), PERP_OK); \
        return fresh;                                          \
    }
#define FRESH(kind) FRESH_BY(kind, perp_struct_init)
#define FRESH_DEFAULTS(kind) FRESH_BY(kind, perp_##kind##_init)
FRESH_DEFAULTS(lcp_settings)
FRESH(lcp_result)
FRESH(lcp_proof)
FRESH(lcp_sensitivity_info)
FRESH(lcp_enumeration)
FRESH_DEFAULTS(contact_laws)
FRESH(contact_dynamics)
FRESH_DEFAULTS(contact_settings)
FRESH(contact_result)
FRESH(contact_sensitivity_info)
FRESH(statics_problem)
FRESH(statics_settings)
FRESH(statics_result)
FRESH(ncp_problem)
FRESH_DEFAULTS(ncp_settings)
FRESH(ncp_result)
FRESH(ncp_check)
FRESH_DEFAULTS(mechanism_model)
FRESH_DEFAULTS(mechanism_settings)
FRESH(mechanism_step)
FRESH(mechanism_run_result)
FRESH(mechanism_found)
FRESH(mechanism_summary)
FRESH(mechanism_check_result)
FRESH_DEFAULTS(load_system)
FRESH_DEFAULTS(load_settings)
FRESH(load_found)
FRESH(load_summary)
FRESH(load_uniqueness)
FRESH(load_inverse)
FRESH(load_step)
FRESH(compliant_system)
FRESH_DEFAULTS(compliant_settings)
FRESH(compliant_result)
FRESH(compliant_stability)
FRESH(bristle)
FRESH_DEFAULTS(body_settings)
FRESH_DEFAULTS(body_state)
FRESH_DEFAULTS(shape_settings)
FRESH_DEFAULTS(joint_settings)
FRESH(joint_state)
FRESH(step_result)
FRESH(world_stats)
FRESH(world_contact)
FRESH(world_states)
FRESH(matrix)
FRESH(context_settings)
#undef FRESH
#undef FRESH_DEFAULTS
#undef FRESH_BY

/* Views of rows by columns numbers, one row after the other, and of compressed columns. */
static inline perp_matrix matrix_rows(const double *values, int32_t rows, int32_t columns)
{
    perp_matrix view = fresh_matrix();

    assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, rows, columns, values,
                                       columns > 0 ? columns : 1),
                     PERP_OK);
    return view;
}

static inline perp_matrix matrix_csc(int32_t rows, int32_t columns, const int32_t *starts,
                                     const int32_t *indices, const double *values)
{
    perp_matrix view = fresh_matrix();

    assert_int_equal(perp_matrix_csc(&view, rows, columns, starts, indices, values), PERP_OK);
    return view;
}

#endif

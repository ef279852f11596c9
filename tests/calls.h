/* Structs of one call, written where it is: perp_lcp_solve(context, z, w, NULL, &result, NULL,
 * LCP(&M, q), NULL). What is left out is NULL. */
#ifndef PERP_TESTS_CALLS_H
#define PERP_TESTS_CALLS_H

#include <perp/mechanism.h>
#include <perp/perp.h>

/* M, q, lower, upper; then count and n before these */
#define LCP(...) STRUCT(perp_lcp_problem, __VA_ARGS__)
#define LCP_STACK(size, each, ...) \
    STRUCT(perp_lcp_stack, .count = size, .n = each, .M = __VA_ARGS__)
/* v, r, u, modes, ray */
#define ANSWER(...) STRUCT(perp_contact_answer, __VA_ARGS__)
/* laws, dynamics, f, w, b */
#define DYNAMICS(...) STRUCT(perp_contact_problem, __VA_ARGS__)
/* df, dw, db, dmu, dM, dH, dG */
#define DIRECTION(...) STRUCT(perp_contact_change, __VA_ARGS__)
/* t, h, q, v */
#define START(...) STRUCT(perp_mechanism_start, __VA_ARGS__)
#define DELASSUS(contacts, matrix, offset) \
    STRUCT(perp_contact_problem, contacts, .W = matrix, .q = offset)
#define LCP_PRODUCT(size, multiply, own, scale, offset, ...)                                 \
    STRUCT(perp_lcp_problem, .n = size, .product = multiply, .user = own, .diagonal = scale, \
           .q = offset, __VA_ARGS__)
#define STRUCT(T, ...) (&(T){.struct_size = sizeof(T), __VA_ARGS__})

#endif

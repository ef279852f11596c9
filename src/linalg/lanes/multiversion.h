/* Kernels compiled twice: for any processor, and for those with wide vectors and a fused
 * multiply-add in hardware. A kernel's arithmetic is fixed by its C text (-ffp-contract=off, fma()
 * only where written), so both versions give the same bits.
 *
 * Usage: PERP__MULTIVERSION(name, (parameters), (arguments)) and the body with the loops, in
 * braces, define `static void name(parameters)`, PERP__MULTIVERSION_SHARED one that a header
 * declares; the loops alone are `name_loops`. Functions that loops call are PERP__KERNEL static. */
#ifndef PERP_LINALG_MULTIVERSION_H
#define PERP_LINALG_MULTIVERSION_H

#if defined(__GNUC__) && defined(__x86_64__) && !defined(PERP_NO_MULTIVERSION) && \
    !(defined(__AVX2__) && defined(__FMA__))

#define PERP__KERNEL __attribute__((always_inline)) inline
#define PERP__MULTIVERSIONS(linkage, name, parameters, arguments)                    \
    PERP__KERNEL static void name##_loops parameters;                                \
    __attribute__((target("avx2,fma"), noinline)) static void name##_avx2 parameters \
    {                                                                                \
        name##_loops arguments;                                                      \
    }                                                                                \
    __attribute__((noinline)) static void name##_any parameters                      \
    {                                                                                \
        name##_loops arguments;                                                      \
    }                                                                                \
    linkage void name parameters                                                     \
    {                                                                                \
        if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))         \
            name##_avx2 arguments;                                                   \
        else                                                                         \
            name##_any arguments;                                                    \
    }                                                                                \
    PERP__KERNEL static void name##_loops parameters

#else

#define PERP__KERNEL inline
#define PERP__MULTIVERSIONS(linkage, name, parameters, arguments) \
    PERP__KERNEL static void name##_loops parameters;             \
    linkage void name parameters                                  \
    {                                                             \
        name##_loops arguments;                                   \
    }                                                             \
    PERP__KERNEL static void name##_loops parameters

#endif

/* kernel(width, rows, ...) with constants where `rows` of a matrix lie on rigid bodies, of so many
 * coordinates each, as those of usual contacts do. Sums and their order are the same for all. */
#define PERP__WITH_SHAPE(kernel, width, rows, ...) \
    do {                                           \
        if ((width) == 6 && (rows) == 3)           \
            kernel(6, 3, __VA_ARGS__);             \
        else if ((width) == 6 && (rows) == 1)      \
            kernel(6, 1, __VA_ARGS__);             \
        else if ((width) == 3 && (rows) == 2)      \
            kernel(3, 2, __VA_ARGS__);             \
        else                                       \
            kernel(width, rows, __VA_ARGS__);      \
    } while (0)

#define PERP__MULTIVERSION(name, parameters, arguments) \
    PERP__MULTIVERSIONS(static, name, parameters, arguments)
#define PERP__MULTIVERSION_SHARED(name, parameters, arguments) \
    PERP__MULTIVERSIONS(, name, parameters, arguments)

#endif

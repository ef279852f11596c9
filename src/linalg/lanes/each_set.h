/* Includes TEMPLATE, a template (vectors.h), for each instruction set: NAME(x) is x_one, x_avx2 and
 * x_avx512. PERP__OF_EACH_SET(x) lists these in the order of perp__vector_set. */
#define NAME(x) x##_one
#include "linalg/lanes/vector_one.h"
#include TEMPLATE
#include "linalg/lanes/vector_end.h"

#if PERP__X86
#define NAME(x) x##_avx2
#include "linalg/lanes/vector_avx2.h"
#include TEMPLATE
#include "linalg/lanes/vector_end.h"

#define NAME(x) x##_avx512
#include "linalg/lanes/vector_avx512.h"
#include TEMPLATE
#include "linalg/lanes/vector_end.h"

#define PERP__OF_EACH_SET(x) x##_one, x##_avx2, x##_avx512
#else
#define PERP__OF_EACH_SET(x) x##_one
#endif

#undef TEMPLATE

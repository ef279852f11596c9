/* Vectors of one double, for any processor and the templates of linalg/lanes/vectors.h. */
#define TARGET
#define LANES 1
#define lanes double
#define load(from) (*(from))
#define store(into, a) (*(into) = (a))
#define spread(a) (a)
#define minus_product(c, a, b) ((c) - (a) * (b))
#define plus_fused(c, a, b) fma((a), (b), (c))
#define root sqrt
#define minus_fused(c, a, b) fma(-(a), (b), (c))
#define add(a, b) ((a) + (b))
#define subtract(a, b) ((a) - (b))
#define multiply(a, b) ((a) * (b))
#define divide(a, b) ((a) / (b))
#define absolute(a) fabs(a)
#define larger(a, b) ((a) > (b) ? (a) : (b))
#define smaller(a, b) ((a) < (b) ? (a) : (b))
#define largest_of(a) (a)
#define smallest_of(a) (a)
#define first_of(t) 0
#define bits_of(t) (unsigned)(t)
#define truth int
#define less(a, b) ((a) < (b))
#define at_most(a, b) ((a) <= (b))
#define both(t, u) ((t) & (u))
#define any_of(t) (t)
#define all_of(t) (t)
#define pick(t, a, b) ((t) ? (a) : (b))
#define prefetch(at) ((void)(at))
#define EIGHT_DOUBLES(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7)

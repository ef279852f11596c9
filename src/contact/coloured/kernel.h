/* Template (linalg/lanes/vectors.h): passes over the groups, eight pairs side by side. The order of
 * all sums is that of eight lanes whatever the width of the vectors, so that every set of
 * instructions gives the same bits. */

/* Four numbers of LANES bodies into four vectors of one number each, and back; halves of eight. */
#if LANES == 8
TARGET static inline void NAME(halve)(lanes *x)
{
    for (int32_t l = 0; l < 4; l++) {
        const lanes low = _mm512_shuffle_f64x2(x[l], x[4 + l], 0x44);

        x[4 + l] = _mm512_shuffle_f64x2(x[l], x[4 + l], 0xee);
        x[l] = low;
    }
}

TARGET static inline void NAME(transpose)(lanes *x)
{
    const lanes ab = _mm512_unpacklo_pd(x[0], x[1]), AB = _mm512_unpackhi_pd(x[0], x[1]);
    const lanes cd = _mm512_unpacklo_pd(x[2], x[3]), CD = _mm512_unpackhi_pd(x[2], x[3]);
    const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
    const __m512i high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);

    x[0] = _mm512_permutex2var_pd(ab, low, cd);
    x[1] = _mm512_permutex2var_pd(AB, low, CD);
    x[2] = _mm512_permutex2var_pd(ab, high, cd);
    x[3] = _mm512_permutex2var_pd(AB, high, CD);
}
#elif LANES == 4
TARGET static inline void NAME(transpose)(lanes *x)
{
    const lanes ab = _mm256_unpacklo_pd(x[0], x[1]), AB = _mm256_unpackhi_pd(x[0], x[1]);
    const lanes cd = _mm256_unpacklo_pd(x[2], x[3]), CD = _mm256_unpackhi_pd(x[2], x[3]);

    x[0] = _mm256_permute2f128_pd(ab, cd, 0x20);
    x[1] = _mm256_permute2f128_pd(AB, CD, 0x20);
    x[2] = _mm256_permute2f128_pd(ab, cd, 0x31);
    x[3] = _mm256_permute2f128_pd(AB, CD, 0x31);
}
#endif

/* The numbers of bodies by lanes: the plane has all in the first four. */
TARGET static inline void NAME(take)(lanes *x, const int32_t *bodies, int32_t width,
                                     const double *y)
{
#if LANES == 8
    for (int32_t l = 0; l < 8 && width > 3; l++)
        x[l] = load(y + 8 * (size_t)bodies[l]);
    for (int32_t l = 0; l < 4 && width == 3; l++)
        x[l] =
            _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(y + 8 * (size_t)bodies[l])),
                               _mm256_loadu_pd(y + 8 * (size_t)bodies[4 + l]), 1);
    if (width > 3) {
        NAME(halve)(x);
        NAME(transpose)(x + 4);
    }
    NAME(transpose)(x);
#else
    for (int32_t at = 0; at < (width > 3 ? 8 : 4); at += LANES) {
        for (int32_t l = 0; l < LANES; l++)
            x[at + l] = load(y + 8 * (size_t)bodies[l] + at);
#if LANES == 4
        NAME(transpose)(x + at);
#endif
    }
#endif
}

TARGET static inline void NAME(put)(lanes *x, const int32_t *bodies, int32_t width, double *y)
{
#if LANES == 8
    NAME(transpose)(x);
    if (width > 3) {
        NAME(transpose)(x + 4);
        NAME(halve)(x);
    }
    for (int32_t l = 0; l < 8 && width > 3; l++)
        store(y + 8 * (size_t)bodies[l], x[l]);
    for (int32_t l = 0; l < 4 && width == 3; l++) {
        _mm256_storeu_pd(y + 8 * (size_t)bodies[l], _mm512_castpd512_pd256(x[l]));
        _mm256_storeu_pd(y + 8 * (size_t)bodies[4 + l], _mm512_extractf64x4_pd(x[l], 1));
    }
#else
    for (int32_t at = 0; at < (width > 3 ? 8 : 4); at += LANES) {
#if LANES == 4
        NAME(transpose)(x + at);
#endif
        for (int32_t l = 0; l < LANES; l++)
            store(y + 8 * (size_t)bodies[l] + at, x[at + l]);
    }
#endif
}

/* P_i y + w of the pairs, whose bodies have `width` coordinates. */
TARGET static inline lanes NAME(along)(const double (*P)[PERP__GROUP], int32_t width, lanes w,
                                       const lanes *A, const lanes *B)
{
    lanes a = plus_fused(w, load(P[0]), A[0]), b = multiply(load(P[6]), B[0]);

    for (int32_t i = 1; i < width; i++) {
        a = plus_fused(a, load(P[i]), A[i]);
        b = plus_fused(b, load(P[6 + i]), B[i]);
    }
    return add(a, b);
}

/* y += P_i' dr. */
TARGET static inline void NAME(push)(const double (*P)[PERP__GROUP], int32_t width, lanes dr,
                                     lanes *A, lanes *B)
{
    for (int32_t i = 0; i < width; i++) {
        A[i] = plus_fused(A[i], load(P[i]), dr);
        B[i] = plus_fused(B[i], load(P[6 + i]), dr);
    }
}

/* r_i goes on from where it was last, by a share of its change; and where it is now. */
TARGET static inline lanes NAME(go_on)(perp__lane_point *p, int32_t i, int32_t at, lanes momentum)
{
    const lanes r = load(p->r[i] + at);
    const lanes change = subtract(r, load(p->last[i] + at));

    store(p->last[i] + at, r);
    return add(r, multiply(momentum, change));
}

/* One contact of each pair: the normal, then the tangents, of which the plane has one. The fixed
 * point is Coulomb's law. What the normal's change does to the tangents is known (`across`), so
 * that all three velocities are read at once. Where none presses nothing changes. */
TARGET PERP__KERNEL static void NAME(visit)(perp__lane_point *p, int32_t width, int32_t at,
                                            lanes momentum, lanes *A, lanes *B)
{
    const double(*P)[PERP__GROUP] = (const double(*)[PERP__GROUP]) & p->P[0][at];
    const lanes zero = spread(0.0), step = load(p->inverse_tangent + at);
    const lanes n0 = NAME(go_on)(p, 0, at, momentum), s0 = NAME(go_on)(p, 1, at, momentum);
    const lanes t0 = width > 3 ? NAME(go_on)(p, 2, at, momentum) : zero;
    lanes u[3], n, s, t = zero, most, length, change;
    truth outside;

    u[0] = NAME(along)(P, width, load(p->bias + at), A, B);
    n = larger(minus_fused(n0, u[0], load(p->inverse_normal + at)), zero);
    store(p->r[0] + at, n);
    length = add(add(n, absolute(n0)), add(absolute(s0), absolute(t0)));
    if (!any_of(less(zero, length))) {
        store(p->r[1] + at, zero);
        store(p->r[2] + at, zero);
        return;
    }
    u[1] = NAME(along)(P + 12, width, load(p->w[1] + at), A, B);
    u[2] = width > 3 ? NAME(along)(P + 24, width, load(p->w[2] + at), A, B) : zero;
    change = subtract(n, n0);
    NAME(push)(P, width, change, A, B);
    s = minus_fused(s0, plus_fused(u[1], load(p->across[0] + at), change), step);
    if (width > 3)
        t = minus_fused(t0, plus_fused(u[2], load(p->across[1] + at), change), step);
    most = multiply(load(p->mu + at), n);
    length = plus_fused(multiply(s, s), t, t);
    outside = less(multiply(most, most), length);
    if (any_of(outside)) {
        const lanes slips = divide(most, root(length));

        s = pick(outside, plus_fused(zero, s, slips), s); /* 0 without a sign */
        t = pick(outside, plus_fused(zero, t, slips), t);
    }
    store(p->r[1] + at, s);
    NAME(push)(P + 12, width, subtract(s, s0), A, B);
    if (width > 3) {
        store(p->r[2] + at, t);
        NAME(push)(P + 24, width, subtract(t, t0), A, B);
    }
}

/* Their impulses alone. */
TARGET static inline void NAME(add_impulses)(perp__lane_point *p, int32_t width, int32_t at,
                                             lanes *A, lanes *B)
{
    for (int32_t i = 0; i < (width > 3 ? 3 : 2); i++)
        NAME(push)
    ((const double(*)[PERP__GROUP]) & p->P[12 * i][at], width, load(p->r[i] + at), A, B);
}

/* The normal row alone, from a push of its own, towards u_n >= -bias. */
TARGET static inline void NAME(visit_normal)(perp__lane_point *p, int32_t width, int32_t at,
                                             lanes *A, lanes *B)
{
    const double(*P)[PERP__GROUP] = (const double(*)[PERP__GROUP]) & p->P[0][at];
    const lanes old = load(p->shift + at);
    const lanes u = NAME(along)(P, width, load(p->bias + at), A, B);
    const lanes n = larger(minus_fused(old, u, load(p->inverse_normal + at)), spread(0.0));

    store(p->shift + at, n);
    NAME(push)(P, width, subtract(n, old), A, B);
}

/* Asks memory for what a sweep reads of a group. A kernel, as calls without effect are left out. */
TARGET PERP__KERNEL static void NAME(ask)(const perp__coloured *c, const perp__lane_group *group,
                                          const double *y)
{
    for (int32_t l = 0; l < PERP__GROUP; l++) {
        prefetch(y + 8 * (size_t)group->a[l]);
        prefetch(y + 8 * (size_t)group->b[l]);
    }
    for (int32_t k = 0; k < group->points; k++)
        for (size_t at = 0; at < offsetof(perp__lane_point, gap); at += 64)
            prefetch((const char *)&c->point[group->first + k] + at);
}

/* One of the three for each contact, with y; `width` is known here. What is far is asked for. */
TARGET PERP__KERNEL static void NAME(pass_of_width)(perp__coloured *c, int32_t width, int32_t what,
                                                    double *y, int32_t first, int32_t end)
{
    for (int32_t g = first; g < end; g++) {
        const perp__lane_group *group = &c->group[g];

        if (group->rests && what == PERP__COLOURED_SWEEP)
            continue;
        if (width > 3 && what == PERP__COLOURED_SWEEP && c->points > PERP__FAR_POINTS &&
            g + PERP__PAIR_POINTS < end)
            NAME(ask)(c, group + PERP__PAIR_POINTS, y);
        for (int32_t at = 0; at < group->pairs; at += LANES) {
            lanes A[8], B[8], momentum;

            NAME(take)(A, group->a + at, width, y);
            NAME(take)(B, group->b + at, width, y);
            momentum = larger(A[PERP__MOMENTUM(width)], B[PERP__MOMENTUM(width)]);
            for (int32_t k = 0; k < group->points; k++) {
                perp__lane_point *p = &c->point[group->first + k];

                if (what == PERP__COLOURED_SWEEP)
                    NAME(visit)(p, width, at, momentum, A, B);
                else if (what == PERP__COLOURED_ADD)
                    NAME(add_impulses)(p, width, at, A, B);
                else
                    NAME(visit_normal)(p, width, at, A, B);
            }
            NAME(put)(A, group->a + at, width, y);
            NAME(put)(B, group->b + at, width, y);
        }
    }
}

TARGET static void NAME(pass)(perp__coloured *c, int32_t what, double *y, int32_t first,
                              int32_t end)
{
    if (c->width == 3)
        NAME(pass_of_width)(c, 3, what, y, first, end);
    else
        NAME(pass_of_width)(c, 6, what, y, first, end);
}

TARGET static inline lanes NAME(dot)(const double (*P)[PERP__GROUP], const double (*Q)[PERP__GROUP])
{
    lanes sum = spread(0.0);

    for (int32_t i = 0; i < 12; i++)
        sum = add(sum, multiply(load(P[i]), load(Q[i])));
    return sum;
}

/* 1 / x; 0 where that is none. */
TARGET static inline lanes NAME(inverse)(lanes x)
{
    const lanes zero = spread(0.0), inverse = divide(spread(1.0), x);

    return pick(both(less(zero, x), less(inverse, spread(INFINITY))), inverse, zero);
}

/* W_nn, W_nt, and the larger eigenvalue of W_tt. */
TARGET static void NAME(invert)(perp__lane_point *p)
{
    for (int32_t at = 0; at < PERP__GROUP; at += LANES) {
        const double(*P)[PERP__GROUP] = (const double(*)[PERP__GROUP]) & p->P[0][at];
        const lanes a = NAME(dot)(P + 12, P + 12), b = NAME(dot)(P + 24, P + 24);
        const lanes d = NAME(dot)(P + 12, P + 24), apart = subtract(a, b);
        const lanes most = add(
            add(a, b), root(add(multiply(apart, apart), multiply(multiply(spread(4.0), d), d))));

        store(p->across[0] + at, NAME(dot)(P, P + 12));
        store(p->across[1] + at, NAME(dot)(P, P + 24));
        store(p->inverse_normal + at, NAME(inverse)(NAME(dot)(P, P)));
        store(p->inverse_tangent + at, NAME(inverse)(multiply(spread(0.5), most)));
    }
}

/* sqrt(a^2 + b^2); where squares may be beyond the range of doubles, by way of shares. */
TARGET static inline lanes NAME(length)(lanes a, lanes b)
{
    const lanes zero = spread(0.0), most = larger(absolute(a), absolute(b));
    const lanes size = pick(less(zero, most), most, spread(1.0));
    const truth plain = both(less(spread(1e-140), size), less(size, spread(1e140)));
    lanes length = root(plus_fused(multiply(a, a), b, b));

    if (!all_of(plain)) {
        const lanes x = divide(a, size), y = divide(b, size);

        length = pick(plain, length, multiply(size, root(plus_fused(multiply(x, x), y, y))));
    }
    return length;
}

/* The natural residual of Coulomb's law, |r - P(r - d)| with d = (u_n + mu |u_t|, u_t) / t and the
 * friction cone's P, and the contact's mode. Law.c has the forms, which do not cancel. */
TARGET static inline lanes NAME(natural)(lanes mu, lanes t, const lanes *r, const lanes *u,
                                         lanes *mode)
{
    const lanes d_s = divide(u[1], t), d_t = divide(u[2], t), d = NAME(length)(d_s, d_t);
    const lanes d_n = plus_fused(divide(u[0], t), mu, d), x_n = subtract(r[0], d_n);
    const lanes x_s = subtract(r[1], d_s), x_t = subtract(r[2], d_t);
    const lanes x = NAME(length)(x_s, x_t), friction = NAME(length)(r[1], r[2]);
    const lanes two = spread(2.0), zero = spread(0.0), sum = add(x, friction);
    const truth opens = at_most(multiply(mu, x), subtract(zero, x_n));
    const truth sticks = at_most(x, multiply(mu, x_n));
    lanes over = multiply(d_s, minus_product(d_s, two, r[1])), share, slides;

    /* 1. What takes r - d back to the cone where it slips. */
    over = divide(plus_fused(over, d_t, minus_product(d_t, two, r[2])), sum);
    over = add(add(subtract(friction, multiply(mu, r[0])), multiply(mu, d_n)), over);
    over = divide(over, plus_fused(spread(1.0), mu, mu));
    share = divide(over, x);
    slides = NAME(length)(plus_fused(d_s, share, x_s), plus_fused(d_t, share, x_t));
    slides = NAME(length)(minus_product(d_n, mu, over), slides);
    /* 2. One of the three ways; what presses a little where it opens slips. */
    *mode = pick(sticks, spread(PERP_CONTACT_STICK), spread(PERP_CONTACT_SLIP));
    *mode = pick(opens, spread(PERP_CONTACT_SLIP), *mode);
    *mode = pick(at_most(r[0], zero), spread(PERP_CONTACT_SEPARATE), *mode);
    return pick(opens, NAME(length)(r[0], friction), pick(sticks, NAME(length)(d_n, d), slides));
}

/* What the passes have come to: see perp__lane_measure. A gap that nothing closes is no velocity,
 * however short the step: it drives nothing. Nor does a slip drive more than friction can do about
 * it: that is mu times what presses, however fast it is. */
TARGET PERP__KERNEL static void NAME(measure_of_width)(const perp__coloured *c, int32_t width,
                                                       const perp__lane_group *group,
                                                       const perp__lane_point *p, double share,
                                                       perp__lane_measure *found)
{
    const lanes zero = spread(0.0);

    for (int32_t at = 0; at < group->pairs; at += LANES) {
        lanes A[8], B[8], a[8], b[8], u[3], r[3], speed[3], sizes[3], trace = zero, drive = zero;
        lanes most, mode, natural, size;

        NAME(take)(A, group->a + at, width, c->y);
        NAME(take)(B, group->b + at, width, c->y);
        NAME(take)(a, group->a + at, width, c->free);
        NAME(take)(b, group->b + at, width, c->free);
        for (int32_t i = 0; i < 3; i++) {
            const double(*P)[PERP__GROUP] = (const double(*)[PERP__GROUP]) & p->P[12 * i][at];
            const lanes w = load((i == 0 ? p->bias : p->w[i]) + at);
            const lanes ahead = i == 0 ? subtract(w, load(p->w[0] + at)) : zero;
            lanes q = w;

            u[i] = w;
            sizes[i] = absolute(w);
            r[i] = load(p->r[i] + at);
            for (int32_t k = 0; k < 2 * width && (i < 2 || width > 3); k++) {
                const int32_t j = k < width ? k : k - width;
                const lanes row = load(P[k < width ? j : 6 + j]);
                const lanes term = multiply(row, k < width ? a[j] : b[j]);

                u[i] = plus_fused(u[i], row, k < width ? A[j] : B[j]);
                q = add(q, term);
                sizes[i] = add(sizes[i], absolute(term));
                trace = plus_fused(trace, row, row);
            }
            speed[i] = pick(less(zero, q), smaller(q, absolute(subtract(q, ahead))), absolute(q));
            store(found->u[i] + at, u[i]);
        }
        most = multiply(trace, multiply(load(p->mu + at), r[0]));
        for (int32_t i = 0; i < 3; i++) {
            const lanes driving = i == 0 ? speed[0] : smaller(speed[i], most);

            drive = NAME(length)(drive, larger(driving, multiply(spread(share), sizes[i])));
        }
        natural = NAME(natural)(load(p->mu + at), trace, r, u, &mode);
        size = root(trace);
        store(found->trace + at, trace);
        store(found->mode + at, mode);
        store(found->drive + at, pick(less(zero, trace), divide(drive, size), zero));
        store(found->natural + at, pick(less(zero, trace), multiply(size, natural), zero));
    }
}

TARGET static void NAME(measure)(const perp__coloured *c, const perp__lane_group *group,
                                 const perp__lane_point *p, double share, perp__lane_measure *found)
{
    if (c->width == 3)
        NAME(measure_of_width)(c, 3, group, p, share, found);
    else
        NAME(measure_of_width)(c, 6, group, p, share, found);
}

static const perp__coloured_kernels NAME(kernels) = {NAME(pass), NAME(invert), NAME(measure)};
#undef NAME

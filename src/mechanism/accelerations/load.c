/* Contacts with two or three normals that hold both ways (pins, ball joints): friction has the
 * size mu |N|, which is no linear function of N.
 *
 * With the loads s_e = |N_e| of the contacts that slip as unknowns the pattern is linear,
 * N_e = a_e + sum C_ef s_f, and what is left is
 *
 *   |a_e tau + sum_f C_ef s_f| = s_e >= 0,   tau = 1.
 *
 * Both sides are homogeneous in z = (s, tau), so that every answer is a point where the largest of
 * z is 1: a face of a cube. All of them are found by cutting these faces into boxes. A box has none
 * where |N_e| and s_e differ by more than the box can make up for; it has at most one where the
 * Jacobian, times the inverse of the one in the middle, is near 1 all over the box of twice the
 * size (R. E. Moore, R. B. Kearfott & M. J. Cloud, "Introduction to Interval Analysis", 2009,
 * chapter 8), and Newton's method with that inverse finds it. Other boxes are cut in halves. */
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"

/* A box of this size that is not settled holds an answer that two branches share, or nearly. */
#define MOST_BOXES 200000
/* Halves of one coordinate: what is known of a double answer is half of the digits. */
#define HALVES (DBL_MANT_DIG / 2)
#define SMALLEST ldexp(1.0, 2 - HALVES)
#define CONTRACTION 0.5

typedef struct loads {
    perp__acceleration *a;
    perp_status (*found)(perp__acceleration *a);
    int32_t count, face; /* count: contacts that bend; columns are those and tau */
    int32_t *index;      /* count: elements */
    int32_t loaded;      /* 0: a = 0, nothing loads them but their own friction */
    double *C, *S;       /* count times (count + 1): three entries, and their length */
    double *N, *g, *step;
    double *Y;     /* count times count: the inverse, column by column */
    double *boxes; /* middle and half width, one after the other */
} loads;

bool perp__load_bends(const perp__element *element)
{
    return element->two_sided && element->friction && element->normals > 1;
}

/* load := x / |x|, or 0; returns the change. */
static double set_load(double *load, const double *x, int32_t count)
{
    double full[PERP__MOST_NORMALS] = {0.0}, size, change = 0.0;

    memcpy(full, x, (size_t)count * sizeof *full);
    size = perp__length(full, 3);
    for (int32_t i = 0; i < PERP__MOST_NORMALS; i++) {
        const double next = size > 0.0 ? full[i] / size : 0.0;

        change = fmax(change, fabs(next - load[i]));
        load[i] = next;
    }
    return change;
}

double perp__load_turn(perp__acceleration *a)
{
    double change = 0.0;

    for (int32_t i = 0; i < a->elements; i++) {
        const perp__element *element = a->element + i;
        double *load = a->pattern.load + PERP__MOST_NORMALS * (size_t)i;

        if (perp__load_bends(element))
            change = fmax(change, set_load(load, a->linear.x + element->row, element->normals));
    }
    return change;
}

bool perp__load_slips(const perp__acceleration *a, int32_t index)
{
    return perp__load_bends(a->element + index) && a->pattern.mode[index] == PERP_MECHANISM_SLIP;
}

/* ---- the equations ------------------------------------------------------------------------- */

size_t perp__load_room(size_t elements)
{
    const size_t p = elements < PERP__MOST_CONTACTS ? elements : PERP__MOST_CONTACTS;

    return 4 * p * (p + 1) + 5 * p + p * p + 2 * (p + 1) * (HALVES * p + 4);
}

/* Column f: the normal forces x, in units of forces. */
static void set_column(loads *l, int32_t f, const double *x, double unit)
{
    for (int32_t e = 0; e < l->count; e++) {
        const perp__element *element = l->a->element + l->index[e];
        const size_t at = (size_t)(e * (l->count + 1) + f);

        for (int32_t i = 0; i < PERP__MOST_NORMALS; i++)
            l->C[3 * at + (size_t)i] =
                i < element->normals ? x[element->row + i] * unit / l->a->scale[element->row] : 0.0;
        l->S[at] = perp__length(l->C + 3 * at, 3);
    }
}

/* C from unit loads and, with none, from what else there is; returns 0 where it is not unique. */
static bool fill(loads *l)
{
    perp__acceleration *a = l->a;
    double *force = a->work, *change = a->turn_work, largest = 0.0;

    for (int32_t e = 0; e < l->count; e++)
        memset(a->pattern.load + PERP__MOST_NORMALS * (size_t)l->index[e], 0,
               PERP__MOST_NORMALS * sizeof *a->pattern.load);
    perp__pattern_solve_roughly(a, PERP__ACCELERATION_SINGULAR, a->active);
    if (a->linear.system.sign == 0)
        return 0;
    set_column(l, l->count, a->linear.x, 1.0);
    for (int32_t e = 0; e < l->count; e++)
        largest = fmax(largest, l->S[e * (l->count + 1) + l->count]);
    l->loaded = largest > 0.0;
    if (l->loaded)
        set_column(l, l->count, a->linear.x, 1.0 / largest);
    for (int32_t f = 0; f < l->count; f++) {
        const perp__element *element = a->element + l->index[f];
        const double *direction = a->pattern.direction + 2 * (size_t)l->index[f];

        memset(force, 0, (size_t)a->active * sizeof *force);
        for (int32_t i = 0; i < element->tangents; i++)
            force[element->tangent + i] = -element->mu * direction[i] * a->scale[element->row];
        perp__pattern_respond(a, force, change);
        set_column(l, f, force, 1.0);
    }
    return 1;
}

/* N and g = |N| - s at z. */
static void evaluate(loads *l, const double *z)
{
    const int32_t columns = l->count + 1;

    memset(l->N, 0, 3 * (size_t)l->count * sizeof *l->N);
    for (int32_t e = 0; e < l->count; e++) {
        for (int32_t f = 0; f < columns; f++)
            for (int32_t i = 0; i < 3; i++)
                l->N[3 * e + i] += l->C[3 * (e * columns + f) + i] * z[f];
        l->g[e] = perp__length(l->N + 3 * e, 3) - z[e];
    }
}

/* ---- boxes --------------------------------------------------------------------------------- */

/* What the box adds to N_e. */
static double spread_of(const loads *l, int32_t e, const double *half)
{
    double sum = 0.0;

    for (int32_t f = 0; f <= l->count; f++)
        sum += l->S[e * (l->count + 1) + f] * half[f];
    return sum;
}

/* Column of unknown k: those of z but the face's. */
static int32_t column_of(const loads *l, int32_t k)
{
    return k + (k >= l->face);
}

/* Y := the inverse of the Jacobian in the middle; off := what that is off, row by row; returns 0
 * where it is singular. */
static bool invert(loads *l, const double *half, double *off)
{
    perp__pivoting *system = &l->a->turning;
    const int32_t p = l->count;
    double top = 0.0;

    system->n = p;
    for (int32_t e = 0; e < p; e++) {
        /* N_e / |N_e|, and how far it is off in the box of twice the size; or 0 */
        const double size = perp__length(l->N + 3 * e, 3), spread = spread_of(l, e, half);
        const bool known = 4.0 * spread < size;
        double n[3];

        for (int32_t i = 0; i < 3; i++)
            n[i] = known ? l->N[3 * e + i] / size : 0.0;
        off[e] = known ? 4.0 * spread / size : 1.0;
        for (int32_t k = 0; k < p; k++) {
            const int32_t f = column_of(l, k);
            const double *c = l->C + 3 * (e * (p + 1) + f);
            const double entry = n[0] * c[0] + n[1] * c[1] + n[2] * c[2] - (f == e);

            system->K[e * p + k] = entry;
            top = fmax(top, fabs(entry));
        }
    }
    perp__pivoting_eliminate(system, PERP__SUM_ROUNDING * top, p);
    for (int32_t k = 0; k < p && system->rank == p; k++) {
        memset(l->g, 0, (size_t)p * sizeof *l->g);
        l->g[k] = 1.0;
        perp__pivoting_solve(system, l->Y + k * p, l->g);
    }
    return system->rank == p;
}

/* step := Y g. */
static void find_step(loads *l)
{
    memset(l->step, 0, (size_t)l->count * sizeof *l->step);
    for (int32_t e = 0; e < l->count; e++)
        for (int32_t k = 0; k < l->count; k++)
            l->step[k] += l->Y[e * l->count + k] * l->g[e];
}

/* z is an answer: the pattern gets its loads. One at infinity is none. */
static perp_status take(loads *l, const double *z)
{
    perp__acceleration *a = l->a;

    for (int32_t f = 0; f <= l->count; f++)
        if (z[f] < -SMALLEST)
            return PERP_OK;
    if (!(z[l->count] > PERP__SUM_ROUNDING)) {
        a->answers.incomplete = 1;
        return PERP_OK;
    }
    evaluate(l, z);
    for (int32_t e = 0; e < l->count; e++) {
        const double size = perp__length(l->N + 3 * e, 3);
        double *load = a->pattern.load + PERP__MOST_NORMALS * (size_t)l->index[e];

        memset(load, 0, PERP__MOST_NORMALS * sizeof *load);
        if (size > PERP__SUM_ROUNDING * spread_of(l, e, z))
            set_load(load, l->N + 3 * e, PERP__MOST_NORMALS);
    }
    return l->found(a);
}

/* Settles the box: 1 where nothing of it is left to look at. */
static bool settle(loads *l, double *z, const double *half, perp_status *status)
{
    const int32_t p = l->count;
    double off[PERP__MOST_CONTACTS], contraction = 0.0;

    /* 1. no point of it can be an answer */
    evaluate(l, z);
    for (int32_t e = 0; e < p; e++)
        if (fabs(l->g[e]) >
            spread_of(l, e, half) + half[e] + PERP__SUM_ROUNDING * (spread_of(l, e, z) + z[e]))
            return 1;
    /* 2. there is at most one: how much the Jacobian times Y can differ from 1, in its widths */
    if (!invert(l, half, off))
        return 0;
    for (int32_t i = 0; i < p; i++) {
        double sum = 0.0;

        for (int32_t e = 0; e < p; e++)
            sum += fabs(l->Y[e * p + i]) * off[e] * spread_of(l, e, half);
        contraction = fmax(contraction, sum / half[column_of(l, i)]);
    }
    if (!(contraction < CONTRACTION))
        return 0;
    evaluate(l, z);
    find_step(l);
    for (int32_t k = 0; k < p; k++)
        if (fabs(l->step[k]) > (1.0 + contraction) * half[column_of(l, k)] + PERP__SUM_ROUNDING)
            return 1;
    /* 3. Newton's method */
    for (int32_t round = 0; round < PERP__MOST_HALVES; round++) {
        for (int32_t k = 0; k < p; k++)
            z[column_of(l, k)] -= l->step[k];
        evaluate(l, z);
        find_step(l);
    }
    for (int32_t e = 0; e < p; e++) /* outside of the box it need not converge */
        if (fabs(l->g[e]) > SMALLEST * (spread_of(l, e, z) + fabs(z[e])))
            return 1;
    *status = take(l, z);
    return 1;
}

/* All boxes of the face, which is the one on top; *looked_at counts them. */
static perp_status search_face(loads *l, int64_t *looked_at)
{
    const int32_t columns = l->count + 1;
    perp_status status = PERP_OK;
    double z[PERP__MOST_CONTACTS + 1];

    for (int32_t depth = 1; depth > 0 && status == PERP_OK;) {
        double *box = l->boxes + 2 * columns * --depth, *half = box + columns;
        int32_t widest = 0;

        if (*looked_at >= MOST_BOXES ||
            (++*looked_at % PERP__A_READING == 0 && perp__mechanism_is_late(l->a->m))) {
            *looked_at = MOST_BOXES;
            l->a->answers.incomplete = 1;
            return PERP_OK;
        }
        memcpy(z, box, (size_t)columns * sizeof *z);
        if (settle(l, z, half, &status))
            continue;
        for (int32_t f = 1; f < columns; f++)
            if (half[f] > half[widest])
                widest = f;
        if (half[widest] > SMALLEST) { /* both halves in its place */
            half[widest] *= 0.5;
            memcpy(box + 2 * columns, box, 2 * (size_t)columns * sizeof *box);
            box[widest] -= half[widest];
            box[2 * columns + widest] += half[widest];
            depth += 2;
        } else {
            l->a->answers.incomplete = 1;
            status = take(l, box);
        }
    }
    return status;
}

perp_status perp__load_all(perp__acceleration *a, perp_status (*found)(perp__acceleration *a))
{
    int32_t index[PERP__MOST_CONTACTS], tau;
    int64_t looked_at = 0;
    perp_status status = PERP_OK;
    loads l = {a, found, 0, 0, index, 0, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    size_t p;

    for (int32_t i = 0; i < a->elements; i++)
        if (perp__load_slips(a, i))
            index[l.count++] = i;
    p = (size_t)l.count;
    l.C = l.a->load_work;
    l.S = l.C + 3 * p * (p + 1);
    l.N = l.S + p * (p + 1);
    l.g = l.N + 3 * p;
    l.step = l.g + p;
    l.Y = l.step + p;
    l.boxes = l.Y + p * p;
    if (!fill(&l)) {
        a->answers.incomplete = 1;
        return PERP_OK;
    }
    tau = l.count;
    if (!l.loaded) { /* then s = 0, or the loads are those of all multiples: tau = 0 */
        memset(l.boxes, 0, (size_t)tau * sizeof *l.boxes);
        l.boxes[tau] = 1.0;
        status = take(&l, l.boxes);
    }
    for (l.face = 0; l.face < tau + l.loaded && status == PERP_OK; l.face++) {
        for (int32_t f = 0; f <= tau; f++) {
            const double half = f == l.face || (f == tau && !l.loaded) ? 0.0 : 0.5;

            l.boxes[f] = f == l.face ? 1.0 : half;
            l.boxes[tau + 1 + f] = half;
        }
        status = search_face(&l, &looked_at);
    }
    return status;
}

/* perp_contact_statics: what stands is in balance and within its cones, what falls has a proof,
 * both recomputed in 113 bits; forces that impulses inside all cones were made of never fall; the
 * safety of a load is where the verdict changes. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "dynamics.h"

typedef struct statics_problem {
    laws_problem laws;
    fuzz_mood mood;
    int32_t n, bilateral, bounded, rows; /* rows: of H and G */
    fuzz_matrix H, G;
    double *f, *load, *scale; /* scale: the largest entry of a column; 1 where there is none */
    double *r0;               /* which way contacts press that hold both ways */
    int carried;              /* f is what impulses inside the cones carry, without rounding */
    perp_statics_problem given;
    perp_statics_settings settings;
} statics_problem;

static const double *row_of(const statics_problem *p, int32_t i)
{
    const int32_t rows = p->rows - p->bilateral;

    return i < rows ? p->H.dense + i * p->n : p->G.dense + (i - rows) * p->n;
}

/* Forces that normals of 1 to 3 carry, without friction: exact where H is small integers. */
static void make_carried(fuzz_bytes *bytes, statics_problem *p)
{
    int32_t k, j;

    memset(p->f, 0, (size_t)p->n * sizeof *p->f);
    for (k = 0; k < p->laws.laws.contacts; k++) {
        const double normal = 1 + fuzz_pick(bytes, 3);

        for (j = 0; j < p->n; j++)
            p->f[j] -= normal * row_of(p, p->laws.first[k])[j];
    }
    p->carried = p->mood == FUZZ_INTEGERS && p->bounded == 0;
}

static void make_scale(statics_problem *p)
{
    double most = 0.0;
    int32_t i, j;

    for (j = 0; j < p->n; j++) {
        p->scale[j] = 0.0;
        for (i = 0; i < p->rows; i++)
            p->scale[j] = fmax(p->scale[j], fabs(row_of(p, i)[j]));
        most = fmax(most, p->scale[j]);
    }
    for (j = 0; j < p->n; j++)
        if (!(p->scale[j] > 1e-12 * most)) /* noise stays so */
            p->scale[j] = most > 0.0 ? most : 1.0;
}

static void make(fuzz_bytes *bytes, statics_problem *p)
{
    static const int32_t blocks[] = {3, 6, 1, VELOCITIES};
    fuzz_mood rows_mood;
    int32_t block, k;
    uint8_t flags;

    memset(p, 0, sizeof *p);
    p->mood = fuzz_mood_of(bytes);
    rows_mood = p->mood == FUZZ_WIDE ? FUZZ_MODERATE : p->mood;
    laws_make(bytes, p->mood, &p->laws);
    flags = fuzz_byte(bytes);
    block = blocks[fuzz_pick(bytes, 4)];
    p->n = 1 + fuzz_pick(bytes, VELOCITIES);
    p->rows = p->laws.rows;
    p->bilateral = p->laws.laws.bilateral;
    p->bounded = p->laws.laws.bounded;
    dynamics_make_rows(bytes, rows_mood, &p->H, p->rows - p->bilateral, p->n, block);
    dynamics_make_rows(bytes, rows_mood, &p->G, p->bilateral, p->n, block);
    p->f = fuzz_doubles(p->n);
    p->load = fuzz_doubles(p->n);
    p->scale = fuzz_doubles(p->n);
    if (flags & 1)
        make_carried(bytes, p);
    else
        fuzz_numbers(bytes, p->mood, p->f, p->n);
    if (flags & 2)
        fuzz_numbers(bytes, p->mood, p->load, p->n);
    else
        memset(p->load, 0, (size_t)p->n * sizeof *p->load);
    p->r0 = fuzz_doubles(p->rows);
    for (k = 0; k < p->rows; k++)
        p->r0[k] = flags & 16 ? fuzz_pick(bytes, 5) - 2.0 : 0.0;
    p->carried &= !(flags & 16); /* not along r0, perhaps */
    make_scale(p);
    if (perp_struct_init(&p->given, sizeof p->given) != PERP_OK ||
        perp_struct_init(&p->settings, sizeof p->settings) != PERP_OK)
        fuzz_fail("perp_struct_init takes their own size");
    p->given.n = p->n;
    p->given.laws = &p->laws.laws;
    p->given.H = &p->H.view;
    p->given.G = p->bilateral > 0 ? &p->G.view : NULL;
    p->given.f = p->f;
    p->given.load = flags & 2 ? p->load : NULL;
    p->given.r0 = flags & 16 ? p->r0 : NULL;
    p->settings.objective = flags >> 2 & 1;
    if (flags & 8)
        p->settings.max_iterations = fuzz_pick(bytes, 20);
    fuzz_show("H", p->H.dense, (p->rows - p->bilateral) * p->n);
    fuzz_show("G", p->G.dense, p->bilateral * p->n);
    fuzz_show("f", p->f, p->n);
    fuzz_show("load", p->load, p->n);
    fuzz_show("r0", p->r0, p->rows - p->bilateral);
    fuzz_show("mu", p->laws.mu, p->laws.laws.contacts);
    fuzz_show("rolling", p->laws.rolling, p->laws.laws.contacts);
    fuzz_show("spinning", p->laws.spinning, p->laws.laws.contacts);
    fuzz_show("lower", p->laws.lower, p->bounded);
    fuzz_show("upper", p->laws.upper, p->bounded);
}

static wide size_of(const wide *x, int32_t rows)
{
    wide sum = 0;
    int32_t i;

    for (i = 0; i < rows; i++)
        sum += x[i] * x[i];
    return oracle_sqrt(sum);
}

/* ---- it stands ---- */

/* Impulses in their cones and bounds, to the last bit of a double. */
static void check_cones(const statics_problem *p, const double *r)
{
    int32_t l, i;

    for (l = 0; l < p->laws.count; l++) {
        const oracle_law *law = &p->laws.law[l];
        wide tangent[3] = {0, 0, 0}, most = (wide)law->mu * (law->normal < 0 ? 0 : r[law->normal]);
        wide pressing[3] = {0, 0, 0};

        if (law->kind == ORACLE_NORMAL && !(r[law->first] >= 0))
            fuzz_fail("stands: normal impulse r[%d] = %g", law->first, r[law->first]);
        if (law->kind == ORACLE_BOUNDED &&
            !(law->lower <= r[law->first] && r[law->first] <= law->upper))
            fuzz_fail("stands: r[%d] = %.17g with bounds [%g, %g]", law->first, r[law->first],
                      law->lower, law->upper);
        if (law->kind != ORACLE_FRICTION)
            continue;
        for (i = 0; i < law->rows && i < 3; i++)
            tangent[i] = r[law->first + i];
        for (i = 0; i < law->normals; i++)
            pressing[i] = r[law->normal + i];
        if (law->normals > 0)
            most = law->mu * size_of(pressing, law->normals);
        if (size_of(tangent, law->rows) > most * (1 + (wide)0x1p-53))
            fuzz_fail("stands: r[%d] leaves its cone by %g of %g", law->first,
                      (double)(size_of(tangent, law->rows) - most), (double)most);
    }
}

/* f + H'r + G's beside its terms: as told, and less than 1e-12. Beside the largest of all bodies,
 * for what a body is is the library's to tell; in units in which columns have size 1. */
static void check_balance(const statics_problem *p, const double *r, double unbalance)
{
    wide left = 0, most = 0;
    double turned = 0; /* where normals are turned, each rounds beside the others */
    int32_t i, j;

    for (i = 0; i < p->rows && p->given.r0; i++)
        turned = fmax(turned, fabs(r[i]));
    for (j = 0; j < p->n; j++) {
        wide sum = (wide)p->f[j] + p->load[j];
        wide terms = oracle_abs(p->f[j]) + oracle_abs(p->load[j]);

        for (i = 0; i < p->rows; i++) {
            const wide term = (wide)row_of(p, i)[j] * r[i];

            sum += term;
            terms += fmax((double)oracle_abs(term), fabs(row_of(p, i)[j]) * turned);
        }
        left = oracle_abs(sum) / p->scale[j] > left ? oracle_abs(sum) / p->scale[j] : left;
        most = terms / p->scale[j] > most ? terms / p->scale[j] : most;
    }
    if (!(unbalance <= 1e-12))
        fuzz_fail("stands: unbalance %g", unbalance);
    if (left > most * ((wide)4 * unbalance + (wide)0x1p-50) + p->rows * (wide)0x1p-1074)
        fuzz_fail("stands: f + H'r + G's is %g beside %g; unbalance %g", (double)left, (double)most,
                  unbalance);
}

/* ---- it falls ---- */

/* The friction of a contact that holds both ways, from the law of its normals; or NULL. */
static const oracle_law *friction_of(const statics_problem *p, const oracle_law *law)
{
    return law->kind == ORACLE_BILATERAL && law < p->laws.law + p->laws.count - 1 &&
                   law[1].kind == ORACLE_FRICTION && law[1].normals > 0 && law[1].mu > 0
               ? law + 1
               : NULL;
}

/* What rows of a law lack to be in the dual cone. */
static wide find_lack(const statics_problem *p, const oracle_law *law, const wide *u)
{
    wide lack = 0;
    const oracle_law *friction = friction_of(p, law);
    int32_t l;

    if (friction) { /* along r0 as a normal's, across it none */
        wide r0[3] = {0}, along = 0, across;

        for (l = 0; l < law->rows; l++) {
            r0[l] = p->r0[law->first + l];
            along += u[law->first + l] * r0[l];
        }
        along /= size_of(r0, law->rows);
        across = size_of(u + law->first, law->rows);
        across = oracle_sqrt(across * across > along * along ? across * across - along * along : 0);
        lack = friction->mu * size_of(u + friction->first, friction->rows) - along;
        return across + (lack > 0 ? lack : 0);
    }
    if (law->kind == ORACLE_NORMAL) { /* with all friction of its contact */
        lack = -u[law->first];
        for (l = 0; l < p->laws.count; l++)
            if (p->laws.law[l].kind == ORACLE_FRICTION && p->laws.law[l].normal == law->first)
                lack += p->laws.law[l].mu * size_of(u + p->laws.law[l].first, p->laws.law[l].rows);
    } else if (law->kind == ORACLE_BILATERAL) {
        lack = size_of(u + law->first, law->rows);
    } else if (law->kind == ORACLE_BOUNDED) {
        if ((u[law->first] > 0 && law->lower == -INFINITY) ||
            (u[law->first] < 0 && law->upper == INFINITY))
            lack = oracle_abs(u[law->first]);
    }
    return lack > 0 ? lack : 0;
}

/* Rows to 1e-9 of what they are made of; work, and more than what impulses of the size of all
 * forces together could do on what rows lack. The work that a bound does is known as well as its
 * row, whose rounding is 2^-50 of what it is made of. */
static void check_certificate(const statics_problem *p, const double *v, double told)
{
    wide *u = fuzz_take(p->rows, sizeof *u), *reach = fuzz_take(p->rows, sizeof *reach);
    wide work = 0, size = 0, forces = 0, lacks = 0, rounding = 0;
    double most = 0, largest = 0;
    int32_t i, j, l;

    for (j = 0; j < p->n; j++) {
        const wide force = (wide)p->f[j] + p->load[j];

        most = fmax(most, fabs(v[j]) * p->scale[j]);
        largest = fmax(largest, fabs(v[j]));
        work += force * v[j];
        size += (oracle_abs(p->f[j]) + oracle_abs(p->load[j])) * oracle_abs(v[j]);
        forces += oracle_abs(force) / p->scale[j];
    }
    if (!(largest <= 1.0 && largest > 0.0))
        fuzz_fail("falls: the largest |v_i| is %g", largest);
    for (i = 0; i < p->rows; i++) {
        u[i] = reach[i] = 0;
        for (j = 0; j < p->n; j++) {
            if (fabs(row_of(p, i)[j]) < p->scale[j] * 0x1p-1000 && row_of(p, i)[j] != 0.0)
                return; /* next to the end of doubles beside its column */
            u[i] += (wide)row_of(p, i)[j] * v[j];
            reach[i] += oracle_abs((wide)row_of(p, i)[j]) / p->scale[j] * most;
        }
    }
    for (l = 0; l < p->laws.count; l++) {
        const oracle_law *law = &p->laws.law[l];
        const int contact = law->kind == ORACLE_NORMAL;
        wide lack = find_lack(p, law, u), made = 0;

        if (friction_of(p, law))
            for (i = 0; i < law[1].rows; i++)
                made += law[1].mu * reach[law[1].first + i];
        for (i = 0; i < (contact ? law->block_rows : law->rows); i++)
            made += reach[(contact ? law->block : law->first) + i];
        if (contact)
            for (i = 0; i < p->laws.count; i++)
                if (p->laws.law[i].kind == ORACLE_FRICTION && p->laws.law[i].normal == law->first)
                    made += p->laws.law[i].mu * reach[p->laws.law[i].first];
        if (lack > (wide)1e-9 * made)
            fuzz_fail("falls: the row of r[%d] lacks %g beside %g", law->first, (double)lack,
                      (double)made);
        lacks += made > 0 ? lack * most / made : 0;
        if (law->kind == ORACLE_BOUNDED)
            rounding += (isfinite(law->lower) ? oracle_abs(law->lower) : 0) * made +
                        (isfinite(law->upper) ? oracle_abs(law->upper) : 0) * made;
        if (law->kind == ORACLE_BOUNDED && lack == 0 && u[law->first] != 0) {
            const wide least = (wide)(u[law->first] > 0 ? law->lower : law->upper) * u[law->first];

            work += least;
            size += oracle_abs(least);
        }
    }
    if (!(work + (wide)0x1p-50 * rounding > forces * lacks))
        fuzz_fail("falls: work %g, rows lack %g beside forces %g", (double)work, (double)lacks,
                  (double)forces);
    work = work < DBL_MAX ? work : DBL_MAX;
    if (!(work > forces * (wide)0x1p-1000)) /* beyond what doubles tell from nothing */
        return;
    if (oracle_abs(work - told) >
        (wide)1e-9 * work + (wide)0x1p-46 * size + (wide)0x1p-50 * rounding + (wide)0x1p-1070)
        fuzz_fail("falls: work is %.17g, not %.17g", (double)work, told);
}

/* ---- calls ---- */

static int call(perp_context *context, const statics_problem *p, perp_statics_result *result,
                double *r, double *v)
{
    if (perp_struct_init(result, sizeof *result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (!fuzz_status_of(context,
                        perp_contact_statics(context, r, v, result, &p->given, &p->settings),
                        "statics", (const void *[]){r, v, NULL}))
        return 0;
    if (result->verdict < PERP_STATICS_STANDS || result->verdict > PERP_STATICS_INDETERMINATE)
        fuzz_fail("statics: verdict %d", result->verdict);
    if ((result->verdict != PERP_STATICS_STANDS && p->rows > 0 && !fuzz_untouched(r)) ||
        (result->verdict != PERP_STATICS_FALLS && p->n > 0 && !fuzz_untouched(v)))
        fuzz_fail("%s: what it does not concern is untouched",
                  perp_statics_verdict_text(result->verdict));
    if (isnan(result->margin) || isnan(result->work) || isnan(result->unbalance) ||
        result->margin > 1.0 || result->iterations < 0)
        fuzz_fail("%s: margin %g, work %g, unbalance %g, iterations %d",
                  perp_statics_verdict_text(result->verdict), result->margin, result->work,
                  result->unbalance, result->iterations);
    if (!p->given.load && !isnan(result->safety))
        fuzz_fail("statics: safety %g of no load", result->safety);
    if (result->verdict == PERP_STATICS_STANDS) {
        fuzz_finite("r", r, p->rows);
        check_cones(p, r);
        check_balance(p, r, result->unbalance);
    }
    if (result->verdict == PERP_STATICS_FALLS) {
        fuzz_finite("v", v, p->n);
        check_certificate(p, v, result->work);
    }
    return 1;
}

/* f + factor load: on the inner side of safety it never falls where f stands, on the outer one it
 * never stands. */
static void check_safety(perp_context *context, statics_problem *p, double safety)
{
    static const double sides[] = {0.0, 1.0 - 1e-6, 1.0 + 1e-6};
    const double *load = p->load;
    double *scaled = fuzz_doubles(p->n), size = 0.0, base = 0.0;
    perp_statics_result result;
    double left = 0.0; /* of both forces together */
    int32_t k, j, stands = 0;

    for (j = 0; j < p->n; j++) {
        size = fmax(size, fabs(load[j]) / p->scale[j]);
        base = fmax(base, fabs(p->f[j]) / p->scale[j]);
        left = fmax(left, fabs(p->f[j] + safety * load[j]) / p->scale[j]);
    }
    /* a change of safety by 1e-6 is one of all forces by 1e-9 at least, and what is left of these
     * is no rounding */
    if (isnan(safety) || !(safety * size > 1e-3 * base) || !(safety * size < 1e6 * base) ||
        !(left > 1e-3 * base))
        return;
    for (k = 0; k < 3; k++) {
        for (j = 0; j < p->n; j++)
            scaled[j] = sides[k] * safety * load[j];
        p->load = scaled;
        p->given.load = scaled;
        if (!call(context, p, &result, fuzz_doubles(p->rows), fuzz_doubles(p->n)))
            return;
        if (k == 0)
            stands = result.verdict == PERP_STATICS_STANDS;
        else if (k == 1 ? stands && result.verdict == PERP_STATICS_FALLS
                        : result.verdict == PERP_STATICS_STANDS)
            fuzz_fail("safety %.17g: %.9g of that %s", safety, sides[k],
                      perp_statics_verdict_text(result.verdict));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    perp_statics_result result, again;
    statics_problem p;
    double *r, *v, *same_r, *same_v, largest = 0.0; /* of forces: beyond, r may be no double */
    int32_t j;

    make(&bytes, &p);
    for (j = 0; j < p.n; j++)
        largest = fmax(largest, fabs(p.f[j] + p.load[j]));
    r = fuzz_doubles(p.rows), v = fuzz_doubles(p.n);
    same_r = fuzz_doubles(p.rows), same_v = fuzz_doubles(p.n);
    if (call(context, &p, &result, r, v)) {
        const int limited = p.settings.max_iterations > 0;

        if (p.carried && !p.given.load &&
            (result.verdict == PERP_STATICS_FALLS ||
             (result.verdict == PERP_STATICS_INDETERMINATE && !limited)))
            fuzz_fail("%s, margin %g, but forces are those of impulses inside all cones",
                      perp_statics_verdict_text(result.verdict), result.margin);
        if (call(context, &p, &again, same_r, same_v) &&
            (again.verdict != result.verdict ||
             memcmp(&again.margin, &result.margin, sizeof(double)) ||
             memcmp(r, same_r, (size_t)p.rows * sizeof *r) ||
             memcmp(v, same_v, (size_t)p.n * sizeof *v)))
            fuzz_fail("the same question has the same answer");
        p.settings.objective = 1 - p.settings.objective;
        if (call(context, &p, &again, fuzz_doubles(p.rows), fuzz_doubles(p.n)) &&
            again.verdict != result.verdict && largest < 1e300)
            fuzz_fail("%s with one objective, %s with the other",
                      perp_statics_verdict_text(result.verdict),
                      perp_statics_verdict_text(again.verdict));
        if (p.given.load && p.mood <= FUZZ_MODERATE && !limited)
            check_safety(context, &p, result.safety);
    }
    fuzz_close(context);
    return 0;
}

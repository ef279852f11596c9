/* Locality: what a problem is worth is what the worst of its parts is worth, whatever their units,
 * and a contact is judged beside its own terms. */
#include <math.h>

#include "suite.h"

#include "hand_over.h"

#include "context.h"

static const int32_t methods[] = {PERP_CONTACT_METHOD_AUTO, PERP_CONTACT_METHOD_SWEEP,
                                  PERP_CONTACT_METHOD_NEWTON, PERP_CONTACT_METHOD_LEMKE};

enum { METHODS = sizeof methods / sizeof *methods };

/* ---- stacks ---------------------------------------------------------------------------------- */

enum { PARTS = 3, MOST_N = 42, MOST_ROWS = 36, MOST_CONTACTS = 12 };

/* How a stack is handed over. */
enum entrance { DENSE_M, SPARSE_M, DENSE_W, SPARSE_W, ENTRANCES };

typedef struct sparse {
    int32_t starts[MOST_N + 1], rows[MOST_N * MOST_N];
    double values[MOST_N * MOST_N];
} sparse;

typedef struct stack {
    hand_over parts[PARTS];
    double mass[PARTS], speed[PARTS]; /* powers of two; impulses are in mass times speed */
    int32_t count, n, contacts, rows, joints;
    int32_t dims[MOST_CONTACTS];
    double mu[MOST_CONTACTS];
    double M[MOST_N * MOST_N], H[MOST_ROWS * MOST_N], G[PARTS * MOST_N], W[MOST_ROWS * MOST_ROWS];
    double f[MOST_N], w[MOST_ROWS], b[PARTS], q[MOST_ROWS];
    double v[MOST_N], r[MOST_ROWS], u[MOST_ROWS];
    perp_contact_result result;
} stack;

/* x := M^-1 x by elimination; M is well conditioned. */
static void solve_mass(const hand_over *p, double *x)
{
    double A[HAND_N * HAND_N];
    int32_t i, j, k;

    memcpy(A, p->M, sizeof A);
    for (k = 0; k < p->n; k++)
        for (i = k + 1; i < p->n; i++) {
            const double factor = A[i + k * p->n] / A[k + k * p->n];

            for (j = k; j < p->n; j++)
                A[i + j * p->n] -= factor * A[k + j * p->n];
            x[i] -= factor * x[k];
        }
    for (i = p->n - 1; i >= 0; i--) {
        for (j = i + 1; j < p->n; j++)
            x[i] -= A[i + j * p->n] * x[j];
        x[i] /= A[i + i * p->n];
    }
}

/* Row i of the part's (H, G), and where it is in the stack. */
static double entry(const hand_over *p, int32_t i, int32_t j)
{
    return i < p->rows ? p->H[i + j * p->rows] : p->G[i - p->rows + j * p->joints];
}

static int32_t place(const stack *s, int32_t first_row, int32_t first_joint, const hand_over *p,
                     int32_t i)
{
    return i < p->rows ? first_row + i : s->rows + first_joint + i - p->rows;
}

static void add_delassus(stack *s, const hand_over *p, int32_t part, int32_t row, int32_t joint)
{
    const int32_t size = s->rows + s->joints;
    double x[HAND_N];
    int32_t i, j, c;

    for (c = 0; c <= p->size; c++) { /* the last is q */
        for (j = 0; j < p->n; j++)
            x[j] = c < p->size ? entry(p, c, j) : p->f[j];
        solve_mass(p, x);
        for (i = 0; i < p->size; i++) {
            const int32_t to = place(s, row, joint, p, i);
            double sum = 0.0;

            for (j = 0; j < p->n; j++)
                sum += entry(p, i, j) * x[j];
            if (c < p->size)
                s->W[to + place(s, row, joint, p, c) * size] = sum / s->mass[part];
            else
                s->q[to] = (sum + (i < p->rows ? p->w[i] : p->b[i - p->rows])) * s->speed[part];
        }
    }
}

static void assemble(stack *s)
{
    int32_t at = 0, row = 0, joint = 0, contact = 0, part, i, j;

    s->n = s->rows = s->joints = s->contacts = 0;
    for (part = 0; part < s->count; part++) {
        s->n += s->parts[part].n;
        s->rows += s->parts[part].rows;
        s->joints += s->parts[part].joints;
    }
    memset(s->M, 0, sizeof s->M);
    memset(s->H, 0, sizeof s->H);
    memset(s->G, 0, sizeof s->G);
    memset(s->W, 0, sizeof s->W);
    for (part = 0; part < s->count; part++) {
        const hand_over *p = &s->parts[part];
        const double impulse = s->mass[part] * s->speed[part];

        for (j = 0; j < p->n; j++) {
            for (i = 0; i < p->n; i++)
                s->M[at + i + (at + j) * s->n] = p->M[i + j * p->n] * s->mass[part];
            for (i = 0; i < p->rows; i++)
                s->H[row + i + (at + j) * s->rows] = p->H[i + j * p->rows];
            for (i = 0; i < p->joints; i++)
                s->G[joint + i + (at + j) * s->joints] = p->G[i + j * p->joints];
            s->f[at + j] = p->f[j] * impulse;
        }
        for (i = 0; i < p->rows; i++)
            s->w[row + i] = p->w[i] * s->speed[part];
        for (i = 0; i < p->joints; i++)
            s->b[joint + i] = p->b[i] * s->speed[part];
        for (i = 0; i < p->contacts; i++, contact++) {
            s->dims[contact] = p->dims[i];
            s->mu[contact] = p->mu[i];
        }
        add_delassus(s, p, part, row, joint);
        at += p->n;
        row += p->rows;
        joint += p->joints;
    }
    s->contacts = contact;
}

static void compress(perp_matrix *view, sparse *own, const double *A, int32_t rows, int32_t columns)
{
    int32_t at = 0, i, j;

    for (j = 0; j < columns; j++) {
        own->starts[j] = at;
        for (i = 0; i < rows; i++)
            if (A[i + j * rows] != 0.0) {
                own->rows[at] = i;
                own->values[at++] = A[i + j * rows];
            }
    }
    own->starts[columns] = at;
    assert_int_equal(perp_matrix_csc(view, rows, columns, own->starts, own->rows, own->values), 0);
}

static void view_of(perp_matrix *view, sparse *own, const double *A, int32_t rows, int32_t columns,
                    int32_t is_sparse)
{
    assert_int_equal(perp_struct_init(view, sizeof *view), 0);
    if (is_sparse)
        compress(view, own, A, rows, columns);
    else
        assert_int_equal(perp_matrix_dense(view, PERP_STORAGE_COLUMN_MAJOR, rows, columns, A,
                                           rows > 0 ? rows : 1),
                         0);
}

static void run(stack *s, enum entrance entrance, int32_t method, int32_t cone, double tol)
{
    static sparse columns[3];
    const int32_t size = s->rows + s->joints, by_W = entrance >= DENSE_W;
    const int32_t is_sparse = entrance == SPARSE_M || entrance == SPARSE_W;
    perp_contact_settings settings = fresh_contact_settings();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix M, H, G, W;

    assert_int_equal(perp_struct_init(&s->result, sizeof s->result), 0);
    settings.method = method;
    settings.cone = cone;
    settings.tol = tol;
    laws.contacts = s->contacts;
    laws.dims = s->dims;
    laws.mu = s->mu;
    laws.bilateral = s->joints;
    if (by_W) {
        view_of(&W, &columns[0], s->W, size, size, is_sparse);
        assert_int_equal(perp_contact_solve(context, ANSWER(NULL, s->r, s->u), &s->result,
                                            &settings, DELASSUS(&laws, &W, s->q), NULL),
                         PERP_OK);
        return;
    }
    view_of(&M, &columns[0], s->M, s->n, s->n, is_sparse);
    view_of(&H, &columns[1], s->H, s->rows, s->n, is_sparse);
    view_of(&G, &columns[2], s->G, s->joints, s->n, is_sparse);
    dynamics.n = s->n;
    dynamics.M = &M;
    dynamics.H = &H;
    dynamics.G = s->joints > 0 ? &G : NULL;
    assert_int_equal(perp_contact_solve(context, ANSWER(s->v, s->r, s->u), &s->result, &settings,
                                        DYNAMICS(&laws, &dynamics, s->f, s->w, s->b), NULL),
                     PERP_OK);
}

/* Hands the answer to the parts, in their own units. */
static void hand_back(stack *s, int32_t has_v)
{
    int32_t at = 0, row = 0, joint = 0, part, i;

    for (part = 0; part < s->count; part++) {
        hand_over *p = &s->parts[part];
        const double impulse = s->mass[part] * s->speed[part];

        for (i = 0; i < p->size; i++) {
            p->r[i] = s->r[place(s, row, joint, p, i)] / impulse;
            p->u[i] = s->u[place(s, row, joint, p, i)] / s->speed[part];
        }
        for (i = 0; i < p->n; i++)
            p->v[i] = has_v ? s->v[at + i] / s->speed[part] : p->f[i];
        for (i = 0; !has_v && i < p->size; i++) {
            int32_t j;

            for (j = 0; j < p->n; j++)
                p->v[j] += entry(p, i, j) * p->r[i];
        }
        if (!has_v)
            solve_mass(p, p->v);
        at += p->n;
        row += p->rows;
        joint += p->joints;
    }
}

static int32_t is_good(const stack *s)
{
    return s->result.outcome == PERP_OUTCOME_SOLVED ||
           s->result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

static void draw(stack *s, uint64_t seed)
{
    gen_random random;
    int32_t part;

    gen_seed(&random, seed);
    s->count = PARTS;
    for (part = 0; part < PARTS; part++) {
        const int32_t wide = gen_integer(&random, 2); /* 14 unknowns are no rigid body */

        hand_make(&s->parts[part], 10 * seed + (uint64_t)part, wide ? 14 : 8, wide ? 3 : 2, 0,
                  gen_integer(&random, 2), 0.5);
        s->mass[part] = ldexp(1.0, gen_integer(&random, 201) - 100);
        s->speed[part] = ldexp(1.0, gen_integer(&random, 201) - 100);
    }
    assemble(s);
}

static stack alone_of(const stack *s, int32_t part)
{
    stack own = *s;

    own.count = 1;
    own.parts[0] = s->parts[part];
    own.mass[0] = s->mass[part];
    own.speed[0] = s->speed[part];
    assemble(&own);
    return own;
}

/* Masses and forces of 1e-30 .. 1e30 beside each other: verdict and answer are those of the parts
 * alone. A part's violation is within 1e-7 of its own numbers, which are of order 1: the tested
 * residual is at most 1e-10 of them, and products of r and u add the conditioning of W, below 1e3.
 */
static void test_stacks(void **state)
{
    static stack s, own;
    uint64_t seed;
    int32_t entrance, m, part;

    (void)state;
    for (seed = 1; seed <= 40; seed++)
        for (entrance = 0; entrance < ENTRANCES; entrance++)
            for (m = 0; m < METHODS; m++) {
                int32_t good = 1;

                draw(&s, seed);
                for (part = 0; part < PARTS; part++) {
                    own = alone_of(&s, part);
                    run(&own, (enum entrance)entrance, methods[m], 0, 1e-10);
                    good &= is_good(&own);
                }
                run(&s, (enum entrance)entrance, methods[m], 0, 1e-10);
                assert_int_equal(is_good(&s), good);
                if (!good)
                    continue;
                hand_back(&s, entrance < DENSE_W);
                for (part = 0; part < PARTS; part++)
                    assert_true(hand_violation(&s.parts[part]) <= 1e-7);
            }
}

/* Polyhedra, which nothing polishes: the parts' own answers. Contacts are independent and mu is
 * small, so that there is only one. */
static void test_polyhedra(void **state)
{
    static stack s, own[PARTS];
    uint64_t seed;
    int32_t entrance, part, i;

    (void)state;
    for (seed = 1; seed <= 40; seed++)
        for (entrance = 0; entrance < ENTRANCES; entrance++) {
            draw(&s, seed);
            run(&s, (enum entrance)entrance, PERP_CONTACT_METHOD_LEMKE, 8, 1e-10);
            assert_true(is_good(&s));
            hand_back(&s, entrance < DENSE_W);
            for (part = 0; part < PARTS; part++) {
                own[part] = alone_of(&s, part);
                run(&own[part], (enum entrance)entrance, PERP_CONTACT_METHOD_LEMKE, 8, 1e-10);
                assert_true(is_good(&own[part]));
                hand_back(&own[part], entrance < DENSE_W);
                for (i = 0; i < s.parts[part].size; i++)
                    assert_true(fabs(s.parts[part].r[i] - own[part].parts[0].r[i]) <= 1e-7);
            }
        }
}

/* Walls that close on a body from both sides leave no velocities: a proof for one part is one for
 * the whole, whatever else there is. */
static void test_impossible_part(void **state)
{
    static stack s;
    uint64_t seed;
    int32_t m, i;

    (void)state;
    for (seed = 1; seed <= 20; seed++)
        for (m = 0; m < METHODS; m++) {
            hand_over *p;

            draw(&s, seed);
            p = &s.parts[seed % PARTS];
            hand_make(p, seed, 8, 2, 1, 0, 0.0);
            for (i = 0; i < p->n; i++)
                p->H[1 + i * p->rows] = -p->H[i * p->rows];
            p->w[0] = p->w[1] = -1.0;
            assemble(&s);
            run(&s, DENSE_M, methods[m], 0, 1e-10);
            assert_int_equal(s.result.outcome, PERP_OUTCOME_RAY);
            assert_int_equal(s.result.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
        }
}

/* The law of every contact for u = W r + q, beside |W| |r| + |q| of its own rows. */
static double worst_own(const stack *s)
{
    const int32_t size = s->rows + s->joints;
    double u[MOST_ROWS], terms[MOST_ROWS], worst = 0.0;
    int32_t row = 0, i, j, k;

    for (i = 0; i < size; i++) {
        long double sum = (long double)s->q[i];

        terms[i] = fabs(s->q[i]);
        for (j = 0; j < size; j++) {
            sum += (long double)s->W[i + j * size] * (long double)s->r[j];
            terms[i] += fabs(s->W[i + j * size] * s->r[j]);
        }
        u[i] = (double)sum;
    }
    for (k = 0; k < s->contacts; row += s->dims[k++]) {
        const double t = s->W[row + row * size];
        double scale = 0.0, slide = 0.0, power = 0.0;

        for (i = row; i < row + s->dims[k]; i++)
            scale = hypot(scale, terms[i]);
        for (i = row + 1; i < row + s->dims[k]; i++) {
            slide = hypot(slide, u[i]);
            power += u[i] * s->r[i];
        }
        if (scale == 0.0)
            continue;
        worst = fmax(worst, -u[row] / scale);
        worst = fmax(worst, fmin(u[row], t * s->r[row]) / scale);
        if (t * s->r[row] > 1e-6 * scale)
            worst = fmax(worst, fabs(power / s->r[row] + s->mu[k] * slide) / scale);
    }
    for (i = s->rows; i < size; i++)
        worst = fmax(worst, fabs(u[i]) / terms[i]);
    return worst;
}

/* Noise where there should be zeros, of 2^-50 as a W made with an inverse has, or 2^-34. It couples
 * parts of whatever scales, and what is called good still is so beside each contact's own terms;
 * the bound is that of the stacks without noise. */
static void test_noise(void **state)
{
    static stack s;
    int32_t good = 0, m, i, j;
    uint64_t seed;

    (void)state;
    for (seed = 1; seed <= 200; seed++)
        for (m = 0; m < METHODS; m++) {
            gen_random random;
            int32_t size;

            draw(&s, seed);
            size = s.rows + s.joints;
            gen_seed(&random, seed);
            for (j = 0; j < size; j++)
                for (i = 0; i < j; i++)
                    if (s.W[i + j * size] == 0.0)
                        s.W[i + j * size] = s.W[j + i * size] =
                            gen_normal(&random) * (seed % 2 ? 0x1p-50 : 0x1p-34) *
                            sqrt(s.W[i + i * size]) * sqrt(s.W[j + j * size]);
            run(&s, DENSE_W, methods[m], 0, 1e-10);
            if (!is_good(&s))
                continue;
            good++;
            assert_true(worst_own(&s) <= 1e-7);
        }
    assert_true(good > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stacks),
        cmocka_unit_test(test_polyhedra),
        cmocka_unit_test(test_impossible_part),
        cmocka_unit_test(test_noise),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

/* The tree, the store, polyhedra and linear patterns against what is known by hand. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "base/context.h"
#include "memory.h"
#include "mechanism/linear.h"

#include "context.h"

/* ---- the tree ------------------------------------------------------------------------------ */

typedef struct walker {
    perp__pattern_tree tree;
    int32_t counts[3], choice[3], next[3];
    int32_t forbidden; /* choice 1 at position 0 leads nowhere */
    int32_t leaves, last;
    int32_t end_at;            /* leaves; 0: never */
    int32_t any_order, second; /* second: the second leaf's number */
} walker;

static int32_t choices(void *user, int32_t position)
{
    return ((const walker *)user)->counts[position];
}

static int32_t choose(void *user, int32_t position, int32_t choice)
{
    walker *w = user;

    w->choice[position] = choice;
    return !(w->forbidden && position == 0 && choice == 1);
}

static perp_status leaf(void *user)
{
    walker *w = user;
    const int32_t number =
        (w->choice[0] * w->counts[1] + w->choice[1]) * w->counts[2] + w->choice[2];

    assert_true(w->any_order || number > w->last); /* choices in order: each once */
    w->last = number;
    w->leaves++;
    if (w->leaves == 2)
        w->second = number;
    w->tree.ended = w->leaves == w->end_at;
    return PERP_OK;
}

static walker start(int32_t a, int32_t b, int32_t c)
{
    walker w = {
        {0, NULL, 0, 0, NULL, choices, choose, leaf}, {a, b, c}, {0}, {0}, 0, 0, -1, 0, 0, 0};

    w.tree.positions = 3;
    return w;
}

static int32_t search(walker *w)
{
    w->tree.user = w;
    w->tree.next = w->next;
    assert_int_equal(perp__pattern_tree_search(&w->tree), PERP_OK);
    return w->leaves;
}

static void test_tree(void **state)
{
    walker w = start(2, 3, 4);

    (void)state;
    w.tree.user = &w;
    assert_int_equal(perp__pattern_tree_count(&w.tree, 100), 24);
    assert_true(perp__pattern_tree_count(&w.tree, 5) > 5);
    assert_int_equal(search(&w), 24);
    w = start(3, 1, 2);
    w.forbidden = 1;
    assert_int_equal(search(&w), 4); /* a third of 6 is cut off */
    w = start(2, 2, 2);
    w.end_at = 3;
    assert_int_equal(search(&w), 3);
    w = start(2, 3, 4);
    w.tree.reverse = 1; /* the first position turns fastest: numbers that don't grow */
    w.any_order = 1;
    assert_int_equal(search(&w), 24);
    assert_int_equal(w.second, 12);
    w = start(2, 0, 2); /* a position without a choice */
    assert_int_equal(search(&w), 0);
    w.tree.positions = 0;
    w.last = -1;
    memset(w.choice, 0, sizeof w.choice);
    assert_int_equal(search(&w), 1);
}

/* ---- the store ----------------------------------------------------------------------------- */

/* Points on the line: equal ones are one, and a family is an interval. */
static int32_t holds(void *user, perp__answer *outer, const perp__answer *inner)
{
    int32_t k;

    (void)user;
    if (outer->dimension == 0)
        return outer->points[0] == inner->points[0];
    for (k = 0; k < inner->vertices; k++)
        if (inner->points[k] < outer->points[0] || inner->points[k] > outer->points[1])
            return 0;
    return 1;
}

static int32_t is_before(const void *user, const perp__answer *a, const perp__answer *b)
{
    (void)user;
    return a->points[0] <= b->points[0];
}

static void keep(perp__answers *store, double from, double to, int32_t stable)
{
    perp__answer *answer = perp__answer_create(store, from == to ? 1 : 2);

    assert_non_null(answer);
    answer->points[0] = from;
    answer->points[answer->vertices - 1] = to;
    answer->dimension = from != to;
    answer->stable = stable;
    answer->eigenvalues[0] = stable;
    perp__answers_keep(store, answer);
}

static void test_store(void **state)
{
    perp__answers store = {context, 1, 0, 1, 0, holds, NULL, NULL, NULL, 0, 0};

    (void)state;
    keep(&store, 3.0, 3.0, 1);
    keep(&store, 1.0, 1.0, 1);
    keep(&store, 3.0, 3.0, 0); /* two branches meet, one of them not stable */
    assert_int_equal(store.count, 2);
    assert_false(perp__answers_get(&store, 0)->stable);
    assert_true(perp__answers_get(&store, 0)->eigenvalues[0] == 0.0);
    keep(&store, 1.0, 1.0, 1);
    assert_true(perp__answers_get(&store, 1)->stable);
    keep(&store, 2.0, 4.0, 1); /* takes the first in, and comes last */
    assert_int_equal(store.count, 2);
    keep(&store, 2.5, 3.5, 1);
    keep(&store, 4.0, 4.0, 1);
    assert_int_equal(store.count, 2);
    keep(&store, 0.0, 5.0, 1);
    assert_int_equal(store.count, 1);
    perp__answer_find_middle(&store, store.first);
    assert_true(store.first->middle[0] == 2.5);
    keep(&store, 7.0, 7.0, 1);
    keep(&store, -2.0, -2.0, 1);
    keep(&store, 6.0, 6.0, 1);
    perp__answers_sort(&store, is_before);
    assert_int_equal(store.count, 4);
    assert_true(perp__answers_get(&store, 0)->points[0] == -2.0);
    assert_true(perp__answers_get(&store, 1)->points[1] == 5.0);
    assert_true(perp__answers_get(&store, 3)->points[0] == 7.0);
    perp__answers_release(&store);
    assert_int_equal(store.count, 0);
}

/* ---- families ------------------------------------------------------------------------------ */

/* x = (1, 2, 0) + t_1 (1, 0, 1) + t_2 (0, 1, 0) with x_1 >= 0, x_2 >= 0, x_1 + x_2 <= 5. */
static void test_polyhedron(void **state)
{
    static const double origin[3] = {1.0, 2.0, 0.0}, directions[6] = {1.0, 0.0, 1.0, 0.0, 1.0, 0.0};
    static const double rows[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {-1.0, -1.0, 0.0}};
    static const double constants[3] = {0.0, 0.0, 5.0}, nothing[3] = {0.0, 0.0, 0.0};
    const perp__inequality never = {-1.0, 0.0, nothing, 0};
    perp__answers store = {context, 3, 0, 0, 0, holds, NULL, NULL, NULL, 0, 0};
    perp__polyhedron p = {{0}, 3, 0, origin, directions, 0.0, 0.0, 1e-9, NULL, 0};
    perp__answer *made;
    int32_t count, k;

    (void)state;
    p.cone.context = context;
    for (count = 2; count <= 3; count++) {
        double basis[9];
        int32_t rank = 0;

        assert_int_equal(perp__polyhedron_begin(&p, 3, 2), PERP_OK);
        for (k = 0; k < count; k++) {
            const perp__inequality g = {constants[k], 0.0, rows[k], 0};

            perp__polyhedron_cut(&p, &g);
        }
        assert_int_equal(perp__polyhedron_enumerate(&p, &store), PERP_OK);
        assert_int_equal(perp__polyhedron_list(&p, &store, &made), PERP_OK);
        assert_int_equal(made->vertices, count == 2 ? 1 : 3); /* a quadrant, a triangle */
        assert_int_equal(made->rays, count == 2 ? 2 : 0);
        for (k = 0; k < made->vertices + made->rays; k++) {
            const double *x = made->points + 3 * k, shift = k < made->vertices;

            assert_true(fabs(x[2] - (x[0] - shift)) <= 1e-15); /* rounding of numbers up to 5 */
            assert_true(x[0] >= 0.0 && x[1] >= 0.0 && (x[0] == 0.0 || x[1] == 0.0));
            memcpy(basis + 3 * rank, x, sizeof origin);
            rank = perp__rank_add(basis, rank, 3, 1e-9);
        }
        assert_int_equal(rank, 3);
        perp__answer_release(&store, made);
    }
    assert_int_equal(perp__polyhedron_begin(&p, 3, 2), PERP_OK);
    perp__polyhedron_cut(&p, &never);
    assert_int_equal(p.empty, 1);
    assert_int_equal(perp__polyhedron_enumerate(&p, &store), PERP_OK);
    assert_int_equal(perp__polyhedron_list(&p, &store, &made), PERP_OK);
    assert_null(made);
    perp__answers_release(&store);
    perp__cone_release(&p.cone);
}

/* ---- linear patterns ------------------------------------------------------------------------ */

/* The LCP u = M x + c, 0 <= x perp u >= 0: a position is at 0 or free. */
static int32_t conditions(const void *user, const void *pattern, int32_t i, perp__condition *list)
{
    const int32_t is_free = ((const int8_t *)pattern)[i];
    const perp__condition zero = {PERP__CONDITION_EQUATION, 0, 1, {0}, 0.0, {1.0, 0.0, 0.0}};
    const perp__condition sign = {PERP__CONDITION_NOT_NEGATIVE, 0, 1, {0}, 0.0, {1.0, 0.0, 0.0}};

    (void)user;
    list[0] = zero;
    list[1] = sign;
    list[0].index[0] = is_free ? i : ~i;
    list[1].index[0] = is_free ? ~i : i;
    return 2;
}

typedef struct plane {
    perp__linear p;
    perp__arena arena;
    double M[4], c[2], size[2], scale[2];
} plane;

static void layout(perp__arena *arena, void *object)
{
    perp__linear_layout(&((plane *)object)->p, arena);
}

static void open_plane(plane *l, double a, double b, double c, double d, double q, double r)
{
    const plane made = {{0}, {0}, {a, c, b, d}, {q, r}, {fabs(q), fabs(r)}, {1.0, 1.0}};

    *l = made;
    memset(&l->arena, 0, sizeof l->arena);
    l->p.length = l->p.rows = l->p.positions = 2;
    l->p.block[0] = l->M;
    l->p.c = l->c;
    l->p.c_size = l->size;
    l->p.scale = l->scale;
    l->p.tolerance = 1e-12;
    l->p.conditions = conditions;
    assert_int_equal(perp__arena_fit(&l->arena, context, layout, l), PERP_OK);
}

/* Free positions of the pattern solved; -1, or the dimension. */
static int32_t solve(plane *l, const int8_t *pattern)
{
    static const double alone[3] = {1.0, 0.0, 0.0};
    perp__linear *p = &l->p;
    int32_t i;

    perp__linear_begin(p);
    for (i = 0; i < 2; i++)
        if (pattern[i])
            perp__linear_column(p, i, 1, alone);
    perp__pivoting_eliminate(&p->system, 4e-12 * perp__linear_load(p), 2);
    perp__linear_evaluate(p);
    perp__linear_correct(p);
    perp__linear_evaluate(p);
    perp__linear_find_widths(p);
    return perp__linear_find_null(p);
}

static int32_t is_answer(const plane *l, const int8_t *pattern, int32_t *at_vertex)
{
    const perp__linear *p = &l->p;
    const perp__linear_point point = {p->x, p->u, p->x_width, p->u_width, 0, 0, 0};

    return perp__linear_holds(p, pattern, &point, at_vertex);
}

static void test_linear(void **state)
{
    static const int8_t none[2] = {0, 0}, first[2] = {1, 0}, both[2] = {1, 1};
    static const double right[2] = {4.0, 0.0}, wrong[2] = {5.0, 0.0};
    plane l;
    int32_t at_vertex;

    (void)state;
    open_plane(&l, 2.0, 1.0, 1.0, 2.0, -4.0, -5.0); /* x = (1, 2) */
    assert_int_equal(solve(&l, both), 0);
    assert_true(fabs(l.p.x[0] - 1.0) <= 1e-15 && fabs(l.p.x[1] - 2.0) <= 1e-15);
    assert_true(is_answer(&l, both, &at_vertex));
    assert_false(at_vertex);
    assert_int_equal(solve(&l, first), 0); /* x = (2, 0), u_2 = -3 */
    assert_true(l.p.x[0] == 2.0 && l.p.x[1] == 0.0 && l.p.u[1] == -3.0);
    assert_false(is_answer(&l, first, &at_vertex));
    assert_false(perp__linear_holds_at(&l.p, first, l.p.x, 0, 1.0, &at_vertex));
    perp__arena_release(&l.arena);

    open_plane(&l, 1.0, 0.0, 0.0, 1.0, -4.0, 5.0); /* x = (4, 0) */
    assert_true(perp__linear_holds_at(&l.p, first, right, 0, 1.0, &at_vertex));
    assert_false(perp__linear_holds_at(&l.p, first, wrong, 0, 1.0, &at_vertex));
    assert_false(perp__linear_holds_at(&l.p, first, right, 1, 1.0, &at_vertex)); /* u_1 = 4 */
    perp__arena_release(&l.arena);

    open_plane(&l, 2.0, 1.0, 1.0, 2.0, 0.0, 3.0); /* x = 0 by two patterns */
    assert_int_equal(solve(&l, none), 0);
    assert_true(is_answer(&l, none, &at_vertex) && at_vertex);
    assert_int_equal(solve(&l, first), 0);
    assert_true(is_answer(&l, first, &at_vertex) && at_vertex);
    perp__arena_release(&l.arena);

    open_plane(&l, 1.0, 1.0, 1.0, 1.0, -2.0, -2.0); /* x_1 + x_2 = 2 */
    assert_int_equal(solve(&l, both), 1);
    assert_true(l.p.null[0] == -l.p.null[1] && l.p.null[0] != 0.0);
    perp__arena_release(&l.arena);
    open_plane(&l, 1.0, 1.0, 1.0, 1.0, -2.0, -3.0); /* that, and = 3 */
    assert_int_equal(solve(&l, both), -1);
    perp__arena_release(&l.arena);
}

/* The segment from (2, 0) to (0, 2). */
static void test_linear_family(void **state)
{
    static const int8_t both[2] = {1, 1};
    perp__answers store = {context, 2, 0, 0, 0, holds, NULL, NULL, NULL, 0, 0};
    perp__polyhedron family = {{0}, 2, 0, NULL, NULL, 0.0, 0.0, 1e-9, NULL, 0};
    perp__answer *made;
    plane l;
    int32_t at_vertex, k;

    (void)state;
    open_plane(&l, 1.0, 1.0, 1.0, 1.0, -2.0, -2.0);
    assert_int_equal(solve(&l, both), 1);
    family.cone.context = context;
    family.origin = l.p.x;
    family.directions = l.p.null;
    assert_int_equal(perp__polyhedron_begin(&family, 4, 1), PERP_OK);
    perp__linear_cut(&l.p, both, &family);
    assert_int_equal(perp__polyhedron_enumerate(&family, &store), PERP_OK);
    assert_int_equal(perp__polyhedron_list(&family, &store, &made), PERP_OK);
    assert_int_equal(made->vertices, 2);
    assert_int_equal(made->rays, 0);
    for (k = 0; k < 2; k++) {
        const double *x = made->points + 2 * k;

        assert_true(fmin(fabs(x[0]), fabs(x[1])) <= 1e-15 && fabs(x[0] + x[1] - 2.0) <= 1e-15);
        assert_true(perp__linear_holds_at(&l.p, both, x, 0, 1.0, &at_vertex) && at_vertex);
    }
    assert_true(perp__linear_holds_at(&l.p, both, made->middle, 0, 1.0, &at_vertex));
    assert_false(at_vertex);
    perp__answer_release(&store, made);
    perp__answers_release(&store);
    perp__cone_release(&family.cone);
    perp__arena_release(&l.arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tree),          cmocka_unit_test(test_store),
        cmocka_unit_test(test_polyhedron),    cmocka_unit_test(test_linear),
        cmocka_unit_test(test_linear_family),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

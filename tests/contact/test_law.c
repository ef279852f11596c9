/* The law of one contact, number by number: impulses and velocities by hand, most of them no
 * solutions, and what each of them violates. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "contact/law.h"

#define STICK PERP_CONTACT_STICK
#define SLIP PERP_CONTACT_SLIP
#define SEPARATE PERP_CONTACT_SEPARATE

typedef struct one {
    int32_t dim, cone;
    double mu, rolling, spinning, trace;
} one;

/* A problem of that contact alone, which is enough for its law. */
static perp__contact_problem problem_of(const one *contact)
{
    static const int32_t starts[2] = {0, 6};
    perp__contact_problem problem;

    memset(&problem, 0, sizeof problem);
    problem.contacts = 1;
    problem.starts = starts;
    problem.dims = &contact->dim;
    problem.mu = &contact->mu;
    problem.rolling = contact->rolling > 0.0 ? &contact->rolling : NULL;
    problem.spinning = contact->spinning > 0.0 ? &contact->spinning : NULL;
    problem.trace = &contact->trace;
    problem.cone = contact->cone;
    return problem;
}

/* Numbers of order 1, a dozen operations. */
static void require_near(double x, double expected, size_t k, const char *what)
{
    if (!(fabs(x - expected) <= 16.0 * DBL_EPSILON))
        fail_msg("case %d, %s: %.17g, expected %.17g", (int)k, what, x, expected);
}

/* d = u / t. signorini |min(r_n, d_n)|, dissipation |r_t - P(r_t - d_t)| on the disc of radius
 * mu r_n, natural |r - P_K(r - d - mu |d_t| e_n)| (of discs, polygons and mu > 1e3 |(signorini,
 * dissipation)|), change the least change of u that obeys. */
static void test_what_is_violated(void **state)
{
    static const struct {
        one contact; /* dim, cone, mu, rolling, spinning, t */
        double r[6], u[6];
        double natural, change, signorini, cone, dissipation;
        int32_t mode;
    } cases[] = {
        /* no friction: presses and moves; closes without pressing; opens */
        {{1, 0, 0, 0, 0, 2}, {3}, {2}, 1, 2, 1, 0, 0, STICK},
        {{1, 0, 0, 0, 0, 2}, {0}, {-2}, 1, 2, 1, 0, 0, STICK},
        {{1, 0, 0, 0, 0, 2}, {0}, {2}, 0, 0, 0, 0, 0, SEPARATE},
        {{1, 0, 0, 0, 0, 1}, {1}, {2}, 1, 2, 1, 0, 0, SEPARATE},
        {{2, 0, 0, 0, 0, 2}, {3, 0}, {2, 5}, 1, 2, 1, 0, 0, SLIP},
        /* a line, mu = 1/2: right slip; friction of the wrong sign, |d_t| = 1: from (1 - 1/2, -1/2)
         * to (3/5, -3/10); the same, too little to leave the disc */
        {{2, 0, 0.5, 0, 0, 2}, {1, -0.5}, {0, 2}, 0, 0, 0, 0, 0, SLIP},
        {{2, 0, 0.5, 0, 0, 2}, {1, 0.5}, {0, 2}, 0.8944271909999159, 2, 0, 0, 1, SLIP},
        {{2, 0, 0.5, 0, 0, 2}, {1, 0.5}, {0, 0.5}, 0.2795084971874737, 0.5, 0, 0, 0.25, STICK},
        {{2, 0, 0.5, 0, 0, 2}, {1, 0}, {0, 0}, 0, 0, 0, 0, 0, STICK},
        /* beyond the cone: by 1/4, and back to its edge */
        {{2, 0, 0.5, 0, 0, 1}, {1, 0.75}, {0, 0}, 0.22360679774997896, 0, 0, 0.25, 0.25, SLIP},
        /* space, mu = 1/2: slip along x, friction at right angles; opposite; inside */
        {{3, 0, 0.5, 0, 0, 1},
         {1, -0.5, 0},
         {0, 3, 4},
         0.4061489283335135,
         4,
         0,
         0,
         0.4132162824305704,
         SLIP},
        {{3, 0, 0.5, 0, 0, 1}, {1, -0.3, -0.4}, {0, 3, 4}, 0, 0, 0, 0, 0, SLIP},
        {{3, 0, 0.5, 0, 0, 1}, {1, 0.3, 0.4}, {0, 3, 4}, 0.8944271909999159, 5, 0, 0, 1, SLIP},
        {{3, 0, 0.5, 0, 0, 1},
         {1, 0, 0},
         {0, 0.03, 0.04},
         0.05590169943749474,
         0.05,
         0,
         0,
         0.05,
         STICK},
        /* mu = 1e6, which counts apart: closes and slides; sticks, and moves */
        {{3, 0, 1e6, 0, 0, 1}, {0, 0, 0}, {-1, 3, 4}, 1, 1, 1, 0, 0, SLIP},
        {{3, 0, 1e6, 0, 0, 1}, {1, 0, 0}, {0, 3, 4}, 5, 5, 0, 0, 5, STICK},
        /* opens with an impulse along a tangent left */
        {{3, 0, 0.5, 0, 0, 1}, {0, 0, 0}, {1, 3, 4}, 0, 0, 0, 0, 0, SEPARATE},
        /* rolling: all numbers of normal and parts together, each part its own disc */
        {{2, 0, 0.5, 0.25, 0, 1}, {1, 0, 0}, {0, 0, 0}, 0, 0, 0, 0, 0, STICK},
        {{2, 0, 0.5, 0.25, 0, 1}, {1, 0, 0}, {0, 0, 4}, 0.25, 4, 0, 0, 0.25, SLIP},
        {{2, 0, 0.5, 0.25, 0, 1}, {1, 0.5, -0.25}, {0.125, -4, 4}, 0.125, 0.125, 0.125, 0, 0, SLIP},
        {{3, 0, 0.5, 0, 0.25, 1}, {1, 0, 0, 0.25}, {0, 0, 0, 4}, 0.5, 4, 0, 0, 0.5, SLIP},
        /* a square with vertices (+-mu r_n, 0), (0, +-mu r_n): inside; at the vertex (1, 0), whose
         * normals are all within 45 degrees of (1, 0); there, and u leads inside; in the middle of
         * an edge, against its normal */
        {{3, 4, 1, 0, 0, 1}, {1, 0.25, 0}, {0, 0, 0.25}, 0.25, 0.25, 0, 0, 0.25, STICK},
        {{3, 4, 1, 0, 0, 1}, {1, 1, 0}, {0, -2, 1}, 0, 0, 0, 0, 0, SLIP},
        {{3, 4, 1, 0, 0, 1}, {1, 1, 0}, {0, 3, 0}, 2, 3, 0, 0, 2, SLIP},
        {{3, 4, 1, 0, 0, 1}, {1, 0.5, 0.5}, {0, -2, -2}, 0, 0, 0, 0, 0, SLIP},
    };
    size_t k;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        const perp__contact_problem problem = problem_of(&cases[k].contact);
        perp__contact_law law;

        perp__contact_outcome_of(&problem, 0, cases[k].r, cases[k].u, &law);
        require_near(law.signorini, cases[k].signorini, k, "signorini");
        require_near(law.dissipation, cases[k].dissipation, k, "dissipation");
        require_near(law.natural, cases[k].natural, k, "natural");
        require_near(law.change, cases[k].change, k, "change");
        require_near(law.cone, cases[k].cone, k, "cone");
        if (law.mode != cases[k].mode)
            fail_msg("case %d: mode %d, expected %d", (int)k, (int)law.mode, (int)cases[k].mode);
    }
}

/* Impulses to the nearest point of each disc; what pulls is 0, and all of the contact with it. */
static void test_clip(void **state)
{
    static const struct {
        one contact;
        double r[6], expected[6];
    } cases[] = {
        {{1, 0, 0, 0, 0, 1}, {-1}, {0}},
        {{1, 0, 0, 0, 0, 1}, {2}, {2}},
        {{2, 0, 0.5, 0, 0, 1}, {-1, 3}, {0, 0}},
        {{2, 0, 0.5, 0, 0, 1}, {1, -3}, {1, -0.5}},
        {{3, 0, 0.5, 0, 0, 1}, {2, 3, -4}, {2, 0.6, -0.8}},
        {{3, 0, 0.5, 0, 0, 1}, {2, 0.6, -0.7}, {2, 0.6, -0.7}},
        {{3, 0, 0.5, 0, 0, 1}, {(double)NAN, 3, -4}, {0, 0, 0}},
        {{3, 0, 0.5, 0.25, 0.125, 1}, {2, 3, -4, -3, 0, 1}, {2, 0.6, -0.8, -0.5, 0, 0.25}},
        {{3, 4, 1, 0, 0, 1}, {1, 2, 2}, {1, 0.5, 0.5}},
        {{3, 4, 1, 0, 0, 1}, {1, 0, -3}, {1, 0, -1}},
        {{3, 4, 1, 0, 0, 1}, {1, 0.25, -0.5}, {1, 0.25, -0.5}},
        /* from where x - (x - P(x)) is 0 */
        {{3, 4, 1, 0, 0, 1}, {1, 1e17, 3e16}, {1, 1, 0}},
        {{3, 4, 1, 0, 0, 1}, {1, -1e17, -1e17}, {1, -0.5, -0.5}},
    };
    size_t k, i;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        const perp__contact_problem problem = problem_of(&cases[k].contact);
        double r[6];

        memcpy(r, cases[k].r, sizeof r);
        perp__contact_clip(&problem, 0, r);
        for (i = 0; i < 6; i++)
            require_near(r[i], cases[k].expected[i], k, "clip");
    }
}

/* Pressures of both ways whose length no double holds: without friction there is none all the same.
 */
static void test_clip_beyond_doubles(void **state)
{
    static const int32_t both = 2;
    static const one contact = {3, 0, 0, 0, 0, 1};
    perp__contact_problem problem = problem_of(&contact);
    double r[3] = {DBL_MAX, -DBL_MAX, 1.0};

    (void)state;
    problem.two_sided = &both;
    perp__contact_clip(&problem, 0, r);
    assert_true(r[0] == DBL_MAX && r[1] == -DBL_MAX && r[2] == 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_is_violated),
        cmocka_unit_test(test_clip),
        cmocka_unit_test(test_clip_beyond_doubles),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Compliant contacts, linearised: the lead screw of docs/friction.md, the closed criterion against
 * the eigenvalues of the first-order system, the reduced model's labels against the full one.
 * The screw's values are those of a computation with 40 digits. */
#include "screw.h"

#include "mechanism/eigenvalues.h"

static void test_screw_eigenvalues(void **state)
{
    const int32_t plus = 1, minus = -1;
    perp_compliant_stability stability = fresh_compliant_stability();
    double gamma[2], roots[4];
    screw s;

    (void)state;
    start_screw(&s, 0, 1e9, 1e4);
    assert_int_equal(perp_compliant_linearise(s.compliant, &stability, gamma, roots, &plus, &plus),
                     PERP_OK);
    assert_near(gamma[0], 0.14430548747773325, 1e-14);
    assert_near(roots[0], -721.527437388666, 1e-14);
    assert_near(fabs(roots[1]), 11991.033551568, 1e-13);
    assert_true(stability.stable && !stability.flutter);
    assert_int_equal(perp_compliant_linearise(s.compliant, &stability, gamma, roots, &plus, &minus),
                     PERP_OK);
    assert_near(gamma[0], -0.028648097478529382, 1e-14);
    assert_near(stability.growth, 5497.54859542658, 1e-13);
    assert_near(fmin(roots[0], roots[2]), -5211.06762064128, 1e-13);
    assert_true(!stability.stable && !stability.flutter);
    finish_screw(&s);
}

/* The rigid screw in Dupont's form: J + m r^2 tan(lead) (k+ + k-) / 2, with k+- = tan(lead +- phi).
 */
static void test_rigid_screw(void **state)
{
    const double lead = pi / 36, tangent = tan(lead), phi = atan(mu), forward = 1, rest = 0;
    const double up = tan(lead + phi), down = tan(lead - phi), T[] = {0, -0.1};
    const double A = J + m * r * r * tangent * (up + down) / 2, b = r * W * (up + down) / 2;
    const double C = m * r * tangent, d = W, friction = r * (up - down) / 2;
    const double raise = 0.29260865149704385, lower = -0.11057649846053822;
    const double torques[] = {raise * 1.0001, raise * 0.9999, lower * 0.9999, lower * 1.0001};
    perp_load_uniqueness unique = fresh_load_uniqueness();
    asked a;
    int k;

    (void)state;
    describe(&a, 1, &A, &b, &C, &d, &friction);
    start(&a, NULL);
    assert_int_equal(ask(&a, &T[0], &forward), 2);
    assert_near(answer(&a, 0).acceleration[0], -3897.5253610274788, 1e-13);
    assert_near(answer(&a, 1).acceleration[0], -1977.0895003470284, 1e-13);
    assert_int_equal(answer(&a, 0).stable, 0);
    assert_int_equal(answer(&a, 1).stable, 1);
    /* N (cos -+ mu sin) = the axial force, C th'' + d */
    assert_near(answer(&a, 1).normal_force[0] / (cos(lead) - mu * sin(lead)), 13.806747276266417,
                1e-12);
    assert_near(answer(&a, 0).normal_force[0] / (cos(lead) + mu * sin(lead)), -69.547005614481321,
                1e-12);
    assert_int_equal(ask(&a, &T[1], &forward), 0); /* below the vertex T* = -0.0457 */
    for (k = 0; k < 4; k++) { /* self-locking: held between the torques that lower and raise */
        const int32_t held = k == 1 || k == 2;
        int32_t i, sticks = 0;

        for (i = ask(&a, &torques[k], &rest) - 1; i >= 0; i--)
            sticks |= answer(&a, i).kind == PERP_LOAD_STATIC;
        assert_int_equal(sticks, held);
    }
    assert_int_equal(perp_load_friction_uniqueness(a.friction, &unique, NULL), PERP_OK);
    assert_int_equal(unique.verdict, PERP_LOAD_NOT_UNIQUE);
    finish(&a);
}

/* n = p = 3, random: the verdict of the closed criterion against all 2 p eigenvalues of the
 * first-order system, and the latter against the roots. */
static void test_criterion(void **state)
{
    const int32_t slip[] = {1, 1, 1}, load[] = {1, 1, 1};
    perp_compliant_stability stability = fresh_compliant_stability();
    double numbers[27], first[36], re[6], im[6], gamma[6], roots[12], coefficients[3] = {1, 1, 1};
    uint64_t seed = 3;
    int round, i, j, stable = 0, flutter = 0;

    (void)state;
    for (round = 0; round < 1000; round++) {
        perp_matrix mass, normal, tangent;
        perp_compliant_system system = fresh_compliant_system();
        perp_compliant *compliant;
        perp_context *context;
        double growth = -INFINITY;

        for (i = 0; i < 27; i++) {
            seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
            numbers[i] = i < 9 || (i < 18 && i % 4 != 1)
                             ? 0
                             : 3 * ((double)(int64_t)(seed >> 33) / 1073741824.0 - 1.0);
        }
        for (i = 0; i < 3; i++) /* mass and normal are unit matrices: Gamma = I + tangent' */
            numbers[4 * i] = numbers[9 + 4 * i] = 1;
        mass = matrix_rows(numbers, 3, 3);
        normal = matrix_rows(numbers + 9, 3, 3);
        tangent = matrix_rows(numbers + 18, 3, 3);
        system.n = system.contacts = 3;
        system.mass = &mass;
        system.normal = &normal;
        system.tangent = &tangent;
        system.mu = coefficients;
        system.stiffness = pow(10, (double)(round % 7) / 2 - 1);
        system.damping = pow(10, (double)(round % 5) / 2 - 1);
        assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
        assert_int_equal(perp_compliant_create(context, &compliant, &system), PERP_OK);
        assert_int_equal(perp_compliant_linearise(compliant, &stability, gamma, roots, slip, load),
                         PERP_OK);
        memset(first, 0, sizeof first);
        for (i = 0; i < 3; i++) {
            first[i + 6 * (3 + i)] = 1;
            for (j = 0; j < 3; j++) {
                const double entry = (i == j) + numbers[18 + 3 * j + i];

                first[3 + i + 6 * j] = -system.stiffness * entry;
                first[3 + i + 6 * (3 + j)] = -system.damping * entry;
            }
        }
        assert_int_equal(perp__eigenvalues(6, first, re, im), 0);
        for (i = 0; i < 6; i++)
            growth = fmax(growth, re[i]);
        /* eigenvalues of a matrix of norm up to 1000, condition of a few hundred */
        assert_true(fabs(growth - stability.growth) < 1e-9);
        assert_int_equal(stability.stable, growth < 0);
        stable += stability.stable;
        flutter += stability.flutter;
        perp_compliant_destroy(compliant);
        perp_context_destroy(context);
    }
    assert_true(stable > 100 && flutter > 20 && stable + flutter < 900);
}

/* A, C, mu, S in coordinates (q, y) with mass [A C'; C S + C A^-1 C'], contacts on y. */
static void test_reduced_model(void **state)
{
    const double A[] = {2, 1, 1, 2}, C[] = {3, 1, 1, 3}, d[] = {1, 1}, zero[] = {0, 0};
    const double one[] = {1, 1}, S[] = {1, 0.25, 0.25, 2};
    /* C A^-1 C' = [3 1; 1 3] [2 -1; -1 2] / 3 [3 1; 1 3] = [14 2; 2 14] / 3 */
    const double mass[] = {
        2,           1, 3, 1, 1, 2, 1, 3, 3, 1, 1 + 14.0 / 3, 0.25 + 2.0 / 3, 1, 3, 0.25 + 2.0 / 3,
        2 + 14.0 / 3};
    const double normal[] = {0, 0, -1, 0, 0, 0, 0, -1}, tangent[] = {1, 0, 0, 0, 0, 1, 0, 0};
    perp_matrix view[4];
    perp_compliant_stability stability = fresh_compliant_stability();
    perp_compliant_system system;
    perp_compliant *compliant;
    double roots[8];
    asked a;
    int k, i, j;

    (void)state;
    for (k = 0; k < 4; k++)
        perp_struct_init(&view[k], sizeof view[k]);
    perp_matrix_dense(&view[0], PERP_STORAGE_ROW_MAJOR, 2, 2, S, 2);
    perp_matrix_dense(&view[1], PERP_STORAGE_ROW_MAJOR, 4, 4, mass, 4);
    perp_matrix_dense(&view[2], PERP_STORAGE_ROW_MAJOR, 2, 4, normal, 4);
    perp_matrix_dense(&view[3], PERP_STORAGE_ROW_MAJOR, 2, 4, tangent, 4);
    describe(&a, 2, A, zero, C, d, one)->normal_inertia = &view[0];
    a.system.stiffness = 100;
    a.system.damping = 3;
    start(&a, NULL);
    perp_struct_init(&system, sizeof system);
    system.n = 4;
    system.contacts = 2;
    system.mass = &view[1];
    system.normal = &view[2];
    system.tangent = &view[3];
    system.mu = one;
    system.stiffness = 100;
    system.damping = 3;
    assert_int_equal(perp_compliant_create(a.context, &compliant, &system), PERP_OK);
    assert_int_equal(ask(&a, zero, one), 4);
    for (k = 0; k < 4; k++) {
        const perp_load_found found = answer(&a, k);
        const int32_t slip[] = {1, 1};
        const int32_t load[] = {found.normal_force[0] > 0 ? 1 : -1,
                                found.normal_force[1] > 0 ? 1 : -1};

        assert_int_equal(perp_compliant_linearise(compliant, &stability, NULL, roots, slip, load),
                         PERP_OK);
        assert_int_equal(found.stable, stability.stable);
        for (i = 0; i < 4; i++) {
            double least = INFINITY;

            for (j = 0; j < 4; j++)
                least = fmin(least, hypot(found.eigenvalues[2 * i] - roots[2 * j],
                                          found.eigenvalues[2 * i + 1] - roots[2 * j + 1]));
            assert_true(least < 1e-11); /* of numbers up to 20 */
        }
    }
    perp_compliant_destroy(compliant);
    finish(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_screw_eigenvalues),
        cmocka_unit_test(test_rigid_screw),
        cmocka_unit_test(test_criterion),
        cmocka_unit_test(test_reduced_model),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* The binary interface of perp/bristle.h, pinned: as tests/abi/test_layout.c, which see. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <perp/mechanism.h>

#define SIZE(type, size) assert_int_equal(sizeof(type), size)
#define FIELD(type, field, offset, size)             \
    assert_int_equal(offsetof(type, field), offset); \
    assert_int_equal(sizeof(((type *)0)->field), size)

static void test_bristle(void **state)
{
    (void)state;
    SIZE(perp_bristle, 56);
    FIELD(perp_bristle, struct_size, 0, 8);
    FIELD(perp_bristle, kinetic, 8, 8);
    FIELD(perp_bristle, breakaway, 16, 8);
    FIELD(perp_bristle, speed, 24, 8);
    FIELD(perp_bristle, viscosity, 32, 8);
    FIELD(perp_bristle, stiffness, 40, 8);
    FIELD(perp_bristle, damping, 48, 8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_bristle)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}

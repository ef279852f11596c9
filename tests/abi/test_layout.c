/* What a C compiler makes of the headers, beside layout.def: the size of every public struct, the
 * place of every field and the value of every constant, on machines with 64-bit longs and pointers.
 * The numbers there follow from the declarations by the rules of the System V ABI, not from a
 * compiler's output, and were committed: an accident in a header is seen here.
 *
 * A release may add fields at the end of a struct, and constants; nothing else may ever change
 * (docs/abi.md). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <perp/mechanism.h>
#include <perp/perp.h>

static int different;

static void same(const char *type, const char *what, long long found, long long pinned)
{
    if (found != pinned) {
        print_error("%s %s is %lld, pinned as %lld\n", type, what, found, pinned);
        different++;
    }
}

/* A block for each struct, in which `here` is its type and `name` its name. */
#define SAME(what, found, pinned) same(name, what, (long long)(found), pinned)
#define SIZE(type, size) SAME("size", sizeof(type), size)
#define STRUCT(type, size)         \
    {                              \
        typedef type here;         \
        const char name[] = #type; \
        SIZE(type, size);
#define FIELD(field, offset, size)                            \
    SAME("offset of " #field, offsetof(here, field), offset); \
    SAME("size of " #field, sizeof(((here *)0)->field), size);
#define END }
#define VALUE(constant, value) same("constant", #constant, constant, value);

static void test_layout(void **state)
{
    (void)state;
#include "layout.def"
    assert_int_equal(different, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layout),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

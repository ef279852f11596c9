/* Tasks, and rounds of pieces: each once, and none before the round before it is over, on threads
 * of our own and however a caller runs them. A thread sanitizer sees what these tests can't (make
 * SANITIZE=thread test-threads). */
#include <string.h>

#include "suite.h"

#include "base/tasks.h"

enum { ROUNDS = 300, MOST = 100 };

/* Piece i of a round adds one to what its right neighbour had in the round before: if all come once
 * and in time, every number is that of the rounds. */
typedef struct field {
    int32_t number[2][MOST + 3];
    int32_t now, first, end;
} field;

static void add_one(int32_t i, void *data)
{
    field *f = data;
    const int32_t next = i + 1 < f->end ? i + 1 : f->first;

    f->number[!f->now][i] = f->number[f->now][next] + 1;
}

static void count_one(int32_t i, void *data)
{
    ((int32_t *)data)[i]++;
}

/* Last first, some twice, which is once too often. */
static void run_backwards(perp_task task, void *data, int32_t count, void *user)
{
    (void)user;
    for (int32_t i = count; i-- > 0;) {
        task(i, data);
        if (i % 2 == 0)
            task(i, data);
    }
}

static void run_nothing(perp_task task, void *data, int32_t count, void *user)
{
    (void)task;
    (void)data;
    (void)count;
    (void)user;
}

static void run_rounds(perp__tasks *tasks, int32_t first, int32_t end)
{
    field f;
    int32_t counts[MOST + 3] = {0};

    memset(&f, 0, sizeof f);
    f.first = first;
    f.end = end;
    perp__tasks_open(tasks);
    for (int32_t k = 0; k < ROUNDS; k++) {
        perp__tasks_pieces(tasks, first, end, add_one, &f);
        f.now = !f.now;
        perp__tasks_pieces(tasks, first, end, count_one, counts);
    }
    perp__tasks_close(tasks);
    for (int32_t i = 0; i < MOST + 3; i++) {
        const int32_t expected = i >= first && i < end ? ROUNDS : 0;

        assert_int_equal(f.number[f.now][i], expected);
        assert_int_equal(counts[i], expected);
    }
}

static void test_rounds(void **state)
{
    static const perp_run_tasks ways[] = {NULL, run_backwards, run_nothing};
    static const int32_t threads[] = {1, 2, 3, 8};
    perp_context *context;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    for (int32_t w = 0; w < 3; w++)
        for (int32_t t = 0; t < 4; t++) {
            perp__tasks *tasks;

            assert_int_equal(perp__tasks_create(context, &tasks, threads[t], ways[w], NULL),
                             PERP_OK);
            for (int32_t count = 1; count <= MOST; count += count < 10 ? 1 : 45) {
                int32_t counts[8] = {0};

                run_rounds(tasks, count % 3, count % 3 + count);
                perp__tasks_run(tasks, count_one, counts);
                for (int32_t i = 0; i < 8; i++)
                    assert_int_equal(counts[i], i < threads[t]);
            }
            perp__tasks_destroy(tasks);
        }
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rounds),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

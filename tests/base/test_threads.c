/* Threads: contexts that share nothing, side by side; a context handed from one thread to the next;
 * the threads of a batch. A thread sanitizer sees what these tests can't (make SANITIZE=thread). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"
#include <pthread.h>

#include <perp/perp.h>

enum { THREADS = 4, ROUNDS = 20, N = 40, MOST_WRONG = 1000 };

/* cmocka's assertions jump: a thread counts instead what is wrong. */
typedef struct worker {
    pthread_t thread;
    double mass; /* every thread has numbers of its own */
    int32_t wrong;
    perp_context *context;
    perp_lcp_solver *lcp;
    perp_contact_solver *contact;
    perp_world *world;
    perp_body ball;
    double M[N * N];
    perp_matrix view, W;
    double friction, W_values[4];
} worker;

static void require(worker *w, int32_t right)
{
    if (!right && w->wrong < MOST_WRONG)
        w->wrong++;
}

/* M = mass tridiag(-1, 2, -1), q = -mass: z_i = (i + 1)(N - i) / 2, an interior parabola. */
static void set_up_lcp(worker *w)
{
    int32_t i;

    for (i = 0; i < N; i++) {
        w->M[i * N + i] = 2 * w->mass;
        if (i > 0)
            w->M[i * N + i - 1] = w->M[(i - 1) * N + i] = -w->mass;
    }
    require(w, perp_struct_init(&w->view, sizeof w->view) == PERP_OK);
    require(w, perp_matrix_dense(&w->view, PERP_STORAGE_ROW_MAJOR, N, N, w->M, N) == PERP_OK);
    require(w, perp_lcp_solver_create(w->context, &w->lcp, NULL) == PERP_OK);
    require(w, perp_lcp_solver_setup(w->lcp, &w->view, NULL, NULL) == PERP_OK);
}

/* 1e-9: the answer is of order N^2 / 8 = 200, the condition of order N^2 = 1600. */
static void solve_lcp(worker *w)
{
    double z[N], q[N];
    perp_lcp_result result;
    int32_t i;

    for (i = 0; i < N; i++)
        q[i] = -w->mass;
    require(w, perp_struct_init(&result, sizeof result) == PERP_OK);
    require(w, perp_lcp_solver_solve(w->lcp, z, NULL, NULL, &result, q, NULL) == PERP_OK);
    require(w, result.outcome == PERP_OUTCOME_SOLVED);
    for (i = 0; i < N; i++)
        require(w, fabs(z[i] - (i + 1) * (N - i) / 2.0) <= 1e-9);
}

/* A mass that is pressed down by 1 and pushed along by 1 slides for mu < 1: r = (mass, mu mass). */
static void set_up_contact(worker *w)
{
    perp_contact_laws laws;

    w->friction = 0.5;
    w->W_values[0] = w->W_values[3] = 1 / w->mass;
    require(w, perp_contact_laws_init(&laws, sizeof laws) == PERP_OK);
    laws.contacts = 1;
    laws.dim = 2;
    laws.mu = &w->friction;
    require(w, perp_struct_init(&w->W, sizeof w->W) == PERP_OK);
    require(w, perp_matrix_dense(&w->W, PERP_STORAGE_ROW_MAJOR, 2, 2, w->W_values, 2) == PERP_OK);
    require(w, perp_contact_solver_create(w->context, &w->contact, NULL) == PERP_OK);
    require(w, perp_contact_solver_setup_delassus(w->contact, &laws, &w->W) == PERP_OK);
}

/* 1e-7: what counts as solved is 1e-8 of the largest velocity, 1. */
static void solve_contact(worker *w)
{
    const double q[2] = {-1.0, 1.0};
    double r[2] = {0, 0};
    perp_contact_result result;

    require(w, perp_struct_init(&result, sizeof result) == PERP_OK);
    require(w, perp_contact_solver_solve_delassus(w->contact, ANSWER(NULL, r), &result, q, NULL) ==
                   PERP_OK);
    require(w, fabs(r[0] - w->mass) <= 1e-7 * w->mass);
    require(w, fabs(r[1] + 0.5 * w->mass) <= 1e-7 * w->mass);
}

/* A ball at rest on a plane. */
static void set_up_world(worker *w)
{
    const double up[3] = {0, 0, 1};
    perp_body_settings settings;

    require(w, perp_world_create(w->context, &w->world, NULL) == PERP_OK);
    require(w, perp_world_add_plane(w->world, NULL, perp_world_ground(w->world), up, 0.0, NULL) ==
                   PERP_OK);
    require(w, perp_body_settings_init(&settings, sizeof settings) == PERP_OK);
    settings.mass = w->mass;
    settings.position[2] = 1.0;
    require(w, perp_world_add_body(w->world, &w->ball, &settings) == PERP_OK);
    require(w, perp_world_add_sphere(w->world, NULL, w->ball, 1.0, NULL) == PERP_OK);
}

/* What rests has velocity 0.0, and is carried by m g dt (1e-12: some roundings). */
static void step_world(worker *w)
{
    perp_body_state state;
    perp_world_contact contact;

    require(w, perp_world_step(w->world, NULL, 0.01) == PERP_OK);
    require(w, perp_body_state_init(&state, sizeof state) == PERP_OK);
    require(w, perp_world_get_body(w->world, &state, w->ball) == PERP_OK);
    require(w, state.position[2] == 1.0 && state.velocity[2] == 0.0);
    require(w, perp_struct_init(&contact, sizeof contact) == PERP_OK);
    require(w, perp_world_get_contact(w->world, &contact, 0) == PERP_OK);
    require(w, fabs(contact.impulse[0] - w->mass * 9.81 * 0.01) <= 1e-12 * w->mass);
}

/* Two problems at once on two threads of the call's own: z = (1, 0), and 0. */
static void solve_batch(worker *w)
{
    const double M[8] = {1, 0, 0, 1, 1, 0, 0, 1}, q[4] = {-1, 1, 1, 1};
    double z[4];

    require(w, perp_lcp_batch(w->context, z, NULL, NULL, NULL, NULL, 2,
                              LCP_STACK(2, 2, M, q, NULL, NULL)) == PERP_OK);
    require(w, z[0] == 1 && z[1] == 0 && z[2] == 0 && z[3] == 0);
}

static void create(worker *w)
{
    require(w, perp_context_create(&w->context, NULL) == PERP_OK);
    set_up_lcp(w);
    set_up_contact(w);
    set_up_world(w);
}

static void work(worker *w)
{
    int32_t round;

    for (round = 0; round < ROUNDS; round++) {
        solve_lcp(w);
        solve_contact(w);
        step_world(w);
        if (round % 5 == 0)
            solve_batch(w);
        /* a refusal writes the message: it is the context's own too */
        require(w, perp_world_step(w->world, NULL, -1.0) == PERP_ERROR_ARGUMENT);
        require(w, perp_context_message(w->context)[0] != '\0');
    }
}

static void destroy(worker *w)
{
    perp_lcp_solver_destroy(w->lcp);
    perp_contact_solver_destroy(w->contact);
    perp_context_destroy(w->context);
    perp_world_destroy(w->world); /* the last one: it takes the context with it */
}

static void *live(void *user)
{
    create(user);
    work(user);
    destroy(user);
    return NULL;
}

static void *only_create(void *user)
{
    create(user);
    return NULL;
}

static void *only_work(void *user)
{
    work(user);
    return NULL;
}

static void *only_destroy(void *user)
{
    destroy(user);
    return NULL;
}

static worker *make_workers(void)
{
    worker *workers = calloc(THREADS, sizeof *workers);
    int32_t k;

    assert_non_null(workers);
    for (k = 0; k < THREADS; k++)
        workers[k].mass = 1 << k;
    return workers;
}

static void run(worker *w, void *(*function)(void *))
{
    assert_int_equal(pthread_create(&w->thread, NULL, function, w), 0);
}

static void wait_for(worker *w)
{
    assert_int_equal(pthread_join(w->thread, NULL), 0);
    assert_int_equal(w->wrong, 0);
}

/* Two contexts on two threads share nothing. */
static void test_side_by_side(void **state)
{
    worker *workers = make_workers();
    int32_t k;

    (void)state;
    for (k = 0; k < THREADS; k++)
        run(&workers[k], live);
    for (k = 0; k < THREADS; k++)
        wait_for(&workers[k]);
    free(workers);
}

/* A context belongs to one thread at a time: created here, used there, used elsewhere, released by
 * a fourth, with nothing but the joins between them. */
static void test_handed_over(void **state)
{
    worker *w = make_workers();

    (void)state;
    run(w, only_create);
    wait_for(w);
    run(w, only_work);
    wait_for(w);
    work(w);
    assert_int_equal(w->wrong, 0);
    run(w, only_work);
    wait_for(w);
    run(w, only_destroy);
    wait_for(w);
    free(w);
}

/* While threads work, others of their kind come and go. */
static void test_come_and_go(void **state)
{
    worker *workers = make_workers();
    int32_t round;

    (void)state;
    run(&workers[0], live);
    run(&workers[1], live);
    for (round = 0; round < 8; round++) {
        run(&workers[2], live);
        wait_for(&workers[2]);
        memset(&workers[2], 0, sizeof workers[2]);
        workers[2].mass = 1 + round;
    }
    wait_for(&workers[0]);
    wait_for(&workers[1]);
    free(workers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_side_by_side),
        cmocka_unit_test(test_handed_over),
        cmocka_unit_test(test_come_and_go),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

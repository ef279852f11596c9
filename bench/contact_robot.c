/* The robot's case of perp_contact: a few contacts, joint limits and equality rows over the dense
 * or tree-sparse M of a machine of hinges that moves, 3-D, exact cone. Every step has a new M and H
 * of the same sizes, so that a step is a set-up and a solve by one kept solver: 'set-up', 'cold'
 * (without a start) and 'warm' (from the answer of the step before) are medians over the steps, in
 * microseconds of one thread, through the public calls with checks, verdict and zeros. 'error': the
 * largest difference of v from the answer to 1e-13 next to it, over the largest |v|; 'residual':
 * the largest tested one; 'good': steps with outcome solved or rounding_limit. */
#include "measure.h"

enum { LINKS = 40, WIDTH = 64, ROWS = 160, STEPS = 40 };

/* A tree of links, each on a hinge of its parent's; link 0 floats, with six velocities, or is fixed
 * to the world. Links' masses are points and a ball about them. */
typedef struct machine {
    uint64_t seed;
    int32_t links, floats, n;
    int32_t parent[LINKS];
    double axis[LINKS][3], at[LINKS][3], centre[LINKS][3]; /* in the parent; in itself */
    double mass[LINKS];
    double angle[LINKS], speed[LINKS], gap[LINKS][2]; /* of joints; to their lower bounds */
    /* in the world */
    double turn[LINKS][9], origin[LINKS][3];
} machine;

typedef struct scene {
    const char *name;
    machine robot;
    int32_t contacts, link[16], bars, bar[4][2];
    double point[16][3], mu;
    int32_t pins, pin[8][2]; /* about y, at the origin of the second; after the contacts */
    int32_t sparse;
} scene;

/* One step: M v = f + H'r + G's, ... */
typedef struct step {
    double M[WIDTH * WIDTH], H[ROWS * WIDTH], G[8 * WIDTH], f[WIDTH], w[ROWS], b[8];
    double M_values[WIDTH * WIDTH], H_values[ROWS * WIDTH];
    int32_t M_starts[WIDTH + 1], M_rows[WIDTH * WIDTH], H_starts[WIDTH + 1], H_rows[ROWS * WIDTH];
    int32_t rows, equations;
} step;

static void cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static void rotate(const double *R, const double *x, double *y)
{
    for (int i = 0; i < 3; i++)
        y[i] = R[3 * i] * x[0] + R[3 * i + 1] * x[1] + R[3 * i + 2] * x[2];
}

/* R := R (rotation by angle about the unit axis) */
static void turn(double *R, const double *axis, double angle)
{
    const double c = cos(angle), s = sin(angle);
    double Q[9], P[9];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            Q[3 * i + j] = (i == j ? c : 0) + (1 - c) * axis[i] * axis[j];
    Q[1] -= s * axis[2], Q[2] += s * axis[1], Q[5] -= s * axis[0];
    Q[3] += s * axis[2], Q[6] -= s * axis[1], Q[7] += s * axis[0];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            P[3 * i + j] = R[3 * i] * Q[j] + R[3 * i + 1] * Q[3 + j] + R[3 * i + 2] * Q[6 + j];
    memcpy(R, P, sizeof P);
}

static void place(machine *m)
{
    for (int32_t k = 0; k < m->links; k++) {
        const int32_t p = m->parent[k];
        double shift[3];
        if (p < 0) {
            memset(m->turn[k], 0, sizeof m->turn[k]);
            m->turn[k][0] = m->turn[k][4] = m->turn[k][8] = 1;
            memset(m->origin[k], 0, sizeof m->origin[k]);
        } else {
            memcpy(m->turn[k], m->turn[p], sizeof m->turn[k]);
            rotate(m->turn[p], m->at[k], shift);
            for (int i = 0; i < 3; i++)
                m->origin[k][i] = m->origin[p][i] + shift[i];
        }
        if (p >= 0 || !m->floats)
            turn(m->turn[k], m->axis[k], m->angle[k]);
    }
}

/* The velocity that joint k has the number of. */
static int32_t number_of(const machine *m, int32_t k)
{
    return m->floats ? 5 + k : k;
}

/* J, 3 by n: velocity of the point of link k at x in the world; angular: that of the link. */
static void point_rows(const machine *m, int32_t k, const double *x, double *J, double *angular)
{
    double axis[3], arm[3], v[3];
    memset(J, 0, 3 * WIDTH * sizeof *J);
    if (angular)
        memset(angular, 0, 3 * WIDTH * sizeof *angular);
    for (int32_t l = k; l >= 0; l = m->parent[l]) {
        for (int i = 0; i < 3; i++)
            arm[i] = x[i] - m->origin[l][i];
        if (l == 0 && m->floats) {
            for (int a = 0; a < 3; a++) {
                const double e[3] = {a == 0, a == 1, a == 2};
                cross(e, arm, v);
                J[a * WIDTH + a] = 1;
                for (int i = 0; i < 3; i++)
                    J[i * WIDTH + 3 + a] = v[i];
                if (angular)
                    angular[a * WIDTH + 3 + a] = 1;
            }
            break;
        }
        rotate(m->turn[l], m->axis[l], axis);
        cross(axis, arm, v);
        for (int i = 0; i < 3; i++) {
            J[i * WIDTH + number_of(m, l)] = v[i];
            if (angular)
                angular[i * WIDTH + number_of(m, l)] = axis[i];
        }
    }
}

static void world_point(const machine *m, int32_t k, const double *local, double *x)
{
    rotate(m->turn[k], local, x);
    for (int i = 0; i < 3; i++)
        x[i] += m->origin[k][i];
}

static void add_mass(const machine *m, int32_t k, step *s)
{
    double J[3 * WIDTH], A[3 * WIDTH], x[3];
    const double inertia = 0.01 * m->mass[k];
    world_point(m, k, m->centre[k], x);
    point_rows(m, k, x, J, A);
    for (int32_t i = 0; i < m->n; i++)
        for (int32_t j = 0; j < m->n; j++)
            for (int a = 0; a < 3; a++)
                s->M[i * m->n + j] += m->mass[k] * J[a * WIDTH + i] * J[a * WIDTH + j] +
                                      inertia * A[a * WIDTH + i] * A[a * WIDTH + j];
}

static void compress(const double *A, int32_t rows, int32_t n, double *values, int32_t *starts,
                     int32_t *indices)
{
    int32_t at = 0;
    for (int32_t j = 0; j < n; j++) {
        starts[j] = at;
        for (int32_t i = 0; i < rows; i++)
            if (A[i * n + j] != 0) {
                values[at] = A[i * n + j];
                indices[at++] = i;
            }
    }
    starts[n] = at;
}

/* A frictional pin: what parts two links along x and z, and its radius times the relative spin. */
static void add_pin(const scene *c, int32_t k, step *s, int32_t row)
{
    const machine *m = &c->robot;
    double J[3 * WIDTH], K[3 * WIDTH], A[3 * WIDTH], B[3 * WIDTH];
    point_rows(m, c->pin[k][0], m->origin[c->pin[k][1]], J, A);
    point_rows(m, c->pin[k][1], m->origin[c->pin[k][1]], K, B);
    for (int32_t j = 0; j < m->n; j++) {
        s->H[row * m->n + j] = J[j] - K[j];
        s->H[(row + 1) * m->n + j] = J[2 * WIDTH + j] - K[2 * WIDTH + j];
        s->H[(row + 2) * m->n + j] = 0.02 * (A[WIDTH + j] - B[WIDTH + j]);
    }
}

/* Contacts, pins, then limits of all joints, then bars between two links' origins. */
static void add_rows(const scene *c, step *s, double h)
{
    static const int order[3] = {2, 0, 1};
    const machine *m = &c->robot;
    double J[3 * WIDTH], K[3 * WIDTH], x[3];
    int32_t row = 0;
    for (int32_t k = 0; k < c->contacts; k++) {
        world_point(m, c->link[k], c->point[k], x);
        point_rows(m, c->link[k], x, J, NULL);
        for (int a = 0; a < 3; a++, row++)
            memcpy(s->H + row * m->n, J + order[a] * WIDTH, (size_t)m->n * sizeof(double));
    }
    for (int32_t k = 0; k < c->pins; k++, row += 3)
        add_pin(c, k, s, row);
    for (int32_t k = m->floats ? 1 : 0; k < m->links; k++, row++) {
        s->H[row * m->n + number_of(m, k)] = 1;
        s->w[row] = m->gap[k][0] / h;
    }
    s->rows = row;
    for (int32_t k = 0; k < c->bars; k++) {
        point_rows(m, c->bar[k][0], m->origin[c->bar[k][0]], J, NULL);
        point_rows(m, c->bar[k][1], m->origin[c->bar[k][1]], K, NULL);
        for (int a = 0; a < 3; a++)
            for (int32_t j = 0; j < m->n; j++)
                s->G[(3 * k + a) * m->n + j] = J[a * WIDTH + j] - K[a * WIDTH + j];
    }
    s->equations = 3 * c->bars;
}

static void make_step(scene *c, int32_t number, step *s)
{
    const double h = 0.002, g = 9.81;
    uint64_t seed = 7;
    machine *m = &c->robot;
    memset(s, 0, sizeof *s);
    for (int32_t k = 0; k < m->links; k++)
        m->angle[k] += h * m->speed[k];
    place(m);
    for (int32_t k = 0; k < m->links; k++)
        add_mass(m, k, s);
    for (int32_t j = 0; j < m->n; j++)
        s->M[j * m->n + j] += 0.01; /* of the motors */
    add_rows(c, s, h);
    for (int32_t k = 0; k < m->links; k++) { /* f = M v + h (weights and torques) */
        double J[3 * WIDTH], x[3];
        world_point(m, k, m->centre[k], x);
        point_rows(m, k, x, J, NULL);
        for (int32_t j = 0; j < m->n; j++)
            s->f[j] -= h * g * m->mass[k] * J[2 * WIDTH + j];
    }
    for (int32_t j = m->floats ? 6 : 0; j < m->n; j++)
        s->f[j] += h * (10 * random_number(&seed) * sin(0.05 * number) + 5 * random_number(&seed));
    for (int32_t i = 0; i < m->n; i++)
        for (int32_t k = m->floats ? 1 : 0; k < m->links; k++)
            s->f[i] += s->M[i * m->n + number_of(m, k)] * m->speed[k];
    compress(s->M, m->n, m->n, s->M_values, s->M_starts, s->M_rows);
    compress(s->H, s->rows, m->n, s->H_values, s->H_starts, s->H_rows);
}

/* ---- the machines --------------------------------------------------------------------------- */

static int32_t add_link(machine *m, int32_t parent, int axis, double mass, double x, double y,
                        double z, double length)
{
    const int32_t k = m->links++;
    m->parent[k] = parent;
    m->axis[k][axis] = 1;
    m->at[k][0] = x, m->at[k][1] = y, m->at[k][2] = z;
    m->centre[k][2] = -0.5 * length;
    m->mass[k] = mass;
    m->angle[k] = 0.3 * random_number(&m->seed);
    m->speed[k] = 0.2 * random_number(&m->seed);
    m->gap[k][0] = k % 7 == 3 ? 0 : 0.3 + 0.2 * random_number(&m->seed); /* few are near */
    m->n = m->floats ? m->links + 5 : m->links;
    return k;
}

static void add_contact(scene *c, int32_t link, double x, double y, double z)
{
    const int32_t k = c->contacts++;
    c->link[k] = link;
    c->point[k][0] = x, c->point[k][1] = y, c->point[k][2] = z;
}

static void begin_scene(scene *c, const char *name, int32_t floats, int32_t sparse)
{
    memset(c, 0, sizeof *c);
    c->name = name;
    c->robot.floats = floats;
    c->robot.seed = 3;
    c->sparse = sparse;
    c->mu = 0.7;
}

/* Six hinges a leg, four an arm, one in the waist: 27 velocities. Hands may hold a bar. */
static void humanoid(scene *c, const char *name, int32_t feet, int32_t bars, int32_t sparse)
{
    machine *m = &c->robot;
    int32_t hands[2], waist;
    begin_scene(c, name, 1, sparse);
    add_link(m, -1, 0, 8, 0, 0, 0, 0);
    waist = add_link(m, 0, 2, 20, 0, 0, 0.1, -0.4);
    for (int side = 0; side < 2; side++) {
        const double y = side ? -0.1 : 0.1;
        int32_t k = add_link(m, 0, 2, 1, 0, y, 0, 0);
        k = add_link(m, k, 0, 1, 0, 0, 0, 0.05);
        k = add_link(m, k, 1, 6, 0, 0, 0, 0.4);
        k = add_link(m, k, 1, 4, 0, 0, -0.4, 0.4);
        k = add_link(m, k, 1, 0.5, 0, 0, -0.4, 0);
        k = add_link(m, k, 0, 1, 0, 0, 0, 0.05);
        for (int corner = 0; corner < 4 && side < feet; corner++)
            add_contact(c, k, corner % 2 ? 0.15 : -0.08, corner / 2 ? 0.05 : -0.05, -0.06);
    }
    for (int side = 0; side < 2; side++) {
        int32_t k = add_link(m, waist, 1, 1, 0, side ? -0.2 : 0.2, 0.4, 0);
        k = add_link(m, k, 0, 2, 0, 0, 0, 0.3);
        k = add_link(m, k, 2, 0.5, 0, 0, -0.3, 0);
        hands[side] = add_link(m, k, 1, 1.5, 0, 0, -0.05, 0.25);
    }
    c->bars = bars;
    c->bar[0][0] = hands[0];
    c->bar[0][1] = hands[1];
}

/* Three hinges a leg: 18 velocities, a contact a foot. */
static void quadruped(scene *c, const char *name, int32_t sparse)
{
    machine *m = &c->robot;
    begin_scene(c, name, 1, sparse);
    add_link(m, -1, 0, 12, 0, 0, 0, 0);
    for (int leg = 0; leg < 4; leg++) {
        int32_t k = add_link(m, 0, 0, 0.7, leg / 2 ? 0.2 : -0.2, leg % 2 ? 0.1 : -0.1, 0, 0.05);
        k = add_link(m, k, 1, 1, 0, 0, 0, 0.2);
        k = add_link(m, k, 1, 0.3, 0, 0, -0.2, 0.2);
        add_contact(c, k, 0, 0, -0.2);
    }
}

/* Six fingers of four hinges hold a thing that floats: 30 velocities, two contacts a finger. */
static void hand(scene *c, const char *name, int32_t sparse)
{
    machine *m = &c->robot;
    begin_scene(c, name, 1, sparse);
    add_link(m, -1, 0, 0.5, 0, 0, 0, 0);
    for (int finger = 0; finger < 6; finger++) {
        const double a = finger * 1.0471975511965976;
        int32_t k = add_link(m, 0, 2, 0.05, 0.05 * cos(a), 0.05 * sin(a), 0, 0.02);
        k = add_link(m, k, 1, 0.05, 0, 0, 0, 0.04);
        k = add_link(m, k, 1, 0.04, 0, 0, -0.04, 0.03);
        add_contact(c, k, 0, 0.01, -0.03);
        k = add_link(m, k, 1, 0.03, 0, 0, -0.03, 0.02);
        add_contact(c, k, 0, 0, -0.02);
    }
}

/* A scissor lift: two chains of six hinges about y, which frictional pins join link by link. */
static void lift(scene *c, const char *name, int32_t sparse)
{
    machine *m = &c->robot;
    int32_t last[2] = {0, 0};
    begin_scene(c, name, 0, sparse);
    add_link(m, -1, 1, 5, 0, 0, 0, 0);
    c->mu = 0.2;
    for (int32_t k = 0; k < 6; k++) {
        for (int side = 0; side < 2; side++)
            last[side] = add_link(m, last[side], 1, 1, k == 0 ? side - 0.5 : 0.0, 0, -0.3, 0.3);
        if (k > 0) {
            c->pin[c->pins][0] = last[0];
            c->pin[c->pins++][1] = last[1];
        }
    }
}

/* ---- measuring ------------------------------------------------------------------------------ */

typedef struct solver {
    perp_contact_solver *perp;
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    perp_matrix M, H, G;
    double mu[24], v[WIDTH], r[ROWS], u[ROWS], start[ROWS];
    int32_t modes[ROWS], two_sided[24];
    perp_contact_result result;
} solver;

static double seconds_of_setup(perp_context *context, solver *o, const scene *c, step *s)
{
    const int32_t n = c->robot.n, by_rows = PERP_STORAGE_ROW_MAJOR;
    double started;
    int made;
    if (c->sparse) {
        made = perp_matrix_csc(&o->M, n, n, s->M_starts, s->M_rows, s->M_values) == PERP_OK &&
               perp_matrix_csc(&o->H, s->rows, n, s->H_starts, s->H_rows, s->H_values) == PERP_OK;
    } else {
        made = perp_matrix_dense(&o->M, by_rows, n, n, s->M, n) == PERP_OK &&
               perp_matrix_dense(&o->H, by_rows, s->rows, n, s->H, n) == PERP_OK;
    }
    require(made && perp_matrix_dense(&o->G, by_rows, s->equations, n, s->G, n) == PERP_OK,
            "matrices");
    o->dynamics.n = n;
    o->dynamics.M = &o->M;
    o->dynamics.H = &o->H;
    o->dynamics.G = s->equations > 0 ? &o->G : NULL;
    o->laws.contacts = c->contacts + c->pins;
    o->laws.bounded = s->rows - 3 * o->laws.contacts;
    o->laws.mu = o->mu;
    o->laws.two_sided = c->pins > 0 ? o->two_sided : NULL;
    for (int32_t k = 0; k < o->laws.contacts; k++) {
        o->mu[k] = c->mu;
        o->two_sided[k] = k < c->contacts ? 0 : 2;
    }
    started = seconds_now();
    require(perp_contact_solver_setup_dynamics(o->perp, &o->laws, &o->dynamics) == PERP_OK,
            perp_context_message(context));
    return seconds_now() - started;
}

static double seconds_of_solve(perp_context *context, solver *o, const step *s, const double *r0)
{
    const perp_contact_answer answer = {sizeof answer, o->v, o->r, o->u, o->modes, NULL};
    const double started = seconds_now();
    require(perp_contact_solver_solve_dynamics(o->perp, &answer, &o->result, s->f, s->w, NULL,
                                               r0) == PERP_OK,
            perp_context_message(context));
    return seconds_now() - started;
}

static solver *new_solver(perp_context *context, double tol)
{
    solver *o = require_memory(sizeof *o);
    perp_contact_settings settings;
    memset(o, 0, sizeof *o);
    require(perp_contact_settings_init(&settings, sizeof settings) == PERP_OK &&
                perp_struct_init(&o->M, sizeof o->M) == PERP_OK &&
                perp_struct_init(&o->H, sizeof o->H) == PERP_OK &&
                perp_struct_init(&o->G, sizeof o->G) == PERP_OK &&
                perp_contact_laws_init(&o->laws, sizeof o->laws) == PERP_OK &&
                perp_struct_init(&o->dynamics, sizeof o->dynamics) == PERP_OK &&
                perp_struct_init(&o->result, sizeof o->result) == PERP_OK,
            "structs");
    settings.tol = tol;
    require(perp_contact_solver_create(context, &o->perp, &settings) == PERP_OK, "solver");
    return o;
}

static double error_of(const double *v, const double *exact, int32_t n)
{
    double most = 0, size = 1e-300;
    for (int32_t j = 0; j < n; j++) {
        most = fmax(most, fabs(v[j] - exact[j]));
        size = fmax(size, fabs(exact[j]));
    }
    return most / size;
}

typedef struct numbers {
    double setup[STEPS], cold[STEPS], warm[STEPS], error, residual;
    int32_t good, modes[5];
    int64_t iterations;
} numbers;

static void measure_step(perp_context *context, solver *o, solver *exact, const scene *c, step *s,
                         int32_t at, numbers *m)
{
    const size_t bytes = (size_t)(s->rows + s->equations) * sizeof(double);
    double setup = INFINITY, cold = INFINITY, warm = INFINITY;
    for (int k = 0; k < 5; k++) { /* what the machine does besides is left out */
        setup = fmin(setup, seconds_of_setup(context, o, c, s));
        cold = fmin(cold, seconds_of_solve(context, o, s, NULL));
        seconds_of_setup(context, o, c, s);
        warm = fmin(warm, seconds_of_solve(context, o, s, o->start));
    }
    memcpy(o->start, o->r, bytes);
    seconds_of_setup(context, exact, c, s);
    seconds_of_solve(context, exact, s, o->r); /* there may be other answers */
    if (at < 0)
        return;
    m->setup[at] = setup;
    m->cold[at] = cold;
    m->warm[at] = warm;
    m->error = fmax(m->error, error_of(o->v, exact->v, c->robot.n));
    m->residual = fmax(m->residual, o->result.residual);
    m->good += o->result.outcome == PERP_OUTCOME_SOLVED ||
               o->result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
    m->iterations += o->result.iterations;
    for (int32_t k = 0; k < o->laws.contacts + o->laws.bounded; k++)
        m->modes[o->modes[k]]++;
}

static void run(scene *c)
{
    perp_context *context;
    step *s = require_memory(sizeof *s);
    numbers m;
    solver *o, *exact;
    double setup, cold, warm;
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    o = new_solver(context, 1e-8);
    exact = new_solver(context, 1e-13);
    memset(&m, 0, sizeof m);
    for (int32_t k = -2; k < STEPS; k++) {
        make_step(c, k + 2, s);
        measure_step(context, o, exact, c, s, k, &m);
    }
    setup = 1e6 * median(m.setup, STEPS);
    cold = 1e6 * median(m.cold, STEPS);
    warm = 1e6 * median(m.warm, STEPS);
    printf("%-20s %3d %8d %6d %3d %5d/%d/%d %7.1f %6.1f %6.1f %9.1f %9.1f %8.1e %8.1e %3d/%d\n",
           c->name, c->robot.n, o->laws.contacts, o->laws.bounded, s->equations, m.modes[0] / STEPS,
           m.modes[1] / STEPS, m.modes[2] / STEPS, setup, cold, warm, setup + cold, setup + warm,
           m.error, m.residual, m.good, STEPS);
    perp_contact_solver_destroy(o->perp);
    perp_contact_solver_destroy(exact->perp);
    perp_context_destroy(context);
    free(o);
    free(exact);
    free(s);
}

int main(void)
{
    static scene c;
    double gflops, gbytes;
    print_machine_speed(&gflops, &gbytes);
    printf("\nModes: contacts and limits that separate / stick / slip, of a mean step.\n\n"
           "%-20s %3s %8s %6s %3s %9s %7s %6s %6s %9s %9s %8s %8s %s\n",
           "machine", "n", "contacts", "limits", "eq.", "modes", "set-up", "cold", "warm",
           "step cold", "step warm", "error", "residual", "good");
    humanoid(&c, "humanoid, one foot", 1, 0, 0);
    run(&c);
    humanoid(&c, "humanoid", 2, 0, 0);
    run(&c);
    humanoid(&c, "humanoid, loop", 2, 1, 0);
    run(&c);
    humanoid(&c, "humanoid, loop, CSC", 2, 1, 1);
    run(&c);
    quadruped(&c, "quadruped", 0);
    run(&c);
    quadruped(&c, "quadruped, CSC", 1);
    run(&c);
    hand(&c, "hand", 0);
    run(&c);
    hand(&c, "hand, CSC", 1);
    run(&c);
    lift(&c, "lift on pins", 0);
    run(&c);
    lift(&c, "lift on pins, CSC", 1);
    run(&c);
    return 0;
}

/* The life of handles: any order of creating, using and destroying on several contexts, with NULLs,
 * destroyed contexts that live on in what they made, calls back from callbacks (monitors and the
 * log), and memory that runs out at any allocation. */
#include <math.h>
#include <string.h>

#include "fuzz.h"

#define CONTEXTS 3
#define OBJECTS 6
#define CALLS 32

enum {
    NOTHING,
    LCP,
    NCP,
    CONTACT,
    WORLD,
    MECHANISM,
    FRICTION,
    SENSITIVITY,
    COMPLIANT,
    KINDS,
    RESERVED
};

typedef struct object {
    int kind, owner;
    void *handle;
} object;

static struct {
    perp_context *contexts[CONTEXTS];
    int gone[CONTEXTS];    /* destroyed by us; lives on while it has children */
    int running[CONTEXTS]; /* calls of each, one within the other */
    object objects[OBJECTS];
    fuzz_bytes *bytes;
    int depth; /* of callbacks */
} all;

static const double M[4] = {2, 1, 1, 2}, Q[2] = {-1, 1};
static perp_matrix view;

static int children(int owner)
{
    int k, count = 0;

    for (k = 0; k < OBJECTS; k++)
        count += all.objects[k].kind > NOTHING && all.objects[k].kind < KINDS &&
                 all.objects[k].owner == owner;
    return count;
}

/* What may be passed on: a context that was destroyed and has no children is no memory any more. */
static perp_context *usable(int k)
{
    return all.contexts[k] && (!all.gone[k] || children(k) > 0) ? all.contexts[k] : NULL;
}

static void any_call(void);

/* A callback of the library's: perhaps calls back, perhaps stops or aborts. */
static int32_t call_back(void)
{
    if (all.depth > 2)
        return 0;
    all.depth++;
    while (fuzz_one_in(all.bytes, 3))
        any_call();
    all.depth--;
    return fuzz_pick(all.bytes, 8) == 7 ? -1 : 0;
}

static int32_t lcp_monitor(const perp_lcp_progress *progress, void *user)
{
    (void)progress, (void)user;
    return call_back();
}

static int32_t visit(const perp_lcp_found *found, void *user)
{
    (void)found, (void)user;
    return call_back();
}

static int32_t contact_monitor(const perp_contact_progress *progress, void *user)
{
    (void)progress, (void)user;
    return call_back();
}

static int32_t function(double *F, const double *z, void *user)
{
    (void)user;
    F[0] = 2 * z[0] + z[1] - 1 + z[0] * z[0];
    F[1] = z[0] + 2 * z[1] + 1;
    return call_back();
}

static int32_t force(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t, (void)q, (void)v, (void)user;
    k[0] = -1;
    return call_back();
}

static int32_t rows(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                    void *user)
{
    (void)drift, (void)mu, (void)t, (void)user;
    gap[0] = q[0];
    H[0] = 1;
    return call_back();
}

static void say(const char *message, void *user)
{
    (void)user;
    if (!message[0])
        fuzz_fail("handles: the log gets a line of text");
    call_back();
}

/* Runs `expression`, a call in the context `owner`. */
#define INSIDE(owner_, expression)           \
    do {                                     \
        int nested_ = all.running[owner_]++; \
        check(nested_, (expression));        \
        all.running[owner_]--;               \
    } while (0)

static void check(int nested, perp_status status)
{
    if (status > 0 || status < PERP_ERROR_CALLBACK)
        fuzz_fail("handles: status %d", status);
    if (nested && status == PERP_OK)
        fuzz_fail("handles: a call from a callback of the same context is refused");
}

static void create_lcp(object *o, perp_context *context)
{
    perp_lcp_settings settings;

    if (perp_lcp_settings_init(&settings, sizeof settings) != PERP_OK)
        return;
    settings.monitor = lcp_monitor;
    settings.method = PERP_LCP_FISCHER;
    INSIDE(o->owner, perp_lcp_solver_create(context, (perp_lcp_solver **)&o->handle, &settings));
}

static void create_contact(object *o, perp_context *context)
{
    perp_contact_settings settings;

    if (perp_contact_settings_init(&settings, sizeof settings) != PERP_OK)
        return;
    settings.monitor = contact_monitor;
    INSIDE(o->owner,
           perp_contact_solver_create(context, (perp_contact_solver **)&o->handle, &settings));
}

static void create_mechanism(object *o, perp_context *context)
{
    perp_mechanism_model model;

    if (perp_mechanism_model_init(&model, sizeof model) != PERP_OK)
        return;
    model.velocities = model.contacts = model.dim = 1;
    model.force = force;
    model.contact_rows = rows;
    INSIDE(o->owner, perp_mechanism_create(context, (perp_mechanism **)&o->handle, NULL, &model));
}

static void create_others(object *o, perp_context *context, int kind)
{
    perp_load_system load;
    perp_compliant_system compliant;
    perp_lcp_sensitivity_info info;
    static const double z[2] = {0.5, 0}, mu[2] = {0.5, 0.5};

    if (perp_load_system_init(&load, sizeof load) != PERP_OK ||
        perp_struct_init(&compliant, sizeof compliant) != PERP_OK ||
        perp_struct_init(&info, sizeof info) != PERP_OK)
        return;
    load.n = compliant.n = compliant.contacts = 2;
    load.A = load.C = compliant.mass = compliant.normal = compliant.tangent = &view;
    load.mu = compliant.mu = mu;
    compliant.stiffness = 1;
    if (kind == FRICTION)
        INSIDE(o->owner,
               perp_load_friction_create(context, (perp_load_friction **)&o->handle, NULL, &load));
    else if (kind == COMPLIANT)
        INSIDE(o->owner, perp_compliant_create(context, (perp_compliant **)&o->handle, &compliant));
    else
        INSIDE(o->owner, perp_lcp_sensitivity_create(context, (perp_lcp_sensitivity **)&o->handle,
                                                     &info, NULL, LCP(&view, Q), z));
}

static void create(void)
{
    int at = fuzz_pick(all.bytes, OBJECTS), kind = 1 + fuzz_pick(all.bytes, KINDS - 1);
    int owner = fuzz_pick(all.bytes, CONTEXTS);
    perp_context *context = usable(owner);
    object made = {kind, owner, NULL};

    if (all.objects[at].kind != NOTHING)
        return;
    all.objects[at].kind = RESERVED; /* for what callbacks may do */
    if (kind == LCP)
        create_lcp(&made, context);
    else if (kind == NCP)
        INSIDE(owner, perp_ncp_solver_create(context, (perp_ncp_solver **)&made.handle, NULL));
    else if (kind == CONTACT)
        create_contact(&made, context);
    else if (kind == WORLD)
        INSIDE(owner, perp_world_create(context, (perp_world **)&made.handle, NULL));
    else if (kind == MECHANISM)
        create_mechanism(&made, context);
    else
        create_others(&made, context, kind);
    if (made.handle && (!context || all.gone[owner]))
        fuzz_fail("handles: kind %d was created on a context that was destroyed, or NULL", kind);
    made.kind = made.handle ? kind : NOTHING;
    all.objects[at] = made;
}

static void use_lcp(object *o)
{
    double z[2], w[2];
    perp_lcp_result result;

    INSIDE(o->owner, perp_lcp_solver_setup(o->handle, &view, NULL, NULL));
    if (perp_struct_init(&result, sizeof result) == PERP_OK)
        INSIDE(o->owner, perp_lcp_solver_solve(o->handle, z, w, NULL, &result, Q, NULL));
}

static void use_ncp(object *o)
{
    double z[2], w[2];
    perp_ncp_problem problem;
    perp_ncp_result result;

    if (perp_struct_init(&problem, sizeof problem) != PERP_OK ||
        perp_struct_init(&result, sizeof result) != PERP_OK)
        return;
    problem.n = 2;
    problem.function = function;
    INSIDE(o->owner, perp_ncp_solver_setup(o->handle, &problem));
    INSIDE(o->owner, perp_ncp_solver_solve(o->handle, z, w, &result, NULL));
}

static void use_contact(object *o)
{
    double r[2];
    perp_contact_laws laws;
    perp_contact_result result;

    if (perp_contact_laws_init(&laws, sizeof laws) != PERP_OK ||
        perp_struct_init(&result, sizeof result) != PERP_OK)
        return;
    laws.contacts = 1;
    laws.dim = 2;
    INSIDE(o->owner, perp_contact_solver_setup_delassus(o->handle, &laws, &view));
    INSIDE(o->owner,
           perp_contact_solver_solve_delassus(o->handle, ANSWER(NULL, r), &result, Q, NULL));
}

static void use_world(object *o)
{
    perp_body body = 0;
    perp_body_settings settings;

    if (perp_body_settings_init(&settings, sizeof settings) != PERP_OK)
        return;
    INSIDE(o->owner, perp_world_add_body(o->handle, &body, &settings));
    INSIDE(o->owner, perp_world_add_sphere(o->handle, NULL, body, 1.0, NULL));
    INSIDE(o->owner, perp_world_step(o->handle, NULL, fuzz_pick(all.bytes, 4) * 0.01));
    perp_world_contact_count(o->handle);
}

static void use_mechanism(object *o)
{
    double q[1] = {0}, v[1] = {-1};
    perp_mechanism_step step;
    perp_mechanism_summary summary;

    if (perp_struct_init(&step, sizeof step) != PERP_OK ||
        perp_struct_init(&summary, sizeof summary) != PERP_OK)
        return;
    INSIDE(o->owner, perp_mechanism_advance(o->handle, q, v, NULL, NULL, NULL, NULL, &step,
                                            START(0, 0.1, q, v)));
    INSIDE(o->owner, perp_mechanism_accelerations(o->handle, &summary, 0, q, v));
}

static void use_others(object *o)
{
    double x[2], y[2];
    perp_load_summary summary;
    perp_compliant_result result;

    if (perp_struct_init(&summary, sizeof summary) != PERP_OK ||
        perp_struct_init(&result, sizeof result) != PERP_OK)
        return;
    if (o->kind == FRICTION)
        INSIDE(o->owner, perp_load_friction_solve(o->handle, &summary, Q, Q));
    else if (o->kind == SENSITIVITY)
        INSIDE(o->owner, perp_lcp_sensitivity_forward(o->handle, x, Q, NULL, NULL, NULL));
    else
        INSIDE(o->owner, perp_compliant_run(o->handle, x, y, NULL, &result, NULL, Q, Q, 0.01));
}

static void use(void)
{
    object *o = &all.objects[fuzz_pick(all.bytes, OBJECTS)];

    if (o->kind != NOTHING && o->kind != RESERVED && !o->handle)
        fuzz_fail("handles: the target lost a handle");
    switch (o->kind) {
    case NOTHING:
    case RESERVED:
        return;
    case LCP:
        use_lcp(o);
        return;
    case NCP:
        use_ncp(o);
        return;
    case CONTACT:
        use_contact(o);
        return;
    case WORLD:
        use_world(o);
        return;
    case MECHANISM:
        use_mechanism(o);
        return;
    default:
        use_others(o);
    }
}

/* In a callback of its own context a destroy is ignored: the handle stays ours to release. */
static void destroy_object(object *o)
{
    object gone = *o;

    if (o->kind != RESERVED && !all.running[o->owner])
        o->kind = NOTHING;
    switch (gone.kind) {
    case LCP:
        perp_lcp_solver_destroy(gone.handle);
        break;
    case NCP:
        perp_ncp_solver_destroy(gone.handle);
        break;
    case CONTACT:
        perp_contact_solver_destroy(gone.handle);
        break;
    case WORLD:
        perp_world_destroy(gone.handle);
        break;
    case MECHANISM:
        perp_mechanism_destroy(gone.handle);
        break;
    case FRICTION:
        perp_load_friction_destroy(gone.handle);
        break;
    case SENSITIVITY:
        perp_lcp_sensitivity_destroy(gone.handle);
        break;
    case COMPLIANT:
        perp_compliant_destroy(gone.handle);
        break;
    default:
        break;
    }
}

/* Not in one of its own callbacks: perp/base.h doesn't say what that would be. */
static void destroy_context(void)
{
    int k = fuzz_pick(all.bytes, CONTEXTS);

    if (!all.contexts[k] || all.gone[k] || all.running[k])
        return;
    all.gone[k] = 1;
    perp_context_destroy(all.contexts[k]);
}

/* Calls that make and release everything themselves. */
static void call_at_once(void)
{
    int owner = fuzz_pick(all.bytes, CONTEXTS);
    perp_context *context = usable(owner);
    double z[2], outcomes_z[4];
    static const double two_M[8] = {2, 1, 1, 2, 2, 1, 1, 2}, two_q[4] = {-1, 1, -1, 1};
    perp_lcp_enumeration enumeration;
    perp_lcp_result result;
    perp_lcp_proof proof;

    if (perp_struct_init(&enumeration, sizeof enumeration) != PERP_OK ||
        perp_struct_init(&result, sizeof result) != PERP_OK ||
        perp_struct_init(&proof, sizeof proof) != PERP_OK)
        return;
    switch (fuzz_pick(all.bytes, 4)) {
    case 0:
        INSIDE(owner, perp_lcp_solve(context, z, NULL, NULL, &result, NULL, LCP(&view, Q), NULL));
        break;
    case 1:
        INSIDE(owner, perp_lcp_all(context, &enumeration, NULL, LCP(&view, Q), visit, NULL));
        break;
    case 2:
        INSIDE(owner, perp_lcp_batch(context, outcomes_z, NULL, NULL, NULL, NULL,
                                     1 + fuzz_one_in(all.bytes, 8),
                                     LCP_STACK(2, 2, two_M, two_q, NULL, NULL)));
        break;
    default:
        INSIDE(owner, perp_lcp_verify(context, NULL, &proof, LCP(&view, Q), Q));
    }
}

static void any_call(void)
{
    switch (fuzz_pick(all.bytes, 8)) {
    case 0:
    case 1:
        create();
        return;
    case 2:
    case 3:
    case 4:
        use();
        return;
    case 5:
        destroy_object(&all.objects[fuzz_pick(all.bytes, OBJECTS)]);
        return;
    case 6:
        call_at_once();
        return;
    default:
        destroy_context();
        fuzz_fail_after(fuzz_one_in(all.bytes, 3) ? fuzz_pick(all.bytes, 16) : -1);
    }
}

static void open_contexts(perp_context *counted)
{
    perp_context_settings settings;
    int k;

    all.contexts[0] = counted;
    for (k = 1; k < CONTEXTS; k++) {
        if (perp_struct_init(&settings, sizeof settings) != PERP_OK)
            return;
        settings.log = say;
        if (perp_context_create(&all.contexts[k], &settings) != PERP_OK)
            all.contexts[k] = NULL;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 0);
    int k;

    memset(&all, 0, sizeof all);
    all.bytes = &bytes;
    if (perp_struct_init(&view, sizeof view) != PERP_OK ||
        perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, 2, 2, M, 2) != PERP_OK)
        fuzz_fail("a view of a matrix can be made");
    open_contexts(context);
    for (k = 0; k < CALLS && bytes.at < bytes.end; k++)
        any_call();
    fuzz_fail_after(-1);
    bytes.at = bytes.end;
    for (k = 0; k < OBJECTS; k++)
        destroy_object(&all.objects[k]);
    for (k = 1; k < CONTEXTS; k++)
        if (!all.gone[k])
            perp_context_destroy(all.contexts[k]);
    fuzz_close(all.gone[0] ? NULL : context);
    return 0;
}

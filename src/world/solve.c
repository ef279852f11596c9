/* The complementarity problems of the islands.
 *
 * First stage, without restitution (Stewart & Trinkle 1995, Anitescu & Potra 1997), in the
 * impulses c, beta and the slip speed lambda of each contact:
 *
 *   0 <= c      perp  u_n - target    >= 0,    target = -max(gap, 0) / h
 *   0 <= beta   perp  D'u + e lambda  >= 0,    u = J v_f + J M^-1 J' r
 *   0 <= lambda perp  mu c - e'beta   >= 0
 *
 * Its velocities move the positions, so that a body that hits something ends the step touching it.
 *
 * Second stage, only after an impact: some contact presses, has restitution e > 0 and approached
 * faster than free forces alone explain, u_n- < -h |a_n| with h a_n = u_n(v_f) - u_n-. Slower
 * approaches are resting contact, which would else bounce at speeds of order g h for ever. The
 * same problem with Moreau's law: contacts that touch after the first stage have
 *
 *   target = -e u_n-,
 *
 * not clipped at 0 (with equal e a solution then always exists, 2 (1 + e) times the inelastic
 * change of velocity over 2); others have -max(e u_n-, gap'/h) with the gap' that the first stage
 * leaves. The velocities of this stage are those after the step. */
#include "world/world.h"

#include <math.h>

#include "base/context.h"
#include "lcp/lcp.h"
#include "world/spatial.h"

static void lay_out_rows(perp__arena *arena, perp__island_work *work)
{
    size_t rows = (size_t)work->max_rows;

    /* rows squared: two factors, so that the arena sees an overflow */
    work->matrix = perp__arena_take(arena, rows, rows * sizeof *work->matrix);
    work->q = perp__arena_take(arena, rows, sizeof *work->q);
    work->z = perp__arena_take(arena, rows, sizeof *work->z);
}

static void lay_out(perp__arena *arena, void *object)
{
    perp_world *world = object;
    perp__island_work *work = &world->work;
    size_t held = (size_t)work->max_held_rows;
    size_t columns = (size_t)work->max_columns;

    lay_out_rows(arena, work);
    work->held_rows = perp__arena_take(arena, held, columns * sizeof *work->held_rows);
    work->targets = perp__arena_take(arena, held, sizeof *work->targets);
    work->norms = perp__arena_take(arena, held, sizeof *work->norms);
    work->taken = perp__arena_take(arena, held, sizeof *work->taken);
    work->basis = perp__arena_take(arena, columns, columns * sizeof *work->basis);
    work->particular = perp__arena_take(arena, columns, sizeof *work->particular);
    work->loose = perp__arena_take(arena, columns, sizeof *work->loose);
    work->unit = perp__arena_take(arena, columns, sizeof *work->unit);
    work->group_bodies = perp__arena_take(arena, columns, sizeof *work->group_bodies);
}

perp_status perp__fit_island_work(perp_world *world, int32_t velocities)
{
    perp__island_work *work = &world->work;
    int32_t axes = world->settings.planar ? 2 : 3;
    int32_t i;

    work->max_rows = work->max_held_rows = work->max_columns = 0;
    for (i = 0; i < world->island_count; i++) {
        const perp__island *island = &world->islands[i];

        if (island->rows > work->max_rows)
            work->max_rows = island->rows;
        if (velocities && axes * island->contacts > work->max_held_rows)
            work->max_held_rows = axes * island->contacts;
        if (velocities && world->dof * island->bodies > work->max_columns)
            work->max_columns = world->dof * island->bodies;
    }
    return perp__arena_fit(&world->island_arena, lay_out, world);
}

perp_status perp__solve_rows(perp_world *world, int32_t n, int32_t same_matrix)
{
    perp__island_work *work = &world->work;
    perp_matrix W;
    perp_status status = PERP_OK;

    if (!same_matrix) {
        status = perp_matrix_init(&W, sizeof W);
        if (status == PERP_OK)
            status = perp_matrix_dense(&W, PERP_STORAGE_COLUMN_MAJOR, n, n, work->matrix, n);
        if (status == PERP_OK)
            status = perp__lcp_setup(world->solver, &W, NULL, NULL);
    }
    if (status == PERP_OK)
        status = perp__lcp_solve(world->solver, work->z, NULL, NULL, &work->result, work->q, NULL);
    return status;
}

static perp__world_contact *island_contact(const perp_world *world, const perp__island *island,
                                           int32_t i)
{
    return &world->contacts.contacts[world->contact_order[island->first_contact + i]];
}

/* A gap that is not told apart from 0 is 0: rounding of coordinates must not move what rests. */
static double positive_gap(const perp__world_contact *contact, double gap)
{
    return gap > contact->rounding ? gap : 0.0;
}

static void write_q(perp_world *world, const perp__island *island)
{
    int32_t i, j;

    for (i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = island_contact(world, island, i);
        double *q = world->work.q + contact->first_row;

        q[0] = contact->free[0] - contact->target;
        if (contact->edges == 0)
            continue;
        for (j = 0; j < contact->edges; j++)
            q[1 + j] = world->edge[j][0] * contact->free[1] + world->edge[j][1] * contact->free[2];
        q[1 + contact->edges] = 0.0;
    }
}

/* Impulses along the axes. Without a normal impulse there is no friction. */
static void read_impulses(perp_world *world, const perp__island *island)
{
    int32_t i, j;

    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = island_contact(world, island, i);
        const double *z = world->work.z + contact->first_row;

        contact->impulse[0] = z[0];
        contact->impulse[1] = contact->impulse[2] = 0.0;
        if (z[0] == 0.0)
            continue;
        for (j = 0; j < contact->edges; j++) {
            contact->impulse[1] += world->edge[j][0] * z[1 + j];
            contact->impulse[2] += world->edge[j][1] * z[1 + j];
        }
    }
}

static int32_t severity(perp_outcome outcome)
{
    return outcome == PERP_OUTCOME_RAY ? INT32_MAX : outcome;
}

/* Solves for the targets that stand, and writes the twist. */
static perp_status solve_stage(perp_world *world, const perp__island *island, int32_t second,
                               perp__solve_summary *summary)
{
    const perp_lcp_result *result = &world->work.result;
    perp_status status;

    write_q(world, island);
    status = perp__solve_rows(world, island->rows, second);
    if (status != PERP_OK)
        return status;
    summary->iterations += result->iterations;
    summary->residual = fmax(summary->residual, result->residual);
    if (severity(result->outcome) > severity(summary->outcome))
        summary->outcome = result->outcome;
    if (result->outcome == PERP_OUTCOME_RAY)
        return PERP_OK;
    read_impulses(world, island);
    perp__exact_velocities(world, island, second ? PERP__TWIST_AFTER : PERP__TWIST_MOVING);
    return PERP_OK;
}

/* First-stage targets; returns 1 if some contact would close by itself, else nothing needs solving.
 */
static int32_t first_targets(perp_world *world, const perp__island *island, double h)
{
    int32_t closing = 0;
    int32_t i;

    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = island_contact(world, island, i);

        contact->target = 0.0 - positive_gap(contact, contact->gap) / h; /* not -0.0 */
        closing = closing || contact->free[0] < contact->target;
    }
    return closing;
}

static int32_t is_impact(const perp__world_contact *contact)
{
    double forced = fabs(contact->free[0] - contact->start[0]); /* h |a_n| */

    return contact->restitution > 0.0 && contact->impulse[0] > 0.0 && contact->start[0] < -forced;
}

/* Second-stage targets where there was an impact; returns whether there was. */
static int32_t second_targets(perp_world *world, const perp__island *island, double h)
{
    int32_t impact = 0;
    int32_t i;

    for (i = 0; i < island->contacts; i++)
        impact = impact || is_impact(island_contact(world, island, i));
    for (i = 0; i < island->contacts && impact; i++) {
        perp__world_contact *contact = island_contact(world, island, i);
        double bounce = contact->restitution * contact->start[0];
        double gap = contact->gap + h * contact->velocity[0];

        if (contact->closed || positive_gap(contact, gap) == 0.0)
            contact->target = 0.0 - bounce;
        else
            contact->target = 0.0 - fmax(bounce, gap / h);
    }
    return impact;
}

static perp_status solve_island(perp_world *world, const perp__island *island, double h,
                                perp__solve_summary *summary)
{
    perp_status status;
    int32_t i;

    if (!first_targets(world, island, h))
        return PERP_OK; /* the free velocities, which motions hold already */
    summary->solved++;
    perp__assemble_matrix(world, &world->contacts, island);
    status = solve_stage(world, island, 0, summary);
    if (status != PERP_OK || summary->outcome == PERP_OUTCOME_RAY)
        return status;
    if (second_targets(world, island, h)) {
        summary->impacts++;
        return solve_stage(world, island, 1, summary);
    }
    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = &world->motions[world->body_order[island->first_body + i]];
        int32_t k;

        for (k = 0; k < 6; k++)
            motion->after[k] = motion->moving[k];
    }
    return PERP_OK;
}

/* Rows and velocities of all contacts, which then stand as if nothing touched. */
static void prepare_contacts(perp_world *world)
{
    int32_t i;

    for (i = 0; i < world->contacts.count; i++) {
        perp__world_contact *contact = &world->contacts.contacts[i];

        perp__contact_jacobian(world, world->states, contact);
        perp__relative_velocity(world, contact, PERP__TWIST_START, contact->start);
        perp__relative_velocity(world, contact, PERP__TWIST_FREE, contact->free);
        perp__copy3(contact->velocity, contact->free);
    }
}

perp_status perp__solve_islands(perp_world *world, double h, perp__solve_summary *summary)
{
    perp_status status = perp__fit_island_work(world, 1);
    int32_t i;

    summary->outcome = PERP_OUTCOME_SOLVED;
    summary->iterations = 0;
    summary->residual = 0.0;
    summary->solved = summary->impacts = 0;
    if (status == PERP_OK)
        prepare_contacts(world);
    for (i = 0; i < world->island_count && status == PERP_OK; i++) {
        status = solve_island(world, &world->islands[i], h, summary);
        if (summary->outcome == PERP_OUTCOME_RAY)
            break;
    }
    return status;
}

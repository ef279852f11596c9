/* Passes over the whole step: Gauss-Seidel with Nesterov's momentum, restarted where it leads back
 * (O'Donoghue & Candes 2015), that ends on a plain one. A normal row wants u_n >= -max(gap, 0) / h:
 * what the exact methods solve, of which this is what a budget gives. */
#include "contact/coloured/coloured.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/pivoting.h"
#include "linalg/spatial.h"

/* Nesterov's weight at most. */
#define MOMENTUM 0.9

/* What pieces read; they write to bodies, groups and contacts of their own. */
typedef struct job {
    perp__coloured *c;
    int32_t what; /* of a pass */
    double *y;
} job;

void perp__coloured_init(perp__coloured *c, perp_context *context)
{
    const perp__coloured_kernels *found[PERP__COLOURED_SETS];

    memset(c, 0, sizeof *c);
    perp__coloured_find_kernels(found);
    c->kernels = found[0];
    c->context = context;
}

void perp__coloured_release(perp__coloured *c)
{
    perp__arena_release(&c->arena);
    perp__arena_release(&c->point_arena);
    perp__joint_block_release(&c->joints);
}

/* ---- rounds of pieces, side by side where there are tasks ---- */

static bool is_shared(const perp__coloured *c)
{
    return c->is_large && c->tasks && c->points >= c->shared_from;
}

static void run_pieces(job *at, int32_t first, int32_t end, perp_task piece)
{
    if (end - first > 1 && is_shared(at->c))
        perp__tasks_pieces(at->c->tasks, first, end, piece, at);
    else
        for (int32_t i = first; i < end; i++)
            piece(i, at);
}

/* Of the bodies: of one problem, or of those that are side by side. */
static int32_t count_pieces(const perp__coloured *c)
{
    return c->parts > 1 ? c->parts : (c->bodies + PERP__PIECE_BODIES - 1) / PERP__PIECE_BODIES;
}

static perp__coloured_part *part_of(const perp__coloured *c, int32_t piece)
{
    return &c->part[c->parts > 1 ? piece : 0];
}

static int32_t first_body(const perp__coloured *c, int32_t piece)
{
    return c->parts > 1 ? c->part[piece].first_body : piece * PERP__PIECE_BODIES;
}

static int32_t end_body(const perp__coloured *c, int32_t piece)
{
    return piece + 1 < count_pieces(c) ? first_body(c, piece + 1) : c->bodies;
}

static void sweep_piece(int32_t i, void *data)
{
    const job *at = data;
    const int32_t *first = at->c->piece_first + i;

    at->c->kernels->pass(at->c, at->what, at->y, first[0], first[1]);
}

/* A pass, colour by colour: groups of one share no body. */
static void run_pass(job *at, int32_t what, double *y)
{
    const perp__coloured *c = at->c;

    if (!is_shared(c)) {
        c->kernels->pass(at->c, what, y, 0, c->groups);
        return;
    }
    at->what = what;
    at->y = y;
    for (int32_t k = 0; k < c->colour_count; k++)
        run_pieces(at, c->colour_first[k], c->colour_first[k + 1], sweep_piece);
}

/* ---- momentum ---- */

/* How much of the way from `before`, where the pass began, to y led back from where the last one
 * went; and y, moved on. `numbers` of each body's eight are used. */
PERP__KERNEL static double weigh_numbers(const perp__coloured *c, int32_t piece, size_t numbers)
{
    const size_t end = 8 * (size_t)end_body(c, piece);
    double back[8] = {0.0};

    for (size_t i = 8 * (size_t)first_body(c, piece); i < end; i += 8)
        for (size_t l = 0; l < numbers; l++)
            back[l] += (c->before[i + l] - c->y[i + l]) * (c->y[i + l] - c->moved[i + l]);
    return ((back[0] + back[4]) + (back[2] + back[6])) +
           ((back[1] + back[5]) + (back[3] + back[7]));
}

PERP__KERNEL static void move_numbers(const perp__coloured *c, int32_t piece, size_t numbers)
{
    const perp__coloured_part *part = part_of(c, piece);
    const size_t end = part->ended ? 0 : 8 * (size_t)end_body(c, piece);
    const double beta = part->momentum;

    for (size_t i = 8 * (size_t)first_body(c, piece); i < end; i += 8) {
        for (size_t l = 0; l < numbers; l++) {
            const double now = c->y[i + l];

            c->before[i + l] = c->y[i + l] = now + beta * (now - c->moved[i + l]);
            c->moved[i + l] = now;
        }
        c->before[i + numbers - 1] = c->y[i + numbers - 1] = beta;
    }
}

PERP__MULTIVERSION(weigh_way, (int32_t piece, void *data), (piece, data))
{
    const perp__coloured *c = ((const job *)data)->c;

    c->back[piece] = c->width == 3 ? weigh_numbers(c, piece, 4) : weigh_numbers(c, piece, 8);
}

PERP__MULTIVERSION(go_on, (int32_t piece, void *data), (piece, data))
{
    const perp__coloured *c = ((const job *)data)->c;

    if (c->width == 3)
        move_numbers(c, piece, 4);
    else
        move_numbers(c, piece, 8);
}

/* ---- passes ---- */

/* y := C^-1 v of the free velocities; no zero has a sign, which it would lose or keep as others do
 * beside it. */
static void start_bodies(int32_t i, void *data)
{
    const job *at = data;
    const perp__coloured *c = at->c;
    const int32_t width = c->width, block = width - 3; /* of C, 3 by 3 */
    const perp__coloured_part *part = part_of(c, i);

    for (int32_t body = first_body(c, i); body < end_body(c, i); body++) {
        const int32_t number = body - part->first_body;
        const double *C = part->problem->factors + width * width * number;
        double *y = c->free + 8 * body;

        memset(y, 0, 8 * sizeof *y);
        memcpy(y, part->problem->free + width * number, (size_t)width * sizeof *y);
        if (perp__is_zero3(y) && perp__is_zero3(y + 3)) {
            memset(c->y + 8 * body, 0, 8 * sizeof *y);
            continue;
        }
        for (int32_t k = 0; k < block; k++)
            y[k] /= C[7 * k];
        perp__solve_small(C + (width + 1) * block, 3, width, y + block, 1);
        for (int32_t k = 0; k < width; k++)
            y[k] += 0.0;
        memcpy(c->y + 8 * body, y, 8 * sizeof *y);
    }
}

static void fill_piece(int32_t i, void *data)
{
    const job *at = data;
    const int32_t *first = at->c->piece_first + i;

    perp__coloured_fill(at->c, first[0], first[1]);
}

/* The impulses of a part that are known; or none, where 1/2 y'y + r'w is above that of none, and so
 * they are farther from any answer, as those may be by which joints that say the same press each
 * other. */
static void check_start(perp__coloured *c, const perp__coloured_part *part)
{
    const size_t first = 8 * (size_t)part->first_body, end = 8 * (size_t)part->end_body;
    double more = 0.0;

    for (size_t i = first; i < end; i++)
        more += 0.5 * (c->y[i] - c->free[i]) * (c->y[i] + c->free[i]);
    for (int32_t k = part->first_contact; k < part->end_contact; k++) {
        const perp__lane_point *p = &c->point[c->place[k] / PERP__GROUP];
        const int32_t l = c->place[k] % PERP__GROUP;

        for (int32_t i = 0; i < 3; i++)
            more += p->r[i][l] * (i == 0 ? p->bias[l] : p->w[i][l]);
    }
    for (int32_t n = 0; n < c->joints.rows; n++)
        more += c->joints.r[n] * c->joints.w[n];
    if (more <= 0.0)
        return;
    for (int32_t k = part->first_contact; k < part->end_contact; k++) {
        perp__lane_point *p = &c->point[c->place[k] / PERP__GROUP];
        const int32_t l = c->place[k] % PERP__GROUP;

        for (int32_t i = p->inverse_normal[l] > 0.0 ? 0 : 1; i < 3; i++)
            p->r[i][l] = p->last[i][l] = 0.0; /* a bound is no impulse */
    }
    memcpy(c->y + first, c->free + first, (end - first) * sizeof *c->y);
    for (int32_t n = 0; n < c->joints.rows; n++)
        c->joints.r[n] = c->joints.last[n] = 0.0;
}

/* The impulses of the passes so far. */
static void read_impulses(const perp__coloured *c, const perp__coloured_part *part)
{
    const perp__rigid_problem *problem = part->problem;
    double *r = part->answer->impulse;

    for (int32_t k = part->first_contact; k < part->end_contact; k++)
        for (int32_t i = 0; i < 3; i++, r++)
            *r = c->point[c->place[k] / PERP__GROUP].r[i][c->place[k] % PERP__GROUP];
    for (int32_t k = problem->contacts, n = 0; k < problem->contacts + problem->joints; k++)
        for (int32_t i = 0; i < 3; i++, r++)
            *r = i < problem->rows[k].dim ? c->joints.r[n++] : 0.0;
}

/* y goes on in the direction that it took, as r will when it is swept next; or both stay where that
 * led back, or a round did more than the first, as in loops of friction. There the next begins. */
static void keep_momentum(job *at)
{
    perp__coloured *c = at->c;

    run_pieces(at, 0, count_pieces(c), weigh_way);
    for (int32_t k = 0; k < c->parts; k++) {
        perp__coloured_part *part = &c->part[k];
        const int32_t end = c->parts > 1 ? k + 1 : count_pieces(c);
        double next = 0.5 * (1.0 + sqrt(1.0 + 4.0 * part->theta * part->theta)), back = 0.0;

        for (int32_t i = k; i < end; i++)
            back += c->back[i];
        if (back > 0.0)
            next = part->theta = 1.0;
        part->momentum = part->plain ? 0.0 : fmin((part->theta - 1.0) / next, MOMENTUM);
        part->theta = next;
        part->way -= back;
    }
    run_pieces(at, 0, count_pieces(c), go_on);
}

/* Ends the parts that are at their last pass, or all; returns how many go on. What ended stays in
 * `moved`. Others end with a residual that is good, and of which nothing sinks: what a step leaves
 * is beside what drives, and where that is a load far above the weights, more than is taken back of
 * what is two guards deep. */
static int32_t end_parts(perp__coloured *c, int32_t passes, int32_t all)
{
    int32_t left = 0;

    for (int32_t k = 0; k < c->parts; k++) { /* the budget ends them, whatever they have come to */
        const perp__rigid_problem *problem = c->part[k].problem;
        const perp__passes *step = c->part[k].step;

        c->part[k].ends = all || !step->measures || passes >= step->rounds * step->passes ||
                          (problem->max_iterations > 0 && passes >= problem->max_iterations) ||
                          (problem->deadline > 0.0 && perp__now() >= problem->deadline);
    }
    if (c->part->step->measures)
        perp__coloured_measure(c);
    for (int32_t k = 0; k < c->parts; k++) {
        perp__coloured_part *part = &c->part[k];
        const size_t first = 8 * (size_t)part->first_body, end = 8 * (size_t)part->end_body;

        if (part->ended)
            continue;
        part->ended = part->ends || (part->answer->tested <= part->problem->tol &&
                                     part->sinks <= PERP__CLEARED_SHARE);
        left += !part->ended;
        part->plain |= part->way > part->first_way;
        if (passes == part->step->passes)
            part->first_way = part->way;
        part->way = 0.0;
        if (!part->ended)
            continue;
        part->answer->iterations = passes;
        read_impulses(c, part);
        memcpy(c->moved + first, c->y + first, (end - first) * sizeof *c->y);
    }
    for (int32_t g = 0; g < c->groups && left > 0; g++) {
        c->group[g].rests = 1;
        for (int32_t l = 0; l < c->group[g].pairs; l++)
            c->group[g].rests &= c->part[c->pair_part[c->group[g].pair[l]]].ended;
    }
    return left;
}

static void run_passes(job *at)
{
    perp__coloured *c = at->c;
    const size_t size = 8 * (size_t)c->rows * sizeof *c->y;
    double lack = INFINITY, before;
    int32_t passes = 0, ends = 0;

    /* 1. The impulses that are known, and what they make of the free velocities. */
    run_pieces(at, 0, c->colour_first[c->colour_count], fill_piece);
    run_pieces(at, 0, count_pieces(c), start_bodies);
    memset(c->y + 8 * c->bodies, 0, size - 8 * (size_t)c->bodies * sizeof *c->y);
    memset(c->free + 8 * c->bodies, 0, size - 8 * (size_t)c->bodies * sizeof *c->y);
    if (c->part->problem->warm) {
        run_pass(at, PERP__COLOURED_ADD, c->y);
        perp__joint_block_add(&c->joints, c->y);
        (void)perp__joint_block_solve(&c->joints, 1.0, 0.0, c->y);
    }
    for (int32_t k = 0; k < c->parts && c->part->problem->warm; k++)
        check_start(c, &c->part[k]);
    memcpy(c->moved, c->y, size);
    memcpy(c->before, c->y, size);
    /* 2. Rounds of passes; equations alone go as far as refinement does. */
    do {
        for (int32_t k = 0; k < c->part->step->passes && !ends; k++, passes++) {
            if (passes > 0 && c->points > 0)
                keep_momentum(at);
            before = lack;
            run_pass(at, PERP__COLOURED_SWEEP, c->y);
            lack = perp__joint_block_solve(&c->joints, 1.0, c->part->momentum, c->y);
            ends = c->points == 0 && !(lack > 0.0 && lack < 0.5 * before);
        }
    } while (end_parts(c, passes, ends) > 0);
    memcpy(c->y, c->moved, 8 * (size_t)c->bodies * sizeof *c->y);
}

/* Adds to `moved` what takes a share of the penetration away. */
static void clear_penetration(job *at)
{
    perp__coloured *c = at->c;
    const size_t size = 8 * (size_t)c->rows;
    int32_t deep = 0, most = 0;

    for (int32_t n = 0; n < c->parts; n++) {
        const perp__passes *step = c->part[n].step;

        most = step->clear > most ? step->clear : most;
        for (int32_t k = c->part[n].first_contact; k < c->part[n].end_contact; k++) {
            perp__lane_point *point = &c->point[c->place[k] / PERP__GROUP];
            const int32_t l = c->place[k] % PERP__GROUP;
            const double guard = point->guard[l], lack = -(point->gap[l] + guard);
            const int32_t sinks = step->clear > 0 && lack > 0.0;

            point->shift[l] = 0.0;
            point->bias[l] = sinks ? -perp__cleared(lack, guard) / step->h : 0.0;
            deep += sinks;
        }
    }
    if (deep == 0)
        return;
    memset(c->before, 0, size * sizeof *c->before);
    for (int32_t k = 0; k < most; k++) {
        run_pass(at, PERP__COLOURED_CLEAR, c->before);
        (void)perp__joint_block_solve(&c->joints, 0.0, 0.0, c->before);
    }
    for (size_t i = 0; i < size; i++)
        c->moved[i] += c->before[i];
}

/* v := free + C (y - y_free): where impulses change nothing, the bits of `free`. */
static void write_velocity(const perp__coloured *c, const perp__coloured_part *part, int32_t body,
                           const double *y, double *v)
{
    const int32_t width = c->width, number = width * (body - part->first_body);
    const double *C = part->problem->factors + width * number;
    double dy[6];

    for (int32_t j = 0; j < width; j++)
        dy[j] = y[8 * body + j] - c->free[8 * body + j];
    for (int32_t k = 0; k < width; k++) {
        double sum = 0.0;

        for (int32_t j = 0; j < width; j++)
            sum += C[width * k + j] * dy[j];
        v[number + k] = part->problem->free[number + k] + sum;
    }
}

static void write_velocities(int32_t i, void *data)
{
    const perp__coloured *c = ((const job *)data)->c;
    const perp__coloured_part *part = part_of(c, i);

    for (int32_t body = first_body(c, i); body < end_body(c, i); body++) {
        write_velocity(c, part, body, c->y, part->answer->v);
        if (part->moving)
            write_velocity(c, part, body, c->moved, part->moving);
    }
}

perp_status perp__coloured_parts(perp__coloured *c, perp__coloured_part *parts, int32_t count)
{
    job at = {c, 0, NULL};
    perp_status status;

    c->part = parts;
    c->parts = count;
    for (int32_t k = 0; k < count; k++) {
        parts[k].ended = parts[k].plain = 0;
        parts[k].worst = -1;
        parts[k].drive = parts[k].first_way = INFINITY;
        parts[k].theta = 1.0;
        parts[k].momentum = parts[k].way = 0.0;
    }
    status = perp__coloured_pack(c);
    PERP__THEN(status, perp__joint_block_set_up(&c->joints, c->context, parts->problem));
    if (status != PERP_OK)
        return status;
    if (is_shared(c))
        perp__tasks_open(c->tasks);
    run_passes(&at);
    if (parts->step->gap)
        clear_penetration(&at);
    run_pieces(&at, 0, count_pieces(c), write_velocities);
    if (is_shared(c))
        perp__tasks_close(c->tasks);
    return PERP_OK;
}

perp_status perp__coloured_step(perp__coloured *c, perp__rigid_answer *answer, double *moving,
                                const perp__rigid_problem *problem, const perp__passes *step)
{
    perp__coloured_part part = {
        .answer = answer, .moving = moving, .problem = problem, .step = step};

    return perp__coloured_parts(c, &part, 1);
}

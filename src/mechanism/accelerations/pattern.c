/* Within a pattern the forces are the solution of a linear system. Unknowns: the normal force of a
 * contact that presses, with it the friction -mu s of one that slips along s; tangential forces of
 * what sticks; bilateral forces. Equations: the accelerations of the same rows are 0. */
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"

static bool separates(const perp__element *element)
{
    return !element->dry && !element->two_sided;
}

/* Signs of the normal force that make a difference. */
static int32_t sides_of(const perp__element *element)
{
    return 1 + (element->two_sided && element->friction && element->normals == 1);
}

int32_t perp__element_choices(void *user, int32_t index)
{
    const perp__acceleration *a = user;
    const perp__element *element = a->element + index;
    const bool starts = !element->moves && element->friction;
    const int32_t directions = element->tangents == 2 ? a->m->settings.directions : 2;
    const int32_t motions = 1 + (starts ? directions : 0);

    return motions * sides_of(element) + separates(element);
}

/* Choices of a contact: to separate, to stick, to slip; in motion and without friction the second
 * is to slip. Groups of dry friction don't separate, nor does what holds both ways: that may press
 * on one side, then on the other. */
int32_t perp__element_choose(void *user, int32_t index, int32_t choice)
{
    perp__acceleration *a = user;
    const perp__element *element = a->element + index;
    const int32_t sides = sides_of(element), press = choice / sides - separates(element);
    int8_t *mode = a->pattern.mode + index;
    double *direction = a->pattern.direction + 2 * (size_t)index;
    double *load = a->pattern.load + PERP__MOST_NORMALS * (size_t)index;

    direction[0] = direction[1] = load[1] = load[2] = 0.0;
    load[0] = perp__load_bends(element) ? 0.0 : choice % sides == 0 ? 1.0 : -1.0;
    *mode = (int8_t)(press < 0 ? PERP_MECHANISM_SEPARATE : PERP_MECHANISM_SLIP);
    if (press < 0 || !element->friction)
        return 1;
    if (element->moves)
        memcpy(direction, element->direction, sizeof element->direction);
    else if (press == 0)
        *mode = PERP_MECHANISM_STICK;
    else if (element->tangents == 2) {
        const double angle = 2.0 * PERP__PI * (press - 1) / a->m->settings.directions;

        direction[0] = cos(angle);
        direction[1] = sin(angle);
    } else
        direction[0] = press == 1 ? 1.0 : -1.0;
    return 1;
}

bool perp__element_starts(const perp__element *element, int32_t mode)
{
    return mode == PERP_MECHANISM_SLIP && element->friction && !element->moves;
}

bool perp__element_presses(const perp__element *element, int32_t mode)
{
    return !element->dry && mode != PERP_MECHANISM_SEPARATE;
}

/* ---- the system ---------------------------------------------------------------------------- */

static void list_element(perp__acceleration *a, int32_t index)
{
    static const double alone = 1.0;
    const perp__element *element = a->element + index;
    const int32_t mode = a->pattern.mode[index], t = element->tangent;
    const double *direction = a->pattern.direction + 2 * (size_t)index;
    const double *load = a->pattern.load + PERP__MOST_NORMALS * (size_t)index;

    if (mode == PERP_MECHANISM_STICK)
        for (int32_t i = element->row; i < t + element->tangents; i++)
            perp__linear_column(&a->linear, i, 1, &alone);
    else if (element->dry)
        for (int32_t i = 0; i < element->tangents; i++)
            a->linear.known[t + i] = -element->bound * direction[i];
    else if (mode == PERP_MECHANISM_SLIP)
        for (int32_t row = element->row; row < t; row++) { /* with its part of the friction */
            double dragged[PERP__MOST_TERMS] = {1.0};

            for (int32_t i = 0; i < element->tangents; i++)
                dragged[t - row + i] = -element->mu * load[row - element->row] * direction[i];
            perp__linear_column(&a->linear, row, t - row + element->tangents, dragged);
        }
}

void perp__pattern_solve_roughly(perp__acceleration *a, double singular, int32_t most)
{
    static const double alone = 1.0;

    perp__linear_begin(&a->linear);
    for (int32_t index = 0; index < a->closed; index++)
        list_element(a, index);
    for (int32_t row = 0; row < a->m->bilateral; row++)
        perp__linear_column(&a->linear, a->bilateral_row + row, 1, &alone);
    for (int32_t index = a->closed; index < a->elements; index++)
        list_element(a, index);
    perp__pivoting_eliminate(&a->linear.system, singular * perp__linear_load(&a->linear), most);
    perp__linear_evaluate(&a->linear);
    perp__linear_correct(&a->linear);
    perp__linear_evaluate(&a->linear);
}

int32_t perp__pattern_solve(perp__acceleration *a)
{
    perp__pattern_solve_roughly(a, PERP__ACCELERATION_SINGULAR, a->active);
    perp__linear_correct(&a->linear);
    perp__linear_evaluate(&a->linear);
    perp__linear_find_widths(&a->linear);
    return perp__linear_find_null(&a->linear);
}

void perp__pattern_respond(perp__acceleration *a, double *force, double *change)
{
    double *rhs = a->linear.residual, *x = a->linear.load;

    perp__linear_rows(&a->linear, change, NULL, force, 1);
    for (int32_t r = 0; r < a->linear.system.n; r++)
        rhs[r] = -change[a->linear.first[r]] * a->scale[a->linear.first[r]];
    perp__pivoting_solve(&a->linear.system, x, rhs);
    perp__linear_add(&a->linear, force, x, 0);
    perp__linear_rows(&a->linear, change, NULL, force, 1);
}

/* ---- what the pattern says ------------------------------------------------------------------ */

static perp__condition row_is(int32_t kind, int32_t row)
{
    const perp__condition g = {kind, 0, 1, {row}, 0.0, {1.0}};

    return g;
}

/* along_0 u_t' + along_1 u_t+1', the second only where there is one. */
static perp__condition slip_is(int32_t kind, const perp__element *element, double along_0,
                               double along_1)
{
    const int32_t t = element->tangent;
    const perp__condition g = {kind,
                               kind == PERP__CONDITION_POSITIVE,
                               element->tangents,
                               {t, t + 1},
                               0.0,
                               {along_0, along_1}};

    return g;
}

/* g + factor |N|, or factor times the bound. */
static perp__condition add_load(perp__condition g, const perp__element *element, const double *load,
                                double factor)
{
    g.constant = element->dry ? factor * element->bound : 0.0;
    for (int32_t i = 0; i < element->normals; i++) {
        g.index[g.count] = ~(element->row + i);
        g.factor[g.count++] = factor * load[i];
    }
    return g;
}

/* bound or factor |N|, and a tangential force times `sign`. */
static perp__condition force_is(int32_t kind, const perp__element *element, const double *load,
                                int32_t i, double sign, double factor)
{
    const perp__condition g = {kind, 0, 1, {~(element->tangent + i)}, 0.0, {sign}};

    return add_load(g, element, load, factor);
}

int32_t perp__element_conditions(const void *user, const void *of, int32_t index,
                                 perp__condition *list)
{
    const perp__acceleration *a = user;
    const perp__mode_pattern *pattern = of;
    const perp__element *element = a->element + index;
    const double *load = pattern->load + PERP__MOST_NORMALS * (size_t)index;
    const double *direction = pattern->direction + 2 * (size_t)index;
    int32_t mode, t, count = 0;

    if (index >= a->elements) {
        list[0] = row_is(PERP__CONDITION_EQUATION, a->bilateral_row + index - a->elements);
        return 1;
    }
    mode = pattern->mode[index];
    t = element->tangent;
    if (mode == PERP_MECHANISM_SEPARATE) {
        for (int32_t i = 0; i <= element->tangents; i++)
            list[count++] = row_is(PERP__CONDITION_EQUATION, ~(element->row + i));
        list[count] = row_is(PERP__CONDITION_NOT_NEGATIVE, element->row);
        list[count++].strict = 1; /* where it does not lift off it presses as well */
        return count;
    }
    for (int32_t i = 0; i < element->normals; i++)
        list[count++] = row_is(PERP__CONDITION_EQUATION, element->row + i);
    if (element->normals > 0 && (element->friction || !element->two_sided)) {
        const perp__condition load_alone = {PERP__CONDITION_NOT_NEGATIVE, 0, 0, {0}, 0.0, {0.0}};

        list[count++] = add_load(load_alone, element, load, 1.0);
    }
    if (mode == PERP_MECHANISM_STICK) { /* within the disc, or the interval */
        const double limit = element->dry ? 1.0 : element->mu_stick;
        const perp__condition disc = {PERP__CONDITION_DISC, 0, 2, {~t, ~(t + 1)}, 0.0, {0.0}};

        for (int32_t i = 0; i < element->tangents; i++)
            list[count++] = row_is(PERP__CONDITION_EQUATION, t + i);
        if (element->tangents == 2)
            list[count++] = add_load(disc, element, load, limit);
        for (int32_t sign = -1; sign <= 1 && element->tangents == 1; sign += 2)
            list[count++] = force_is(PERP__CONDITION_NOT_NEGATIVE, element, load, 0, sign, limit);
    } else { /* friction along the direction, in which it starts */
        const double mu = element->dry ? 1.0 : element->mu;
        const bool starts = perp__element_starts(element, PERP_MECHANISM_SLIP);

        for (int32_t i = 0; i < element->tangents; i++)
            list[count++] =
                force_is(PERP__CONDITION_EQUATION, element, load, i, 1.0, mu * direction[i]);
        if (starts)
            list[count++] = slip_is(PERP__CONDITION_POSITIVE, element, direction[0], direction[1]);
        if (starts && element->tangents == 2)
            list[count++] = slip_is(PERP__CONDITION_PARALLEL, element, -direction[1], direction[0]);
    }
    return count;
}

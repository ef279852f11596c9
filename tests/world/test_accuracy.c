/* Levels of accuracy: what rests, rests at every one of them; what is hit gains no energy; and what
 * is said of a step that a budget ended. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

enum { ROWS = 7, MOST = ROWS * (ROWS + 1) / 2 };

/* A pyramid of cubes of 1 m and 1 kg, 2 cm apart; returns how many. */
static int pyramid(scene *s, int32_t planar, int32_t accuracy, perp_body *boxes)
{
    perp_world_settings world;
    int row, i, count = 0;

    assert_int_equal(perp_world_settings_init(&world, sizeof world, planar), PERP_OK);
    world.accuracy = accuracy;
    scene_create(s, &world);
    scene_plane(s, s->ground, 0.0, planar, !planar, 0.0, 0.5, 0.0);
    for (row = 0; row < ROWS; row++)
        for (i = 0; i < ROWS - row; i++) {
            perp_body_settings settings = scene_settings();

            settings.inertia[0] = settings.inertia[4] = settings.inertia[8] = 1.0 / 6.0;
            settings.position[0] = 1.02 * (i + 0.5 * row);
            settings.position[planar ? 1 : 2] = 0.5 + row;
            boxes[count] = scene_add(s, &settings);
            scene_box(s, boxes[count++], 0.5, 0.5, 0.5, 0.5, 0.0);
        }
    return count;
}

static void test_rests_at_every_level(void **state)
{
    perp_body boxes[MOST];
    int32_t planar, accuracy;
    int step, i;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (accuracy = PERP_ACCURACY_FAST; accuracy <= PERP_ACCURACY_EXACT; accuracy++) {
            perp_body_state first[MOST];
            perp_step_result result = fresh_step_result();
            scene s;
            const int count = pyramid(&s, planar, accuracy, boxes);

            for (i = 0; i < count; i++)
                first[i] = scene_state(&s, boxes[i]);
            for (step = 0; step < 40; step++) { /* impulses settle later than velocities */
                SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
                assert_true(result.outcome == PERP_OUTCOME_SOLVED ||
                            result.outcome == PERP_OUTCOME_ITERATION_LIMIT);
            }
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            for (i = 0; i < count; i++) {
                perp_body_state now = scene_state(&s, boxes[i]);

                if (!scene_rests(&s, boxes[i]) ||
                    memcmp(now.position, first[i].position, sizeof now.position) != 0)
                    fail_msg("planar %d accuracy %d: box %d moves", (int)planar, (int)accuracy, i);
            }
            scene_close(&s);
        }
}

static void open_on_ground(scene *s, int32_t accuracy, double friction)
{
    perp_world_settings world;

    assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
    world.accuracy = accuracy;
    world.friction = friction;
    scene_create(s, &world);
    scene_plane(s, s->ground, 0.0, 0.0, 1.0, 0.0, PERP_FRICTION_OF_WORLD, 0.0);
}

/* A stack of 24 cubes, many more coordinates than are solved for together: without friction, or
 * with friction between them but none below (then all moves as one, which is asked at rest alone).
 * It keeps the twist that it has, to the last bit, with all the rest 0.0. */
static void test_stacks_without_friction(void **state)
{
    enum { CUBES = 24 };
    static const struct {
        double friction, speed, turning;
    } cases[] = {{0.0, 0.0, 0.0}, {0.5, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 0.3}};

    (void)state;
    for (int k = 0; k < 4; k++)
        for (int32_t accuracy = PERP_ACCURACY_FAST; accuracy <= PERP_ACCURACY_EXACT; accuracy++) {
            perp_body cubes[CUBES];
            perp_step_result result = fresh_step_result();
            scene s;

            open_on_ground(&s, accuracy, 0.0);
            for (int i = 0; i < CUBES; i++) {
                perp_body_settings settings = scene_settings();

                settings.inertia[0] = settings.inertia[4] = settings.inertia[8] = 1.0 / 6.0;
                settings.position[2] = i + 0.5;
                settings.velocity[0] = cases[k].speed;
                settings.angular_velocity[2] = cases[k].turning;
                cubes[i] = scene_add(&s, &settings);
                scene_box(&s, cubes[i], 0.5, 0.5, 0.5, cases[k].friction, 0.0);
            }
            for (int step = 0; step < 40; step++)
                SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            for (int i = 0; i < CUBES; i++) {
                const perp_body_state now = scene_state(&s, cubes[i]);
                const double v[6] = {cases[k].speed, 0.0, 0.0, 0.0, 0.0, cases[k].turning};

                if (now.position[2] != i + 0.5)
                    fail_msg("case %d accuracy %d: cube %d sinks", k, (int)accuracy, i);
                for (int c = 0; c < 3; c++)
                    if (now.velocity[c] != v[c] || now.angular_velocity[c] != v[3 + c])
                        fail_msg("case %d accuracy %d: cube %d: %g, %g", k, (int)accuracy, i,
                                 now.velocity[c] - v[c], now.angular_velocity[c] - v[3 + c]);
            }
            scene_close(&s);
        }
}

/* A wall of bricks in bond that touch on all sides, half ones at its ends: nothing presses
 * sideways, and what sweeps leave there is no reason to move, with friction or without. */
static void test_a_wall_rests(void **state)
{
    enum { ROWS_HIGH = 8, WIDE = 8 };

    (void)state;
    for (int k = 0; k < 2; k++)
        for (int32_t accuracy = PERP_ACCURACY_FAST; accuracy <= PERP_ACCURACY_EXACT; accuracy++) {
            perp_body bricks[ROWS_HIGH * (WIDE + 1)];
            double x[ROWS_HIGH * (WIDE + 1)];
            perp_step_result result = fresh_step_result();
            scene s;
            int count = 0;

            open_on_ground(&s, accuracy, 0.5 * k);
            for (int row = 0; row < ROWS_HIGH; row++)
                for (int i = 0; i < WIDE + row % 2; i++) {
                    const int half = row % 2 && (i == 0 || i == WIDE);
                    perp_body_settings settings = scene_defaults();

                    settings.position[0] = x[count] = row % 2 == 0 ? i
                                                      : half       ? (i == 0 ? -0.25 : WIDE - 0.75)
                                                                   : i - 0.5;
                    settings.position[2] = 0.25 + 0.5 * row;
                    bricks[count] = scene_add(&s, &settings);
                    scene_box(&s, bricks[count++], half ? 0.25 : 0.5, 0.25, 0.25,
                              PERP_FRICTION_OF_WORLD, 0.0);
                }
            for (int step = 0; step < 20; step++) {
                SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
                assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            }
            for (int i = 0; i < count; i++)
                if (!scene_rests(&s, bricks[i]) || scene_state(&s, bricks[i]).position[0] != x[i])
                    fail_msg("friction %g accuracy %d: brick %d moves", 0.5 * k, (int)accuracy, i);
            scene_close(&s);
        }
}

/* A wall of bricks that a heavy one strikes: level exact finds what meets by sweeps, of 1e-6 at
 * best, but what it gives is solved to 1e-10. */
static void test_what_exact_gives_is_solved(void **state)
{
    perp_step_result result = fresh_step_result();
    perp_body_settings settings = scene_defaults();
    perp_body striker;
    scene s;

    (void)state;
    open_on_ground(&s, PERP_ACCURACY_EXACT, 0.5);
    for (int i = 0; i < 36; i++) {
        perp_body_settings brick = scene_defaults();

        brick.position[0] = i % 6 + 0.5 * (i / 6 % 2);
        brick.position[2] = 0.25 + 0.5 * (i / 6);
        scene_box(&s, scene_add(&s, &brick), 0.499, 0.25, 0.25, PERP_FRICTION_OF_WORLD, 0.0);
    }
    settings.mass = 10.0;
    settings.position[0] = 3.1;
    settings.position[1] = -0.56;
    settings.position[2] = 1.6;
    settings.velocity[1] = 5.0;
    striker = scene_add(&s, &settings);
    scene_box(&s, striker, 0.3, 0.3, 0.3, PERP_FRICTION_OF_WORLD, 0.0);
    for (int step = 0; step < 6; step++) {
        SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(result.residual <= 1e-10);
    }
    assert_true(scene_state(&s, striker).velocity[1] < 4.0);
    scene_close(&s);
}

/* Columns of one to ten bricks side by side, that touch: 55 faces below and 45 at the side, with
 * four points each. What sweeps have not come to is no motion in which the bricks of different
 * columns would meet at their edges: no contact comes, in no step. */
static void test_columns_stay_apart(void **state)
{
    enum { COLUMNS = 10, BRICKS = COLUMNS * (COLUMNS + 1) / 2 };

    (void)state;
    for (int32_t accuracy = PERP_ACCURACY_FAST; accuracy <= PERP_ACCURACY_EXACT; accuracy++) {
        perp_body bricks[BRICKS];
        perp_step_result result = fresh_step_result();
        scene s;
        int count = 0;

        open_on_ground(&s, accuracy, 0.5);
        for (int i = 0; i < COLUMNS; i++)
            for (int row = 0; row <= i; row++) {
                perp_body_settings settings = scene_defaults();

                settings.position[0] = i;
                settings.position[2] = 0.25 + 0.5 * row;
                bricks[count] = scene_add(&s, &settings);
                scene_box(&s, bricks[count++], 0.5, 0.5, 0.25, 0.5, 0.0);
            }
        for (int step = 0; step < 20; step++) {
            SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            assert_int_equal(result.contacts, 4 * (BRICKS + COLUMNS * (COLUMNS - 1) / 2));
        }
        for (int i = 0; i < count; i++)
            assert_true(scene_rests(&s, bricks[i]));
        scene_close(&s);
    }
}

/* A pyramid that falls with gaps of 0.3 mm between its layers closes these, and no more, in a step:
 * large islands come near what `exact` solves, the nearer the more may be spent. What sweeps leave
 * of the change that contacts make falls to a tenth within 16 sweeps of seven layers. */
static void test_swept_beside_exact(void **state)
{
    static const double most[] = {0.1, 0.05, 0.02};
    double exact[MOST][6];

    (void)state;
    for (int32_t accuracy = PERP_ACCURACY_EXACT; accuracy >= PERP_ACCURACY_FAST; accuracy--) {
        perp_body boxes[MOST];
        perp_step_result result = fresh_step_result();
        double wrong = 0.0, change = 0.0;
        scene s;
        const int count = pyramid(&s, 0, accuracy, boxes);

        for (int i = 0; i < count; i++) {
            perp_body_state now = scene_state(&s, boxes[i]);

            now.position[2] += 3e-4 * (now.position[2] + 0.5);
            now.velocity[2] = -0.5;
            SCENE_OK(&s, perp_world_set_body(s.world, &now, boxes[i]));
        }
        SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
        for (int i = 0; i < count; i++) {
            const perp_body_state now = scene_state(&s, boxes[i]);
            double v[6];

            memcpy(v, now.velocity, 3 * sizeof *v);
            memcpy(v + 3, now.angular_velocity, 3 * sizeof *v);
            if (accuracy == PERP_ACCURACY_EXACT)
                memcpy(exact[i], v, sizeof v);
            for (int k = 0; k < 6; k++) { /* forces make -0.5 - 0.0981 m/s of -0.5 */
                const double from = exact[i][k] + (k == 2 ? 0.5 + 0.0981 : 0.0);

                wrong += (v[k] - exact[i][k]) * (v[k] - exact[i][k]);
                change += from * from;
            }
        }
        if (accuracy < PERP_ACCURACY_EXACT && !(wrong <= most[accuracy] * most[accuracy] * change))
            fail_msg("accuracy %d: %.2g of the change is wrong", (int)accuracy,
                     sqrt(wrong / change));
        scene_close(&s);
    }
}

/* A card of 0.9 m by 0.6 m by 1 cm with its centre at x, z, turned by `lean` about y. */
static perp_body add_card(scene *s, double half_x, double half_z, double x, double z, double lean,
                          double friction)
{
    perp_body_settings settings = scene_defaults();
    perp_body card;

    settings.mass = 1.0;
    settings.position[0] = x;
    settings.position[2] = z;
    settings.orientation[0] = cos(lean / 2.0);
    settings.orientation[2] = sin(lean / 2.0);
    card = scene_add(s, &settings);
    scene_box(s, card, half_x, 0.3, half_z, friction, 0.0);
    return card;
}

/* A house of cards in three storeys. A card that leans by 15 degrees pushes along itself, within
 * the friction cone of its feet: tan 15 = 0.27 < 0.5, and stands; so all do, and no card moves. */
static void test_a_house_of_cards_stands(void **state)
{
    const double length = 0.9, thick = 0.01, lean = 15.0 * PI / 180.0;
    const double foot = length / 2.0 * sin(lean) + thick / 2.0 * cos(lean), width = 4.0 * foot;
    const double height = length * cos(lean) + thick * sin(lean);

    (void)state;
    for (int32_t accuracy = 0; accuracy < 4; accuracy++) {
        perp_world_settings settings;
        perp_body cards[15];
        perp_body_state first[15];
        perp_step_result result = {0};
        int count = 0;
        double z = 0.0;
        scene s;

        assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
        settings.accuracy = accuracy;
        settings.wakeful = 1;
        scene_create(&s, &settings);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
        for (int storey = 3; storey > 0; storey--) {
            for (int c = 0; c < 2 * storey; c++) {
                const double side = c % 2 ? 1.0 : -1.0;

                cards[count++] = add_card(&s, thick / 2.0, length / 2.0,
                                          (c / 2 - (storey - 1) / 2.0) * width + side * foot,
                                          z + height / 2.0, -side * lean, 0.5);
            }
            z += height;
            for (int c = 0; c + 1 < storey; c++)
                cards[count++] =
                    add_card(&s, width / 2.0 - 0.001, thick / 2.0, (c - (storey - 2) / 2.0) * width,
                             z + thick / 2.0, 0.0, 0.5);
            z += thick;
        }
        for (int i = 0; i < count; i++)
            first[i] = scene_state(&s, cards[i]);
        for (int k = 0; k < 200; k++)
            result = scene_step(&s, 0.01);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(result.iterations, 0); /* the impulses of the step before are tested */
        for (int i = 0; i < count; i++) {
            const perp_body_state now = scene_state(&s, cards[i]);

            for (int k = 0; k < 3; k++) { /* gaps of rounding may close */
                scene_near(now.position[k], first[i].position[k], 1e-14, "a card that stands");
                assert_true(now.velocity[k] == 0.0 && now.angular_velocity[k] == 0.0);
            }
        }
        scene_close(&s);
    }
}

/* Two cards, upper edge on upper edge. Their thrust is level by symmetry, and needs no friction
 * there along a level normal; along a face's, which leans by 6 or 17 degrees, it would need more
 * than tan 6 = .1. Their feet need mu >= x / z, of the mass centre's way from the foot and the
 * height of the upper edge: they stand at .999 of that share of it, and fall at 1.001. */
static void test_edges_that_meet_have_a_level_normal(void **state)
{
    const double length = 0.9, thick = 0.01;

    (void)state;
    for (int i = 0; i < 16; i++) {
        const double lean = (i / 8 ? 17.0 : 6.0) * PI / 180.0, share = i / 4 % 2 ? 1.001 : 0.999;
        const double centre_x = (length * sin(lean) - thick * cos(lean)) / 2.0;
        const double centre_z = (length * cos(lean) + thick * sin(lean)) / 2.0;
        const double needed = centre_x / (length * cos(lean)), at_edges = 0.05;
        perp_world_settings settings;
        perp_body cards[2];
        scene s;

        assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
        settings.accuracy = i % 4;
        scene_create(&s, &settings);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, pow(needed / share, 2.0) / at_edges, 0.0);
        for (int side = 0; side < 2; side++)
            cards[side] = add_card(&s, thick / 2.0, length / 2.0,
                                   (side ? 1.0 : -1.0) * (length * sin(lean) - centre_x), centre_z,
                                   side ? -lean : lean, at_edges);
        for (int k = 0; k < 10; k++)
            (void)scene_step(&s, 0.01);
        for (int side = 0; side < 2; side++)
            assert_int_equal(scene_rests(&s, cards[side]), share < 1.0);
        scene_close(&s);
    }
}

/* Two pairs of such cards in a row on ice between two walls: feet push on feet, and the ground on
 * which both stand does not lie between them. */
static void test_feet_that_meet_carry_a_thrust(void **state)
{
    const double length = 0.9, thick = 0.01, lean = 12.0 * PI / 180.0;
    const double centre_x = (length * sin(lean) - thick * cos(lean)) / 2.0;
    const double centre_z = (length * cos(lean) + thick * sin(lean)) / 2.0;
    const double half = length * sin(lean) + thick * cos(lean); /* of a pair's width */

    (void)state;
    for (int32_t accuracy = 0; accuracy < 4; accuracy++) {
        perp_world_settings settings;
        perp_body cards[4];
        scene s;

        assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
        settings.accuracy = accuracy;
        scene_create(&s, &settings);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
        for (int side = -1; side < 2; side += 2)
            scene_plane(&s, s.ground, -side, 0.0, 0.0, -2.0 * half, 0.0, 0.0);
        for (int i = 0; i < 4; i++)
            cards[i] = add_card(&s, thick / 2.0, length / 2.0,
                                (i < 2 ? -1.0 : 1.0) * half +
                                    (i % 2 ? 1.0 : -1.0) * (length * sin(lean) - centre_x),
                                centre_z, i % 2 ? -lean : lean, 0.0);
        for (int k = 0; k < 10; k++)
            (void)scene_step(&s, 0.01);
        for (int i = 0; i < 4; i++)
            assert_true(scene_rests(&s, cards[i]));
        scene_close(&s);
    }
}

static double energy_of(scene *s)
{
    double kinetic, potential;

    SCENE_OK(s, perp_world_energy(s->world, &kinetic, &potential));
    return kinetic + potential;
}

/* A ball of 5 kg at 20 m/s into the pyramid: a step within a budget says so, goes on, and gives no
 * more energy than it found, to 1 % of it. */
static void test_a_hit_gives_no_energy(void **state)
{
    perp_body boxes[MOST];
    int32_t accuracy;
    int step, limited = 0;

    (void)state;
    for (accuracy = PERP_ACCURACY_FAST; accuracy <= PERP_ACCURACY_ACCURATE; accuracy++) {
        perp_body_settings settings = scene_settings();
        double before, start;
        perp_body ball;
        scene s;

        pyramid(&s, 0, accuracy, boxes);
        settings.mass = 5.0;
        settings.position[0] = -1.5;
        settings.position[2] = 2.5;
        settings.velocity[0] = 20.0;
        ball = scene_add(&s, &settings);
        scene_sphere(&s, ball, 0.5, 0.5, 0.0);
        start = before = energy_of(&s);
        for (step = 0; step < 25; step++) {
            perp_step_result result = fresh_step_result();
            double now;

            SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
            assert_int_equal(result.advanced, 1);
            assert_true(result.residual >= 0.0 && result.residual < INFINITY);
            limited += result.outcome == PERP_OUTCOME_ITERATION_LIMIT;
            now = energy_of(&s);
            if (!(now <= before + 0.01 * start))
                fail_msg("accuracy %d step %d: %g to %g", (int)accuracy, step, before, now);
            before = now;
        }
        scene_close(&s);
    }
    assert_true(limited > 0);
}

/* The deepest overlap of balls of radius 1/2. */
static double deepest(scene *s, const perp_body *balls, int count)
{
    double deepest = 0.0;
    int i, j, k;

    for (i = 0; i < count; i++) {
        const perp_body_state a = scene_state(s, balls[i]);

        for (j = 0; j < i; j++) {
            const perp_body_state b = scene_state(s, balls[j]);
            double square = 0.0;

            for (k = 0; k < 3; k++)
                square += (a.position[k] - b.position[k]) * (a.position[k] - b.position[k]);
            deepest = fmax(deepest, 1.0 - sqrt(square));
        }
    }
    return deepest;
}

/* Balls that fall into a shaft, layer upon layer: what a ball meets depends on what stops the one
 * below it, in many rounds. No contact may be left out: what overlaps is what sweeps are wrong by,
 * a few times the 1 mm that they do not tell from contact. */
static void test_a_heap_does_not_sink_into_itself(void **state)
{
    enum { side = 4, layers = 12, count = side * side * layers };
    perp_body balls[count];
    double most = 0.0;
    int i, step;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    scene_plane(&s, s.ground, 1.0, 0.0, 0.0, -2.3, 0.5, 0.0);
    scene_plane(&s, s.ground, -1.0, 0.0, 0.0, -2.3, 0.5, 0.0);
    scene_plane(&s, s.ground, 0.0, 1.0, 0.0, -2.3, 0.5, 0.0);
    scene_plane(&s, s.ground, 0.0, -1.0, 0.0, -2.3, 0.5, 0.0);
    for (i = 0; i < count; i++) {
        perp_body_settings settings = scene_settings();

        settings.inertia[0] = settings.inertia[4] = settings.inertia[8] = 0.1;
        settings.position[0] = 1.12 * (i % side - 1.5) + 0.05 * sin(3.0 * i); /* any numbers */
        settings.position[1] = 1.12 * (i / side % side - 1.5) + 0.05 * sin(5.0 * i);
        settings.position[2] = 0.6 + 1.15 * (i / (side * side));
        balls[i] = scene_add(&s, &settings);
        scene_sphere(&s, balls[i], 0.5, 0.5, 0.0);
    }
    for (step = 0; step < 150; step++) {
        perp_step_result result = fresh_step_result();

        SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
        if (step % 5 == 0)
            most = fmax(most, deepest(&s, balls, count));
    }
    if (!(most < 0.005))
        fail_msg("overlap %g", most);
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rests_at_every_level),
        cmocka_unit_test(test_stacks_without_friction),
        cmocka_unit_test(test_a_wall_rests),
        cmocka_unit_test(test_what_exact_gives_is_solved),
        cmocka_unit_test(test_columns_stay_apart),
        cmocka_unit_test(test_swept_beside_exact),
        cmocka_unit_test(test_a_house_of_cards_stands),
        cmocka_unit_test(test_edges_that_meet_have_a_level_normal),
        cmocka_unit_test(test_feet_that_meet_carry_a_thrust),
        cmocka_unit_test(test_a_hit_gives_no_energy),
        cmocka_unit_test(test_a_heap_does_not_sink_into_itself),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

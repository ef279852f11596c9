/* A chain of 100 links with a weight a thousand times that of a link. It hangs with velocity 0, to
 * the last bit, and tells what it pulls with; let go at the 50th link, the lower half falls freely.
 */
#include <perp/perp.h>

#include <math.h>
#include <stdio.h>

enum { LINKS = 100 };

/* Links of 0.1 m and 0.1 kg below each other, the weight at the end. */
static perp_status build(perp_world *world, perp_body *links, perp_joint *joints)
{
    perp_body above = perp_world_ground(world);
    perp_status status = PERP_OK;

    for (int k = 0; k < LINKS && status == PERP_OK; k++) {
        perp_body_settings body;
        perp_joint_settings joint;

        perp_body_settings_init(&body, sizeof body);
        body.mass = k == LINKS - 1 ? 100 : 0.1;
        for (int i = 0; i < 9; i += 4)
            body.inertia[i] = 1e-4 * body.mass;
        body.position[2] = -0.05 - 0.1 * k;
        status = perp_world_add_body(world, &links[k], &body);
        perp_joint_settings_init(&joint, sizeof joint);
        joint.kind = PERP_JOINT_BALL;
        joint.anchor[2] = -0.1 * k;
        if (status == PERP_OK)
            status = perp_world_add_joint(world, &joints[k], above, links[k], &joint);
        above = links[k];
    }
    return status;
}

static perp_status run(perp_world *world, double seconds, double h)
{
    perp_status status = PERP_OK;

    for (int step = 0; step < lround(seconds / h) && status == PERP_OK; step++)
        status = perp_world_step(world, NULL, h);
    return status;
}

static perp_status hang(perp_world *world, perp_body weight, perp_joint top)
{
    perp_body_state state;
    perp_joint_state joint;
    perp_status status = run(world, 1, 0.01);

    perp_body_state_init(&state, sizeof state);
    perp_struct_init(&joint, sizeof joint);
    if (status == PERP_OK)
        status = perp_world_get_body(world, &state, weight);
    if (status == PERP_OK)
        status = perp_world_get_joint(world, &joint, top);
    if (status == PERP_OK)
        printf("after 1 s the weight has velocity %g, the chain pulls with %.4f N (%.4f)\n",
               fabs(state.velocity[2]), joint.impulse[2] / 0.01, (99 * 0.1 + 100) * 9.81);
    return status;
}

static perp_status let_go(perp_world *world, perp_body weight, perp_joint middle)
{
    perp_body_state state;
    perp_status status = perp_world_remove_joint(world, middle);

    perp_body_state_init(&state, sizeof state);
    if (status == PERP_OK)
        status = run(world, 0.5, 0.01);
    if (status == PERP_OK)
        status = perp_world_get_body(world, &state, weight);
    if (status == PERP_OK)
        printf("let go, after 0.5 s it has velocity %.4f m/s (%.4f)\n", state.velocity[2],
               -0.5 * 9.81);
    return status;
}

int main(void)
{
    perp_body links[LINKS];
    perp_joint joints[LINKS];
    perp_context *context = NULL;
    perp_world *world = NULL;
    perp_status status = perp_context_create(&context, NULL);

    if (status != PERP_OK) {
        fprintf(stderr, "%s\n", perp_status_text(status));
        return 1;
    }
    status = perp_world_create(context, &world, NULL);
    if (status == PERP_OK)
        status = build(world, links, joints);
    if (status == PERP_OK)
        status = hang(world, links[LINKS - 1], joints[0]);
    if (status == PERP_OK)
        status = let_go(world, links[LINKS - 1], joints[LINKS / 2]);
    if (status != PERP_OK)
        fprintf(stderr, "%s\n", perp_context_message(context));
    perp_world_destroy(world);
    perp_context_destroy(context);
    return status != PERP_OK;
}

/* MuJoCo with the elliptic cone and Newton, its defaults otherwise; more substeps: steps of h over
 * so many (it has no other knob that makes contacts harder). */
#include "scene.h"

#include <mujoco/mujoco.h>

#include <string>

struct engine {
    mjModel *model;
    mjData *data;
    const scene *s;
    int times;
};

static void step(void *object, double h)
{
    engine *e = static_cast<engine *>(object);
    e->model->opt.timestep = h / e->times;
    for (int k = 0; k < e->times; k++)
        mj_step(e->model, e->data);
}

static int first_of(const engine *e, int k)
{
    return e->model->body_jntadr[k + 1];
}

static void read_state(void *object, int k, double *x)
{
    const engine *e = static_cast<engine *>(object);
    const int joint = first_of(e, k);
    memset(x, 0, 13 * sizeof *x);
    memcpy(x, e->s->bodies[k].position, 3 * sizeof *x);
    memcpy(x + 3, e->s->bodies[k].orientation, 4 * sizeof *x);
    if (joint < 0)
        return;
    memcpy(x, e->data->qpos + e->model->jnt_qposadr[joint], 7 * sizeof *x);
    const double *v = e->data->qvel + e->model->jnt_dofadr[joint];
    memcpy(x + 7, v, 3 * sizeof *x);
    mju_rotVecQuat(x + 10, v + 3, x + 3); /* its spin is the body's */
}

static std::string numbers(const double *x, int count)
{
    std::string text;
    char word[40];
    for (int k = 0; k < count; k++) {
        snprintf(word, sizeof word, "%.17g ", x[k]);
        text += word;
    }
    return text;
}

static std::string describe(const scene &s)
{
    std::string text = "<mujoco><size memory='400M'/><option cone='elliptic' gravity='" +
                       numbers(s.gravity, 3) + "' timestep='" + numbers(&s.h, 1) +
                       "'/><default><geom friction='" + numbers(&s.friction, 1) +
                       "0 0' condim='3'/></default><worldbody><geom type='plane' size='0 0 1'/>";
    for (int i = 0; i < s.count; i++) {
        const scene_body &b = s.bodies[i];
        text += "<body pos='" + numbers(b.position, 3) + "' quat='" + numbers(b.orientation, 4) +
                "'>" + (b.mass > 0 ? "<freejoint/>" : "") + "<geom type='" +
                (b.sphere ? "sphere" : "box") + "' size='" + numbers(b.half, b.sphere ? 1 : 3) +
                "'" + (b.mass > 0 ? " mass='" + numbers(&b.mass, 1) + "'" : "") + "/></body>";
    }
    return text + "</worldbody></mujoco>";
}

int main(int argc, char **argv)
{
    char error[500] = "";
    scene s;
    FILE *record = scene_open(&s, argc, argv);
    if (s.planar) {
        puts("skipped: no plane");
        return 0;
    }
    mjSpec *spec = mj_parseXMLString(describe(s).c_str(), nullptr, error, sizeof error);
    mjModel *model = spec ? mj_compile(spec, nullptr) : nullptr;
    if (!model) {
        fprintf(stderr, "mujoco: %s\n", error);
        return 1;
    }
    engine e = {model, mj_makeData(model), &s, atoi(argv[1])};
    for (int i = 0; i < s.count; i++)
        if (first_of(&e, i) >= 0)
            memcpy(e.data->qvel + model->jnt_dofadr[first_of(&e, i)], s.bodies[i].velocity,
                   3 * sizeof(double));
    scene_play(&s, &e, step, read_state, record, atof(argv[2]), argc > 4 ? atoi(argv[4]) : 1);
    fclose(record);
    return 0;
}

/* Machines with known motions, as callbacks of perp/mechanism.h: a brick on a ramp, falling rods,
 * balls, a rocking block, a wedge, a table, a peg, ... each with its start, its end and the numbers
 * that it is known by. Free of the test framework, so that benchmarks use them too. */
#ifndef PERP_TESTS_MACHINES_H
#define PERP_TESTS_MACHINES_H

#include "calls.h"

#define MACHINE_GRAVITY 9.81
#define MACHINE_PI 3.14159265358979323846

enum { MACHINE_ROOM = 8, MACHINE_LEGS = 1000 };

enum machine_name {
    MACHINE_RAMP_R1,  /* a brick on a slope: a stop, and rest */
    MACHINE_RAMP_R2,  /* pushed down: a late stop */
    MACHINE_RAMP_R3,  /* pushed harder: never stops */
    MACHINE_RAMP_R4,  /* upwards: a stop, and rest */
    MACHINE_RAMP_R5,  /* upwards with little friction: a stop, and back down */
    MACHINE_RAMP_R6,  /* a growing force: breaks away */
    MACHINE_RAMP_R7,  /* shaken: creeps down a little in each cycle */
    MACHINE_PLANE,    /* slides in two dimensions on a disc of dry friction */
    MACHINE_FLOOR,    /* the same on a contact in three dimensions */
    MACHINE_ROD,      /* Painleve's: slips on its tip, no acceleration exists */
    MACHINE_ROD_FALL, /* with rounded ends, falls onto the floor, tumbles and comes to rest */
    MACHINE_BALL,     /* bounces: infinitely often in a finite time */
    MACHINE_CHAIN_3,  /* three equal balls that touch, one comes in */
    MACHINE_CHAIN_5,
    MACHINE_CHAIN_UNLIKE, /* two, 1 to 3 */
    MACHINE_BLOCK,        /* rocks on its two corners */
    MACHINE_BLOCK_SLOPE,  /* rests on a slope, tips or slides */
    MACHINE_BLOCK_PUSH,   /* pushed at a height */
    MACHINE_WEDGE,        /* between two faces of a groove, only shifted */
    MACHINE_TABLE,        /* four legs */
    MACHINE_TABLE_MANY,   /* a thousand */
    MACHINE_ROLL_BALL,    /* slides, then rolls */
    MACHINE_ROLL_DISC,
    MACHINE_ROLL_HOOP,
    MACHINE_ROLL_BACK,  /* with so much backspin that it returns */
    MACHINE_ROLL_SLOPE, /* rolls down from rest */
    MACHINE_BELT,       /* a mass on a spring and a belt: sticks and slips */
    MACHINE_FINGER,     /* a hinged finger pushed over a surface, tip ahead: slides to a stop */
    MACHINE_FINGER_JAM, /* steeper: jams at once */
    MACHINE_PEG,        /* in a hole, no clearance: slides in or jams */
    MACHINE_PENDULUM,   /* held by a bilateral constraint */
    MACHINE_SPIN,       /* a free body with a quaternion */
    MACHINES
};

/* What the callbacks read. */
typedef struct machine_ramp {
    double mass, slope, mu;
    double force, rate, amplitude, frequency; /* force + rate t + amplitude sin(frequency t) */
} machine_ramp;

/* A planar body q = (x, y, angle) above the floor y = 0. Its points are where it can touch: at
 * `along` and `across` in its own axes, each with a cap of this radius. */
typedef struct machine_body {
    double mass, inertia, radius;
    double along[2], across[2];
    double gravity[2];
    double push, height; /* a horizontal force at a height above the floor */
} machine_body;

typedef struct machine_belt {
    double mass, stiffness, speed, gravity;
} machine_belt;

/* q = (carriage along the rail, angle between finger and surface). The finger's mass centre is its
 * hinge, at `height` above the surface; its torque presses the tip down, ahead of the hinge. */
typedef struct machine_finger {
    double carriage, inertia, length, height, torque, force;
} machine_finger;

/* q = (x, y) of the middle of the tip, angle. The hole is |x| <= hole, y <= 0. The load acts at
 * the tip's middle, the mass centre too; y points out. */
typedef struct machine_peg {
    double mass, inertia, radius, hole;
    int32_t points[4]; /* that contacts are at: left corner, right corner, left rim, right rim */
    double load[3];    /* force along x, along y, moment */
} machine_peg;

typedef struct machine_free {
    double inertia[3];
} machine_free;

typedef struct machine_mass {
    double mass[MACHINE_ROOM];
    double length;             /* of the pendulum */
    double load[MACHINE_ROOM]; /* constant forces */
    double slope;              /* of the wedge's faces */
    double places[2][4];       /* of the legs; with more of them: around the unit circle */
} machine_mass;

/* A number that a machine is known by. What a run shows of it, see machine_measure. */
enum machine_kind {
    MACHINE_COORDINATE, /* q[index] at the end */
    MACHINE_VELOCITY,   /* v[index] at the end */
    MACHINE_STOP,       /* when v[index] has become 0.0, for good */
    MACHINE_HIT,        /* when contact `index` has its first impulse */
    MACHINE_OTHER       /* a test asks for it in its own way */
};

typedef struct machine_reference {
    const char *what, *source;
    int32_t kind, index;
    double value;
} machine_reference;

typedef struct machine machine;
struct machine {
    const char *name;
    perp_mechanism_model model; /* points into this struct: it must not be copied */
    double q[MACHINE_ROOM], v[MACHINE_ROOM], end;
    double mu[MACHINE_ROOM], mu_static[MACHINE_ROOM], restitution[MACHINE_ROOM];
    union {
        machine_ramp ramp;
        machine_body body;
        machine_belt belt;
        machine_finger finger;
        machine_peg peg;
        machine_free free;
        machine_mass mass;
    } data;
    double (*energy)(const machine *m, const double *q, const double *v); /* or NULL */
    machine_reference reference[MACHINE_ROOM];
    int32_t references;
};

/* Fills *m; what it holds may be changed afterwards, before a mechanism is made of it. */
void machine_make(machine *m, int32_t name);
/* Leaves two points of the peg that touch, without clearance. */
void machine_touch_peg(machine *m, int32_t one, int32_t other);
/* The reference of that text; aborts where there is none. */
double machine_value(const machine *m, const char *what);

/* What a run was. */
typedef struct machine_record {
    perp_mechanism_run_result result;
    double q[MACHINE_ROOM], v[MACHINE_ROOM];
    double stop[MACHINE_ROOM]; /* when v has become 0.0, for good; +inf: it has not */
    double hit[MACHINE_ROOM];  /* when a contact had its first impulse; +inf: never */
    double energy[2];          /* at the start and at the end */
    double energy_change;      /* the largest, of both signs, from the start */
} machine_record;

/* From the machine's start to `end` (<= 0: its own). Returns the status of the first call that
 * fails. */
perp_status machine_run(machine_record *record, perp_context *context, const machine *m,
                        const perp_mechanism_settings *settings, double h, double end);
double machine_measure(const machine_record *record, const machine_reference *reference);

/* For the files that fill a machine. */
void machine_refer(machine *m, int32_t kind, int32_t index, double value, const char *what,
                   const char *source);
/* The row of a planar body's point at `offset` from its reference, moving along `direction`. */
void machine_row(double *row, const double *direction, const double *offset);

void machine_make_ramp(machine *m, double parameter);
void machine_make_plane(machine *m, double parameter);
void machine_make_rod(machine *m, double parameter);
void machine_make_rod_fall(machine *m, double parameter);
void machine_make_ball(machine *m, double parameter);
void machine_make_chain(machine *m, double parameter);
void machine_make_chain_unlike(machine *m, double parameter);
void machine_make_block(machine *m, double parameter);
void machine_make_block_slope(machine *m, double parameter);
void machine_make_block_push(machine *m, double parameter);
void machine_make_wedge(machine *m, double parameter);
void machine_make_table(machine *m, double parameter);
void machine_make_roll(machine *m, double parameter);
void machine_make_roll_back(machine *m, double parameter);
void machine_make_roll_slope(machine *m, double parameter);
void machine_make_belt(machine *m, double parameter);
void machine_make_finger(machine *m, double parameter);
void machine_make_peg(machine *m, double parameter);
void machine_make_pendulum(machine *m, double parameter);
void machine_make_spin(machine *m, double parameter);

#endif

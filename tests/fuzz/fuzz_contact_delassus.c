/* perp_contact_solve: any W of the palette, or W = P'P as mechanics makes it. */
#include <math.h>
#include <string.h>

#include "laws.h"

/* W = P P' of `inner` columns: semidefinite, often singular; sometimes slightly unsymmetric. */
static void make_matrix(fuzz_bytes *bytes, fuzz_mood mood, int32_t rows, fuzz_matrix *W)
{
    double *dense = fuzz_doubles(rows * rows), *P;
    int32_t kind = fuzz_pick(bytes, 4), inner = 1 + fuzz_pick(bytes, 8), i, j, k;

    if (kind == 3)
        fuzz_numbers(bytes, mood, dense, rows * rows);
    P = fuzz_doubles(rows * inner);
    if (kind < 3)
        fuzz_numbers(bytes, mood, P, rows * inner);
    for (i = 0; kind < 3 && i < rows; i++)
        for (j = 0; j < rows; j++)
            for (dense[i * rows + j] = i == j && kind == 2, k = 0; k < inner; k++)
                dense[i * rows + j] += P[i * inner + k] * P[j * inner + k];
    if (fuzz_one_in(bytes, 8) && rows > 1)
        dense[1] *= 1 + 1e-6;
    fuzz_wrap(bytes, W, rows, rows, dense);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    fuzz_mood mood = fuzz_mood_of(&bytes);
    perp_contact_settings settings;
    perp_contact_result *result = fuzz_take(1, sizeof *result), kept;
    laws_problem p;
    fuzz_matrix W;
    double *r, *u, *ray, *q, *r0;
    int32_t *modes;

    laws_make(&bytes, mood, &p);
    laws_settings_make(&bytes, &settings, &p);
    make_matrix(&bytes, mood, p.rows, &W);
    q = fuzz_doubles(p.rows);
    r0 = fuzz_doubles(p.rows);
    fuzz_numbers(&bytes, mood, q, p.rows);
    r = fuzz_doubles(p.rows);
    u = fuzz_doubles(p.rows);
    ray = fuzz_doubles(p.rows);
    fuzz_show("W", W.dense, p.rows * p.rows);
    fuzz_show("q", q, p.rows);
    fuzz_show("r", r, p.rows);
    fuzz_show("mu", p.mu, p.laws.contacts);
    fuzz_show("tol", &settings.tol, 1);
    modes = fuzz_take(p.laws.contacts + p.laws.bounded, sizeof *modes);
    if (perp_struct_init(result, sizeof *result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    kept = *result;
    if (fuzz_one_in(&bytes, 3))
        fuzz_numbers(&bytes, mood, r0, p.rows);
    else
        r0 = NULL;
    if (fuzz_status_of(context,
                       perp_contact_solve(context, ANSWER(NULL, r, u, modes, ray), result,
                                          &settings, DELASSUS(&p.laws, &W.view, q), r0),
                       "perp_contact_solve", (const void *[]){r, u, modes, ray, NULL})) {
        if (result->has_ray != !fuzz_untouched(ray))
            fuzz_fail("a ray is written if and only if has_ray is 1");
        laws_check("delassus", &p, oracle_wide(p.rows * p.rows, W.dense), oracle_wide(p.rows, q),
                   NULL, &settings, result, r, u, modes);
    } else if (memcmp(&kept, result, sizeof kept) != 0)
        fuzz_fail("a refusal leaves the result untouched");
    fuzz_close(context);
    return 0;
}

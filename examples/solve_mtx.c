/* solve_mtx: solves a linear complementarity problem that is read from Matrix Market files.
 *
 *     solve_mtx M.mtx q.mtx [lower.mtx [upper.mtx]] [options]
 *
 *     --methods LIST       of auto, lemke, pgs, fischer, separated by commas; default auto
 *     --tol NUMBER         tested residual that counts as solved; default 1e-10
 *     --max-iterations N   pivots, sweeps or Newton steps; default: the method's own limit
 *     --time-limit S       seconds for each method; default: none
 *     --relaxation NUMBER  over- or under-relaxation of pgs, between 0 and 2; default 1
 *     --output z.mtx       writes the z of the first method that solved the problem
 *
 * Without bounds z >= 0. A lower bound may hold -inf, an upper bound inf. The exit status is 0 if
 * every method solved the problem, 2 if one did not, 1 if the problem could not be read.
 *
 * What to look at if you want to do the same: solve_all() shows the life of a solver (context,
 * settings, solver, setup, solve), read_problem() how a matrix gets into it.
 */
#define _POSIX_C_SOURCE 200809L /* fmemopen, for market_file.h */

#include <perp/perp.h>

#include "matrix_market.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_METHODS = 8 };

typedef struct options {
    const char *files[4]; /* M, q, lower, upper */
    int file_count;
    int32_t methods[MAX_METHODS];
    int method_count;
    const char *output;
    perp_lcp_settings settings;
} options;

typedef struct problem {
    market_matrix M;
    double *q;
    double *lower; /* NULL: 0 */
    double *upper; /* NULL: +inf */
    double *z;
    double *solution; /* of the first method that solved it */
} problem;

static int usage(const char *message, const char *word)
{
    fprintf(stderr, "solve_mtx: %s%s%s\n", message, word ? " " : "", word ? word : "");
    fprintf(stderr, "usage: solve_mtx M.mtx q.mtx [lower.mtx [upper.mtx]] [--methods LIST] "
                    "[--tol NUMBER]\n                 [--max-iterations N] [--time-limit S] "
                    "[--relaxation NUMBER] [--output z.mtx]\n");
    return 1;
}

/* Splits "lemke,pgs" into the library's numbers; returns the word it doesn't know, or NULL. */
static const char *read_methods(options *chosen, char *list)
{
    chosen->method_count = 0;
    for (char *word = strtok(list, ","); word; word = strtok(NULL, ",")) {
        int32_t method = PERP_LCP_AUTO;
        while (method <= PERP_LCP_FISCHER && strcmp(word, perp_lcp_method_text(method)) != 0)
            method++;
        if (method > PERP_LCP_FISCHER || chosen->method_count == MAX_METHODS)
            return word;
        chosen->methods[chosen->method_count++] = method;
    }
    return NULL;
}

/* A number that fills its whole word. */
static int read_number(const char *word, double *number)
{
    char *end;
    *number = strtod(word, &end);
    return end != word && *end == '\0';
}

/* Reads one "--name value" pair; returns 0 if it is understood. */
static int read_option(options *chosen, const char *name, char *value)
{
    double number = 0;
    if (strcmp(name, "--output") == 0) {
        chosen->output = value;
        return 0;
    }
    if (strcmp(name, "--methods") == 0) {
        const char *unknown = read_methods(chosen, value);
        return unknown ? usage("unknown method", unknown) : 0;
    }
    if (!read_number(value, &number))
        return usage("expected a number after", name);
    if (strcmp(name, "--tol") == 0)
        chosen->settings.tol = number;
    else if (strcmp(name, "--max-iterations") == 0)
        chosen->settings.max_iterations = (int32_t)fmin(fmax(number, 0), INT32_MAX);
    else if (strcmp(name, "--time-limit") == 0)
        chosen->settings.time_limit = number;
    else if (strcmp(name, "--relaxation") == 0)
        chosen->settings.relaxation = number;
    else
        return usage("unknown option", name);
    return 0;
}

static int read_options(options *chosen, int count, char **words)
{
    memset(chosen, 0, sizeof *chosen);
    perp_lcp_settings_init(&chosen->settings, sizeof chosen->settings);
    chosen->methods[0] = PERP_LCP_AUTO;
    chosen->method_count = 1;
    for (int k = 1; k < count; k++) {
        if (strncmp(words[k], "--", 2) == 0) {
            if (k + 1 == count)
                return usage("nothing follows", words[k]);
            if (read_option(chosen, words[k], words[k + 1]) != 0)
                return 1;
            k++;
        } else if (chosen->file_count < 4) {
            chosen->files[chosen->file_count++] = words[k];
        } else {
            return usage("too many files:", words[k]);
        }
    }
    return chosen->file_count < 2 ? usage("needs M.mtx and q.mtx", NULL) : 0;
}

static void free_problem(problem *lcp)
{
    market_free(&lcp->M);
    free(lcp->q);
    free(lcp->lower);
    free(lcp->upper);
    free(lcp->z);
    free(lcp->solution);
}

/* Reads the files. The reader has said what is wrong if this returns false. */
static bool read_problem(problem *lcp, const options *chosen)
{
    memset(lcp, 0, sizeof *lcp);
    if (!market_read_matrix(&lcp->M, chosen->files[0]))
        return false;
    int32_t n = lcp->M.rows;
    if (lcp->M.columns != n) {
        fprintf(stderr, "%s: the matrix must be square, not %d by %d\n", chosen->files[0], (int)n,
                (int)lcp->M.columns);
        return false;
    }
    lcp->q = market_read_vector(chosen->files[1], n, MARKET_FINITE);
    if (!lcp->q)
        return false;
    if (chosen->files[2]) {
        lcp->lower = market_read_vector(chosen->files[2], n, MARKET_MINUS_INFINITY);
        if (!lcp->lower)
            return false;
    }
    if (chosen->files[3]) {
        lcp->upper = market_read_vector(chosen->files[3], n, MARKET_PLUS_INFINITY);
        if (!lcp->upper)
            return false;
    }
    lcp->z = calloc((size_t)n, sizeof *lcp->z);
    lcp->solution = calloc((size_t)n, sizeof *lcp->solution);
    if (!lcp->z || !lcp->solution) {
        fprintf(stderr, "solve_mtx: not enough memory\n");
        return false;
    }
    return true;
}

static void print_result(int32_t asked, const perp_lcp_result *result)
{
    char name[48];
    if (asked == result->method)
        snprintf(name, sizeof name, "%s", perp_lcp_method_text(asked));
    else
        snprintf(name, sizeof name, "%s (%s)", perp_lcp_method_text(asked),
                 perp_lcp_method_text(result->method));
    printf("%-16s %-16s %9.2e %9.2e %9.2e %10lld %10.3f ms\n", name,
           perp_outcome_text(result->outcome), result->residual, result->natural_residual,
           result->backward_error, (long long)result->iterations, 1e3 * result->seconds);
    if (result->certificate == PERP_CERTIFICATE_INFEASIBLE)
        printf("%-16s the ray proves that no z >= lower has M z + q >= 0\n", "");
}

/* Runs every method on the problem. Returns the number of methods that did not solve it, or -1 if
 * the library refused the problem. */
static int solve_all(perp_context *context, problem *lcp, const options *chosen)
{
    perp_lcp_solver *solver = NULL;
    perp_lcp_settings settings = chosen->settings;
    perp_lcp_result result;
    perp_matrix M;
    bool found = false;
    int unsolved = 0;

    /* the matrix stays where it is: perp looks at it through a view */
    perp_struct_init(&M, sizeof M);
    perp_matrix_csc(&M, lcp->M.rows, lcp->M.columns, lcp->M.column_starts, lcp->M.row_indices,
                    lcp->M.values);
    perp_struct_init(&result, sizeof result);

    if (perp_lcp_solver_create(context, &solver, &settings) != PERP_OK ||
        perp_lcp_solver_setup(solver, &M, lcp->lower, lcp->upper) != PERP_OK)
        unsolved = -1;

    for (int k = 0; k < chosen->method_count && unsolved >= 0; k++) {
        settings.method = chosen->methods[k];
        /* a negative status says that the call was wrong, here: that the method doesn't fit */
        if (perp_lcp_solver_set(solver, &settings) != PERP_OK ||
            perp_lcp_solver_solve(solver, lcp->z, NULL, NULL, &result, lcp->q, NULL) != PERP_OK) {
            printf("%-16s %s\n", perp_lcp_method_text(settings.method),
                   perp_context_message(context));
            unsolved++;
            continue;
        }
        /* an outcome says what became of the problem */
        print_result(settings.method, &result);
        bool solved =
            result.outcome == PERP_OUTCOME_SOLVED || result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
        if (solved && !found)
            memcpy(lcp->solution, lcp->z, (size_t)lcp->M.rows * sizeof *lcp->z);
        found = found || solved;
        unsolved += !solved;
    }
    if (unsolved < 0)
        fprintf(stderr, "solve_mtx: %s\n", perp_context_message(context));
    else if (chosen->output && !found)
        fprintf(stderr, "solve_mtx: nothing solved, %s is not written\n", chosen->output);
    else if (chosen->output && !market_write_vector(chosen->output, lcp->M.rows, lcp->solution))
        unsolved = -1;
    perp_lcp_solver_destroy(solver);
    return unsolved;
}

int main(int argc, char **argv)
{
    options chosen;
    problem lcp;
    perp_context *context = NULL;
    int unsolved = -1;

    if (read_options(&chosen, argc, argv) != 0)
        return 1;
    if (read_problem(&lcp, &chosen)) {
        printf("%s: n = %d, %d entries; perp %s\n\n", chosen.files[0], (int)lcp.M.rows,
               (int)lcp.M.column_starts[lcp.M.columns], perp_version_text());
        printf("%-16s %-16s %9s %9s %9s %10s %13s\n", "method", "outcome", "tested", "natural",
               "backward", "iterations", "time");
        printf("%-16s %-16s %9s %9s %9s\n", "", "", "residual", "residual", "error");
        if (perp_context_create(&context, NULL) == PERP_OK)
            unsolved = solve_all(context, &lcp, &chosen);
        else
            fprintf(stderr, "solve_mtx: not enough memory\n");
        perp_context_destroy(context);
    }
    free_problem(&lcp);
    return unsolved < 0 ? 1 : unsolved > 0 ? 2 : 0;
}

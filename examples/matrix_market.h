/* matrix_market.h: the matrix and the vectors of an LCP from Matrix Market files, and back.
 *
 * Entries that are given twice are refused: the format doesn't say which one counts.
 */
#ifndef MATRIX_MARKET_H
#define MATRIX_MARKET_H

#include "market_file.h"

/* Compressed sparse column, rows sorted within a column; release with market_free. */
typedef struct market_matrix {
    int32_t rows;
    int32_t columns;
    int32_t *column_starts;
    int32_t *row_indices;
    double *values;
} market_matrix;

/* Order of compressed columns; entries given twice come in the order of the file. */
static int market_compare(const void *left, const void *right)
{
    const market_entry *a = left, *b = right;
    if (a->column != b->column)
        return a->column < b->column ? -1 : 1;
    if (a->row != b->row)
        return a->row < b->row ? -1 : 1;
    return (a->line > b->line) - (a->line < b->line);
}

/* Sorts the entries and refuses those that are given twice. */
static bool market_sort(market_file *file)
{
    if (file->count > 0)
        qsort(file->entries, file->count, sizeof *file->entries, market_compare);
    for (size_t k = 1; k < file->count; k++) {
        const market_entry *a = &file->entries[k - 1], *b = &file->entries[k];
        if (a->column == b->column && a->row == b->row) {
            file->line = b->line;
            return market_fail(file, "entry (%d, %d) was already given in line %lld",
                               (int)b->row + 1, (int)b->column + 1, (long long)a->line);
        }
    }
    return true;
}

static void market_free(market_matrix *matrix)
{
    free(matrix->column_starts);
    free(matrix->row_indices);
    free(matrix->values);
    memset(matrix, 0, sizeof *matrix);
}

/* Sorted entries to compressed columns. */
static bool market_compress(market_file *file, market_matrix *matrix)
{
    file->line = 0;
    if (file->count > INT32_MAX)
        return market_fail(file, "too many entries");
    matrix->rows = file->rows;
    matrix->columns = file->columns;
    matrix->column_starts = calloc((size_t)file->columns + 1, sizeof *matrix->column_starts);
    matrix->row_indices = malloc((file->count + 1) * sizeof *matrix->row_indices);
    matrix->values = malloc((file->count + 1) * sizeof *matrix->values);
    if (!matrix->column_starts || !matrix->row_indices || !matrix->values)
        return market_fail(file, "not enough memory");
    for (size_t k = 0; k < file->count; k++) {
        matrix->column_starts[file->entries[k].column + 1]++;
        matrix->row_indices[k] = file->entries[k].row;
        matrix->values[k] = file->entries[k].value;
    }
    for (int32_t column = 0; column < file->columns; column++)
        matrix->column_starts[column + 1] += matrix->column_starts[column];
    return true;
}

/* Reads a matrix; prints what is wrong on stderr and returns false if that fails. */
static bool market_read_matrix(market_matrix *matrix, const char *path)
{
    market_file file;
    memset(matrix, 0, sizeof *matrix);
    bool good = market_read(&file, path, MARKET_FINITE) && market_sort(&file) &&
                market_compress(&file, matrix);
    if (!good)
        fprintf(stderr, "%s\n", file.message);
    free(file.entries);
    return good;
}

/* Reads a vector of the given length (one column; what a coordinate file leaves out is 0) into a
 * new array; prints what is wrong on stderr and returns NULL if that fails. */
static double *market_read_vector(const char *path, int32_t length, int infinities)
{
    market_file file;
    double *vector = NULL;
    bool good = market_read(&file, path, infinities) && market_sort(&file);
    file.line = 0;
    if (good && (file.rows != length || file.columns != 1))
        good = market_fail(&file, "is %d by %d, but the matrix asks for a vector of %d by 1",
                           file.rows, file.columns, (int)length);
    if (good && !(vector = calloc((size_t)length, sizeof *vector)))
        good = market_fail(&file, "not enough memory");
    for (size_t k = 0; good && k < file.count; k++)
        vector[file.entries[k].row] = file.entries[k].value;
    if (!good)
        fprintf(stderr, "%s\n", file.message);
    free(file.entries);
    return vector;
}

/* Writes a vector so that reading it again gives the same bits (mmio writes a digit less). */
static bool market_write_vector(const char *path, int32_t length, const double *vector)
{
    MM_typecode code;
    mm_initialize_typecode(&code);
    mm_set_matrix(&code);
    mm_set_array(&code);
    mm_set_real(&code);
    FILE *stream = fopen(path, "w");
    bool good = stream != NULL && mm_write_banner(stream, code) == 0 &&
                mm_write_mtx_array_size(stream, (int)length, 1) == 0;
    for (int32_t i = 0; good && i < length; i++)
        good = fprintf(stream, "%.17g\n", vector[i]) > 0;
    if (stream && fclose(stream) != 0)
        good = false;
    if (!good)
        fprintf(stderr, "%s: can't be written: %s\n", path, strerror(errno));
    return good;
}

#endif

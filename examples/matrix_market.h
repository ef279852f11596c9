/* matrix_market.h: reads Matrix Market files (https://math.nist.gov/MatrixMarket/formats.html).
 *
 * A small reader that can be copied together with solve_mtx.c. It accepts the coordinate and the
 * array format, real and integer numbers, general, symmetric and skew-symmetric matrices (the last
 * two are expanded), and says in which line of which file something is wrong. Refused: complex and
 * pattern files (a pattern has no values), Hermitian matrices, an entry that is given twice (the
 * format doesn't say which one counts), an entry above the diagonal of a symmetric matrix.
 */
#ifndef MATRIX_MARKET_H
#define MATRIX_MARKET_H

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Which infinities may stand in a file: none in a matrix, -inf in a lower bound, ... */
enum { MM_FINITE = 0, MM_MINUS_INFINITY = 1, MM_PLUS_INFINITY = 2 };

enum mm_symmetry { MM_GENERAL = 0, MM_SYMMETRIC = 1, MM_SKEW = -1 };

/* Compressed sparse column, rows sorted within a column; release with mm_free. */
typedef struct mm_matrix {
    int32_t rows;
    int32_t columns;
    int32_t *column_starts;
    int32_t *row_indices;
    double *values;
} mm_matrix;

typedef struct mm_entry {
    int32_t row;
    int32_t column;
    int64_t line;
    double value;
} mm_entry;

/* A file that is being read, and what has been read from it. */
typedef struct mm_file {
    FILE *stream;
    const char *path;
    int64_t line;
    int infinities;
    bool coordinate;
    enum mm_symmetry symmetry;
    int32_t rows;
    int32_t columns;
    mm_entry *entries;
    size_t count;
    size_t capacity;
    char text[1032]; /* the format allows lines of 1024 characters */
    char message[512];
} mm_file;

/* Writes "path:line: what is wrong" and returns false. */
static bool mm_fail(mm_file *file, const char *format, ...)
{
    int used = file->line > 0 ? snprintf(file->message, sizeof file->message,
                                         "%s:%lld: ", file->path, (long long)file->line)
                              : snprintf(file->message, sizeof file->message, "%s: ", file->path);
    if (used >= 0 && (size_t)used < sizeof file->message) {
        va_list arguments;
        va_start(arguments, format);
        vsnprintf(file->message + used, sizeof file->message - (size_t)used, format, arguments);
        va_end(arguments);
    }
    return false;
}

/* The next line that is not blank; false at the end of the file or after an error, which then
 * stands in file->message. */
static bool mm_next_line(mm_file *file)
{
    while (fgets(file->text, (int)sizeof file->text, file->stream)) {
        file->line++;
        size_t length = strlen(file->text);
        if (length + 1 == sizeof file->text && file->text[length - 1] != '\n')
            return mm_fail(file, "the line is longer than the 1024 characters of the format");
        if (file->text[strspn(file->text, " \t\r\n\v\f")] != '\0')
            return true;
    }
    if (ferror(file->stream))
        return mm_fail(file, "can't be read: %s", strerror(errno));
    return false;
}

/* Reads a whole number at *cursor and moves the cursor behind it. */
static bool mm_integer(const char **cursor, int64_t *number)
{
    char *end;
    errno = 0;
    long long value = strtoll(*cursor, &end, 10);
    if (end == *cursor || errno == ERANGE || !(isspace((unsigned char)*end) || *end == '\0'))
        return false;
    *cursor = end;
    *number = value;
    return true;
}

/* Reads the last field of a line: a number, "inf" or "-inf" where the file may hold them. */
static bool mm_value(mm_file *file, const char *cursor, double *number)
{
    char *end;
    errno = 0;
    double value = strtod(cursor, &end);
    size_t length = strcspn(cursor + strspn(cursor, " \t"), " \t\r\n");
    const char *word = cursor + strspn(cursor, " \t");
    if (end == cursor)
        return mm_fail(file, "expected a number, found '%.*s'", (int)length, word);
    if (end[strspn(end, " \t\r\n\v\f")] != '\0')
        return mm_fail(file, "the line goes on after the value");
    if (isnan(value))
        return mm_fail(file, "the value is not a number (NaN)");
    if (isinf(value) && errno == ERANGE)
        return mm_fail(file, "the value %.*s is too large for a double", (int)length, word);
    if (isinf(value) && !(file->infinities & (value < 0 ? MM_MINUS_INFINITY : MM_PLUS_INFINITY)))
        return mm_fail(file, "the value %.*s must not be infinite here", (int)length, word);
    *number = value;
    return true;
}

/* Line 1: %%MatrixMarket matrix <coordinate|array> <field> <symmetry>. */
static bool mm_read_banner(mm_file *file)
{
    char banner[16], object[16], format[16], field[16], symmetry[16];
    char *words[] = {object, format, field, symmetry};
    if (!mm_next_line(file))
        return file->message[0] ? false : mm_fail(file, "the file is empty");
    if (sscanf(file->text, "%15s %15s %15s %15s %15s", banner, object, format, field, symmetry) !=
            5 ||
        strcmp(banner, "%%MatrixMarket") != 0)
        return mm_fail(file, "not a Matrix Market file: the first line must read '%%%%MatrixMarket "
                             "matrix <format> <field> <symmetry>'");
    for (size_t k = 0; k < sizeof words / sizeof *words; k++)
        for (char *letter = words[k]; *letter; letter++)
            *letter = (char)tolower((unsigned char)*letter);
    if (strcmp(object, "matrix") != 0)
        return mm_fail(file, "holds a '%s', not a matrix", object);
    file->coordinate = strcmp(format, "coordinate") == 0;
    if (!file->coordinate && strcmp(format, "array") != 0)
        return mm_fail(file, "unknown format '%s' (coordinate or array)", format);
    if (strcmp(field, "real") != 0 && strcmp(field, "double") != 0 && strcmp(field, "integer") != 0)
        return mm_fail(file, "numbers of kind '%s' are not supported (real or integer)", field);
    file->symmetry = strcmp(symmetry, "symmetric") == 0        ? MM_SYMMETRIC
                     : strcmp(symmetry, "skew-symmetric") == 0 ? MM_SKEW
                                                               : MM_GENERAL;
    if (file->symmetry == MM_GENERAL && strcmp(symmetry, "general") != 0)
        return mm_fail(file, "symmetry '%s' is not supported", symmetry);
    return true;
}

/* Comments, then "rows columns entries" (coordinate) or "rows columns" (array). */
static bool mm_read_sizes(mm_file *file, int64_t *announced)
{
    int64_t rows, columns;
    do {
        if (!mm_next_line(file))
            return file->message[0] ? false : mm_fail(file, "ends before the line of sizes");
    } while (file->text[0] == '%');
    const char *cursor = file->text;
    *announced = 0;
    if (!mm_integer(&cursor, &rows) || !mm_integer(&cursor, &columns) ||
        (file->coordinate && !mm_integer(&cursor, announced)) ||
        cursor[strspn(cursor, " \t\r\n\v\f")] != '\0')
        return mm_fail(file, "expected the sizes '%s'",
                       file->coordinate ? "rows columns entries" : "rows columns");
    if (rows < 1 || columns < 1 || rows > INT32_MAX - 1 || columns > INT32_MAX - 1)
        return mm_fail(file, "%lld by %lld is not a size that can be handled", (long long)rows,
                       (long long)columns);
    if (*announced < 0 || *announced > INT32_MAX)
        return mm_fail(file, "%lld is not a number of entries that can be handled",
                       (long long)*announced);
    file->rows = (int32_t)rows;
    file->columns = (int32_t)columns;
    if (file->symmetry != MM_GENERAL && rows != columns)
        return mm_fail(file, "a symmetric matrix must be square, not %lld by %lld", (long long)rows,
                       (long long)columns);
    return true;
}

/* Keeps an entry, and its mirror image in a symmetric file. */
static bool mm_keep(mm_file *file, int32_t row, int32_t column, double value)
{
    if (file->count + 2 > file->capacity) {
        size_t capacity = file->capacity ? 2 * file->capacity : 1024;
        mm_entry *entries = realloc(file->entries, capacity * sizeof *entries);
        if (!entries)
            return mm_fail(file, "not enough memory");
        file->entries = entries;
        file->capacity = capacity;
    }
    file->entries[file->count++] = (mm_entry){row, column, file->line, value};
    if (file->symmetry != MM_GENERAL && row != column)
        file->entries[file->count++] =
            (mm_entry){column, row, file->line, file->symmetry == MM_SKEW ? -value : value};
    return true;
}

/* One line "row column value", counted from 1. */
static bool mm_read_coordinate_line(mm_file *file)
{
    int64_t row, column;
    double value;
    const char *cursor = file->text;
    if (!mm_integer(&cursor, &row) || !mm_integer(&cursor, &column))
        return mm_fail(file, "expected 'row column value'");
    if (row < 1 || row > file->rows || column < 1 || column > file->columns)
        return mm_fail(file, "entry (%lld, %lld) lies outside of the %d by %d matrix",
                       (long long)row, (long long)column, (int)file->rows, (int)file->columns);
    if (file->symmetry != MM_GENERAL && row < column)
        return mm_fail(file, "entry (%lld, %lld) lies above the diagonal of a symmetric matrix",
                       (long long)row, (long long)column);
    if (file->symmetry == MM_SKEW && row == column)
        return mm_fail(file, "entry (%lld, %lld) lies on the diagonal of a skew-symmetric matrix",
                       (long long)row, (long long)column);
    return mm_value(file, cursor, &value) &&
           mm_keep(file, (int32_t)(row - 1), (int32_t)(column - 1), value);
}

static bool mm_read_coordinate(mm_file *file, int64_t announced)
{
    for (int64_t k = 0; k < announced; k++) {
        if (!mm_next_line(file))
            return file->message[0] ? false
                                    : mm_fail(file, "truncated: ends after %lld of %lld entries",
                                              (long long)k, (long long)announced);
        if (!mm_read_coordinate_line(file))
            return false;
    }
    return true;
}

/* Column by column, one value a line; of a symmetric matrix the lower triangle. */
static bool mm_read_array(mm_file *file)
{
    for (int32_t column = 0; column < file->columns; column++) {
        int32_t first = file->symmetry == MM_GENERAL     ? 0
                        : file->symmetry == MM_SYMMETRIC ? column
                                                         : column + 1;
        for (int32_t row = first; row < file->rows; row++) {
            double value;
            if (!mm_next_line(file))
                return file->message[0] ? false
                                        : mm_fail(file, "truncated: ends before entry (%d, %d)",
                                                  (int)row + 1, (int)column + 1);
            if (!mm_value(file, file->text, &value))
                return false;
            if (value != 0 && !mm_keep(file, row, column, value))
                return false;
        }
    }
    return true;
}

/* Reads the whole file into file->entries. */
static bool mm_read(mm_file *file, const char *path, int infinities)
{
    int64_t announced;
    memset(file, 0, sizeof *file);
    file->path = path;
    file->infinities = infinities;
    file->stream = fopen(path, "r");
    if (!file->stream)
        return mm_fail(file, "can't be opened: %s", strerror(errno));
    bool good = mm_read_banner(file) && mm_read_sizes(file, &announced) &&
                (file->coordinate ? mm_read_coordinate(file, announced) : mm_read_array(file));
    if (good && mm_next_line(file))
        good = mm_fail(file, "the file goes on after its last entry");
    good = good && file->message[0] == '\0';
    fclose(file->stream);
    return good;
}

/* Order of compressed columns; entries given twice come in the order of the file. */
static int mm_compare(const void *left, const void *right)
{
    const mm_entry *a = left, *b = right;
    if (a->column != b->column)
        return a->column < b->column ? -1 : 1;
    if (a->row != b->row)
        return a->row < b->row ? -1 : 1;
    return (a->line > b->line) - (a->line < b->line);
}

/* Sorts the entries and refuses those that are given twice. */
static bool mm_sort(mm_file *file)
{
    if (file->count > 0)
        qsort(file->entries, file->count, sizeof *file->entries, mm_compare);
    for (size_t k = 1; k < file->count; k++) {
        const mm_entry *a = &file->entries[k - 1], *b = &file->entries[k];
        if (a->column == b->column && a->row == b->row) {
            file->line = b->line;
            return mm_fail(file, "entry (%d, %d) was already given in line %lld", (int)b->row + 1,
                           (int)b->column + 1, (long long)a->line);
        }
    }
    return true;
}

static void mm_free(mm_matrix *matrix)
{
    free(matrix->column_starts);
    free(matrix->row_indices);
    free(matrix->values);
    memset(matrix, 0, sizeof *matrix);
}

/* Sorted entries to compressed columns. */
static bool mm_compress(mm_file *file, mm_matrix *matrix)
{
    if (file->count > INT32_MAX)
        return mm_fail(file, "too many entries");
    matrix->rows = file->rows;
    matrix->columns = file->columns;
    matrix->column_starts = calloc((size_t)file->columns + 1, sizeof *matrix->column_starts);
    matrix->row_indices = malloc((file->count + 1) * sizeof *matrix->row_indices);
    matrix->values = malloc((file->count + 1) * sizeof *matrix->values);
    if (!matrix->column_starts || !matrix->row_indices || !matrix->values)
        return mm_fail(file, "not enough memory");
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
static bool mm_read_matrix(mm_matrix *matrix, const char *path)
{
    mm_file file;
    memset(matrix, 0, sizeof *matrix);
    bool good = mm_read(&file, path, MM_FINITE) && mm_sort(&file) && mm_compress(&file, matrix);
    if (!good)
        fprintf(stderr, "%s\n", file.message);
    free(file.entries);
    return good;
}

/* Reads a vector of the given length (one column; what a coordinate file leaves out is 0) into a
 * new array; prints what is wrong on stderr and returns NULL if that fails. */
static double *mm_read_vector(const char *path, int32_t length, int infinities)
{
    mm_file file;
    double *vector = NULL;
    bool good = mm_read(&file, path, infinities) && mm_sort(&file);
    if (good && (file.rows != length || file.columns != 1)) {
        file.line = 0;
        good = mm_fail(&file, "is %d by %d, but the matrix asks for a vector of %d by 1",
                       (int)file.rows, (int)file.columns, (int)length);
    }
    if (good && !(vector = calloc((size_t)length, sizeof *vector)))
        good = mm_fail(&file, "not enough memory");
    for (size_t k = 0; good && k < file.count; k++)
        vector[file.entries[k].row] = file.entries[k].value;
    if (!good)
        fprintf(stderr, "%s\n", file.message);
    free(file.entries);
    return vector;
}

/* Writes a vector so that reading it again gives the same bits. */
static bool mm_write_vector(const char *path, int32_t length, const double *vector)
{
    FILE *stream = fopen(path, "w");
    bool good = stream != NULL;
    if (good)
        fprintf(stream, "%%%%MatrixMarket matrix array real general\n%d 1\n", (int)length);
    for (int32_t i = 0; good && i < length; i++)
        good = fprintf(stream, "%.17g\n", vector[i]) > 0;
    if (stream && fclose(stream) != 0)
        good = false;
    if (!good)
        fprintf(stderr, "%s: can't be written: %s\n", path, strerror(errno));
    return good;
}

#endif

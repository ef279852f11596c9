/* market_file.h: the entries of a Matrix Market file
 * (https://math.nist.gov/MatrixMarket/formats.html), checked.
 *
 * mmio, the format's own library, reads them: banner, sizes and entries. Here is what it leaves to
 * its user: which line of which file is wrong, and why; indices out of range; infinities and NaN;
 * files that end too early or go on; symmetric matrices expanded. Read are the coordinate and the
 * array format, real and integer numbers, general, symmetric and skew-symmetric matrices.
 *
 * mmio gets one line at a time, as a stream of its own: it doesn't tell how far it has read, and on
 * a line of sizes without sizes in it would read the same letter for ever. It also trusts the
 * length of words and of integers, so that these are looked at first.
 *
 * Needs fmemopen: define _POSIX_C_SOURCE as 200809L before the first #include.
 */
#ifndef MARKET_FILE_H
#define MARKET_FILE_H

#include "third_party/mmio.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Which infinities may stand in a file: none in a matrix, -inf in a lower bound, ... */
enum { MARKET_FINITE = 0, MARKET_MINUS_INFINITY = 1, MARKET_PLUS_INFINITY = 2 };

#define MARKET_SPACE " \t\r\n\v\f"

typedef struct market_entry {
    int32_t row;
    int32_t column;
    int64_t line;
    double value;
} market_entry;

/* A file that is being read, and what has been read from it. */
typedef struct market_file {
    FILE *stream;
    const char *path;
    int64_t line;
    int infinities;
    MM_typecode code;
    int rows;
    int columns;
    int announced; /* entries of a coordinate file */
    market_entry *entries;
    size_t count;
    size_t capacity;
    char text[MM_MAX_LINE_LENGTH + 1]; /* the format allows lines of 1024 characters */
    char message[512];
} market_file;

/* Writes "path:line: what is wrong" and returns false. */
static bool market_fail(market_file *file, const char *format, ...)
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

/* The next line that is not blank, without the spaces at its end; false at the end of the file or
 * after an error, which then stands in file->message. */
static bool market_next_line(market_file *file)
{
    while (fgets(file->text, (int)sizeof file->text, file->stream)) {
        file->line++;
        size_t length = strlen(file->text);
        if ((length == 0 || file->text[length - 1] != '\n') && !feof(file->stream))
            return market_fail(file, "the line is longer than the 1024 characters of the format, "
                                     "or this is not a text");
        while (length > 0 && strchr(MARKET_SPACE, file->text[length - 1]))
            file->text[--length] = '\0';
        if (length > 0)
            return true;
    }
    if (ferror(file->stream))
        return market_fail(file, "can't be read: %s", strerror(errno));
    return false;
}

/* The text as the stream that mmio reads from; NULL if memory is short. */
static FILE *market_stream(market_file *file, char *text)
{
    FILE *stream = fmemopen(text, strlen(text), "r");
    if (!stream)
        market_fail(file, "can't be read: %s", strerror(errno));
    return stream;
}

/* The word at *cursor and its length, 0 behind the last one; moves the cursor behind it. */
static const char *market_word(const char **cursor, size_t *length)
{
    const char *word = *cursor + strspn(*cursor, MARKET_SPACE);
    *length = strcspn(word, MARKET_SPACE);
    *cursor = word + *length;
    return word;
}

/* The number of words in the line at hand; 0 if one of the first `integers` is no integer of at
 * most 9 characters, which an int surely holds. */
static int market_words(const market_file *file, int integers)
{
    const char *cursor = file->text;
    size_t length;
    int count = 0;
    for (const char *word = market_word(&cursor, &length); length > 0;
         word = market_word(&cursor, &length)) {
        size_t sign = *word == '-' || *word == '+';
        if (count < integers &&
            (length > 9 || length == sign || strspn(word + sign, "0123456789") != length - sign))
            return 0;
        count++;
    }
    return count;
}

/* Says what is wrong with a banner that mmio refuses. */
static bool market_refuse_banner(market_file *file, int error)
{
    if (error != MM_UNSUPPORTED_TYPE)
        return market_fail(file,
                           "not a Matrix Market file: the first line must read '"
                           "%s matrix <format> <field> <symmetry>'",
                           MatrixMarketBanner);
    /* mmio fills in the code from the left and stops at what it doesn't know */
    if (!mm_is_matrix(file->code))
        return market_fail(file, "holds something else than a matrix");
    if (!mm_is_coordinate(file->code) && !mm_is_array(file->code))
        return market_fail(file, "unknown format (coordinate or array)");
    if (file->code[2] == ' ')
        return market_fail(file, "unknown kind of numbers (real or integer)");
    return market_fail(file, "unknown symmetry (general, symmetric or skew-symmetric)");
}

/* Line 1: %%MatrixMarket matrix <coordinate|array> <field> <symmetry>. */
static bool market_read_banner(market_file *file)
{
    if (!market_next_line(file))
        return file->message[0] ? false : market_fail(file, "the file is empty");
    const char *cursor = file->text;
    size_t length;
    do {
        market_word(&cursor, &length);
        if (length >= MM_MAX_TOKEN_LENGTH)
            return market_refuse_banner(file, MM_NO_HEADER);
    } while (length > 0);

    FILE *stream = market_stream(file, file->text);
    if (!stream)
        return false;
    int error = mm_read_banner(stream, &file->code);
    fclose(stream);
    if (error != 0)
        return market_refuse_banner(file, error);
    if (mm_is_complex(file->code) || mm_is_pattern(file->code))
        return market_fail(file, "numbers of kind '%s' are not supported (real or integer)",
                           mm_is_complex(file->code) ? MM_COMPLEX_STR : MM_PATTERN_STR);
    if (mm_is_hermitian(file->code))
        return market_fail(file, "symmetry '%s' is not supported", MM_HERM_STR);
    mm_set_real(&file->code); /* mmio reads no entries of integer files */
    return true;
}

/* Comments, then "rows columns entries" (coordinate) or "rows columns" (array). */
static bool market_read_sizes(market_file *file)
{
    do {
        if (!market_next_line(file))
            return file->message[0] ? false : market_fail(file, "ends before the line of sizes");
    } while (file->text[0] == '%');

    bool coordinate = mm_is_coordinate(file->code);
    int numbers = coordinate ? 3 : 2;
    bool good = market_words(file, numbers) == numbers;
    if (good) {
        FILE *stream = market_stream(file, file->text);
        if (!stream)
            return false;
        good = (coordinate
                    ? mm_read_mtx_crd_size(stream, &file->rows, &file->columns, &file->announced)
                    : mm_read_mtx_array_size(stream, &file->rows, &file->columns)) == 0;
        fclose(stream);
    }
    if (!good)
        return market_fail(file, "expected the sizes '%s', of at most 9 digits",
                           coordinate ? "rows columns entries" : "rows columns");
    if (file->rows < 1 || file->columns < 1 || file->announced < 0)
        return market_fail(file, "%d by %d with %d entries is not a size that can be handled",
                           file->rows, file->columns, file->announced);
    if (!mm_is_general(file->code) && file->rows != file->columns)
        return market_fail(file, "a symmetric matrix must be square, not %d by %d", file->rows,
                           file->columns);
    return true;
}

/* Keeps an entry, counted from 1, and its mirror image in a symmetric file. */
static bool market_keep(market_file *file, int row, int column, double value)
{
    if (file->count + 2 > file->capacity) {
        size_t capacity = file->capacity ? 2 * file->capacity : 1024;
        market_entry *entries = realloc(file->entries, capacity * sizeof *entries);
        if (!entries)
            return market_fail(file, "not enough memory");
        file->entries = entries;
        file->capacity = capacity;
    }
    file->entries[file->count++] = (market_entry){row - 1, column - 1, file->line, value};
    if (!mm_is_general(file->code) && row != column)
        file->entries[file->count++] = (market_entry){column - 1, row - 1, file->line,
                                                      mm_is_skew(file->code) ? -value : value};
    return true;
}

/* Refuses NaN, and infinities where the file may not hold them. */
static bool market_check_value(market_file *file, double value)
{
    const char *cursor = file->text, *word = cursor;
    size_t length = 1;
    while (*cursor) /* to the last word */
        word = market_word(&cursor, &length);
    if (isnan(value))
        return market_fail(file, "the value is not a number (NaN)");
    if (isinf(value) && !strpbrk(word, "nN")) /* as in inf */
        return market_fail(file, "the value %.60s is too large for a double", word);
    if (isinf(value) &&
        !(file->infinities & (value < 0 ? MARKET_MINUS_INFINITY : MARKET_PLUS_INFINITY)))
        return market_fail(file, "the value %.60s must not be infinite here", word);
    return true;
}

/* The line at hand: "row column value", counted from 1, or in an array, where the place is known,
 * "value". mmio reads entries of the first form alone, so the second is made into it. */
static bool market_read_entry(market_file *file, int *row, int *column, double *value)
{
    char entry[sizeof file->text + 32];
    bool coordinate = mm_is_coordinate(file->code);
    int expected = coordinate ? 3 : 1;
    int words = market_words(file, coordinate ? 2 : 0);
    if (words > expected)
        return market_fail(file, "the line goes on after the value");
    bool good = words == expected;
    if (good) {
        if (coordinate)
            snprintf(entry, sizeof entry, "%s", file->text);
        else
            snprintf(entry, sizeof entry, "%d %d %s", *row, *column, file->text);
        FILE *stream = market_stream(file, entry);
        if (!stream)
            return false;
        good = mm_read_mtx_crd_entry(stream, row, column, value, NULL, file->code) == 0 &&
               fgetc(stream) == EOF;
        fclose(stream);
        /* some C libraries read 1e, which a file was cut at, as 1 */
        good = good && !strchr("eEpP+-", file->text[strlen(file->text) - 1]);
    }
    if (!good)
        return market_fail(file, "expected '%s', found '%.60s'",
                           coordinate ? "row column value" : "value", file->text);
    return market_check_value(file, *value);
}

static bool market_read_coordinate(market_file *file)
{
    for (int k = 0; k < file->announced; k++) {
        int row, column;
        double value;
        if (!market_next_line(file))
            return file->message[0] ? false
                                    : market_fail(file, "truncated: ends after %d of %d entries", k,
                                                  file->announced);
        if (!market_read_entry(file, &row, &column, &value))
            return false;
        if (row < 1 || row > file->rows || column < 1 || column > file->columns)
            return market_fail(file, "entry (%d, %d) lies outside of the %d by %d matrix", row,
                               column, file->rows, file->columns);
        if (!mm_is_general(file->code) && row < column)
            return market_fail(file, "entry (%d, %d) lies above the diagonal of a symmetric matrix",
                               row, column);
        if (mm_is_skew(file->code) && row == column)
            return market_fail(file,
                               "entry (%d, %d) lies on the diagonal of a skew-symmetric matrix",
                               row, column);
        if (!market_keep(file, row, column, value))
            return false;
    }
    return true;
}

/* Column by column, one value a line; of a symmetric matrix the lower triangle. */
static bool market_read_array(market_file *file)
{
    for (int column = 1; column <= file->columns; column++) {
        int first = mm_is_general(file->code)     ? 1
                    : mm_is_symmetric(file->code) ? column
                                                  : column + 1;
        for (int row = first; row <= file->rows; row++) {
            double value;
            if (!market_next_line(file))
                return file->message[0] ? false
                                        : market_fail(file, "truncated: ends before entry (%d, %d)",
                                                      row, column);
            if (!market_read_entry(file, &row, &column, &value) ||
                (value != 0 && !market_keep(file, row, column, value)))
                return false;
        }
    }
    return true;
}

/* Reads the whole file into file->entries; the caller frees them. */
static bool market_read(market_file *file, const char *path, int infinities)
{
    memset(file, 0, sizeof *file);
    file->path = path;
    file->infinities = infinities;
    file->stream = fopen(path, "r");
    if (!file->stream)
        return market_fail(file, "can't be opened: %s", strerror(errno));
    bool good =
        market_read_banner(file) && market_read_sizes(file) &&
        (mm_is_coordinate(file->code) ? market_read_coordinate(file) : market_read_array(file));
    if (good && market_next_line(file))
        good = market_fail(file, "the file goes on after its last entry");
    good = good && file->message[0] == '\0';
    fclose(file->stream);
    return good;
}

#endif

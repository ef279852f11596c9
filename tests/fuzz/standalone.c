/* libFuzzer's main for machines without it: runs the files and the files of the folders given. */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "fuzz.h"

static int run_file(const char *name)
{
    static uint8_t data[65536];
    FILE *file = fopen(name, "rb");
    uint8_t *copy;
    size_t size;

    if (!file) {
        perror(name);
        return 1;
    }
    size = fread(data, 1, sizeof data, file);
    fclose(file);
    copy = malloc(size > 0 ? size : 1); /* of its size: a sanitizer sees who reads past it */
    if (!copy)
        return 1;
    for (size_t i = 0; i < size; i++)
        copy[i] = data[i];
    fprintf(stderr, "%s\n", name);
    LLVMFuzzerTestOneInput(copy, size);
    free(copy);
    return 0;
}

static int run_folder(const char *folder)
{
    DIR *list = opendir(folder);
    struct dirent *entry;
    char name[4096];
    int failed = 0;

    if (!list)
        return run_file(folder);
    while ((entry = readdir(list)))
        if (entry->d_name[0] != '.') {
            snprintf(name, sizeof name, "%s/%s", folder, entry->d_name);
            failed |= run_file(name);
        }
    closedir(list);
    return failed;
}

int main(int count, char **names)
{
    int failed = 0, k;

    for (k = 1; k < count; k++)
        failed |= run_folder(names[k]);
    return failed;
}

/*
 * Inspects and damages a journal, without the farm's own code:
 *
 *   faults_journal count FILE        prints how many complete records it holds
 *   faults_journal tear FILE NUMBER  truncates it at a place that depends on the number
 *   faults_journal flip FILE NUMBER  flips a bit there; both print how many records remain complete
 */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FILE_HEADER   24
#define RECORD_HEADER 64
#define BYTES_AT      56 /* offset in a record's header of the payload's length */

/* The number of complete records before the end, without the one in which a byte is changed; turned: its place,
 * -1: none. */
static unsigned count_records(FILE *file, long end, long turned)
{
    unsigned count = 0;
    for (long at = FILE_HEADER; at + RECORD_HEADER <= end;) {
        uint64_t bytes = 0;
        if (fseek(file, at + BYTES_AT, SEEK_SET) || fread(&bytes, sizeof bytes, 1, file) != 1)
            break;
        if (bytes > (uint64_t)(end - at - RECORD_HEADER)) break;
        long next = at + RECORD_HEADER + (long)bytes;
        count += !(at <= turned && turned < next);
        at = next;
    }
    return count;
}

static int turn_bit(FILE *file, long at, unsigned bit)
{
    if (fseek(file, at, SEEK_SET)) return 1;
    int byte = fgetc(file);
    return byte == EOF || fseek(file, at, SEEK_SET) || fputc(byte ^ (1 << bit), file) == EOF;
}

static bool is_known(const char *what)
{
    return strcmp(what, "count") == 0 || strcmp(what, "tear") == 0 || strcmp(what, "flip") == 0;
}

int main(int argc, char **argv)
{
    FILE *file = argc >= 3 && is_known(argv[1]) ? fopen(argv[2], "r+b") : NULL;
    if (!file || fseek(file, 0, SEEK_END)) {
        fprintf(stderr, "usage: faults_journal count|tear|flip FILE [NUMBER]\n");
        return 2;
    }
    long size = ftell(file);
    unsigned long number = argc > 3 ? strtoul(argv[3], NULL, 10) : 0;
    bool damages = strcmp(argv[1], "count") != 0 && size > FILE_HEADER;
    bool tears = strcmp(argv[1], "tear") == 0;
    long place = damages ? FILE_HEADER + (long)(number % (unsigned long)(size - FILE_HEADER)) : -1;
    printf("%u\n", count_records(file, tears ? place : size, place));
    if (!damages) return 0;
    int failed =
        tears ? ftruncate(fileno(file), place) : turn_bit(file, place, (unsigned)(number / 7 % 8));
    return fclose(file) || failed;
}

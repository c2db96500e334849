/* Maps names to numbers: a hash table from which nothing can be removed. */
#ifndef FARM_MASTER_NAME_TABLE_H
#define FARM_MASTER_NAME_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct name_entry {
    char *name; /* owned; NULL: the entry is free */
    uint32_t value;
};

/* All zero: an empty table. */
struct name_table {
    struct name_entry *entries;
    size_t count, room; /* room is 0 or a power of two */
};

/* Sets the value of a name, which is copied if it is new. */
void name_table_set(struct name_table *table, const char *name, uint32_t value);

/* Stores the value of a name in *value; false, with *value left as it is, if it has none. */
bool name_table_find(const struct name_table *table, const char *name, uint32_t *value);

void name_table_free(struct name_table *table);

#endif

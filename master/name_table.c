#include "master/name_table.h"

#include <stdlib.h>
#include <string.h>

#include "common/hash.h"
#include "common/message.h"

/* The entry of this name, or the free one where it is to be put; at least one entry must be free. */
static struct name_entry *place_of_name(const struct name_table *table, const char *name)
{
    size_t at = (size_t)hash64(name, strlen(name), 0) & (table->room - 1);
    while (table->entries[at].name && strcmp(table->entries[at].name, name) != 0)
        at = (at + 1) & (table->room - 1);
    return &table->entries[at];
}

static void enlarge(struct name_table *table)
{
    struct name_table larger = {.count = table->count, .room = table->room ? 2 * table->room : 16};
    larger.entries = allocate_zeroed(larger.room, sizeof *larger.entries);
    for (size_t i = 0; i < table->room; i++)
        if (table->entries[i].name)
            *place_of_name(&larger, table->entries[i].name) = table->entries[i];
    free(table->entries);
    *table = larger;
}

void name_table_set(struct name_table *table, const char *name, uint32_t value)
{
    /* At most half full, so that searches stay short. */
    if (2 * table->count >= table->room) enlarge(table);
    struct name_entry *entry = place_of_name(table, name);
    if (!entry->name) {
        entry->name = copy_text(name);
        table->count++;
    }
    entry->value = value;
}

bool name_table_find(const struct name_table *table, const char *name, uint32_t *value)
{
    if (!table->room) return false;
    const struct name_entry *entry = place_of_name(table, name);
    if (entry->name) *value = entry->value;
    return entry->name != NULL;
}

void name_table_free(struct name_table *table)
{
    for (size_t i = 0; i < table->room; i++)
        free(table->entries[i].name);
    free(table->entries);
    *table = (struct name_table){0};
}

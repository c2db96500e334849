/* Makes an empty struct arrivals (common/tray.h) for a farm of `ranks` ranks. The caller frees it. */
#ifndef FARM_TEST_ARRIVALS_FIXTURE_H
#define FARM_TEST_ARRIVALS_FIXTURE_H

#include <stdlib.h>

#include "common/tray.h"

static inline struct arrivals *arrivals_create(uint32_t ranks)
{
    size_t bytes = sizeof(struct arrivals) + arrivals_words(ranks) * sizeof(uint64_t);
    struct arrivals *arrivals = aligned_alloc(_Alignof(struct arrivals), TRAY_ROW(bytes));
    arrivals_init(arrivals, ranks);
    return arrivals;
}

#endif

/* The colours of ranks in output.ranks and its legend. */
#ifndef FARM_MASTER_RANK_COLORS_H
#define FARM_MASTER_RANK_COLORS_H

#include <stdint.h>

/*
 * Sets the colours of so many ranks, as they are in a PNG. Each is as different from all before it as can be, so the
 * first few are as far apart as colours can be, and the first colours do not depend on count. None is dark or nearly
 * grey: black, greys and white are something else in that picture. Beyond 3335 ranks colours are repeated.
 */
void rank_colors(uint32_t count, float (*rgb)[3]);

#endif

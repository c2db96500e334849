/* How well errors are told of things that few samples meet: fields of discs, needles and hairs, without any rays. */
#ifndef FARM_BENCH_ERROR_FIELDS_H
#define FARM_BENCH_ERROR_FIELDS_H

#include <stdint.h>

/* Samples so many fields adaptively to FIELD_TARGETS errors each and prints, as Markdown: what the true errors were of
 * those told behind passes, by how much of these is hidden; and how often an interval of a run did not hold, as it is
 * and with other bounds of what is hidden (HIDDEN_LEAST, HIDDEN_MOST). */
#define FIELD_TARGETS 6
void fields_measure(uint32_t count);

#endif

/* How well errors are estimated for things that few samples hit: fields of discs, needles and hairs, without any
 * rays. */
#ifndef FARM_BENCH_ERROR_FIELDS_H
#define FARM_BENCH_ERROR_FIELDS_H

#include <stdint.h>

/* Samples so many fields adaptively, to several target errors each, and prints as Markdown: the ratio of true errors to
 * those estimated after passes, by how much of these is hidden; and how often a confidence interval of a run did not
 * contain the error, with the bounds on what is hidden as they are (HIDDEN_LEAST, HIDDEN_MOST) and with others. */
void fields_measure(uint32_t count);

#endif

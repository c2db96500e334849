/* The models that the sample scenes use. Each function writes its OBJ files into an existing folder, and reports errors
 * on stderr. */
#ifndef FARM_CONFIG_MODELS_MODELS_H
#define FARM_CONFIG_MODELS_MODELS_H

#include <stdbool.h>

bool write_lantern(const char *folder);
bool write_garden(const char *folder);

#endif

#include "common/build.h"

#include "common/protocol.h"

#ifndef FARM_SOURCES
#define FARM_SOURCES "0" /* for tools that only parse this file: the Makefile defines it */
#endif

const char farm_build[] = FARM_VERSION "-" FARM_SOURCES;

_Static_assert(sizeof farm_build <= sizeof((struct welcome *)0)->build, "it is sent in there");

/*
 * Which farm this is. Between releases the messages and the pictures' last bits change under one version
 * number, so that ranks tell each other's sources apart.
 */
#ifndef FARM_COMMON_BUILD_H
#define FARM_COMMON_BUILD_H

/* The version, and the checksum (cksum) of all sources of the program: the same for any compiler. Fits
 * into struct welcome (common/protocol.h). */
extern const char farm_build[];

#endif

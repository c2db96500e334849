/*
 * Identifies the build of the program. Between releases, the messages and the last bits of pictures change
 * under one version number, so ranks compare a checksum of their sources as well.
 */
#ifndef FARM_COMMON_BUILD_H
#define FARM_COMMON_BUILD_H

/*
 * The version and the checksum (cksum) of all sources of the program; it does not depend on the compiler.
 * Fits into struct welcome (common/protocol.h).
 */
extern const char farm_build[];

#endif
